//! One body of a tree with its joint: parameters, levers, and the joint coordinate of given positions.

use crate::mechanism::scalars::StateScalar;
use crate::system::state::State;

/// Connection of a body to its parent in a tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Joint {
    /// An angle relative to the parent.
    Revolute,
    /// A revolute joint of a body whose rotation is prescribed, such as a driven crank or a point mass: no coordinate.
    Pin,
    /// A displacement along a line.
    Prismatic,
    /// No coordinate.
    Fixed,
    /// Without a parent: those of x, y and θ that are not prescribed are the coordinates.
    Free {
        /// For x, y and θ, true if it is not prescribed.
        is_free: [bool; 3],
    },
}

impl Joint {
    /// Number of joint coordinates.
    pub fn count(self) -> usize {
        match self {
            Self::Revolute | Self::Prismatic => 1,
            Self::Pin | Self::Fixed => 0,
            Self::Free { is_free } => is_free.into_iter().filter(|free| *free).count(),
        }
    }
}

/// A body of a tree, and the joint that connects it to its parent.
#[derive(Clone, Debug)]
pub(crate) struct TreeBody {
    /// Coordinates x, y and θ of the body.
    pub coordinates: [usize; 3],
    /// Coordinates of the parent: a body of the tree or one whose motion is prescribed. Those of the body itself if it is free.
    pub parent: [usize; 3],
    /// Number of the parent in the tree, unless its motion is prescribed.
    pub parent_node: Option<usize>,
    /// Kind of the joint.
    pub joint: Joint,
    /// Number of the joint's element.
    pub element: Option<usize>,
    /// True if the body is that of the first point of the element, and the parent that of the second.
    pub is_reversed: bool,
    /// First joint coordinate.
    pub first: usize,
    /// First multiplier of the element.
    pub first_multiplier: usize,
}

/// Numbers of the parameters of a joint in its element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ParameterNumbers {
    /// Point of the parent, x and y.
    pub parent: [usize; 2],
    /// Point of the body, x and y.
    pub child: [usize; 2],
    /// Direction of the line in the body of the element's first point.
    pub line: Option<usize>,
    /// Rotation of the element's second body relative to its first one.
    pub angle: Option<usize>,
}

impl TreeBody {
    /// The coordinates of a free body that are not prescribed.
    pub fn free_coordinates(&self) -> impl Iterator<Item = usize> + use<> {
        let is_free = if let Joint::Free { is_free } = self.joint { is_free } else { [false; 3] };
        self.coordinates.into_iter().zip(is_free).filter(|(_, free)| *free).map(|(i, _)| i)
    }

    /// Numbers of the joint's parameters, or `None` without a joint.
    pub fn parameter_numbers(&self) -> Option<ParameterNumbers> {
        let (b, line, angle) = match self.joint {
            Joint::Revolute | Joint::Pin => ([2, 3], None, None),
            Joint::Fixed => ([2, 3], None, Some(4)),
            Joint::Prismatic => ([3, 4], Some(2), Some(5)),
            Joint::Free { .. } => return None,
        };
        let [parent, child] = if self.is_reversed { [b, [0, 1]] } else { [[0, 1], b] };
        Some(ParameterNumbers { parent, child, line, angle })
    }

    /// −1 if the body is that of the first point of the joint's element, otherwise 1.
    pub fn sign(&self) -> f64 {
        if self.is_reversed { -1.0 } else { 1.0 }
    }

    /// The body of the joint's first point, from which a line is measured: the coordinates of the parent or of the child.
    pub fn first_body(&self) -> [usize; 3] {
        if self.is_reversed { self.coordinates } else { self.parent }
    }
}

/// Parameters of a joint as seen from the tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointParameters<T> {
    /// Point of the parent.
    pub parent: [T; 2],
    /// Point of the body.
    pub child: [T; 2],
    /// Direction of the line in the body of the element's first point.
    pub line: T,
    /// Rotation of the body relative to its parent, if it is constant.
    pub angle: T,
}

