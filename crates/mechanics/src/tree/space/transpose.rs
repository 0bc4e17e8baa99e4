//! The transpose of the sweeps over a tree in space: derivatives with respect to bodies become those with respect to joint
//! coordinates and to parameters of joints.
//!
//! The derivatives of each body with respect to its parent, its joint coordinates and the markers of its joint are those of
//! [`place_joint`] in dual numbers. They are computed once at each state, for all responses.

use crate::mechanism::rotation::{e_times, e_transposed_times, square};
use crate::mechanism::scalars::{Dual8, StateScalar};
use crate::mechanism::vector::cross;
use crate::system::state::State;
use crate::tree::space::joint::{BodyMotion, Joint3, angular_velocity, markers};
use crate::tree::space::placed::{PlacedBody, Twist, halves, joined, of_body, rates, rows_of_moment};
use crate::tree::space::plan::{Node3, Slot, Space};
use crate::tree::space::sweep::{accelerate_joint, normalized, place_joint, reaction_column};
use autodiff::WIDTH;

/// A variable on which a body depends through its joint.
#[derive(Clone, Copy, Debug)]
enum BodyInput {
    /// Position (0), velocity (1) or acceleration (2) of a coordinate of the mechanism.
    Coordinate(usize, usize),
    /// A joint coordinate (0) or its velocity (1).
    Joint(usize, usize),
    /// A parameter of the joint's element.
    Parameter(usize),
}

/// Derivatives of a body and of the columns of its joint.
#[derive(Clone, Debug, Default)]
pub(crate) struct NodeJacobian {
    inputs: Vec<BodyInput>,
    /// Number of outputs: coordinates with velocities and accelerations, the arm, columns.
    outputs: usize,
    /// By input, then by output.
    values: Vec<f64>,
}

/// Number of outputs before the columns: positions, velocities and accelerations of seven coordinates, and the arm.
const FIXED: usize = 24;

/// A state of trees in space in which their sweeps are transposed.
pub(crate) struct SpacePoint<'a> {
    pub state: &'a State<f64>,
    /// Joint coordinates, their velocities and their accelerations.
    pub joints: [&'a [f64]; 3],
    pub placed: &'a [PlacedBody<f64>],
    /// Wrenches of the parts of the trees, and those of the elements on each body alone.
    pub wrenches: &'a [Twist<f64>],
    pub own: &'a [Twist<f64>],
}

/// Derivatives of one response with respect to positions, velocities and accelerations of all coordinates.
#[derive(Clone, Debug, Default)]
pub(crate) struct BodyAdjoint {
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub a: Vec<f64>,
}

/// The seven coordinates of a body in numbers that are seeded.
struct SeededCoordinates {
    first: usize,
    next: usize,
}

impl SeededCoordinates {
    fn seed(&mut self, value: f64) -> Dual8 {
        let k = self.next;
        self.next += 1;
        match k.checked_sub(self.first) {
            Some(k) if k < WIDTH => Dual8::variable(value, k),
            _ => Dual8::constant(value),
        }
    }

    fn all<const N: usize>(&mut self, values: &[f64; N]) -> [Dual8; N] {
        values.map(|x| self.seed(x))
    }
}

/// A body with these positions, velocities and accelerations of its coordinates.
fn placed_body([q, v, a]: [[Dual8; 7]; 3]) -> PlacedBody<Dual8> {
    let mut body = PlacedBody::of(&q, &v);
    body.accelerate(&v, &a);
    body
}

