//! The outputs of a mechanism over time by explicit steps.

use crate::Result;
use crate::analyses::dynamics::History;
use crate::analyses::sampling::Sampler;
use crate::diagnostics;
use crate::events::impact;
use crate::initial_conditions::{Projection, assemble, make_velocities_consistent};
use crate::integrators::explicit::mechanism::{MechanismRhs, SAMPLE, StepRecord};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::recording::ExplicitRecording;
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

/// Simulates `mechanism` by explicit steps and records its outputs at `times` (increasing, s).
///
/// For smooth, non-stiff motions at high accuracy: no beams, no stiff contacts. Iterations are evaluations of the
/// accelerations.
///
/// **Errors.** [`crate::Error::Analysis`] naming element and time if the mechanism cannot be built, assembled or
/// moved on.
pub fn simulate_explicitly(mechanism: &Mechanism<f64>, settings: &Explicit, times: &[f64]) -> Result<History> {
    Ok(simulate_with_steps(mechanism, settings, times)?.0)
}

/// [`simulate_explicitly`], with the lengths of the steps (s): given as [`crate::integrators::explicit::settings::StepControl::Given`] they repeat the run.
pub fn simulate_with_steps(
    mechanism: &Mechanism<f64>,
    settings: &Explicit,
    times: &[f64],
) -> Result<(History, Vec<f64>)> {
    let (march, _) = start(mechanism, settings, times, false)?;
    record(mechanism, march, times, None)
}

/// [`simulate_explicitly`], with the steps in at most `memory` bytes.
pub fn simulate_with_recording(
    mechanism: &Mechanism<f64>,
    settings: &Explicit,
    times: &[f64],
    memory: usize,
) -> Result<(History, ExplicitRecording)> {
    let (march, start) = start(mechanism, settings, times, false)?;
    let mut recording = ExplicitRecording::of(&march, start, memory);
    let (history, _) = record(mechanism, march, times, Some(&mut recording))?;
    Ok((history, recording))
}

fn record(
    mechanism: &Mechanism<f64>,
    mut march: OdeDriver<MechanismRhs<'_>>,
    times: &[f64],
    mut recording: Option<&mut ExplicitRecording>,
) -> Result<(History, Vec<f64>)> {
    let mut sampler = Sampler::new(mechanism);
    let mut y = march.stepper.old.clone();
    let mut outputs = Vec::new();
    let mut values = vec![Vec::with_capacity(times.len()); mechanism.outputs.len()];
    for &t in times {
        while march.is_before(t) {
            march.advance()?;
            recording.iter_mut().for_each(|recording| recording.log.keep(&march));
        }
        recording.iter_mut().for_each(|recording| recording.log.advance_to(t));
        sample(&mut march, &mut y, t)?;
        sampler.outputs(mechanism, &march.stepper.flow.state, &mut outputs);
        diagnostics::check(mechanism, &march.stepper.flow.state, &outputs)?;
        values.iter_mut().zip(&outputs).for_each(|(series, &value)| series.push(value));
    }
    let (work, last) = (march.work(), march.stepper.flow.state.clone());
    Ok((
        History { names: mechanism.output_names(), times: times.to_vec(), values, last, impacts: Vec::new(), work },
        march.steps,
    ))
}

/// Assembles the mechanism and stands at the start of its motion, with a tape if it is to be differentiated.
pub(crate) fn start<'m>(
    mechanism: &'m Mechanism<f64>,
    settings: &Explicit,
    times: &[f64],
    recorded: bool,
) -> Result<(OdeDriver<MechanismRhs<'m>>, Start)> {
    settings.check(times)?;
    impact::refuse(mechanism, "explicit steps")?;
    let mut system = System::at(mechanism, settings.start)?;
    let mut state = State::built(mechanism, settings.start);
    let mut projection = assemble(&mut system, mechanism, &mut state, settings.assembly)?;
    projection.velocity = make_velocities_consistent(&mut system, mechanism, &mut state)?;
    state.l.fill(0.0);
    let y = MechanismRhs::vector(&state);
    let tape = recorded.then(|| StepRecord::new(&mut system, &state));
    let mut flow = MechanismRhs::new(mechanism, system, state.clone());
    flow.tape = tape;
    Ok((OdeDriver::new(flow, settings, y, times)?, Start { state, projection }))
}

/// The consistent initial state and the multipliers of its projections.
pub struct Start {
    pub state: State<f64>,
    pub projection: Projection,
}

/// Leaves the state at `t`, accelerations and multipliers included, in the flow. Returns whether by dense output.
pub(crate) fn sample(march: &mut OdeDriver<MechanismRhs<'_>>, y: &mut [f64], t: f64) -> Result<bool> {
    let dense = march.sample(t, y)?;
    let mut rates = std::mem::take(&mut march.scratch);
    rates.resize(y.len(), 0.0);
    march.stepper.flow.rates(SAMPLE, t, y, &mut rates)?;
    march.stepper.evaluations += 1;
    march.scratch = rates;
    Ok(dense)
}
