//! Derivatives of analyses that solve each time point separately: kinematics with inverse dynamics, and statics.

use crate::analyses::dynamics::Work;
use crate::analyses::kinematics::KinematicDriver;
use crate::analyses::sampling::OutputRecorder;
use crate::analyses::statics::Statics;
use crate::derivatives::forward::initial_conditions::{InitialDerivatives, equilibrium};
use crate::derivatives::history::{OutputGradients, SensitiveHistory};
use crate::derivatives::indeterminate::check_outputs;
use crate::derivatives::seeding::build_chunks;
use crate::equilibrium::advance_equilibrium;
use crate::events::impact;
use crate::initial_conditions::{Assembly, assemble};
use crate::mechanism::scalars::{DerivativeScalar, Dual8, ElementScalar, Jet2};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::System;
use crate::system::linearization::Linearization;
use crate::system::outputs::Sampler;
use crate::system::state::State;
use crate::{Error, Result, diagnostics};

/// Solves kinematics and inverse dynamics of `model` at `times` (s) and differentiates all outputs.
///
/// # Errors
/// [`Error::Unsupported`] unless every degree of freedom is driven: then a time point depends on the design alone and
/// not on its predecessors. [`Error::Analysis`] where the mechanism cannot be assembled.
pub fn differentiate_kinematics<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let seeded = build_chunks(model, b, &mechanism)?;
    kinematics_seeded(&mechanism, &seeded, b.len(), assembly, times)
}

/// Finds static equilibria of `model` at `times` (s), a load path, and differentiates all outputs.
///
/// # Errors
/// As [`equilibria`](crate::analyses::statics::equilibria).
pub fn differentiate_equilibria<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let seeded = build_chunks(model, b, &mechanism)?;
    equilibria_seeded(&mechanism, &seeded, b.len(), settings, times)
}

// The functions below are not generic over the model: they are compiled once, in this crate.

fn kinematics_seeded(
    mechanism: &Mechanism<f64>,
    seeded: &[Mechanism<Dual8>],
    variables: usize,
    assembly: Assembly,
    times: &[f64],
) -> Result<SensitiveHistory> {
    record_instants(mechanism, variables, times, |recorder| {
        kinematic_derivatives(mechanism, seeded, assembly, times, recorder)
    })
}

fn equilibria_seeded(
    mechanism: &Mechanism<f64>,
    seeded: &[Mechanism<Dual8>],
    variables: usize,
    settings: &Statics,
    times: &[f64],
) -> Result<SensitiveHistory> {
    record_instants(mechanism, variables, times, |recorder| {
        equilibrium_derivatives(mechanism, seeded, settings, times, recorder)
    })
}

/// The history of time points that `solve` solves one by one: it records their outputs and returns the gradients.
pub(crate) fn record_instants(
    mechanism: &Mechanism<f64>,
    variables: usize,
    times: &[f64],
    solve: impl FnOnce(&mut OutputRecorder) -> Result<OutputGradients>,
) -> Result<SensitiveHistory> {
    let mut recorder = OutputRecorder::new(mechanism, times.len());
    let gradients = solve(&mut recorder)?;
    let work = Work { steps: times.len(), ..Work::default() };
    Ok(SensitiveHistory::new(mechanism, times, recorder, (&gradients, variables), work))
}

