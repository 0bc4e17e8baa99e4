//! Weights with which derivatives of the residual are summed in the matrix of an analysis.

use crate::elements::element::TangentWeights;

/// Weights of the derivatives of the residual in a matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linearization {
    /// Weights of position, velocity and acceleration for elements without constraints.
    pub dynamics_weights: TangentWeights,
    /// Weights of position, velocity and acceleration for constraints.
    pub constraint_weights: TangentWeights,
    /// Factor on the constraint rows.
    pub constraint_scale: f64,
    /// True if the matrix has the derivatives of the reactions Φ_qᵀ λ with respect to positions.
    pub geometric_stiffness: bool,
    /// True if the matrix has ones on the diagonal of the free coordinates instead of elements without constraints.
    pub projection: bool,
    /// True if the matrix has the elements whose loads depend on reactions.
    pub reaction_loads: bool,
}

/// Weight of the velocity of a follower that is held in a projection of velocities: far above those of other coordinates, which are one.
pub(crate) const HELD: f64 = 1e9;

impl Linearization {
    /// Matrix of an implicit time step, whose unknowns are accelerations.
    ///
    /// `position` (s²) and `velocity` (s) are the derivatives of position and velocity with respect to acceleration.
    /// Constraint rows are divided by `position`, which keeps the matrix well scaled for every step size.
    ///
    /// # Sources
    ///
    /// Bottasso, Dopico & Trainelli, *Multibody Syst. Dyn.* 19 (2008) 3–20.
    pub fn step(position: f64, velocity: f64) -> Self {
        let weights = TangentWeights { position, velocity, acceleration: 1.0 };
        Self {
            dynamics_weights: weights,
            constraint_weights: weights,
            constraint_scale: 1.0 / position,
            geometric_stiffness: true,
            projection: false,
            reaction_loads: true,
        }
    }

    /// Saddle-point matrix of M and Φ_q, for accelerations and multipliers at a given state.
    pub fn accelerations() -> Self {
        let dynamics_weights = TangentWeights { position: 0.0, velocity: 0.0, acceleration: 1.0 };
        let constraint_weights = TangentWeights { position: 1.0, velocity: 0.0, acceleration: 0.0 };
        Self {
            dynamics_weights,
            constraint_weights,
            constraint_scale: 1.0,
            geometric_stiffness: false,
            projection: false,
            reaction_loads: true,
        }
    }

    /// Stiffness matrix and Φ_q, for a static equilibrium.
    pub fn statics() -> Self {
        let weights = TangentWeights { position: 1.0, velocity: 0.0, acceleration: 0.0 };
        Self {
            dynamics_weights: weights,
            constraint_weights: weights,
            constraint_scale: 1.0,
            geometric_stiffness: true,
            projection: false,
            reaction_loads: true,
        }
    }

    /// Saddle-point matrix of M and Φ_q, for velocities of the least kinetic energy at given positions.
    pub fn velocities() -> Self {
        Self { reaction_loads: false, ..Self::accelerations() }
    }

    /// Identity and Φ_q, for the nearest point that satisfies the constraints.
    pub fn projection() -> Self {
        Self { projection: true, ..Self::statics() }
    }

    /// Identity and Φ_q, for the nearest velocities that satisfy the constraints at given positions: Φ̇ is linear in them, so reactions
    /// do not enter. Followers that are held have a very large weight.
    pub fn velocity_projection() -> Self {
        Self { geometric_stiffness: false, ..Self::projection() }
    }
}
