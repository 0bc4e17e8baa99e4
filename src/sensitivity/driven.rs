//! The outputs of a driven mechanism as responses of an optimization problem: no integration.

use super::instant::differentiate_kinematics;
use super::semi_analytical::{self, difference_kinematics};
use crate::Result;
use crate::analysis::dynamics::check_times;
use crate::analysis::kinematics::kinematics;
use crate::analysis::start::Assembly;
use crate::multibody::Model;
use crate::problem::{Alternative, Analysis, Instant, Responses};
use nalgebra::DMatrix;

/// The outputs of a mechanism whose every degree of freedom is driven, at given times: positions, velocities,
/// accelerations, reactions and driving efforts, each instant assembled by itself.
///
/// Response h is the mechanism's output h, time-dependent, on the grid `times`. Sensitivities are direct.
pub struct Driven<M> {
    model: M,
    assembly: Assembly,
    times: Vec<f64>,
}

impl<M: Model> Driven<M> {
    /// For the outputs of `model` at `times` (s, increasing).
    ///
    /// **Errors.** [`crate::Error::Definition`] if times do not increase.
    pub fn new(model: M, assembly: Assembly, times: &[f64]) -> Result<Self> {
        check_times(f64::NEG_INFINITY, times)?;
        Ok(Self { model, assembly, times: times.to_vec() })
    }
}

impl<M: Model> Analysis for Driven<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        Ok(Responses::new(kinematics(&self.model.build(b)?, self.assembly, &self.times)?))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        // From the first time on, as the analysis: the branch is that of the motion and not that of the wanted instants.
        let count = wanted.iter().map(|instant| instant.point + 1).max().unwrap_or(0);
        let history = differentiate_kinematics(&self.model, b, self.assembly, &self.times[..count])?;
        let row = |instant: &Instant| history.slopes[instant.response][instant.point].iter().copied();
        Ok(DMatrix::from_row_iterator(wanted.len(), b.len(), wanted.iter().flat_map(row)))
    }

    fn alternatives(&self) -> Vec<Alternative<'_>> {
        let semi = |step: f64, b: &[f64], _: &Responses, wanted: &[Instant]| {
            let count = wanted.iter().map(|instant| instant.point + 1).max().unwrap_or(0);
            let history = difference_kinematics(&self.model, b, self.assembly, &self.times[..count], step)?;
            Ok(history.rows(b.len(), wanted, |instant| instant.point))
        };
        vec![Alternative::of("direct", self), Alternative::approximate("semi-analytical", semi_analytical::STEP, semi)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::mechanisms::SliderCrank;

    #[test]
    fn wanted_instants_come_in_the_order_asked() {
        let times: Vec<f64> = (0..10).map(|k| 0.05 * f64::from(k)).collect();
        let analysis = Driven::new(SliderCrank::rigid(), Assembly::default(), &times).unwrap();
        let b = SliderCrank::DESIGN;
        let responses = analysis.analyze(&b).unwrap();
        let wanted = [(3, 7), (0, 2), (3, 1)].map(|(response, point)| Instant { response, point });
        let rows = analysis.sensitivities(&b, &responses, &wanted).unwrap();
        let all = differentiate_kinematics(&SliderCrank::rigid(), &b, Assembly::default(), &times).unwrap();
        assert_eq!(responses.values, all.values);
        for (k, instant) in wanted.iter().enumerate() {
            assert_eq!(rows.row(k).iter().copied().collect::<Vec<_>>(), all.slopes[instant.response][instant.point]);
        }
        assert!(Driven::new(SliderCrank::rigid(), Assembly::default(), &[0.1, 0.1]).is_err());
    }
}
