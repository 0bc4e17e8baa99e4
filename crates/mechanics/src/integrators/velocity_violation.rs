//! The part of the velocities of implicit steps that violates the constraints.

use crate::initial_conditions::{Projection, nearest_consistent_velocities};
use crate::integrators::settings::{Dynamics, StepSize};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

impl Dynamics {
    /// Returns whether steps of other lengths rescale the velocities that violate the constraints, see
    /// [`GeneralizedAlpha`](crate::GeneralizedAlpha).
    pub(crate) fn rescales_velocities(&self, mechanism: &Mechanism<f64>) -> bool {
        matches!(self.step, StepSize::Adaptive { .. }) && mechanism.multipliers > 0
    }
}

/// The state `at` with the nearest velocities that satisfy the constraints, and the multipliers of this projection; `None` in positions
/// where constraints depend on each other.
pub(crate) fn consistent_velocities(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    at: &State<f64>,
) -> Option<(State<f64>, Projection)> {
    let mut consistent = at.clone();
    let nearest_velocity = nearest_consistent_velocities(system, mechanism, &mut consistent).ok()?;
    let is_finite = consistent.v.iter().all(|v| v.is_finite());
    is_finite.then_some((consistent, Projection { nearest_velocity, ..Projection::default() }))
}
