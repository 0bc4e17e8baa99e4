//! The transpose of [`Tree::place`] and [`Tree::place_virtual`]: from the tips to the ground, derivatives with respect to bodies
//! become those with respect to joint coordinates and to parameters of joints.

use crate::system::state::State;
use crate::tree::collect::prismatic_opening;
use crate::tree::joint::TreeBody;
use crate::tree::joint::{Joint, Levers, dot, rotated, turned};
use crate::tree::placement::TreeGeometry;
use crate::tree::space::placed::Twist;
use crate::tree::space::transpose::{BodyAdjoint, NodeJacobian, SpacePoint};
use crate::tree::topology::Tree;

/// A state of a tree in which its sweeps are transposed.
pub(crate) struct TreePoint<'a> {
    /// Positions, velocities and accelerations of all coordinates.
    pub state: &'a State<f64>,
    /// Joint coordinates, followed by their velocities.
    pub y: &'a [f64],
    /// Accelerations of the joint coordinates.
    pub a: &'a [f64],
    pub geometry: &'a TreeGeometry<f64>,
    /// Wrenches of the subtrees, from [`Tree::collect`] at these accelerations.
    pub wrenches: &'a [f64],
    /// Wrenches of the subtrees in space, and those of each body alone.
    pub in_space: [&'a [Twist<f64>]; 2],
    /// Derivatives of the bodies in space.
    pub jacobians: &'a [NodeJacobian],
}

/// Virtual displacements of a tree.
pub(crate) struct VirtualDisplacements<'a> {
    /// Of the joint coordinates.
    pub joints: &'a [f64],
    /// Of all coordinates, as computed by [`Tree::place_virtual`].
    pub bodies: &'a [f64],
    /// Openings of the constraints.
    pub gaps: &'a [f64],
}

impl Tree {
    /// Converts the derivatives with respect to `bodies` into those with respect to the joint coordinates and their
    /// velocities, `out`, including those of the power of `psi`.
    ///
    /// `add` receives the derivatives with respect to the parameters of joints: element, number of the parameter, derivative. On
    /// return `bodies` has those with respect to prescribed coordinates.
    pub fn transpose(
        &self,
        x: &TreePoint<'_>,
        psi: &VirtualDisplacements<'_>,
        bodies: &mut BodyAdjoint,
        out: &mut [f64],
        mut add: impl FnMut(usize, usize, f64),
    ) {
        let n = self.count;
        let (q, v) = x.y.split_at(n);
        let (by_q, by_v) = out.split_at_mut(n);
        by_q.fill(0.0);
        by_v.fill(0.0);
        let [wrenches, own] = x.in_space;
        let point = SpacePoint { state: x.state, joints: [q, v, x.a], placed: &x.geometry.placed, wrenches, own };
        self.space.transpose(&point, x.jacobians, psi, bodies, [by_q, by_v], &mut add);
        for k in (0..self.nodes.len()).rev() {
            let node = &self.nodes[k];
            if let Joint::Free { .. } = node.joint {
                for (k, i) in node.free_coordinates().enumerate() {
                    (out[node.first + k], out[n + node.first + k]) = (bodies.q[i], bodies.v[i]);
                }
                continue;
            }
            let [coordinate, rate] = transpose_joint(node, k, x, psi, bodies, &mut add, n);
            if node.joint.count() > 0 {
                (out[node.first], out[n + node.first]) = (coordinate, rate);
            }
        }
        for (k, &i) in self.singles.iter().enumerate() {
            let at = self.first_single + k;
            (out[at], out[n + at]) = (bodies.q[i], bodies.v[i]);
        }
    }
}

/// Derivatives with respect to the reference point of a body.
struct PointAdjoint {
    position: [f64; 2],
    velocity: [f64; 2],
    acceleration: [f64; 2],
    /// With respect to its virtual displacement.
    virtual_displacement: [f64; 2],
}

/// Σ factor · r.
fn sum<const N: usize>(terms: [(f64, [f64; 2]); N]) -> [f64; 2] {
    terms.iter().fold([0.0; 2], |s, (factor, r)| [s[0] + factor * r[0], s[1] + factor * r[1]])
}

impl PointAdjoint {
    /// Derivatives with respect to a lever whose tip moves the point by `sign` times its own motion: with the angular velocity `spin`, the angular
    /// acceleration `turn` and the virtual rotation `psi`.
    fn by_lever(&self, sign: f64, [spin, turn, psi]: [f64; 3]) -> [f64; 2] {
        sum([
            (sign, self.position),
            (-sign * spin, turned(self.velocity)),
            (-sign * turn, turned(self.acceleration)),
            (-sign * spin * spin, self.acceleration),
            (-sign * psi, turned(self.virtual_displacement)),
        ])
    }
}

