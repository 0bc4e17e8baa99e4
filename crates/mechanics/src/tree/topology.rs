//! The tree of a mechanism: its bodies in the order from the ground to the tips.

use crate::Result;
use crate::elements::bodies::{inertia, point_mass, rigid_body};
use crate::elements::element::{ElementDescriptor, ElementState, ElementWorkspace, JacobianWorkspace, TangentWeights};
use crate::elements::joints::{fixed_joint, prismatic, revolute};
use crate::mechanism::{CoordinateData, ElementInstance, Mechanism};
use crate::system::state::{State, gather};
use crate::system::{ConstantEntry, System};
use crate::tree::joint::{Joint, TreeBody};
use crate::tree::space::Space;
use crate::tree::space::rigid::is_body as is_body_in_space;
use crate::tree::space::topology::Node3;
use crate::tree::unsupported;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// An equation of a cut joint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutRow {
    /// Number of the element.
    pub element: usize,
    /// Number of the equation in the element.
    pub row: usize,
    /// Number of the multiplier.
    pub multiplier: usize,
}

/// The bodies of a mechanism in relative coordinates, the same for all designs.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    /// Bodies in the plane, each after its parent.
    pub nodes: Vec<TreeBody>,
    /// Bodies in space, whose joint coordinates follow those of the bodies in the plane.
    pub space: Space,
    /// Single coordinates: unknowns that belong to no body, such as those of flywheels. They are joint coordinates as well.
    pub singles: Vec<usize>,
    /// Joint coordinate of the first single coordinate.
    pub first_single: usize,
    /// Number of joint coordinates.
    pub count: usize,
    /// Elements that are bodies: masses under gravity.
    pub bodies: Vec<usize>,
    /// Other elements that act on coordinates.
    pub forces: Vec<usize>,
    /// Equations of joints that the trees do not contain: those that close loops.
    pub cuts: Vec<CutRow>,
    /// Number of these equations that do not follow from the others.
    pub independent_cuts: usize,
    /// Elements of these equations.
    pub cut_elements: Vec<usize>,
    /// Prescribed coordinates that move.
    pub moving: Vec<usize>,
    /// Names of the joint coordinates.
    pub names: Vec<String>,
}

impl Tree {
    /// The tree of `mechanism` with the equations `system`.
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] naming the part that relative coordinates do not support.
    pub fn new(mechanism: &Mechanism<f64>, system: &System) -> Result<Self> {
        if let Some(event) = mechanism.events.first() {
            return Err(unsupported(
                &event.gap.name,
                "rigid contacts, dry friction, switches and events need absolute coordinates",
            ));
        }
        let mut builder = TreeBuilder::new(mechanism)?;
        builder.attach_all();
        let TreeBuilder { nodes, mut owner, bodies: planar, mut cuts, .. } = builder;
        let in_plane: usize = nodes.iter().map(|node| node.joint.count()).sum();
        let space = Space::new(mechanism, in_plane)?;
        add_owners(mechanism, &space, planar.len(), &mut owner);
        cuts.extend(&space.cuts);
        cuts.sort_unstable();
        let in_space: BTreeSet<usize> = space.nodes.iter().flat_map(|node| node.coordinates).collect();
        check_forces(mechanism, system, (&owner, &in_space))?;
        check_cuts(mechanism, system, &cuts, &owner)?;
        let rows = cut_rows(mechanism, &cuts);
        let is_single = |i: &usize| is_unknown(mechanism, *i) && owner[*i].is_none();
        let singles: Vec<usize> = (0..mechanism.coordinates.len()).filter(is_single).collect();
        let first_single = in_plane + space.count;
        let (bodies, forces) = bodies_and_forces(mechanism);
        Ok(Self {
            names: names(mechanism, (&nodes, &space), &singles),
            nodes,
            space,
            first_single,
            count: first_single + singles.len(),
            singles,
            bodies,
            forces,
            independent_cuts: rows.len(),
            cuts: rows,
            cut_elements: cuts,
            moving: moving_coordinates(mechanism),
        })
    }

    /// Returns whether joint coordinates or Euler parameters replace constraints.
    fn has_joints(&self) -> bool {
        let replaces = |node: &Node3| node.element.is_some() || node.rotates();
        self.space.nodes.iter().any(replaces) || self.nodes.iter().any(|node| node.element.is_some())
    }

    /// Returns whether joint coordinates replace constraints, and no constraint remains.
    pub fn is_open(&self) -> bool {
        self.has_joints() && self.cuts.is_empty()
    }

    /// Ratio of the largest to the smallest mass of bodies with mass. The recursion loses digits where it is large.
    pub fn mass_ratio(&self, mechanism: &Mechanism<f64>, system: &System) -> f64 {
        let mut masses: BTreeMap<usize, f64> = BTreeMap::new();
        let xs: BTreeSet<usize> = self.nodes.iter().map(|node| node.coordinates[0]).collect();
        for &k in &self.bodies {
            let instance = &mechanism.elements[k];
            for entry in system.coefficients(k).iter().filter(|entry| entry.row == entry.coordinate) {
                let coordinate = instance.coordinates[entry.coordinate];
                if xs.contains(&coordinate) {
                    *masses.entry(coordinate).or_default() += entry.values[2];
                }
            }
        }
        for &(k, node) in &self.space.bodies {
            let coordinate = self.space.nodes[node].coordinates[0];
            *masses.entry(coordinate).or_default() += mechanism.elements[k].parameters[0];
        }
        let all = masses.into_values().filter(|mass| *mass > 0.0);
        let [least, largest] = all.fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], mass| [a.min(mass), b.max(mass)]);
        if largest > 0.0 { largest / least } else { 1.0 }
    }

    /// The parameters of the element of a joint.
    pub fn element_parameters<'m, T>(&self, mechanism: &'m Mechanism<T>, node: &TreeBody) -> &'m [T] {
        node.element.map_or(&[], |k| &mechanism.elements[k].parameters)
    }
}

