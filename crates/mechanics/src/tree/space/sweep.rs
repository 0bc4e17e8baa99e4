//! Sweeps over a tree in space: positions, velocities and accelerations from the ground to the tips, rows of the joints back.

use crate::elements::spatial::joints::rows::ConstraintRow;
use crate::mechanism::rotation::{conjugate, matrix, quaternion_product, square};
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::vector::{add, cross, product, scaled, subtract};
use crate::system::state::State;
use crate::tree::space::joint::{
    BodyMotion, Joint3, JointAxis, JointMarkers, RelativeMotion, angular_velocity, joint_coordinates,
};
use crate::tree::space::placed::{PlacedBody, Twist, halves, joined, moment_of_rows, of_body, power, rows_of_moment};
use crate::tree::space::topology::{Node3, Slot, Space};

/// Places a body on its parent: everything but accelerations. `own` has the Euler parameters and angular velocity of a body whose
/// rotation is prescribed.
#[inline(always)]
pub(crate) fn place_joint<T: StateScalar>(
    node: &Node3,
    markers: &JointMarkers<T>,
    parent: &PlacedBody<T>,
    own: &PlacedBody<T>,
    q: &[T; 4],
    v: &[T; 4],
) -> PlacedBody<T> {
    let motion = RelativeMotion::new(node.joint, q, v);
    let mut placed = PlacedBody::zero();
    place_points(node, markers, parent, own, &motion, &mut placed);
    set_velocities(node, parent, own, &motion, &mut placed);
    set_columns(node, &motion, &mut placed);
    placed
}

/// `x`, or −`x` for a joint whose first marker is on the body.
#[inline(always)]
fn signed<T: StateScalar>(node: &Node3, x: [T; 3]) -> [T; 3] {
    let sign = node.sign();
    x.map(|x| x * sign)
}

/// Sets the rotation of a body, the axes of its joint, and the vectors from both bodies to the joint.
#[inline(always)]
fn place_points<T: StateScalar>(
    node: &Node3,
    [a, b]: &JointMarkers<T>,
    parent: &PlacedBody<T>,
    own: &PlacedBody<T>,
    motion: &RelativeMotion<T>,
    placed: &mut PlacedBody<T>,
) {
    let is_pin = node.joint == Joint3::Pin;
    if is_pin {
        (placed.e, placed.rotation) = (own.e, own.rotation);
    }
    if node.is_reversed {
        let marker_b = quaternion_product(&parent.e, &b.e);
        let marker_a = quaternion_product(&marker_b, &conjugate(&motion.e));
        placed.axes = matrix(&marker_a);
        placed.arm = product(&parent.rotation, b.point);
        if is_pin {
            placed.tip = product(&placed.rotation, a.point);
        } else {
            placed.e = quaternion_product(&marker_a, &conjugate(&a.e)).map(|x| x * node.e_sign);
            placed.rotation = matrix(&placed.e);
            let slide = product(&placed.axes, motion.displacement);
            placed.tip = add(slide, product(&placed.rotation, a.point));
        }
    } else {
        let marker_a = quaternion_product(&parent.e, &a.e);
        placed.axes = matrix(&marker_a);
        let slide = product(&placed.axes, motion.displacement);
        placed.arm = add(slide, product(&parent.rotation, a.point));
        if !is_pin {
            let marker_b = quaternion_product(&marker_a, &motion.e);
            placed.e = quaternion_product(&marker_b, &conjugate(&b.e)).map(|x| x * node.e_sign);
            placed.rotation = matrix(&placed.e);
        }
        placed.tip = product(&placed.rotation, b.point);
    }
}

