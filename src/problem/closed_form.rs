//! Analyses in closed form: responses as explicit functions, differentiated by dual numbers.

use super::{Analysis, Instant, Responses, TimeGrid};
use crate::error::Result;
use crate::scalar::{Dual, Scalar, WIDTH, seed, slopes};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Responses as explicit functions of design and time, written once over the scalar.
pub trait ClosedForm: Send + Sync {
    /// Response `h` at design `b` and time `t` (NaN for a time-independent response), in its unit.
    fn response<S: Scalar>(&self, h: usize, b: &[S], t: S) -> S;
}

/// The [`Analysis`] of a [`ClosedForm`]: only the wanted instants are differentiated, in chunks of design variables.
pub struct Analytic<M> {
    model: M,
    times: Vec<Vec<f64>>,
}

impl<M: ClosedForm> Analytic<M> {
    /// `grids` holds the time grid of each response in order, none for a time-independent one.
    pub fn new(model: M, grids: &[Option<&TimeGrid>]) -> Self {
        let times = grids.iter().map(|g| g.map_or(vec![f64::NAN], |g| g.points.clone())).collect();
        Self { model, times }
    }

    /// The model.
    pub fn model(&self) -> &M {
        &self.model
    }
}

impl<M: ClosedForm> Analysis for Analytic<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let history = |(h, times): (usize, &Vec<f64>)| times.iter().map(|&t| self.model.response(h, b, t)).collect();
        Ok(Responses::new(self.times.iter().enumerate().map(history).collect()))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        let seeds: Vec<Vec<Dual>> = (0..b.len().div_ceil(WIDTH)).map(|c| seed(b, c * WIDTH)).collect();
        let row = |i: &Instant| -> Vec<f64> {
            let t = Dual::from(self.times[i.response][i.point]);
            let chunk =
                |(c, b): (usize, &Vec<Dual>)| slopes(&self.model.response(i.response, b, t), b.len() - c * WIDTH);
            seeds.iter().enumerate().flat_map(chunk).collect()
        };
        let rows: Vec<Vec<f64>> = wanted.par_iter().with_min_len(64).map(row).collect();
        Ok(DMatrix::from_row_iterator(wanted.len(), b.len(), rows.into_iter().flatten()))
    }
}