/// Returns whether `instance` has this declaration.
fn is_kind(instance: &ElementInstance<f64>, descriptor: &'static ElementDescriptor) -> bool {
    instance.element.descriptor().is_some_and(|own| std::ptr::eq(own, descriptor))
}

/// Returns whether the element is a mass under gravity, with rows M q̈ − constant.
fn is_body(instance: &ElementInstance<f64>) -> bool {
    [&rigid_body::DESCRIPTOR, &point_mass::DESCRIPTOR, &inertia::DESCRIPTOR]
        .into_iter()
        .any(|descriptor| is_kind(instance, descriptor))
}

/// Returns whether the motion of a coordinate is not prescribed.
fn is_unknown(mechanism: &Mechanism<f64>, coordinate: usize) -> bool {
    mechanism.coordinates[coordinate].motion.is_none()
}

/// Adds the owners of the coordinates of bodies in space and of their joints; the owners before them are `planar` bodies.
fn add_owners(mechanism: &Mechanism<f64>, space: &Space, planar: usize, owner: &mut [Option<usize>]) {
    for (k, node) in space.nodes.iter().enumerate() {
        let own = node.coordinates.iter().filter(|&&i| is_unknown(mechanism, i));
        own.for_each(|&i| owner[i] = Some(planar + k));
        for attached in &node.attached {
            owner[attached.coordinate] = Some(planar + space.nodes.len() + attached.coordinate);
        }
    }
}

/// The equations of the elements `cuts`.
fn cut_rows(mechanism: &Mechanism<f64>, cuts: &[usize]) -> Vec<CutRow> {
    let rows_of = |&element: &usize| {
        let first = mechanism.elements[element].first_multiplier;
        let count = mechanism.elements[element].num_constraints;
        (0..count).map(move |row| CutRow { element, row, multiplier: first + row })
    };
    cuts.iter().flat_map(rows_of).collect()
}

/// The elements that act on coordinates: masses under gravity, and others. Bodies in space are not among them.
fn bodies_and_forces(mechanism: &Mechanism<f64>) -> (Vec<usize>, Vec<usize>) {
    let acts = |k: &usize| {
        let instance = &mechanism.elements[*k];
        let is_force = instance.num_constraints == 0 && !instance.element.is_sensor() && !is_body_in_space(instance);
        is_force && instance.coordinates.iter().any(|&i| is_unknown(mechanism, i))
    };
    (0..mechanism.elements.len()).filter(acts).partition(|&k| is_body(&mechanism.elements[k]))
}

