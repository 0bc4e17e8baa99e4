//! Polishing of an approximate solution: direct solution of the optimality conditions of the active set.
//!
//! An interior point method ends about 1e-10 away from the solution. With the active rows A and the variables F that
//! are off their bounds, the exact solution follows from
//!
//! $$ \begin{bmatrix} H_{FF} & A_F^T \\ A_F & 0 \end{bmatrix} \begin{bmatrix} d_F \\ λ \end{bmatrix}
//!    = -\begin{bmatrix} ∇_F f \\ g_A \end{bmatrix} . $$
//!
//! The diagonal is shifted by ±δ, so that the system is regular for dependent rows and for directions without curvature.
//! Iterative refinement removes the effect of the shift.
//!
//! # Sources
//! The shift: Stellato et al., OSQP, *Math. Prog. Comp.* 12 (2020), section 4. A wrong active set is corrected by the
//! classical active set step: add the most violated row, drop the most negative multiplier.

use crate::QuadraticProgram;
use crate::solution::Candidate;
use nalgebra::{DMatrix, DVector};

/// Largest number of active sets.
const ROUNDS: usize = 25;
/// Shift of the diagonal, in scaled units.
const SHIFT: f64 = 1e-9;
/// Steps of iterative refinement at most.
const REFINEMENTS: usize = 12;
/// Largest number of unknowns.
const LARGEST: usize = 1200;
/// Rounding error of a scaled program; smaller violations and negative multipliers are ignored.
const ROUNDING: f64 = 1e-13;

/// State of a variable relative to its bounds.
#[derive(Clone, Copy, PartialEq)]
enum BoundStatus {
    Free,
    Lower,
    Upper,
}

/// The rows that hold with equality, and the variables at their bounds.
#[derive(Clone, PartialEq)]
struct WorkingSet {
    rows: Vec<bool>,
    bounds: Vec<BoundStatus>,
}

/// The best of `approximate` and the solutions of a sequence of active sets, with its residual.
pub(super) fn polish(program: &QuadraticProgram, approximate: Candidate) -> (Candidate, f64) {
    let mut active = initial_set(program, &approximate);
    let mut best = residual(program, &approximate);
    let mut chosen = approximate;
    let mut seen = vec![];
    for _ in 0..ROUNDS {
        if best <= ROUNDING || seen.contains(&active) {
            break;
        }
        let Some(trial) = solve(program, &active, &chosen) else { break };
        let reached = residual(program, &trial);
        seen.push(active.clone());
        correct(program, &mut active, &trial);
        if reached < best {
            (best, chosen) = (reached, trial);
        }
    }
    (chosen, best)
}

/// The initial active set: rows and bounds whose multiplier exceeds the slack.
fn initial_set(program: &QuadraticProgram, c: &Candidate) -> WorkingSet {
    let g = program.values_of_rows(&program.step(&c.x));
    let rows = (0..g.len()).map(|i| program.equality[i] || c.multipliers[i] > -g[i]).collect();
    let bounds = (0..c.x.len()).map(|j| {
        let (below, above) = (c.x[j] - program.lower[j], program.upper[j] - c.x[j]);
        if program.lower[j] == program.upper[j] || c.lower[j] > below {
            BoundStatus::Lower
        } else if c.upper[j] > above {
            BoundStatus::Upper
        } else {
            BoundStatus::Free
        }
    });
    WorkingSet { rows, bounds: bounds.collect() }
}

/// Point and multipliers of an active set; `None` if the system is too large or has no finite solution.
fn solve(program: &QuadraticProgram, active: &WorkingSet, near: &Candidate) -> Option<Candidate> {
    let n = near.x.len();
    let free: Vec<usize> = (0..n).filter(|&j| active.bounds[j] == BoundStatus::Free).collect();
    let rows: Vec<usize> = (0..active.rows.len()).filter(|&i| active.rows[i]).collect();
    if free.len() + rows.len() > LARGEST {
        return None;
    }
    let mut x = near.x.clone();
    for (j, x) in x.iter_mut().enumerate() {
        match active.bounds[j] {
            BoundStatus::Free => (),
            BoundStatus::Lower => *x = program.lower[j],
            BoundStatus::Upper => *x = program.upper[j],
        }
    }
    let d = program.step(&x);
    let (gradient, g) = (program.objective_gradient(&d), program.values_of_rows(&d));
    let system = system(program, &free, &rows);
    let right = DVector::from_iterator(
        free.len() + rows.len(),
        free.iter().map(|&j| -gradient[j]).chain(rows.iter().map(|&i| -g[i])),
    );
    let solution = shifted_solve(&system, &right, free.len())?;
    for (k, &j) in free.iter().enumerate() {
        x[j] += solution[k];
    }
    let mut multipliers = vec![0.0; active.rows.len()];
    for (k, &i) in rows.iter().enumerate() {
        multipliers[i] = solution[free.len() + k];
    }
    let (lower, upper) = bound_multipliers(program, active, &x, &multipliers);
    Some(Candidate { x, multipliers, lower, upper, ..near.clone() })
}

