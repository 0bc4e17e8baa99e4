//! Design variables and their bounds.

use error::{Error, Readable, Result};

/// A design variable b with bounds bˡ ≤ b ≤ bᵘ (equation 3) and a start value.
///
/// ```
/// use linkwright_optimization::problem::DesignVariable;
/// let k = DesignVariable::new("stiffness", "N/m", 1.0).within(1e-6, 2.0);
/// assert_eq!((k.start, k.lower, k.upper), (1.0, 1e-6, 2.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DesignVariable {
    /// Name, unique in the problem.
    pub name: String,
    /// Unit, for tables and axes.
    pub unit: String,
    /// Start value, in the unit.
    pub start: f64,
    /// Lower bound, in the unit; −∞ for none.
    pub lower: f64,
    /// Upper bound, in the unit; ∞ for none.
    pub upper: f64,
}

/// Size at and above which a bound counts as absent.
const NO_BOUND: f64 = 1e15;

impl DesignVariable {
    /// A variable without bounds.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, start: f64) -> Self {
        Self { name: name.into(), unit: unit.into(), start, lower: f64::NEG_INFINITY, upper: f64::INFINITY }
    }

    /// Replaces the bounds; ∓∞ for none, for which other programs write numbers of 10¹⁵ and more.
    #[must_use]
    pub fn within(self, lower: f64, upper: f64) -> Self {
        let lower = if lower <= -NO_BOUND { f64::NEG_INFINITY } else { lower };
        let upper = if upper >= NO_BOUND { f64::INFINITY } else { upper };
        Self { lower, upper, ..self }
    }

    /// Checks that the lower bound is at most the upper one, and that the start is between them.
    pub(super) fn check(&self) -> Result<()> {
        let Self { name, lower, upper, .. } = self;
        let what = format!("design variable `{name}`");
        if !(lower <= upper) || *lower == f64::INFINITY || *upper == f64::NEG_INFINITY {
            let why = format!(
                "the lower bound {} and the upper bound {} contain no value",
                Readable(*lower),
                Readable(*upper)
            );
            return Err(Error::definition(what, why, "give a lower bound that is at most the upper bound"));
        }
        self.check_start(self.start)
    }

    /// Checks that the start is a number within the bounds.
    pub(super) fn check_start(&self, start: f64) -> Result<()> {
        let Self { name, lower, upper, .. } = self;
        if start.is_finite() && (*lower..=*upper).contains(&start) {
            return Ok(());
        }
        let [start, lower, upper] = [start, *lower, *upper].map(Readable);
        let why = format!("the start {start} is not a number within the bounds [{lower}, {upper}]");
        Err(Error::definition(format!("design variable `{name}`"), why, "move the start inside or widen the bounds"))
    }
}
