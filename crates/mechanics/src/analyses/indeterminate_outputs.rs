//! Outputs and friction that redundant constraints leave indeterminate.

use crate::Result;
use crate::constraint_rank::self_stresses;
use crate::elements::element::ElementWorkspace;
use crate::events::mode_transition::{assemble_closed, set_initial_modes};
use crate::initial_conditions::{Assembly, assemble, make_velocities_consistent};
use crate::mechanism::scalars::ElementScalar;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::System;
use crate::system::outputs::Sampler;
use crate::system::state::{State, gather};

/// Relative change of an output by a self-stress, above which the output is indeterminate.
const CHANGED: f64 = 1e-8;

/// Numbers of the outputs that change with self-stresses (multipliers n with Φ_qᵀ n = 0), in an assembled state.
///
/// Their values are one of many possible ones, in absolute coordinates those of the reactions of least norm; they have no derivatives.
pub fn indeterminate_outputs(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<usize> {
    if !system.allows_redundancy() {
        return Vec::new();
    }
    let mut sampler = Sampler::new(mechanism);
    let (mut here, mut moved) = (Vec::new(), Vec::new());
    sampler.outputs(mechanism, state, &mut here);
    let mut changes = vec![false; here.len()];
    for stress in self_stresses(system, mechanism, state) {
        let mut stressed = state.clone();
        stressed.l.iter_mut().zip(&stress).for_each(|(l, n)| *l += n);
        sampler.outputs(mechanism, &stressed, &mut moved);
        for ((change, a), b) in changes.iter_mut().zip(&here).zip(&moved) {
            *change |= (a - b).abs() > CHANGED * (1.0 + a.abs());
        }
    }
    (0..changes.len()).filter(|&k| changes[k]).collect()
}

/// Velocities (m/s and rad/s) at which friction is compared: at rest it may have no force.
const SLIDING: f64 = 1.0;

/// Names of the elements whose friction changes with self-stresses (multipliers n with Φ_qᵀ n = 0), in an assembled state: the motion
/// then depends on the choice of the reactions.
pub fn indeterminate_friction(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<String> {
    if !system.allows_redundancy() {
        return Vec::new();
    }
    let mut sliding = state.clone();
    // An arbitrary direction whose components have no simple ratios.
    sliding.v.iter_mut().enumerate().for_each(|(i, v)| *v = SLIDING * (1.0 + 2.3 * i as f64).sin());
    let stresses = self_stresses(system, mechanism, state);
    let mut workspace = ElementWorkspace::<f64>::default();
    let mut forces = |instance: &ElementInstance<f64>, at: &State<f64>| {
        gather(instance, at, &mut workspace);
        f64::residual_of(instance.element.as_ref(), &instance.parameters, at.t, &mut workspace);
        workspace.dynamics.clone()
    };
    let loads = mechanism.elements.iter().filter(|instance| instance.num_reactions > 0 && instance.switch.is_none());
    let changes = |instance: &&ElementInstance<f64>| {
        let here = forces(instance, &sliding);
        stresses.iter().any(|stress| {
            let mut stressed = sliding.clone();
            stressed.l.iter_mut().zip(stress).for_each(|(l, n)| *l += n);
            forces(instance, &stressed).iter().zip(&here).any(|(a, b)| (a - b).abs() > CHANGED * (1.0 + b.abs()))
        })
    };
    loads.filter(changes).map(|instance| instance.name.clone()).collect()
}

/// Warnings about the outputs and the friction of `mechanism` that redundant constraints leave indeterminate, when it is assembled at time `t` in s.
///
/// # Errors
///
/// As [`assemble`].
pub fn warn_of_indeterminate_outputs(mechanism: &Mechanism<f64>, assembly: Assembly, t: f64) -> Result<Vec<String>> {
    let (mut system, mut state) = (System::new(mechanism)?, State::built(mechanism, t));
    assemble(&mut system, mechanism, &mut state, assembly)?;
    make_velocities_consistent(&mut system, mechanism, &mut state)?;
    if set_initial_modes(&mut system, mechanism, &mut state)? {
        assemble_closed(&mut system, mechanism, &mut state, assembly)?;
    }
    let warning = |name: String| {
        format!(
            "{name}: redundant constraints leave this reaction indeterminate, and the value is one of many: that of least norm in \
             absolute coordinates, that without constraints that follow from others in relative ones; leave out the \
             constraints that follow from others, or replace a joint by a bushing, a rigid contact by a compliant one"
        )
    };
    let friction = |name: String| {
        format!(
            "{name}: redundant constraints leave the reactions on which its friction depends indeterminate, and so the motion, which is one of \
             many: that of reactions of least norm; leave out the constraints that follow from others, or replace a joint by a bushing"
        )
    };
    let name = |output: usize| mechanism.outputs[output].name.clone();
    let outputs = indeterminate_outputs(&system, mechanism, &state).into_iter().map(name).map(warning);
    Ok(outputs.chain(indeterminate_friction(&system, mechanism, &state).into_iter().map(friction)).collect())
}
