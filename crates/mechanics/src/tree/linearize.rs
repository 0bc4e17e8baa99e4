//! Directional derivatives of a tree at one stage: the derivatives of each joint with respect to its two bodies, which all design variables
//! share, and the sweeps that apply them to several design variables at a time.
//!
//! With the levers $p$ and $c$ of a joint in its parent and its body, and $\hat r$ for r turned by 90°, the tip of a lever has the
//! acceleration $\Lambda_r = \dot\omega\,\hat r - \omega^2 r$. A change of the motion at fixed accelerations of the joint coordinates is
//!
//! $$ \delta\ddot x = \delta\ddot x_p + \Lambda_{\delta p} - 2\omega_p p\,\delta\omega_p + \hat p\,\delta\dot\omega_p -
//!    \Lambda_{\delta c} + 2\omega_c c\,\delta\omega_c - \hat c\,\delta\dot\omega_c $$
//!
//! $$ \delta p = \hat p\,\delta\theta_p + R_p\,\delta b ,\quad \delta c = \hat c\,\delta\theta_c + R_c\,\delta b $$
//!
//! and the rows of the joints change with the wrenches and with the levers of the wrenches F of the motion. Nothing is
//! evaluated in dual numbers, and sines and cosines are computed once for all design variables.

use crate::linalg::simd::Gradient;
use crate::linalg::simd::rows;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Dual8;
use crate::system::state::State;
use crate::tree::articulated::ArticulatedInertia;
use crate::tree::dynamics::{TreeDynamics, TreeResidual};
use crate::tree::joint::TreeBody;
use crate::tree::joint::{Joint, JointParameters, Levers, dot, rotated, turned};
use crate::tree::topology::Tree;
use autodiff::WIDTH;
use pulp::{Scalar, Simd};

/// Derivatives of one joint at a stage.
#[derive(Clone, Copy, Debug)]
struct JointLinearization {
    levers: Levers<f64>,
    /// Angular velocities and accelerations of the parent and of the body.
    spins: [f64; 2],
    turns: [f64; 2],
    /// Displacement, speed and acceleration of a prismatic joint.
    slide: [f64; 3],
    /// Derivatives with respect to the rotations of parent and body: of the body's position, velocity and acceleration.
    by_rotations: [[[f64; 2]; 2]; 3],
    /// Those with respect to their angular velocities: of velocity and acceleration.
    by_spins: [[[f64; 2]; 2]; 2],
    /// Of a prismatic joint, with respect to the direction of its line and to the displacement: of position, velocity, acceleration.
    by_direction: [[f64; 2]; 3],
    by_displacement: [[f64; 2]; 3],
    /// Force of the wrench of the subtree that begins with the body.
    force: [f64; 2],
}

/// r times a number.
#[inline(always)]
fn scaled([x, y]: [f64; 2], by: f64) -> [f64; 2] {
    [x * by, y * by]
}

#[inline(always)]
fn plus([x, y]: [f64; 2], [u, v]: [f64; 2]) -> [f64; 2] {
    [x + u, y + v]
}

/// Acceleration of the tip of a lever: ω̇ r̂ − ω² r.
#[inline(always)]
fn carried(r: [f64; 2], spin: f64, turn: f64) -> [f64; 2] {
    plus(scaled(turned(r), turn), scaled(r, -spin * spin))
}

impl JointLinearization {
    fn zero() -> Self {
        let pair = [[0.0; 2]; 2];
        Self {
            levers: Levers::zero(),
            spins: [0.0; 2],
            turns: [0.0; 2],
            slide: [0.0; 3],
            by_rotations: [pair; 3],
            by_spins: [pair; 2],
            by_direction: [[0.0; 2]; 3],
            by_displacement: [[0.0; 2]; 3],
            force: [0.0; 2],
        }
    }

