//! Semi-analytical differentiation of a motion by implicit steps.

use crate::analyses::dynamics::Dynamics;
use crate::analyses::sampling::{interpolate, interpolate_inside};
use crate::checkpointing::recording::Recording;
use crate::derivatives::forward::dynamics::separated;
use crate::derivatives::forward::implicit_steps::{ConvergedStep, ImplicitSteps, OutputTimes, StepBlock};
use crate::derivatives::forward::initial_conditions::ProjectedPart;
use crate::derivatives::forward::saltation::ClosedContact;
use crate::derivatives::history::{OutputGradients, SensitiveHistory};
use crate::derivatives::indeterminate::check_outputs;
use crate::derivatives::propagation::{Schedule, StepConsumer, propagate};
use crate::derivatives::semi_analytical::central_difference::{CentralDifference, moved_state, set_difference};
use crate::derivatives::semi_analytical::initial_conditions::InitialDifferences;
use crate::elements::element::ElementWorkspace;
use crate::events::impact::{apply_impact, apply_switch, event_offset, make_consistent, simultaneous_switches};
use crate::events::mode_transition::{events_at_once, find_transition};
use crate::integrators::consistent_ends::at_event;
use crate::integrators::generalized_alpha::Step;
use crate::integrators::velocity_violation::consistent_velocities;
use crate::linalg::factor::SolveWorkspace;
use crate::mechanism::output::{EventSide, HeldFrom};
use crate::mechanism::{Mechanism, ParametricMechanism, refuse_switches};
use crate::system::System;
use crate::system::outputs::Sampler;
use crate::system::state::State;
use crate::{Error, Result};
use error::Seconds;

/// Simulates `model` at the design `b` and differentiates its outputs at `times` (s) semi-analytically, with the relative
/// step `step` of the differences (see [`STEP`](crate::derivatives::semi_analytical::STEP)).
///
/// # Errors
/// As [`simulate`](crate::analyses::dynamics::simulate); [`Error::Option`](crate::Error::Option) for a step that is not
/// between 0 and 1; [`Error::Definition`](crate::Error::Definition) if the design decides which elements are built;
/// [`Error::Unsupported`](crate::Error::Unsupported) if the mechanism has a [switch](crate::Mechanism::switch).
pub fn differentiate_semi_analytically<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    step: f64,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let differences = CentralDifference::by_each_variable(model, b, step, &mechanism)?;
    let mut steps = ImplicitSteps::simulated(&mechanism, settings, times)?;
    let gradients = propagate_differences(differences, settings, times, &mut steps)?;
    let (recorder, work) = steps.finish().expect("the steps are simulated");
    Ok(SensitiveHistory::new(&mechanism, times, recorder, (&gradients, b.len()), work))
}

/// Differentiates semi-analytically along the steps of a recording of `model` at `b`, which reaches the last of `times`.
///
/// # Errors
/// As [`differentiate_semi_analytically`], without those of the simulation.
pub fn differentiate_recorded<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    recording: &Recording,
    step: f64,
) -> Result<OutputGradients> {
    let mechanism = model.build(b)?;
    let differences = CentralDifference::by_each_variable(model, b, step, &mechanism)?;
    let mut steps = ImplicitSteps::recorded(&mechanism, recording, settings, times);
    propagate_differences(differences, settings, times, &mut steps)
}

