//! Angles, displacements and distances between markers as coordinates, their drives, and screws.

use crate::as_object;
use crate::element_inputs;
use crate::elements::spatial::line3::{Line3, MarkerPair, check_ends, ends3, without_direction3};
use crate::mechanism::element::{AnyElement, Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::vector::{cross, dot, scaled, subtract};
use crate::mechanism::{Coordinate, Marker3, Mechanism};
use crate::motion::Motion;
use autodiff::{Jet2, Scalar};
use std::sync::Arc;

element_inputs!(JointCoordinateInputs {
    a: marker3("marker of the first body"),
    b: marker3("marker of the second body"),
    coordinate: coordinate("the angle, displacement or distance"),
});

/// Local number of the coordinate, after those of two bodies.
const COORDINATE: usize = 14;

const MEASURES: &[Measure] = &[Measure::new(
    "generalized_force",
    "N or N·m",
    "force or torque on b of everything that acts on the coordinate, positive towards larger values",
)];

/// Angle of a joint as a coordinate φ: the angle from x of A to x of B about the axis z of A.
///
/// $$ \Phi = \operatorname{atan2}(\mathbf y_A\cdot\mathbf x_B,\ \mathbf x_A\cdot\mathbf x_B) - \varphi
///    \quad\text{modulo } 2\pi $$
///
/// φ counts turns, as it changes continuously. Use it with a revolute or cylindrical joint about z. λ is the torque in N·m
/// that acts on φ.
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.3.
#[derive(Clone, Copy, Debug)]
pub struct JointAngle;

as_object!(JointAngle);

pub static ANGLE: ElementDescriptor = ElementDescriptor {
    kind: "angle",
    family: Family::Joint,
    inputs: INPUTS,
    measures: MEASURES,
    about: "a coordinate that is the angle from x of a to x of b about z of a",
    law: "coordinate = angle from x_a to x_b about z_a, which counts turns",
    symbol: Symbol::None,
};

/// Sine and cosine of the angle of a joint, each times the length of x of B in the plane normal to z of A.
fn sine_cosine<T: Scalar>(ends: &MarkerPair<T>) -> (T, T) {
    (dot(ends.a.axes[1], ends.b.axes[0]), dot(ends.a.axes[0], ends.b.axes[0]))
}

fn angle<T: Scalar>(x: &ElementState<'_, T>) -> T {
    let (sin, cos) = sine_cosine(&MarkerPair::of(x));
    sin.atan2(cos)
}

impl Element for JointAngle {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let (ends, l) = (MarkerPair::of(x), x.l[0]);
        let (s, c) = sine_cosine(&ends);
        let (sin, cos) = x.q[COORDINATE].sin_cos();
        constraint[0] = (s * cos - c * sin).atan2(c * cos + s * sin);
        let [x_a, y_a, _] = ends.a.axes;
        let x_b = ends.b.axes[0];
        let gradient = subtract(scaled(cross(y_a, x_b), c), scaled(cross(x_a, x_b), s));
        ends.apply_torque(scaled(gradient, l / (s * s + c * c)), dynamics);
        dynamics[COORDINATE] = -l;
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&ANGLE)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = -x.l[0];
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_ends(p)
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        let (s, c) = sine_cosine(&MarkerPair::of(x));
        (s == 0.0 && c == 0.0).then(|| "x of b is along z of a, so that it has no angle".to_owned())
    }
}

/// Displacement of a joint as a coordinate s: Φ = z_A · (r_B − r_A) − s, the position of B along the axis z of A.
///
/// Use it with a prismatic or cylindrical joint along z. λ is the force in N that acts on s.
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.3.
#[derive(Clone, Copy, Debug)]
pub struct JointDisplacement;

as_object!(JointDisplacement);

pub static DISPLACEMENT: ElementDescriptor = ElementDescriptor {
    kind: "displacement",
    family: Family::Joint,
    inputs: INPUTS,
    measures: MEASURES,
    about: "a coordinate that is the position of the point b along z of a",
    law: "coordinate = z_a·(r_b − r_a)",
    symbol: Symbol::None,
};

