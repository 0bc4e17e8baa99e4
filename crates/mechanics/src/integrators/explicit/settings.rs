//! Settings of explicit methods.

use crate::initial_conditions::Assembly;
use crate::integrators::explicit::dop853::DOP853;
use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::tableau::{DOPRI5, Tableau};
use crate::integrators::settings::check_times;
use crate::{Error, Result};
use std::sync::Arc;

/// Tolerances of the local error of component i: absoluteᵢ + relativeᵢ |yᵢ|.
///
/// A vector of length one applies to all components. The components of a mechanism are the positions of its coordinates in
/// m or rad, followed by their velocities; in relative coordinates, the joint coordinates and their velocities.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Relative tolerances.
    pub relative: Vec<f64>,
    /// Absolute tolerances in the units of the components.
    pub absolute: Vec<f64>,
}

impl Tolerance {
    /// Tolerances of all components, relative and absolute, with the same value.
    pub fn same(tolerance: f64) -> Self {
        Self { relative: vec![tolerance], absolute: vec![tolerance] }
    }

    /// Tolerated error of component `i` with the absolute value `size`.
    #[inline]
    pub fn at(&self, i: usize, size: f64) -> f64 {
        let pick = |values: &[f64]| if values.len() == 1 { values[0] } else { values[i] };
        pick(&self.absolute) + pick(&self.relative) * size
    }

    /// Checks the ranges of the tolerances.
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

/// Choice of the unknowns of a mechanism in explicit steps.
///
/// Open chains and trees of rigid bodies have joint angles and displacements as unknowns in relative coordinates, and Euler
/// parameters of spherical joints and of free bodies in space: fewer of them, no constraints that drift, and a cost per step that is
/// proportional to the number of bodies. Outputs and their derivatives are the same up to the tolerance of the steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Coordinates {
    /// Relative coordinates for open chains and trees, otherwise absolute ones.
    #[default]
    Automatic,
    /// Position and rotation of every body, with constraints.
    Absolute,
    /// Joint angles and displacements. Joints that close loops, and other constraints, are cut: they remain constraints. An error names
    /// the part of a mechanism that is not supported: beams, contacts, events.
    Relative,
}

impl Coordinates {
    /// The name of the choice.
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "automatic",
            Self::Absolute => "absolute",
            Self::Relative => "relative",
        }
    }
}

/// Choice of the step lengths.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepControl {
    /// Steps of this length in s.
    Fixed(f64),
    /// Steps whose local error is below a tolerance.
    Adaptive {
        /// Tolerated local error.
        tolerance: Tolerance,
        /// Longest step in s.
        longest: f64,
    },
    /// Given steps in s, for example those of an earlier simulation. An event in a step splits it.
    Given(Vec<f64>),
    /// The steps of an earlier simulation of another design, for differences: the contacts of a step are closed or open as they were.
    Taken(Vec<ReplayedStep>),
}

/// A step of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplayedStep {
    /// Length in s.
    pub length: f64,
    /// Signs of the switching functions of all elements along the step, true for positive ones.
    pub sides: Vec<bool>,
    /// Distribution of the stages.
    pub grading: Grading,
}

/// Settings of an explicit method.
#[derive(Clone, Debug, PartialEq)]
pub struct Explicit {
    /// Start in s.
    pub start: f64,
    /// Integration method.
    pub method: &'static Tableau,
    /// Choice of the step lengths.
    pub step_control: StepControl,
    /// Assembly of a mechanism's initial positions.
    pub assembly: Assembly,
    /// Choice of a mechanism's unknowns.
    pub coordinates: Coordinates,
    /// End of the motion in s, which adaptive steps end at; by default the last output time.
    pub end: Option<f64>,
    /// Times in s, increasing, at which long adaptive steps are inspected; by default the output times.
    pub inspected: Option<Arc<[f64]>>,
}

impl Explicit {
    /// Adaptive steps by the method of Dormand and Prince of order 5, for `tolerance` above about 1e-7.
    pub fn adaptive(tolerance: f64) -> Self {
        let step_control = StepControl::Adaptive { tolerance: Tolerance::same(tolerance), longest: f64::INFINITY };
        Self {
            start: 0.0,
            method: &DOPRI5,
            step_control,
            assembly: Assembly::default(),
            coordinates: Coordinates::Automatic,
            end: None,
            inspected: None,
        }
    }

    /// Adaptive steps by the method of order 8, which is cheaper for `tolerance` below about 1e-7.
    pub fn eighth_order(tolerance: f64) -> Self {
        Self { method: &DOP853, ..Self::adaptive(tolerance) }
    }

    /// Replaces the choice of the unknowns.
    pub fn with_coordinates(self, coordinates: Coordinates) -> Self {
        Self { coordinates, ..self }
    }

    /// Replaces the end of the motion. Up to earlier output times, the steps are then those of the whole motion to the time `end` (s),
    /// with the same events.
    pub fn with_end(self, end: f64) -> Self {
        Self { end: Some(end), ..self }
    }

    /// Replaces the times (s, increasing) at which long adaptive steps are inspected. The steps are then those of a motion with outputs at
    /// these times, for any output times.
    pub fn with_inspected_times(self, times: &[f64]) -> Self {
        Self { inspected: Some(times.into()), ..self }
    }

    /// End of the motion in s, at the last of the output `times` (s) or after it.
    pub fn end_after(&self, times: &[f64]) -> f64 {
        let last = times.last().copied().unwrap_or(self.start);
        self.end.map_or(last, |end| end.max(last))
    }

    /// Returns whether each component has its own tolerance.
    pub(crate) fn has_tolerance_vectors(&self) -> bool {
        match &self.step_control {
            StepControl::Adaptive { tolerance, .. } => tolerance.relative.len() != 1 || tolerance.absolute.len() != 1,
            _ => false,
        }
    }

    /// Replaces the choice of the step lengths. If each component had its own tolerance, which belongs to absolute coordinates, the
    /// unknowns stay absolute.
    pub fn with_step_control(self, step_control: StepControl) -> Self {
        let is_absolute = self.coordinates == Coordinates::Automatic && self.has_tolerance_vectors();
        let coordinates = if is_absolute { Coordinates::Absolute } else { self.coordinates };
        Self { step_control, coordinates, ..self }
    }

    /// Bounds adaptive steps by the length `longest` in s.
    pub fn with_longest_step(mut self, longest: f64) -> Self {
        if let StepControl::Adaptive { longest: bound, .. } = &mut self.step_control {
            *bound = longest;
        }
        self
    }

    /// Checks the settings, and that the output `times` (s) increase.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] if a setting is out of range, [`Error::Definition`] if the times do not increase.
    pub fn check(&self, times: &[f64]) -> Result<()> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        match &self.step_control {
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
            StepControl::Taken(steps) => {
                for ReplayedStep { length, .. } in steps {
                    Error::check_option("taken step", "positive", *length, positive(*length))?;
                }
            }
        }
        check_times(self.start, times)
    }

    /// Checks the number of tolerances for a system of `size` components.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] if the number of tolerances is neither one nor `size`.
    pub fn check_size(&self, size: usize) -> Result<()> {
        if let StepControl::Adaptive { tolerance, .. } = &self.step_control {
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
