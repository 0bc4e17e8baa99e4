//! Relaxation of programs without a feasible point: all rows are violated by the same smallest amount.
//!
//! With one elastic variable t and weights w (the units of the rows), the rows become g ≤ w t and |h| ≤ w t. The
//! smallest t is computed first. The smallest objective at that t follows from an exact penalty, which is increased
//! until t has its smallest value again.
//!
//! # Sources
//! Nocedal & Wright, *Numerical Optimization*, 2nd ed., sections 17.2 and 18.5 (exact ℓ∞ penalty).

use crate::LowRank;
use crate::kkt::{largest_change, row_units, variable_scales};
use crate::program::{
    Gradients, Program, Separable, Structure, Term, Values, bounds_from_fields, largest_violation, separable_part,
};
use crate::solution::{Candidate, ProgramStatus};
use error::Result;
use nalgebra::DMatrix;
use std::borrow::Cow;

/// Normalized violation below which a program counts as feasible.
const FEASIBLE: f64 = 1e-9;
/// Relative tolerance of the smallest violation while the objective is minimized.
const LEAST_TOLERANCE: f64 = 1e-8;
/// Largest number of penalties, each a hundred times the previous one.
const PENALTIES: usize = 6;

/// The program min f + penalty · t subject to g ≤ w t, |h| ≤ w t, t ≥ 0, in the variables (x, t); f may be omitted.
pub(super) struct Elastic<'a> {
    program: &'a dyn Program,
    /// Index of the row in the program, and its sign: an equality becomes two rows.
    rows: Vec<(usize, f64)>,
    /// w, the violation of each row for t = 1.
    weights: Vec<f64>,
    /// True if f is included.
    objective: bool,
    penalty: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> Elastic<'a> {
    /// The program that minimizes the violation alone, in units of `weights`.
    pub fn least_violation(program: &'a dyn Program, weights: Vec<f64>) -> Self {
        Self { objective: false, ..Self::with_objective(program, weights, 1.0) }
    }

    /// The program that minimizes the objective plus the penalized violation.
    pub fn with_objective(program: &'a dyn Program, weights: Vec<f64>, penalty: f64) -> Self {
        let mut rows = vec![];
        for i in 0..program.rows() {
            rows.push((i, 1.0));
            if program.is_equality(i) {
                rows.push((i, -1.0));
            }
        }
        let extended = |b: &[f64], last: f64| b.iter().copied().chain([last]).collect();
        let (lower, upper) = (extended(program.lower(), 0.0), extended(program.upper(), f64::INFINITY));
        Self { program, rows, weights, objective: true, penalty, lower, upper }
    }

    /// Returns (x, t) with the smallest t for which x is feasible.
    pub fn start(&self, x: &[f64]) -> Result<Vec<f64>> {
        let g = self.program.values(x)?.rows;
        let t = largest_violation(self.program, &g, |i| self.weights[i]);
        Ok(x.iter().copied().chain([t]).collect())
    }

    /// Splits a candidate in (x, t) into one in x and the value of t.
    pub fn split(&self, mut c: Candidate) -> (Candidate, f64) {
        let mut multipliers = vec![0.0; self.program.rows()];
        for (&(i, sign), λ) in self.rows.iter().zip(&c.multipliers) {
            multipliers[i] += sign * λ;
        }
        c.multipliers = multipliers;
        c.lower.pop();
        c.upper.pop();
        let t = c.x.pop().unwrap_or(0.0);
        (c, t)
    }
}

