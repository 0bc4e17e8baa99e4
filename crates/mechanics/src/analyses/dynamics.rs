//! Simulation of a mechanism over time, by implicit or explicit steps.

use crate::Result;
use crate::analyses::conservation::EnergyDrift;
use crate::analyses::equilibrium_stability::warn_of_unstable_equilibrium;
use crate::analyses::initial_positions::positions_that_do_not_fit;
use crate::analyses::motion_watch::MotionWatch;
use crate::analyses::sampling::OutputRecorder;
use crate::checkpointing::recording::{ExplicitRecording, Recording};
use crate::checkpointing::trajectory_store::{Checkpointable, TrajectoryStore};
use crate::events::Event;
use crate::events::condition::{HOLDS_FROM_START, not_happened};
use crate::events::held_outputs::HeldOutputs;
use crate::integrators::event_location::EventLocator;
use crate::integrators::explicit::constraint_drift::ConstraintDrift;
use crate::integrators::explicit::mechanism::{MechanismRhs, sample, start};
use crate::integrators::explicit::{Coordinates, Explicit, OdeDriver, OdeRhs, ReplayedStep};
use crate::integrators::time_stepper::TimeStepper;
use crate::mechanism::Mechanism;
use crate::mechanism::output::HeldFrom;
use crate::system::state::State;
use error::Seconds;

pub use crate::integrators::settings::{
    Dynamics, InitialAcceleration, InitialConfiguration, StepSize, Work, check_times, is_before,
};
pub use crate::integrators::time_stepper::GivenStep;

/// Outputs of a mechanism over time.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    /// Names of the outputs.
    pub names: Vec<String>,
    /// Times in s.
    pub times: Vec<f64>,
    /// One series per output, one value per time.
    pub values: Vec<Vec<f64>>,
    /// State at the last time.
    pub last: State<f64>,
    /// Events (impacts, zero crossings of switches, and others), in order of time.
    pub impacts: Vec<Event>,
    /// Numbers of steps and iterations. Iterations of explicit steps are evaluations of the accelerations.
    pub work: Work,
    /// Change of the energy, if the mechanism conserves it; otherwise `None`.
    pub energy_drift: Option<EnergyDrift>,
    /// Violation of the constraints, along explicit steps; otherwise `None`.
    pub constraint_drift: Option<ConstraintDrift>,
    /// Unknowns of the steps, absolute or relative coordinates. Implicit steps have absolute ones.
    pub coordinates: Coordinates,
    /// Reasons to doubt the results of a simulation that has succeeded: the part, the time and the remedy.
    pub warnings: Vec<String>,
}

impl History {
    /// The series of the output `name`.
    pub fn series(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| n == name).map(|k| self.values[k].as_slice())
    }
}

/// Simulates `mechanism` by implicit steps and records its outputs at `times` (increasing, s).
///
/// This is the analysis for general mechanisms: closed loops, beams, stiff forces, contacts and impacts.
///
/// # Errors
///
/// [`Error::Analysis`](crate::Error::Analysis) naming element and time if the mechanism cannot be built or assembled, or if a
/// step does not converge. Settings that [`Dynamics::check`] rejects.
pub fn simulate(mechanism: &Mechanism<f64>, settings: &Dynamics, times: &[f64]) -> Result<History> {
    let outcome = record_outputs(mechanism, TimeStepper::new(mechanism, settings, times)?, times, None)?;
    finished(outcome, settings)
}

/// Simulates as [`simulate`] and records the steps in at most `memory` bytes for derivatives.
///
/// If the steps do not fit into memory, the recording has checkpoints instead.
///
/// # Errors
///
/// As [`simulate`].
pub fn simulate_recorded(
    mechanism: &Mechanism<f64>,
    settings: &Dynamics,
    times: &[f64],
    memory: usize,
) -> Result<(History, Recording)> {
    let stepper = TimeStepper::new(mechanism, settings, times)?;
    let mut recording = Recording::of(&stepper, memory);
    let outcome = record_outputs(mechanism, stepper, times, Some(&mut recording.store))?;
    recording.has_simultaneous_events = outcome.1.has_simultaneous_events;
    Ok((finished(outcome, settings)?, recording))
}

