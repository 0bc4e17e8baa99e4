//! Equations of motion of a tree: accelerations of the joint coordinates, and residuals in any number type.

use crate::diagnostics::not_finite;
use crate::elements::element::ElementWorkspace;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::system::System;
use crate::system::state::{State, evaluate};
use crate::tree::articulated::{ArticulatedInertia, ArticulatedWorkspace, TreeInertias};
use crate::tree::cut::{self, CutWorkspace, ProjectionFactor, TreeFactor};
use crate::tree::placement::{TreeGeometry, TreeParameters};
use crate::tree::space::articulated::Inertia3;
use crate::tree::space::placed::{PlacedBody, Twist};
use crate::tree::space::rigid::RigidProperties;
use crate::tree::topology::Tree;
use crate::{Error, Result};
use error::Seconds;

/// Entry of the Jacobian of a cut joint that counts as rounding, as a fraction of its gradient times a distance in m.
const ROUNDING: f64 = 1e-12;

impl Tree {
    /// Returns whether elements other than the bodies themselves act on the bodies.
    pub fn acts_on_bodies(&self) -> bool {
        !(self.forces.is_empty() && self.cut_elements.is_empty())
    }

    /// Counts the independent equations of cut joints in the consistent `state`.
    ///
    /// The row of an equation that the tree satisfies in all positions consists of rounding errors.
    pub fn count_independent(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let (mut placed, mut geometry, mut rows) = (state.clone(), TreeGeometry::new(self), Vec::new());
        let y = self.joint_state(mechanism, state);
        self.place(&self.parameters(mechanism), &y, &mut placed, &mut geometry);
        let at = (&self.cuts[..], &y[..self.count]);
        CutWorkspace::default().jacobian(self, mechanism, at, &placed, &geometry, &mut rows);
        let farthest = placed.q.iter().fold(1.0f64, |a, q| a.max(q.abs()));
        let gradients = cut::gradients(mechanism, &self.cuts, &placed);
        for (row, gradient) in rows.chunks_exact_mut(self.count.max(1)).zip(gradients) {
            let size = gradient.iter().fold(0.0f64, |a, (_, x)| a.max(x.abs()));
            if row.iter().all(|x| x.abs() <= ROUNDING * size * farthest) {
                row.fill(0.0);
            }
        }
        self.independent_cuts = cut::independent_rows(&rows, self.count, self.cuts.len()).len();
    }

    /// Sets position, velocity and acceleration of the prescribed coordinates that move, at the time of `state`.
    pub fn prescribe<T: StateScalar>(&self, mechanism: &Mechanism<T>, state: &mut State<T>) {
        for &i in &self.moving {
            if let Some((motion, parameters)) = &mechanism.coordinates[i].motion {
                [state.q[i], state.v[i], state.a[i]] = T::motion(motion.as_ref(), parameters, state.t);
            }
        }
    }
}

/// Residual of a tree in any number type: positions of all bodies from joint coordinates, and the rows of the joints.
#[derive(Clone)]
pub(crate) struct TreeResidual<T> {
    parameters: TreeParameters<T>,
    geometry: TreeGeometry<T>,
    /// Bodies in space, with their nodes.
    properties: Vec<(usize, RigidProperties<T>)>,
    wrenches: Vec<Twist<T>>,
    /// Mass or moment of inertia of the bodies by coordinate, and their weights.
    pub masses: Vec<T>,
    pub weights: Vec<T>,
    /// Inertia − force by coordinate.
    rows: Vec<T>,
    workspace: ElementWorkspace<T>,
    jets: ElementWorkspace<Jet2<T>>,
}