impl Program for Elastic<'_> {
    bounds_from_fields!();
    fn rows(&self) -> usize {
        self.rows.len()
    }
    fn structure(&self) -> Structure {
        match self.program.structure() {
            Structure::Quadratic if !self.objective => Structure::Linear,
            other => other,
        }
    }
    fn separable(&self) -> Option<&dyn Separable> {
        let coupled = self.objective && self.program.coupled().is_some();
        (!coupled && separable_part(self.program).is_some()).then_some(self as &dyn Separable)
    }
    fn coupled(&self) -> Option<(&dyn Separable, Cow<'_, LowRank>)> {
        let (_, low_rank) = self.program.coupled().filter(|_| self.objective)?;
        Some((self as &dyn Separable, Cow::Owned(low_rank.extended())))
    }
    fn values(&self, y: &[f64]) -> Result<Values> {
        let (t, x) = y.split_last().expect("t is the last variable");
        let v = self.program.values(x)?;
        Ok(Values {
            objective: self.penalty * t + if self.objective { v.objective } else { 0.0 },
            rows: self.rows.iter().map(|&(i, sign)| sign * v.rows[i] - self.weights[i] * t).collect(),
        })
    }
    fn gradients(&self, y: &[f64]) -> Result<Gradients> {
        let (t, x) = y.split_last().expect("t is the last variable");
        let g = self.program.gradients(x)?;
        let n = x.len();
        let rows = DMatrix::from_fn(self.rows.len(), n + 1, |k, j| {
            let (i, sign) = self.rows[k];
            if j < n { sign * g.rows[(i, j)] } else { -self.weights[i] }
        });
        let values = Values {
            objective: self.penalty * t + if self.objective { g.values.objective } else { 0.0 },
            rows: self.rows.iter().map(|&(i, sign)| sign * g.values.rows[i] - self.weights[i] * t).collect(),
        };
        let objective = if self.objective { g.objective } else { vec![0.0; n] };
        Ok(Gradients { values, objective: objective.into_iter().chain([self.penalty]).collect(), rows })
    }
    fn lagrangian_hessian(&self, y: &[f64], multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        let x = &y[..y.len() - 1];
        let mut λ = vec![0.0; self.program.rows()];
        self.rows.iter().zip(multipliers).for_each(|(&(i, sign), m)| λ[i] += sign * m);
        let Some(mut h) = self.program.lagrangian_hessian(x, &λ)? else { return Ok(None) };
        if !self.objective {
            let Some(f) = self.program.lagrangian_hessian(x, &vec![0.0; λ.len()])? else { return Ok(None) };
            h -= f;
        }
        let n = x.len();
        Ok(Some(h.insert_row(n, 0.0).insert_column(n, 0.0)))
    }
}

/// Terms of the separable part of the program, and linear terms of t; used only if the program is separable, except for a
/// coupling.
impl Separable for Elastic<'_> {
    fn constant(&self, i: usize) -> f64 {
        let inner = self.separable_program();
        match i.checked_sub(1) {
            Some(k) => self.rows[k].1 * inner.constant(self.rows[k].0 + 1),
            None if self.objective => inner.constant(0),
            None => 0.0,
        }
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        let linear = |slope: f64| Term { value: slope * x, slope, curvature: 0.0 };
        let last = j + 1 == self.lower.len();
        match i.checked_sub(1) {
            Some(k) if last => linear(-self.weights[self.rows[k].0]),
            Some(k) => Term::default().plus(self.rows[k].1, self.separable_program().term(self.rows[k].0 + 1, j, x)),
            None if last => linear(self.penalty),
            None if self.objective => self.separable_program().term(0, j, x),
            None => Term::default(),
        }
    }
}

impl Elastic<'_> {
    fn separable_program(&self) -> &dyn Separable {
        separable_part(self.program).expect("called for separable programs only")
    }
}

/// A solver without relaxation: returns a point with its status.
pub(super) type Unrelaxed<'a> = &'a dyn Fn(&dyn Program, &[f64]) -> Result<Candidate>;

