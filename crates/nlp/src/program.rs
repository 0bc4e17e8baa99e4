//! Mathematical programs: the traits [`Program`] and [`Separable`], their values, and checks of both.

use crate::LowRank;
use error::{Error, Result};
use nalgebra::DMatrix;
use std::borrow::Cow;
use std::ops::Range;

/// Class of a program, by the degree of its objective and rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Structure {
    /// Objective and all rows linear.
    Linear,
    /// Objective a quadratic, all rows linear.
    Quadratic,
    /// Anything else that is smooth.
    Nonlinear,
}

/// Value of the objective and of every row at one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// f(x).
    pub objective: f64,
    /// gᵢ(x), length m.
    pub rows: Vec<f64>,
}

/// Values and first derivatives at one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradients {
    /// The values at the same point.
    pub values: Values,
    /// ∇f, length n.
    pub objective: Vec<f64>,
    /// ∂gᵢ/∂xⱼ, m × n.
    pub rows: DMatrix<f64>,
}

/// A smooth mathematical program:
///
/// $$ \min_x f(x) \quad\text{subject to}\quad g_i(x) \le 0 \ (i = 1 \dots m),\qquad l \le x \le u. $$
///
/// A row for which [`Program::is_equality`] holds reads gᵢ(x) = 0 instead. Bounds may be infinite. Evaluations may fail,
/// for example where they call a simulation: solvers then shorten the step.
///
/// The numbers of variables and rows, the bounds, values and gradients are required. The other methods describe
/// structure that solvers use: equality rows, exact Hessians, convex quadratic rows, separability.
pub trait Program: Sync {
    /// Number of variables n.
    fn variables(&self) -> usize;
    /// Number of rows m.
    fn rows(&self) -> usize;
    /// Lower bounds l, length n.
    fn lower(&self) -> &[f64];
    /// Upper bounds u, length n.
    fn upper(&self) -> &[f64];
    /// True if row `i` is an equality.
    fn is_equality(&self, _i: usize) -> bool {
        false
    }
    /// Class of the program.
    fn structure(&self) -> Structure {
        Structure::Nonlinear
    }
    /// Objective and rows at `x` (length n).
    fn values(&self, x: &[f64]) -> Result<Values>;
    /// Values and first derivatives at `x`.
    fn gradients(&self, x: &[f64]) -> Result<Gradients>;
    /// Exact Hessian of f + Σ λᵢ gᵢ at `x`, n × n; `None` if it is not available.
    fn lagrangian_hessian(&self, _x: &[f64], _multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        Ok(None)
    }
    /// Factors Cᵢ (k × n) of the constant Hessians CᵢᵀCᵢ of convex quadratic rows; an entry is `None` for a linear row.
    ///
    /// Only for programs with a linear or convex quadratic objective; equality rows must be linear.
    fn row_factors(&self) -> Option<Vec<Option<DMatrix<f64>>>> {
        None
    }
    /// The program as a sum over its variables; `None` if it is not separable.
    fn separable(&self) -> Option<&dyn Separable> {
        None
    }
    /// Separable part and coupling of a program that is separable except for a quadratic of low rank in the objective.
    ///
    /// The constants and terms of the separable part exclude the quadratic; the program's values and gradients include
    /// it. Such a program is not [`separable`](Self::separable).
    fn coupled(&self) -> Option<(&dyn Separable, Cow<'_, LowRank>)> {
        None
    }
}

/// Implements `variables`, `lower` and `upper` of [`Program`] for a type with the fields `lower` and `upper`.
macro_rules! bounds_from_fields {
    () => {
        fn variables(&self) -> usize {
            self.lower.len()
        }
        fn lower(&self) -> &[f64] {
            &self.lower
        }
        fn upper(&self) -> &[f64] {
            &self.upper
        }
    };
}
pub(crate) use bounds_from_fields;

/// Value and derivatives of a scalar function at one point.
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