    fn new(node: &TreeBody, levers: Levers<f64>, state: &State<f64>, slide: [f64; 3], wrenches: &[f64]) -> Self {
        let [pt, ct] = [node.parent[2], node.coordinates[2]];
        let ([spin, child_spin], [turn, child_turn]) = ([state.v[pt], state.v[ct]], [state.a[pt], state.a[ct]]);
        let Levers { base, parent, child, axis, .. } = levers;
        let [base_turned, child_turned] = [turned(base), turned(child)];
        let mut joint = Self {
            levers,
            spins: [spin, child_spin],
            turns: [turn, child_turn],
            slide,
            by_rotations: [
                [base_turned, scaled(child_turned, -1.0)],
                [scaled(base, -spin), scaled(child, child_spin)],
                [carried(base_turned, spin, turn), scaled(carried(child_turned, child_spin, child_turn), -1.0)],
            ],
            by_spins: [
                [turned(parent), scaled(child_turned, -1.0)],
                [scaled(parent, -2.0 * spin), scaled(child, 2.0 * child_spin)],
            ],
            force: [wrenches[node.coordinates[0]], wrenches[node.coordinates[1]]],
            ..Self::zero()
        };
        if node.joint == Joint::Prismatic {
            let ([displacement, speed, acceleration], sideways) = (slide, turned(axis));
            joint.by_spins[1][0] = plus(joint.by_spins[1][0], scaled(sideways, 2.0 * speed));
            joint.by_displacement = [axis, scaled(sideways, spin), carried(axis, spin, turn)];
            let moved = scaled(sideways, displacement);
            joint.by_direction = [
                moved,
                plus(scaled(turned(moved), spin), scaled(sideways, speed)),
                plus(
                    carried(moved, spin, turn),
                    plus(scaled(sideways, acceleration), scaled(axis, -2.0 * spin * speed)),
                ),
            ];
        }
        joint
    }
}

/// Derivatives of a joint's parameters with respect to `W` design variables.
#[derive(Clone, Debug)]
struct JointGradients<const W: usize> {
    parent: [Gradient<W>; 2],
    child: [Gradient<W>; 2],
    line: Gradient<W>,
    angle: Gradient<W>,
    /// False if all are zero.
    is_active: bool,
}

/// Derivatives of the masses, and of the joints' parameters, with respect to `W` design variables.
#[derive(Clone, Debug)]
pub(crate) struct TreeGradients<const W: usize> {
    joints: Vec<JointGradients<W>>,
    /// Coordinate, and the derivatives of its mass or moment of inertia and of its weight, where they are not zero.
    masses: Vec<(usize, Gradient<W>, Gradient<W>)>,
}

impl<const W: usize> TreeGradients<W> {
    /// Derivatives from `chunks` of [`WIDTH`] design variables.
    pub fn new(tree: &Tree, chunks: &[Mechanism<Dual8>]) -> Self {
        let parameters: Vec<Vec<JointParameters<Dual8>>> =
            chunks.iter().map(|chunk| tree.parameters(chunk).plane).collect();
        let residuals: Vec<_> = chunks.iter().map(|chunk| TreeResidual::new(tree, chunk)).collect();
        let joined = |of: &dyn Fn(usize) -> Dual8| {
            let mut all = [0.0; W];
            (0..chunks.len()).for_each(|c| all[c * WIDTH..(c + 1) * WIDTH].copy_from_slice(&of(c).eps));
            all
        };
        let joint = |k: usize| {
            let mut joint = JointGradients {
                parent: [0, 1].map(|i| joined(&|c| parameters[c][k].parent[i])),
                child: [0, 1].map(|i| joined(&|c| parameters[c][k].child[i])),
                line: joined(&|c| parameters[c][k].line),
                angle: joined(&|c| parameters[c][k].angle),
                is_active: false,
            };
            let all = joint.parent.iter().chain(&joint.child).chain([&joint.line, &joint.angle]);
            joint.is_active = all.flatten().any(|x| *x != 0.0);
            joint
        };
        let coordinates = chunks.first().map_or(0, |chunk| chunk.coordinates.len());
        let mass = |i: usize| (i, joined(&|c| residuals[c].masses[i]), joined(&|c| residuals[c].weights[i]));
        let is_active =
            |(_, mass, weight): &(usize, Gradient<W>, Gradient<W>)| mass.iter().chain(weight).any(|x| *x != 0.0);
        Self {
            joints: (0..tree.nodes.len()).map(joint).collect(),
            masses: (0..coordinates).map(mass).filter(is_active).collect(),
        }
    }
}

/// Derivatives of the reference point of a body.
struct PointGradients<const W: usize> {
    position: [Gradient<W>; 2],
    velocity: [Gradient<W>; 2],
    acceleration: [Gradient<W>; 2],
}

