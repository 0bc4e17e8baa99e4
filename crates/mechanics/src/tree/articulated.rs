//! The articulated-body recursion: factorization of the mass matrix of a tree, and solutions with it, in O(n).
//!
//! From the tips to the ground, each body has an articulated-body inertia: that of the body and of all bodies outboard of it, whose
//! joints move freely. For a joint with the direction s of its coordinate and the inertia I of the body outboard of it
//!
//! $$ U = I s,\qquad D = s^T U,\qquad I' = I - U U^T / D $$
//!
//! and I′ is added to the inertia of the parent. A solution of A x = b takes one sweep inwards and one outwards with these numbers.
//!
//! # Sources
//!
//! Featherstone, *Rigid Body Dynamics Algorithms* (2008), Chapter 7.

use crate::tree::joint::{Joint, turned};
use crate::tree::placement::TreeGeometry;
use crate::tree::space::articulated::{Articulated3, Inertia3};
use crate::tree::topology::Tree;
use crate::{Error, Result};
use error::Seconds;

/// Symmetric inertia of a body about its reference point: xx, xy, yy, xθ, yθ, θθ.
pub(crate) type ArticulatedInertia = [f64; 6];

/// Factors of one body.
#[derive(Clone, Copy, Debug, Default)]
struct NodeFactor {
    /// Direction of the joint coordinate: motion of the body at its rate one.
    direction: [f64; 3],
    /// U = I s.
    force: [f64; 3],
    /// 1/D.
    inverse: f64,
    /// Velocity of the body's reference point at the angular velocity one of the parent.
    turn: [f64; 2],
    /// One, or zero if the body does not turn with its parent.
    rotates: f64,
    /// Inverse of the inertia of a free body.
    free: ArticulatedInertia,
}

/// Factorized mass matrix of a tree.
#[derive(Clone, Debug)]
pub(crate) struct Articulated {
    nodes: Vec<NodeFactor>,
    inertias: Vec<ArticulatedInertia>,
    /// Of bodies in space.
    space: Articulated3,
    /// Inverse masses of single coordinates.
    singles: Vec<f64>,
}

/// Inertias of all bodies in a position.
pub(crate) struct TreeInertias<'a> {
    /// Of bodies in the plane.
    pub plane: &'a [ArticulatedInertia],
    /// Of bodies in space.
    pub space: &'a [Inertia3],
    /// Constant masses by coordinate, of coordinates that belong to no body.
    pub coordinates: &'a [f64],
}

/// Workspace of solutions with `W` right-hand sides.
#[derive(Clone, Debug, Default)]
pub(crate) struct ArticulatedWorkspace<const W: usize> {
    plane: Vec<[[f64; W]; 3]>,
    space: Vec<[[f64; W]; 6]>,
}

/// I · (x, y, θ).
#[inline(always)]
fn times([xx, xy, yy, xt, yt, tt]: ArticulatedInertia, [x, y, t]: [f64; 3]) -> [f64; 3] {
    [xx * x + xy * y + xt * t, xy * x + yy * y + yt * t, xt * x + yt * y + tt * t]
}

impl Articulated {
    /// Storage for `tree`, with the masses of its single coordinates.
    pub fn new(tree: &Tree, singles: &[f64]) -> Self {
        Self {
            nodes: vec![NodeFactor::default(); tree.nodes.len()],
            inertias: vec![[0.0; 6]; tree.nodes.len()],
            space: Articulated3::new(&tree.space),
            singles: singles.iter().map(|mass| 1.0 / mass).collect(),
        }
    }

