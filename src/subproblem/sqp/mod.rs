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
use super::solver::{Candidate, SubproblemSolver, feasible_start};
use super::{Conic, Evaluations, Solution, Status, elastic};
use crate::error::{Error, Result};
use crate::problem::Program;
use argmin::core::Executor;
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
    /// * `tolerance` — largest [`KktResidual`](super::KktResidual) of a solution, in 1e-14 … 1e-2 (1e-10);
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
    fn run(&self, program: &dyn Program, start: &[f64]) -> Result<(Candidate, Evaluations)> {
        let start = feasible_start(program, start)?;
        let limit = self.iterations as u64;
        let executor = Executor::new(program, *self).configure(|s: SqpState| s.start(&start, limit));
        let outcome = executor.ctrlc(false).timer(false).run().map_err(iteration::from_argmin)?;
        let state = outcome.state;
        Ok((state.candidate(), state.evaluations))
    }
}

impl SubproblemSolver for Sqp {
    fn name(&self) -> &'static str {
        "SQP"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let start = feasible_start(program, start)?;
        let (first, evaluations) = self.run(program, &start)?;
        let accepted = (10.0 * self.tolerance).max(1e-7);
        let mut solution = first.clone().judged(program, &start, evaluations)?;
        if solution.status == Status::Stalled && solution.kkt.largest() <= accepted {
            solution.status = Status::Solved;
        }
        if solution.kkt.primal > accepted {
            let total = Cell::new(evaluations);
            let plain = |p: &dyn Program, x: &[f64]| {
                let (mut c, e) = self.run(p, x)?;
                let t = total.get();
                total.set(Evaluations {
                    values: t.values + e.values,
                    gradients: t.gradients + e.gradients,
                    hessians: t.hessians + e.hessians,
                });
                if c.status == Status::Stalled && c.clone().judged(p, x, e)?.kkt.largest() <= accepted {
                    c.status = Status::Solved;
                }
                Ok(c)
            };
            let settled = elastic::settle(program, &solution.x.clone(), first, &plain)?;
            solution = settled.judged(program, &start, total.get())?;
        }
        solution.status = supported(solution.status, &solution.kkt, accepted);
        Ok(solution)
    }
}