impl<const W: usize> PointGradients<W> {
    /// Adds those by the points of the joint in its parent and in the body.
    #[inline(always)]
    fn add_levers(&mut self, joint: &JointLinearization, gradients: &JointGradients<W>) {
        let levers = [(&gradients.parent, 1.0), (&gradients.child, -1.0)];
        for (k, (parameter, sign)) in levers.into_iter().enumerate() {
            let lever = rotated_pair(joint.levers.rotations[k], parameter);
            let (spin, turn) = (joint.spins[k], joint.turns[k]);
            add_turned(&mut self.acceleration, sign * turn, &lever);
            add_turned(&mut self.velocity, sign * spin, &lever);
            for i in 0..2 {
                add(&mut self.acceleration[i], -sign * spin * spin, &lever[i]);
                add(&mut self.position[i], sign, &lever[i]);
            }
        }
    }

    /// Adds those by the `direction` of the line of a prismatic joint, and by its displacement, speed and acceleration.
    #[inline(always)]
    fn add_slide(
        &mut self,
        joint: &JointLinearization,
        direction: &Gradient<W>,
        [displacement, speed, acceleration]: [&Gradient<W>; 3],
    ) {
        let axis = joint.levers.axis;
        let all = [&mut self.position, &mut self.velocity, &mut self.acceleration];
        for (k, out) in all.into_iter().enumerate() {
            add_pair(out, joint.by_direction[k], direction);
            add_pair(out, joint.by_displacement[k], displacement);
        }
        add_pair(&mut self.velocity, axis, speed);
        add_pair(&mut self.acceleration, scaled(turned(axis), 2.0 * joint.spins[0]), speed);
        add_pair(&mut self.acceleration, axis, acceleration);
    }
}

/// A tree linearized at one stage.
#[derive(Clone, Debug)]
pub(crate) struct TreeLinearization {
    joints: Vec<JointLinearization>,
    inertias: Vec<ArticulatedInertia>,
    /// Accelerations of all coordinates.
    accelerations: Vec<f64>,
    /// True if the forces on the bodies depend on their positions or velocities.
    has_forces: bool,
    /// True if a prescribed coordinate moves.
    has_turns: bool,
}

/// Derivatives of all coordinates with respect to `W` design variables.
pub(crate) struct Directions<'a, const W: usize> {
    /// Joint coordinates, followed by their velocities.
    pub y: &'a [Gradient<W>],
    /// Accelerations of the joint coordinates, or `None` if they are fixed.
    pub a: Option<&'a [Gradient<W>]>,
}

/// x += factor · y.
#[inline(always)]
fn add<const W: usize>(x: &mut Gradient<W>, factor: f64, y: &Gradient<W>) {
    for (x, y) in x.iter_mut().zip(y) {
        *x += factor * y;
    }
}

/// x += y.
#[inline(always)]
fn accumulate<const W: usize>(x: &mut Gradient<W>, y: &Gradient<W>) {
    for (x, y) in x.iter_mut().zip(y) {
        *x += y;
    }
}

/// x += a · y for both components of a vector.
#[inline(always)]
fn add_pair<const W: usize>(x: &mut [Gradient<W>; 2], a: [f64; 2], y: &Gradient<W>) {
    add(&mut x[0], a[0], y);
    add(&mut x[1], a[1], y);
}

/// x += factor · r turned by 90°.
#[inline(always)]
fn add_turned<const W: usize>(x: &mut [Gradient<W>; 2], factor: f64, r: &[Gradient<W>; 2]) {
    add(&mut x[0], -factor, &r[1]);
    add(&mut x[1], factor, &r[0]);
}

/// A body-fixed vector in the axes of the plane.
#[inline(always)]
fn rotated_pair<const W: usize>((sin, cos): (f64, f64), r: &[Gradient<W>; 2]) -> [Gradient<W>; 2] {
    let mut out = [[0.0; W]; 2];
    for lane in 0..W {
        let [x, y] = rotated((sin, cos), [r[0][lane], r[1][lane]]);
        (out[0][lane], out[1][lane]) = (x, y);
    }
    out
}

impl TreeLinearization {
    /// Storage for `tree`.
    pub fn new(tree: &Tree, dynamics: &TreeDynamics, mechanism: &Mechanism<f64>) -> Self {
        Self {
            joints: vec![JointLinearization::zero(); tree.nodes.len()],
            inertias: dynamics.inertias.clone(),
            accelerations: vec![0.0; mechanism.coordinates.len()],
            has_forces: !tree.forces.is_empty(),
            has_turns: !tree.moving.is_empty(),
        }
    }