    /// Factorizes the mass matrix for the `inertias` of the bodies, in the position with this `geometry` and the joint coordinates `q`.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming a joint coordinate that moves no mass.
    pub fn factorize(
        &mut self,
        tree: &Tree,
        inertias: &TreeInertias<'_>,
        geometry: &TreeGeometry<f64>,
        q: &[f64],
        t: f64,
    ) -> Result<()> {
        let in_space = self.space.factorize(&tree.space, inertias.space, &geometry.placed, q, inertias.coordinates);
        in_space.map_err(|coordinate| singular(tree, coordinate, t))?;
        self.inertias.copy_from_slice(inertias.plane);
        for k in (0..tree.nodes.len()).rev() {
            let (node, levers, factor) = (&tree.nodes[k], &geometry.levers[k], &mut self.nodes[k]);
            let mut inertia = self.inertias[k];
            factor.rotates = 1.0;
            match node.joint {
                Joint::Free { is_free } => {
                    let inverse = inverse(inertia, is_free);
                    factor.free = inverse.ok_or_else(|| singular(tree, node.first, t))?;
                    continue;
                }
                Joint::Revolute => {
                    let [x, y] = turned(levers.child);
                    factor.direction = [-x, -y, 1.0];
                }
                Joint::Prismatic => factor.direction = [levers.axis[0], levers.axis[1], 0.0],
                Joint::Pin => factor.rotates = 0.0,
                Joint::Fixed => {}
            }
            if let Joint::Revolute | Joint::Prismatic = node.joint {
                let [x, y, t_direction] = factor.direction;
                let force = times(inertia, factor.direction);
                let stiffness = x * force[0] + y * force[1] + t_direction * force[2];
                if !(stiffness > 0.0 && stiffness.is_finite()) {
                    return Err(singular(tree, node.first, t));
                }
                let inverse = 1.0 / stiffness;
                let [fx, fy, ft] = force;
                let [gx, gy, gt] = force.map(|f| f * inverse);
                inertia[0] -= fx * gx;
                inertia[1] -= fx * gy;
                inertia[2] -= fy * gy;
                inertia[3] -= fx * gt;
                inertia[4] -= fy * gt;
                inertia[5] -= ft * gt;
                (factor.force, factor.inverse) = (force, inverse);
            }
            let turn = turned(if node.joint == Joint::Pin { levers.parent } else { levers.between() });
            factor.turn = turn;
            if let Some(parent) = node.parent_node {
                // A motion (x, y, θ) of the parent moves the body by (x, y) + turn θ and by rotates θ.
                let [fx, fy, ft] = times(inertia, [turn[0], turn[1], factor.rotates]);
                let to = &mut self.inertias[parent];
                to[0] += inertia[0];
                to[1] += inertia[1];
                to[2] += inertia[2];
                to[3] += fx;
                to[4] += fy;
                to[5] += turn[0] * fx + turn[1] * fy + factor.rotates * ft;
            }
        }
        match self.singles.iter().position(|inverse| !(*inverse > 0.0 && inverse.is_finite())) {
            Some(k) => Err(singular(tree, tree.first_single + k, t)),
            None => Ok(()),
        }
    }