/// Propagates the derivatives with respect to all design variables to the end of the motion.
fn propagate_differences(
    mut differences: Vec<CentralDifference>,
    settings: &Dynamics,
    times: &[f64],
    steps: &mut ImplicitSteps<'_>,
) -> Result<OutputGradients> {
    let (plain, start) = (steps.mechanism, steps.start.clone());
    let why = "semi-analytical derivatives take differences across the jump of the force at a switch";
    refuse_switches(&plain.events, why, "take direct or adjoint derivatives, or an event that activates the force")?;
    check_outputs(&steps.system, plain, &start)?;
    let mut initial = InitialDifferences { plain, system: &mut steps.system };
    let states = initial.start(&mut differences, &start, &steps.projection, settings)?;
    let begin = |pair| DifferenceSensitivity::new(pair, plain, &steps.system, &start, settings, times);
    let mut sensitivities = differences.into_iter().zip(states).map(begin).collect::<Result<Vec<_>>>()?;
    propagate(steps, &mut sensitivities, Schedule::Overlapped)?;
    let derivatives = sensitivities.into_iter().map(|sensitivity| sensitivity.derivatives).collect();
    Ok(OutputGradients::new(plain.outputs.len(), 1, derivatives))
}

/// Largest number of differences of the residual in a step; two suffice unless rounding or curvature is large.
const PASSES: usize = 4;

/// A correction that is small enough to stop, and the largest one that the last pass may leave, as fractions of the
/// derivatives.
const SETTLED: f64 = 1e-9;
const UNSETTLED: f64 = 1e-3;

/// Displacement in m or rad, for a change of the design variable by its own size, that counts as rounding. It is the
/// scale of the derivatives of positions where nothing moves and all positions are zero.
const NOWHERE: f64 = 1e-24;

/// The derivatives of a motion with respect to one design variable, which are propagated along implicit steps.
struct DifferenceSensitivity<'m> {
    difference: CentralDifference,
    plain: &'m Mechanism<f64>,
    system: System,
    settings: &'m Dynamics,
    times: OutputTimes<'m>,
    /// The states at both ends of the step.
    values: Step<f64>,
    /// Their derivatives.
    sensitivity: Step<f64>,
    /// Derivatives of the times of both ends. They are zero unless an end is at an event.
    time_rates: [f64; 2],
    /// Derivatives of the lengths of the step before and of this one.
    length_rates: [f64; 2],
    /// The event at the end of the last step.
    closed: Option<ClosedContact>,
    /// Derivatives of the outputs that keep the value of an event which has happened.
    held: Vec<Option<f64>>,
    started: bool,
    /// Largest size of the derivatives of positions so far.
    largest: f64,
    at: State<f64>,
    sensitivity_at: State<f64>,
    workspace: ElementWorkspace<f64>,
    solve_workspace: SolveWorkspace,
    changes: Vec<[f64; 1]>,
    sampler: Sampler<f64>,
    /// Of the outputs, by time and output.
    derivatives: Vec<f64>,
}

impl<'m> DifferenceSensitivity<'m> {
    /// Sensitivity at the initial state `start` of a motion, with its derivatives.
    fn new(
        (difference, sensitivity): (CentralDifference, State<f64>),
        plain: &'m Mechanism<f64>,
        system: &System,
        start: &State<f64>,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let mut begin = Self {
            difference,
            plain,
            solve_workspace: system.solve_workspace(),
            changes: vec![[0.0]; system.size()],
            system: system.clone(),
            settings,
            times: OutputTimes::new(settings.start, times),
            values: Step::from(start.clone()),
            time_rates: [0.0; 2],
            length_rates: [0.0; 2],
            closed: None,
            held: vec![None; plain.outputs.len()],
            at: start.clone(),
            sensitivity_at: sensitivity.clone(),
            sensitivity: Step::from(sensitivity),
            started: false,
            largest: 0.0,
            workspace: ElementWorkspace::default(),
            sampler: Sampler::new(plain),
            derivatives: Vec::with_capacity(times.len() * plain.outputs.len()),
        };
        begin.record_outputs()?;
        Ok(begin)
    }