impl<T: StateScalar> TreeResidual<T>
where
    Jet2<T>: ElementScalar,
{
    /// Residual of `mechanism`.
    pub fn new(tree: &Tree, mechanism: &Mechanism<T>) -> Self {
        let (n, mut workspace) = (mechanism.coordinates.len(), ElementWorkspace::default());
        let mut rows_of = |acceleration: f64| {
            let mut state = State::built(mechanism, 0.0);
            state.v.fill(T::from(0.0));
            state.a.fill(T::from(acceleration));
            let mut rows = vec![T::from(0.0); n];
            for &k in &tree.bodies {
                add_rows(mechanism, k, &state, &mut workspace, &mut rows);
            }
            rows
        };
        let (weights, moving) = (rows_of(0.0), rows_of(1.0));
        Self {
            parameters: tree.parameters(mechanism),
            geometry: TreeGeometry::new(tree),
            properties: properties(tree, mechanism),
            wrenches: vec![[T::from(0.0); 6]; tree.space.nodes.len()],
            masses: moving.iter().zip(&weights).map(|(all, weight)| *all - *weight).collect(),
            weights,
            rows: vec![T::from(0.0); n],
            workspace,
            jets: ElementWorkspace::default(),
        }
    }

    /// Writes the state of all coordinates at the time of `state` for the joint coordinates and their velocities, `y`.
    #[inline(always)]
    pub fn place(&mut self, tree: &Tree, mechanism: &Mechanism<T>, y: &[T], state: &mut State<T>) {
        tree.prescribe(mechanism, state);
        tree.place(&self.parameters, y, state, &mut self.geometry);
    }

    /// Writes the rows of the joint coordinates for their accelerations `a`, in the position of the last [`Self::place`], and those of the
    /// cut joints, Φ̈. The multipliers of cut joints are those of `state`.
    #[inline(always)]
    pub fn evaluate(
        &mut self,
        tree: &Tree,
        mechanism: &Mechanism<T>,
        (y, a): (&[T], &[T]),
        state: &mut State<T>,
        out: &mut [T],
    ) {
        tree.place_accelerations(y, a, state, &mut self.geometry);
        let bodies = self.weights.iter().zip(&self.masses).zip(&state.a);
        self.rows.iter_mut().zip(bodies).for_each(|(row, ((weight, mass), a))| *row = *mass * *a + *weight);
        for &k in tree.forces.iter().chain(&tree.cut_elements) {
            add_rows(mechanism, k, state, &mut self.workspace, &mut self.rows);
        }
        let Self { geometry, properties, wrenches, rows, .. } = self;
        add_bodies(properties, &geometry.placed, wrenches);
        if tree.acts_on_bodies() {
            tree.space.add_rows(&geometry.placed, rows, wrenches);
        }
        let (q, v) = y.split_at(tree.count);
        let (joints, cuts) = out.split_at_mut(tree.count);
        tree.collect(geometry, q, (rows, wrenches), joints);
        tree.space.add_lengths((q, v), a, joints);
        cut::rates(mechanism, &tree.cuts, state, 2, &mut self.jets, cuts);
    }

    /// Writes w + Gᵀ μ for the rows of the joint coordinates, and G w + Φ (`order` 0) or G w + Φ̇ (1) for those of the cut joints: the
    /// equations of a correction w of the joint coordinates or velocities. G is that in the position `base`; Φ and Φ̇ are those at `y`.
    pub fn correction(
        &mut self,
        tree: &Tree,
        mechanism: &Mechanism<T>,
        ([base, y], order): ([&[T]; 2], usize),
        (w, multipliers): (&[T], &[T]),
        state: &mut State<T>,
        out: &mut [T],
    ) {
        let (zero, n) = (T::from(0.0), tree.count);
        self.place(tree, mechanism, y, state);
        let mut violation = vec![zero; tree.cuts.len()];
        cut::rates(mechanism, &tree.cuts, state, order, &mut self.jets, &mut violation);
        let (mut still, mut moving) = (violation.clone(), violation.clone());
        for (rates, velocities) in [(&mut still, None), (&mut moving, Some(w))] {
            let mut at = base.to_vec();
            match velocities {
                Some(velocities) => at[n..].copy_from_slice(velocities),
                None => at[n..].fill(zero),
            }
            self.place(tree, mechanism, &at, state);
            cut::rates(mechanism, &tree.cuts, state, 1, &mut self.jets, rates);
        }
        for (cut, multiplier) in tree.cuts.iter().zip(multipliers) {
            state.l[cut.multiplier] = *multiplier;
        }
        self.rows.fill(zero);
        for &k in &tree.cut_elements {
            add_rows(mechanism, k, state, &mut self.workspace, &mut self.rows);
        }
        self.wrenches.fill([zero; 6]);
        tree.space.add_rows(&self.geometry.placed, &self.rows, &mut self.wrenches);
        let (joints, cuts) = out.split_at_mut(n);
        tree.collect(&self.geometry, &base[..n], (&mut self.rows, &mut self.wrenches), joints);
        joints.iter_mut().zip(w).for_each(|(row, w)| *row += *w);
        for (k, row) in cuts.iter_mut().enumerate() {
            *row = violation[k] + moving[k] - still[k];
        }
    }

    /// Writes the reactions of the joints to `state`, after [`Self::evaluate`] with the accelerations of the motion.
    pub fn reactions(&self, tree: &Tree, y: &[T], state: &mut State<T>) {
        tree.reactions(y, &self.geometry, (&self.rows, &self.wrenches), &mut state.l);
    }
}