impl NodeJacobian {
    /// Derivatives of the node with number `k`; those with respect to the parameters of its joint if `has_parameters`.
    fn new(
        space: &Space,
        k: usize,
        x: &SpacePoint<'_>,
        parameters: &[f64],
        (has_parameters, has_reactions): (bool, bool),
    ) -> Self {
        let node = &space.nodes[k];
        let State { q, v, a, .. } = x.state;
        let of = |coordinates: &[usize; 7]| [q, v, a].map(|x| of_body(x, coordinates));
        let mut inputs = Vec::new();
        let add_body = |inputs: &mut Vec<BodyInput>, c: &[usize; 7]| {
            (0..3).for_each(|order| inputs.extend(c.iter().map(|&i| BodyInput::Coordinate(order, i))));
        };
        add_body(&mut inputs, &node.parent);
        let is_pin = node.joint == Joint3::Pin;
        if is_pin {
            add_body(&mut inputs, &node.coordinates);
        }
        let width = if node.joint == Joint3::Spherical { 4 } else { node.slots.len() };
        for order in 0..3 {
            inputs.extend((0..width).map(|i| match node.slots.get(i) {
                Some(Slot::Prescribed(coordinate)) => BodyInput::Coordinate(order, *coordinate),
                Some(Slot::Free(at)) => BodyInput::Joint(order, *at),
                None => BodyInput::Joint(order, node.first + i),
            }));
        }
        if has_parameters {
            inputs.extend((0..14).map(BodyInput::Parameter));
        }
        let values: [[f64; 4]; 3] = [0, 1, 2].map(|order| space.of_joint(node, x.joints[order], [q, v, a][order]));
        let mut jacobian = Self { inputs, outputs: 0, values: Vec::new() };
        for first in (0..jacobian.inputs.len()).step_by(WIDTH) {
            let mut seeds = SeededCoordinates { first, next: 0 };
            let parent = placed_body(of(&node.parent).map(|x| seeds.all(&x)));
            let own = match is_pin {
                true => placed_body(of(&node.coordinates).map(|x| seeds.all(&x))),
                false => PlacedBody::zero(),
            };
            let mut joint = values.map(|x| x.map(Dual8::constant));
            for joint in &mut joint {
                joint[..width].iter_mut().for_each(|x| *x = seeds.seed(x.re));
            }
            let p: Vec<Dual8> = match has_parameters {
                true => parameters.iter().map(|&p| seeds.seed(p)).collect(),
                false => parameters.iter().map(|&p| Dual8::constant(p)).collect(),
            };
            let mut body = place_joint(node, &markers(&p), &parent, &own, &joint[0], &joint[1]);
            accelerate_joint(node, &mut body, &parent, &own, (&joint[0], &joint[2]));
            let (position, velocity) = body.coordinates();
            let mut outputs: Vec<Dual8> = [position, velocity, body.second()].concat();
            outputs.extend(body.arm);
            columns(node, &body, &joint[0], &mut outputs);
            if has_reactions {
                node.rows.iter().for_each(|row| outputs.extend(reaction_column(node, &body, *row)));
            }
            jacobian.outputs = outputs.len();
            let count = WIDTH.min(jacobian.inputs.len() - first);
            (0..count).for_each(|k| jacobian.values.extend(outputs.iter().map(|output| output.eps[k])));
        }
        jacobian
    }
}

/// Appends the motions of a body at the rate one of each joint coordinate.
fn columns<T: StateScalar>(node: &Node3, body: &PlacedBody<T>, q: &[T; 4], out: &mut Vec<T>) {
    if node.joint == Joint3::Spherical {
        for k in 0..4 {
            let mut unit = [T::from(0.0); 4];
            unit[k] = T::from(1.0);
            let spin = angular_velocity(q, &unit);
            out.extend((0..6).map(|i| (0..3).map(|j| body.columns[j][i] * spin[j]).sum::<T>()));
        }
    } else {
        body.columns[..node.slots.len()].iter().for_each(|column| out.extend(column));
    }
}