/// The steps by which [`simulate`] advances `mechanism` to the last of `times`.
///
/// # Errors
///
/// As [`simulate`].
pub fn implicit_steps(mechanism: &Mechanism<f64>, settings: &Dynamics, times: &[f64]) -> Result<Vec<GivenStep>> {
    let mut stepper = TimeStepper::new(mechanism, settings, times)?;
    let mut steps = Vec::new();
    for &t in times {
        while stepper.is_before(t) {
            stepper.advance()?;
            steps.push(stepper.given_step());
        }
    }
    Ok(steps)
}

/// Simulates as [`simulate`], by the given `steps` instead of those of the settings.
///
/// The derivatives of a motion by adaptive steps are those of its steps: their lengths do not change, except of those that end at events.
/// This is the function that they differentiate, for a neighbouring design.
///
/// # Errors
///
/// As [`simulate`], and [`Error::Analysis`](crate::Error::Analysis) if other events happen.
pub fn simulate_by_given_steps(
    mechanism: &Mechanism<f64>,
    settings: &Dynamics,
    steps: &[GivenStep],
    times: &[f64],
) -> Result<History> {
    let stepper = TimeStepper::new(mechanism, settings, times)?.with_given_steps(steps);
    finished(record_outputs(mechanism, stepper, times, None)?, settings)
}