    /// Propagates the derivatives from the beginning of a step to its end.
    fn advance(&mut self, step: &ConvergedStep) -> Result<()> {
        self.apply_event()?;
        if self.started {
            self.sensitivity.accept();
            self.values.accept();
        }
        (self.time_rates[0], self.length_rates[0]) = (self.time_rates[1], self.length_rates[1]);
        if self.started {
            self.set_violation()?;
        }
        self.started = true;
        let Dynamics { scheme, prescribed, .. } = self.settings;
        self.values.new.a.copy_from_slice(&step.end.a);
        self.values.integrate(self.plain, scheme, *prescribed, step.h);
        self.values.new.copy_from(&step.end);
        let Step { old, new, .. } = &mut self.sensitivity;
        new.a.copy_from_slice(&old.a);
        new.l.copy_from_slice(&old.l);
        match step.events.closed {
            Some(contact) => self.close_contact(step, contact),
            // The end is at a given time.
            None if step.events.has_given_end => self.differentiate_step(step, -self.time_rates[0]),
            None => self.differentiate_step(step, 0.0),
        }
    }

    /// Differentiates the velocities at the beginning of the step that violate the constraints, where the step rescales them.
    fn set_violation(&mut self) -> Result<()> {
        let Self { plain, settings, system, values, sensitivity, difference, time_rates, .. } = self;
        if !settings.rescales_velocities(plain) || !values.may_rescale() {
            return Ok(());
        }
        if let Some((consistent, projection)) = consistent_velocities(system, plain, &values.old) {
            let mut state = State { l: vec![0.0; values.old.l.len()], ..sensitivity.old.clone() };
            difference.time_rate = time_rates[0];
            let (differences, states) = (std::slice::from_mut(difference), std::slice::from_mut(&mut state));
            let velocities = ProjectedPart::Velocities;
            InitialDifferences { plain, system }.project(velocities, differences, &consistent, &projection, states)?;
            values.set_violation(&consistent.v);
            sensitivity.set_violation(&state.v);
        }
        Ok(())
    }

    /// Differentiates a step whose length has the derivative `rate`.
    ///
    /// The derivatives of accelerations and multipliers start from those of the last step, and are corrected by the
    /// differenced residual until the correction is small. The first difference is taken along a direction that violates the
    /// linearized constraints and stretches stiff elements; its error grows with the cube of this violation. The next one is
    /// taken along a direction that satisfies them.
    fn differentiate_step(&mut self, step: &ConvergedStep, rate: f64) -> Result<()> {
        self.length_rates[1] = rate;
        self.time_rates[1] = self.time_rates[0] + rate;
        self.difference.time_rate = self.time_rates[1];
        let Dynamics { scheme, prescribed, .. } = self.settings;
        self.sensitivity.new.t = step.end.t;
        if step.is_extrapolated(self.settings.step) {
            self.integrate_moved(step);
            self.sensitivity.new.l.copy_from_slice(&self.sensitivity.old.l);
            return Ok(());
        }
        if step.events.depends_on_event() {
            self.integrate_moved(step);
        } else {
            let new = &mut self.sensitivity.new;
            self.difference.prescribe(new, |mechanism, state| state.prescribe_positions(mechanism, *prescribed));
            self.sensitivity.integrate_prescribed(self.plain, scheme, *prescribed, step.h);
        }
        let mut correction = f64::INFINITY;
        self.largest = self.largest.max(self.scale());
        for pass in 0..PASSES {
            correction = self.correct(step);
            if pass > 0 && correction <= SETTLED * self.scale() {
                return Ok(());
            }
        }
        let zero = f64::EPSILON * self.largest + NOWHERE / self.difference.size();
        if correction <= zero.max(UNSETTLED * self.scale()) { Ok(()) } else { Err(self.failure(correction)) }
    }

