//! Sequential quadratic programming: Newton's method on the optimality conditions, for any smooth program.
//!
//! | file | what it does |
//! |---|---|
//! | `state` | everything that changes during a run |
//! | `curvature` | damped BFGS, or the exact Hessian made convex |
//! | `step` | the quadratic program of an iteration, relaxed where it has no feasible point |
//! | `merit` | the merit function and the search along a step |
//! | `iteration` | one iteration, as an argmin `Solver` |

mod curvature;
mod iteration;
mod merit;
mod state;
mod step;

use super::kkt::supported;
use super::normalized::{LinearizedRows, Normalized};
use super::solver::{Candidate, SubproblemSolver, check_finite, feasible_start};
use super::{Conic, Evaluations, Solution, Status, elastic};
use crate::Program;
use argmin::core::Executor;
use error::{Error, Result};
pub(super) use iteration::from_argmin;
pub use state::SqpState;
use std::cell::Cell;

/// Where the curvature of the Lagrangian comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Curvature {
    /// The program's exact Hessian where it gives one, damped BFGS otherwise.
    #[default]
    Exact,
    /// Damped BFGS always.
    QuasiNewton,
}

/// The solver of smooth programs.
///
/// Each iteration solves a quadratic program through [`Conic`]; the step is accepted by the merit function f + ρ·max(gᵢ)⁺
/// after a second-order correction or shortening. Linearized rows without a common point are relaxed. An evaluation
/// that fails on the way shortens the step. It is also an argmin `Solver`, so that argmin's observers and
/// checkpoints apply: `Executor::new(&program as &dyn Program, Sqp::default())`.
///
/// **Source.** Nocedal & Wright, *Numerical Optimization*, 2nd ed., algorithm 18.3; Powell (1978) for the damping.
///
/// **Guarantees.** A local solution only: start several times where there are more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sqp {
    tolerance: f64,
    iterations: usize,
    curvature: Curvature,
    conic: Conic,
}

impl Default for Sqp {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations: 200, curvature: Curvature::Exact, conic: Conic::default() }
    }
}

impl Sqp {
    /// With settings:
    ///
    /// * `tolerance` — largest [`KktResidual`](super::KktResidual) of a solution, in 1e-14 … 1e-2 (1e-10); where rounding lets
    ///   the merit function fall no further, ten times this, or 1e-7 if that is more, counts as solved;
    /// * `iterations` — limit, at least 1 (200);
    /// * `curvature` — exact where given, or BFGS always.
    ///
    /// **Errors.** [`Error::Option`] outside these ranges.
    pub fn new(tolerance: f64, iterations: usize, curvature: Curvature) -> Result<Self> {
        let good = (1e-14..=1e-2).contains(&tolerance);
        Error::check_option("tolerance of the SQP solver", "between 1e-14 and 1e-2", tolerance, good)?;
        Error::check_option("iterations of the SQP solver", "at least 1", iterations as f64, iterations >= 1)?;
        Ok(Self { tolerance, iterations, curvature, ..Self::default() })
    }

    /// One run without relaxation of the program as a whole.
    fn run(&self, program: &dyn Program, start: &[f64]) -> Result<Run> {
        let start = feasible_start(program, start)?;
        let here = program.gradients(&start)?;
        check_finite(program, &start, &here)?;
        let first = here.objective.clone();
        let normalized = Normalized::new(program, &start, &here);
        let z = normalized.inward(&start);
        let limit = self.iterations as u64;
        let known = LinearizedRows { program: &normalized, at: &z, gradients: normalized.of(here) };
        let executor = Executor::new(&known as &dyn Program, *self).configure(|s: SqpState| s.start(&z, limit));
        let state = executor.ctrlc(false).timer(false).run().map_err(iteration::from_argmin)?.state;
        let gradients = normalized.undo(state.gradients());
        let evaluations = state.evaluations;
        let solution =
            normalized.restore(state.candidate()).certified(program, &start, evaluations, &gradients, Some(&first));
        Ok(Run { solution: self.lenient(solution), first })
    }

    /// The residual up to which a run that can do no more counts as solved.
    fn accepted(&self) -> f64 {
        (10.0 * self.tolerance).max(1e-7)
    }

    fn lenient(&self, mut s: Solution) -> Solution {
        if matches!(s.status, Status::Stalled | Status::IterationLimit) && s.kkt.largest() <= self.accepted() {
            s.status = Status::Solved;
        }
        s
    }
}

/// A solution of one run, and the objective's slope at its start.
struct Run {
    solution: Solution,
    first: Vec<f64>,
}

impl SubproblemSolver for Sqp {
    fn name(&self) -> &'static str {
        "SQP"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let run = self.run(program, start)?;
        let mut solution = run.solution;
        if solution.kkt.primal > self.accepted() {
            let total = Cell::new(solution.evaluations);
            let plain = |p: &dyn Program, x: &[f64]| {
                let run = self.run(p, x)?;
                total.set(total.get() + run.solution.evaluations);
                Ok(Candidate::from(run.solution))
            };
            let x = solution.x.clone();
            let settled = elastic::settle(program, &x, solution.into(), &plain)?;
            let gradients = program.gradients(&settled.x)?;
            let evaluations = total.get() + Evaluations { gradients: 1, ..Evaluations::default() };
            let start = feasible_start(program, start)?;
            solution = settled.certified(program, &start, evaluations, &gradients, Some(&run.first));
        }
        solution.status = supported(solution.status, &solution.kkt, self.accepted());
        Ok(solution)
    }
}