/// The bodies in space of `mechanism`, with their nodes.
fn properties<T: StateScalar>(tree: &Tree, mechanism: &Mechanism<T>) -> Vec<(usize, RigidProperties<T>)> {
    let of = |&(k, node): &(usize, usize)| (node, RigidProperties::of(&mechanism.elements[k]));
    tree.space.bodies.iter().map(of).collect()
}

/// Writes inertia − weight of the bodies in space.
#[inline(always)]
fn add_bodies<T: StateScalar>(
    properties: &[(usize, RigidProperties<T>)],
    placed: &[PlacedBody<T>],
    wrenches: &mut [Twist<T>],
) {
    wrenches.fill([T::from(0.0); 6]);
    for (node, body) in properties {
        let own = body.wrench(&placed[*node]);
        wrenches[*node].iter_mut().zip(own).for_each(|(to, from)| *to += from);
    }
}

/// Adds the rows of element number `k`.
fn add_rows<T: StateScalar>(
    mechanism: &Mechanism<T>,
    k: usize,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
    rows: &mut [T],
) {
    let instance = &mechanism.elements[k];
    evaluate(instance, state, workspace);
    instance.coordinates.iter().zip(&workspace.dynamics).for_each(|(&i, row)| rows[i] += *row);
}

/// Inertia of each body of a tree in the plane, and masses by coordinate of those that belong to no body: they are constant.
fn constant_masses(tree: &Tree, mechanism: &Mechanism<f64>, system: &System) -> (Vec<ArticulatedInertia>, Vec<f64>) {
    let n = mechanism.coordinates.len();
    let mut place_of = vec![None; n];
    for (k, node) in tree.nodes.iter().enumerate() {
        for (slot, &i) in node.coordinates.iter().enumerate() {
            if mechanism.coordinates[i].motion.is_none() {
                place_of[i] = Some((k, slot));
            }
        }
    }
    let (mut inertias, mut masses) = (vec![[0.0; 6]; tree.nodes.len()], vec![0.0; n]);
    for &k in tree.bodies.iter().chain(&tree.forces) {
        let instance = &mechanism.elements[k];
        for entry in system.coefficients(k) {
            let [i, j] = [entry.row, entry.coordinate].map(|local| instance.coordinates[local]);
            match (place_of[i], place_of[j]) {
                (Some((node, a)), Some((_, b))) if a <= b => inertias[node][PLACES[a][b]] += entry.values[2],
                (None, None) if i == j => masses[i] += entry.values[2],
                _ => {}
            }
        }
    }
    (inertias, masses)
}

/// Accelerations of the joint coordinates of a tree.
#[derive(Clone)]
pub(crate) struct TreeDynamics {
    /// The bodies.
    pub tree: Tree,
    /// Vectors of the joints in the current position.
    pub geometry: TreeGeometry<f64>,
    /// Mass matrix, factorized at the last evaluation of accelerations.
    pub factor: TreeFactor,
    /// Jacobian of the cut joints.
    cut_jacobian: Vec<f64>,
    cut_workspace: CutWorkspace,
    cut_rates: Vec<f64>,
    jets: ElementWorkspace<Jet2<f64>>,
    parameters: TreeParameters<f64>,
    /// Inertia of each body in the plane.
    pub inertias: Vec<ArticulatedInertia>,
    /// Bodies in space, with their nodes.
    properties: Vec<(usize, RigidProperties<f64>)>,
    /// Inertia of each body in space in the current position.
    inertias_in_space: Vec<Inertia3>,
    /// Constant masses by coordinate, of coordinates that belong to no body.
    masses: Vec<f64>,
    /// Rows of the bodies' weights, by coordinate.
    weights: Vec<f64>,
    /// Inertia − force by coordinate; after an evaluation, wrenches of the subtrees.
    pub rows: Vec<f64>,
    /// Inertia − force of each body in space; after an evaluation, wrenches of the subtrees.
    pub wrenches: Vec<Twist<f64>>,
    /// Inertia − force of each body in space alone, after [`Self::complete`].
    pub own_wrenches: Vec<Twist<f64>>,
    joint_rows: Vec<[f64; 1]>,
    values: Vec<f64>,
    zeros: Vec<f64>,
    work: ArticulatedWorkspace<1>,
    workspace: ElementWorkspace<f64>,
}