fn displacement<T: Scalar>(x: &ElementState<'_, T>) -> T {
    let ends = MarkerPair::of(x);
    dot(ends.a.axes[2], ends.gap())
}

impl Element for JointDisplacement {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let (ends, l) = (MarkerPair::of(x), x.l[0]);
        let z = ends.a.axes[2];
        constraint[0] = dot(z, ends.gap()) - x.q[COORDINATE];
        ends.apply_at_b(scaled(z, -l), dynamics);
        dynamics[COORDINATE] = -l;
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DISPLACEMENT)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = -x.l[0];
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_ends(p)
    }
}

/// Distance of two points as a coordinate s: Φ = |r_B − r_A| − s.
///
/// λ is the force in N that acts on s. The points must not coincide.
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.3.
#[derive(Clone, Copy, Debug)]
pub struct PointDistance;

as_object!(PointDistance);

pub static DISTANCE: ElementDescriptor = ElementDescriptor {
    kind: "length",
    family: Family::Joint,
    inputs: INPUTS,
    measures: MEASURES,
    about: "a coordinate that is the distance of two points",
    law: "coordinate = |r_b − r_a|",
    symbol: Symbol::Spring,
};

fn distance<T: Scalar>(x: &ElementState<'_, T>) -> T {
    Line3::of(x).length
}