/// Sets position and velocity of a body whose points are placed, and its acceleration at zero accelerations of the parent and of the joint
/// coordinates.
#[inline(always)]
fn set_velocities<T: StateScalar>(
    node: &Node3,
    parent: &PlacedBody<T>,
    own: &PlacedBody<T>,
    motion: &RelativeMotion<T>,
    placed: &mut PlacedBody<T>,
) {
    let is_pin = node.joint == Joint3::Pin;
    let change = signed(node, product(&placed.axes, motion.spin));
    placed.spin = if is_pin { own.spin } else { add(parent.spin, change) };
    let slide_rate = signed(node, product(&placed.axes, motion.rate));
    placed.lever = subtract(placed.arm, placed.tip);
    placed.origin = add(parent.origin, placed.lever);
    let turning = subtract(cross(parent.spin, placed.arm), cross(placed.spin, placed.tip));
    placed.velocity = add(parent.velocity, add(turning, slide_rate));
    let carrier = if node.is_reversed { placed.spin } else { parent.spin };
    let centripetal = |spin, r| cross(spin, cross(spin, r));
    let mut bias = subtract(centripetal(parent.spin, placed.arm), centripetal(placed.spin, placed.tip));
    bias = add(bias, scaled(cross(carrier, slide_rate), T::from(2.0)));
    let mut turn = [T::from(0.0); 3];
    if !is_pin {
        turn = add(signed(node, product(&placed.axes, motion.bias)), cross(parent.spin, change));
        bias = subtract(bias, cross(turn, placed.tip));
    }
    placed.bias = joined([turn, bias]);
}

/// Sets the motions of a body, whose points are placed, at the rate one of each joint coordinate.
#[inline(always)]
fn set_columns<T: StateScalar>(node: &Node3, motion: &RelativeMotion<T>, placed: &mut PlacedBody<T>) {
    let PlacedBody { axes, tip, columns, .. } = placed;
    let column = |k: usize| signed(node, [0, 1, 2].map(|i| axes[i][k]));
    let turned = |axis: [T; 3]| joined([axis, cross(*tip, axis)]);
    if node.joint == Joint3::Spherical {
        *columns = [0, 1, 2].map(|k| turned(column(k)));
    }
    for (to, axis) in columns.iter_mut().zip(node.joint.axes()) {
        *to = match *axis {
            JointAxis::Turn => turned(column(2)),
            JointAxis::Cross => turned(signed(node, product(axes, motion.cross))),
            JointAxis::Slide(k) => joined([[T::from(0.0); 3], column(k)]),
        };
    }
}

/// Accelerates a body on its parent, for the accelerations `a` of the joint coordinates. `own` has those of a body whose rotation is
/// prescribed.
#[inline(always)]
pub(crate) fn accelerate_joint<T: StateScalar>(
    node: &Node3,
    placed: &mut PlacedBody<T>,
    parent: &PlacedBody<T>,
    own: &PlacedBody<T>,
    (q, a): (&[T; 4], &[T; 4]),
) {
    let [turn, shift] = halves(&placed.bias);
    if node.joint == Joint3::Pin {
        placed.turn = own.turn;
        let swing = subtract(cross(parent.turn, placed.arm), cross(own.turn, placed.tip));
        placed.acceleration = add(parent.acceleration, add(swing, shift));
        return;
    }
    let (mut all, mut along) = (turn, shift);
    let own_turn;
    let rates: &[T] = if node.joint == Joint3::Spherical {
        own_turn = angular_velocity(q, a);
        &own_turn
    } else {
        &a[..node.slots.len()]
    };
    for (column, rate) in placed.columns.iter().zip(rates) {
        let [w, v] = halves(column);
        all = add(all, scaled(w, *rate));
        along = add(along, scaled(v, *rate));
    }
    placed.turn = add(parent.turn, all);
    placed.acceleration = add(parent.acceleration, add(cross(parent.turn, placed.lever), along));
}

