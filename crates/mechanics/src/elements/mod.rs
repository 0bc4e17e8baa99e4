//! Elements of a mechanism in families: bodies, joints, drives, forces, contacts, beams and sensors; those of spatial
//! mechanisms are in [`spatial`].
//!
//! Each file holds one element: its residual, its declaration ([`ElementDescriptor`]), the method of
//! [`Mechanism`](crate::mechanism::Mechanism) that adds it, and a test with numbers. [`kinds`] lists those that model files
//! can name.

pub mod beams;
pub mod bodies;
pub mod contacts;
pub mod drives;
#[cfg(test)]
pub(crate) mod element_tests;
pub mod forces;
pub mod joints;
pub mod kind;
pub(crate) mod line;
pub mod sensors;
pub mod spatial;
mod state_function;

pub use crate::mechanism::element;
pub use beams::*;
pub use bodies::*;
pub use contacts::*;
pub use drives::*;
pub use element::{Element, ElementDescriptor, ElementState, Energy, Family, Input, Measure, Role, Symbol};
pub use forces::*;
pub use joints::*;
pub use kind::{Added, ElementKind, InputValue};
pub use sensors::*;

use crate::motion::Motion;

/// Elements that model files can name, over the types of functions of time and of functions of state.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    [joints::kinds(), drives::kinds(), forces::kinds(), contacts::kinds(), bodies::kinds()]
        .into_iter()
        .flatten()
        .collect()
}