/// Transposes one joint. Returns the derivatives with respect to its coordinate and velocity.
fn transpose_joint(
    node: &TreeBody,
    k: usize,
    x: &TreePoint<'_>,
    psi: &VirtualDisplacements<'_>,
    bodies: &mut BodyAdjoint,
    add: &mut impl FnMut(usize, usize, f64),
    n: usize,
) -> [f64; 2] {
    let ([px, py, pt], [cx, cy, ct]) = (node.parent, node.coordinates);
    let State { q, v, a, .. } = x.state;
    let Levers { base, parent, child, .. } = x.geometry.levers[k];
    let point = PointAdjoint {
        position: [bodies.q[cx], bodies.q[cy]],
        velocity: [bodies.v[cx], bodies.v[cy]],
        acceleration: [bodies.a[cx], bodies.a[cy]],
        virtual_displacement: [x.wrenches[cx], x.wrenches[cy]],
    };
    let (by_v, by_a) = (point.velocity, point.acceleration);
    let by_parent = point.by_lever(1.0, [v[pt], a[pt], psi.bodies[pt]]);
    let psi_turn = if node.joint == Joint::Pin { 0.0 } else { psi.bodies[ct] };
    let by_child = point.by_lever(-1.0, [v[ct], a[ct], psi_turn]);
    bodies.v[pt] += dot(by_v, turned(parent)) - 2.0 * v[pt] * dot(by_a, parent);
    bodies.v[ct] += -dot(by_v, turned(child)) + 2.0 * v[ct] * dot(by_a, child);
    bodies.a[pt] += dot(by_a, turned(parent));
    bodies.a[ct] -= dot(by_a, turned(child));
    let [mut coordinate, mut rate] = match node.joint {
        Joint::Prismatic => transpose_slide(node, (k, n), x, psi, (&point, by_parent), bodies, add),
        _ => [0.0; 2],
    };
    bodies.q[pt] += dot(by_parent, turned(base));
    bodies.q[ct] += dot(by_child, turned(child));
    if let Some((numbers, element)) = node.parameter_numbers().zip(node.element) {
        for (angle, by, points) in [(q[pt], by_parent, numbers.parent), (q[ct], by_child, numbers.child)] {
            let (sin, cos) = angle.sin_cos();
            let own = rotated((-sin, cos), by);
            points.into_iter().zip(own).for_each(|(number, derivative)| add(element, number, derivative));
        }
        numbers.angle.into_iter().for_each(|angle| add(element, angle, node.sign() * bodies.q[ct]));
    }
    for (bar, by) in [(&mut bodies.q, point.position), (&mut bodies.v, by_v), (&mut bodies.a, by_a)] {
        bar[px] += by[0];
        bar[py] += by[1];
        (bar[cx], bar[cy]) = (0.0, 0.0);
    }
    if node.joint != Joint::Pin {
        if node.joint == Joint::Revolute {
            coordinate += bodies.q[ct];
            rate += bodies.v[ct];
        }
        for bar in [&mut bodies.q, &mut bodies.v, &mut bodies.a] {
            bar[pt] += std::mem::take(&mut bar[ct]);
        }
    }
    [coordinate, rate]
}

/// Transposes the displacement along the line of a prismatic joint, number `k` of a tree with `n` joint coordinates. Returns the derivatives with
/// respect to displacement and speed.
fn transpose_slide(
    node: &TreeBody,
    (k, n): (usize, usize),
    x: &TreePoint<'_>,
    psi: &VirtualDisplacements<'_>,
    (point, by_parent): (&PointAdjoint, [f64; 2]),
    bodies: &mut BodyAdjoint,
    add: &mut impl FnMut(usize, usize, f64),
) -> [f64; 2] {
    let (pt, axis) = (node.parent[2], x.geometry.levers[k].axis);
    let (by_v, by_a, by_psi) = (point.velocity, point.acceleration, point.virtual_displacement);
    let (displacement, speed, acceleration) = (x.y[node.first], x.y[n + node.first], x.a[node.first]);
    let (along, _) = prismatic_opening(node, displacement, &psi.gaps[node.first_multiplier..]);
    let (spin, sideways) = (x.state.v[pt], turned(axis));
    let by_axis = sum([
        (speed, by_v),
        (acceleration, by_a),
        (-2.0 * spin * speed, turned(by_a)),
        (displacement, by_parent),
        (1.0, [0, 1].map(|i| psi.joints[node.first] * by_psi[i] - along * turned(by_psi)[i])),
    ]);
    let mut by_displacement = dot(by_parent, axis);
    if node.is_reversed {
        by_displacement += psi.gaps[node.first_multiplier + 1] * dot(by_psi, sideways);
    }
    bodies.v[pt] += 2.0 * speed * dot(by_a, sideways);
    let by_direction = dot(by_axis, sideways);
    bodies.q[node.first_body()[2]] += by_direction;
    if let Some((numbers, element)) = node.parameter_numbers().zip(node.element) {
        numbers.line.into_iter().for_each(|line| add(element, line, by_direction));
    }
    [by_displacement, dot(by_v, axis) + 2.0 * spin * dot(by_a, sideways)]
}
