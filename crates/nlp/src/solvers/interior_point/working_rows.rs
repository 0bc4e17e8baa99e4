//! Working rows of programs with many rows and few active ones: each round adds the violated rows.
//!
//! A solution of a convex program with some of its rows is a solution with all rows if it satisfies the others. Each
//! round costs one evaluation of all rows and the solution of a small program.

use super::central_path::{ACCEPTED, InteriorPoint};
use crate::kkt::{row_units, variable_scales};
use crate::program::{Gradients, Program, Separable, Term, most_violated};
use crate::separable;
use crate::solution::{Candidate, Evaluations, ProgramStatus, Solution};
use error::Result;

/// Number of rounds after which all rows are used.
const ROUNDS: usize = 40;
/// Violation, in units of the row, above which a row is added.
const VIOLATED: f64 = 1e-10;

/// A program with some of its rows.
struct WorkingRows<'a> {
    program: &'a dyn Separable,
    rows: Vec<usize>,
}

impl WorkingRows<'_> {
    /// Index of function `i` in the whole program; function 0 is the objective.
    fn function(&self, i: usize) -> usize {
        i.checked_sub(1).map_or(0, |k| self.rows[k] + 1)
    }
}

/// Solves `program` with working rows; `None` if there are few rows, equality rows or a coupling.
///
/// A round that fails, for example because no point is feasible, ends the rounds with the status `Stalled`. `here` are the
/// gradients at `start`, which is within the bounds.
pub(super) fn solve(
    solver: &InteriorPoint,
    program: &dyn Separable,
    start: &[f64],
    here: &Gradients,
) -> Result<Option<Solution>> {
    let (n, m) = (program.variables(), program.rows());
    let first = 4 * n + 4;
    if m <= 4 * first || program.coupled().is_some() || (0..m).any(|i| program.is_equality(i)) {
        return Ok(None);
    }
    let units = row_units(&variable_scales(program, start, start), &here.rows);
    let worst = |g: &[f64], threshold: f64, count: usize| most_violated(0..m, |i| g[i] / units[i], threshold, count);
    let mut kept = WorkingRows { program, rows: worst(&here.values.rows, f64::NEG_INFINITY, first) };
    let (mut x, mut iterations, mut evaluations) = (start.to_vec(), 0, Evaluations::default());
    for _ in 0..ROUNDS {
        let found = solver.run(&kept, &x)?;
        iterations += found.iterations;
        evaluations = evaluations + found.evaluations;
        let solved = found.status == ProgramStatus::Solved;
        let values = program.values(&found.x)?;
        let added = worst(&values.rows, VIOLATED, first / 2);
        let new: Vec<usize> = added.into_iter().filter(|i| !kept.rows.contains(i)).collect();
        if new.is_empty() || !solved {
            let mut multipliers = vec![0.0; m];
            kept.rows.iter().zip(&found.multipliers).for_each(|(&i, λ)| multipliers[i] = *λ);
            let candidate = Candidate { multipliers, iterations, relaxation: None, ..Candidate::from(found) };
            let gradients = program.gradients(&candidate.x)?;
            let mut solution = candidate.certified(program, start, evaluations, &gradients, Some(&here.objective));
            let is_accepted = solved && solution.kkt.largest() <= ACCEPTED;
            solution.status = if is_accepted { ProgramStatus::Solved } else { ProgramStatus::Stalled };
            return Ok(Some(solution));
        }
        kept.rows.extend(new);
        x = found.x;
    }
    Ok(None)
}

impl Program for WorkingRows<'_> {
    fn variables(&self) -> usize {
        self.program.variables()
    }
    fn rows(&self) -> usize {
        self.rows.len()
    }
    fn lower(&self) -> &[f64] {
        self.program.lower()
    }
    fn upper(&self) -> &[f64] {
        self.program.upper()
    }
    separable::evaluate_terms!();
}

impl Separable for WorkingRows<'_> {
    fn constant(&self, i: usize) -> f64 {
        self.program.constant(self.function(i))
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        self.program.term(self.function(i), j, x)
    }
}
