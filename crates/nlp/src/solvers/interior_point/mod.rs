//! A primal–dual interior point method for separable convex programs.
//!
//! | file | content |
//! |---|---|
//! | `central_path` | settings, and Newton's method for a decreasing perturbation μ |
//! | `conditions` | primal and dual variables, and the perturbed optimality conditions |
//! | `newton` | the Newton step |
//! | `condensed_kkt` | the matrix of the Newton step over the variables |
//! | `working_rows` | runs with the violated rows only, for programs with many rows |

mod central_path;
mod condensed_kkt;
mod conditions;
mod newton;
mod working_rows;

pub use central_path::InteriorPoint;

use crate::program::{Program, check_finite, feasible_start, separable_part};
use crate::solution::{Candidate, ProgramStatus, Solution, SubproblemSolver};
use crate::solvers::elastic;
use central_path::ACCEPTED;
use error::{Error, Result};
use std::cell::Cell;

impl InteriorPoint {
    /// One run without relaxation: with the violated rows if there are many rows, and with all rows if that fails.
    fn run_with_fallback(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        if let Some(separable) = program.separable() {
            let start = feasible_start(program, start)?;
            let here = program.gradients(&start)?;
            check_finite(program, &start, &here)?;
            let found = working_rows::solve(self, separable, &start, &here)?;
            if let Some(solution) = found.filter(|solution| solution.status == ProgramStatus::Solved) {
                return Ok(solution);
            }
        }
        self.run(program, start)
    }
}

impl SubproblemSolver for InteriorPoint {
    fn name(&self) -> &'static str {
        "interior point"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let separable = separable_part(program).ok_or_else(|| {
            let why = "the program is neither a sum over its variables nor such a sum plus a quadratic of low rank";
            Error::unsupported("interior point solver", why, "use the automatic solver")
        })?;
        let start = feasible_start(program, start)?;
        let here = program.gradients(&start)?;
        check_finite(program, &start, &here)?;
        let mut solution = match working_rows::solve(self, separable, &start, &here)? {
            Some(solution) => solution,
            None => self.run(program, &start)?,
        };
        if solution.status != ProgramStatus::Solved {
            let total = Cell::new(solution.evaluations);
            let unrelaxed = |p: &dyn Program, x: &[f64]| {
                let solution = self.run_with_fallback(p, x)?;
                total.set(total.get() + solution.evaluations);
                Ok(Candidate::from(solution))
            };
            let found = elastic::resolve(program, &start, solution.into(), &unrelaxed)?;
            let gradients = program.gradients(&found.x)?;
            solution = found.certified(program, &start, total.get(), &gradients, Some(&here.objective));
        }
        Ok(solution.checked(10.0 * ACCEPTED))
    }
}
