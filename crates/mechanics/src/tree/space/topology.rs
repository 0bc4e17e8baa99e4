//! The trees of bodies in space of a mechanism, in the order from the ground to the tips.

use crate::Result;
use crate::elements::spatial::bodies::normalization::normalized_frame;
use crate::elements::spatial::bodies::rigid_body3;
use crate::elements::spatial::drives::joint_coordinate;
use crate::elements::spatial::joints::rows::ConstraintRow;
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::State;
use crate::tree::space::joint::{BodyMotion, Joint3, JointAxis, JointMarkers, joint_of, markers};
use crate::tree::space::placed::of_body;
use crate::tree::space::rigid::is_body;
use crate::tree::topology::BodyNumbers;
use crate::tree::unsupported;
use std::collections::{BTreeMap, VecDeque};

/// Source of a joint coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    /// The joint coordinate with this number.
    Free(usize),
    /// The prescribed coordinate with this number.
    Prescribed(usize),
}

/// A coordinate of the mechanism that is a joint coordinate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointCoordinateSource {
    /// The coordinate.
    pub coordinate: usize,
    /// Number of the joint coordinate in the joint.
    pub slot: usize,
    /// Multiplier of the element that defines the coordinate.
    pub multiplier: usize,
}

/// A body of a tree in space, and the joint that connects it to its parent.
#[derive(Clone, Debug)]
pub(crate) struct Node3 {
    /// Coordinates x, y, z and Euler parameters of the body.
    pub coordinates: [usize; 7],
    /// Coordinates of the parent: a body of the tree or one whose motion is prescribed. Those of the body itself if it is free.
    pub parent: [usize; 7],
    /// Number of the parent in the tree, unless its motion is prescribed.
    pub parent_node: Option<usize>,
    /// Kind of the joint.
    pub joint: Joint3,
    /// Number of the joint's element.
    pub element: Option<usize>,
    /// True if the body is that of the first marker of the element, and the parent that of the second.
    pub is_reversed: bool,
    /// First joint coordinate.
    pub first: usize,
    /// Angles and displacements, in the order of [`Joint3::axes`].
    pub slots: Vec<Slot>,
    /// Coordinates of the mechanism that are those of the joint.
    pub attached: Vec<JointCoordinateSource>,
    /// Constraint equations of the element.
    pub rows: &'static [ConstraintRow],
    /// First multiplier of the element.
    pub first_multiplier: usize,
    /// Sign of the Euler parameters of the body, as e and −e are the same rotation.
    pub e_sign: f64,
}

impl Node3 {
    /// −1 if the body is that of the first marker of the joint's element, otherwise 1.
    pub fn sign(&self) -> f64 {
        if self.is_reversed { -1.0 } else { 1.0 }
    }

    /// Returns whether the tree determines the rotation of the body.
    pub fn rotates(&self) -> bool {
        !matches!(self.joint, Joint3::Pin | Joint3::Free { turns: false, .. })
    }

    /// Number of coordinates of the body that the tree determines: Euler parameters may be prescribed.
    pub fn own_coordinates(&self) -> usize {
        if self.rotates() { 7 } else { 3 }
    }

    /// Number of joint coordinates.
    pub fn count(&self) -> usize {
        match self.joint {
            Joint3::Spherical => 4,
            Joint3::Free { .. } => self.free_coordinates().count(),
            _ => self.slots.iter().filter(|slot| matches!(slot, Slot::Free(_))).count(),
        }
    }

    /// Joint coordinates of a free body, with the coordinates that they are.
    pub fn free_coordinates(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (moves, turns) = match self.joint {
            Joint3::Free { moves, turns } => (moves, turns),
            _ => ([false; 3], false),
        };
        let is_free = [moves[0], moves[1], moves[2], turns, turns, turns, turns];
        let first = self.first;
        let free = self.coordinates.into_iter().zip(is_free).filter(|(_, free)| *free);
        free.enumerate().map(move |(k, (i, _))| (first + k, i))
    }

    /// First of the Euler parameters among the joint coordinates.
    fn quaternion(&self) -> Option<usize> {
        match self.joint {
            Joint3::Spherical => Some(self.first),
            Joint3::Free { moves, turns: true } => Some(self.first + moves.iter().filter(|x| **x).count()),
            _ => None,
        }
    }
}

