//! The names that most programs with mechanisms need: `use linkwright_mechanics::prelude::*;`.

pub use crate::derivatives::forward::dynamics::differentiate;
pub use crate::elements::{Element, ElementState};
pub use crate::motion::{ConstantSpeed, Motion};
pub use crate::{
    Assembly, Body, Coordinate, Dynamics, ElementIndex, Error, Explicit, GeneralizedAlpha, History,
    InitialAcceleration, InitialConfiguration, Marker, Mechanism, Modes, Newton, ParametricMechanism, Pose, Result,
    Statics, StepSize, Work, equilibria, kinematics, modes, simulate, simulate_explicitly,
};
pub use autodiff::Scalar;
