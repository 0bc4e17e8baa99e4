//! From the ground to the tips: positions, velocities and accelerations of the bodies of a tree.

use crate::mechanism::Mechanism;
use crate::mechanism::scalars::StateScalar;
use crate::system::state::State;
use crate::tree::joint::{Joint, JointParameters, Levers, joint_coordinate, motion_of, rotated, turned};
use crate::tree::plan::Tree;

impl Tree {
    /// Parameters of all joints.
    pub fn parameters<T: StateScalar>(&self, mechanism: &Mechanism<T>) -> Vec<JointParameters<T>> {
        let of = |node| JointParameters::of(node, self.element_parameters(mechanism, node));
        self.nodes.iter().map(of).collect()
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
        parameters: &[JointParameters<T>],
        y: &[T],
        state: &mut State<T>,
        levers: &mut [Levers<T>],
    ) {
        let (q, v) = y.split_at(self.count);
        for ((node, parameters), levers) in self.nodes.iter().zip(parameters).zip(levers) {
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
            levers.base = rotated(rotation.sin_cos(), parameters.parent);
            levers.parent = levers.base;
            levers.child = rotated(state.q[ct].sin_cos(), parameters.child);
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
    pub fn place_accelerations<T: StateScalar>(&self, y: &[T], a: &[T], state: &mut State<T>, levers: &[Levers<T>]) {
        let v = &y[self.count..];
        for (node, levers) in self.nodes.iter().zip(levers) {
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
    /// Joints open against their constraints: the virtual displacement of the equation with the multiplier m is the negative
    /// `gaps[m]`. Then `gaps` · λ = Σ `out` · r over the rows of all bodies, which gives the derivatives of reactions.
    pub fn place_virtual(&self, y: &[f64], psi: &[f64], gaps: Option<&[f64]>, levers: &[Levers<f64>], out: &mut [f64]) {
        out.fill(0.0);
        for (node, levers) in self.nodes.iter().zip(levers) {
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