impl TreeDynamics {
    /// Accelerations of `mechanism` with the equations `system`.
    pub fn new(tree: Tree, mechanism: &Mechanism<f64>, system: &System) -> Self {
        let n = mechanism.coordinates.len();
        let (inertias, masses) = constant_masses(&tree, mechanism, system);
        let mut weights = vec![0.0; n];
        let rest = State { v: vec![0.0; n], a: vec![0.0; n], ..State::built(mechanism, 0.0) };
        let mut workspace = ElementWorkspace::default();
        for &k in &tree.bodies {
            add_rows(mechanism, k, &rest, &mut workspace, &mut weights);
        }
        let singles: Vec<f64> = tree.singles.iter().map(|&i| masses[i]).collect();
        let in_space = tree.space.nodes.len();
        Self {
            parameters: tree.parameters(mechanism),
            geometry: TreeGeometry::new(&tree),
            factor: TreeFactor::new(&tree, &singles),
            cut_jacobian: Vec::new(),
            cut_workspace: CutWorkspace::default(),
            cut_rates: vec![0.0; tree.cuts.len()],
            jets: ElementWorkspace::default(),
            inertias,
            properties: properties(&tree, mechanism),
            inertias_in_space: vec![Inertia3::default(); in_space],
            masses,
            wrenches: vec![[0.0; 6]; in_space],
            own_wrenches: vec![[0.0; 6]; in_space],
            weights,
            rows: vec![0.0; n],
            joint_rows: vec![[0.0]; tree.count + tree.cuts.len()],
            values: vec![0.0; tree.count],
            zeros: vec![0.0; tree.count],
            work: ArticulatedWorkspace::default(),
            workspace,
            tree,
        }
    }

    /// Writes the state of all coordinates at the time `t` (s) for the joint coordinates and their velocities, `y`.
    pub fn place(&mut self, mechanism: &Mechanism<f64>, t: f64, y: &[f64], state: &mut State<f64>) {
        state.t = t;
        self.tree.prescribe(mechanism, state);
        self.tree.place(&self.parameters, y, state, &mut self.geometry);
    }

    /// Writes the accelerations of the joint coordinates to `out`, and the multipliers of cut joints to `state`, in the position of the
    /// last [`Self::place`].
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming an element that is not finite, or a joint that moves no mass.
    pub fn accelerations(
        &mut self,
        mechanism: &Mechanism<f64>,
        y: &[f64],
        state: &mut State<f64>,
        out: &mut [f64],
    ) -> Result<()> {
        self.tree.place_accelerations(y, &self.zeros, state, &mut self.geometry);
        self.add_rows(mechanism, state, false);
        let (q, v) = y.split_at(self.tree.count);
        self.tree.collect(&self.geometry, q, (&mut self.rows, &mut self.wrenches), &mut self.values);
        self.tree.space.add_lengths((q, v), &self.zeros, &mut self.values);
        if self.values.iter().any(|row| !row.is_finite()) {
            return Err(self.non_finite_error(mechanism, state));
        }
        self.inertias_in_space.fill(Inertia3::default());
        for (node, body) in &self.properties {
            self.inertias_in_space[*node].add_rigid(body, &self.geometry.placed[*node].rotation);
        }
        let inertias =
            TreeInertias { plane: &self.inertias, space: &self.inertias_in_space, coordinates: &self.masses };
        self.factor.mass.factorize(&self.tree, &inertias, &self.geometry, q, state.t)?;
        if !self.tree.cuts.is_empty() {
            self.close(mechanism, q, state)?;
            if self.cut_rates.iter().any(|rate| !rate.is_finite()) {
                return Err(self.non_finite_error(mechanism, state));
            }
        }
        let values = self.values.iter().chain(&self.cut_rates);
        self.joint_rows.iter_mut().zip(values).for_each(|(row, value)| *row = [-value]);
        self.factor.solve(&self.tree, &mut self.joint_rows, &mut self.work);
        out.iter_mut().zip(&self.joint_rows).for_each(|(out, row)| *out = row[0]);
        for (cut, row) in self.tree.cuts.iter().zip(&self.joint_rows[self.tree.count..]) {
            state.l[cut.multiplier] = row[0];
        }
        Ok(())
    }

