//! One joint of a tree in space: its coordinates, and the motion of its second marker relative to the first.

use crate::elements::spatial::joints::rows::ConstraintRow;
use crate::elements::spatial::joints::{lower_pairs, point_joints};
use crate::elements::spatial::{Cylindrical, FixedJoint3, Planar, Prismatic3, Revolute3, Spherical, Universal};
use crate::mechanism::ElementInstance;
use crate::mechanism::element::ElementDescriptor;
use crate::mechanism::rotation::{conjugate, e_times, matrix, quaternion_product, square};
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::vector::{add, dot, product, scaled, subtract, transposed_product};

/// Connection of a body to its parent in a tree in space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Joint3 {
    /// An angle about z.
    Revolute,
    /// A displacement along z.
    Prismatic,
    /// An angle about z and a displacement along z.
    Cylindrical,
    /// Displacements along x and y, and an angle about z.
    Planar,
    /// An angle about z of the first marker, and one about z of the second.
    Universal,
    /// Euler parameters.
    Spherical,
    /// A spherical joint of a body whose rotation is prescribed, such as a point mass: no coordinate.
    Pin,
    /// No coordinate.
    Fixed,
    /// Without a parent: those of x, y, z and of the Euler parameters that are not prescribed are the coordinates.
    Free {
        /// For x, y and z, true if it is not prescribed.
        moves: [bool; 3],
        /// True if the Euler parameters are not prescribed.
        turns: bool,
    },
}

/// Direction of a joint coordinate, in the axes of the first marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JointAxis {
    /// A rotation about z.
    Turn,
    /// A rotation about z of the second marker, which the rotation about z turns in the plane of x and y.
    Cross,
    /// A displacement along x, y or z.
    Slide(usize),
}

impl Joint3 {
    /// Directions of the coordinates; none for Euler parameters and free bodies.
    pub fn axes(self) -> &'static [JointAxis] {
        match self {
            Self::Revolute => &[JointAxis::Turn],
            Self::Prismatic => &[JointAxis::Slide(2)],
            Self::Cylindrical => &[JointAxis::Turn, JointAxis::Slide(2)],
            Self::Planar => &[JointAxis::Slide(0), JointAxis::Slide(1), JointAxis::Turn],
            Self::Universal => &[JointAxis::Turn, JointAxis::Cross],
            Self::Spherical | Self::Pin | Self::Fixed | Self::Free { .. } => &[],
        }
    }
}

/// The joint of a tree and its constraint equations for an element that is a joint of two bodies in space.
pub(crate) fn joint_of<S>(instance: &ElementInstance<S>) -> Option<(Joint3, &'static [ConstraintRow])> {
    let own = instance.element.descriptor()?;
    let is = |descriptor: &'static ElementDescriptor| std::ptr::eq(own, descriptor);
    match () {
        () if is(&lower_pairs::REVOLUTE) => Some((Joint3::Revolute, Revolute3::ROWS)),
        () if is(&lower_pairs::PRISMATIC) => Some((Joint3::Prismatic, Prismatic3::ROWS)),
        () if is(&lower_pairs::CYLINDRICAL) => Some((Joint3::Cylindrical, Cylindrical::ROWS)),
        () if is(&lower_pairs::PLANAR) => Some((Joint3::Planar, Planar::ROWS)),
        () if is(&lower_pairs::FIXED) => Some((Joint3::Fixed, FixedJoint3::ROWS)),
        () if is(&point_joints::SPHERICAL) => Some((Joint3::Spherical, Spherical::ROWS)),
        () if is(&point_joints::UNIVERSAL) => Some((Joint3::Universal, Universal::ROWS)),
        () => None,
    }
}

/// A marker of a joint: its point and the Euler parameters of its axes, both in the body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointMarker<T> {
    pub point: [T; 3],
    pub e: [T; 4],
}

impl<T: StateScalar> JointMarker<T> {
    /// From seven parameters of an element.
    pub fn of(p: &[T]) -> Self {
        Self { point: [p[0], p[1], p[2]], e: [p[3], p[4], p[5], p[6]] }
    }
}

/// The markers A and B of a joint.
pub(crate) type JointMarkers<T> = [JointMarker<T>; 2];

/// The markers of a joint with these parameters; those of a free body are not used.
pub(crate) fn markers<T: StateScalar>(p: &[T]) -> JointMarkers<T> {
    let (zero, one) = (T::from(0.0), T::from(1.0));
    match p.len() {
        0 => [JointMarker::of(&[zero, zero, zero, one, zero, zero, zero]); 2],
        _ => [JointMarker::of(&p[..7]), JointMarker::of(&p[7..14])],
    }
}

/// Motion of the marker B relative to A, in the axes of A.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RelativeMotion<T> {
    /// Euler parameters of the rotation.
    pub e: [T; 4],
    /// Angular velocity, and angular acceleration without that of the coordinates.
    pub spin: [T; 3],
    pub bias: [T; 3],
    /// Displacement and its rate.
    pub displacement: [T; 3],
    pub rate: [T; 3],
    /// Direction of [`JointAxis::Cross`].
    pub cross: [T; 3],
}

/// Angular velocity in rad/s for the rates of Euler parameters of any length.
#[inline(always)]
pub(crate) fn angular_velocity<T: StateScalar>(e: &[T; 4], rate: &[T; 4]) -> [T; 3] {
    scaled(e_times(e, rate), square(e).recip() * 2.0)
}