    /// Differentiates the formulas of a step whose length or time depends on an event: differences of two steps.
    fn integrate_moved(&mut self, step: &ConvergedStep) {
        let Self { difference, values, sensitivity, settings, time_rates, length_rates, .. } = self;
        let moved = difference.sides().map(|(mechanism, by)| {
            let old = moved_state(&values.old, &sensitivity.old, time_rates[0], by);
            let mut moved = values.moved(sensitivity, old, length_rates[0], by);
            if step.is_extrapolated(settings.step) {
                moved.extrapolate(mechanism, step.h + by * length_rates[1]);
                return moved;
            }
            let accelerations = step.end.a.iter().zip(&sensitivity.new.a);
            moved.new.a.iter_mut().zip(accelerations).for_each(|(to, (a, rate))| *to = a + by * rate);
            moved.integrate(mechanism, &settings.scheme, settings.prescribed, step.h + by * length_rates[1]);
            moved
        });
        sensitivity.set_end_difference(moved.each_ref(), difference.width(), step.h);
    }

    /// Differentiates a step that ends when `contact` closes, at a time that depends on the design.
    fn close_contact(&mut self, step: &ConvergedStep, contact: usize) -> Result<()> {
        let simultaneous = simultaneous_switches(self.plain, contact, &step.end, step.h);
        self.differentiate_step(step, 0.0)?;
        let fixed = self.gap_rate(step, contact);
        let others: Vec<f64> = simultaneous.iter().map(|&event| self.gap_rate(step, event)).collect();
        let nominal = self.settings.step.nominal();
        let length = if step.is_extrapolated(self.settings.step) { nominal } else { step.h };
        let mut rate = length / self.difference.size();
        self.differentiate_step(step, rate)?;
        let speed = (self.gap_rate(step, contact) - fixed) / rate;
        let event = &self.plain.events[contact];
        let gap = event.value_after_step((&self.system, self.settings.start), self.plain, &step.end);
        event.check_crossing(gap, &step.end)?;
        let name = &event.gap.name;
        if speed == 0.0 || !speed.is_finite() {
            let why = format!(
                "it is touched with zero speed at t = {}, where differences of the residual have no derivative",
                Seconds(step.end.t)
            );
            return Err(Error::unsupported(
                name,
                why,
                "use the direct or the adjoint method, or change the design a little",
            ));
        }
        rate = -fixed / speed;
        for _ in 0..2 {
            self.differentiate_step(step, rate)?;
            rate -= self.gap_rate(step, contact) / speed;
        }
        self.differentiate_step(step, rate)?;
        for (&event, fixed) in simultaneous.iter().zip(others) {
            let moved = self.gap_rate(step, event);
            if moved.abs() > UNSETTLED * fixed.abs().max(moved.abs()) {
                return Err(separated(name, &self.plain.events[event].gap.name, step.end.t));
            }
        }
        let at_event = events_at_once(&self.system, self.plain, (contact, &simultaneous), &step.end, nominal)?;
        self.closed = Some(ClosedContact { contact, at_event, values: step.end.clone() });
        Ok(())
    }

    /// Derivative of the gap of an event at the end of the step.
    fn gap_rate(&mut self, step: &ConvergedStep, event: usize) -> f64 {
        let system = (&self.system, self.settings.start);
        let gap = |mechanism: &Mechanism<f64>, state: &State<f64>, out: &mut Vec<f64>| {
            out.clear();
            out.push(mechanism.events[event].value_after_step(system, mechanism, state));
        };
        self.difference.derivatives(&step.end, &self.sensitivity.new, gap).sum()
    }

