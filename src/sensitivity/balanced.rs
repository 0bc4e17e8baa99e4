//! Static equilibria as responses of an optimization problem.

use super::instant::differentiate_equilibria;
use super::semi_analytical::{self, difference_equilibria};
use crate::Result;
use crate::analysis::dynamics::check_times;
use crate::analysis::statics::{Statics, equilibria};
use crate::multibody::Model;
use crate::problem::{Alternative, Analysis, Instant, Responses};
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

    fn alternatives(&self) -> Vec<Alternative<'_>> {
        let semi = |step: f64, b: &[f64], _: &Responses, wanted: &[Instant]| {
            let count = wanted.iter().map(|instant| instant.point + 1).max().unwrap_or(0);
            let history = difference_equilibria(&self.model, b, &self.settings, &self.times[..count], step)?;
            Ok(history.rows(b.len(), wanted, |instant| instant.point))
        };
        vec![Alternative::of("direct", self), Alternative::approximate("semi-analytical", semi_analytical::STEP, semi)]
    }
}
