//! Planar mechanisms, rigid and flexible, written once over the scalar type.
//!
//! | file | what |
//! |---|---|
//! | `element` | the [`Element`] trait: one residual over the scalar |
//! | `elements/` | bodies, beams, joints, forces, sensors: one file each |
//! | `motion/` | prescribed motions: constant speed, start-ups, ramps, harmonics, tables |
//! | `formula` | outputs as formulas of measured quantities |
//! | `impact` | rigid contacts that a mechanism bounces off, and switches that it passes |
//! | `mechanism` | coordinates + elements + outputs, as a pure function of the design ([`Model`]) |
//! | `number` | the closed set of numbers in which mechanisms are evaluated |
//!
//! Units are SI and radians. Absolute coordinates: every body and every beam node has x, y and θ.

pub mod element;
pub mod elements;
pub mod formula;
pub mod frame;
pub(crate) mod impact;
pub mod mechanism;
pub mod motion;
pub mod number;

pub use element::{Element, Energy, Local};
pub use formula::Formula;
pub use mechanism::{Body, Coordinate, Marker, Mechanism, Model, Part, Pose, Term};
pub use motion::Motion;
pub use number::{Carrier, Curved, Jet, Narrow, Number, Real, Sensitive};