    /// Factorizes the Delassus matrix of the cut joints, and writes their Φ̈ at zero accelerations of the joint coordinates.
    fn close(&mut self, mechanism: &Mechanism<f64>, q: &[f64], state: &State<f64>) -> Result<()> {
        let Self { tree, factor, geometry, cut_jacobian, cut_workspace, cut_rates, jets, .. } = self;
        cut_workspace.jacobian(tree, mechanism, (&tree.cuts, q), state, geometry, cut_jacobian);
        factor.close(tree, cut_jacobian).map_err(|row| dependent(mechanism, tree, row, state.t))?;
        cut::rates(mechanism, &tree.cuts, state, 2, jets, cut_rates);
        Ok(())
    }

    /// Projects the joint coordinates `y` at the time `t` (s) onto the constraints of the cut joints, by one least-squares step for
    /// positions and one for velocities with the same factor. Returns the largest violations that remain.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming a joint that depends on others.
    pub fn project(
        &mut self,
        mechanism: &Mechanism<f64>,
        t: f64,
        y: &mut [f64],
        state: &mut State<f64>,
        record: &mut ProjectionRecord,
    ) -> Result<[f64; 2]> {
        let n = self.tree.count;
        record.t = t;
        record.y.copy_from_slice(y);
        for order in 0..2 {
            self.place(mechanism, t, y, state);
            let Self { tree, geometry, cut_jacobian, cut_workspace, jets, cut_rates: rates, joint_rows, .. } =
                &mut *self;
            if order == 0 {
                cut_workspace.jacobian(tree, mechanism, (&tree.cuts, &y[..n]), state, geometry, cut_jacobian);
                let factorized = record.factor.factorize(tree, cut_jacobian);
                factorized.map_err(|row| dependent(mechanism, tree, row, t))?;
            }
            cut::rates(mechanism, &tree.cuts, state, order, jets, rates);
            joint_rows.fill([0.0]);
            joint_rows[n..].iter_mut().zip(&*rates).for_each(|(row, rate)| *row = [-*rate]);
            record.factor.solve(tree, joint_rows);
            let solution = &mut record.solutions[order];
            solution.iter_mut().zip(&*joint_rows).for_each(|(to, row)| *to = row[0]);
            y[order * n..(order + 1) * n].iter_mut().zip(&*solution).for_each(|(y, change)| *y += change);
        }
        let mut violations = [0.0; 2];
        self.place(mechanism, t, y, state);
        for (order, violation) in violations.iter_mut().enumerate() {
            cut::rates(mechanism, &self.tree.cuts, state, order, &mut self.jets, &mut self.cut_rates);
            *violation = self.cut_rates.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        }
        Ok(violations)
    }

    /// Writes accelerations of all bodies and the reactions of the joints to `state`, for the accelerations `a` of the joint
    /// coordinates.
    pub fn complete(&mut self, mechanism: &Mechanism<f64>, (y, a): (&[f64], &[f64]), state: &mut State<f64>) {
        self.tree.place_accelerations(y, a, state, &mut self.geometry);
        self.add_rows(mechanism, state, true);
        self.own_wrenches.copy_from_slice(&self.wrenches);
        let q = &y[..self.tree.count];
        self.tree.collect(&self.geometry, q, (&mut self.rows, &mut self.wrenches), &mut self.values);
        self.tree.reactions(y, &self.geometry, (&self.rows, &self.wrenches), &mut state.l);
    }

