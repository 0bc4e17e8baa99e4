//! What argmin wants to know of every state, for states that hold one point.

use argmin::core::TerminationStatus;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::time::Duration;

/// Counters and the end of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Bookkeeping {
    pub iteration: u64,
    pub limit: u64,
    pub counts: HashMap<String, u64>,
    pub elapsed: Option<Duration>,
    pub termination: TerminationStatus,
}

/// Implements argmin's `State` for a type with the field `book: Bookkeeping` and `Default`, given the fields of its point
/// and its cost. There is one point, and it is the best: what is better is decided by a merit function, not by the
/// objective alone.
macro_rules! impl_argmin_state {
    ($t:ty, $point:ident, $cost:ident) => {
        impl argmin::core::State for $t {
            type Param = Vec<f64>;
            type Float = f64;

            fn new() -> Self {
                let mut state = Self::default();
                state.book.limit = u64::MAX;
                state
            }
            fn update(&mut self) {}
            fn get_param(&self) -> Option<&Vec<f64>> {
                Some(&self.$point)
            }
            fn get_best_param(&self) -> Option<&Vec<f64>> {
                Some(&self.$point)
            }
            fn get_max_iters(&self) -> u64 {
                self.book.limit
            }
            fn increment_iter(&mut self) {
                self.book.iteration += 1;
            }
            fn get_iter(&self) -> u64 {
                self.book.iteration
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
                self.book.counts = problem.counts.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect();
            }
            fn get_func_counts(&self) -> &std::collections::HashMap<String, u64> {
                &self.book.counts
            }
            fn time(&mut self, time: Option<std::time::Duration>) -> &mut Self {
                self.book.elapsed = time;
                self
            }
            fn get_time(&self) -> Option<std::time::Duration> {
                self.book.elapsed
            }
            fn get_last_best_iter(&self) -> u64 {
                self.book.iteration
            }
            fn is_best(&self) -> bool {
                true
            }
            fn terminate_with(mut self, reason: argmin::core::TerminationReason) -> Self {
                self.book.termination = argmin::core::TerminationStatus::Terminated(reason);
                self
            }
            fn get_termination_status(&self) -> &argmin::core::TerminationStatus {
                &self.book.termination
            }
            fn get_termination_reason(&self) -> Option<&argmin::core::TerminationReason> {
                match &self.book.termination {
                    argmin::core::TerminationStatus::Terminated(reason) => Some(reason),
                    argmin::core::TerminationStatus::NotTerminated => None,
                }
            }
        }
    };
}
pub(super) use impl_argmin_state;