/// The trees in space of a mechanism.
#[derive(Clone, Debug, Default)]
pub(crate) struct Space {
    /// Bodies, each after its parent.
    pub nodes: Vec<Node3>,
    /// Elements that are bodies, with the numbers of their nodes.
    pub bodies: Vec<(usize, usize)>,
    /// First of the four Euler parameters of each spherical joint and free body.
    pub quaternions: Vec<usize>,
    /// Number of joint coordinates.
    pub count: usize,
    /// Elements with constraints that the trees do not contain.
    pub cuts: Vec<usize>,
}

impl Space {
    /// The trees of `mechanism`, with joint coordinates from number `first` on.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`](crate::Error::Unsupported) naming the part that relative coordinates do not support.
    pub fn new(mechanism: &Mechanism<f64>, first: usize) -> Result<Self> {
        let mut builder = TreeBuilder3::new(mechanism, first)?;
        builder.attach_all()?;
        let TreeBuilder3 { nodes, numbers, reached, cuts, .. } = builder;
        let quaternions = nodes.iter().filter_map(Node3::quaternion).collect();
        let count = nodes.iter().map(Node3::count).sum();
        let by_translations: BTreeMap<[usize; 3], usize> =
            numbers.iter().map(|(c, &body)| ([c[0], c[1], c[2]], body)).collect();
        let node_of = |(k, instance): (usize, &ElementInstance<f64>)| {
            let body = is_body(instance).then(|| by_translations.get(&instance.coordinates[..3])).flatten()?;
            Some((k, reached[*body].flatten()?))
        };
        let bodies = mechanism.elements.iter().enumerate().filter_map(node_of).collect();
        Ok(Self { nodes, bodies, quaternions, count, cuts })
    }

    /// The markers of all joints.
    pub fn markers<T: StateScalar>(&self, mechanism: &Mechanism<T>) -> Vec<JointMarkers<T>> {
        let of = |node: &Node3| markers(node.element.map_or(&[], |k| &mechanism.elements[k].parameters));
        self.nodes.iter().map(of).collect()
    }

    /// Writes the joint coordinates `q` and their velocities `v` of the consistent `state`.
    pub fn write_joint_state<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        (q, v): (&mut [T], &mut [T]),
    ) {
        let body = |c: &[usize; 7]| BodyMotion::of(&of_body(&state.q, c), &of_body(&state.v, c));
        for (node, markers) in self.nodes.iter().zip(self.markers(mechanism)) {
            for (at, i) in node.free_coordinates() {
                (q[at], v[at]) = (state.q[i], state.v[i]);
            }
            if node.count() == 0 || matches!(node.joint, Joint3::Free { .. }) {
                continue;
            }
            let (own_q, own_v) = self.joint_state(node, &markers, [&body(&node.parent), &body(&node.coordinates)]);
            if node.joint == Joint3::Spherical {
                q[node.first..node.first + 4].copy_from_slice(&own_q);
                v[node.first..node.first + 4].copy_from_slice(&own_v);
            }
            for (k, slot) in node.slots.iter().enumerate() {
                if let Slot::Free(at) = *slot {
                    (q[at], v[at]) = (own_q[k], own_v[k]);
                }
            }
            // The coordinates of the mechanism count turns.
            for attached in &node.attached {
                if let Slot::Free(at) = node.slots[attached.slot] {
                    (q[at], v[at]) = (state.q[attached.coordinate], state.v[attached.coordinate]);
                }
            }
        }
    }

    /// Returns whether the element belongs to the trees: their joints, coordinates of joints and lengths of Euler parameters.
    pub fn has_constraint(instance: &ElementInstance<f64>) -> bool {
        joint_of(instance).is_some() || normalized_frame(instance).is_some() || coordinate_axis(instance).is_some()
    }

    /// Names of the joint coordinates.
    pub fn names(&self, mechanism: &Mechanism<f64>, names: &mut Vec<String>) {
        for node in &self.nodes {
            names.extend(node.free_coordinates().map(|(_, i)| mechanism.coordinates[i].name.clone()));
            let Some(element) = node.element else { continue };
            let name = &mechanism.elements[element].name;
            if node.joint == Joint3::Spherical {
                names.extend((0..4).map(|k| format!("e{k} of {name}")));
            }
            for (axis, slot) in node.joint.axes().iter().zip(&node.slots) {
                let what = match axis {
                    JointAxis::Turn => "angle",
                    JointAxis::Cross => "second angle",
                    JointAxis::Slide(k) if node.joint == Joint3::Planar => ["displacement x", "displacement y", ""][*k],
                    JointAxis::Slide(_) => "displacement",
                };
                if let Slot::Free(_) = slot {
                    names.push(format!("{what} of {name}"));
                }
            }
        }
    }
}