/// Resolves a program that `solve` did not solve from `start`: relaxes it if it is infeasible, or else solves it again.
///
/// `first` is the candidate of the failed attempt. An unbounded program that is feasible remains unbounded.
pub(super) fn resolve(
    program: &dyn Program,
    start: &[f64],
    first: Candidate,
    solve: Unrelaxed<'_>,
) -> Result<Candidate> {
    let units = FunctionUnits::new(program, start)?;
    let feasibility = Elastic::least_violation(program, units.rows.clone());
    let (nearest, t) = feasibility.split(solve(&feasibility, &feasibility.start(start)?)?);
    let iterations = first.iterations + nearest.iterations;
    if t > FEASIBLE && nearest.status != ProgramStatus::Solved {
        // It remains unknown whether the program is feasible.
        return Ok(Candidate { iterations, ..first });
    }
    if t <= FEASIBLE {
        if first.status == ProgramStatus::Unbounded {
            return Ok(Candidate { iterations, ..first });
        }
        let second = solve(program, &nearest.x)?;
        return Ok(Candidate { iterations: iterations + second.iterations, ..second });
    }
    // Equal violations if the rows are comparable; violations in the units of the rows otherwise, or if that fails.
    let equal = relax(program, &nearest.x, &units, units.weights(), solve)?;
    let again = equal.status == ProgramStatus::Stalled && units.are_comparable();
    let relaxed = if again { relax(program, &nearest.x, &units, units.rows.clone(), solve)? } else { equal };
    Ok(Candidate { iterations: iterations + relaxed.iterations, ..relaxed })
}

/// Minimizes the violation in units of `weights`, and then the objective at this violation, starting from `nearest`.
fn relax(
    program: &dyn Program,
    nearest: &[f64],
    units: &FunctionUnits,
    weights: Vec<f64>,
    solve: Unrelaxed<'_>,
) -> Result<Candidate> {
    let amounts = |t: f64| Some(weights.iter().map(|w| w * t).collect());
    let penalty = units.penalty(&weights);
    let least = Elastic::least_violation(program, weights.clone());
    let (best, least) = least.split(solve(&least, &least.start(nearest)?)?);
    let mut iterations = best.iterations;
    let mut x = best.x.clone();
    for k in 0..PENALTIES {
        let elastic = Elastic::with_objective(program, weights.clone(), penalty * 100f64.powi(k as i32));
        let (c, t) = elastic.split(solve(&elastic, &elastic.start(&x)?)?);
        iterations += c.iterations;
        if c.status == ProgramStatus::Unbounded {
            return Ok(Candidate { iterations, relaxation: amounts(least), ..c });
        }
        if c.status == ProgramStatus::Solved {
            x.clone_from(&c.x);
            if t <= least * (1.0 + LEAST_TOLERANCE) {
                return Ok(Candidate { iterations, relaxation: amounts(t), status: ProgramStatus::Relaxed, ..c });
            }
        }
    }
    Ok(Candidate { iterations, relaxation: amounts(least), status: ProgramStatus::Stalled, ..best })
}

/// Largest changes of the rows and of the objective when one variable changes by its scale.
struct FunctionUnits {
    rows: Vec<f64>,
    objective: f64,
}

/// Largest ratio of the units of two rows that are relaxed by the same amount.
const COMPARABLE: f64 = 1e4;

impl FunctionUnits {
    fn new(program: &dyn Program, x: &[f64]) -> Result<Self> {
        let g = program.gradients(x)?;
        let scales = variable_scales(program, x, x);
        Ok(Self { rows: row_units(&scales, &g.rows), objective: largest_change(&scales, &g.objective) })
    }

    /// Violation of each row for t = 1, equal for all rows if they are comparable.
    fn weights(&self) -> Vec<f64> {
        if self.are_comparable() { vec![1.0; self.rows.len()] } else { self.rows.clone() }
    }

    fn are_comparable(&self) -> bool {
        let small = self.rows.iter().copied().fold(f64::INFINITY, f64::min);
        let large = self.rows.iter().copied().fold(0.0, f64::max);
        large <= COMPARABLE * small
    }

    /// An initial estimate of the exact penalty.
    fn penalty(&self, weights: &[f64]) -> f64 {
        let ratios = weights.iter().zip(&self.rows).map(|(w, r)| r / w);
        let largest = ratios.fold(0.0, f64::max);
        if self.objective > 0.0 && largest > 0.0 { 10.0 * self.objective / largest } else { 1.0 }
    }
}