/// The prescribed coordinates that move.
fn moving_coordinates(mechanism: &Mechanism<f64>) -> Vec<usize> {
    let moves =
        |coordinate: &CoordinateData<f64>| coordinate.motion.as_ref().is_some_and(|(motion, _)| !motion.is_fixed());
    (0..mechanism.coordinates.len()).filter(|&i| moves(&mechanism.coordinates[i])).collect()
}

/// Bodies with `N` coordinates, numbered in the order in which they are found.
pub(crate) struct BodyNumbers<const N: usize> {
    pub bodies: Vec<[usize; N]>,
    pub numbers: BTreeMap<[usize; N], usize>,
}

impl<const N: usize> BodyNumbers<N> {
    pub fn new() -> Self {
        Self { bodies: Vec::new(), numbers: BTreeMap::new() }
    }

    /// Number of the body with these first `N` coordinates.
    pub fn number(&mut self, coordinates: &[usize]) -> usize {
        let body: [usize; N] = std::array::from_fn(|k| coordinates[k]);
        *self.numbers.entry(body).or_insert_with(|| {
            self.bodies.push(body);
            self.bodies.len() - 1
        })
    }
}

/// A tree under construction, from the ground outwards.
struct TreeBuilder<'m> {
    mechanism: &'m Mechanism<f64>,
    /// Coordinates of each body.
    bodies: Vec<[usize; 3]>,
    /// Element, kind and bodies of each joint.
    joints: Vec<(usize, Joint, [usize; 2])>,
    /// Joints of each body.
    joints_of: Vec<Vec<usize>>,
    /// Body that each unknown coordinate belongs to.
    owner: Vec<Option<usize>>,
    nodes: Vec<TreeBody>,
    /// Node of each body that is reached; `None` inside for a body whose motion is prescribed.
    reached: Vec<Option<Option<usize>>>,
    /// Elements with constraints that the tree does not contain.
    cuts: Vec<usize>,
}

/// The joint of a tree for an element that is such a joint.
fn joint_of(instance: &ElementInstance<f64>) -> Option<Joint> {
    match () {
        () if is_kind(instance, &revolute::DESCRIPTOR) => Some(Joint::Revolute),
        () if is_kind(instance, &prismatic::DESCRIPTOR) => Some(Joint::Prismatic),
        () if is_kind(instance, &fixed_joint::DESCRIPTOR) => Some(Joint::Fixed),
        () => None,
    }
}

/// The body that each unknown coordinate belongs to.
///
/// # Errors
///
/// [`Error::Unsupported`](crate::Error::Unsupported) naming a coordinate of two bodies.
fn owners(mechanism: &Mechanism<f64>, bodies: &[[usize; 3]]) -> Result<Vec<Option<usize>>> {
    let mut owner = vec![None; mechanism.coordinates.len()];
    for (body, coordinates) in bodies.iter().enumerate() {
        for &i in coordinates.iter().filter(|&&i| is_unknown(mechanism, i)) {
            if owner[i].replace(body).is_some() {
                return Err(unsupported(&mechanism.coordinates[i].name, "two bodies share this coordinate"));
            }
        }
    }
    Ok(owner)
}

impl<'m> TreeBuilder<'m> {
    fn new(mechanism: &'m Mechanism<f64>) -> Result<Self> {
        let mut numbers = BodyNumbers::<3>::new();
        let (mut joints, mut cuts) = (Vec::new(), Vec::new());
        for (k, instance) in mechanism.elements.iter().enumerate() {
            if is_kind(instance, &rigid_body::DESCRIPTOR) {
                numbers.number(&instance.coordinates);
            }
            if instance.num_constraints == 0 || Space::has_constraint(instance) {
                continue;
            }
            let Some(joint) = joint_of(instance) else {
                cuts.push(k);
                continue;
            };
            let pair = [&instance.coordinates[..3], &instance.coordinates[3..]];
            joints.push((k, joint, pair.map(|coordinates| numbers.number(coordinates))));
        }
        let bodies = numbers.bodies;
        let owner = owners(mechanism, &bodies)?;
        let mut joints_of = vec![Vec::new(); bodies.len()];
        for (k, (_, _, pair)) in joints.iter().enumerate() {
            pair.iter().for_each(|&body: &usize| joints_of[body].push(k));
        }
        let reached = vec![None; bodies.len()];
        Ok(Self { mechanism, bodies, joints, joints_of, owner, nodes: Vec::new(), reached, cuts })
    }

