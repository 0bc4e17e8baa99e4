//! What to do with a program that has no feasible point: violate all rows by the same least amount.
//!
//! With one elastic variable t, in units w of the rows, these become g ≤ w t and |h| ≤ w t. Smallest t first, then the smallest objective at
//! that t, by a penalty that is raised until t no longer moves (it is exact above a finite weight).
//!
//! **Source.** Nocedal & Wright, *Numerical Optimization*, 2nd ed., sections 17.2 and 18.5 (exact ℓ∞ penalty).

use super::Status;
use super::kkt::variable_scale;
use super::solver::{Candidate, separable_part};
use crate::separable::{Separable, Term};
use crate::{Gradients, LowRank, Program, Structure, Values};
use error::Result;
use nalgebra::DMatrix;
use std::borrow::Cow;

/// Normalised violation below which a program counts as feasible.
const FEASIBLE: f64 = 1e-9;
/// Relative room for the least violation while the objective is minimized.
const ROOM: f64 = 1e-8;
/// Penalties tried, each a hundred times the one before.
const PENALTIES: usize = 6;

/// min [f] + penalty · t subject to g ≤ w t, |h| ≤ w t, t ≥ 0; variables (x, t).
pub(super) struct Elastic<'a> {
    program: &'a dyn Program,
    /// Row of the program and sign.
    rows: Vec<(usize, f64)>,
    weights: Vec<f64>,
    objective: bool,
    penalty: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> Elastic<'a> {
    /// The least violation in units of `weights` alone, the objective left out.
    pub fn least_violation(program: &'a dyn Program, weights: Vec<f64>) -> Self {
        Self { objective: false, ..Self::with_objective(program, weights, 1.0) }
    }

    /// Objective and penalized violation.
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

    /// (x, t) with the smallest t that x allows.
    pub fn start(&self, x: &[f64]) -> Result<Vec<f64>> {
        let g = self.program.values(x)?.rows;
        let t = self.rows.iter().fold(0.0f64, |t, &(i, sign)| t.max(sign * g[i] / self.weights[i]));
        Ok(x.iter().copied().chain([t]).collect())
    }

    /// A solution in (x, t) as one in x, and t.
    pub fn unwrap(&self, mut c: Candidate) -> (Candidate, f64) {
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
    fn variables(&self) -> usize {
        self.lower.len()
    }
    fn rows(&self) -> usize {
        self.rows.len()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
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

/// Separable if the program is, but for a coupling: t is one more variable with linear terms.
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
        separable_part(self.program).expect("asked only of programs that have one")
    }
}

/// A solver without relaxation: a point with its own verdict.
pub(super) type Plain<'a> = &'a dyn Fn(&dyn Program, &[f64]) -> Result<Candidate>;

/// Decides about a program that `solve` did not solve from `start` (`first` is what it said): feasible and unbounded,
/// feasible after all, or relaxed.
pub(super) fn settle(program: &dyn Program, start: &[f64], first: Candidate, solve: Plain<'_>) -> Result<Candidate> {
    let measures = measures(program, start)?;
    let feasibility = Elastic::least_violation(program, measures.rows.clone());
    let (nearest, t) = feasibility.unwrap(solve(&feasibility, &feasibility.start(start)?)?);
    let iterations = first.iterations + nearest.iterations;
    if t > FEASIBLE && nearest.status != Status::Solved {
        // Neither feasible nor proven infeasible.
        return Ok(Candidate { iterations, ..first });
    }
    if t <= FEASIBLE {
        if first.status == Status::Unbounded {
            return Ok(Candidate { iterations, ..first });
        }
        let second = solve(program, &nearest.x)?;
        return Ok(Candidate { iterations: iterations + second.iterations, ..second });
    }
    relaxed(program, &nearest, &measures, iterations, solve)
}

/// Smallest violation, then the smallest objective: by one amount for all rows where they are comparable, in the rows'
/// own units where they are not or where that fails.
fn relaxed(
    program: &dyn Program,
    nearest: &Candidate,
    measures: &Measures,
    iterations: usize,
    solve: Plain<'_>,
) -> Result<Candidate> {
    let first = relaxed_by(program, nearest, measures, measures.weights(), solve)?;
    let again = first.status == Status::Stalled && measures.are_comparable();
    let c = if again { relaxed_by(program, nearest, measures, measures.rows.clone(), solve)? } else { first };
    Ok(Candidate { iterations: iterations + c.iterations, ..c })
}

fn relaxed_by(
    program: &dyn Program,
    nearest: &Candidate,
    measures: &Measures,
    weights: Vec<f64>,
    solve: Plain<'_>,
) -> Result<Candidate> {
    let amounts = |t: f64| Some(weights.iter().map(|w| w * t).collect());
    let penalty = measures.penalty(&weights);
    let least = Elastic::least_violation(program, weights.clone());
    let (best, least) = least.unwrap(solve(&least, &least.start(&nearest.x)?)?);
    let mut iterations = best.iterations;
    let mut x = best.x.clone();
    for k in 0..PENALTIES {
        let elastic = Elastic::with_objective(program, weights.clone(), penalty * 100f64.powi(k as i32));
        let (c, t) = elastic.unwrap(solve(&elastic, &elastic.start(&x)?)?);
        iterations += c.iterations;
        if c.status == Status::Unbounded {
            return Ok(Candidate { iterations, relaxation: amounts(least), ..c });
        }
        if c.status == Status::Solved {
            x.clone_from(&c.x);
            if t <= least * (1.0 + ROOM) {
                return Ok(Candidate { iterations, relaxation: amounts(t), status: Status::Relaxed, ..c });
            }
        }
    }
    Ok(Candidate { iterations, relaxation: amounts(least), status: Status::Stalled, ..best })
}

struct Measures {
    /// Change of each row over the scales of the variables.
    rows: Vec<f64>,
    /// Change of the objective.
    objective: f64,
}

/// Rows whose units differ by more than this are measured in their own.
const COMPARABLE: f64 = 1e4;

impl Measures {
    /// What t means in each row: one and the same amount where the rows are comparable.
    fn weights(&self) -> Vec<f64> {
        if self.are_comparable() { vec![1.0; self.rows.len()] } else { self.rows.clone() }
    }

    fn are_comparable(&self) -> bool {
        let small = self.rows.iter().copied().fold(f64::INFINITY, f64::min);
        let large = self.rows.iter().copied().fold(0.0, f64::max);
        large <= COMPARABLE * small
    }

    /// A first guess of the exact penalty.
    fn penalty(&self, weights: &[f64]) -> f64 {
        let ratios = weights.iter().zip(&self.rows).map(|(w, r)| r / w);
        let largest = ratios.fold(0.0, f64::max);
        if self.objective > 0.0 && largest > 0.0 { 10.0 * self.objective / largest } else { 1.0 }
    }
}

fn measures(program: &dyn Program, x: &[f64]) -> Result<Measures> {
    let g = program.gradients(x)?;
    let s: Vec<f64> =
        (0..x.len()).map(|j| variable_scale(program.lower()[j], program.upper()[j], x[j], x[j])).collect();
    let over = |slope: &dyn Fn(usize) -> f64| (0..x.len()).fold(0.0f64, |a, j| a.max((s[j] * slope(j)).abs()));
    let rows: Vec<f64> =
        (0..program.rows()).map(|i| over(&|j| g.rows[(i, j)])).map(|r| if r > 0.0 { r } else { 1.0 }).collect();
    let objective = over(&|j| g.objective[j]);
    Ok(Measures { rows, objective })
}
