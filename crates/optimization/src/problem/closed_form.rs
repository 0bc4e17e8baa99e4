//! Analyses in closed form: responses as explicit functions, differentiated by dual numbers.

use super::{Analysis, ContinuousTime, ResponseAt, Responses, TimeGrid, seed_block};
use autodiff::{BLOCK, Dual, HyperDual, Scalar, WIDTH, hessian, partials, seed};
use error::Result;
use nalgebra::{Const, DMatrix, U1};
use rayon::prelude::*;

/// Responses as explicit functions of design and time, written once over the scalar.
pub trait ClosedForm: Send + Sync {
    /// Response `h` at design `b` and time `t` (NaN for a time-independent response), in its unit.
    fn response<S: Scalar>(&self, h: usize, b: &[S], t: S) -> S;

    /// Explains a response that is not finite, as in `asin(1.2) is not defined`.
    fn undefined(&self, _h: usize, _b: &[f64], _t: f64) -> Option<String> {
        None
    }
}

/// The [`Analysis`] of a [`ClosedForm`]: only the wanted responses are differentiated, in chunks of design variables.
pub struct Analytic<M> {
    model: M,
    times: Vec<Vec<f64>>,
}

impl<M: ClosedForm> Analytic<M> {
    /// Creates the analysis; `grids` has the time grid of each response in order, `None` for a time-independent one.
    pub fn new(model: M, grids: &[Option<&TimeGrid>]) -> Self {
        let times = grids.iter().map(|g| g.map_or(vec![f64::NAN], |g| g.points.clone())).collect();
        Self { model, times }
    }

    /// The model.
    pub fn model(&self) -> &M {
        &self.model
    }
}

/// A matrix of `columns` columns with one row for each response; compiled once for all closed forms.
fn in_parallel(row: &(dyn Fn(&ResponseAt) -> Vec<f64> + Sync), wanted: &[ResponseAt], columns: usize) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = wanted.par_iter().with_min_len(64).map(row).collect();
    DMatrix::from_row_iterator(wanted.len(), columns, rows.into_iter().flatten())
}

impl<M: ClosedForm> Analysis for Analytic<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let history = |(h, times): (usize, &Vec<f64>)| times.iter().map(|&t| self.model.response(h, b, t)).collect();
        Ok(Responses::new(self.times.iter().enumerate().map(history).collect()))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let seeds: Vec<Vec<Dual>> = (0..b.len().div_ceil(WIDTH)).map(|c| seed(b, c * WIDTH)).collect();
        let row = |i: &ResponseAt| -> Vec<f64> {
            let t = Dual::from(self.times[i.response][i.point]);
            let chunk =
                |(c, b): (usize, &Vec<Dual>)| partials(&self.model.response(i.response, b, t), b.len() - c * WIDTH);
            seeds.iter().enumerate().flat_map(chunk).collect()
        };
        Ok(in_parallel(&row, wanted, b.len()))
    }

    fn curvatures(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        let one = |i: &ResponseAt| {
            let t = HyperDual::from(self.times[i.response][i.point]);
            hessian(|b| self.model.response(i.response, b, t), b).2
        };
        Ok(Some(wanted.iter().map(one).collect()))
    }

    fn undefined(&self, b: &[f64], at: ResponseAt) -> Option<String> {
        self.model.undefined(at.response, b, self.times[at.response][at.point])
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        Some(self)
    }
}

/// Derivatives with respect to time by one more dual part.
impl<M: ClosedForm> ContinuousTime for Analytic<M> {
    fn rates(&self, b: &[f64], _: &Responses, h: usize, t: f64) -> Result<[f64; 3]> {
        let design: Vec<HyperDual> = b.iter().map(|&v| HyperDual::from_re(v)).collect();
        let value = self.model.response(h, &design, HyperDual::from_re(t).derivative1(0).derivative2(0));
        let second = value.eps1eps2.unwrap_generic(Const::<BLOCK>, Const::<BLOCK>)[(0, 0)];
        Ok([value.re, value.eps1.unwrap_generic(Const::<BLOCK>, U1)[0], second])
    }

    fn curvature(&self, b: &[f64], _: &Responses, h: usize, t: f64) -> Result<Option<DMatrix<f64>>> {
        Ok(Some(hessian(|b| self.model.response(h, b, HyperDual::from_re(t)), b).2))
    }

    fn rate_sensitivities(&self, b: &[f64], _: &Responses, h: usize, t: f64) -> Result<[Vec<f64>; 2]> {
        let mut found = [Vec::with_capacity(b.len()), Vec::with_capacity(b.len())];
        for start in (0..b.len()).step_by(BLOCK) {
            let value = self.model.response(h, &seed_block(b, start), HyperDual::from_re(t).derivative2(0));
            let slopes = value.eps1.unwrap_generic(Const::<BLOCK>, U1);
            let mixed = value.eps1eps2.unwrap_generic(Const::<BLOCK>, Const::<BLOCK>);
            for a in 0..BLOCK.min(b.len() - start) {
                found[0].push(slopes[a]);
                found[1].push(mixed[(a, 0)]);
            }
        }
        Ok(found)
    }
}
