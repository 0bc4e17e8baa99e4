//! Many rows, few of them active: rows are taken in as they are violated.
//!
//! A convex program whose solution with some of its rows satisfies the others is solved. Each round costs one evaluation of all
//! rows and a small program.

use super::{ACCEPTED, InteriorPoint, Run};
use crate::separable::{self, Separable, Term};
use crate::solver::Candidate;
use crate::variable_scale;
use crate::{Evaluations, Status};
use crate::{Gradients, Program};
use error::Result;

/// Rounds until all rows are taken at once.
const ROUNDS: usize = 40;
/// Violation, in units of the row, that calls for it.
const VIOLATED: f64 = 1e-10;

/// The program with some of its rows.
struct Kept<'a> {
    program: &'a dyn Separable,
    rows: Vec<usize>,
}

impl Kept<'_> {
    /// Function 0 is the objective.
    fn function(&self, i: usize) -> usize {
        i.checked_sub(1).map_or(0, |k| self.rows[k] + 1)
    }
}

/// The outcome by rounds; none where rows are few or equalities, or variables coupled. A round that fails, as where no point is feasible, ends it:
/// the status is then not that of a solution.
///
/// `here` are the gradients at `start`, which is within the bounds.
pub(super) fn solve(
    solver: &InteriorPoint,
    program: &dyn Separable,
    start: &[f64],
    here: &Gradients,
) -> Result<Option<Run>> {
    let (n, m) = (program.variables(), program.rows());
    let first = 4 * n + 4;
    if m <= 4 * first || program.coupled().is_some() || (0..m).any(|i| program.is_equality(i)) {
        return Ok(None);
    }
    let scale: Vec<f64> =
        (0..n).map(|j| variable_scale(program.lower()[j], program.upper()[j], start[j], start[j])).collect();
    let mut units = vec![0.0f64; m];
    for j in 0..n {
        units.iter_mut().zip(here.rows.column(j).iter()).for_each(|(u, g)| *u = u.max((scale[j] * g).abs()));
    }
    units.iter_mut().filter(|u| **u == 0.0).for_each(|u| *u = 1.0);
    let mut kept = Kept { program, rows: worst(&here.values.rows, &units, f64::NEG_INFINITY, first) };
    let (mut x, mut iterations, mut evaluations) = (start.to_vec(), 0, Evaluations::default());
    for _ in 0..ROUNDS {
        let run = solver.run(&kept, &x)?.solution;
        iterations += run.iterations;
        evaluations = evaluations + run.evaluations;
        let solved = run.status == Status::Solved;
        let values = program.values(&run.x)?;
        let added = worst(&values.rows, &units, VIOLATED, first / 2);
        let fresh: Vec<usize> = added.into_iter().filter(|i| !kept.rows.contains(i)).collect();
        if fresh.is_empty() || !solved {
            let mut multipliers = vec![0.0; m];
            kept.rows.iter().zip(&run.multipliers).for_each(|(&i, λ)| multipliers[i] = *λ);
            let candidate = Candidate { multipliers, iterations, relaxation: None, ..Candidate::from(run) };
            let gradients = program.gradients(&candidate.x)?;
            let first = here.objective.clone();
            let mut solution = candidate.certified(program, start, evaluations, &gradients, Some(&first));
            let good = solved && solution.kkt.largest() <= ACCEPTED;
            solution.status = if good { Status::Solved } else { Status::Stalled };
            return Ok(Some(Run { solution, first }));
        }
        kept.rows.extend(fresh);
        x = run.x;
    }
    Ok(None)
}

/// The rows above `least` in their units, the worst first, at most `count`.
fn worst(values: &[f64], units: &[f64], least: f64, count: usize) -> Vec<usize> {
    let measure = |i: &usize| values[*i] / units[*i];
    let mut rows: Vec<usize> = (0..values.len()).filter(|i| measure(i) > least).collect();
    if rows.len() > count {
        rows.select_nth_unstable_by(count, |a, b| measure(b).total_cmp(&measure(a)).then(a.cmp(b)));
        rows.truncate(count);
    }
    rows.sort_unstable_by(|a, b| measure(b).total_cmp(&measure(a)).then(a.cmp(b)));
    rows
}

impl Program for Kept<'_> {
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

impl Separable for Kept<'_> {
    fn constant(&self, i: usize) -> f64 {
        self.program.constant(self.function(i))
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        self.program.term(self.function(i), j, x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_rows_come_first_and_ties_are_in_order() {
        let values = [0.5, -1.0, 2.0, 0.5, 3.0];
        assert_eq!(worst(&values, &[1.0, 1.0, 1.0, 1.0, 10.0], 0.0, 3), [2, 0, 3]);
        assert_eq!(worst(&values, &[1.0; 5], 0.0, 9), [4, 2, 0, 3]);
    }
}