/// The history of a simulation by implicit steps with its events.
///
/// # Errors
///
/// [`Error::Analysis`](crate::Error::Analysis) naming an event that has not happened although an output is held from it on.
fn finished((mut history, stepper): (History, TimeStepper<'_>), settings: &Dynamics) -> Result<History> {
    let (mechanism, state) = (stepper.integrator.mechanism, &stepper.integrator.step.new);
    add_events(&mut history, mechanism, &stepper.locator, state, (stepper.end(), stepper.has_ended()))?;
    history.warnings.extend(interpolated_outputs(settings, &history.times));
    Ok(History { work: stepper.work(), ..history })
}

/// Adds the events of a motion to its `history`, and warnings about events that have not happened. The motion is at
/// `state`, `end` (s) is its last output time, and `has_ended` is true if an event has ended it.
///
/// # Errors
///
/// [`Error::Analysis`](crate::Error::Analysis) naming an event that has not happened although an output is held from it on.
fn add_events(
    history: &mut History,
    mechanism: &Mechanism<f64>,
    locator: &EventLocator,
    state: &State<f64>,
    (end, has_ended): (f64, bool),
) -> Result<()> {
    let last = locator.closed;
    let is_open = |k: &usize| mechanism.events[*k].when.is_some() && !state.modes.has_happened(*k) && last != Some(*k);
    for event in (0..mechanism.events.len()).filter(is_open) {
        let (name, holds) = (&mechanism.events[event].gap.name, locator.held_from_start.contains(&event));
        let is_of_event = |held: HeldFrom| held.event == event && held.is_required;
        if mechanism.outputs.iter().any(|output| output.held.is_some_and(is_of_event)) {
            let ended_by = last.filter(|_| has_ended).map(|k| mechanism.events[k].gap.name.as_str());
            return Err(not_happened(name, if has_ended { state.t } else { end }, (holds, ended_by)));
        }
        if !has_ended {
            let why = match holds {
                true => HOLDS_FROM_START.to_owned(),
                false => format!("this event has not happened until t = {end}", end = Seconds(end)),
            };
            history.warnings.push(format!("{name}: {why}"));
        }
    }
    let end = last.filter(|_| has_ended).map(|k| Event { contact: mechanism.events[k].gap.name.clone(), t: state.t });
    history.impacts.extend(locator.events.iter().cloned().chain(end));
    Ok(())
}

/// Number of output times in one step from which the interpolation between the ends of steps is worth a warning.
const MANY_OUTPUTS: f64 = 4.0;

/// The warning about fixed steps that are far longer than the interval of the output times.
fn interpolated_outputs(settings: &Dynamics, times: &[f64]) -> Option<String> {
    let StepSize::Fixed(h) = settings.step else { return None };
    let intervals = times.len().checked_sub(1).filter(|count| *count > 0)?;
    let spacing = (times.last()? - times.first()?) / intervals as f64;
    (h > MANY_OUTPUTS * spacing && spacing > 0.0).then(|| {
        format!(
            "the time step of {h:.3e} s is longer than the distance of the output times, {spacing:.3e} s on average: outputs \
             between the ends of steps are interpolated, and accelerations and reactions are straight lines there. Take a time \
             step of {spacing:.1e} s or less, or fewer output times."
        )
    })
}

/// Simulates `mechanism` by explicit steps and records its outputs at `times` (increasing, s).
///
/// For smooth, non-stiff motions at high accuracy: no beams, no stiff contacts.
///
/// # Errors
///
/// [`Error::Analysis`](crate::Error::Analysis) naming element and time if the mechanism cannot be built or assembled, or if
/// the step becomes too small. [`Error::Unsupported`](crate::Error::Unsupported) for a mechanism with a [switch](crate::Mechanism::switch).
pub fn simulate_explicitly(mechanism: &Mechanism<f64>, settings: &Explicit, times: &[f64]) -> Result<History> {
    Ok(simulate_with_steps(mechanism, settings, times)?.0)
}

/// Simulates as [`simulate_explicitly`] and returns the lengths of the steps in s.
///
/// Given as [`StepControl::Given`](crate::integrators::explicit::StepControl::Given), these steps repeat the simulation.
///
/// # Errors
///
/// As [`simulate_explicitly`].
pub fn simulate_with_steps(
    mechanism: &Mechanism<f64>,
    settings: &Explicit,
    times: &[f64],
) -> Result<(History, Vec<f64>)> {
    let (driver, _) = start(mechanism, settings, times, false)?;
    let (history, driver) = record_outputs(mechanism, driver, times, None)?;
    Ok((finished_explicitly(history, &driver)?, driver.steps))
}

/// The steps of a simulation as by [`simulate_explicitly`], without its history.
///
/// Given as [`StepControl::Taken`](crate::integrators::explicit::StepControl::Taken), these steps repeat the simulation, also in
/// neighbouring designs. Differences of such motions approximate first derivatives, which are those along frozen steps. Events
/// of rigid contacts end additional steps.
///
/// # Errors
///
/// As [`simulate_explicitly`].
pub fn replayed_steps(mechanism: &Mechanism<f64>, settings: &Explicit, times: &[f64]) -> Result<Vec<ReplayedStep>> {
    let (mut driver, _) = start(mechanism, settings, times, false)?;
    let mut steps = Vec::new();
    for &t in times {
        while driver.is_before(t) {
            driver.advance()?;
            steps.push(driver.replayed_step());
        }
    }
    Ok(steps)
}

/// Simulates as [`simulate_explicitly`] and records the steps in at most `memory` bytes for derivatives.
///
/// # Errors
///
/// As [`simulate_explicitly`].
pub fn simulate_with_recording(
    mechanism: &Mechanism<f64>,
    settings: &Explicit,
    times: &[f64],
    memory: usize,
) -> Result<(History, ExplicitRecording)> {
    let (driver, start) = start(mechanism, settings, times, false)?;
    let mut recording = ExplicitRecording::of(&driver, start, memory);
    let (history, driver) = record_outputs(mechanism, driver, times, Some(&mut recording.store))?;
    Ok((finished_explicitly(history, &driver)?, recording))
}

/// The history of a simulation by explicit steps with its work and the violation of its constraints.
fn finished_explicitly(mut history: History, driver: &OdeDriver<MechanismRhs<'_>>) -> Result<History> {
    let rhs = &driver.stepper.rhs;
    if let (Some(locator), Some(ends)) = (&rhs.locator, &rhs.step_ends) {
        let last = history.times.last().copied().unwrap_or(driver.end());
        add_events(&mut history, rhs.mechanism, locator, &ends.states[1], (last, rhs.has_ended()))?;
    }
    history.warnings.extend(rhs.drift.warning());
    let coordinates = rhs.coordinates();
    Ok(History { work: driver.work(), constraint_drift: Some(rhs.drift), coordinates, ..history })
}

/// A simulation in progress whose state can be sampled between steps.
trait Simulation: Checkpointable {
    /// Returns whether the current step ends before `t` (s).
    fn is_before(&self, t: f64) -> bool;

    /// Writes the state at the time `t` (s) in the current step to `at`; `y` is workspace.
    fn sample(&mut self, t: f64, y: &mut Vec<f64>, at: &mut State<f64>) -> Result<()>;

    /// The state at the start, before the first step.
    fn start(&self) -> State<f64>;

    /// The static equilibrium at the start with its reactions, if the motion starts in one.
    fn equilibrium(&self) -> Option<State<f64>> {
        None
    }

    /// The absolute tolerance of the local error of positions in m or rad; `None` for steps without error control.
    fn tolerance(&self) -> Option<f64>;

    /// Outputs that keep their value from an event on.
    fn held(&self) -> Option<&HeldOutputs<f64>> {
        None
    }
}

impl Simulation for TimeStepper<'_> {
    fn is_before(&self, t: f64) -> bool {
        self.is_before(t)
    }

    fn sample(&mut self, t: f64, _y: &mut Vec<f64>, at: &mut State<f64>) -> Result<()> {
        self.sample(t, at);
        Ok(())
    }

    fn start(&self) -> State<f64> {
        self.integrator.step.old.clone()
    }

    fn equilibrium(&self) -> Option<State<f64>> {
        self.equilibrium_at_start()
    }

    fn tolerance(&self) -> Option<f64> {
        self.tolerance()
    }

    fn held(&self) -> Option<&HeldOutputs<f64>> {
        self.locator.held.as_ref()
    }
}

