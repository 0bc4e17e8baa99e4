//! Settings of an explicit analysis.

use crate::analyses::dynamics::check_times;
use crate::initial_conditions::Assembly;
use crate::integrators::explicit::dop853::DOP853;
use crate::integrators::explicit::tableau::{DOPRI5, Tableau};
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

    fn check(&self) -> Result<()> {
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
pub enum StepControl {
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
#[derive(Clone, Debug, PartialEq)]
pub struct Explicit {
    /// Start in s.
    pub start: f64,
    /// The method.
    pub method: &'static Tableau,
    /// Step sizes.
    pub pace: StepControl,
    /// Assembly of a mechanism's initial positions.
    pub assembly: Assembly,
}

impl Explicit {
    /// Adaptive steps by Dormand and Prince's method of order 5.
    pub fn adaptive(tolerance: f64) -> Self {
        let pace = StepControl::Adaptive { tolerance: Tolerance::same(tolerance), longest: f64::INFINITY };
        Self { start: 0.0, method: &DOPRI5, pace, assembly: Assembly::default() }
    }

    /// Adaptive steps by the method of order 8: the cheaper one from about seven digits on.
    pub fn eighth_order(tolerance: f64) -> Self {
        Self { method: &DOP853, ..Self::adaptive(tolerance) }
    }

    /// The same with other steps.
    pub fn with_pace(self, pace: StepControl) -> Self {
        Self { pace, ..self }
    }

    /// **Errors.** [`Error::Option`] if a setting is out of range, [`Error::Definition`] if times are not increasing.
    pub fn check(&self, times: &[f64]) -> Result<()> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match &self.pace {
            StepControl::Fixed(h) => Error::check_option("time step", "positive", *h, positive(*h))?,
            StepControl::Adaptive { tolerance, longest } => {
                tolerance.check()?;
                Error::check_option("longest step", "positive", *longest, *longest > 0.0)?;
            }
            StepControl::Given(steps) => {
                for &h in steps {
                    Error::check_option("given step", "positive", h, positive(h))?;
                }
            }
        }
        check_times(self.start, times)
    }

    /// **Errors.** [`Error::Length`] if there are tolerances for another number of components than `size`.
    pub fn check_size(&self, size: usize) -> Result<()> {
        if let StepControl::Adaptive { tolerance, .. } = &self.pace {
            for (name, values) in
                [("relative tolerances", &tolerance.relative), ("absolute tolerances", &tolerance.absolute)]
            {
                if values.len() != 1 {
                    Error::check_length(name, size, values.len())?;
                }
            }
        }
        Ok(())
    }
}
