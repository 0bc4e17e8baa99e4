//! Elements of spatial mechanisms in families: bodies, joints, drives, forces, contacts, beams and sensors.
//!
//! A body in space has seven coordinates: the position x, y, z of its reference point in world axes, and Euler parameters e of
//! its orientation, with the constraint |e| = 1. All coordinates lie in a vector space with q̇ = v, so that all analyses and all
//! methods for derivatives apply to spatial mechanisms as to planar ones.
//!
//! Joints connect markers: points with axes ([`Marker3`](crate::mechanism::Marker3)). Angles and displacements of
//! joints are coordinates ([`Mechanism::joint_angle`](crate::mechanism::Mechanism::joint_angle) and similar methods).
//! Elements that act on coordinates then act on joints: prescribed motions, springs, friction, loads, gears, flywheels
//! and sensors. An angle is not limited to one turn.
//!
//! Rotation matrices, angular velocities and torques are those of e/|e|, so that they do not depend on |e|. The constraint
//! |e| = 1 therefore has the multiplier zero.
//!
//! # Examples
//!
//! A pendulum on a skew hinge, a spring on its angle, and the angle as an output:
//!
//! ```
//! use linkwright_mechanics::prelude::*;
//!
//! let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
//! let ground = m.ground3();
//! let bar = MassProperties3::principal(1.2, [0.001, 0.04, 0.04]).with_centre([0.3, 0.0, 0.0]);
//! let arm = m.body3("arm", bar, Pose3::at([0.0; 3]));
//! // Both bodies have the axes of the world at the start, so that the hinge has the same components in both.
//! let axis = [0.0, 1.0, 0.4];
//! let (a, b) = (ground.origin().with_z(axis), arm.origin().with_z(axis));
//! m.revolute3("hinge", a, b);
//! let angle = m.joint_angle("angle", a, b);
//! let still = m.ground().theta;
//! m.coordinate_spring("spring", still, angle, [2.0, 0.1, 0.0, 0.0]);
//! let sensor = m.coordinate_sensor("sensor", still, angle);
//! let position = m.measure(sensor, "position")?;
//! m.output("angle", &[position]);
//! let history = simulate(&m, &Dynamics::fixed(1e-3), &[0.2])?;
//! // The weight turns the bar downwards: from x towards −z is positive about y.
//! assert!(history.values[0][0] > 0.0);
//! # Ok::<(), linkwright_mechanics::Error>(())
//! ```
//!
//! # Sources
//!
//! Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Chapters 6 to 8 and 11; Haug, *Computer Aided Kinematics
//! and Dynamics of Mechanical Systems* (1989), Chapters 9 to 11.

pub mod beams;
pub mod bodies;
pub mod contacts;
pub mod drives;
pub mod forces;
pub mod joints;
pub(crate) mod line3;
pub mod sensors;

pub use beams::*;
pub use bodies::*;
pub use contacts::*;
pub use drives::*;
pub use forces::*;
pub use joints::*;
pub use sensors::*;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Elements of spatial mechanisms by their declarations, over the types of functions of time and of functions of state.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    let forces = [forces::kinds(), contacts::kinds(), beams::kinds(), sensors::kinds()];
    [bodies::kinds(), joints::kinds(), drives::kinds()].into_iter().chain(forces).flatten().collect()
}
