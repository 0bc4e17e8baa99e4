//! Programs whose objective and rows are sums over the variables.
//!
//! $$ f_i(x) = r_i + \sum_{j=1}^{n} f_{ij}(x_j),\qquad i = 0 \dots m $$
//!
//! with convex scalar functions fᵢⱼ; i = 0 is the objective. The classical approximations of structural optimization
//! are of this kind: [`MovingAsymptotes`] (MMA), [`Reciprocal`] (CONLIN), [`DiagonalQuadratic`]. For given multipliers the
//! Lagrangian falls apart into n problems of one variable, which is what makes a million variables possible.

mod asymptotes;
mod blocks;
mod dual_sums;
mod quadratic;
mod reciprocal;

pub use asymptotes::MovingAsymptotes;
pub use dual_sums::DualSums;
pub use quadratic::DiagonalQuadratic;
pub use reciprocal::Reciprocal;

use super::{Gradients, Program, Values};
use error::{Error, Result};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::ops::Range;

/// Variables per parallel task; fixed, so that sums have the same bits for any number of threads.
pub(crate) const CHUNK: usize = 2048;
/// Largest n for which a dense Hessian is made of the diagonal.
const DENSE: usize = 1000;

/// One scalar function at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Term {
    /// f.
    pub value: f64,
    /// f′.
    pub slope: f64,
    /// f″, not negative.
    pub curvature: f64,
}

impl Term {
    /// self + w · other.
    #[must_use]
    pub fn plus(self, w: f64, other: Self) -> Self {
        Self {
            value: self.value + w * other.value,
            slope: self.slope + w * other.slope,
            curvature: self.curvature + w * other.curvature,
        }
    }
}

/// A program that is a sum over its variables.
pub trait Separable: Program {
    /// rᵢ, i = 0 … m.
    fn constant(&self, i: usize) -> f64;

    /// fᵢⱼ at `x`, i = 0 … m, j = 0 … n − 1.
    fn term(&self, i: usize, j: usize, x: f64) -> Term;

    /// Value and slope of fᵢⱼ at `x` for all i, into slices of length 1 + m.
    fn column(&self, j: usize, x: f64, values: &mut [f64], slopes: &mut [f64]) {
        for (i, (value, slope)) in values.iter_mut().zip(slopes).enumerate() {
            let term = self.term(i, j, x);
            (*value, *slope) = (term.value, term.slope);
        }
    }

    /// Σ wᵢ fᵢⱼ at `x`; `weights` has length 1 + m.
    fn weighted(&self, j: usize, x: f64, weights: &[f64]) -> Term {
        let add = |sum: Term, (i, &w): (usize, &f64)| if w == 0.0 { sum } else { sum.plus(w, self.term(i, j, x)) };
        weights.iter().enumerate().fold(Term::default(), add)
    }

    /// The x within the bounds of variable j at which Σ wᵢ fᵢⱼ is smallest.
    ///
    /// By default Newton's method, kept inside a shrinking bracket; give the closed form where there is one.
    fn minimizer(&self, j: usize, weights: &[f64]) -> f64 {
        bracketed_newton(|x| self.weighted(j, x, weights), self.lower()[j], self.upper()[j])
    }

    /// The share of the variables in `range` in the dual function at `weights` = (1, λ) and in its derivatives.
    fn dual_sums(&self, range: Range<usize>, weights: &[f64]) -> DualSums {
        dual_sums::general(self, range, weights)
    }
}

/// Root of the slope of a convex function on [lower, upper], or the end towards which it falls. The ends must be finite
/// unless the function rises towards them.
pub(crate) fn bracketed_newton(f: impl Fn(f64) -> Term, lower: f64, upper: f64) -> f64 {
    let (mut a, mut b) = (lower, upper);
    if a.is_finite() && f(a).slope >= 0.0 {
        return a;
    }
    if b.is_finite() && f(b).slope <= 0.0 {
        return b;
    }
    let mut x = match (a.is_finite(), b.is_finite()) {
        (true, true) => 0.5 * (a + b),
        (true, false) => a + a.abs().max(1.0),
        (false, true) => b - b.abs().max(1.0),
        (false, false) => 0.0,
    };
    for _ in 0..200 {
        let at = f(x);
        if at.slope == 0.0 {
            return x;
        }
        if at.slope > 0.0 {
            b = x
        } else {
            a = x
        }
        let newton = x - at.slope / at.curvature;
        let next = if newton > a && newton < b {
            newton
        } else if a.is_finite() && b.is_finite() {
            0.5 * (a + b)
        } else {
            x - at.slope.signum() * 2.0 * x.abs().max(1.0)
        };
        if (next - x).abs() <= 2.0 * f64::EPSILON * x.abs() {
            return next;
        }
        x = next;
    }
    x
}

/// Objective and rows of a separable program: chunks in parallel, added up in order.
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

/// The values from their sums over chunks of variables.
fn added(program: &(impl Separable + ?Sized), parts: &[Vec<f64>]) -> Values {
    let total = |i: usize| parts.iter().fold(program.constant(i), |a, part| a + part[i]);
    Values { objective: total(0), rows: (1..=program.rows()).map(total).collect() }
}

/// Values and slopes of a separable program, in one pass.
pub fn gradients(program: &(impl Separable + ?Sized), x: &[f64]) -> Result<Gradients> {
    Error::check_length("design variables", program.variables(), x.len())?;
    let (n, m) = (x.len(), program.rows());
    let (mut rows, mut objective) = (DMatrix::zeros(m, n), vec![0.0; n]);
    // Without rows there are no columns to be cut into chunks.
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

/// The diagonal Hessian of the Lagrangian as a dense matrix, up to n = 1000.
pub fn hessian(program: &(impl Separable + ?Sized), x: &[f64], λ: &[f64]) -> Option<DMatrix<f64>> {
    let n = x.len();
    if n > DENSE {
        return None;
    }
    let weights: Vec<f64> = [1.0].into_iter().chain(λ.iter().copied()).collect();
    let curvature = (0..n).map(|j| program.weighted(j, x[j], &weights).curvature);
    Some(DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(n, curvature)))
}

/// Coefficients of 1 + m functions in n variables, variable by variable: entry (i, j) is at j (1 + m) + i.
pub(crate) fn check_coefficients(what: &str, n: usize, functions: usize, values: &[f64], least: f64) -> Result<()> {
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

/// The methods of `Program` that follow from the terms of a `Separable`.
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

/// Implements the parts of `Program` that all separable forms share.
macro_rules! impl_separable_program {
    ($t:ty) => {
        impl crate::Program for $t {
            fn variables(&self) -> usize {
                self.lower.len()
            }
            fn rows(&self) -> usize {
                self.constants.len() - 1
            }
            fn lower(&self) -> &[f64] {
                &self.lower
            }
            fn upper(&self) -> &[f64] {
                &self.upper
            }
            crate::separable::evaluate_terms!();
        }
    };
}
use impl_separable_program;
