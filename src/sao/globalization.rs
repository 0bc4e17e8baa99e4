//! Accepting or rejecting a proposed design.

use super::{Guard, Trial};
use crate::error::{Error, Result};
use crate::problem::{Evaluation, Problem};

/// What becomes of a proposed design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Verdict {
    /// It starts the next cycle.
    Accept,
    /// The cycle is repeated from the same design with other move limits.
    Reject,
    /// The cycle is repeated from the same design with the same move limits and more conservatism.
    Tighten,
}

/// A rule that judges trials. Values hold settings only; what it remembers is in the [`Guard`] of the state.
pub trait Globalization: Send + Sync + std::fmt::Debug {
    /// Refuses settings out of range.
    fn check(&self) -> Result<()> {
        Ok(())
    }
    /// What is remembered of the start design.
    fn start(&self, _problem: &Problem, _first: &Evaluation) -> Guard {
        Guard::default()
    }
    /// The verdict on a trial. A trial whose analysis failed never gets here: it is rejected.
    fn judge(&self, trial: &Trial, guard: &mut Guard) -> Verdict;
}

/// The paper's rule: a design is accepted unless the approximation errors there are too large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBased {
    /// E = max(E_f, E_g) in percent above which the cycle is rejected. In the paper's tables 28.7 is accepted, 41.6 is not.
    pub reject_above_pct: f64,
}

impl Default for ErrorBased {
    fn default() -> Self {
        Self { reject_above_pct: 30.0 }
    }
}

impl Globalization for ErrorBased {
    fn check(&self) -> Result<()> {
        let limit = self.reject_above_pct;
        Error::check_option("error above which a cycle is rejected", "positive", limit, limit > 0.0)
    }

    fn judge(&self, trial: &Trial, _: &mut Guard) -> Verdict {
        let error = trial.outcome.as_ref().map_or(f64::INFINITY, |o| o.error_pct());
        if error > self.reject_above_pct { Verdict::Reject } else { Verdict::Accept }
    }
}

/// Every design that can be analysed is accepted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AcceptAlways;

impl Globalization for AcceptAlways {
    fn judge(&self, _: &Trial, _: &mut Guard) -> Verdict {
        Verdict::Accept
    }
}
