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
use crate::tree::space::sweep::{accelerate_joint, normalized, place_joint, reaction_column};
use crate::tree::space::topology::{Node3, Slot, Space};
use crate::tree::transpose::VirtualDisplacements;
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
    /// Wrenches of the subtrees, and those of the elements on each body alone.
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

impl BodyAdjoint {
    /// Sets all derivatives to zero.
    pub fn clear(&mut self) {
        [&mut self.q, &mut self.v, &mut self.a].into_iter().for_each(|all| all.fill(0.0));
    }
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
        let inputs = inputs_of(node, has_parameters);
        let mut jacobian = Self { inputs, outputs: 0, values: Vec::new() };
        for first in (0..jacobian.inputs.len()).step_by(WIDTH) {
            let mut seeds = SeededCoordinates { first, next: 0 };
            let (body, joint) = seeded_body(space, node, x, (parameters, has_parameters), &mut seeds);
            let (position, velocity) = body.coordinates();
            let mut outputs: Vec<Dual8> = [position, velocity, body.second()].concat();
            outputs.extend(body.arm);
            columns(node, &body, &joint, &mut outputs);
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

/// Number of the angles, displacements and Euler parameters of a joint, prescribed ones included.
fn joint_width(node: &Node3) -> usize {
    if node.joint == Joint3::Spherical { 4 } else { node.slots.len() }
}

/// The variables on which the body of a node depends, in the order in which [`seeded_body`] seeds them.
fn inputs_of(node: &Node3, has_parameters: bool) -> Vec<BodyInput> {
    let mut inputs = Vec::new();
    let mut add_body = |c: &[usize; 7]| {
        (0..3).for_each(|order| inputs.extend(c.iter().map(|&i| BodyInput::Coordinate(order, i))));
    };
    add_body(&node.parent);
    if node.joint == Joint3::Pin {
        add_body(&node.coordinates);
    }
    for order in 0..3 {
        inputs.extend((0..joint_width(node)).map(|i| match node.slots.get(i) {
            Some(Slot::Prescribed(coordinate)) => BodyInput::Coordinate(order, *coordinate),
            Some(Slot::Free(at)) => BodyInput::Joint(order, *at),
            None => BodyInput::Joint(order, node.first + i),
        }));
    }
    if has_parameters {
        inputs.extend((0..14).map(BodyInput::Parameter));
    }
    inputs
}

/// The body of a node and the coordinates of its joint, with `seeds` in the variables on which they depend.
fn seeded_body(
    space: &Space,
    node: &Node3,
    x: &SpacePoint<'_>,
    (parameters, has_parameters): (&[f64], bool),
    seeds: &mut SeededCoordinates,
) -> (PlacedBody<Dual8>, [Dual8; 4]) {
    let State { q, v, a, .. } = x.state;
    let of = |coordinates: &[usize; 7]| [q, v, a].map(|x| of_body(x, coordinates));
    let parent = placed_body(of(&node.parent).map(|x| seeds.all(&x)));
    let own = match node.joint {
        Joint3::Pin => placed_body(of(&node.coordinates).map(|x| seeds.all(&x))),
        _ => PlacedBody::zero(),
    };
    let joint: [[f64; 4]; 3] = [0, 1, 2].map(|order| space.of_joint(node, x.joints[order], [q, v, a][order]));
    let mut joint = joint.map(|x| x.map(Dual8::constant));
    for joint in &mut joint {
        joint[..joint_width(node)].iter_mut().for_each(|x| *x = seeds.seed(x.re));
    }
    let p: Vec<Dual8> = match has_parameters {
        true => parameters.iter().map(|&p| seeds.seed(p)).collect(),
        false => parameters.iter().map(|&p| Dual8::constant(p)).collect(),
    };
    let mut body = place_joint(node, &markers(&p), &parent, &own, &joint[0], &joint[1]);
    accelerate_joint(node, &mut body, &parent, &own, (&joint[0], &joint[2]));
    (body, joint[0])
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
            let mut twist = virtual_twist(node, body, psi, twists);
            self.add_joint_motion(node, body, (q, psi), &mut twist);
            if let Some(gaps) = gaps {
                add_openings(node, body, gaps, &mut twist);
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

    /// Adds the motion of a body relative to its parent for the virtual displacements `psi` of the joint coordinates q.
    fn add_joint_motion(
        &self,
        node: &Node3,
        body: &PlacedBody<f64>,
        (q, psi): (&[f64], &[f64]),
        twist: &mut Twist<f64>,
    ) {
        if node.joint == Joint3::Spherical {
            let own = self.of_joint(node, psi, &[]);
            let spin = angular_velocity(&self.of_joint(node, q, &[]), &own);
            spin.iter().zip(&body.columns).for_each(|(rate, column)| add_scaled(twist, *rate, column));
        }
        for (slot, column) in node.slots.iter().zip(&body.columns) {
            if let Slot::Free(at) = *slot {
                add_scaled(twist, psi[at], column);
            }
        }
    }

    /// Moves the derivatives `bodies` to the joint coordinates (`by_q`) and their velocities (`by_v`), and those of the power of the
    /// virtual displacements `psi` as well.
    pub fn transpose(
        &self,
        x: &SpacePoint<'_>,
        jacobians: &[NodeJacobian],
        psi: &VirtualDisplacements<'_>,
        bodies: &mut BodyAdjoint,
        [by_q, by_v]: [&mut [f64]; 2],
        add: &mut impl FnMut(usize, usize, f64),
    ) {
        let mut adjoint = Vec::new();
        for (k, (node, jacobian)) in self.nodes.iter().zip(jacobians).enumerate().rev() {
            if node.rotates() {
                transpose_rows(node, (&x.placed[k], &x.own[k]), psi, bodies);
            }
            if let Joint3::Free { turns, .. } = node.joint {
                if turns {
                    self.transpose_turn(node, psi.joints, halves(&x.wrenches[k])[0], &x.placed[k].e, bodies);
                }
                for (at, i) in node.free_coordinates() {
                    (by_q[at], by_v[at]) = (std::mem::take(&mut bodies.q[i]), std::mem::take(&mut bodies.v[i]));
                    bodies.a[i] = 0.0;
                }
                continue;
            }
            self.output_adjoint(k, x, psi, bodies, &mut adjoint);
            take_own(node, bodies, [&mut *by_q, &mut *by_v]);
            debug_assert!(jacobian.outputs <= adjoint.len() && jacobian.outputs >= FIXED);
            for (input, values) in jacobian.inputs.iter().zip(jacobian.values.chunks_exact(jacobian.outputs)) {
                let derivative = values.iter().zip(&adjoint).map(|(a, b)| a * b).sum::<f64>();
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
        }
        // ψᵀ e (e·ë + ė·ė), where the second factor is zero.
        let [q, v, a] = x.joints;
        for &first in &self.quaternions {
            let along: f64 = (first..first + 4).map(|k| psi.joints[k] * q[k]).sum();
            for k in first..first + 4 {
                by_q[k] += along * a[k];
                by_v[k] += 2.0 * along * v[k];
            }
        }
    }

    /// Writes the derivatives with respect to the outputs of the [`NodeJacobian`] of node `k` to `out`; those of the power with respect to the
    /// position of the parent are subtracted from `bodies`.
    fn output_adjoint(
        &self,
        k: usize,
        x: &SpacePoint<'_>,
        psi: &VirtualDisplacements<'_>,
        bodies: &mut BodyAdjoint,
        out: &mut Vec<f64>,
    ) {
        let (node, wrench) = (&self.nodes[k], &x.wrenches[k]);
        let [_, force] = halves(wrench);
        out.clear();
        for all in [&bodies.q, &bodies.v, &bodies.a] {
            let is_own = |slot: usize| slot < node.own_coordinates();
            out.extend(node.coordinates.iter().enumerate().map(|(slot, &i)| if is_own(slot) { all[i] } else { 0.0 }));
        }
        out.extend([0.0; 3]);
        let parent_spin = match node.parent_node {
            Some(parent) => virtual_spin(&x.placed[parent], &self.nodes[parent], psi.bodies),
            None => [0.0; 3],
        };
        let by_lever = cross(force, parent_spin);
        for i in 0..3 {
            if node.joint == Joint3::Pin {
                out[21 + i] += by_lever[i];
            } else {
                out[i] += by_lever[i];
                bodies.q[node.parent[i]] -= by_lever[i];
            }
        }
        let weights = |factor: f64| wrench.map(|w| factor * w);
        if node.joint == Joint3::Spherical {
            (0..4).for_each(|i| out.extend(weights(psi.joints[node.first + i])));
        }
        for (slot, source) in node.slots.iter().enumerate() {
            let factor = match *source {
                Slot::Free(at) => psi.joints[at],
                Slot::Prescribed(_) => {
                    let own = node.attached.iter().find(|attached| attached.slot == slot);
                    own.map_or(0.0, |attached| -psi.gaps[attached.multiplier])
                }
            };
            out.extend(weights(factor));
        }
        let reactions = (0..node.rows.len()).map(|k| psi.gaps[node.first_multiplier + k]);
        reactions.for_each(|gap| out.extend(weights(gap)));
    }

    /// Adds the derivatives with respect to the component of ë along e of free bodies, from those with respect to all
    /// coordinates. [`Space::collect`] does not include them.
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
            let mut own: Vec<(usize, usize)> = match node.joint {
                Joint3::Spherical => (0..4).map(|k| (k, node.first + k)).collect(),
                _ => Vec::new(),
            };
            for (slot, source) in node.slots.iter().enumerate() {
                let Slot::Free(at) = *source else { continue };
                match node.attached.iter().find(|attached| attached.slot == slot) {
                    Some(attached) => {
                        add(at, StartVariable::Position(attached.coordinate), [1.0, 0.0]);
                        add(at, StartVariable::Velocity(attached.coordinate), [0.0, 1.0]);
                    }
                    None => own.push((slot, at)),
                }
            }
            if !own.is_empty() {
                self.differentiate_joint(node, state, (element, parameters(element)), &own, &mut add);
            }
        }
    }

    /// Calls `add` with the derivatives of the joint coordinates `own` of a node and of their velocities; `own` has their numbers in the joint and
    /// among all joint coordinates.
    fn differentiate_joint(
        &self,
        node: &Node3,
        state: &State<f64>,
        (element, parameters): (usize, &[f64]),
        own: &[(usize, usize)],
        add: &mut impl FnMut(usize, StartVariable, [f64; 2]),
    ) {
        let mut variables = Vec::new();
        let mut values = Vec::new();
        for body in [&node.parent, &node.coordinates] {
            variables.extend(body.iter().map(|&i| StartVariable::Position(i)));
            variables.extend(body.iter().map(|&i| StartVariable::Velocity(i)));
            values.extend(of_body(&state.q, body).into_iter().chain(of_body(&state.v, body)));
        }
        variables.extend((0..14).map(|i| StartVariable::Parameter(element, i)));
        values.extend_from_slice(&parameters[..14]);
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
                for &(slot, at) in own {
                    add(at, variables[first + k], [q[slot].eps[k], v[slot].eps[k]]);
                }
            }
        }
    }
}

