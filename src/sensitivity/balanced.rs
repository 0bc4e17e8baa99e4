//! Static equilibria as responses of an optimization problem.

use super::instant::differentiate_equilibria;
use crate::Result;
use crate::analysis::dynamics::check_times;
use crate::analysis::statics::{Statics, equilibria};
use crate::multibody::Model;
use crate::problem::{Analysis, Instant, Responses};
use nalgebra::DMatrix;

/// The outputs of a mechanism in static equilibrium at given times: a load path where loads are functions of time.
///
/// Response h is the mechanism's output h, on the grid `times`. Sensitivities are direct.
pub struct Balanced<M> {
    model: M,
    settings: Statics,
    times: Vec<f64>,
}

impl<M: Model> Balanced<M> {
    /// For the outputs of `model` at `times` (s, increasing).
    ///
    /// **Errors.** [`crate::Error::Definition`] if times do not increase.
    pub fn new(model: M, settings: Statics, times: &[f64]) -> Result<Self> {
        check_times(f64::NEG_INFINITY, times)?;
        Ok(Self { model, settings, times: times.to_vec() })
    }
}

impl<M: Model> Analysis for Balanced<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        Ok(Responses::new(equilibria(&self.model.build(b)?, &self.settings, &self.times)?))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        // From the first time on, as the analysis: each equilibrium starts from the one before.
        let count = wanted.iter().map(|instant| instant.point + 1).max().unwrap_or(0);
        let history = differentiate_equilibria(&self.model, b, &self.settings, &self.times[..count])?;
        let row = |instant: &Instant| history.slopes[instant.response][instant.point].iter().copied();
        Ok(DMatrix::from_row_iterator(wanted.len(), b.len(), wanted.iter().flat_map(row)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::Mechanism;
    use crate::scalar::Scalar;

    /// A mass on a spring of stiffness b under gravity.
    struct Hanging;

    impl Model for Hanging {
        fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
            let zero = S::from(0.0);
            let mut m = Mechanism::with_gravity(zero, S::from(-10.0));
            let body = m.point_mass("weight", S::from(2.0), zero, zero);
            m.coordinate_spring("spring", m.ground().y, body.y, [b[0], zero, zero, zero]);
            m.fix(body.x);
            let sensor = m.sensor("weight", body.origin());
            let y = m.measure(sensor, "y")?;
            m.output("y", &[y]);
            Ok(m)
        }
    }

    #[test]
    fn a_weight_hangs_lower_on_a_softer_spring() {
        let analysis = Balanced::new(Hanging, Statics::default(), &[0.0]).unwrap();
        let responses = analysis.analyze(&[50.0]).unwrap();
        // y = −m g / k, dy/dk = m g / k².
        assert!((responses.values[0][0] + 0.4).abs() < 1e-12);
        let slope = analysis.sensitivities(&[50.0], &responses, &[Instant { response: 0, point: 0 }]).unwrap();
        assert!((slope[(0, 0)] - 0.008).abs() < 1e-12);
    }
}
