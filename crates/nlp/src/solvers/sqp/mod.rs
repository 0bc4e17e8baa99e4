//! Sequential quadratic programming: Newton's method on the optimality conditions, for any smooth program.
//!
//! | file | content |
//! |---|---|
//! | `state` | settings and state |
//! | `curvature` | damped BFGS, or the exact Hessian made convex |
//! | `least_squares` | multipliers from the gradients at a point alone |
//! | `quadratic_subproblem` | the quadratic program of an iteration, relaxed if it has no feasible point |
//! | `merit` | the merit function and the line search |
//! | `negative_curvature` | steps from points where the violation is stationary to first order |
//! | `iteration` | one iteration, as an argmin `Solver` |

mod curvature;
mod iteration;
mod least_squares;
mod merit;
mod negative_curvature;
mod quadratic_subproblem;
mod state;

pub use least_squares::least_squares_multipliers;
pub use state::{Curvature, Sqp, SqpState};

use crate::program::{Gradients, Program, check_finite, feasible_start};
use crate::solution::{Candidate, Evaluations, ProgramStatus, Solution, SubproblemSolver};
use crate::solvers::scaling::Normalized;
use crate::solvers::{argmin_state, elastic};
use argmin::core::Executor;
use error::Result;
use std::cell::Cell;

impl Sqp {
    /// This solver on `program` as an argmin `Executor`, for observers, checkpoints, timing and a time limit.
    ///
    /// Unlike [`SubproblemSolver::solve`], the run neither scales the program nor relaxes an infeasible one. Its
    /// iteration limit is that of the settings. [`SqpState::solution`] converts the final state into a [`Solution`].
    ///
    /// # Errors
    /// As [`SubproblemSolver::solve`] for a start with a wrong length or an entry that is not finite.
    ///
    /// # Examples
    /// ```
    /// use argmin::core::{State, TerminationReason};
    /// use linkwright_nlp::{QuadraticProgram, Sqp, ProgramStatus};
    /// use nalgebra::DMatrix;
    /// // min (x − 1)² + y²  subject to  x + y ≥ 2
    /// let program = QuadraticProgram::new(vec![-2.0, 0.0])
    ///     .hessian(DMatrix::identity(2, 2) * 2.0)
    ///     .at_most(&[-1.0, -1.0], -2.0);
    /// let result = Sqp::default().executor(&program, &[0.0, 0.0])?.timer(true).run().expect("it can be evaluated");
    /// assert_eq!(result.state.get_termination_reason(), Some(&TerminationReason::SolverConverged));
    /// let solution = result.state.solution(&program);
    /// assert_eq!(solution.status, ProgramStatus::Solved);
    /// assert!((solution.x[0] - 1.5).abs() < 1e-9 && (solution.x[1] - 0.5).abs() < 1e-9);
    /// # Ok::<(), linkwright_nlp::Error>(())
    /// ```
    pub fn executor<'a>(
        &self,
        program: &'a dyn Program,
        start: &[f64],
    ) -> Result<Executor<&'a dyn Program, Self, SqpState>> {
        let start = feasible_start(program, start)?;
        let limit = self.iterations as u64;
        Ok(Executor::new(program, *self).configure(|state| state.start(&start, limit)).ctrlc(false))
    }

    /// One run without relaxation, and the objective's gradient at its start.
    fn run(&self, program: &dyn Program, start: &[f64]) -> Result<(Solution, Vec<f64>)> {
        let start = feasible_start(program, start)?;
        let here = program.gradients(&start)?;
        check_finite(program, &start, &here)?;
        let start_gradient = here.objective.clone();
        let normalized = Normalized::new(program, &start, &here);
        let state = self.run_normalized(&normalized, &start, here)?;
        let gradients = normalized.gradients_in_units(state.gradients());
        let candidate = normalized.restore(state.candidate());
        let solution = candidate.certified(program, &start, state.evaluations, &gradients, Some(&start_gradient));
        Ok((self.accept_small_residual(solution), start_gradient))
    }

    fn run_normalized(&self, program: &Normalized<'_>, start: &[f64], here: Gradients) -> Result<SqpState> {
        let z = program.to_normalized(start);
        let first = SqpState { known_gradients: Some(program.normalized_gradients(here)), ..SqpState::default() };
        argmin_state::run(program as &dyn Program, *self, first.start(&z, self.iterations as u64))
    }

    fn accept_small_residual(&self, mut s: Solution) -> Solution {
        if matches!(s.status, ProgramStatus::Stalled | ProgramStatus::IterationLimit)
            && s.kkt.largest() <= self.accepted()
        {
            s.status = ProgramStatus::Solved;
        }
        s
    }
}

impl SubproblemSolver for Sqp {
    fn name(&self) -> &'static str {
        "SQP"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let (mut solution, start_gradient) = self.run(program, start)?;
        if solution.kkt.primal > self.accepted() {
            let total = Cell::new(solution.evaluations);
            let unrelaxed = |p: &dyn Program, x: &[f64]| {
                let (solution, _) = self.run(p, x)?;
                total.set(total.get() + solution.evaluations);
                Ok(Candidate::from(solution))
            };
            let x = solution.x.clone();
            let found = elastic::resolve(program, &x, solution.into(), &unrelaxed)?;
            let gradients = program.gradients(&found.x)?;
            let evaluations = total.get() + Evaluations { gradients: 1, ..Evaluations::default() };
            let start = feasible_start(program, start)?;
            solution = found.certified(program, &start, evaluations, &gradients, Some(&start_gradient));
        }
        Ok(solution.checked(self.accepted()))
    }
}
