//! The articulated-body recursion of a tree in space: factorization of its mass matrix, and solutions with it, in O(n).
//!
//! The coordinates of a joint are eliminated one by one, as those of a chain of bodies without mass. Three of them are the components
//! of an angular velocity for Euler parameters e; the solution for these is ½ Eᵀ α and a part along e.
//!
//! # Sources
//!
//! Featherstone, *Rigid Body Dynamics Algorithms* (2008), Chapter 7.

use crate::mechanism::rotation::{e_times, e_transposed_times, square};
use crate::mechanism::vector::{cross, product};
use crate::tree::space::joint::Joint3;
use crate::tree::space::placed::{PlacedBody, Twist};
use crate::tree::space::rigid::RigidProperties;
use crate::tree::space::topology::{Node3, Slot, Space};

/// Inertia of a body about its reference point, in world axes: moment = rotation·α + coupling·a, force = couplingᵀ·α + mass·a.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inertia3 {
    rotation: [[f64; 3]; 3],
    coupling: [[f64; 3]; 3],
    mass: [[f64; 3]; 3],
}

/// One eliminated joint coordinate.
#[derive(Clone, Copy, Debug, Default)]
struct EliminatedCoordinate {
    /// Motion of the body at the rate one.
    direction: Twist<f64>,
    /// U = I s.
    force: Twist<f64>,
    /// 1/D.
    inverse: f64,
}

/// Factors of one body.
#[derive(Clone, Copy, Debug, Default)]
struct NodeFactor3 {
    /// From the reference point of the parent: to that of the body, or to the joint's point of a body that does not turn with it.
    lever: [f64; 3],
    /// Euler parameters of the joint or of the free body.
    e: [f64; 4],
}

/// Factorized mass matrix of the trees in space.
#[derive(Clone, Debug, Default)]
pub(crate) struct Articulated3 {
    nodes: Vec<NodeFactor3>,
    columns: Vec<EliminatedCoordinate>,
    inertias: Vec<Inertia3>,
}

impl Inertia3 {
    /// Adds a rigid body.
    pub fn add_rigid(&mut self, body: &RigidProperties<f64>, rotation: &[[f64; 3]; 3]) {
        let (m, c) = (body.mass, product(rotation, body.centre));
        let square = m * (c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
        let half: [[f64; 3]; 3] = [0, 1, 2].map(|i| {
            let row = rotation[i];
            [0, 1, 2].map(|k| (0..3).map(|j| row[j] * body.inertia[j][k]).sum())
        });
        for i in 0..3 {
            for k in 0..3 {
                let own: f64 = (0..3).map(|j| half[i][j] * rotation[k][j]).sum();
                self.rotation[i][k] += own - m * c[i] * c[k];
            }
            self.rotation[i][i] += square;
            self.mass[i][i] += m;
        }
        let [x, y, z] = c.map(|x| m * x);
        for (i, k, value) in [(0, 1, -z), (0, 2, y), (1, 0, z), (1, 2, -x), (2, 0, -y), (2, 1, x)] {
            self.coupling[i][k] += value;
        }
    }

    /// I · (α, a).
    #[inline(always)]
    pub fn times(&self, x: &Twist<f64>) -> Twist<f64> {
        std::array::from_fn(|i| match i {
            0..3 => (0..3).map(|k| self.rotation[i][k] * x[k] + self.coupling[i][k] * x[3 + k]).sum(),
            _ => (0..3).map(|k| self.coupling[k][i - 3] * x[k] + self.mass[i - 3][k] * x[3 + k]).sum(),
        })
    }

    /// I −= factor · u uᵀ.
    #[inline(always)]
    fn reduce(&mut self, u: &Twist<f64>, factor: f64) {
        for i in 0..3 {
            let (a, b) = (u[i] * factor, u[3 + i] * factor);
            for k in 0..3 {
                self.rotation[i][k] -= a * u[k];
                self.coupling[i][k] -= a * u[3 + k];
                self.mass[i][k] -= b * u[3 + k];
            }
        }
    }

    /// Adds the inertia `other` of a body whose reference point is at `p` relative to this one.
    #[inline(always)]
    fn add_shifted(&mut self, other: &Self, p: [f64; 3]) {
        // a_p = a − p × α: with the matrix P of p ×, the coupling becomes B + P C and the rotation A + P Bᵀ + (P Bᵀ)ᵀ + P C Pᵀ.
        let columns = |m: &[[f64; 3]; 3]| [0, 1, 2].map(|k| cross(p, [m[0][k], m[1][k], m[2][k]]));
        let pc = columns(&other.mass);
        let bt = [0, 1, 2].map(|i| [0, 1, 2].map(|k| other.coupling[k][i]));
        let pb = columns(&bt);
        let rows_pc = [0, 1, 2].map(|i| [0, 1, 2].map(|k| pc[k][i]));
        for i in 0..3 {
            let pcp = cross(p, rows_pc[i]);
            for k in 0..3 {
                self.rotation[i][k] += other.rotation[i][k] + pb[k][i] + pb[i][k] + pcp[k];
                self.coupling[i][k] += other.coupling[i][k] + pc[k][i];
                self.mass[i][k] += other.mass[i][k];
            }
        }
    }
}

impl Articulated3 {
    /// Storage for the trees of `space`.
    pub fn new(space: &Space) -> Self {
        let nodes = space.nodes.len();
        Self {
            nodes: vec![NodeFactor3::default(); nodes],
            columns: Vec::with_capacity(space.count),
            inertias: vec![Inertia3::default(); nodes],
        }
    }