    /// Inertia times the accelerations of a body, by coordinate.
    pub fn inertia_times(&self, node: usize, [x, y, t]: [f64; 3]) -> [f64; 3] {
        let [xx, xy, yy, xt, yt, tt] = self.inertias[node];
        [xx * x + xy * y + xt * t, xy * x + yy * y + yt * t, xt * x + yt * y + tt * t]
    }

    /// Writes inertia − force of all bodies and forces, and the reactions of cut joints if `has_reactions`.
    fn add_rows(&mut self, mechanism: &Mechanism<f64>, state: &mut State<f64>, has_reactions: bool) {
        self.rows.copy_from_slice(&self.weights);
        // Constant masses of elements are part of the inertias of the bodies, so the elements are evaluated without accelerations.
        let is_closed = has_reactions && !self.tree.cut_elements.is_empty();
        let has_forces = is_closed || !self.tree.forces.is_empty();
        if has_forces {
            let accelerations = std::mem::take(&mut state.a);
            state.a.resize(accelerations.len(), 0.0);
            let cuts = if is_closed { &self.tree.cut_elements[..] } else { &[] };
            for &k in self.tree.forces.iter().chain(cuts) {
                add_rows(mechanism, k, state, &mut self.workspace, &mut self.rows);
            }
            state.a = accelerations;
        }
        for (k, node) in self.tree.nodes.iter().enumerate() {
            let forces = self.inertia_times(k, node.coordinates.map(|i| state.a[i]));
            node.coordinates.iter().zip(forces).for_each(|(&i, force)| self.rows[i] += force);
        }
        for node in &self.tree.space.nodes {
            for attached in &node.attached {
                self.rows[attached.coordinate] += self.masses[attached.coordinate] * state.a[attached.coordinate];
            }
        }
        add_bodies(&self.properties, &self.geometry.placed, &mut self.wrenches);
        if has_forces {
            self.tree.space.add_rows(&self.geometry.placed, &self.rows, &mut self.wrenches);
        }
    }

    /// Inertia times a motion of a body in space: a wrench.
    pub fn inertia_in_space_times(&self, node: usize, twist: &Twist<f64>) -> Twist<f64> {
        self.inertias_in_space[node].times(twist)
    }

    /// The error of rows that are not finite.
    fn non_finite_error(&self, mechanism: &Mechanism<f64>, state: &State<f64>) -> Error {
        not_finite(mechanism, state).unwrap_or_else(|| {
            let worst = self.values.iter().position(|row| !row.is_finite()).unwrap_or(0);
            let why = format!("its rates are not finite at t = {}", Seconds(state.t));
            Error::analysis(
                &self.tree.names[worst],
                why,
                "use shorter steps or, with adaptive ones, a smaller tolerance",
            )
        })
    }
}

/// A projection onto the constraints of cut joints at the end of a step.
#[derive(Clone, Default)]
pub(crate) struct ProjectionRecord {
    /// Time in s.
    pub t: f64,
    /// Joint coordinates and velocities before.
    pub y: Vec<f64>,
    /// Corrections of the joint coordinates and of their velocities, each with its multipliers.
    pub solutions: [Vec<f64>; 2],
    pub factor: ProjectionFactor,
}

impl ProjectionRecord {
    /// Storage for `tree`.
    pub fn new(tree: &Tree) -> Self {
        let solution = vec![0.0; tree.count + tree.cuts.len()];
        Self {
            t: 0.0,
            y: vec![0.0; 2 * tree.count],
            solutions: [solution.clone(), solution],
            factor: ProjectionFactor::default(),
        }
    }
}

/// The error of an equation of a cut joint that depends on others.
fn dependent(mechanism: &Mechanism<f64>, tree: &Tree, row: usize, t: f64) -> Error {
    let cut = tree.cuts[row];
    let name = format!("{} (constraint {})", mechanism.elements[cut.element].name, cut.row + 1);
    let why = format!(
        "its equation follows from those of the other joints at t = {t}, and fewer constraints are independent than at the start",
        t = Seconds(t)
    );
    let remedy = "the mechanism is in a singular position, such as a dead centre: change the design, or use absolute coordinates";
    Error::analysis(name, why, remedy)
}

/// Place of the entry (i, j) of a symmetric inertia.
const PLACES: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];