/// A program whose objective (i = 0) and rows (i = 1 … m) are sums over the variables:
///
/// $$ f_i(x) = r_i + \sum_{j=1}^{n} f_{ij}(x_j) $$
///
/// with convex scalar functions fᵢⱼ. See [`separable`](crate::separable) for forms with closed-form minimizers.
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

    /// Minimizer of Σ wᵢ fᵢⱼ within the bounds of variable j.
    ///
    /// The default is Newton's method inside a shrinking bracket. Override it where a closed form exists.
    fn minimizer(&self, j: usize, weights: &[f64]) -> f64 {
        bracketed_newton(|x| self.weighted(j, x, weights), self.lower()[j], self.upper()[j])
    }

    /// Contribution of the variables in `range` to the dual function at `weights` = (1, λ) and to its derivatives.
    fn dual_sums(&self, range: Range<usize>, weights: &[f64]) -> DualSums {
        general_dual_sums(self, range, weights)
    }
}

/// Minimizer of a convex function on [lower, upper]: the root of its slope, or the end with the smaller value.
///
/// An end may be infinite if the function increases towards it.
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

/// Sums over a range of variables, each at its minimizer for given weights (1, λ).
#[derive(Clone, Debug, PartialEq)]
pub struct DualSums {
    /// Σⱼ fᵢⱼ, length 1 + m.
    pub values: Vec<f64>,
    /// −∇²W: Σⱼ f′ᵢⱼ f′ₖⱼ / f″ⱼ over the variables off their bounds, the lower triangle row by row.
    pub negative_hessian: Vec<f64>,
}

impl DualSums {
    /// Zeros for m rows.
    pub fn new(m: usize) -> Self {
        Self { values: vec![0.0; m + 1], negative_hessian: vec![0.0; m * (m + 1) / 2] }
    }

    /// Entry (i, k) of the symmetric matrix −∇²W.
    pub fn entry(&self, i: usize, k: usize) -> f64 {
        let (i, k) = (i.max(k), i.min(k));
        self.negative_hessian[i * (i + 1) / 2 + k]
    }

    /// Adds the sums over other variables.
    pub fn add(&mut self, other: &Self) {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += b);
        self.negative_hessian.iter_mut().zip(&other.negative_hessian).for_each(|(a, b)| *a += b);
    }

    /// Multiplies the sums by a factor.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        self.values.iter_mut().chain(&mut self.negative_hessian).for_each(|v| *v *= factor);
        self
    }

    /// Adds one variable: value and slope of all 1 + m functions, and 1/f″ if it is off its bounds.
    fn add_variable(&mut self, values: &[f64], slopes: &[f64], inverse_curvature: Option<f64>) {
        self.values.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        let Some(inverse_curvature) = inverse_curvature else { return };
        let mut rest = self.negative_hessian.as_mut_slice();
        for i in 1..slopes.len() {
            let (row, next) = rest.split_at_mut(i);
            let scaled = slopes[i] * inverse_curvature;
            row.iter_mut().zip(&slopes[1..]).for_each(|(b, s)| *b += scaled * s);
            rest = next;
        }
    }
}

/// The sums over `range`, computed term by term.
pub(crate) fn general_dual_sums(program: &(impl Separable + ?Sized), range: Range<usize>, weights: &[f64]) -> DualSums {
    let mut sums = DualSums::new(weights.len() - 1);
    let (mut values, mut slopes) = (vec![0.0; weights.len()], vec![0.0; weights.len()]);
    for j in range {
        let x = program.minimizer(j, weights);
        program.column(j, x, &mut values, &mut slopes);
        let curvature = program.weighted(j, x, weights).curvature;
        let free = x > program.lower()[j] && x < program.upper()[j] && curvature > 0.0;
        sums.add_variable(&values, &slopes, free.then(|| 1.0 / curvature));
    }
    sums
}

/// The separable part of a program that is separable, or separable except for a coupling.
pub(crate) fn separable_part(program: &dyn Program) -> Option<&dyn Separable> {
    program.separable().or_else(|| program.coupled().map(|(part, _)| part))
}