/// x += factor · y.
fn add_scaled(x: &mut Twist<f64>, factor: f64, y: &Twist<f64>) {
    x.iter_mut().zip(y).for_each(|(to, from)| *to += factor * from);
}

/// Virtual displacement of a free body, or of a body that does not move relative to its parent, from those of the bodies before it.
fn virtual_twist(node: &Node3, body: &PlacedBody<f64>, psi: &[f64], twists: &[Twist<f64>]) -> Twist<f64> {
    if let Joint3::Free { .. } = node.joint {
        let mut own = [0.0; 7];
        for (at, i) in node.free_coordinates() {
            let slot = node.coordinates.iter().position(|c| *c == i).unwrap_or(0);
            own[slot] = psi[at];
        }
        let spin = angular_velocity(&body.e, &[own[3], own[4], own[5], own[6]]);
        return joined([spin, [own[0], own[1], own[2]]]);
    }
    let Some(parent) = node.parent_node else { return [0.0; 6] };
    let [spin, shift] = halves(&twists[parent]);
    let (lever, spin_of_body) = match node.joint {
        Joint3::Pin => (body.arm, [0.0; 3]),
        _ => (body.lever, spin),
    };
    let swing = cross(spin, lever);
    joined([spin_of_body, [0, 1, 2].map(|i| shift[i] + swing[i])])
}