impl<T: StateScalar> JointParameters<T> {
    /// From the parameters of the element.
    pub fn of(node: &TreeBody, p: &[T]) -> Self {
        let zero = T::from(0.0);
        let Some(numbers) = node.parameter_numbers() else {
            return Self { parent: [zero; 2], child: [zero; 2], line: zero, angle: zero };
        };
        Self {
            parent: numbers.parent.map(|k| p[k]),
            child: numbers.child.map(|k| p[k]),
            line: numbers.line.map_or(zero, |k| p[k]),
            angle: numbers.angle.map_or(zero, |k| p[k] * node.sign()),
        }
    }
}

/// Vectors of a joint in the axes of the plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levers<T> {
    /// From the reference point of the parent to the joint's point of the parent.
    pub base: [T; 2],
    /// From the reference point of the parent to the joint's point of the body: `base` and the displacement.
    pub parent: [T; 2],
    /// From the reference point of the body to the joint's point of the body.
    pub child: [T; 2],
    /// Unit vector of the line, positive for a positive displacement of the body.
    pub axis: [T; 2],
    /// Sine and cosine of the rotations of the parent and of the body.
    pub rotations: [(T, T); 2],
}

impl<T: StateScalar> Levers<T> {
    /// Zero vectors.
    pub fn zero() -> Self {
        let zero = [T::from(0.0); 2];
        Self { base: zero, parent: zero, child: zero, axis: zero, rotations: [(T::from(0.0), T::from(1.0)); 2] }
    }

    /// From the reference point of the parent to that of the body.
    #[inline(always)]
    pub fn between(&self) -> [T; 2] {
        [self.parent[0] - self.child[0], self.parent[1] - self.child[1]]
    }
}

/// The vector r turned by 90°: the velocity of its tip at the angular velocity one.
#[inline(always)]
pub(crate) fn turned<T: StateScalar>(r: [T; 2]) -> [T; 2] {
    [-r[1], r[0]]
}

/// Scalar product.
#[inline(always)]
pub(crate) fn dot<T: StateScalar>(a: [T; 2], b: [T; 2]) -> T {
    a[0] * b[0] + a[1] * b[1]
}

/// A body-fixed vector in the axes of the plane, for the rotation with this sine and cosine.
#[inline(always)]
pub(crate) fn rotated<T: StateScalar>((sin, cos): (T, T), r: [T; 2]) -> [T; 2] {
    [cos * r[0] - sin * r[1], sin * r[0] + cos * r[1]]
}

/// Coordinate and rate of a revolute or prismatic joint between two bodies with the positions and velocities (x, y, θ) of
/// `parent` and `child`, which satisfy the joint's constraints.
pub(crate) fn joint_coordinate<T: StateScalar>(
    node: &TreeBody,
    p: &[T],
    [parent_q, parent_v]: [[T; 3]; 2],
    [child_q, child_v]: [[T; 3]; 2],
) -> [T; 2] {
    if node.joint == Joint::Revolute {
        return [child_q[2] - parent_q[2], child_v[2] - parent_v[2]];
    }
    let parameters = JointParameters::of(node, p);
    let from = rotated(parent_q[2].sin_cos(), parameters.parent);
    let to = rotated(child_q[2].sin_cos(), parameters.child);
    let rotation = if node.is_reversed { child_q[2] } else { parent_q[2] } + parameters.line;
    let (sin, cos) = rotation.sin_cos();
    let axis = [cos * node.sign(), sin * node.sign()];
    let (spin_from, spin_to) = (turned(from), turned(to));
    let [mut along, mut rate] = [[T::from(0.0); 2]; 2];
    for i in 0..2 {
        along[i] = child_q[i] + to[i] - parent_q[i] - from[i];
        rate[i] = child_v[i] + child_v[2] * spin_to[i] - parent_v[i] - parent_v[2] * spin_from[i];
    }
    [dot(axis, along), dot(axis, rate)]
}

/// The values of `x` for the three coordinates of a body.
#[inline(always)]
pub(crate) fn of_body<T: Copy>(x: &[T], coordinates: [usize; 3]) -> [T; 3] {
    coordinates.map(|i| x[i])
}

/// Position and velocity of a body.
pub(crate) fn motion_of<T: StateScalar>(state: &State<T>, coordinates: [usize; 3]) -> [[T; 3]; 2] {
    [of_body(&state.q, coordinates), of_body(&state.v, coordinates)]
}