/// `start` moved into the bounds, after a check of lengths and bounds.
pub(crate) fn feasible_start(program: &dyn Program, start: &[f64]) -> Result<Vec<f64>> {
    let n = program.variables();
    Error::check_length("start of the subproblem", n, start.len())?;
    Error::check_length("lower bounds of the subproblem", n, program.lower().len())?;
    Error::check_length("upper bounds of the subproblem", n, program.upper().len())?;
    let mut x = start.to_vec();
    for (j, v) in x.iter_mut().enumerate() {
        let (l, u) = (program.lower()[j], program.upper()[j]);
        if l > u || l.is_nan() || u.is_nan() || l == f64::INFINITY || u == f64::NEG_INFINITY {
            let why = format!("bounds of variable {j} are {l} and {u}");
            return Err(Error::definition("subproblem", why, "make the lower bound the smaller one"));
        }
        if !v.is_finite() {
            return Err(not_finite(format!("start of variable {j}"), *v, start));
        }
        *v = v.clamp(l, u);
    }
    Ok(x)
}

/// Checks lengths and finiteness of objective, rows and their gradients at `x`.
pub(crate) fn check_finite(program: &dyn Program, x: &[f64], g: &Gradients) -> Result<()> {
    let (n, m) = (program.variables(), program.rows());
    Error::check_length("gradient of the objective", n, g.objective.len())?;
    Error::check_length("rows of the subproblem", m, g.values.rows.len())?;
    Error::check_length("columns of the row gradients", n, g.rows.ncols())?;
    Error::check_length("rows of the row gradients", m, g.rows.nrows())?;
    let named = |what: &str, v: &[f64]| match v.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(not_finite(format!("{what} {i}"), v[i], x)),
        None => Ok(()),
    };
    named("objective", &[g.values.objective])?;
    named("row", &g.values.rows)?;
    named("objective slope", &g.objective)?;
    named("row slope", g.rows.as_slice())
}

fn not_finite(what: String, value: f64, x: &[f64]) -> Error {
    let shown: Vec<f64> = x.iter().copied().take(8).collect();
    let place = format!("x = {shown:?}{}", if x.len() > 8 { " …" } else { "" });
    Error::NotFinite { what, value, place, remedy: "start where the program is defined" }
}

/// Largest violation of a row, each divided by its `unit`; zero if all rows hold.
pub(crate) fn largest_violation(program: &dyn Program, rows: &[f64], unit: impl Fn(usize) -> f64) -> f64 {
    let violation = |(i, &g): (usize, &f64)| if program.is_equality(i) { g.abs() } else { g } / unit(i);
    rows.iter().enumerate().map(violation).fold(0.0, f64::max)
}

/// The rows whose `violation` exceeds `threshold`, the most violated first, at most `count`; ties in order of the rows.
pub(crate) fn most_violated(
    rows: impl Iterator<Item = usize>,
    violation: impl Fn(usize) -> f64,
    threshold: f64,
    count: usize,
) -> Vec<usize> {
    let mut rows: Vec<usize> = rows.filter(|&i| violation(i) > threshold).collect();
    let worst_first = |&a: &usize, &b: &usize| violation(b).total_cmp(&violation(a)).then(a.cmp(&b));
    if rows.len() > count {
        rows.select_nth_unstable_by(count, worst_first);
        rows.truncate(count);
    }
    rows.sort_unstable_by(worst_first);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_violated_rows_come_first_and_ties_are_in_order() {
        let values = [0.5, -1.0, 2.0, 0.5, 3.0];
        let units = [1.0, 1.0, 1.0, 1.0, 10.0];
        assert_eq!(most_violated(0..5, |i| values[i] / units[i], 0.0, 3), [2, 0, 3]);
        assert_eq!(most_violated(0..5, |i| values[i], 0.0, 9), [4, 2, 0, 3]);
    }
}
