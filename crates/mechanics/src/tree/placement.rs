//! From the ground to the tips: positions, velocities and accelerations of the bodies of a tree.

use crate::mechanism::Mechanism;
use crate::mechanism::scalars::StateScalar;
use crate::system::state::State;
use crate::tree::joint::{Joint, JointParameters, Levers, joint_coordinate, motion_of, rotated, turned};
use crate::tree::space::joint::JointMarkers;
use crate::tree::space::placed::{PlacedBody, Twist};
use crate::tree::topology::Tree;

/// Parameters of all joints, from parent to child in the tree.
#[derive(Clone)]
pub(crate) struct TreeParameters<T> {
    /// Of joints in the plane.
    pub plane: Vec<JointParameters<T>>,
    /// Of joints in space.
    pub space: Vec<JointMarkers<T>>,
}

/// Vectors of all joints in a position, and the motion of the bodies in space.
#[derive(Clone)]
pub(crate) struct TreeGeometry<T> {
    /// Of joints in the plane.
    pub levers: Vec<Levers<T>>,
    /// Of bodies in space.
    pub placed: Vec<PlacedBody<T>>,
}

impl<T: StateScalar> TreeGeometry<T> {
    /// Storage for `tree`.
    pub fn new(tree: &Tree) -> Self {
        Self {
            levers: vec![Levers::zero(); tree.nodes.len()],
            placed: vec![PlacedBody::zero(); tree.space.nodes.len()],
        }
    }
}

impl Tree {
    /// Parameters of all joints.
    pub fn parameters<T: StateScalar>(&self, mechanism: &Mechanism<T>) -> TreeParameters<T> {
        let of = |node| JointParameters::of(node, self.element_parameters(mechanism, node));
        TreeParameters { plane: self.nodes.iter().map(of).collect(), space: self.space.markers(mechanism) }
    }

    /// Chooses the signs of Euler parameters so that [`Self::place`] gives those of the consistent `state`.
    pub fn choose_signs(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let (parameters, y) = (self.parameters(mechanism), self.joint_state(mechanism, state));
        let (mut placed, mut geometry) = (state.clone(), TreeGeometry::new(self));
        self.place(&parameters, &y, &mut placed, &mut geometry);
        let mut signs = Vec::with_capacity(self.space.nodes.len());
        for node in &mut self.space.nodes {
            let [.., a, b, c, d] = node.coordinates;
            let product: f64 = [a, b, c, d].into_iter().map(|i| placed.q[i] * state.q[i]).sum();
            let sign = if product < 0.0 { -1.0 } else { 1.0 };
            // A body follows the sign of its parent.
            node.e_sign = sign * node.parent_node.map_or(1.0, |parent| signs[parent]);
            signs.push(sign);
        }
    }

    /// Joint coordinates, followed by their velocities, of the consistent `state`.
    pub fn joint_state<T: StateScalar>(&self, mechanism: &Mechanism<T>, state: &State<T>) -> Vec<T> {
        let n = self.count;
        let mut y = vec![T::from(0.0); 2 * n];
        for node in &self.nodes {
            match node.joint {
                Joint::Free { .. } => {
                    for (k, i) in node.free_coordinates().enumerate() {
                        (y[node.first + k], y[n + node.first + k]) = (state.q[i], state.v[i]);
                    }
                }
                Joint::Revolute | Joint::Prismatic => {
                    let p = self.element_parameters(mechanism, node);
                    let bodies = [node.parent, node.coordinates].map(|body| motion_of(state, body));
                    [y[node.first], y[n + node.first]] = joint_coordinate(node, p, bodies[0], bodies[1]);
                }
                Joint::Pin | Joint::Fixed => {}
            }
        }
        let (q, v) = y.split_at_mut(n);
        self.space.write_joint_state(mechanism, state, (q, v));
        for (k, &i) in self.singles.iter().enumerate() {
            let at = self.first_single + k;
            (y[at], y[n + at]) = (state.q[i], state.v[i]);
        }
        y
    }

    /// Writes positions and velocities of all bodies to `state`, in which prescribed coordinates have theirs; `y` are the joint
    /// coordinates, followed by their velocities.
    #[inline(always)]
    pub fn place<T: StateScalar>(
        &self,
        parameters: &TreeParameters<T>,
        y: &[T],
        state: &mut State<T>,
        geometry: &mut TreeGeometry<T>,
    ) {
        let (q, v) = y.split_at(self.count);
        self.space.place(&parameters.space, (q, v), state, &mut geometry.placed);
        for ((node, parameters), levers) in self.nodes.iter().zip(&parameters.plane).zip(&mut geometry.levers) {
            let ([px, py, pt], [cx, cy, ct]) = (node.parent, node.coordinates);
            if let Joint::Free { .. } = node.joint {
                for (k, i) in node.free_coordinates().enumerate() {
                    (state.q[i], state.v[i]) = (q[node.first + k], v[node.first + k]);
                }
                continue;
            }
            let (rotation, spin) = (state.q[pt], state.v[pt]);
            match node.joint {
                Joint::Revolute => {
                    state.q[ct] = rotation + q[node.first];
                    state.v[ct] = spin + v[node.first];
                }
                Joint::Pin => {} // the rotation is prescribed
                _ => {
                    state.q[ct] = rotation + parameters.angle;
                    state.v[ct] = spin;
                }
            }
            levers.rotations = [rotation.sin_cos(), state.q[ct].sin_cos()];
            levers.base = rotated(levers.rotations[0], parameters.parent);
            levers.parent = levers.base;
            levers.child = rotated(levers.rotations[1], parameters.child);
            let mut slide = [T::from(0.0); 2];
            if node.joint == Joint::Prismatic {
                let (sin, cos) = (state.q[node.first_body()[2]] + parameters.line).sin_cos();
                levers.axis = [cos * node.sign(), sin * node.sign()];
                slide = levers.axis.map(|u| u * v[node.first]);
                levers.parent = [0, 1].map(|i| levers.base[i] + levers.axis[i] * q[node.first]);
            }
            let (by_parent, by_child) = (turned(levers.parent), turned(levers.child));
            let child_spin = state.v[ct];
            for (i, (from, to)) in [(px, cx), (py, cy)].into_iter().enumerate() {
                state.q[to] = state.q[from] + levers.parent[i] - levers.child[i];
                state.v[to] = state.v[from] + spin * by_parent[i] + slide[i] - child_spin * by_child[i];
            }
        }
        for (k, &i) in self.singles.iter().enumerate() {
            (state.q[i], state.v[i]) = (q[self.first_single + k], v[self.first_single + k]);
        }
    }