    /// Applies the event at the end of the last step, if any, to the state and to the states on both sides of it.
    fn apply_event(&mut self) -> Result<()> {
        let Some(ClosedContact { contact, at_event, values }) = self.closed.take() else { return Ok(()) };
        self.hold_outputs(EventSide::Before, &at_event, &values);
        let Self { difference, sensitivity, system, plain, settings, time_rates, .. } = self;
        let is_impact = plain.events[contact].is_open_contact(&values.modes);
        let transition =
            find_transition(&mut system.clone(), plain, (contact, &at_event), &values, settings.step.nominal())?;
        let mut offset = None;
        let mut apply = |mechanism: &Mechanism<f64>, mut state: State<f64>| -> Result<State<f64>> {
            // The matrix of the equations has the constant masses of its mechanism.
            let mut system = system.of_design(mechanism, settings.start)?;
            state.modes = transition.jump.clone();
            match is_impact {
                true => apply_impact(&mut system, mechanism, (contact, transition.stays), &mut state)?,
                false => make_consistent(&mut system, mechanism, &mut state)?,
            };
            state.modes = transition.after.clone();
            let nominal = settings.step.nominal();
            let offset = *offset.get_or_insert_with(|| event_offset(plain, &at_event, &state, nominal));
            apply_switch(&mut system, mechanism, offset, &mut state)?;
            Ok(state)
        };
        let after = apply(plain, values.clone())?;
        let [above, below] =
            difference.sides().map(|(m, by)| apply(m, moved_state(&values, &sensitivity.new, time_rates[1], by)));
        let mut derivatives = sensitivity.new.clone();
        set_difference(&mut derivatives, [&above?, &below?], difference.width());
        sensitivity.restart(&derivatives);
        self.values.restart(&after);
        self.hold_outputs(EventSide::After, &at_event, &after);
        Ok(())
    }

    /// Differentiates the outputs that are held from one of the `events` on, in the state `values` on this `side` of it.
    fn hold_outputs(&mut self, side: EventSide, events: &[usize], values: &State<f64>) {
        let is_held =
            |from: Option<HeldFrom>| from.is_some_and(|from| from.side == side && events.contains(&from.event));
        if !self.plain.outputs.iter().any(|output| is_held(output.held)) {
            return;
        }
        let (sampler, system) = (&mut self.sampler, (&self.system, self.settings.start));
        let derivatives =
            self.difference.derivatives(values, &self.sensitivity.new, |mechanism, state, outputs| match side {
                EventSide::Before => {
                    sampler.outputs(mechanism, &consistent_at_event(system, mechanism, state), outputs)
                }
                EventSide::After => sampler.outputs(mechanism, state, outputs),
            });
        for ((held, output), derivative) in self.held.iter_mut().zip(&self.plain.outputs).zip(derivatives) {
            if is_held(output.held) {
                held.get_or_insert(derivative);
            }
        }
    }

    /// Returns whether the last step ends at an event that ends the motion.
    fn has_ended(&self) -> bool {
        self.closed.as_ref().is_some_and(|closed| closed.is_terminal(self.plain))
    }

    /// Corrects the derivatives at the end of a step; returns the largest correction of a position.
    fn correct(&mut self, ConvergedStep { h, end, factor, .. }: &ConvergedStep) -> f64 {
        let scheme = &self.settings.scheme;
        let (position, _) = self.sensitivity.scheme(scheme).newmark_coefficients(*h);
        let (system, workspace, size) = (&self.system, &mut self.workspace, self.changes.len());
        let derivatives = self.difference.derivatives(end, &self.sensitivity.new, |mechanism, state, rows| {
            rows.resize(size, 0.0);
            system.residual(mechanism, state, 1.0 / position, workspace, rows);
        });
        self.changes.iter_mut().zip(derivatives).for_each(|(change, derivative)| *change = [-derivative]);
        factor.solve_in(&mut self.changes, &mut self.solve_workspace);
        let changes = &self.changes;
        self.sensitivity.correct(&self.system, scheme, *h, |equation| changes[equation][0]);
        system.largest_coordinate_row(changes) * position
    }

    /// Size of a position's derivative: the largest of them, but at least the largest position for a change of the design
    /// variable by its own size, at both ends of the step: a step may end where all positions are zero.
    fn scale(&self) -> f64 {
        let largest =
            |step: &Step<f64>| step.old.q.iter().chain(&step.new.q).fold(0.0, |most: f64, x| most.max(x.abs()));
        largest(&self.sensitivity).max(largest(&self.values) / self.difference.size())
    }