impl Space {
    /// Derivatives of each body with respect to its parent, its joint and the markers; empty for a body without a joint. `is_active`
    /// returns whether parameters of an element depend on the design.
    pub fn jacobians<'p>(
        &self,
        x: &SpacePoint<'_>,
        parameters: impl Fn(usize) -> &'p [f64],
        is_active: impl Fn(usize) -> bool,
        has_reactions: bool,
    ) -> Vec<NodeJacobian> {
        let of = |(k, node): (usize, &Node3)| match node.element {
            Some(element) => NodeJacobian::new(self, k, x, parameters(element), (is_active(element), has_reactions)),
            None => NodeJacobian::default(),
        };
        self.nodes.iter().enumerate().map(of).collect()
    }

    /// Writes the virtual displacements of all coordinates for those of the joint coordinates, `psi`, and for constraints that are
    /// violated by −`gaps`, see [`Tree::place_virtual`](crate::tree::Tree::place_virtual).
    pub fn place_virtual(
        &self,
        placed: &[PlacedBody<f64>],
        q: &[f64],
        psi: &[f64],
        gaps: Option<&[f64]>,
        (twists, out): (&mut [Twist<f64>], &mut [f64]),
    ) {
        for (k, node) in self.nodes.iter().enumerate() {
            let body = &placed[k];
            let mut twist = [0.0; 6];
            if let Joint3::Free { .. } = node.joint {
                let mut own = [0.0; 7];
                for (at, i) in node.free_coordinates() {
                    let slot = node.coordinates.iter().position(|c| *c == i).unwrap_or(0);
                    own[slot] = psi[at];
                }
                let spin = angular_velocity(&body.e, &[own[3], own[4], own[5], own[6]]);
                twist = joined([spin, [own[0], own[1], own[2]]]);
            } else if let Some(parent) = node.parent_node {
                let [spin, shift] = halves(&twists[parent]);
                let (lever, spin_of_body) = match node.joint {
                    Joint3::Pin => (body.arm, [0.0; 3]),
                    _ => (body.lever, spin),
                };
                let swing = cross(spin, lever);
                twist = joined([spin_of_body, [0, 1, 2].map(|i| shift[i] + swing[i])]);
            }
            let mut add = |factor: f64, column: &Twist<f64>| {
                twist.iter_mut().zip(column).for_each(|(to, from)| *to += factor * from);
            };
            if node.joint == Joint3::Spherical {
                let own = self.of_joint(node, psi, &[]);
                let spin = angular_velocity(&self.of_joint(node, q, &[]), &own);
                spin.iter().zip(&body.columns).for_each(|(rate, column)| add(*rate, column));
            }
            for (slot, column) in node.slots.iter().zip(&body.columns) {
                if let Slot::Free(at) = *slot {
                    add(psi[at], column);
                }
            }
            if let Some(gaps) = gaps {
                for (k, row) in node.rows.iter().enumerate() {
                    add(gaps[node.first_multiplier + k], &reaction_column(node, body, *row));
                }
                for attached in &node.attached {
                    if let Slot::Prescribed(_) = node.slots[attached.slot] {
                        add(-gaps[attached.multiplier], &body.columns[attached.slot]);
                    }
                }
            }
            for attached in &node.attached {
                if let Slot::Free(at) = node.slots[attached.slot] {
                    out[attached.coordinate] = psi[at] + gaps.map_or(0.0, |gaps| gaps[attached.multiplier]);
                }
            }
            twists[k] = twist;
            let [spin, shift] = halves(&twist);
            let e = rates(&body.e, spin);
            let own = [shift[0], shift[1], shift[2], e[0], e[1], e[2], e[3]];
            for (slot, &i) in node.coordinates.iter().enumerate().take(node.own_coordinates()) {
                out[i] = own[slot];
            }
        }
    }

    /// Moves the derivatives `bodies` to the joint coordinates (`by_q`) and their velocities (`by_v`), and those of the power of the
    /// virtual displacements as well: `psi` of the joint coordinates, `virtuals` of all coordinates, `gaps` of the constraints.
    pub fn transpose(
        &self,
        x: &SpacePoint<'_>,
        jacobians: &[NodeJacobian],
        (psi, virtuals, gaps): (&[f64], &[f64], &[f64]),
        bodies: &mut BodyAdjoint,
        [by_q, by_v]: [&mut [f64]; 2],
        add: &mut impl FnMut(usize, usize, f64),
    ) {
        let mut bars = Vec::new();
        for (k, (node, jacobian)) in self.nodes.iter().zip(jacobians).enumerate().rev() {
            let (body, wrench) = (&x.placed[k], &x.wrenches[k]);
            let [moment, force] = halves(wrench);
            if node.rotates() {
                // The weights of the rows of the Euler parameters are ½ Eᵀ ψ.
                let own = virtual_spin(body, node, virtuals);
                let rows = rows_of_moment(&body.e, halves(&x.own[k])[0]);
                let by_e = e_transposed_times(&rows, own);
                (0..4).for_each(|i| bodies.q[node.coordinates[3 + i]] -= 0.5 * by_e[i]);
            }
            if let Joint3::Free { turns, .. } = node.joint {
                if turns {
                    self.transpose_turn(node, psi, moment, &body.e, bodies);
                }
                for (at, i) in node.free_coordinates() {
                    (by_q[at], by_v[at]) = (std::mem::take(&mut bodies.q[i]), std::mem::take(&mut bodies.v[i]));
                    bodies.a[i] = 0.0;
                }
                continue;
            }
            bars.clear();
            for all in [&bodies.q, &bodies.v, &bodies.a] {
                bars.extend(node.coordinates.iter().enumerate().map(|(slot, &i)| {
                    match slot < node.own_coordinates() {
                        true => all[i],
                        false => 0.0,
                    }
                }));
            }
            bars.extend([0.0; 3]);
            let parent_spin = match node.parent_node {
                Some(parent) => virtual_spin(&x.placed[parent], &self.nodes[parent], virtuals),
                None => [0.0; 3],
            };
            let by_lever = cross(force, parent_spin);
            for i in 0..3 {
                if node.joint == Joint3::Pin {
                    bars[21 + i] += by_lever[i];
                } else {
                    bars[i] += by_lever[i];
                    bodies.q[node.parent[i]] -= by_lever[i];
                }
            }
            let weights = |factor: f64| wrench.map(|w| factor * w);
            if node.joint == Joint3::Spherical {
                (0..4).for_each(|i| bars.extend(weights(psi[node.first + i])));
            }
            for (slot, source) in node.slots.iter().enumerate() {
                let factor = match *source {
                    Slot::Free(at) => psi[at],
                    Slot::Prescribed(_) => {
                        let own = node.attached.iter().find(|attached| attached.slot == slot);
                        own.map_or(0.0, |attached| -gaps[attached.multiplier])
                    }
                };
                bars.extend(weights(factor));
            }
            let reactions = (0..node.rows.len()).map(|k| gaps[node.first_multiplier + k]);
            reactions.for_each(|gap| bars.extend(weights(gap)));
            for (order, all) in [&mut bodies.q, &mut bodies.v, &mut bodies.a].into_iter().enumerate() {
                node.coordinates.iter().take(node.own_coordinates()).for_each(|&i| all[i] = 0.0);
                for attached in &node.attached {
                    if let Slot::Free(at) = node.slots[attached.slot] {
                        let bar = std::mem::take(&mut all[attached.coordinate]);
                        match order {
                            0 => by_q[at] += bar,
                            1 => by_v[at] += bar,
                            _ => {}
                        }
                    }
                }
            }
            for (input, values) in jacobian.inputs.iter().zip(jacobian.values.chunks_exact(jacobian.outputs)) {
                let derivative = values.iter().zip(&bars).map(|(a, b)| a * b).sum::<f64>();
                match *input {
                    BodyInput::Coordinate(order, i) => {
                        let to = [&mut bodies.q, &mut bodies.v, &mut bodies.a][order].get_mut(i);
                        to.into_iter().for_each(|to| *to += derivative);
                    }
                    BodyInput::Joint(0, at) => by_q[at] += derivative,
                    BodyInput::Joint(1, at) => by_v[at] += derivative,
                    BodyInput::Joint(..) => {}
                    BodyInput::Parameter(i) => node.element.into_iter().for_each(|element| add(element, i, derivative)),
                }
            }
            debug_assert!(jacobian.outputs <= bars.len() && jacobian.outputs >= FIXED);
        }
        // ψᵀ e (e·ë + ė·ė), where the second factor is zero.
        let [q, v, a] = x.joints;
        for &first in &self.quaternions {
            let along: f64 = (first..first + 4).map(|k| psi[k] * q[k]).sum();
            for k in first..first + 4 {
                by_q[k] += along * a[k];
                by_v[k] += 2.0 * along * v[k];
            }
        }
    }

    /// Adds the derivatives with respect to the part along e of the second derivatives of the Euler parameters of free bodies, which
    /// [`Space::collect`] leaves out, from those of all coordinates.
    pub fn collect_lengths(&self, placed: &[PlacedBody<f64>], bodies: &[f64], out: &mut [f64]) {
        for (node, body) in self.nodes.iter().zip(placed) {
            if let Joint3::Free { turns: true, .. } = node.joint {
                let [.., a, b, c, d] = of_body(bodies, &node.coordinates);
                let along: f64 = [a, b, c, d].iter().zip(&body.e).map(|(x, e)| x * e).sum::<f64>() / square(&body.e);
                let first = node.first + node.count() - 4;
                out[first..first + 4].iter_mut().zip(&body.e).for_each(|(out, e)| *out += along * e);
            }
        }
    }

    /// Propagates the derivatives of one response with respect to the projected joint coordinates and velocities to those before
    /// [`Space::normalize`], which were `y`.
    pub fn transpose_normalization<const W: usize>(&self, y: &[f64], adjoint: &mut [[f64; W]]) {
        let n = y.len() / 2;
        for &first in &self.quaternions {
            let at = |k: usize| first + k % 4 + if k < 4 { 0 } else { n };
            let seeded: [Dual8; 8] = std::array::from_fn(|k| Dual8::variable(y[at(k)], k));
            let half = |from: usize| [0, 1, 2, 3].map(|k| seeded[from + k]);
            let (e, rate) = normalized(half(0), half(4));
            let outputs = [e, rate];
            let before: [[f64; W]; 8] = std::array::from_fn(|k| {
                let mut sum = [0.0; W];
                for (i, output) in outputs.as_flattened().iter().enumerate() {
                    sum.iter_mut().zip(&adjoint[at(i)]).for_each(|(sum, bar)| *sum += output.eps[k] * bar);
                }
                sum
            });
            before.into_iter().enumerate().for_each(|(k, bar)| adjoint[at(k)] = bar);
        }
    }

    /// Adds the derivatives of the power of `moment` on the virtual rotation 2 E ψ/|e|² of a free body with respect to e.
    fn transpose_turn(&self, node: &Node3, psi: &[f64], moment: [f64; 3], e: &[f64; 4], bodies: &mut BodyAdjoint) {
        let first = node.first + node.count() - 4;
        let own = [0, 1, 2, 3].map(|k| psi[first + k]);
        let factor = 2.0 / square(e);
        let by_product = e_transposed_times(&own, moment);
        let spin = e_times(e, &own);
        let value: f64 = (0..3).map(|k| moment[k] * spin[k]).sum();
        for k in 0..4 {
            bodies.q[node.coordinates[3 + k]] -= factor * (by_product[k] + factor * value * e[k]);
        }
    }

    /// Calls `add` with the derivatives of the joint coordinates and velocities of all nodes, [`Space::write_joint_state`]: joint
    /// coordinate, source, derivatives of the coordinate and of its velocity.
    pub fn differentiate_joint_state<'p>(
        &self,
        state: &State<f64>,
        parameters: impl Fn(usize) -> &'p [f64],
        mut add: impl FnMut(usize, StartVariable, [f64; 2]),
    ) {
        for node in &self.nodes {
            for (at, i) in node.free_coordinates() {
                add(at, StartVariable::Position(i), [1.0, 0.0]);
                add(at, StartVariable::Velocity(i), [0.0, 1.0]);
            }
            let Some(element) = node.element.filter(|_| node.count() > 0) else { continue };
            let attached = |slot: usize| node.attached.iter().find(|attached| attached.slot == slot);
            let own: Vec<(usize, usize)> = match node.joint {
                Joint3::Spherical => (0..4).map(|k| (k, node.first + k)).collect(),
                _ => {
                    let free = node.slots.iter().enumerate().filter_map(|(slot, source)| match *source {
                        Slot::Free(at) => Some((slot, at)),
                        Slot::Prescribed(_) => None,
                    });
                    free.filter(|(slot, at)| {
                        let on = attached(*slot);
                        if let Some(attached) = on {
                            add(*at, StartVariable::Position(attached.coordinate), [1.0, 0.0]);
                            add(*at, StartVariable::Velocity(attached.coordinate), [0.0, 1.0]);
                        }
                        on.is_none()
                    })
                    .collect()
                }
            };
            if own.is_empty() {
                continue;
            }
            let bodies = [&node.parent, &node.coordinates];
            let mut variables = Vec::new();
            let mut values = Vec::new();
            for body in bodies {
                variables.extend(body.iter().map(|&i| StartVariable::Position(i)));
                variables.extend(body.iter().map(|&i| StartVariable::Velocity(i)));
                values.extend(of_body(&state.q, body).into_iter().chain(of_body(&state.v, body)));
            }
            variables.extend((0..14).map(|i| StartVariable::Parameter(element, i)));
            values.extend_from_slice(&parameters(element)[..14]);
            for first in (0..values.len()).step_by(WIDTH) {
                let mut seeds = SeededCoordinates { first, next: 0 };
                let seeded: Vec<Dual8> = values.iter().map(|&x| seeds.seed(x)).collect();
                let body = |from: usize| {
                    BodyMotion::of(
                        &std::array::from_fn(|k| seeded[from + k]),
                        &std::array::from_fn(|k| seeded[from + 7 + k]),
                    )
                };
                let (q, v) = self.joint_state(node, &markers(&seeded[28..]), [&body(0), &body(14)]);
                for k in 0..WIDTH.min(values.len() - first) {
                    for &(slot, at) in &own {
                        add(at, variables[first + k], [q[slot].eps[k], v[slot].eps[k]]);
                    }
                }
            }
        }
    }
}

/// Angular part of the virtual displacement of a body.
fn virtual_spin(body: &PlacedBody<f64>, node: &Node3, virtuals: &[f64]) -> [f64; 3] {
    if !node.rotates() {
        return [0.0; 3];
    }
    let [.., e0, e1, e2, e3] = of_body(virtuals, &node.coordinates);
    angular_velocity(&body.e, &[e0, e1, e2, e3])
}

/// A variable on which the joint coordinates at the start of a motion depend.
#[derive(Clone, Copy, Debug)]
pub(crate) enum StartVariable {
    /// Position of a coordinate of the mechanism.
    Position(usize),
    /// Velocity of one.
    Velocity(usize),
    /// A parameter of an element.
    Parameter(usize, usize),
}