impl Space {
    /// Positions, velocities and accelerations of the coordinates of a joint, those of prescribed ones from the `state`.
    #[inline(always)]
    pub fn of_joint<T: StateScalar>(&self, node: &Node3, joints: &[T], state: &[T]) -> [T; 4] {
        let mut values = [T::from(0.0); 4];
        if node.joint == Joint3::Spherical {
            values.copy_from_slice(&joints[node.first..node.first + 4]);
        } else {
            for (value, slot) in values.iter_mut().zip(&node.slots) {
                *value = match *slot {
                    Slot::Free(k) => joints[k],
                    Slot::Prescribed(i) => state[i],
                };
            }
        }
        values
    }

    /// The placed parent of a node: a body of the tree, or one whose motion is prescribed.
    #[inline(always)]
    fn parent<T: StateScalar>(&self, node: &Node3, state: &State<T>, placed: &[PlacedBody<T>]) -> PlacedBody<T> {
        match node.parent_node {
            Some(parent) => placed[parent],
            None => PlacedBody::of(&of_body(&state.q, &node.parent), &of_body(&state.v, &node.parent)),
        }
    }

    /// Writes positions and velocities of all bodies to `state`, in which prescribed coordinates have theirs; `y` are all joint
    /// coordinates, followed by their velocities.
    #[inline(always)]
    pub fn place<T: StateScalar>(
        &self,
        markers: &[JointMarkers<T>],
        (q, v): (&[T], &[T]),
        state: &mut State<T>,
        placed: &mut [PlacedBody<T>],
    ) {
        for (k, node) in self.nodes.iter().enumerate() {
            if let Joint3::Free { .. } = node.joint {
                for (at, i) in node.free_coordinates() {
                    (state.q[i], state.v[i]) = (q[at], v[at]);
                }
                placed[k] =
                    PlacedBody::of(&of_body(&state.q, &node.coordinates), &of_body(&state.v, &node.coordinates));
                continue;
            }
            let parent = self.parent(node, state, placed);
            let own = match node.joint {
                Joint3::Pin => {
                    PlacedBody::of(&of_body(&state.q, &node.coordinates), &of_body(&state.v, &node.coordinates))
                }
                _ => PlacedBody::zero(),
            };
            let own_q = self.of_joint(node, q, &state.q);
            let own_v = self.of_joint(node, v, &state.v);
            placed[k] = place_joint(node, &markers[k], &parent, &own, &own_q, &own_v);
            let (position, velocity) = placed[k].coordinates();
            for (slot, &i) in node.coordinates.iter().enumerate().take(node.own_coordinates()) {
                (state.q[i], state.v[i]) = (position[slot], velocity[slot]);
            }
            for attached in &node.attached {
                if let Slot::Free(_) = node.slots[attached.slot] {
                    let i = attached.coordinate;
                    (state.q[i], state.v[i]) = (own_q[attached.slot], own_v[attached.slot]);
                }
            }
        }
    }

    /// Writes accelerations of all bodies to `state`, for the accelerations `a` of all joint coordinates at the coordinates `q`.
    #[inline(always)]
    pub fn accelerate<T: StateScalar>(&self, (q, a): (&[T], &[T]), state: &mut State<T>, placed: &mut [PlacedBody<T>]) {
        for (k, node) in self.nodes.iter().enumerate() {
            let mut body = placed[k];
            if let Joint3::Free { .. } = node.joint {
                for (at, i) in node.free_coordinates() {
                    state.a[i] = a[at];
                }
                body.accelerate(&of_body(&state.v, &node.coordinates), &of_body(&state.a, &node.coordinates));
                placed[k] = body;
                continue;
            }
            let parent = match node.parent_node {
                Some(parent) => placed[parent],
                None => {
                    let v = of_body(&state.v, &node.parent);
                    let mut parent = PlacedBody::of(&of_body(&state.q, &node.parent), &v);
                    parent.accelerate(&v, &of_body(&state.a, &node.parent));
                    parent
                }
            };
            let mut own = body;
            if node.joint == Joint3::Pin {
                own.accelerate(&of_body(&state.v, &node.coordinates), &of_body(&state.a, &node.coordinates));
            }
            let own_a = self.of_joint(node, a, &state.a);
            let own_q = self.of_joint(node, q, &state.q);
            accelerate_joint(node, &mut body, &parent, &own, (&own_q, &own_a));
            placed[k] = body;
            let second = body.second();
            for (slot, &i) in node.coordinates.iter().enumerate().take(node.own_coordinates()) {
                state.a[i] = second[slot];
            }
            for attached in &node.attached {
                if let Slot::Free(_) = node.slots[attached.slot] {
                    state.a[attached.coordinate] = own_a[attached.slot];
                }
            }
        }
    }