fn system(program: &QuadraticProgram, free: &[usize], rows: &[usize]) -> DMatrix<f64> {
    let (f, size) = (free.len(), free.len() + rows.len());
    let mut k = DMatrix::zeros(size, size);
    for (b, &j) in free.iter().enumerate() {
        if let Some(h) = &program.hessian {
            for (a, &i) in free.iter().enumerate() {
                k[(a, b)] = h[(i, j)];
            }
        }
        for (a, &i) in rows.iter().enumerate() {
            k[(f + a, b)] = program.rows[(i, j)];
            k[(b, f + a)] = program.rows[(i, j)];
        }
    }
    k
}

/// Solves K y = r with a possibly singular K, through K + diag(δ, −δ) and iterative refinement.
fn shifted_solve(k: &DMatrix<f64>, r: &DVector<f64>, free: usize) -> Option<DVector<f64>> {
    // All variables may be at bounds.
    if r.is_empty() {
        return Some(r.clone());
    }
    let mut shifted = k.clone();
    for i in 0..k.nrows() {
        shifted[(i, i)] += if i < free { SHIFT } else { -SHIFT };
    }
    let lu = shifted.lu();
    let mut y = lu.solve(r)?;
    let mut error = (r - k * &y).amax();
    for _ in 0..REFINEMENTS {
        let better = &y + lu.solve(&(r - k * &y))?;
        let left = (r - k * &better).amax();
        if left >= error || left.is_nan() {
            break;
        }
        (y, error) = (better, left);
    }
    y.iter().all(|v| v.is_finite()).then_some(y)
}

/// Multipliers of the bounds: the reduced costs of the variables at bounds.
fn bound_multipliers(program: &QuadraticProgram, active: &WorkingSet, x: &[f64], λ: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let reduced = reduced_costs(program, x, λ);
    let n = x.len();
    let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
    for j in 0..n {
        // The multiplier of a fixed variable belongs to either bound.
        let fixed = program.lower[j] == program.upper[j];
        match active.bounds[j] {
            BoundStatus::Lower if fixed && reduced[j] < 0.0 => upper[j] = -reduced[j],
            BoundStatus::Lower => lower[j] = reduced[j],
            BoundStatus::Upper => upper[j] = -reduced[j],
            BoundStatus::Free => (),
        }
    }
    (lower, upper)
}

/// Reduced costs ∇f + Aᵀλ.
fn reduced_costs(program: &QuadraticProgram, x: &[f64], λ: &[f64]) -> DVector<f64> {
    program.objective_gradient(&program.step(x)) + program.rows.tr_mul(&DVector::from_column_slice(λ))
}

/// Adds the most violated row and bound to the active set, or else drops the most negative multiplier.
fn correct(program: &QuadraticProgram, active: &mut WorkingSet, trial: &Candidate) {
    let g = program.values_of_rows(&program.step(&trial.x));
    let worst_row = largest((0..g.len()).filter(|&i| !active.rows[i]).map(|i| (i, g[i])));
    let outside = |j: usize| (program.lower[j] - trial.x[j]).max(trial.x[j] - program.upper[j]);
    let worst_bound =
        largest((0..trial.x.len()).filter(|&j| active.bounds[j] == BoundStatus::Free).map(|j| (j, outside(j))));
    if worst_row.is_some() || worst_bound.is_some() {
        if let Some(i) = worst_row {
            active.rows[i] = true;
        }
        if let Some(j) = worst_bound {
            active.bounds[j] = if trial.x[j] < program.lower[j] { BoundStatus::Lower } else { BoundStatus::Upper };
        }
        return;
    }
    let row = largest((0..g.len()).filter(|&i| !program.equality[i]).map(|i| (i, -trial.multipliers[i])));
    let bound = largest((0..trial.x.len()).map(|j| (j, -trial.lower[j].min(trial.upper[j]))));
    match (row, bound) {
        (Some(i), Some(j)) if -trial.lower[j].min(trial.upper[j]) > -trial.multipliers[i] => {
            active.bounds[j] = BoundStatus::Free
        }
        (Some(i), _) => active.rows[i] = false,
        (None, Some(j)) => active.bounds[j] = BoundStatus::Free,
        (None, None) => (),
    }
}

/// Index of the largest value that exceeds rounding.
fn largest(values: impl Iterator<Item = (usize, f64)>) -> Option<usize> {
    values.filter(|v| v.1 > ROUNDING).max_by(|a, b| a.1.total_cmp(&b.1)).map(|v| v.0)
}

/// The largest residual of the optimality conditions, in the scaled units of `program`.
fn residual(program: &QuadraticProgram, c: &Candidate) -> f64 {
    let g = program.values_of_rows(&program.step(&c.x));
    let reduced = reduced_costs(program, &c.x, &c.multipliers);
    let mut worst = 0.0f64;
    let mut add = |v: f64| worst = if v.is_nan() { f64::INFINITY } else { worst.max(v) };
    for i in 0..g.len() {
        if program.equality[i] {
            add(g[i].abs());
        } else {
            add(g[i]);
            add(-c.multipliers[i]);
            add((c.multipliers[i] * g[i]).abs());
        }
    }
    for j in 0..c.x.len() {
        add((reduced[j] - c.lower[j] + c.upper[j]).abs());
        let product = |μ: f64, gap: f64| if μ == 0.0 { 0.0 } else { (μ * gap).abs() };
        for (μ, gap) in [(c.lower[j], c.x[j] - program.lower[j]), (c.upper[j], program.upper[j] - c.x[j])] {
            add(-μ);
            add(-gap);
            add(product(μ, gap));
        }
    }
    worst
}
