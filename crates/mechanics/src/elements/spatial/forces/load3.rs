//! Forces and torques on a body in space as functions of time.

use crate::element_inputs;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame3::{Frame3, check_marker};
use crate::mechanism::vector::{dot, norm, scaled};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A force or torque on a body in space: a function of time along a fixed direction, f(t) u/|u|.
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 8.3.
#[derive(Clone, Copy, Debug)]
pub struct Load3<F> {
    /// Force (N) or torque (N·m) as a function of time.
    pub magnitude: F,
    /// Force or torque, and the axes of its direction.
    pub kind: LoadKind3,
}

/// Kind of a load in space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadKind3 {
    /// A force at the marker, in a direction fixed in the world.
    Force,
    /// A force at the marker, in a direction fixed to the marker.
    FollowerForce,
    /// A torque on the body, about a direction fixed in the world. It has no potential.
    Torque,
    /// A torque on the body, about a direction fixed to the marker.
    FollowerTorque,
}

element_inputs!(Load3Inputs {
    at: marker3("point that it acts on"),
    direction_x: required("", 0.6, "direction, x"),
    direction_y: required("", -0.3, "direction, y"),
    direction_z: required("", 0.5, "direction, z"),
    magnitude: time_function("N or N·m", "as a function of time"),
});

const fn declared(
    kind: &'static str,
    measures: &'static [Measure],
    about: &'static str,
    law: &'static str,
) -> ElementDescriptor {
    ElementDescriptor { kind, family: Family::Force, inputs: INPUTS, measures, about, law, symbol: Symbol::None }
}

const FORCE_MEASURES: &[Measure] = &[Measure::new("force", "N", "force along its direction")];
const TORQUE_MEASURES: &[Measure] = &[Measure::new("torque", "N·m", "torque about its direction")];

pub static FORCE: ElementDescriptor = declared(
    "force",
    FORCE_MEASURES,
    "a force at a point as a function of time, in a direction fixed in the world",
    "the force acts at the point along the unit vector of direction in axes of the world",
);
pub static FOLLOWER_FORCE: ElementDescriptor = declared(
    "follower",
    FORCE_MEASURES,
    "a force at a point as a function of time, in a direction fixed to the marker",
    "the force acts at the point along the unit vector of direction in axes of its marker",
);
pub static TORQUE: ElementDescriptor = declared(
    "torque",
    TORQUE_MEASURES,
    "a torque as a function of time, about a direction fixed in the world",
    "the torque acts on the body about the unit vector of direction in axes of the world, by the right-hand rule",
);
pub static FOLLOWER_TORQUE: ElementDescriptor = declared(
    "follower-torque",
    TORQUE_MEASURES,
    "a torque as a function of time, about a direction fixed to the marker",
    "the torque acts on the body about the unit vector of direction in axes of its marker, by the right-hand rule",
);

impl<T: Copy> Load3Inputs<'_, T> {
    fn direction(self) -> [T; 3] {
        [self.direction_x(), self.direction_y(), self.direction_z()]
    }
}

impl<F: Motion> Load3<F> {
    fn size<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.magnitude.position(Load3Inputs(x.p).magnitude(), x.t)
    }
}

impl<F: Motion> Element for Load3<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let p = Load3Inputs(x.p);
        let direction = p.direction();
        let load = scaled(direction, -self.size(x) / dot(direction, direction).sqrt());
        let marker = Frame3::of(x, 0).marker(p.at());
        match self.kind {
            LoadKind3::Force => marker.frame.add_force(dynamics, marker.lever, load),
            LoadKind3::FollowerForce => marker.frame.add_force(dynamics, marker.lever, marker.world(load)),
            LoadKind3::Torque => marker.frame.add_torque(dynamics, load),
            LoadKind3::FollowerTorque => marker.frame.add_torque(dynamics, marker.world(load)),
        }
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(match self.kind {
            LoadKind3::Force => &FORCE,
            LoadKind3::FollowerForce => &FOLLOWER_FORCE,
            LoadKind3::Torque => &TORQUE,
            LoadKind3::FollowerTorque => &FOLLOWER_TORQUE,
        })
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.magnitude.breaks(Load3Inputs(p).magnitude())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = Load3Inputs(p);
        let direction = p.direction();
        if !(norm(direction) > 0.0) {
            return Some(format!("its direction {direction:?} has length zero or is not a number"));
        }
        check_marker("at", p.at()).or_else(|| self.magnitude.validate_parameters(p.magnitude()))
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.size(x);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a force (N) or torque (N·m) as a function of time at a marker, along `direction`: components in world axes, or in
    /// the axes of the marker for follower loads. The length of `direction` does not matter.
    pub fn load3(
        &mut self,
        name: &str,
        kind: LoadKind3,
        at: Marker3<S>,
        direction: [S; 3],
        magnitude: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let all = [&at.parameters()[..], &direction, parameters].concat();
        self.add(name, Load3 { magnitude, kind }, &at.body.coordinates(), &all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};
    use crate::mechanism::Rotation;
    use crate::motion::Fixed;

    #[test]
    fn loads_on_a_body_turned_by_a_quarter() {
        // The lever (0, −0.5, 0) of a body turned by 90° about z points along +x.
        let quarter = Rotation::about_z(std::f64::consts::FRAC_PI_2).parameters();
        let q = [&[1.0, 1.0, 1.0][..], &quarter].concat();
        let p = [0.0, -0.5, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 8.0];
        // The row of a torque m about z: 2 Eᵀ m.
        let turn = |m: f64| [-2.0 * quarter[3] * m, 0.0, 0.0, 2.0 * quarter[0] * m];
        let load = |kind: LoadKind3| Load3 { magnitude: Fixed, kind };
        let expected = |force: [f64; 3], e: [f64; 4]| [&force[..], &e].concat();
        let computed = |kind: LoadKind3| rows(&load(kind), &at(&p, &q, &[])).0;
        close(&computed(LoadKind3::Force), &expected([0.0, -8.0, 0.0], turn(-4.0)));
        close(&computed(LoadKind3::FollowerForce), &expected([8.0, 0.0, 0.0], turn(0.0)));
        let about = |w: [f64; 3]| crate::mechanism::rotation::e_transposed_times(&quarter, w.map(|w| 2.0 * w));
        close(&computed(LoadKind3::Torque), &expected([0.0; 3], about([0.0, -8.0, 0.0])));
        close(&computed(LoadKind3::FollowerTorque), &expected([0.0; 3], about([8.0, 0.0, 0.0])));
        close(&measured(&load(LoadKind3::Torque), &at(&p, &q, &[])), &[8.0]);
        let mut without = p;
        without[8] = 0.0;
        assert!(load(LoadKind3::Force).validate_parameters(&without).unwrap().contains("length zero"));
    }
}
