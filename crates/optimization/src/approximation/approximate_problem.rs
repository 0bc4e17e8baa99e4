//! The approximate problem (10)–(12) of a cycle as a program.

use super::approximate_functions::ApproximateFunctions;
use super::fitted_models::FittedModels;
use super::separable_sum::SeparableSum;
use super::{Approximation, ApproximationOptions, LinearizationPoint, SubproblemBox};
use crate::problem::{Problem, RowId};
use autodiff::{Dual, HyperDual, PolynomialDegree, hessian, jacobian};
use error::Result;
use nalgebra::{DMatrix, SymmetricEigen};
use nlp::separable::{self, Separable, Term};
use nlp::{Gradients, LowRank, Program, Structure, Values};
use std::borrow::Cow;

/// Number of variables, and of rows, up to which the Hessian of each row is factorized.
const SMALL: usize = 60;

/// Minimize F̃(b) subject to g̃_j(b, tₚ) ≤ c_j at the retained time points, inside the search subregion.
///
/// The approximate responses are models; objective and constraints are the problem's own functions of them. Rows read
/// ĝ − 1 ≤ 0, so a row value of 0.01 is a violation of 1 %; rows of equality constraints read ĝ − 1 = 0.
pub struct ApproximateProblem<'a> {
    functions: ApproximateFunctions<'a>,
    sum: Option<SeparableSum>,
    structure: Structure,
    factors: Option<Vec<Option<DMatrix<f64>>>>,
}

impl<'a> ApproximateProblem<'a> {
    /// Builds the approximate problem of the retained rows inside `subproblem_box`, reduced to the domain of the models.
    ///
    /// # Errors
    ///
    /// Those of [`Approximation::fit`].
    pub fn new(
        problem: &'a Problem,
        approximation: &dyn Approximation,
        point: LinearizationPoint,
        (mut subproblem_box, options): (SubproblemBox, ApproximationOptions),
    ) -> Result<Self> {
        let models = FittedModels::new(problem, approximation, point, &subproblem_box, options.moving_peaks)?;
        models.restrict(&mut subproblem_box);
        let functions = ApproximateFunctions {
            problem,
            retained: point.data.retained.clone(),
            models,
            origin: point.design.to_vec(),
            subproblem_box,
            conservatism: options.conservatism,
            curvature: options.curvature,
        };
        let mut approximate = Self { functions, sum: None, structure: Structure::Nonlinear, factors: None };
        approximate.recognize();
        Ok(approximate)
    }

    /// Retained constraints and time points: the rows, in order.
    pub fn retained(&self) -> &[RowId] {
        &self.functions.retained
    }

    /// w(b), the distance from the start design in which conservatism is measured.
    pub fn distance(&self, b: &[f64]) -> f64 {
        self.functions.distance(b)
    }

    fn curvature(&self) -> Option<&LowRank> {
        self.functions.curvature.as_ref()
    }

    /// Determines structure, cones and separability by an evaluation in numbers that carry a polynomial degree.
    fn recognize(&mut self) {
        let functions = &self.functions;
        let (origin, peaks) = (&functions.origin, &functions.models.peaks);
        let middle = self.lower().iter().zip(self.upper()).map(|(l, u)| PolynomialDegree::variable(0.5 * (l + u)));
        let (objective, rows) = functions.values(&middle.collect::<Vec<_>>(), |_| true);
        let degree = |(i, row): (usize, &PolynomialDegree)| match &peaks[i] {
            Some(p) if !p.stays_quadratic(origin, self.lower(), self.upper()) => PolynomialDegree::NONLINEAR,
            // At the centre of the box the shift of the peak may be zero by chance.
            Some(p) if p.is_moving && p.peak.reach.iter().any(|t| *t > 0.0) => row.degree.max(2),
            _ => row.degree,
        };
        let degrees: Vec<u8> = rows.iter().enumerate().map(degree).collect();
        let most = degrees.iter().copied().max().unwrap_or(0);
        let structure = match objective.degree {
            0 | 1 if most <= 1 => Structure::Linear,
            2 if most <= 1 => Structure::Quadratic,
            _ => Structure::Nonlinear,
        };
        let n = origin.len();
        let small = rows.len() <= SMALL && n <= SMALL;
        let is_conic = structure == Structure::Nonlinear && objective.degree <= 2 && most == 2 && small;
        let factors = if is_conic { self.cones(&degrees) } else { None };
        let large = self.curvature().is_some() && n > SMALL;
        if large || (structure == Structure::Nonlinear && factors.is_none()) {
            self.sum = SeparableSum::of(functions);
        }
        (self.structure, self.factors) = (structure, factors);
    }

