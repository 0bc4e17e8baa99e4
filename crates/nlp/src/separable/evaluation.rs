//! Values, gradients and Hessian of separable programs, and checks and macros for their implementations.

use crate::{Gradients, Separable, Values};
use error::{Error, Result};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Variables per parallel task. It is fixed, so that sums have the same bits for any number of threads.
pub(crate) const CHUNK: usize = 2048;
/// Largest n for which the diagonal Hessian is returned as a dense matrix.
const DENSE: usize = 1000;

/// Objective and rows of a separable program. Chunks of variables run in parallel and are added in order.
///
/// # Errors
/// [`Error::Length`] if `x` does not have one entry per variable.
pub fn values(program: &(impl Separable + ?Sized), x: &[f64]) -> Result<Values> {
    Error::check_length("design variables", program.variables(), x.len())?;
    let m = program.rows();
    let chunk = |(c, part): (usize, &[f64])| {
        let [mut sums, mut values, mut slopes] = [0, 1, 2].map(|_| vec![0.0; m + 1]);
        for (k, &v) in part.iter().enumerate() {
            program.column(c * CHUNK + k, v, &mut values, &mut slopes);
            sums.iter_mut().zip(&values).for_each(|(sum, v)| *sum += v);
        }
        sums
    };
    let parts: Vec<Vec<f64>> = x.par_chunks(CHUNK).enumerate().map(chunk).collect();
    Ok(added(program, &parts))
}

/// Values from their sums over chunks of variables.
fn added(program: &(impl Separable + ?Sized), parts: &[Vec<f64>]) -> Values {
    let total = |i: usize| parts.iter().fold(program.constant(i), |a, part| a + part[i]);
    Values { objective: total(0), rows: (1..=program.rows()).map(total).collect() }
}

/// Values and gradients of a separable program, in one pass.
///
/// # Errors
/// [`Error::Length`] if `x` does not have one entry per variable.
pub fn gradients(program: &(impl Separable + ?Sized), x: &[f64]) -> Result<Gradients> {
    Error::check_length("design variables", program.variables(), x.len())?;
    let (n, m) = (x.len(), program.rows());
    let (mut rows, mut objective) = (DMatrix::zeros(m, n), vec![0.0; n]);
    // Without rows the matrix has no entries: use empty chunks.
    let mut columns: Vec<&mut [f64]> = rows.as_mut_slice().chunks_mut(CHUNK * m.max(1)).collect();
    columns.resize_with(n.div_ceil(CHUNK), Default::default);
    let chunk = |(c, (columns, slopes)): (usize, (&mut [f64], &mut [f64]))| {
        let [mut sums, mut values, mut all] = [0, 1, 2].map(|_| vec![0.0; m + 1]);
        for (k, slope) in slopes.iter_mut().enumerate() {
            let j = c * CHUNK + k;
            program.column(j, x[j], &mut values, &mut all);
            sums.iter_mut().zip(&values).for_each(|(sum, v)| *sum += v);
            *slope = all[0];
            columns[k * m..(k + 1) * m].copy_from_slice(&all[1..]);
        }
        sums
    };
    let both = columns.into_par_iter().zip(objective.par_chunks_mut(CHUNK));
    let parts: Vec<Vec<f64>> = both.enumerate().map(chunk).collect();
    Ok(Gradients { values: added(program, &parts), objective, rows })
}

/// Diagonal Hessian of the Lagrangian as a dense n × n matrix; `None` for n > 1000.
pub fn hessian(program: &(impl Separable + ?Sized), x: &[f64], λ: &[f64]) -> Option<DMatrix<f64>> {
    let n = x.len();
    if n > DENSE {
        return None;
    }
    let weights: Vec<f64> = [1.0].into_iter().chain(λ.iter().copied()).collect();
    let curvature = (0..n).map(|j| program.weighted(j, x[j], &weights).curvature);
    Some(DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(n, curvature)))
}

/// Checks coefficients of 1 + m functions in n variables, with entry (i, j) at j (1 + m) + i.
pub(super) fn check_coefficients(what: &str, n: usize, functions: usize, values: &[f64], least: f64) -> Result<()> {
    Error::check_length(what, n * functions, values.len())?;
    match values.iter().position(|v| !v.is_finite() || *v < least) {
        None => Ok(()),
        Some(k) => {
            let (i, j) = (k % functions, k / functions);
            let why = format!("the coefficient of function {i} in variable {j} is {}", values[k]);
            Err(Error::definition(what, why, format!("make it finite and at least {least}")))
        }
    }
}

/// Implements the methods of `Program` that follow from the terms of a `Separable`.
macro_rules! evaluate_terms {
    () => {
        fn values(&self, x: &[f64]) -> error::Result<crate::Values> {
            crate::separable::values(self, x)
        }
        fn gradients(&self, x: &[f64]) -> error::Result<crate::Gradients> {
            crate::separable::gradients(self, x)
        }
        fn lagrangian_hessian(&self, x: &[f64], multipliers: &[f64]) -> error::Result<Option<nalgebra::DMatrix<f64>>> {
            Ok(crate::separable::hessian(self, x, multipliers))
        }
        fn separable(&self) -> Option<&dyn crate::Separable> {
            Some(self)
        }
    };
}
pub(crate) use evaluate_terms;

/// Weighted sum Σ wᵢ aᵢⱼ of the entries of variable `j`, with entry (i, j) at j · functions + i.
pub(super) fn weighted_sum(by_variable: &[f64], functions: usize, j: usize, weights: &[f64]) -> f64 {
    by_variable[j * functions..j * functions + weights.len()].iter().zip(weights).map(|(a, w)| a * w).sum()
}

/// Implements `Program` for a type with separable terms and the fields `constants`, `lower` and `upper`.
macro_rules! impl_separable_program {
    ($t:ty) => {
        impl crate::Program for $t {
            crate::program::bounds_from_fields!();
            fn rows(&self) -> usize {
                self.constants.len() - 1
            }
            crate::separable::evaluate_terms!();
        }
    };
}
pub(super) use impl_separable_program;
