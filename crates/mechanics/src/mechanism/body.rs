//! Coordinates, and bodies, markers and poses made of them, in the plane and in space.

use crate::mechanism::rotation::Rotation;
use crate::mechanism::vector::add;
use autodiff::Scalar;

/// One coordinate of a mechanism, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Coordinate(pub(crate) usize);

/// A rigid body or a beam node: two translations in m and a rotation in rad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body {
    /// Horizontal position of the reference point.
    pub x: Coordinate,
    /// Vertical position of the reference point.
    pub y: Coordinate,
    /// Rotation, counter-clockwise.
    pub theta: Coordinate,
}

impl Body {
    /// The three coordinates.
    pub fn coordinates(self) -> [Coordinate; 3] {
        [self.x, self.y, self.theta]
    }

    /// The point of the body with the body-fixed coordinates (`x`, `y`) in m.
    pub fn at<S: Scalar>(self, x: S, y: S) -> Marker<S> {
        Marker { body: self, x, y }
    }

    /// The reference point of the body.
    pub fn origin<S: Scalar>(self) -> Marker<S> {
        self.at(S::from(0.0), S::from(0.0))
    }
}

/// A point fixed to a body.
#[derive(Clone, Copy, Debug)]
pub struct Marker<S> {
    /// The body.
    pub body: Body,
    /// Body-fixed x in m.
    pub x: S,
    /// Body-fixed y in m.
    pub y: S,
}

/// Position (m, m, rad) of a body or node.
#[derive(Clone, Copy, Debug)]
pub struct Pose<S> {
    /// Horizontal position.
    pub x: S,
    /// Vertical position.
    pub y: S,
    /// Rotation.
    pub theta: S,
}

/// A rigid body or frame in space: the position of its reference point and Euler parameters of its orientation.
///
/// The Euler parameters e = (e₀, e₁, e₂, e₃), scalar first, have the length one by a constraint of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body3 {
    /// Position of the reference point along x.
    pub x: Coordinate,
    /// Position of the reference point along y.
    pub y: Coordinate,
    /// Position of the reference point along z.
    pub z: Coordinate,
    /// Euler parameters, scalar first.
    pub e: [Coordinate; 4],
}

impl Body3 {
    /// The seven coordinates.
    pub fn coordinates(self) -> [Coordinate; 7] {
        let [e0, e1, e2, e3] = self.e;
        [self.x, self.y, self.z, e0, e1, e2, e3]
    }

    /// The marker at the point with the body-fixed coordinates `point` (m), with the axes of the body.
    pub fn at<S: Scalar>(self, point: [S; 3]) -> Marker3<S> {
        Marker3 { body: self, point, orientation: Rotation::identity() }
    }

    /// The marker at the reference point, with the axes of the body.
    pub fn origin<S: Scalar>(self) -> Marker3<S> {
        self.at([S::zero(); 3])
    }
}

/// A point fixed to a body in space, with axes x, y, z fixed to the body.
///
/// Joints use the axes: a revolute joint turns about z, a prismatic joint slides along z.
#[derive(Clone, Copy, Debug)]
pub struct Marker3<S> {
    /// The body.
    pub body: Body3,
    /// Body-fixed coordinates of the point in m.
    pub point: [S; 3],
    /// Orientation of the marker's axes relative to the body.
    pub orientation: Rotation<S>,
}

impl<S: Scalar> Marker3<S> {
    /// The marker with its axes turned by `rotation`, relative to its present axes.
    pub fn turned(self, rotation: Rotation<S>) -> Self {
        Self { orientation: self.orientation.then(rotation), ..self }
    }

    /// The marker with its z-axis along `axis` (components in the axes of the body); see [`Rotation::z_along`].
    pub fn with_z(self, axis: [S; 3]) -> Self {
        Self { orientation: Rotation::z_along(axis), ..self }
    }

    /// The marker with its z-axis along `z` and its x-axis near `x` (components in the axes of the body).
    pub fn with_z_x(self, z: [S; 3], x: [S; 3]) -> Self {
        Self { orientation: Rotation::from_z_x(z, x), ..self }
    }

    /// Parameters of the marker in an element: the point and the Euler parameters of its orientation.
    pub fn parameters(self) -> [S; 7] {
        let ([x, y, z], [e0, e1, e2, e3]) = (self.point, self.orientation.parameters());
        [x, y, z, e0, e1, e2, e3]
    }
}

/// Position (m) and orientation of a body in space.
#[derive(Clone, Copy, Debug)]
pub struct Pose3<S> {
    /// Position of the reference point in m.
    pub position: [S; 3],
    /// Orientation of the body's axes.
    pub orientation: Rotation<S>,
}

impl<S: Scalar> Pose3<S> {
    /// The pose at `position` (m) with the given orientation.
    pub fn new(position: [S; 3], orientation: Rotation<S>) -> Self {
        Self { position, orientation }
    }

    /// The pose at `position` (m) with the axes of the world.
    pub fn at(position: [S; 3]) -> Self {
        Self::new(position, Rotation::identity())
    }

    /// World coordinates of the point with the body-fixed coordinates `point` (m), to place one part on another.
    pub fn point(&self, point: [S; 3]) -> [S; 3] {
        add(self.position, self.orientation.rotate(point))
    }
}
