//! Solver states for argmin's `Executor`.

use crate::ProgramStatus;
use argmin::core::{Executor, KV, Solver, State, TerminationReason, TerminationStatus};
use error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::time::Duration;

/// Iterations, evaluation counts, wall time and stop reason, as recorded by argmin's `Executor`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct ExecutorRecord {
    pub iteration: u64,
    pub limit: u64,
    pub counts: HashMap<String, u64>,
    pub elapsed: Option<Duration>,
    pub termination: TerminationStatus,
}

/// Result of `init` and `next_iter` of argmin's `Solver` for a state `I`.
pub(super) type IterationResult<I> = Result<(I, Option<KV>), argmin::core::Error>;

/// Runs `solver` on `problem` from the state `start`, without signal handler and timer.
pub(super) fn run<P, S: Solver<P, I>, I: State>(problem: P, solver: S, start: I) -> Result<I> {
    let executor = Executor::new(problem, solver).configure(|_| start);
    Ok(executor.ctrlc(false).timer(false).run().map_err(from_argmin)?.state)
}

/// Converts the status of a solver to argmin's termination status; no status means not terminated.
pub(super) fn termination(status: Option<ProgramStatus>) -> TerminationStatus {
    match status {
        None => TerminationStatus::NotTerminated,
        Some(ProgramStatus::Solved) => TerminationStatus::Terminated(TerminationReason::SolverConverged),
        Some(other) => TerminationStatus::Terminated(TerminationReason::SolverExit(other.to_string())),
    }
}

/// The linkwright error inside an argmin error.
fn from_argmin(e: argmin::core::Error) -> Error {
    e.downcast::<Error>().unwrap_or_else(|e| Error::Subproblem {
        solver: "argmin",
        status: e.to_string(),
        iterations: 0,
        remedy: "report this as a bug",
    })
}

/// Implements argmin's `State` for a type with `Default` and the field `record: ExecutorRecord`, given the names of the
/// fields of its point and its cost.
///
/// The current point is also the best one: solvers compare points by a merit function, not by the objective alone.
macro_rules! impl_argmin_state {
    ($t:ty, $($point:ident).+, $cost:ident) => {
        impl argmin::core::State for $t {
            type Param = Vec<f64>;
            type Float = f64;

            fn new() -> Self {
                let mut state = Self::default();
                state.record.limit = u64::MAX;
                state
            }
            fn update(&mut self) {}
            fn get_param(&self) -> Option<&Vec<f64>> {
                Some(&self.$($point).+)
            }
            fn get_best_param(&self) -> Option<&Vec<f64>> {
                Some(&self.$($point).+)
            }
            fn get_max_iters(&self) -> u64 {
                self.record.limit
            }
            fn increment_iter(&mut self) {
                self.record.iteration += 1;
            }
            fn get_iter(&self) -> u64 {
                self.record.iteration
            }
            fn get_cost(&self) -> f64 {
                self.$cost
            }
            fn get_best_cost(&self) -> f64 {
                self.$cost
            }
            fn get_target_cost(&self) -> f64 {
                f64::NEG_INFINITY
            }
            fn func_counts<O>(&mut self, problem: &argmin::core::Problem<O>) {
                self.record.counts = problem.counts.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect();
            }
            fn get_func_counts(&self) -> &std::collections::HashMap<String, u64> {
                &self.record.counts
            }
            fn time(&mut self, time: Option<std::time::Duration>) -> &mut Self {
                self.record.elapsed = time;
                self
            }
            fn get_time(&self) -> Option<std::time::Duration> {
                self.record.elapsed
            }
            fn get_last_best_iter(&self) -> u64 {
                self.record.iteration
            }
            fn is_best(&self) -> bool {
                true
            }
            fn terminate_with(mut self, reason: argmin::core::TerminationReason) -> Self {
                self.record.termination = argmin::core::TerminationStatus::Terminated(reason);
                self
            }
            fn get_termination_status(&self) -> &argmin::core::TerminationStatus {
                &self.record.termination
            }
            fn get_termination_reason(&self) -> Option<&argmin::core::TerminationReason> {
                match &self.record.termination {
                    argmin::core::TerminationStatus::Terminated(reason) => Some(reason),
                    argmin::core::TerminationStatus::NotTerminated => None,
                }
            }
        }
    };
}
pub(super) use impl_argmin_state;
