//! Settings of an explicit analysis.

use super::DOP853;
use super::tableau::{DOPRI5, Tableau};
use crate::analysis::start::Assembly;
use crate::{Error, Result};

/// Tolerated local error of component i: absoluteᵢ + relativeᵢ |yᵢ|.
///
/// One number stands for all components. The components of a mechanism are the positions of its coordinates in m or
/// rad and then their velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Relative to the component's size.
    pub relative: Vec<f64>,
    /// In the component's unit.
    pub absolute: Vec<f64>,
}

impl Tolerance {
    /// The same number for all components, relative and absolute.
    pub fn same(tolerance: f64) -> Self {
        Self { relative: vec![tolerance], absolute: vec![tolerance] }
    }

    /// Tolerated error of component `i` whose size is `size`.
    #[inline]
    pub fn at(&self, i: usize, size: f64) -> f64 {
        let pick = |values: &[f64]| if values.len() == 1 { values[0] } else { values[i] };
        pick(&self.absolute) + pick(&self.relative) * size
    }

    fn check(&self, size: usize) -> Result<()> {
        for (name, values) in [("relative tolerances", &self.relative), ("absolute tolerances", &self.absolute)] {
            if values.len() != 1 {
                Error::check_length(name, size, values.len())?;
            }
        }
        for &x in &self.relative {
            Error::check_option("relative tolerance", "from 0 to 1", x, (0.0..1.0).contains(&x))?;
        }
        for &x in &self.absolute {
            Error::check_option("absolute tolerance", "positive", x, x > 0.0 && x.is_finite())?;
        }
        Ok(())
    }
}

/// How long the steps are.
#[derive(Clone, Debug, PartialEq)]
pub enum Pace {
    /// Steps of this length in s.
    Fixed(f64),
    /// Steps chosen so that the local error stays below a tolerance.
    Adaptive {
        /// Tolerated local error.
        tolerance: Tolerance,
        /// Longest step in s.
        longest: f64,
    },
    /// These steps in s, one after another: those of an earlier run, for instance.
    Given(Vec<f64>),
}

/// Settings of an explicit analysis.
#[derive(Clone, Debug)]
pub struct Explicit {
    /// Start in s.
    pub start: f64,
    /// The method.
    pub method: &'static Tableau,
    /// Step sizes.
    pub pace: Pace,
    /// Assembly of a mechanism's initial positions.
    pub assembly: Assembly,
}

impl Explicit {
    /// Adaptive steps by the method for high accuracy, that of order 8.
    pub fn adaptive(tolerance: f64) -> Self {
        Self::dop853(tolerance)
    }

    /// Order 8 with adaptive steps.
    pub fn dop853(tolerance: f64) -> Self {
        let pace = Pace::Adaptive { tolerance: Tolerance::same(tolerance), longest: f64::INFINITY };
        Self { start: 0.0, method: &DOP853, pace, assembly: Assembly::default() }
    }

    /// Order 5 with adaptive steps.
    pub fn dopri5(tolerance: f64) -> Self {
        Self { method: &DOPRI5, ..Self::dop853(tolerance) }
    }

    /// The same with other steps.
    pub fn with_pace(self, pace: Pace) -> Self {
        Self { pace, ..self }
    }

    /// **Errors.** [`Error::Option`] or [`Error::Length`] if a setting does not fit `size` components,
    /// [`Error::Definition`] if times are not increasing.
    pub fn check(&self, size: usize, times: &[f64]) -> Result<()> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match &self.pace {
            Pace::Fixed(h) => Error::check_option("time step", "positive", *h, positive(*h))?,
            Pace::Adaptive { tolerance, longest } => {
                tolerance.check(size)?;
                Error::check_option("longest step", "positive", *longest, *longest > 0.0)?;
            }
            Pace::Given(steps) => {
                for &h in steps {
                    Error::check_option("given step", "positive", h, positive(h))?;
                }
            }
        }
        let first = times.first().copied().unwrap_or(self.start);
        Error::check_option("first output time", "not before the start", first, first >= self.start)?;
        if let Some(pair) = times.windows(2).find(|pair| !(pair[0] < pair[1])) {
            let why = format!("{} s is followed by {} s", pair[0], pair[1]);
            return Err(Error::definition("output times", why, "give increasing times"));
        }
        let last = times.last().copied().unwrap_or(self.start);
        Error::check_option("last output time", "finite", last, last.is_finite())
    }
}
