//! Bodies in space: inertia, weight and the length of their Euler parameters.

pub(crate) mod normalization;
pub(crate) mod point_mass3;
pub(crate) mod rigid_body3;

pub use normalization::Normalization;
pub use point_mass3::PointMass3;
pub use rigid_body3::{MassProperties3, RigidBody3};

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Bodies in space by their declarations.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(RigidBody3::object()),
        ElementKind::plain(PointMass3::object()),
        ElementKind::plain(Normalization::object()),
    ]
}
