//! Accepting or rejecting a proposed design.

use super::{Outcome, Trial};
use crate::error::{Error, Result};

/// What becomes of a proposed design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Verdict {
    /// It starts the next cycle.
    Accept,
    /// The cycle is repeated from the same design with other move limits.
    Reject,
}

/// A rule that judges trials. Values hold settings only.
pub trait Globalization: Send + Sync + std::fmt::Debug {
    /// Refuses settings out of range.
    fn check(&self) -> Result<()> {
        Ok(())
    }
    /// The verdict on a trial. A trial whose analysis failed never gets here: it is rejected.
    fn judge(&self, trial: &Trial) -> Verdict;
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

    fn judge(&self, trial: &Trial) -> Verdict {
        let error = trial.outcome.map_or(f64::INFINITY, |o| o.error_pct());
        if error > self.reject_above_pct { Verdict::Reject } else { Verdict::Accept }
    }
}

/// A design is rejected only if the approximation errors are too large and constraints are violated too much.
///
/// Where responses change fast, as near a resonance, errors are large although the design is feasible and better;
/// to throw its analysis away and try again nearby costs cycles. The errors still steer the move limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorAndViolation {
    /// E = max(E_f, E_g) in percent above which a violated design is rejected.
    pub error_above_pct: f64,
    /// V in percent above which a design counts as violated.
    pub violation_above_pct: f64,
}

impl Default for ErrorAndViolation {
    fn default() -> Self {
        Self { error_above_pct: 30.0, violation_above_pct: 5.0 }
    }
}

impl Globalization for ErrorAndViolation {
    fn check(&self) -> Result<()> {
        let (error, violation) = (self.error_above_pct, self.violation_above_pct);
        Error::check_option("error above which a cycle is rejected", "positive", error, error > 0.0)?;
        Error::check_option("violation above which a cycle is rejected", "not negative", violation, violation >= 0.0)
    }

    fn judge(&self, trial: &Trial) -> Verdict {
        let bad = |o: Outcome| o.error_pct() > self.error_above_pct && o.violation_pct > self.violation_above_pct;
        if trial.outcome.is_none_or(bad) { Verdict::Reject } else { Verdict::Accept }
    }
}

/// Every design that can be analysed is accepted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AcceptAlways;

impl Globalization for AcceptAlways {
    fn judge(&self, _: &Trial) -> Verdict {
        Verdict::Accept
    }
}