impl Simulation for OdeDriver<MechanismRhs<'_>> {
    fn is_before(&self, t: f64) -> bool {
        self.is_before(t)
    }

    fn sample(&mut self, t: f64, y: &mut Vec<f64>, at: &mut State<f64>) -> Result<()> {
        y.resize(self.stepper.old.len(), 0.0);
        sample(self, y, t)?;
        at.copy_from(&self.stepper.rhs.state);
        Ok(())
    }

    fn tolerance(&self) -> Option<f64> {
        self.tolerance()
    }

    fn held(&self) -> Option<&HeldOutputs<f64>> {
        self.stepper.rhs.locator.as_ref()?.held.as_ref()
    }

    fn start(&self) -> State<f64> {
        // The state of the right-hand side is that of the last trial in the choice of the first step.
        self.stepper.rhs.state_of(self.stepper.t[0], &self.stepper.old)
    }
}

/// Advances a simulation to `times`, records the outputs, and stores the steps in `store`.
fn record_outputs<S: Simulation>(
    mechanism: &Mechanism<f64>,
    mut simulation: S,
    times: &[f64],
    mut store: Option<&mut TrajectoryStore<S::Checkpoint>>,
) -> Result<(History, S)> {
    let mut recorder = OutputRecorder::new(mechanism, times.len());
    let (mut y, mut at) = (Vec::new(), simulation.start());
    let mut watch = MotionWatch::new(mechanism, &at);
    let at_start = match simulation.equilibrium() {
        Some(state) => warn_of_unstable_equilibrium(mechanism, &state),
        None => positions_that_do_not_fit(mechanism, &at),
    };
    for &t in times {
        while simulation.is_before(t) {
            simulation.step()?;
            store.iter_mut().for_each(|store| store.push(&simulation));
        }
        store.iter_mut().for_each(|store| store.mark_output(t));
        simulation.sample(t, &mut y, &mut at)?;
        recorder.record_held(mechanism, &at, simulation.held())?;
        watch.add(mechanism, &at);
    }
    let (energy_drift, mut warnings) = watch.finish(mechanism, simulation.tolerance());
    warnings.extend(at_start);
    let history = History {
        names: mechanism.output_names(),
        times: times.to_vec(),
        values: recorder.series,
        last: at,
        impacts: Vec::new(),
        work: Work::default(),
        energy_drift,
        constraint_drift: None,
        coordinates: Coordinates::Absolute,
        warnings,
    };
    Ok((history, simulation))
}
