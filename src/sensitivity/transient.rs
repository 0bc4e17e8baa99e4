//! The seam to the optimization wing: a mechanism's outputs as responses.

use super::direct::differentiate;
use crate::Result;
use crate::analysis::{Dynamics, simulate};
use crate::multibody::Model;
use crate::problem::{Analysis, Instant, Responses};
use nalgebra::DMatrix;

/// The outputs of a mechanism over one time grid, as responses of an optimization problem.
///
/// Response h is the mechanism's output h, time-dependent, on the grid `times`. Sensitivities are direct; nothing
/// is integrated beyond the last wanted time.
pub struct Transient<M> {
    model: M,
    settings: Dynamics,
    times: Vec<f64>,
}

impl<M: Model> Transient<M> {
    /// For the outputs of `model` at `times` (s, increasing).
    ///
    /// **Errors.** [`crate::Error::Option`] or [`crate::Error::Definition`] if a setting or the times are impossible.
    pub fn new(model: M, settings: Dynamics, times: &[f64]) -> Result<Self> {
        settings.check(times)?;
        Ok(Self { model, settings, times: times.to_vec() })
    }

    /// The model.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// The analysis' settings.
    pub fn settings(&self) -> &Dynamics {
        &self.settings
    }
}

impl<M: Model> Analysis for Transient<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mechanism = self.model.build(b)?;
        Ok(Responses::new(simulate(&mechanism, &self.settings, &self.times)?.values))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        let mut points: Vec<usize> = wanted.iter().map(|instant| instant.point).collect();
        points.sort_unstable();
        points.dedup();
        let times: Vec<f64> = points.iter().map(|&p| self.times[p]).collect();
        let history = differentiate(&self.model, b, &self.settings, &times)?;
        let row = |instant: &Instant| {
            let at = points.binary_search(&instant.point).expect("every wanted point was simulated");
            history.slopes[instant.response][at].iter().copied()
        };
        Ok(DMatrix::from_row_iterator(wanted.len(), b.len(), wanted.iter().flat_map(row)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::mechanisms::FourBar;

    #[test]
    fn wanted_instants_come_in_the_order_asked() {
        let model = FourBar::as_published();
        let analysis = Transient::new(model, model.dynamics().unwrap(), &FourBar::window()).unwrap();
        let b = [0.0385, 0.0252, 0.02];
        let responses = analysis.analyze(&b).unwrap();
        let wanted = [(2, 17), (20, 3), (2, 16)].map(|(response, point)| Instant { response, point });
        let rows = analysis.sensitivities(&b, &responses, &wanted).unwrap();
        let all = differentiate(&model, &b, analysis.settings(), &FourBar::window()).unwrap();
        for (k, instant) in wanted.iter().enumerate() {
            assert_eq!(rows.row(k).iter().copied().collect::<Vec<_>>(), all.slopes[instant.response][instant.point]);
        }
    }
}