    /// Factorizes the mass matrix for the `inertias` of the bodies at the joint coordinates `q`. `masses` are those of elements that act
    /// on coordinates of joints, by coordinate. Returns the number of a joint coordinate that moves no mass, if there is one.
    pub fn factorize(
        &mut self,
        space: &Space,
        inertias: &[Inertia3],
        placed: &[PlacedBody<f64>],
        q: &[f64],
        masses: &[f64],
    ) -> std::result::Result<(), usize> {
        self.inertias.copy_from_slice(inertias);
        self.columns.clear();
        for (k, node) in space.nodes.iter().enumerate().rev() {
            let body = &placed[k];
            let mut inertia = self.inertias[k];
            let (factor, whole) = (&mut self.nodes[k], self.inertias[k]);
            let mut is_first = true;
            let mut eliminate = |direction: Twist<f64>, extra: f64, at: usize| {
                let force = inertia.times(&direction);
                let stiffness = extra + product_of(&direction, &force);
                let is_first = std::mem::replace(&mut is_first, false);
                let size = if is_first { stiffness } else { extra + product_of(&direction, &whole.times(&direction)) };
                if !(stiffness > ROUNDING * size && stiffness > 0.0 && stiffness.is_finite()) {
                    return Err(at);
                }
                let inverse = 1.0 / stiffness;
                inertia.reduce(&force, inverse);
                self.columns.push(EliminatedCoordinate { direction, force, inverse });
                Ok(())
            };
            match node.joint {
                Joint3::Free { moves, turns } => {
                    factor.e = body.e;
                    for (number, i) in (0..3).filter(|&i| moves[i]).enumerate() {
                        eliminate(unit(3 + i), 0.0, node.first + number)?;
                    }
                    if turns {
                        let first = node.first + moves.iter().filter(|x| **x).count();
                        (0..3).try_for_each(|i| eliminate(unit(i), 0.0, first))?;
                    }
                    continue;
                }
                Joint3::Spherical => {
                    factor.e.copy_from_slice(&q[node.first..node.first + 4]);
                    body.columns.iter().try_for_each(|column| eliminate(*column, 0.0, node.first))?;
                }
                _ => {
                    for (k, (slot, column)) in node.slots.iter().zip(&body.columns).enumerate() {
                        if let Slot::Free(at) = *slot {
                            let own = node.attached.iter().filter(|attached| attached.slot == k);
                            eliminate(*column, own.map(|attached| masses[attached.coordinate]).sum(), at)?;
                        }
                    }
                }
            }
            factor.lever = body.lever;
            if node.joint == Joint3::Pin {
                factor.lever = body.arm;
                (inertia.rotation, inertia.coupling) = Default::default();
            }
            if let Some(parent) = node.parent_node {
                self.inertias[parent].add_shifted(&inertia, factor.lever);
            }
        }
        Ok(())
    }