/// The direction of the coordinate that an element defines: an angle or a displacement of a joint.
fn coordinate_axis(instance: &ElementInstance<f64>) -> Option<JointAxis> {
    let own = instance.element.descriptor()?;
    match () {
        () if std::ptr::eq(own, &joint_coordinate::ANGLE) => Some(JointAxis::Turn),
        () if std::ptr::eq(own, &joint_coordinate::DISPLACEMENT) => Some(JointAxis::Slide(2)),
        () => None,
    }
}

/// A joint between two bodies.
struct JointEdge {
    element: usize,
    joint: Joint3,
    rows: &'static [ConstraintRow],
    bodies: [usize; 2],
    /// Elements that define coordinates of the joint, with the numbers of these in the joint.
    coordinates: Vec<(usize, usize)>,
}

/// Joints in space of a mechanism, and the bodies that they connect.
fn joint_edges(mechanism: &Mechanism<f64>, numbers: &mut BodyNumbers<7>) -> Vec<JointEdge> {
    let mut edges = Vec::new();
    for (element, instance) in mechanism.elements.iter().enumerate() {
        let is_rigid = instance.element.descriptor().is_some_and(|own| std::ptr::eq(own, &rigid_body3::DESCRIPTOR));
        if is_rigid || normalized_frame(instance).is_some() {
            numbers.number(&instance.coordinates);
        }
        if let Some((joint, rows)) = joint_of(instance) {
            let pair = [&instance.coordinates[..7], &instance.coordinates[7..14]];
            let bodies = pair.map(|coordinates| numbers.number(coordinates));
            edges.push(JointEdge { element, joint, rows, bodies, coordinates: Vec::new() });
        }
    }
    edges
}

/// Adds the elements that define coordinates of joints to the `edges` of these joints. Returns those that define other coordinates, which are
/// prescribed.
///
/// # Errors
///
/// [`Error::Unsupported`](crate::Error::Unsupported) naming an element that defines another coordinate, which is not prescribed.
fn add_joint_coordinates(mechanism: &Mechanism<f64>, edges: &mut [JointEdge]) -> Result<Vec<usize>> {
    let mut others = Vec::new();
    for (element, instance) in mechanism.elements.iter().enumerate() {
        let Some(axis) = coordinate_axis(instance) else { continue };
        let fits = |edge: &&mut JointEdge| {
            let on = &mechanism.elements[edge.element];
            // The angle between the markers of a universal joint is not one of its coordinates.
            edge.joint != Joint3::Universal
                && on.coordinates[..] == instance.coordinates[..14]
                && on.parameters == instance.parameters
        };
        let slot = |edge: &JointEdge| edge.joint.axes().iter().position(|own| *own == axis);
        let found = edges.iter_mut().filter(fits).find_map(|edge| slot(edge).map(|slot| (edge, slot)));
        match found {
            Some((edge, slot)) => edge.coordinates.push((element, slot)),
            None if mechanism.coordinates[instance.coordinates[14]].motion.is_some() => others.push(element),
            None => {
                let why =
                    "it is no coordinate of a joint of the tree: no joint has its two markers and such a coordinate";
                return Err(unsupported(&instance.name, why));
            }
        }
    }
    Ok(others)
}

/// Trees in space under construction, from the ground outwards.
struct TreeBuilder3<'m> {
    mechanism: &'m Mechanism<f64>,
    bodies: Vec<[usize; 7]>,
    numbers: BTreeMap<[usize; 7], usize>,
    edges: Vec<JointEdge>,
    edges_of: Vec<Vec<usize>>,
    nodes: Vec<Node3>,
    /// Node of each body that is reached; `None` inside for a body whose motion is prescribed.
    reached: Vec<Option<Option<usize>>>,
    /// Joint coordinates of planar bodies.
    first: usize,
    /// Elements with constraints that the trees do not contain.
    cuts: Vec<usize>,
}