/// Angular acceleration without that of the second derivatives of the Euler parameters.
#[inline(always)]
pub(crate) fn angular_bias<T: StateScalar>(e: &[T; 4], rate: &[T; 4], spin: [T; 3]) -> [T; 3] {
    let growth = (e[0] * rate[0] + e[1] * rate[1] + e[2] * rate[2] + e[3] * rate[3]) * (square(e).recip() * 2.0);
    scaled(spin, -growth)
}

/// Euler parameters of the rotation by `angle` about the axis with this number.
#[inline(always)]
fn about<T: StateScalar>(axis: usize, angle: T) -> [T; 4] {
    let (sin, cos) = (angle * 0.5).sin_cos();
    let mut e = [cos, T::from(0.0), T::from(0.0), T::from(0.0)];
    e[1 + axis] = sin;
    e
}

impl<T: StateScalar> RelativeMotion<T> {
    /// The motion for the joint coordinates `q` and their velocities `v`.
    #[inline(always)]
    pub fn new(joint: Joint3, q: &[T; 4], v: &[T; 4]) -> Self {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let none = [zero; 3];
        let identity = [one, zero, zero, zero];
        let mut motion =
            Self { e: identity, spin: none, bias: none, displacement: none, rate: none, cross: [one, zero, zero] };
        match joint {
            Joint3::Spherical => {
                let inverse = square(q).sqrt().recip();
                motion.e = q.map(|x| x * inverse);
                motion.spin = angular_velocity(q, v);
                motion.bias = angular_bias(q, v, motion.spin);
            }
            Joint3::Universal => {
                let (sin, cos) = q[0].sin_cos();
                // The second axis z lies along x after a quarter of a turn about y.
                let half = std::f64::consts::FRAC_1_SQRT_2;
                let quarter = [T::from(half), zero, T::from(half), zero];
                motion.e = quaternion_product(&about(2, q[0]), &quaternion_product(&quarter, &about(2, q[1])));
                motion.cross = [cos, sin, zero];
                motion.spin = add(scaled(motion.cross, v[1]), [zero, zero, v[0]]);
                motion.bias = scaled([-sin, cos, zero], v[0] * v[1]);
            }
            _ => {
                for (k, axis) in joint.axes().iter().enumerate() {
                    match *axis {
                        JointAxis::Slide(i) => (motion.displacement[i], motion.rate[i]) = (q[k], v[k]),
                        _ => {
                            motion.e = about(2, q[k]);
                            motion.spin[2] = v[k];
                        }
                    }
                }
            }
        }
        motion
    }
}

/// Position and velocity of a body: reference point, Euler parameters, velocity, angular velocity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyMotion<T> {
    pub origin: [T; 3],
    pub e: [T; 4],
    pub velocity: [T; 3],
    pub spin: [T; 3],
}

impl<T: StateScalar> BodyMotion<T> {
    /// From positions and velocities of its seven coordinates.
    pub fn of(q: &[T; 7], v: &[T; 7]) -> Self {
        let e = [q[3], q[4], q[5], q[6]];
        let spin = angular_velocity(&e, &[v[3], v[4], v[5], v[6]]);
        Self { origin: [q[0], q[1], q[2]], e, velocity: [v[0], v[1], v[2]], spin }
    }
}

/// Coordinates and velocities of a joint with the given markers between the bodies of A and B, which satisfy its constraints.
pub(crate) fn joint_coordinates<T: StateScalar>(
    joint: Joint3,
    [marker_a, marker_b]: &JointMarkers<T>,
    [a, b]: [&BodyMotion<T>; 2],
) -> ([T; 4], [T; 4]) {
    let zero = T::from(0.0);
    let (mut q, mut v) = ([zero; 4], [zero; 4]);
    let [ea, eb] = [(a, marker_a), (b, marker_b)].map(|(body, marker)| quaternion_product(&body.e, &marker.e));
    let e = quaternion_product(&conjugate(&ea), &eb);
    let axes = matrix(&ea);
    let [lever_a, lever_b] = [(a, marker_a), (b, marker_b)].map(|(body, m)| product(&matrix(&body.e), m.point));
    let gap = subtract(add(b.origin, lever_b), add(a.origin, lever_a));
    let cross = crate::mechanism::vector::cross;
    let point_velocity = |body: &BodyMotion<T>, lever| add(body.velocity, cross(body.spin, lever));
    let gap_rate = subtract(point_velocity(b, lever_b), point_velocity(a, add(lever_a, gap)));
    let own = |x: [T; 3]| transposed_product(&axes, x);
    let (displacement, rate, spin) = (own(gap), own(gap_rate), own(subtract(b.spin, a.spin)));
    match joint {
        Joint3::Spherical => {
            let inverse = square(&e).sqrt().recip();
            q = e.map(|x| x * inverse);
            v = crate::mechanism::rotation::e_transposed_times(&q, spin).map(|x| x * 0.5);
        }
        Joint3::Universal => {
            let r = matrix(&e);
            q[0] = r[1][2].atan2(r[0][2]);
            let (sin, cos) = q[0].sin_cos();
            q[1] = (cos * r[1][0] - sin * r[0][0]).atan2(-r[2][0]);
            (v[0], v[1]) = (spin[2], dot([cos, sin, zero], spin));
        }
        _ => {
            for (k, axis) in joint.axes().iter().enumerate() {
                match *axis {
                    JointAxis::Slide(i) => (q[k], v[k]) = (displacement[i], rate[i]),
                    _ => {
                        let sign = if e[0].re() < 0.0 { -1.0 } else { 1.0 };
                        (q[k], v[k]) = ((e[3] * sign).atan2(e[0] * sign) * 2.0, spin[2]);
                    }
                }
            }
        }
    }
    (q, v)
}
