//! Responses on their way back, and the transposed products of elements that they take.

use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues, add};
use crate::derivatives::adjoint::design::DesignAdjoint;
use crate::derivatives::adjoint::element_vjp::{Probe, Rows, Slot};
use crate::derivatives::adjoint::output_vjp::OutputVjp;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::integrators::generalized_alpha::Prescribed;
use crate::linalg::factor::Factor;
use crate::mechanism::ElementInstance;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::Unknown;
use crate::system::state::State;

/// Up to [`BATCH`] responses on their way back.
#[derive(Clone)]
pub(crate) struct AdjointBatch {
    /// Derivatives by the state that has been reached.
    pub now: AdjointState,
    /// Derivatives by parameters so far.
    pub design: DesignAdjoint,
    /// ψ by equation.
    pub multipliers: Vec<BatchValues>,
}

impl AdjointBatch {
    /// Zeros for the responses of `mechanism`, which has `size` equations.
    pub fn new(mechanism: &Mechanism<f64>, size: usize) -> Self {
        let (now, design) = (AdjointState::new(mechanism), DesignAdjoint::new(mechanism));
        Self { now, design, multipliers: vec![[0.0; BATCH]; size] }
    }

    /// Aᵀ ψ = −x̄ with the factorization of `system`, where x̄ of an unknown is `bar`.
    pub fn solve(&mut self, system: &mut System, bar: impl Fn(&AdjointState, Unknown) -> BatchValues) {
        for (psi, unknown) in self.multipliers.iter_mut().zip(system.unknowns()) {
            *psi = bar(&self.now, *unknown).map(|x| -x);
        }
        system.factor().solve_transposed(&mut self.multipliers);
    }

    /// The same with another factorization, x̄ being the derivatives by accelerations and multipliers; these are then done
    /// with.
    pub fn solve_accelerations(&mut self, unknowns: &[Unknown], factor: &mut Factor) {
        for (psi, unknown) in self.multipliers.iter_mut().zip(unknowns) {
            let bar = match *unknown {
                Unknown::Coordinate(i) => &mut self.now.a[i],
                Unknown::Multiplier(m) => &mut self.now.l[m],
            };
            *psi = std::mem::take(bar).map(|x| -x);
        }
        factor.solve_transposed(&mut self.multipliers);
    }

    /// The same where x̄ is `bars` for coordinates and nothing for multipliers.
    pub fn solve_free(&mut self, unknowns: &[Unknown], factor: &mut Factor, bars: &[BatchValues]) {
        for (psi, unknown) in self.multipliers.iter_mut().zip(unknowns) {
            *psi = match *unknown {
                Unknown::Coordinate(i) => bars[i].map(|x| -x),
                Unknown::Multiplier(_) => [0.0; BATCH],
            };
        }
        factor.solve_transposed(&mut self.multipliers);
    }

    /// Adds ψᵀ times the `entries` to the derivatives.
    pub fn vjp(&mut self, entries: &Entries, linearizer: &Linearizer, sources: &mut [BatchValues]) {
        sources.fill([0.0; BATCH]);
        entries.vjp(&self.multipliers, sources);
        let AdjointState { q, v, a, .. } = &mut self.now;
        let (by_state, by_parameter) = sources.split_at(3 * q.len());
        let parameters = linearizer.parameters.iter();
        q.iter_mut().chain(v).chain(a).zip(by_state).for_each(|(to, bar)| add(to, 1.0, bar));
        parameters.zip(by_parameter).for_each(|(&(k, i), bar)| add(&mut self.design.parameters[k][i], 1.0, bar));
    }

    /// Hands what prescribed coordinates have at time `t` on to the parameters of their motions, and clears it.
    pub fn take_motions(&mut self, mechanism: &Mechanism<f64>, dependence: &Dependence, t: f64) {
        for i in dependence.moving() {
            let AdjointState { q, v, a, .. } = &mut self.now;
            let bars = [&mut q[i], &mut v[i], &mut a[i]].map(std::mem::take);
            self.design.take_motion(mechanism, i, t, Prescribed::Exact, bars.each_ref());
        }
    }

    /// Adds the derivatives of output number `output` at `state`, times `weight`.
    pub fn output(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        output: usize,
        weight: &BatchValues,
        probe: &mut Probe,
    ) {
        let mut sink = OutputVjp { bars: &mut self.now, design: &mut self.design };
        sink.output(mechanism, state, output, weight, probe);
    }

    /// Looks up ψ of the rows of element number `part`, the first `coordinates` of which are not scaled.
    fn weigh(&self, system: &System, part: usize, coordinates: usize, constraint: f64, weights: &mut [BatchValues]) {
        weights.fill([0.0; BATCH]);
        for (row, equation) in system.rows_of(part) {
            let scale = if row < coordinates { 1.0 } else { constraint };
            add(&mut weights[row], scale, &self.multipliers[equation]);
        }
    }
}

/// Derivatives of an equation by position, velocity and acceleration of a coordinate that are the same in every state.
struct Constant {
    equation: usize,
    is_constraint: bool,
    coordinate: usize,
    slopes: [f64; 3],
}

/// Transposed products of a mechanism's elements.
pub(crate) struct ElementProducts {
    /// The variables of each element that a derivative has to be handed on to.
    slots: Vec<Vec<Slot>>,
    /// Derivatives that are the same in every state; what they belong to is not in the slots.
    constants: Vec<Constant>,
    /// For each lane ψ of one element's rows.
    weights: Vec<Vec<BatchValues>>,
    /// Room for evaluating elements.
    pub probe: Probe,
}