impl<'m> TreeBuilder3<'m> {
    fn new(mechanism: &'m Mechanism<f64>, first: usize) -> Result<Self> {
        let mut numbers = BodyNumbers::new();
        let mut edges = joint_edges(mechanism, &mut numbers);
        let cuts = add_joint_coordinates(mechanism, &mut edges)?;
        let BodyNumbers { bodies, numbers } = numbers;
        let mut edges_of = vec![Vec::new(); bodies.len()];
        for (k, edge) in edges.iter().enumerate() {
            edge.bodies.iter().for_each(|&body| edges_of[body].push(k));
        }
        let reached = vec![None; bodies.len()];
        let mut builder = Self { mechanism, bodies, numbers, edges, edges_of, nodes: Vec::new(), reached, first, cuts };
        builder.add_points();
        builder.check_rotations()?;
        Ok(builder)
    }

    /// Adds point masses that no joint holds, which have the Euler parameters of the ground.
    fn add_points(&mut self) {
        let Some(ground) = self.mechanism.ground3_coordinates() else { return };
        for instance in self.mechanism.elements.iter().filter(|instance| is_body(instance)) {
            let [x, y, z] = [0, 1, 2].map(|k| instance.coordinates[k]);
            if self.bodies.iter().any(|body| body[..3] == [x, y, z]) {
                continue;
            }
            let body = [x, y, z, ground[3], ground[4], ground[5], ground[6]];
            self.numbers.insert(body, self.bodies.len());
            self.bodies.push(body);
            self.edges_of.push(Vec::new());
            self.reached.push(None);
        }
    }

    /// Checks that the rotation of each body is prescribed as a whole or not at all, and that each unknown belongs to one body.
    fn check_rotations(&self) -> Result<()> {
        let mut owner = BTreeMap::new();
        for body in &self.bodies {
            let free = body[3..].iter().filter(|&&i| self.is_unknown(i)).count();
            if free % 4 != 0 {
                let why = "some Euler parameters of a body are prescribed and others are not";
                return Err(unsupported(&self.mechanism.coordinates[body[3]].name, why));
            }
            for &i in body.iter().filter(|&&i| self.is_unknown(i)) {
                if owner.insert(i, body).is_some() {
                    return Err(unsupported(&self.mechanism.coordinates[i].name, "two bodies share this coordinate"));
                }
            }
        }
        Ok(())
    }

    fn is_unknown(&self, coordinate: usize) -> bool {
        self.mechanism.coordinates[coordinate].motion.is_none()
    }

    fn moves(&self, body: usize) -> [bool; 3] {
        [0, 1, 2].map(|k| self.is_unknown(self.bodies[body][k]))
    }

    fn turns(&self, body: usize) -> bool {
        self.is_unknown(self.bodies[body][3])
    }

    /// Attaches all bodies, breadth first: from those whose motion is prescribed, then from free ones.
    fn attach_all(&mut self) -> Result<()> {
        let all = 0..self.bodies.len();
        let prescribed = all.clone().filter(|&body| self.moves(body) == [false; 3] && !self.turns(body));
        let mut queue: VecDeque<usize> = prescribed.collect();
        for &body in &queue {
            self.reached[body] = Some(None);
        }
        // Of the free bodies, those with prescribed coordinates cannot be children of others.
        let (guided, others): (Vec<usize>, _) = all.partition(|&body| self.moves(body) != [true; 3]);
        let mut used = self.closing_edges()?;
        self.attach_from(&mut queue, &mut used)?;
        for body in guided.into_iter().chain(others) {
            if self.reached[body].is_none() {
                self.push(body);
                queue.push_back(body);
                self.attach_from(&mut queue, &mut used)?;
            }
        }
        Ok(())
    }

    /// Cuts joints so that no loops of bodies are left. Returns for each joint whether it is cut.
    ///
    /// Joints with coordinates of the mechanism are cut last, then those with many constraint equations.
    fn closing_edges(&mut self) -> Result<Vec<bool>> {
        let mut parts: Vec<usize> = (0..self.bodies.len()).collect();
        let is_held = |body: &usize| self.moves(*body) == [false; 3] && !self.turns(*body);
        let held: Vec<usize> = (0..self.bodies.len()).filter(is_held).collect();
        held.iter().for_each(|&body| parts[body] = held[0]);
        let mut order: Vec<usize> = (0..self.edges.len()).collect();
        let is_free = |edge: &JointEdge| {
            let coordinate = |element: usize| self.mechanism.elements[element].coordinates[14];
            edge.coordinates.iter().any(|(element, _)| self.is_unknown(coordinate(*element)))
        };
        order.sort_by_key(|&k| {
            let edge = &self.edges[k];
            (!is_free(edge), edge.coordinates.is_empty(), std::cmp::Reverse(edge.rows.len()), k)
        });
        let mut used = vec![false; self.edges.len()];
        for k in order {
            let [a, b] = self.edges[k].bodies.map(|body| parts[body]);
            if a == b {
                used[k] = true;
                self.cut(k)?;
            } else {
                parts.iter_mut().filter(|part| **part == b).for_each(|part| *part = a);
            }
        }
        Ok(used)
    }