    /// The error of differences that do not settle: the derivatives would be noise.
    fn failure(&self, correction: f64) -> Error {
        let why = format!(
            "the differences of the residual do not settle at t = {}: the last correction of a position's derivative is \
             {correction:.1e}",
            Seconds(self.values.new.t)
        );
        Error::analysis(
            "the semi-analytical derivative",
            why,
            "use the direct or adjoint method, or another step of the differences",
        )
    }

    /// Interpolates the state and its derivatives at the time `t` (s) in the step.
    fn sample(&mut self, t: f64) {
        let Self { difference, values, sensitivity, system, at, sensitivity_at, time_rates, .. } = self;
        let system = (&*system, self.settings.start);
        let at_event = self.closed.as_ref().map(|_| consistent_at_event(system, self.plain, &values.new));
        interpolate(&values.old, at_event.as_ref().unwrap_or(&values.new), t, at);
        difference.time_rate = 0.0;
        if *time_rates == [0.0; 2] && at_event.is_none() {
            (sensitivity.old.t, sensitivity.new.t) = (values.old.t, values.new.t);
            return interpolate(&sensitivity.old, &sensitivity.new, t, sensitivity_at);
        }
        let is_event = at_event.is_some();
        let moved = difference.sides().map(|(mechanism, by)| {
            let old = moved_state(&values.old, &sensitivity.old, time_rates[0], by);
            let mut new = moved_state(&values.new, &sensitivity.new, time_rates[1], by);
            if is_event {
                new = consistent_at_event(system, mechanism, &new);
            }
            let mut moved = at.clone();
            interpolate_inside(&old, &new, t, &mut moved);
            moved
        });
        set_difference(sensitivity_at, moved.each_ref(), difference.width());
    }

    /// Records the derivatives of the outputs at the times that the step has reached.
    fn record_outputs(&mut self) -> Result<()> {
        let (end, has_ended) = (self.values.new.t, self.has_ended());
        // After the end of the motion the outputs keep their values.
        while let Some(t) = self.times.next_until(if has_ended { f64::INFINITY } else { end }) {
            let is_after_end = has_ended && t >= end;
            if is_after_end {
                self.at.copy_from(&self.values.new);
                self.sensitivity_at.copy_from(&self.sensitivity.new);
                self.difference.time_rate = self.time_rates[1];
            } else {
                self.sample(t);
            }
            let (from, sampler) = (self.derivatives.len(), &mut self.sampler);
            let system = (&self.system, self.settings.start);
            let derivatives =
                self.difference.derivatives(&self.at, &self.sensitivity_at, |mechanism, state, outputs| {
                    if is_after_end {
                        sampler.outputs(mechanism, &consistent_at_event(system, mechanism, state), outputs);
                    } else {
                        sampler.outputs(mechanism, state, outputs);
                    }
                });
            self.derivatives.extend(derivatives.zip(&self.held).map(|(derivative, held)| held.unwrap_or(derivative)));
            if let Some(k) = self.derivatives[from..].iter().position(|derivative| !derivative.is_finite()) {
                let why = format!("its semi-analytical derivative is not finite at t = {t}", t = Seconds(t));
                let remedy = "use a shorter step of the differences, or the direct or adjoint method";
                return Err(Error::analysis(&self.plain.outputs[k].name, why, remedy));
            }
        }
        Ok(())
    }
}

/// The `state` at the end of a step that ends at an event, with the accelerations and multipliers of the equations of motion. `system` is that
/// of this or another design, and `start` the start of the motion in s.
fn consistent_at_event((system, start): (&System, f64), mechanism: &Mechanism<f64>, state: &State<f64>) -> State<f64> {
    let system = system.of_design(mechanism, start);
    system.map_or_else(|_| state.clone(), |mut system| at_event(&mut system, mechanism, state))
}

impl StepConsumer<StepBlock> for DifferenceSensitivity<'_> {
    fn propagate(&mut self, block: &StepBlock) -> Result<()> {
        block.steps().iter().try_for_each(|step| {
            self.advance(step)?;
            self.record_outputs()
        })
    }
}