    /// Adds the rows of the coordinates of the bodies to their wrenches.
    #[inline(always)]
    pub fn add_rows<T: StateScalar>(&self, placed: &[PlacedBody<T>], rows: &[T], wrenches: &mut [Twist<T>]) {
        for ((node, placed), wrench) in self.nodes.iter().zip(placed).zip(wrenches) {
            let [x, y, z, e0, e1, e2, e3] = of_body(rows, &node.coordinates);
            let moment = if node.rotates() { moment_of_rows(&placed.e, &[e0, e1, e2, e3]) } else { [T::from(0.0); 3] };
            for (to, from) in wrench.iter_mut().zip(joined([moment, [x, y, z]])) {
                *to += from;
            }
        }
    }

    /// Adds the wrench of every body to that of its parent, and writes the rows of the joint coordinates to `out`: the power of the
    /// wrenches, and the `rows` of joint coordinates on which elements act.
    #[inline(always)]
    pub fn collect<T: StateScalar>(
        &self,
        placed: &[PlacedBody<T>],
        q: &[T],
        rows: &[T],
        wrenches: &mut [Twist<T>],
        out: &mut [T],
    ) {
        for (k, node) in self.nodes.iter().enumerate().rev() {
            let (body, wrench) = (&placed[k], wrenches[k]);
            let [moment, force] = halves(&wrench);
            if let Joint3::Free { moves, turns } = node.joint {
                let mut at = node.first;
                for i in (0..3).filter(|&i| moves[i]) {
                    out[at] = force[i];
                    at += 1;
                }
                if turns {
                    out[at..at + 4].copy_from_slice(&rows_of_moment(&body.e, moment));
                }
                continue;
            }
            if node.joint == Joint3::Spherical {
                let own = self.of_joint(node, q, rows);
                let moment = [0, 1, 2].map(|k| power(&body.columns[k], &wrench));
                out[node.first..node.first + 4].copy_from_slice(&rows_of_moment(&own, moment));
            }
            for (column, slot) in body.columns.iter().zip(&node.slots) {
                if let Slot::Free(at) = *slot {
                    out[at] = power(column, &wrench);
                }
            }
            for attached in &node.attached {
                if let Slot::Free(at) = node.slots[attached.slot] {
                    out[at] += rows[attached.coordinate];
                }
            }
            if let Some(parent) = node.parent_node {
                let passed = match node.joint {
                    Joint3::Pin => cross(body.arm, force),
                    _ => add(moment, cross(body.lever, force)),
                };
                for (to, from) in wrenches[parent].iter_mut().zip(joined([passed, force])) {
                    *to += from;
                }
            }
        }
    }

    /// Adds the equations that keep the length of the Euler parameters among the joint coordinates: e (e·ë + ė·ė).
    #[inline(always)]
    pub fn add_lengths<T: StateScalar>(&self, (q, v): (&[T], &[T]), a: &[T], out: &mut [T]) {
        for &first in &self.quaternions {
            let of = |x: &[T]| [0, 1, 2, 3].map(|k| x[first + k]);
            let (e, rate, second) = (of(q), of(v), of(a));
            let bend = e[0] * second[0] + e[1] * second[1] + e[2] * second[2] + e[3] * second[3] + square(&rate);
            out[first..first + 4].iter_mut().zip(e).for_each(|(out, e)| *out += e * bend);
        }
    }