    fn is_free(&self, body: usize) -> [bool; 3] {
        self.bodies[body].map(|i| is_unknown(self.mechanism, i))
    }

    /// Attaches all bodies, breadth first: from those whose motion is prescribed, then from free ones.
    fn attach_all(&mut self) {
        let all = 0..self.bodies.len();
        let prescribed = all.clone().filter(|&body| self.is_free(body) == [false; 3]);
        let mut queue: VecDeque<usize> = prescribed.collect();
        for &body in &queue {
            self.reached[body] = Some(None);
        }
        // Of the free bodies, those with prescribed translations cannot be children of others.
        let (guided, others): (Vec<usize>, _) = all.partition(|&body| {
            let [x, y, _] = self.is_free(body);
            !(x && y)
        });
        let mut used = vec![false; self.joints.len()];
        self.attach_from(&mut queue, &mut used);
        for body in guided.into_iter().chain(others) {
            if self.reached[body].is_none() {
                self.push(body, None);
                queue.push_back(body);
                self.attach_from(&mut queue, &mut used);
            }
        }
    }

    /// Attaches all bodies that joints connect to those in the queue. Joints that close loops, or that a tree cannot have, are cut.
    fn attach_from(&mut self, queue: &mut VecDeque<usize>, used: &mut [bool]) {
        while let Some(parent) = queue.pop_front() {
            for k in self.joints_of[parent].clone() {
                let (element, joint, bodies) = self.joints[k];
                if std::mem::replace(&mut used[k], true) {
                    continue;
                }
                let child = if bodies[0] == parent { bodies[1] } else { bodies[0] };
                let holds = match (self.is_free(child), joint) {
                    ([true, true, true], joint) => Some(joint),
                    ([true, true, false], Joint::Revolute) => Some(Joint::Pin),
                    _ => None, // it would move a prescribed coordinate
                };
                match holds.filter(|_| self.reached[child].is_none()) {
                    Some(joint) => {
                        self.push(child, Some((parent, joint, element, bodies[0] == child)));
                        queue.push_back(child);
                    }
                    None => self.cuts.push(element),
                }
            }
        }
    }

    fn push(&mut self, body: usize, on: Option<(usize, Joint, usize, bool)>) {
        let first = self.nodes.last().map_or(0, |node| node.first + node.joint.count());
        let coordinates = self.bodies[body];
        let free = TreeBody {
            coordinates,
            parent: coordinates,
            parent_node: None,
            joint: Joint::Free { is_free: self.is_free(body) },
            element: None,
            is_reversed: false,
            first,
            first_multiplier: 0,
        };
        let node = on.map_or(free.clone(), |(parent, joint, element, is_reversed)| TreeBody {
            parent: self.bodies[parent],
            parent_node: self.reached[parent].flatten(),
            joint,
            element: Some(element),
            is_reversed,
            first_multiplier: self.mechanism.elements[element].first_multiplier,
            ..free
        });
        self.reached[body] = Some(Some(self.nodes.len()));
        self.nodes.push(node);
    }
}

/// Checks that the coordinates of cut joints that belong to no body have masses of their own.
fn check_cuts(mechanism: &Mechanism<f64>, system: &System, cuts: &[usize], owner: &[Option<usize>]) -> Result<()> {
    let moves_mass = |i: usize| {
        let all = mechanism.elements.iter().enumerate().flat_map(|(k, instance)| {
            system.coefficients(k).iter().map(move |entry| (instance.coordinates[entry.coordinate], entry.values[2]))
        });
        all.filter(|(coordinate, _)| *coordinate == i).any(|(_, mass)| mass != 0.0)
    };
    for &k in cuts {
        let instance = &mechanism.elements[k];
        let is_free = |&&i: &&usize| is_unknown(mechanism, i) && owner[i].is_none();
        if instance.coordinates.iter().filter(is_free).any(|&i| !moves_mass(i)) {
            let why = "it is no joint of the tree, and its coordinate has no mass of its own";
            return Err(unsupported(&instance.name, why));
        }
    }
    Ok(())
}