    /// Solves A x = b in place, where row i of `b` belongs to the joint coordinate i.
    #[inline(always)]
    pub fn solve<const W: usize>(&self, tree: &Tree, b: &mut [[f64; W]], workspace: &mut ArticulatedWorkspace<W>) {
        self.space.solve(&tree.space, b, &mut workspace.space);
        let (zero, work) = ([0.0; W], &mut workspace.plane);
        work.clear();
        work.resize(tree.nodes.len(), [zero; 3]);
        // Inwards: forces that subtrees exert on their parents.
        for (k, (node, factor)) in tree.nodes.iter().zip(&self.nodes).enumerate().rev() {
            let mut p = work[k];
            match node.joint {
                Joint::Free { .. } => continue,
                Joint::Revolute | Joint::Prismatic => {
                    let row = &mut b[node.first];
                    for lane in 0..W {
                        let [x, y, t] = factor.direction;
                        let free = row[lane] - x * p[0][lane] - y * p[1][lane] - t * p[2][lane];
                        row[lane] = free;
                        for i in 0..3 {
                            p[i][lane] += factor.force[i] * factor.inverse * free;
                        }
                    }
                }
                Joint::Pin | Joint::Fixed => {}
            }
            if let Some(parent) = node.parent_node {
                let to = &mut work[parent];
                for lane in 0..W {
                    let [x, y, t] = [p[0][lane], p[1][lane], p[2][lane]];
                    to[0][lane] += x;
                    to[1][lane] += y;
                    to[2][lane] += factor.turn[0] * x + factor.turn[1] * y + factor.rotates * t;
                }
            }
        }
        // Outwards: motions of the bodies.
        for (k, (node, factor)) in tree.nodes.iter().zip(&self.nodes).enumerate() {
            if let Joint::Free { is_free } = node.joint {
                let mut motion = [zero; 3];
                for lane in 0..W {
                    let mut force = [0.0; 3];
                    let mut at = node.first;
                    for i in (0..3).filter(|&i| is_free[i]) {
                        force[i] = b[at][lane] - work[k][i][lane];
                        at += 1;
                    }
                    let solution = times(factor.free, force);
                    at = node.first;
                    for i in (0..3).filter(|&i| is_free[i]) {
                        b[at][lane] = solution[i];
                        motion[i][lane] = solution[i];
                        at += 1;
                    }
                }
                work[k] = motion;
                continue;
            }
            let parent = node.parent_node.map_or([zero; 3], |parent| work[parent]);
            let mut motion = [zero; 3];
            for lane in 0..W {
                let turn = parent[2][lane];
                motion[0][lane] = parent[0][lane] + factor.turn[0] * turn;
                motion[1][lane] = parent[1][lane] + factor.turn[1] * turn;
                motion[2][lane] = factor.rotates * turn;
            }
            if let Joint::Revolute | Joint::Prismatic = node.joint {
                let row = &mut b[node.first];
                for lane in 0..W {
                    let [fx, fy, ft] = factor.force;
                    let carried = fx * motion[0][lane] + fy * motion[1][lane] + ft * motion[2][lane];
                    row[lane] = (row[lane] - carried) * factor.inverse;
                    for i in 0..3 {
                        motion[i][lane] += factor.direction[i] * row[lane];
                    }
                }
            }
            work[k] = motion;
        }
        for (row, inverse) in b[tree.first_single..].iter_mut().zip(&self.singles) {
            row.iter_mut().for_each(|x| *x *= inverse);
        }
    }
}

/// The inverse of a symmetric inertia in the directions that are free; zero in the others. `None` if it is not positive definite.
fn inverse(inertia: ArticulatedInertia, is_free: [bool; 3]) -> Option<ArticulatedInertia> {
    // Gauss–Jordan elimination of the free directions, in place.
    let [xx, xy, yy, xt, yt, tt] = inertia;
    let mut m = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
    for i in 0..3 {
        for j in 0..3 {
            if !(is_free[i] && is_free[j]) {
                m[i][j] = f64::from(u8::from(i == j));
            }
        }
    }
    let mut inverse = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for k in 0..3 {
        let pivot = m[k][k];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        for j in 0..3 {
            m[k][j] /= pivot;
            inverse[k][j] /= pivot;
        }
        for i in (0..3).filter(|&i| i != k) {
            let factor = m[i][k];
            for j in 0..3 {
                m[i][j] -= factor * m[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            if !(is_free[i] && is_free[j]) {
                inverse[i][j] = 0.0;
            }
        }
    }
    let [[xx, xy, xt], [_, yy, yt], [_, _, tt]] = inverse;
    Some([xx, xy, yy, xt, yt, tt])
}

/// The error of a joint coordinate that moves no mass.
fn singular(tree: &Tree, coordinate: usize, t: f64) -> Error {
    let why = format!("the equations are singular at t = {t}: it moves no mass", t = Seconds(t));
    Error::analysis(&tree.names[coordinate], why, "give the bodies that it moves mass and inertia")
}
