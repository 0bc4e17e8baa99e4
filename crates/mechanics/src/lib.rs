//! Planar rigid and flexible multibody dynamics, with exact derivatives with respect to design parameters.
//!
//! Every element is one residual, written once over the scalar type. Mass, stiffness and constraint matrices, consistent
//! velocities and accelerations, and the derivatives with respect to the design follow from it by automatic
//! differentiation. Units are SI and radians. Absolute coordinates: every body and every beam node has x, y and θ.
//!
//! | module | contents |
//! |---|---|
//! | [`linalg`] | sparse LU factorizations of matrices with a fixed pattern |
//! | [`mechanism`] | coordinates, elements and outputs as a function of the design |
//! | [`motion`] | prescribed functions of time: constant speed, ramps, harmonics, tables |
//! | [`elements`] | bodies, joints, drives, forces, contacts, beams and sensors |
//! | [`system`] | equations of motion: numbering of unknowns, residual, matrix |
//! | [`initial_conditions`] | assembly, consistent velocities and accelerations, static equilibrium at the start |
//! | [`integrators`] | generalized-α and HHT on the index-3 equations, explicit Runge–Kutta methods of orders 5 and 8 |
//! | [`events`] | impacts and switches |
//! | [`checkpointing`] | recorded steps within a memory limit, played back in reverse |
//! | [`analyses`] | dynamics, kinematics with inverse dynamics, statics, vibration modes |
//! | [`derivatives`] | direct, adjoint, semi-analytical and second-order derivatives of the analyses |
//! | [`diagnostics`] | names the element or coordinate behind a singular, non-finite or diverging system |

pub mod analyses;
pub mod checkpointing;
pub mod derivatives;
pub mod diagnostics;
pub(crate) mod dual_numbers;
pub mod elements;
pub mod events;
pub mod initial_conditions;
pub mod integrators;
pub mod linalg;
pub mod mechanism;
pub mod motion;
pub mod system;

pub use error::{Error, Result};