impl Element for PointDistance {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let line = Line3::of(x);
        constraint[0] = line.length - x.q[COORDINATE];
        line.add_axial_force(x.l[0], dynamics);
        dynamics[COORDINATE] = -x.l[0];
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DISTANCE)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = -x.l[0];
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_ends(p)
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction3(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds the angle from x of `a` to x of `b` about z of `a` as a coordinate (rad), see [`JointAngle`].
    ///
    /// Its initial position and velocity are those of the bodies; the initial angle is from −π to π.
    pub fn joint_angle(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>) -> Coordinate {
        self.joint_coordinate(name, JointAngle::object(), a, b, angle)
    }

    /// Adds the position of `b` along z of `a` as a coordinate (m), see [`JointDisplacement`].
    ///
    /// Its initial position and velocity are those of the bodies.
    pub fn joint_displacement(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>) -> Coordinate {
        self.joint_coordinate(name, JointDisplacement::object(), a, b, displacement)
    }

    /// Adds the distance of the points of `a` and `b` as a coordinate (m), see [`PointDistance`].
    ///
    /// Its initial position and velocity are those of the bodies.
    pub fn point_distance(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>) -> Coordinate {
        self.joint_coordinate(name, PointDistance::object(), a, b, distance)
    }

    fn joint_coordinate(
        &mut self,
        name: &str,
        element: Arc<dyn AnyElement>,
        a: Marker3<S>,
        b: Marker3<S>,
        value: fn(&ElementState<'_, Jet2<S>>) -> Jet2<S>,
    ) -> Coordinate {
        let (mut coordinates, p) = ends3(a, b);
        let coordinate = self.dependent_coordinate(name, &coordinates, &p, value);
        coordinates.push(coordinate);
        self.add_object(name.into(), element, &coordinates, &p);
        coordinate
    }

    /// Prescribes the angle (rad) from x of `a` to x of `b` about z of `a` as a function of time; returns it as a coordinate.
    pub fn drive_angle(
        &mut self,
        name: &str,
        a: Marker3<S>,
        b: Marker3<S>,
        motion: impl Motion,
        parameters: &[S],
    ) -> Coordinate {
        let coordinate = self.joint_angle(name, a, b);
        self.drive(coordinate, motion, parameters);
        coordinate
    }

    /// Prescribes the position (m) of `b` along z of `a` as a function of time; returns it as a coordinate.
    pub fn drive_displacement(
        &mut self,
        name: &str,
        a: Marker3<S>,
        b: Marker3<S>,
        motion: impl Motion,
        parameters: &[S],
    ) -> Coordinate {
        let coordinate = self.joint_displacement(name, a, b);
        self.drive(coordinate, motion, parameters);
        coordinate
    }

    /// Prescribes the distance (m) of two points as a function of time; returns it as a coordinate.
    pub fn drive_distance(
        &mut self,
        name: &str,
        a: Marker3<S>,
        b: Marker3<S>,
        motion: impl Motion,
        parameters: &[S],
    ) -> Coordinate {
        let coordinate = self.point_distance(name, a, b);
        self.drive(coordinate, motion, parameters);
        coordinate
    }

    /// Joins two markers by a screw along z: a cylindrical joint whose displacement grows by `pitch` (m) in a turn.
    ///
    /// Returns its angle (rad) and its displacement (m). The displacement minus `pitch` times the turns stays as it is at the
    /// start. The pitch must not be zero; it is negative for a left-handed thread.
    pub fn screw(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>, pitch: S) -> [Coordinate; 2] {
        self.cylindrical(name, a, b);
        let angle = self.joint_angle(&format!("{name}.angle"), a, b);
        let displacement = self.joint_displacement(&format!("{name}.displacement"), a, b);
        let lead = pitch * (0.5 / std::f64::consts::PI);
        let offset = self.position(displacement) - lead * self.position(angle);
        let carrier = self.ground().theta;
        let thread = format!("{name}.thread");
        self.gear_pair(&thread, [displacement, angle], carrier, [S::from(1.0), -lead, offset]);
        [angle, displacement]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};
    use crate::elements::spatial::line3::{points, upright};
    use crate::mechanism::{Pose3, Rotation};

    #[test]
    fn an_angle_of_many_turns_and_its_torque() {
        let mut q = [&upright([0.0; 3], [0.0; 3])[..], &[20.0 * std::f64::consts::PI + 0.1]].concat();
        q[10..14].copy_from_slice(&Rotation::about_z(0.3).parameters());
        let (dynamics, constraint) = rows(&JointAngle, &at(&points([0.0; 3], [0.0; 3]), &q, &[5.0]));
        close(&constraint, &[0.2]);
        // A torque of −5 N·m about z on B, the opposite on A: 2 Eᵀ m.
        let [e0, .., e3] = Rotation::about_z(0.3).parameters();
        close(&dynamics[..7], &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -10.0]);
        close(&dynamics[7..], &[0.0, 0.0, 0.0, -10.0 * e3, 0.0, 0.0, 10.0 * e0, -5.0]);
    }

    #[test]
    fn a_displacement_along_the_axis_and_a_distance() {
        let (p, q) = (points([0.0; 3], [0.0; 3]), [&upright([0.0; 3], [2.0, 3.0, 6.0])[..], &[5.0]].concat());
        let (dynamics, constraint) = rows(&JointDisplacement, &at(&p, &q, &[4.0]));
        close(&constraint, &[1.0]);
        // 4 N against z at (2, 3, 6) on A: the torque (−12, 8, 0).
        close(&dynamics, &[0.0, 0.0, -4.0, 0.0, -24.0, 16.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, -4.0]);
        close(&rows(&PointDistance, &at(&p, &q, &[7.0])).1, &[2.0]);
        close(&rows(&PointDistance, &at(&p, &q, &[7.0])).0[7..10], &[2.0, 3.0, 6.0]);
    }

    #[test]
    fn initial_values_follow_those_of_the_bodies() {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground3();
        let pose = Pose3::new([0.0, 0.0, 0.5], Rotation::about_z(0.4));
        let body = m.massless_frame3("body", pose);
        let angle = m.joint_angle("angle", ground.origin(), body.origin());
        let height = m.joint_displacement("height", ground.origin(), body.origin());
        m.set_velocity3(body, [0.0, 0.0, 2.0], [0.0, 0.0, 3.0]);
        close(&[m.position(angle), m.position(height)], &[0.4, 0.5]);
        close(&[m.coordinates[angle.0].velocity, m.coordinates[height.0].velocity], &[3.0, 2.0]);
    }
}