impl ElementProducts {
    /// For the derivatives by what `dependence` names and by free coordinates.
    pub fn new(mechanism: &Mechanism<f64>, dependence: &Dependence, system: &System, batches: usize) -> Self {
        let size = |part: &ElementInstance<f64>| part.coordinates.len() + part.num_constraints;
        let most = mechanism.parts.iter().map(size).max().unwrap_or(0);
        Self {
            slots: slots(mechanism, dependence),
            constants: constants(mechanism, dependence, system),
            weights: vec![vec![[0.0; BATCH]; most]; batches],
            probe: Probe::default(),
        }
    }

    /// Without derivatives by velocities and accelerations, nor by the positions of free coordinates: an equilibrium.
    pub fn at_rest(mechanism: &Mechanism<f64>, dependence: &Dependence, system: &System, batches: usize) -> Self {
        let mut products = Self::new(mechanism, dependence, system, batches);
        products.constants.retain(|constant| dependence.motions[constant.coordinate]);
        for (part, slots) in mechanism.parts.iter().zip(&mut products.slots) {
            slots.retain(|slot| match *slot {
                Slot::Position(i) => dependence.motions[part.coordinates[i]],
                Slot::Parameter(_) => true,
                _ => false,
            });
        }
        products
    }

    /// Adds ψᵀ ∂F/∂x for every variable x of every element to the `batches`, closure rows times `constraint`.
    pub fn vjp(
        &mut self,
        mechanism: &Mechanism<f64>,
        system: &System,
        state: &State<f64>,
        constraint: f64,
        batches: &mut [&mut AdjointBatch],
    ) {
        let Self { slots, constants, weights, probe } = self;
        for Constant { equation, is_constraint, coordinate, slopes: [stiffness, damping, mass] } in constants {
            let scale = if *is_constraint { constraint } else { 1.0 };
            for AdjointBatch { now, multipliers, .. } in batches.iter_mut().map(|batch| &mut **batch) {
                let psi = &multipliers[*equation];
                add(&mut now.q[*coordinate], scale * *stiffness, psi);
                add(&mut now.v[*coordinate], scale * *damping, psi);
                add(&mut now.a[*coordinate], scale * *mass, psi);
            }
        }
        for (k, (part, slots)) in mechanism.parts.iter().zip(slots).enumerate().filter(|(_, x)| !x.1.is_empty()) {
            let (rows, n) = (part.coordinates.len() + part.num_constraints, part.coordinates.len());
            for (batch, weights) in batches.iter().zip(weights.iter_mut()) {
                batch.weigh(system, k, n, constraint, weights);
            }
            let sets = weights[..batches.len()].iter().map(|weights| &weights[..rows]);
            probe.vjp(part, state, slots, Rows::Residual, sets, |set, slot, bar| {
                let AdjointBatch { now, design, .. } = &mut *batches[set];
                let to = match slot {
                    Slot::Position(i) => &mut now.q[part.coordinates[i]],
                    Slot::Velocity(i) => &mut now.v[part.coordinates[i]],
                    Slot::Acceleration(i) => &mut now.a[part.coordinates[i]],
                    Slot::Multiplier(i) => &mut now.l[part.first_multiplier + i],
                    Slot::Parameter(i) => &mut design.parameters[k][i],
                };
                add(to, 1.0, &bar);
            });
        }
    }
}

/// The variables of each element that a derivative has to be handed on to.
fn slots(mechanism: &Mechanism<f64>, dependence: &Dependence) -> Vec<Vec<Slot>> {
    let parts = mechanism.parts.iter().enumerate().filter(|(_, part)| !part.element.is_sensor());
    let mut slots = vec![Vec::new(); mechanism.parts.len()];
    for (k, part) in parts {
        let linear = part.element.linear();
        let counts =
            |&local: &usize| is_wanted(mechanism, dependence, part.coordinates[local]) && !linear.contains(&local);
        let moving: Vec<usize> = (0..part.coordinates.len()).filter(counts).collect();
        // What a constraint adds is λ Φ_q(q): velocities and accelerations are not in it.
        if part.num_constraints == 0 {
            let driven = moving.iter().filter(|&&local| dependence.motions[part.coordinates[local]]);
            slots[k].extend(driven.map(|&local| Slot::Acceleration(local)));
            slots[k].extend(moving.iter().map(|&local| Slot::Velocity(local)));
        }
        slots[k].extend(moving.iter().map(|&local| Slot::Position(local)));
        slots[k].extend(dependence.parameters[k].iter().map(|&p| Slot::Parameter(p)));
    }
    slots
}

fn constants(mechanism: &Mechanism<f64>, dependence: &Dependence, system: &System) -> Vec<Constant> {
    let mut constants = Vec::new();
    for (k, part) in mechanism.parts.iter().enumerate() {
        for coefficient in system.coefficients(k) {
            let coordinate = part.coordinates[coefficient.coordinate];
            let row = system.rows_of(k).find(|(row, _)| *row == coefficient.row);
            let Some((row, equation)) = row.filter(|_| is_wanted(mechanism, dependence, coordinate)) else { continue };
            let [stiffness, damping, mass] = coefficient.values;
            // A new acceleration is an unknown, unless it is prescribed.
            let mass = if dependence.motions[coordinate] { mass } else { 0.0 };
            let (is_constraint, slopes) = (row >= part.coordinates.len(), [stiffness, damping, mass]);
            if slopes != [0.0; 3] {
                constants.push(Constant { equation, is_constraint, coordinate, slopes });
            }
        }
    }
    constants
}

/// Whether derivatives by a coordinate lead on: to its past or to the design.
fn is_wanted(mechanism: &Mechanism<f64>, dependence: &Dependence, coordinate: usize) -> bool {
    dependence.motions[coordinate] || mechanism.coordinates[coordinate].motion.is_none()
}