    /// Solves A x = b in place, where row i of `b` belongs to the joint coordinate i. `work` is a workspace.
    #[inline(always)]
    pub fn solve<const W: usize>(&self, space: &Space, b: &mut [[f64; W]], work: &mut Vec<[[f64; W]; 6]>) {
        let zero = [0.0; W];
        work.clear();
        work.resize(space.nodes.len(), [zero; 6]);
        let mut next = 0;
        // Inwards: forces that subtrees exert on their parents.
        for (k, node) in space.nodes.iter().enumerate().rev() {
            let (factor, mut p) = (&self.nodes[k], work[k]);
            let rows = JointRows::of(node);
            if let Some(first) = rows.quaternion {
                to_moments(&factor.e, &mut b[first..first + 4]);
            }
            for at in rows.eliminated() {
                let EliminatedCoordinate { direction, force, inverse } = &self.columns[next];
                next += 1;
                let row = &mut b[at];
                for lane in 0..W {
                    let mut free = row[lane];
                    for i in 0..6 {
                        free -= direction[i] * p[i][lane];
                    }
                    row[lane] = free;
                    let gain = free * inverse;
                    for i in 0..6 {
                        p[i][lane] += force[i] * gain;
                    }
                }
            }
            work[k] = p;
            if let Some(parent) = node.parent_node {
                let (to, [x, y, z]) = (&mut work[parent], factor.lever);
                let turns = if node.joint == Joint3::Pin { 0.0 } else { 1.0 };
                for lane in 0..W {
                    let f = [p[3][lane], p[4][lane], p[5][lane]];
                    to[0][lane] += p[0][lane] * turns + y * f[2] - z * f[1];
                    to[1][lane] += p[1][lane] * turns + z * f[0] - x * f[2];
                    to[2][lane] += p[2][lane] * turns + x * f[1] - y * f[0];
                    for i in 0..3 {
                        to[3 + i][lane] += f[i];
                    }
                }
            }
        }
        // Outwards: motions of the bodies.
        for (k, node) in space.nodes.iter().enumerate() {
            let (factor, mut motion) = (&self.nodes[k], [zero; 6]);
            if let Some(parent) = node.parent_node {
                let (from, [x, y, z]) = (&work[parent], factor.lever);
                let turns = if node.joint == Joint3::Pin { 0.0 } else { 1.0 };
                for lane in 0..W {
                    let w = [from[0][lane], from[1][lane], from[2][lane]];
                    motion[3][lane] = from[3][lane] + w[1] * z - w[2] * y;
                    motion[4][lane] = from[4][lane] + w[2] * x - w[0] * z;
                    motion[5][lane] = from[5][lane] + w[0] * y - w[1] * x;
                    for i in 0..3 {
                        motion[i][lane] = w[i] * turns;
                    }
                }
            }
            let rows = JointRows::of(node);
            for at in rows.eliminated().rev() {
                next -= 1;
                let EliminatedCoordinate { direction, force, inverse } = &self.columns[next];
                let row = &mut b[at];
                for lane in 0..W {
                    let mut rest = row[lane];
                    for i in 0..6 {
                        rest -= force[i] * motion[i][lane];
                    }
                    let rate = rest * inverse;
                    row[lane] = rate;
                    for i in 0..6 {
                        motion[i][lane] += direction[i] * rate;
                    }
                }
            }
            if let Some(first) = rows.quaternion {
                to_rates(&factor.e, &mut b[first..first + 4]);
            }
            work[k] = motion;
        }
    }
}

/// Inertia of a joint coordinate, relative to its sum before the elimination of the others, that counts as rounding error.
const ROUNDING: f64 = 1e-14;

#[inline(always)]
fn product_of(a: &Twist<f64>, b: &Twist<f64>) -> f64 {
    (0..6).map(|i| a[i] * b[i]).sum()
}

fn unit(i: usize) -> Twist<f64> {
    std::array::from_fn(|k| f64::from(u8::from(k == i)))
}

/// The rows of the joint coordinates of a node.
struct JointRows {
    /// Rows of angles and displacements, and the number of them.
    scalars: [usize; 6],
    count: usize,
    /// First row of Euler parameters.
    quaternion: Option<usize>,
}

impl JointRows {
    #[inline(always)]
    fn of(node: &Node3) -> Self {
        let (mut scalars, mut count, mut quaternion) = ([0; 6], 0, None);
        let mut add = |at: usize| {
            scalars[count] = at;
            count += 1;
        };
        match node.joint {
            Joint3::Free { moves, turns } => {
                let free = moves.iter().filter(|moves| **moves).count();
                (0..free).for_each(|k| add(node.first + k));
                quaternion = turns.then_some(node.first + free);
            }
            Joint3::Spherical => quaternion = Some(node.first),
            _ => node.slots.iter().for_each(|slot| {
                if let Slot::Free(at) = *slot {
                    add(at);
                }
            }),
        }
        if let Some(first) = quaternion {
            (0..3).for_each(|k| add(first + k));
        }
        Self { scalars, count, quaternion }
    }

    /// Rows in the order of elimination; those of Euler parameters are three moments.
    #[inline(always)]
    fn eliminated(&self) -> impl DoubleEndedIterator<Item = usize> + '_ {
        self.scalars[..self.count].iter().copied()
    }
}

/// Rows of Euler parameters become three moments ½ E r, and the part e·r/|e|⁴ along e.
#[inline(always)]
fn to_moments<const W: usize>(e: &[f64; 4], rows: &mut [[f64; W]]) {
    let inverse = 1.0 / (square(e) * square(e));
    for lane in 0..W {
        let r = [0, 1, 2, 3].map(|k| rows[k][lane]);
        let moment = e_times(e, &r);
        for k in 0..3 {
            rows[k][lane] = 0.5 * moment[k];
        }
        rows[3][lane] = (e[0] * r[0] + e[1] * r[1] + e[2] * r[2] + e[3] * r[3]) * inverse;
    }
}

/// Three components of an angular acceleration and the part along e become ½ Eᵀ α + e s.
#[inline(always)]
fn to_rates<const W: usize>(e: &[f64; 4], rows: &mut [[f64; W]]) {
    for lane in 0..W {
        let alpha = [0, 1, 2].map(|k| rows[k][lane]);
        let (own, along) = (e_transposed_times(e, alpha), rows[3][lane]);
        for k in 0..4 {
            rows[k][lane] = 0.5 * own[k] + e[k] * along;
        }
    }
}