    /// Projects the Euler parameters among the joint coordinates `q`, and their rates `v`, onto |e| = 1.
    pub fn normalize<T: StateScalar>(&self, q: &mut [T], v: &mut [T]) {
        for &first in &self.quaternions {
            let of = |x: &[T]| [0, 1, 2, 3].map(|k| x[first + k]);
            let (e, rate) = normalized(of(q), of(v));
            q[first..first + 4].copy_from_slice(&e);
            v[first..first + 4].copy_from_slice(&rate);
        }
    }

    /// Writes the multipliers of the joints in equilibrium to `multipliers`, from the wrenches that [`Self::collect`] has left.
    pub fn reactions<T: StateScalar>(
        &self,
        placed: &[PlacedBody<T>],
        rows: &[T],
        wrenches: &[Twist<T>],
        multipliers: &mut [T],
    ) {
        for ((node, body), wrench) in self.nodes.iter().zip(placed).zip(wrenches) {
            for (k, row) in node.rows.iter().enumerate() {
                multipliers[node.first_multiplier + k] = power(&reaction_column(node, body, *row), wrench);
            }
            for attached in &node.attached {
                multipliers[attached.multiplier] = match node.slots[attached.slot] {
                    Slot::Free(_) => rows[attached.coordinate],
                    Slot::Prescribed(_) => -power(&body.columns[attached.slot], wrench),
                };
            }
        }
    }

    /// Joint coordinates and velocities of a node in the consistent `state`.
    pub fn joint_state<T: StateScalar>(
        &self,
        node: &Node3,
        markers: &JointMarkers<T>,
        [parent, body]: [&BodyMotion<T>; 2],
    ) -> ([T; 4], [T; 4]) {
        let pair = if node.is_reversed { [body, parent] } else { [parent, body] };
        joint_coordinates(node.joint, markers, pair)
    }
}

/// Euler parameters e/|e|, and their rates.
pub(crate) fn normalized<T: StateScalar>(e: [T; 4], rate: [T; 4]) -> ([T; 4], [T; 4]) {
    let inverse = square(&e).sqrt().recip();
    let (unit, scaled) = (e.map(|x| x * inverse), rate.map(|x| x * inverse));
    let along = unit[0] * scaled[0] + unit[1] * scaled[1] + unit[2] * scaled[2] + unit[3] * scaled[3];
    (unit, [0, 1, 2, 3].map(|k| scaled[k] - unit[k] * along))
}

/// The motion of a body relative to its parent on which the multiplier of a constraint equation of the joint acts, with its sign.
#[inline(always)]
pub(crate) fn reaction_column<T: StateScalar>(node: &Node3, body: &PlacedBody<T>, row: ConstraintRow) -> Twist<T> {
    let zero = T::from(0.0);
    let axis = |k: usize| [0, 1, 2].map(|i| body.axes[i][k]);
    let sign = node.sign();
    let column = match row {
        ConstraintRow::Coincident(k) => {
            let mut world = [zero; 3];
            world[k] = T::from(1.0);
            [[zero; 3], world]
        }
        ConstraintRow::InPlane(k) => [[zero; 3], axis(k)],
        ConstraintRow::Perpendicular(i, j) => {
            // In the position of the joint the axes of both markers are the same, but for the cross of a universal joint.
            let second = match node.joint {
                Joint3::Universal => halves(&body.columns[1])[0].map(|x| x * sign),
                _ => axis(j),
            };
            let about = cross(axis(i), second);
            [about, cross(body.tip, about)]
        }
        // No joint of a tree has this row; at equal axes it is a torque about z.
        ConstraintRow::Untwisted => {
            let about = axis(2).map(|x| x * 2.0);
            [about, cross(body.tip, about)]
        }
    };
    joined(column).map(|x| x * sign)
}