/// Adds the motion of a body that opens the constraints of its joint by the negative `gaps`.
fn add_openings(node: &Node3, body: &PlacedBody<f64>, gaps: &[f64], twist: &mut Twist<f64>) {
    for (k, row) in node.rows.iter().enumerate() {
        add_scaled(twist, gaps[node.first_multiplier + k], &reaction_column(node, body, *row));
    }
    for attached in &node.attached {
        if let Slot::Prescribed(_) = node.slots[attached.slot] {
            add_scaled(twist, -gaps[attached.multiplier], &body.columns[attached.slot]);
        }
    }
}

/// Subtracts the derivatives of the power of the rows of Euler parameters: their weights are ½ Eᵀ ψ. `own` is the wrench on the body alone.
fn transpose_rows(
    node: &Node3,
    (body, own): (&PlacedBody<f64>, &Twist<f64>),
    psi: &VirtualDisplacements<'_>,
    bodies: &mut BodyAdjoint,
) {
    let spin = virtual_spin(body, node, psi.bodies);
    let rows = rows_of_moment(&body.e, halves(own)[0]);
    let by_e = e_transposed_times(&rows, spin);
    (0..4).for_each(|i| bodies.q[node.coordinates[3 + i]] -= 0.5 * by_e[i]);
}

/// Moves the derivatives with respect to coordinates of the mechanism that are joint coordinates to these, and clears those of the body.
fn take_own(node: &Node3, bodies: &mut BodyAdjoint, [by_q, by_v]: [&mut [f64]; 2]) {
    for (order, all) in [&mut bodies.q, &mut bodies.v, &mut bodies.a].into_iter().enumerate() {
        node.coordinates.iter().take(node.own_coordinates()).for_each(|&i| all[i] = 0.0);
        for attached in &node.attached {
            if let Slot::Free(at) = node.slots[attached.slot] {
                let derivative = std::mem::take(&mut all[attached.coordinate]);
                match order {
                    0 => by_q[at] += derivative,
                    1 => by_v[at] += derivative,
                    _ => {}
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