    /// Linearizes at the stage for which `dynamics` has written `state`, by `placement` and `complete`.
    pub fn update(&mut self, dynamics: &TreeDynamics, (y, a): (&[f64], &[f64]), state: &State<f64>) {
        let tree = &dynamics.tree;
        self.accelerations.copy_from_slice(&state.a);
        for ((joint, node), levers) in self.joints.iter_mut().zip(&tree.nodes).zip(&dynamics.geometry.levers) {
            if let Joint::Free { .. } = node.joint {
                continue;
            }
            let slide = match node.joint {
                Joint::Prismatic => [y[node.first], y[tree.count + node.first], a[node.first]],
                _ => [0.0; 3],
            };
            *joint = JointLinearization::new(node, *levers, state, slide, &dynamics.rows);
        }
    }

    /// Writes the derivatives of all coordinates to `sources`, from the ground to the tips: positions, then velocities,
    /// then accelerations. Those of prescribed coordinates are given in `sources`. Positions x and y and their
    /// velocities are written only if `all` is true.
    #[inline(always)]
    pub fn place<S: Simd, const W: usize>(
        &self,
        simd: S,
        tree: &Tree,
        parameters: &TreeGradients<W>,
        directions: &Directions<'_, W>,
        all: bool,
        sources: &mut [Gradient<W>],
    ) {
        let (count, n, zero) = (tree.count, self.accelerations.len(), [0.0; W]);
        let (q, v) = directions.y.split_at(count);
        let acceleration = |k: usize| directions.a.map_or(zero, |a| a[k]);
        let has_turns = self.has_turns || directions.a.is_some();
        for ((node, joint), gradients) in tree.nodes.iter().zip(&self.joints).zip(&parameters.joints) {
            let ([px, py, pt], [cx, cy, ct]) = (node.parent, node.coordinates);
            if let Joint::Free { .. } = node.joint {
                for (k, i) in node.free_coordinates().enumerate() {
                    let k = node.first + k;
                    (sources[i], sources[n + i], sources[2 * n + i]) = (q[k], v[k], acceleration(k));
                }
                continue;
            }
            let [rotation, spin] = [pt, n + pt].map(|source| &sources[source]);
            let (base, base_spin) = match node.joint {
                Joint::Pin => (&sources[ct], &sources[n + ct]),
                _ => (rotation, spin),
            };
            let (by_angle, by_rate) = match node.joint {
                Joint::Revolute => (&q[node.first], &v[node.first]),
                Joint::Pin => (&zero, &zero),
                _ => (&gradients.angle, &zero),
            };
            let [parent_x, parent_y] = [px, py].map(|i| &sources[2 * n + i]);
            let [[from_parent, from_child], [by_spin, by_child_spin]] = [joint.by_rotations[2], joint.by_spins[1]];
            let inputs = [rotation, spin, base, base_spin, by_angle, by_rate, parent_x, parent_y];
            let [child_rotation, child_spin, along_x, along_y] =
                rows(simd, inputs, |[parent, parent_spin, base, base_spin, angle, rate, x, y]| {
                    let (own, own_spin) = (base + angle, base_spin + rate);
                    let sum = |i: usize| {
                        parent * from_parent[i]
                            + parent_spin * by_spin[i]
                            + own * from_child[i]
                            + own_spin * by_child_spin[i]
                    };
                    [own, own_spin, x + sum(0), y + sum(1)]
                });
            let mut change = [along_x, along_y];
            let [rotation, spin] = [*rotation, *spin];
            if has_turns {
                let turn = sources[2 * n + pt];
                let mut child_turn = if node.joint == Joint::Pin { sources[2 * n + ct] } else { turn };
                if node.joint == Joint::Revolute {
                    accumulate(&mut child_turn, &acceleration(node.first));
                }
                add_pair(&mut change, joint.by_spins[0][0], &turn);
                add_pair(&mut change, joint.by_spins[0][1], &child_turn);
                sources[2 * n + ct] = child_turn;
            } else {
                // That of the last outputs, for which the accelerations of the joint coordinates were not fixed.
                sources[2 * n + ct] = zero;
            }
            (sources[ct], sources[n + ct]) = (child_rotation, child_spin);
            let mut point = PointGradients { position: [zero; 2], velocity: [zero; 2], acceleration: change };
            if all {
                point.position = [sources[px], sources[py]];
                point.velocity = [sources[n + px], sources[n + py]];
                let rates = [(&rotation, &spin, 0), (&child_rotation, &child_spin, 1)];
                for (rotation, spin, k) in rates {
                    add_pair(&mut point.position, joint.by_rotations[0][k], rotation);
                    add_pair(&mut point.velocity, joint.by_rotations[1][k], rotation);
                    add_pair(&mut point.velocity, joint.by_spins[0][k], spin);
                }
            }
            if gradients.is_active {
                point.add_levers(joint, gradients);
            }
            if node.joint == Joint::Prismatic {
                let own = [&q[node.first], &v[node.first], &acceleration(node.first)];
                point.add_slide(joint, &direction(node, gradients, sources), own);
            }
            [sources[2 * n + cx], sources[2 * n + cy]] = point.acceleration;
            if all {
                [sources[cx], sources[cy]] = point.position;
                [sources[n + cx], sources[n + cy]] = point.velocity;
            }
        }
        for (k, &i) in tree.singles.iter().enumerate() {
            let k = tree.first_single + k;
            (sources[i], sources[n + i], sources[2 * n + i]) = (q[k], v[k], acceleration(k));
        }
    }