    /// A factor of the Hessian of each quadratic row; `None` unless objective and all rows are convex.
    fn cones(&self, degrees: &[u8]) -> Option<Vec<Option<DMatrix<f64>>>> {
        factor(hessian(|b: &[HyperDual]| self.functions.values(b, |_| false).0, &self.functions.origin).2)?;
        let row = |(i, &degree): (usize, &u8)| -> Option<Option<DMatrix<f64>>> {
            if degree <= 1 {
                return Some(None);
            }
            if self.is_equality(i) {
                return None;
            }
            factor(hessian(|b: &[HyperDual]| self.functions.values(b, |k| k == i).1[i], &self.functions.origin).2)
                .map(Some)
        };
        degrees.iter().enumerate().map(row).collect()
    }
}

/// C with CᵀC = H; `None` unless H is positive semidefinite.
fn factor(h: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let eigen = SymmetricEigen::new(h);
    let most = eigen.eigenvalues.amax();
    if eigen.eigenvalues.iter().any(|&v| v < -1e-12 * most) {
        return None;
    }
    let positive: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] > 1e-14 * most).collect();
    let n = eigen.eigenvalues.len();
    Some(DMatrix::from_fn(positive.len(), n, |i, j| {
        eigen.eigenvalues[positive[i]].sqrt() * eigen.eigenvectors[(j, positive[i])]
    }))
}

impl Program for ApproximateProblem<'_> {
    fn variables(&self) -> usize {
        self.functions.problem.n()
    }
    fn rows(&self) -> usize {
        self.functions.retained.len()
    }
    fn lower(&self) -> &[f64] {
        &self.functions.subproblem_box.lower
    }
    fn upper(&self) -> &[f64] {
        &self.functions.subproblem_box.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        self.functions.is_equality(&self.functions.retained[i])
    }
    /// Class of the program, determined once from polynomial degrees.
    fn structure(&self) -> Structure {
        self.structure
    }
    fn row_factors(&self) -> Option<Vec<Option<DMatrix<f64>>>> {
        self.factors.clone()
    }
    fn separable(&self) -> Option<&dyn Separable> {
        (self.sum.is_some() && self.curvature().is_none()).then_some(self as &dyn Separable)
    }
    fn coupled(&self) -> Option<(&dyn Separable, Cow<'_, LowRank>)> {
        let curvature = self.curvature().filter(|_| self.sum.is_some())?;
        Some((self as &dyn Separable, Cow::Borrowed(curvature)))
    }

    fn values(&self, x: &[f64]) -> Result<Values> {
        if self.sum.is_some() {
            let mut values = separable::values(self, x)?;
            values.objective += self.curvature().map_or(0.0, |c| c.value_and_slope(x).0);
            return Ok(values);
        }
        let (objective, rows) = self.functions.values(x, |_| true);
        Ok(Values { objective, rows })
    }

    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        if self.sum.is_some() {
            let mut gradients = separable::gradients(self, x)?;
            if let Some(curvature) = self.curvature() {
                let (value, slope) = curvature.value_and_slope(x);
                gradients.values.objective += value;
                gradients.objective.iter_mut().zip(slope).for_each(|(g, s)| *g += s);
            }
            return Ok(gradients);
        }
        let both = |x: &[Dual]| {
            let (objective, mut rows) = self.functions.values(x, |_| true);
            rows.push(objective);
            rows
        };
        let (mut rows, mut slopes) = jacobian(both, x);
        let objective = rows.pop().expect("the objective was pushed last");
        let gradient = slopes.row(rows.len()).iter().copied().collect();
        slopes = slopes.remove_row(rows.len());
        Ok(Gradients { values: Values { objective, rows }, objective: gradient, rows: slopes })
    }

    fn lagrangian_hessian(&self, x: &[f64], multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        if self.sum.is_some() {
            let quadratic = self.curvature();
            return Ok(separable::hessian(self, x, multipliers).map(|h| quadratic.map_or(h.clone(), |c| h + c.dense())));
        }
        let lagrangian = |x: &[HyperDual]| {
            let (objective, rows) = self.functions.values(x, |i| multipliers[i] != 0.0);
            let active = rows.iter().zip(multipliers).filter(|(_, l)| **l != 0.0);
            active.fold(objective, |sum, (&g, &l)| sum + g * l)
        };
        Ok(Some(hessian(lagrangian, x).2))
    }
}

impl Separable for ApproximateProblem<'_> {
    fn constant(&self, i: usize) -> f64 {
        self.sum.as_ref().map_or(0.0, |sum| sum.constant(i))
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        self.sum.as_ref().map_or_else(Term::default, |sum| sum.term(i, j, x))
    }
}
