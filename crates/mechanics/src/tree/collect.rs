//! From the tips to the ground: rows of the joints, wrenches and reactions.

use crate::mechanism::scalars::StateScalar;
use crate::tree::joint::TreeBody;
use crate::tree::joint::{Joint, Levers, dot, turned};
use crate::tree::placement::TreeGeometry;
use crate::tree::space::placed::Twist;
use crate::tree::topology::Tree;

impl Tree {
    /// Adds the rows of every body to those of its parent, and writes the rows of the joint coordinates to `out`.
    ///
    /// `rows` are inertia − force by coordinate, and `wrenches` those of bodies in space; q are the joint coordinates. On return those
    /// of a body are the wrench of the subtree that begins with this body, about its reference point.
    #[inline(always)]
    pub fn collect<T: StateScalar>(
        &self,
        geometry: &TreeGeometry<T>,
        q: &[T],
        (rows, wrenches): (&mut [T], &mut [Twist<T>]),
        out: &mut [T],
    ) {
        self.space.collect(&geometry.placed, q, rows, wrenches, out);
        for (node, levers) in self.nodes.iter().zip(&geometry.levers).rev() {
            let [x, y, turn] = node.coordinates;
            let (force, moment) = ([rows[x], rows[y]], rows[turn]);
            match node.joint {
                Joint::Free { .. } => {
                    for (k, i) in node.free_coordinates().enumerate() {
                        out[node.first + k] = rows[i];
                    }
                    continue;
                }
                Joint::Revolute => out[node.first] = moment - dot(turned(levers.child), force),
                Joint::Prismatic => out[node.first] = dot(levers.axis, force),
                Joint::Pin | Joint::Fixed => {}
            }
            let [px, py, p_turn] = node.parent;
            rows[px] += force[0];
            rows[py] += force[1];
            rows[p_turn] += match node.joint {
                Joint::Pin => dot(turned(levers.parent), force),
                _ => moment + dot(turned(levers.between()), force),
            };
        }
        for (k, &i) in self.singles.iter().enumerate() {
            out[self.first_single + k] = rows[i];
        }
    }

    /// Writes the multipliers of the joints in equilibrium, from the wrenches that [`Tree::collect`] has left in `rows` and `wrenches`.
    ///
    /// They have the signs of the joints' elements: a reaction Φ_qᵀ λ is in equilibrium with the wrench.
    pub fn reactions<T: StateScalar>(
        &self,
        y: &[T],
        geometry: &TreeGeometry<T>,
        (rows, wrenches): (&[T], &[Twist<T>]),
        multipliers: &mut [T],
    ) {
        self.space.reactions(&geometry.placed, rows, wrenches, multipliers);
        for (node, levers) in self.nodes.iter().zip(&geometry.levers) {
            let [x, y_row, turn] = node.coordinates;
            let force = [rows[x], rows[y_row]];
            let moment = |rows: &[T]| rows[turn] - dot(turned(levers.child), force);
            let (sign, l) = (node.sign(), &mut multipliers[node.first_multiplier..]);
            match node.joint {
                Joint::Free { .. } => {}
                Joint::Revolute | Joint::Pin => (l[0], l[1]) = (force[0] * sign, force[1] * sign),
                Joint::Fixed => (l[0], l[1], l[2]) = (force[0] * sign, force[1] * sign, moment(rows) * sign),
                // The axis is that of the line times the sign.
                Joint::Prismatic => {
                    let normal = dot(turned(levers.axis), force);
                    l[0] = -normal;
                    l[1] = match node.is_reversed {
                        false => -moment(rows),
                        true => moment(rows) + y[node.first] * normal,
                    };
                }
            }
        }
    }

    /// Virtual displacement (x, y, rotation) of a body relative to its parent at the joint, which opens the joint's constraints
    /// by the negative `gaps`: the transpose of [`Tree::reactions`].
    pub fn opening(&self, node: &TreeBody, y: &[f64], gaps: &[f64], levers: &Levers<f64>) -> [f64; 3] {
        let sign = node.sign();
        match node.joint {
            Joint::Free { .. } => [0.0; 3],
            Joint::Revolute | Joint::Pin => [gaps[0] * sign, gaps[1] * sign, 0.0],
            Joint::Fixed => [gaps[0] * sign, gaps[1] * sign, gaps[2] * sign],
            Joint::Prismatic => {
                let (along_normal, rotation) = prismatic_opening(node, y[node.first], gaps);
                let [x, y] = turned(levers.axis).map(|n| n * along_normal);
                [x, y, rotation]
            }
        }
    }
}

/// Virtual displacement along the normal of a prismatic joint, and rotation, for the negative `gaps` of its constraints.
pub(crate) fn prismatic_opening(node: &TreeBody, displacement: f64, gaps: &[f64]) -> (f64, f64) {
    match node.is_reversed {
        false => (-gaps[0], -gaps[1]),
        true => (-gaps[0] + displacement * gaps[1], gaps[1]),
    }
}