    /// Writes the negative derivatives of the rows of the joints to `out`, from the tips to the ground. `wrenches` has
    /// the derivatives of the forces on the bodies; on return it has those of the wrenches of the subtrees.
    #[inline(always)]
    pub fn collect<S: Simd, const W: usize>(
        &self,
        simd: S,
        tree: &Tree,
        parameters: &TreeGradients<W>,
        (directions, sources): (&Directions<'_, W>, &[Gradient<W>]),
        wrenches: &mut [Gradient<W>],
        out: &mut [Gradient<W>],
    ) {
        for (i, mass, weight) in &parameters.masses {
            add(&mut wrenches[*i], self.accelerations[*i], mass);
            accumulate(&mut wrenches[*i], weight);
        }
        let (n, zero) = (self.accelerations.len(), [0.0; W]);
        for (k, (node, joint)) in tree.nodes.iter().zip(&self.joints).enumerate().rev() {
            let ([x, y, t], gradients) = (node.coordinates, &parameters.joints[k]);
            let [ax, ay, at] = [x, y, t].map(|i| &sources[2 * n + i]);
            let [row_x, row_y, row_t] = [x, y, t].map(|i| &wrenches[i]);
            let [xx, xy, yy, xt, yt, tt] = self.inertias[k];
            let [fx, fy, moment] = rows(simd, [ax, ay, at, row_x, row_y, row_t], |[ax, ay, at, x, y, t]| {
                [x + ax * xx + ay * xy + at * xt, y + ax * xy + ay * yy + at * yt, t + ax * xt + ay * yt + at * tt]
            });
            [wrenches[x], wrenches[y], wrenches[t]] = [fx, fy, moment];
            if let Joint::Free { .. } = node.joint {
                for (k, i) in node.free_coordinates().enumerate() {
                    out[node.first + k] = wrenches[i].map(|x| -x);
                }
                continue;
            }
            let [px, py, pt] = node.parent;
            let (moment, force) = (joint.moment(simd, node, gradients, sources, wrenches), [fx, fy]);
            match node.joint {
                Joint::Revolute => out[node.first] = moment.map(|x| -x),
                Joint::Prismatic => {
                    let direction = direction(node, gradients, sources);
                    let axis = joint.levers.axis;
                    let row = &mut out[node.first];
                    *row = [0.0; W];
                    add(row, -axis[0], &force[0]);
                    add(row, -axis[1], &force[1]);
                    add(row, -dot(turned(axis), joint.force), &direction);
                }
                _ => {}
            }
            let (arm, by_rotation) = (turned(joint.levers.parent), -dot(joint.levers.base, joint.force));
            let [row_x, row_y, row_t] = [px, py, pt].map(|i| &wrenches[i]);
            let (rotation, passed) = (&sources[pt], if node.joint == Joint::Pin { &zero } else { &moment });
            let inputs = [row_x, row_y, row_t, &force[0], &force[1], passed, rotation];
            let [to_x, to_y, mut to] = rows(simd, inputs, |[x, y, t, fx, fy, passed, rotation]| {
                [x + fx, y + fy, t + passed + fx * arm[0] + fy * arm[1] + rotation * by_rotation]
            });
            if gradients.is_active {
                let ([fx, fy], lever) = (joint.force, rotated_pair(joint.levers.rotations[0], &gradients.parent));
                add(&mut to, -fx, &lever[1]);
                add(&mut to, fy, &lever[0]);
            }
            if node.joint == Joint::Prismatic {
                let (axis, displacement) = (joint.levers.axis, joint.slide[0]);
                add(&mut to, dot(turned(axis), joint.force), &directions.y[node.first]);
                let by_direction = -displacement * dot(axis, joint.force);
                add(&mut to, by_direction, &direction(node, gradients, sources));
            }
            [wrenches[px], wrenches[py], wrenches[pt]] = [to_x, to_y, to];
        }
        for (k, &i) in tree.singles.iter().enumerate() {
            out[tree.first_single + k] = wrenches[i].map(|x| -x);
        }
    }

    /// Writes the derivatives of the reactions of the joints, from the wrenches that [`Self::collect`] has left in `rows`.
    pub fn reactions<const W: usize>(
        &self,
        tree: &Tree,
        parameters: &TreeGradients<W>,
        (directions, sources): (&Directions<'_, W>, &[Gradient<W>]),
        rows: &[Gradient<W>],
        multipliers: &mut [Gradient<W>],
    ) {
        for ((node, joint), gradients) in tree.nodes.iter().zip(&self.joints).zip(&parameters.joints) {
            let [x, y, _] = node.coordinates;
            let (force, sign) = ([&rows[x], &rows[y]], node.sign());
            let signed = |x: &Gradient<W>| x.map(|x| x * sign);
            let l = &mut multipliers[node.first_multiplier..];
            match node.joint {
                Joint::Free { .. } => {}
                Joint::Revolute | Joint::Pin => (l[0], l[1]) = (signed(force[0]), signed(force[1])),
                Joint::Fixed => {
                    let moment = joint.moment(Scalar, node, gradients, sources, rows);
                    (l[0], l[1], l[2]) = (signed(force[0]), signed(force[1]), signed(&moment));
                }
                Joint::Prismatic => {
                    let moment = joint.moment(Scalar, node, gradients, sources, rows);
                    let (axis, sideways) = (joint.levers.axis, turned(joint.levers.axis));
                    let mut normal = [0.0; W];
                    add(&mut normal, sideways[0], force[0]);
                    add(&mut normal, sideways[1], force[1]);
                    add(&mut normal, -dot(axis, joint.force), &direction(node, gradients, sources));
                    l[0] = normal.map(|x| -x);
                    l[1] = match node.is_reversed {
                        false => moment.map(|x| -x),
                        true => {
                            let mut moment = moment;
                            add(&mut moment, joint.slide[0], &normal);
                            add(&mut moment, dot(sideways, joint.force), &directions.y[node.first]);
                            moment
                        }
                    };
                }
            }
        }
    }

    /// True if the derivatives of the rows need those of all positions and velocities.
    pub fn has_forces(&self) -> bool {
        self.has_forces
    }
}

impl JointLinearization {
    /// Derivatives of the moment of the body's wrench about the joint's point of the body.
    #[inline(always)]
    fn moment<S: Simd, const W: usize>(
        &self,
        simd: S,
        node: &TreeBody,
        gradients: &JointGradients<W>,
        sources: &[Gradient<W>],
        wrenches: &[Gradient<W>],
    ) -> Gradient<W> {
        let ([x, y, t], arm, [fx, fy]) = (node.coordinates, turned(self.levers.child), self.force);
        let (by_rotation, wrench) = (dot(self.levers.child, self.force), [x, y, t].map(|i| &wrenches[i]));
        let inputs = [wrench[0], wrench[1], wrench[2], &sources[t]];
        let [mut moment] =
            rows(simd, inputs, |[x, y, moment, rotation]| [moment + rotation * by_rotation - x * arm[0] - y * arm[1]]);
        if gradients.is_active {
            let lever = rotated_pair(self.levers.rotations[1], &gradients.child);
            add(&mut moment, fx, &lever[1]);
            add(&mut moment, -fy, &lever[0]);
        }
        moment
    }
}

/// Derivatives of the direction of a prismatic joint's line in the plane.
#[inline(always)]
fn direction<const W: usize>(node: &TreeBody, gradients: &JointGradients<W>, sources: &[Gradient<W>]) -> Gradient<W> {
    let mut direction = sources[node.first_body()[2]];
    accumulate(&mut direction, &gradients.line);
    direction
}