    /// Writes accelerations of all bodies to `state`, for the accelerations `a` of the joint coordinates.
    #[inline(always)]
    pub fn place_accelerations<T: StateScalar>(
        &self,
        y: &[T],
        a: &[T],
        state: &mut State<T>,
        geometry: &mut TreeGeometry<T>,
    ) {
        let (q, v) = y.split_at(self.count);
        self.space.accelerate((q, a), state, &mut geometry.placed);
        for (node, levers) in self.nodes.iter().zip(&geometry.levers) {
            let ([px, py, pt], [cx, cy, ct]) = (node.parent, node.coordinates);
            if let Joint::Free { .. } = node.joint {
                for (k, i) in node.free_coordinates().enumerate() {
                    state.a[i] = a[node.first + k];
                }
                continue;
            }
            let (spin, turn) = (state.v[pt], state.a[pt]);
            match node.joint {
                Joint::Revolute => state.a[ct] = turn + a[node.first],
                Joint::Pin => {}
                _ => state.a[ct] = turn,
            }
            let (child_spin, child_turn) = (state.v[ct], state.a[ct]);
            let (by_parent, by_child) = (turned(levers.parent), turned(levers.child));
            let mut slide = [T::from(0.0); 2];
            if node.joint == Joint::Prismatic {
                let sideways = turned(levers.axis);
                let coriolis = spin * v[node.first] * 2.0;
                slide = [0, 1].map(|i| levers.axis[i] * a[node.first] + sideways[i] * coriolis);
            }
            for (i, (from, to)) in [(px, cx), (py, cy)].into_iter().enumerate() {
                state.a[to] = state.a[from] + turn * by_parent[i] - spin * spin * levers.parent[i] + slide[i]
                    - child_turn * by_child[i]
                    + child_spin * child_spin * levers.child[i];
            }
        }
        for (k, &i) in self.singles.iter().enumerate() {
            state.a[i] = a[self.first_single + k];
        }
    }

    /// Writes the virtual displacements of all coordinates for those of the joint coordinates, `psi`.
    ///
    /// With `gaps`, the virtual displacements violate the constraints of joints: that of the constraint with the multiplier m
    /// is −`gaps[m]`. Then `gaps` · λ = Σ `out` · r over the rows of all bodies, which gives the derivatives of reactions.
    pub fn place_virtual(
        &self,
        y: &[f64],
        psi: &[f64],
        gaps: Option<&[f64]>,
        geometry: &TreeGeometry<f64>,
        (twists, out): (&mut [Twist<f64>], &mut [f64]),
    ) {
        out.fill(0.0);
        self.space.place_virtual(&geometry.placed, &y[..self.count], psi, gaps, (twists, &mut *out));
        for (node, levers) in self.nodes.iter().zip(&geometry.levers) {
            let ([px, py, pt], [cx, cy, ct]) = (node.parent, node.coordinates);
            if let Joint::Free { .. } = node.joint {
                for (k, i) in node.free_coordinates().enumerate() {
                    out[i] = psi[node.first + k];
                }
                continue;
            }
            let turn = out[pt];
            let (mut shift, mut child_turn) = ([0.0; 2], turn);
            match node.joint {
                Joint::Revolute => child_turn += psi[node.first],
                Joint::Pin => child_turn = 0.0,
                Joint::Prismatic => shift = levers.axis.map(|u| u * psi[node.first]),
                Joint::Fixed | Joint::Free { .. } => {}
            }
            if let Some(gaps) = gaps {
                let opening = self.opening(node, y, &gaps[node.first_multiplier..], levers);
                shift = [shift[0] + opening[0], shift[1] + opening[1]];
                child_turn += opening[2];
            }
            let (by_parent, by_child) = (turned(levers.parent), turned(levers.child));
            out[cx] = out[px] + turn * by_parent[0] + shift[0] - child_turn * by_child[0];
            out[cy] = out[py] + turn * by_parent[1] + shift[1] - child_turn * by_child[1];
            if node.joint != Joint::Pin {
                out[ct] = child_turn;
            }
        }
        for (k, &i) in self.singles.iter().enumerate() {
            out[i] = psi[self.first_single + k];
        }
    }
}