    /// Cuts a joint: its equations remain constraints, and so do prescribed motions of its coordinates.
    fn cut(&mut self, k: usize) -> Result<()> {
        let edge = &self.edges[k];
        self.cuts.push(edge.element);
        for &(definition, _) in &edge.coordinates {
            let instance = &self.mechanism.elements[definition];
            if self.is_unknown(instance.coordinates[14]) {
                let why = "it is the coordinate of a joint that closes a loop";
                return Err(unsupported(&instance.name, why));
            }
            self.cuts.push(definition);
        }
        Ok(())
    }

    /// Attaches all bodies that joints connect to those in the queue. Joints that would move a prescribed coordinate are cut.
    fn attach_from(&mut self, queue: &mut VecDeque<usize>, used: &mut [bool]) -> Result<()> {
        while let Some(parent) = queue.pop_front() {
            for k in self.edges_of[parent].clone() {
                if std::mem::replace(&mut used[k], true) {
                    continue;
                }
                let bodies = self.edges[k].bodies;
                let child = if bodies[0] == parent { bodies[1] } else { bodies[0] };
                let joint = match (self.moves(child), self.turns(child), self.edges[k].joint) {
                    ([true, true, true], true, joint) => Some(joint),
                    ([true, true, true], false, Joint3::Spherical) => Some(Joint3::Pin),
                    _ => None,
                };
                match joint.filter(|_| self.reached[child].is_none()) {
                    Some(joint) => {
                        self.push_joint(child, parent, k, joint)?;
                        queue.push_back(child);
                    }
                    None => self.cut(k)?,
                }
            }
        }
        Ok(())
    }

    /// Adds the free `body`.
    fn push(&mut self, body: usize) {
        let node = self.free_node(body);
        self.reached[body] = Some(Some(self.nodes.len()));
        self.nodes.push(node);
    }

    fn free_node(&self, body: usize) -> Node3 {
        let coordinates = self.bodies[body];
        Node3 {
            coordinates,
            parent: coordinates,
            parent_node: None,
            joint: Joint3::Free { moves: self.moves(body), turns: self.turns(body) },
            element: None,
            is_reversed: false,
            first: self.nodes.last().map_or(self.first, |node| node.first + node.count()),
            slots: Vec::new(),
            attached: Vec::new(),
            rows: &[],
            first_multiplier: 0,
            e_sign: 1.0,
        }
    }

    /// Adds `body` as a child of `parent`, connected by joint number `k`.
    fn push_joint(&mut self, body: usize, parent: usize, k: usize, joint: Joint3) -> Result<()> {
        let mut node = self.free_node(body);
        let edge = &self.edges[k];
        let element = &self.mechanism.elements[edge.element];
        node.joint = joint;
        node.parent = self.bodies[parent];
        node.parent_node = self.reached[parent].flatten();
        node.element = Some(edge.element);
        node.is_reversed = edge.bodies[0] == body;
        node.rows = edge.rows;
        node.first_multiplier = element.first_multiplier;
        let mut prescribed = vec![None; joint.axes().len()];
        for &(definition, slot) in &edge.coordinates {
            let definition = &self.mechanism.elements[definition];
            let coordinate = definition.coordinates[14];
            let has_others = edge.coordinates.iter().filter(|(_, other)| *other == slot).count() > 1;
            if !self.is_unknown(coordinate) {
                if has_others {
                    let why = "it is prescribed, and the same angle or displacement is a second coordinate";
                    return Err(unsupported(&definition.name, why));
                }
                prescribed[slot] = Some(coordinate);
            }
            node.attached.push(JointCoordinateSource { coordinate, slot, multiplier: definition.first_multiplier });
        }
        let mut next = node.first;
        for prescribed in prescribed {
            node.slots.push(prescribed.map_or(Slot::Free(next), Slot::Prescribed));
            next += usize::from(prescribed.is_none());
        }
        self.reached[body] = Some(Some(self.nodes.len()));
        self.nodes.push(node);
        Ok(())
    }
}
