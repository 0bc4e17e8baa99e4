//! Planar and spatial multibody dynamics of rigid and flexible bodies, with exact derivatives with respect to design
//! parameters.
//!
//! Every element is one residual, generic over the scalar type. Mass, stiffness and constraint matrices, consistent
//! velocities and accelerations, and design derivatives follow from it by automatic differentiation. Units are SI and
//! radians. Coordinates of elements are absolute: every body and every beam node has x, y and θ, or x, y, z and four Euler parameters in
//! space ([`elements::spatial`]).
//!
//! Write a mechanism as a [`ParametricMechanism`], a function of the design variables. [`ParametricMechanism::build`] in `f64`
//! gives a [`Mechanism`] for an analysis; the functions of [`derivatives`] take the parametric mechanism itself.
//!
//! | module | contents |
//! |---|---|
//! | [`linalg`] | sparse LU factorizations of matrices with a fixed pattern |
//! | [`motion`] | prescribed functions of time: constant speed, ramps, harmonics, tables |
//! | [`mechanism`] | coordinates, elements and outputs as a function of the design |
//! | [`elements`] | bodies, joints, drives, forces, contacts, beams and sensors |
//! | [`system`] | equations of motion: numbering of unknowns, residual, matrix |
//! | [`diagnostics`] | names the element or coordinate behind a singular, non-finite or diverging system |
//! | [`constraint_rank`] | redundant constraints, indeterminate reactions, coordinates that no drive moves |
//! | `assembly_failures` | drives that prescribe the same degree of freedom, or lock |
//! | [`equilibrium`] | static equilibrium by Newton's iteration and by load paths |
//! | [`initial_conditions`] | assembly, consistent velocities and accelerations |
//! | `tree` | relative coordinates of open chains and trees: joint angles and displacements as unknowns |
//! | [`events`] | impacts of rigid contacts and switches of forces |
//! | [`integrators`] | generalized-α and HHT on the index-3 equations, explicit Runge–Kutta methods of orders 5 and 8 |
//! | [`checkpointing`] | recorded steps within a memory limit, played back in reverse |
//! | [`analyses`] | dynamics, kinematics with inverse dynamics, statics, vibration modes |
//! | [`derivatives`] | direct, adjoint, semi-analytical and second-order derivatives of the analyses |
//!
//! Modules use only those above them in the table. The names that most programs need are at the root of the crate, and all
//! of them in the [`prelude`].
//!
//! | analysis | settings | function |
//! |---|---|---|
//! | dynamics by implicit steps | [`Dynamics`] | [`simulate`] |
//! | dynamics by explicit steps | [`Explicit`] | [`simulate_explicitly`] |
//! | kinematics and inverse dynamics | [`Assembly`] | [`kinematics`] |
//! | static equilibria | [`Statics`] | [`equilibria`] |
//! | vibration modes | | [`modes`] |
//!
//! Settings are plain structs. Start from a constructor or `Default` and change fields by struct update syntax,
//! `Dynamics { newton, ..Dynamics::fixed(1e-3) }`: fields that are added later do not break your program.

pub mod analyses;
mod assembly_failures;
pub mod checkpointing;
pub mod constraint_rank;
pub mod derivatives;
pub mod diagnostics;
pub mod elements;
pub mod equilibrium;
pub mod events;
pub mod initial_conditions;
pub mod initial_velocities;
pub mod integrators;
pub mod linalg;
pub mod mechanism;
pub mod motion;
mod reaction_loads;
pub mod system;
pub(crate) mod tree;

pub use analyses::dynamics::{History, simulate, simulate_explicitly};
pub use analyses::kinematics::kinematics;
pub use analyses::modal::{VibrationModes, modes};
pub use analyses::statics::equilibria;
pub use error::{Error, Result};
pub use initial_conditions::{Assembly, Statics};
pub use integrators::explicit::Explicit;
pub use integrators::{Dynamics, GeneralizedAlpha, InitialAcceleration, InitialConfiguration, Newton, StepSize, Work};
pub use mechanism::{
    Body, Body3, Coordinate, ElementIndex, EulerSequence, Marker, Marker3, Mechanism, ParametricMechanism, Pose, Pose3,
    Rotation, SimulationClock,
};

/// The names that most programs with mechanisms need: `use linkwright_mechanics::prelude::*;`.
pub mod prelude {
    pub use crate::derivatives::forward::dynamics::differentiate;
    pub use crate::elements::spatial::{BeamSection3, LoadKind3, MassProperties3};
    pub use crate::elements::{Element, ElementState};
    pub use crate::motion::{ConstantSpeed, Motion};
    pub use crate::{
        Assembly, Body, Body3, Coordinate, Dynamics, ElementIndex, Error, EulerSequence, Explicit, GeneralizedAlpha,
        History, InitialAcceleration, InitialConfiguration, Marker, Marker3, Mechanism, Newton, ParametricMechanism,
        Pose, Pose3, Result, Rotation, Statics, StepSize, VibrationModes, Work, equilibria, kinematics, modes,
        simulate, simulate_explicitly,
    };
    pub use autodiff::Scalar;
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