/// Checks that accelerations enter the elements as constant masses of single bodies, and that forces are smooth.
///
/// `owner` has the body of each coordinate, and `in_space` the coordinates of bodies in space.
fn check_forces(
    mechanism: &Mechanism<f64>,
    system: &System,
    (owner, in_space): (&[Option<usize>], &BTreeSet<usize>),
) -> Result<()> {
    let mut state = State::built(mechanism, 0.0);
    // A position without special angles; its components have no simple ratios.
    state.q.iter_mut().enumerate().for_each(|(i, q)| *q += 0.1 * (1.0 + 2.3 * i as f64).sin());
    let mut workspaces = (ElementWorkspace::default(), JacobianWorkspace::default());
    for (k, instance) in mechanism.elements.iter().enumerate() {
        if instance.num_constraints > 0 || instance.element.is_sensor() || is_body_in_space(instance) {
            continue;
        }
        let adds_mass_in_space = |entry: &ConstantEntry| {
            let i = instance.coordinates[entry.row];
            entry.values[2] != 0.0 && is_unknown(mechanism, i) && in_space.contains(&i)
        };
        let couples_bodies = |entry: &ConstantEntry| {
            let [i, j] = [entry.row, entry.coordinate].map(|local| instance.coordinates[local]);
            let is_coupling = is_unknown(mechanism, i) && entry.values[2] != 0.0 && i != j;
            is_coupling && (owner[i].is_none() || owner[i] != owner[j])
        };
        let why = match () {
            () if instance.num_reactions > 0 => "its force depends on the reactions of a joint",
            () if system.coefficients(k).iter().any(adds_mass_in_space) => {
                "it adds mass to one coordinate of a body in space"
            }
            () if system.coefficients(k).iter().any(couples_bodies) => "its mass couples several bodies",
            () if instance.sides.is_some() => "its force is not smooth where a contact closes or opens",
            () if has_varying_mass(instance, &state, &mut workspaces) => "its mass changes with its position",
            () => continue,
        };
        return Err(unsupported(&instance.name, why));
    }
    Ok(())
}

/// Returns whether the derivatives of an element with respect to accelerations depend on its position, or are not zero at `state`.
fn has_varying_mass(
    instance: &ElementInstance<f64>,
    state: &State<f64>,
    (workspace, jacobian_workspace): &mut (ElementWorkspace<f64>, JacobianWorkspace),
) -> bool {
    let varying: Vec<usize> =
        (0..instance.coordinates.len()).filter(|local| !instance.element.linear().contains(local)).collect();
    if varying.is_empty() {
        return false;
    }
    gather(instance, state, workspace);
    let local = ElementState { p: &instance.parameters, ..workspace.local(state.t) };
    let width = varying.len() + 1;
    let mut columns = vec![0.0; instance.coordinates.len() * width];
    let weights = TangentWeights { position: 0.0, velocity: 0.0, acceleration: 1.0 };
    instance.element.columns(&local, weights, &varying, jacobian_workspace, &mut columns);
    columns.chunks_exact(width).any(|row| row[1..].iter().any(|mass| *mass != 0.0))
}

/// Names of the joint coordinates.
fn names(mechanism: &Mechanism<f64>, (nodes, space): (&[TreeBody], &Space), singles: &[usize]) -> Vec<String> {
    let mut names = Vec::new();
    for node in nodes {
        let joint = |what| node.element.map(|k| format!("{what} of {}", mechanism.elements[k].name));
        match node.joint {
            Joint::Revolute => names.extend(joint("angle")),
            Joint::Prismatic => names.extend(joint("displacement")),
            _ => names.extend(node.free_coordinates().map(|i| mechanism.coordinates[i].name.clone())),
        }
    }
    space.names(mechanism, &mut names);
    names.extend(singles.iter().map(|&i| mechanism.coordinates[i].name.clone()));
    names
}