/// Calls `visit` at each of `times`, with its number and the mechanism driven to that time.
///
/// # Errors
/// [`Error::Unsupported`] unless every degree of freedom is driven.
pub(crate) fn for_each_driven_state(
    mechanism: &Mechanism<f64>,
    assembly: Assembly,
    times: &[f64],
    mut visit: impl FnMut(usize, &mut KinematicDriver<'_>) -> Result<()>,
) -> Result<()> {
    let Some(&first) = times.first() else { return Ok(()) };
    let mut driver = KinematicDriver::new(mechanism, assembly, first)?;
    let freedom = driver.system.size() as isize - 2 * mechanism.multipliers as isize;
    let freedom = if driver.system.allows_redundancy() { 0 } else { freedom }; // the driver has counted its rank
    if freedom != 0 {
        let why = format!("{freedom} degrees of freedom are not driven");
        return Err(Error::unsupported("kinematics", why, "drive them, or simulate the motion"));
    }
    check_outputs(&driver.system, mechanism, &driver.state)?;
    for (k, &t) in times.iter().enumerate() {
        if t != driver.state.t {
            driver.advance_to(t)?;
        }
        visit(k, &mut driver)?;
    }
    Ok(())
}

/// Calls `visit` at each of `times`, with its number, the equations and the static equilibrium at that time.
///
/// # Errors
/// As [`equilibria`](crate::analyses::statics::equilibria), and those of `visit`.
pub(crate) fn for_each_equilibrium(
    mechanism: &Mechanism<f64>,
    settings: &Statics,
    times: &[f64],
    mut visit: impl FnMut(usize, &mut System, &State<f64>) -> Result<()>,
) -> Result<()> {
    impact::refuse(mechanism, "equilibria")?;
    let Some(&first) = times.first() else { return Ok(()) };
    let (mut system, mut state) = (System::at(mechanism, first)?, State::built(mechanism, first));
    assemble(&mut system, mechanism, &mut state, Assembly::default())?;
    check_outputs(&system, mechanism, &state)?;
    for (k, &t) in times.iter().enumerate() {
        advance_equilibrium(&mut system, mechanism, &mut state, t, settings)?;
        visit(k, &mut system, &state)?;
    }
    Ok(())
}

/// Factorizes the matrix of the equilibrium `state`.
///
/// # Errors
/// [`Error::Analysis`] naming the coordinate or joint without a pivot.
pub(crate) fn factorize_equilibrium(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, state, Linearization::statics(), &mut rows);
    diagnostics::factorize(system, mechanism, state)
}

/// Drives `mechanism` through `times`, records its outputs and differentiates them with each of the mechanisms `seeded`.
pub(crate) fn kinematic_derivatives<T: DerivativeScalar<L>, const L: usize>(
    mechanism: &Mechanism<f64>,
    seeded: &[Mechanism<T>],
    assembly: Assembly,
    times: &[f64],
    recorder: &mut OutputRecorder,
) -> Result<OutputGradients>
where
    Jet2<T>: ElementScalar,
{
    let mut chunks = vec![Vec::new(); seeded.len()];
    for_each_driven_state(mechanism, assembly, times, |_, driver| {
        let KinematicDriver { state: values, projection, system, .. } = driver;
        recorder.record(mechanism, values)?;
        for (chunk, seeded) in chunks.iter_mut().zip(seeded) {
            let mut derivatives = InitialDerivatives::new(mechanism, seeded, system);
            let mut state = derivatives.consistent(values, projection)?;
            derivatives.accelerations(values, &mut state)?;
            extend_by_outputs(chunk, seeded, &state);
        }
        Ok(())
    })?;
    Ok(OutputGradients::new(mechanism.outputs.len(), L, chunks))
}

/// Finds the equilibria of `mechanism`, records its outputs and differentiates them with each of the mechanisms `seeded`.
pub(crate) fn equilibrium_derivatives<T: DerivativeScalar<L>, const L: usize>(
    mechanism: &Mechanism<f64>,
    seeded: &[Mechanism<T>],
    settings: &Statics,
    times: &[f64],
    recorder: &mut OutputRecorder,
) -> Result<OutputGradients> {
    let mut chunks = vec![Vec::new(); seeded.len()];
    for_each_equilibrium(mechanism, settings, times, |_, system, values| {
        recorder.record(mechanism, values)?;
        factorize_equilibrium(system, mechanism, values)?;
        for (chunk, seeded) in chunks.iter_mut().zip(seeded) {
            extend_by_outputs(chunk, seeded, &equilibrium(seeded, values, system));
        }
        Ok(())
    })?;
    Ok(OutputGradients::new(mechanism.outputs.len(), L, chunks))
}

fn extend_by_outputs<T: DerivativeScalar<L>, const L: usize>(
    chunk: &mut Vec<f64>,
    mechanism: &Mechanism<T>,
    state: &State<T>,
) {
    let mut outputs = Vec::new();
    Sampler::new(mechanism).outputs(mechanism, state, &mut outputs);
    chunk.extend(outputs.iter().flat_map(DerivativeScalar::derivatives));
}
