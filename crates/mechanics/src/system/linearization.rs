//! Which derivatives a matrix is made of.

use crate::elements::element::TangentWeights;

/// How residual rows are linearized into a matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearization {
    /// How variables of balancing elements move with an unknown.
    pub dynamics_weights: TangentWeights,
    /// How variables of constraints move with an unknown.
    pub constraint_weights: TangentWeights,
    /// Factor on the constraint rows.
    pub constraint_scale: f64,
    /// Added to the diagonal of the free coordinates, while balancing elements are left out.
    pub projection: bool,
}

impl Linearization {
    /// One implicit time step: the unknowns are accelerations, with which positions move by `position` (s²) and
    /// velocities by `velocity` (s). Closure rows are divided by `position`, which keeps the matrix well scaled for
    /// every step size.
    ///
    /// **Source.** Bottasso, Dopico & Trainelli, *Multibody Syst. Dyn.* 19 (2008) 3–20.
    pub fn step(position: f64, velocity: f64) -> Self {
        let weights = TangentWeights { position, velocity, acceleration: 1.0 };
        Self {
            dynamics_weights: weights,
            constraint_weights: weights,
            constraint_scale: 1.0 / position,
            projection: false,
        }
    }

    /// Accelerations and multipliers at a given state: the saddle-point matrix of M and Φ_q.
    pub fn accelerations() -> Self {
        let dynamics_weights = TangentWeights { position: 0.0, velocity: 0.0, acceleration: 1.0 };
        let constraint_weights = TangentWeights { position: 1.0, velocity: 0.0, acceleration: 0.0 };
        Self { dynamics_weights, constraint_weights, constraint_scale: 1.0, projection: false }
    }

    /// Positions only.
    pub fn statics() -> Self {
        let weights = TangentWeights { position: 1.0, velocity: 0.0, acceleration: 0.0 };
        Self { dynamics_weights: weights, constraint_weights: weights, constraint_scale: 1.0, projection: false }
    }

    /// The nearest point on the constraints.
    pub fn projection() -> Self {
        Self { projection: true, ..Self::statics() }
    }
}
