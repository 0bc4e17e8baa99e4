//! Direct differentiation of a motion by implicit steps.

use crate::analyses::dynamics::Dynamics;
use crate::analyses::sampling::interpolate;
use crate::checkpointing::recording::Recording;
use crate::derivatives::forward::implicit_steps::{ConvergedStep, ImplicitSteps, OutputTimes, StepBlock};
use crate::derivatives::forward::initial_conditions::{InitialDerivatives, ProjectedPart};
use crate::derivatives::forward::saltation::{self, ClosedContact};
use crate::derivatives::history::{OutputGradients, SensitiveHistory};
use crate::derivatives::indeterminate::check_outputs;
use crate::derivatives::propagation::{Schedule, StepConsumer, propagate};
use crate::derivatives::seeding::{SeededMechanisms, set_values, take_values, values_of};
use crate::diagnostics::check_finite;
use crate::elements::element::ElementWorkspace;
use crate::events::held_outputs::HeldOutputs;
use crate::events::impact::simultaneous_switches;
use crate::events::mode_transition::events_at_once;
use crate::integrators::generalized_alpha::Step;
use crate::integrators::velocity_violation::consistent_velocities;
use crate::linalg::factor::{Factor, SolveWorkspace};
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::System;
use crate::system::outputs::Sampler;
use crate::system::state::State;
use crate::{Error, Result};
use error::Seconds;

/// Simulates `model` at the design `b` and differentiates its outputs at `times` (s) with respect to `b`.
///
/// The derivatives are those of the discrete solution. At a converged step, F(x₁, x₀, b) = 0, so
///
/// $$ \frac{\partial F}{\partial x_1}\frac{dx_1}{db} = -\frac{\partial F}{\partial x_0}\frac{dx_0}{db} - \frac{\partial F}{\partial b} $$
///
/// The right-hand side is one evaluation of the residual in dual numbers, for [`WIDTH`](autodiff::WIDTH) design
/// variables at a time (four if there are no more). The matrix is factorized once per step, for all design variables.
/// On two threads or more, the next steps are computed while the derivatives of the previous ones are propagated.
///
/// # Errors
/// As [`simulate`](crate::analyses::dynamics::simulate), and [`Error::Definition`] if the model builds other elements
/// in dual numbers than in `f64`.
///
/// # Sources
/// Haug, Wehage & Mani, *J. Mech. Trans. Autom. Des.* 106 (1984) 156–162; equations (22) to (25) of the paper.
pub fn differentiate<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    simulate_seeded(&mechanism, &SeededMechanisms::build(model, b, &mechanism)?, b.len(), settings, times)
}

/// Differentiates along the steps of a recording of `model` at `b`, which reaches the last of `times`.
///
/// # Errors
/// [`Error::Definition`] if the model builds other elements in dual numbers than in `f64`.
pub fn differentiate_recorded<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    recording: &Recording,
) -> Result<OutputGradients> {
    let mechanism = model.build(b)?;
    let seeded = SeededMechanisms::build(model, b, &mechanism)?;
    propagate_seeded(&seeded, settings, times, &mut ImplicitSteps::recorded(&mechanism, recording, settings, times))
}

// The functions below are not generic over the model: they are compiled once, in this crate.

fn simulate_seeded(
    mechanism: &Mechanism<f64>,
    seeded: &SeededMechanisms,
    variables: usize,
    settings: &Dynamics,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mut steps = ImplicitSteps::simulated(mechanism, settings, times)?;
    let gradients = propagate_seeded(seeded, settings, times, &mut steps)?;
    let (recorder, work) = steps.finish().expect("the steps are simulated");
    Ok(SensitiveHistory::new(mechanism, times, recorder, (&gradients, variables), work))
}

fn propagate_seeded(
    seeded: &SeededMechanisms,
    settings: &Dynamics,
    times: &[f64],
    steps: &mut ImplicitSteps<'_>,
) -> Result<OutputGradients> {
    match seeded {
        SeededMechanisms::Narrow(mechanisms) => propagate_all(mechanisms, settings, times, steps),
        SeededMechanisms::Wide(mechanisms) => propagate_all(mechanisms, settings, times, steps),
    }
}

/// Propagates the `L` derivatives of each of the `mechanisms` to the end of the motion.
pub(crate) fn propagate_all<T: DerivativeScalar<L>, const L: usize>(
    mechanisms: &[Mechanism<T>],
    settings: &Dynamics,
    times: &[f64],
    steps: &mut ImplicitSteps<'_>,
) -> Result<OutputGradients>
where
    Jet2<T>: ElementScalar,
{
    check_outputs(&steps.system, steps.mechanism, &steps.start)?;
    let start = |mechanism| ForwardSensitivity::new(mechanism, steps, settings, times);
    let mut sensitivities = mechanisms.iter().map(start).collect::<Result<Vec<_>>>()?;
    propagate(steps, &mut sensitivities, Schedule::Overlapped)?;
    let chunks = sensitivities.into_iter().map(|sensitivity| sensitivity.derivatives).collect();
    Ok(OutputGradients::new(steps.mechanism.outputs.len(), L, chunks))
}

/// Change of a gap with the design, as a fraction of its terms, below which two events stay simultaneous.
const SIMULTANEOUS: f64 = 1e-6;

/// Checks that two events at the time `t` (s) stay simultaneous in neighbouring designs. The derivatives of the gap of
/// the second event are given at a `fixed` time, and at the time of the first event, which `moved` with the design:
/// they must be equal.
///
/// # Errors
///
/// [`Error::Analysis`] if a change of the design separates them: the motion depends on their order.
pub(crate) fn check_simultaneous<const L: usize>(
    [first, second]: [&str; 2],
    [fixed, moved]: [[f64; L]; 2],
    t: f64,
) -> Result<()> {
    let size = fixed.iter().chain(&moved).fold(0.0, |size: f64, x| size.max(x.abs()));
    let is_same = moved.iter().all(|x| x.abs() <= SIMULTANEOUS * size);
    if is_same { Ok(()) } else { Err(separated(first, second, t)) }
}

/// The error of two events at the time `t` (s) that a change of the design separates.
pub(crate) fn separated(first: &str, second: &str, t: f64) -> Error {
    let why = format!(
        "it crosses zero at the same time as `{second}`, t = {t}, and the design moves one before the other: there is no \
         derivative",
        t = Seconds(t)
    );
    Error::analysis(first, why, "move one of them a little")
}

/// The state of a motion with `L` derivatives, which are propagated along implicit steps.
pub(crate) struct ForwardSensitivity<'m, T, const L: usize> {
    plain: &'m Mechanism<f64>,
    mechanism: &'m Mechanism<T>,
    /// The equations, for their numbering and rows.
    system: System,
    settings: &'m Dynamics,
    times: OutputTimes<'m>,
    pub step: Step<T>,
    at: State<T>,
    started: bool,
    /// The event at the end of the last step.
    closed: Option<ClosedContact>,
    workspace: ElementWorkspace<T>,
    solve_workspace: SolveWorkspace,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
    sampler: Sampler<T>,
    pub held: Option<HeldOutputs<T>>,
    outputs: Vec<T>,
    /// Of the outputs, by time, output and design variable.
    pub derivatives: Vec<f64>,
}

impl<'m, T: DerivativeScalar<L>, const L: usize> ForwardSensitivity<'m, T, L>
where
    Jet2<T>: ElementScalar,
{
    /// Sensitivity at the start of the motion.
    fn new<'s: 'm>(
        mechanism: &'m Mechanism<T>,
        steps: &mut ImplicitSteps<'s>,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let ImplicitSteps { mechanism: plain, system, start: values, projection, .. } = steps;
        let state = InitialDerivatives::new(plain, mechanism, system).start(values, projection, settings)?;
        let mut sensitivity = Self::after(plain, mechanism, system, (Step::from(state), settings), times);
        sensitivity.started = false;
        sensitivity.record_outputs()?;
        Ok(sensitivity)
    }

    /// Sensitivity at the end of a `step` of a motion, whose later output times are `times` (s).
    pub fn after(
        plain: &'m Mechanism<f64>,
        mechanism: &'m Mechanism<T>,
        system: &System,
        (step, settings): (Step<T>, &'m Dynamics),
        times: &'m [f64],
    ) -> Self {
        Self {
            plain,
            mechanism,
            solve_workspace: system.solve_workspace(),
            system: system.clone(),
            settings,
            times: OutputTimes::new(settings.start, times),
            at: step.new.clone(),
            step,
            started: true,
            closed: None,
            workspace: ElementWorkspace::default(),
            rows: vec![T::from(0.0); system.size()],
            changes: vec![[0.0; L]; system.size()],
            sampler: Sampler::new(mechanism),
            held: HeldOutputs::new(mechanism),
            outputs: Vec::new(),
            derivatives: Vec::with_capacity(times.len() * mechanism.outputs.len() * L),
        }
    }

    /// Propagates the derivatives from the beginning of a step to its end.
    fn advance(&mut self, step: &ConvergedStep) -> Result<()> {
        self.apply_event()?;
        if self.started {
            self.step.accept();
            self.set_violation()?;
        }
        self.started = true;
        let begin = self.step.old.t;
        match step.events.closed {
            Some(contact) => self.close_contact(step, contact)?,
            None if begin.is_constant() || !step.events.has_given_end => self.differentiate_step(step),
            // The beginning depends on the design, the end does not.
            None => self.differentiate_step_of(step, -begin + step.end.t)?,
        }
        Ok(())
    }

    /// Differentiates the velocities at the beginning of the step that violate the constraints, where the step rescales them.
    fn set_violation(&mut self) -> Result<()> {
        let Self { plain, mechanism, system, settings, step, .. } = self;
        if !settings.rescales_velocities(plain) || !step.may_rescale() {
            return Ok(());
        }
        let values = values_of(&step.old);
        if let Some((consistent, projection)) = consistent_velocities(system, plain, &values) {
            let mut state = step.old.clone();
            let mut derivatives = InitialDerivatives::new(plain, mechanism, system);
            derivatives.project(ProjectedPart::Velocities, &consistent, &projection, &mut state)?;
            step.set_violation(&state.v);
        }
        Ok(())
    }

    /// Propagates the derivatives along the `steps`, and records those of the outputs that these reach.
    pub fn propagate_along(&mut self, steps: &[ConvergedStep]) -> Result<()> {
        steps.iter().try_for_each(|step| {
            self.advance(step)?;
            self.record_outputs()
        })
    }

    /// Differentiates a step whose length does not depend on the design.
    fn differentiate_step(&mut self, ConvergedStep { h, end: values, factor, .. }: &ConvergedStep) {
        let Dynamics { scheme, prescribed, .. } = self.settings;
        set_values(&mut self.step.new.a, &values.a);
        set_values(&mut self.step.new.l, &values.l);
        self.step.integrate(self.mechanism, scheme, *prescribed, *h);
        take_values(&mut self.step.new, values);
        for _ in 0..T::ORDER {
            self.solve_changes(*h, factor);
            self.step.correct(&self.system, scheme, *h, |equation| T::with(0.0, self.changes[equation]));
        }
    }

    /// Differentiates a step whose length `h` carries derivatives.
    fn differentiate_step_of(&mut self, step: &ConvergedStep, h: T) -> Result<()> {
        let ConvergedStep { h: value, end: values, factor, .. } = step;
        let Dynamics { scheme, prescribed, step: nominal, .. } = self.settings;
        if step.is_extrapolated(*nominal) {
            self.step.extrapolate(self.mechanism, h);
            take_values(&mut self.step.new, values);
            if T::ORDER > 1 {
                self.add_rate_of_acceleration(values, h)?;
            }
            return Ok(());
        }
        set_values(&mut self.step.new.a, &values.a);
        set_values(&mut self.step.new.l, &values.l);
        for correction in 0..=T::ORDER {
            self.step.integrate(self.mechanism, scheme, *prescribed, h);
            take_values(&mut self.step.new, values);
            if correction < T::ORDER {
                self.solve_changes(*value, factor);
                self.step.add_accelerations(&self.system, |equation| T::with(0.0, self.changes[equation]));
            }
        }
        Ok(())
    }

    /// Sets the velocities at the end `values` of an extrapolated step `h` to q̇₀ + ½ h (q̈₀ + q̈): their second derivatives contain the rate of the
    /// acceleration, although `h` is nearly zero.
    fn add_rate_of_acceleration(&mut self, values: &State<f64>, h: T) -> Result<()> {
        let Self { plain, mechanism, system, step, .. } = self;
        let end = saltation::consistent_at_event(plain, mechanism, system, values, &step.new)?;
        for i in 0..end.a.len() {
            step.new.v[i] = step.old.v[i] + (step.old.a[i] + end.a[i]) * h * 0.5;
        }
        step.new.prescribe(mechanism);
        take_values(&mut step.new, values);
        Ok(())
    }

    /// Solves for the corrections of accelerations and multipliers at the end of a step `h`.
    fn solve_changes(&mut self, h: f64, factor: &Factor) {
        let (position, _) = self.step.scheme(&self.settings.scheme).newmark_coefficients(h);
        self.system.residual(self.mechanism, &self.step.new, 1.0 / position, &mut self.workspace, &mut self.rows);
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
        factor.solve_in(&mut self.changes, &mut self.solve_workspace);
    }

    /// Differentiates a step that ends when `contact` closes, at a time that depends on the design.
    fn close_contact(&mut self, step: &ConvergedStep, contact: usize) -> Result<()> {
        let given = T::from(step.h);
        let unit = T::with(0.0, std::array::from_fn(|k| f64::from(u8::from(k == 0))));
        let mut rate = |h| Ok(self.event_value(step, h, contact)?.derivatives()[0]);
        let fixed: f64 = rate(given)?;
        let speed = rate(given + unit)? - fixed;
        let (event, end) = (&self.plain.events[contact], &step.end);
        let gap = event.value_after_step((&self.system, self.settings.start), self.plain, end);
        event.check_crossing(gap, end)?;
        if speed == 0.0 || !speed.is_finite() {
            let name = &self.plain.events[contact].gap.name;
            let why = format!("it is touched with zero speed at t = {}: there is no derivative", Seconds(step.end.t));
            return Err(Error::analysis(name, why, "change the design a little"));
        }
        let mut h = given;
        for _ in 0..T::ORDER {
            let derivatives = self.event_value(step, h, contact)?.derivatives();
            h -= T::with(0.0, derivatives.map(|gap| gap / speed));
        }
        let simultaneous = simultaneous_switches(self.plain, contact, &step.end, step.h);
        for &switch in &simultaneous {
            self.check_simultaneous(step, h, contact, switch)?;
        }
        let nominal = self.settings.step.nominal();
        let at_event = events_at_once(&self.system, self.plain, (contact, &simultaneous), &step.end, nominal)?;
        self.differentiate_step_of(step, h)?;
        self.closed = Some(ClosedContact { contact, at_event, values: step.end.clone() });
        Ok(())
    }

    /// The function of an event at the end of a step, whose length `h` carries derivatives.
    fn event_value(&mut self, step: &ConvergedStep, h: T, event: usize) -> Result<T> {
        self.differentiate_step_of(step, h)?;
        saltation::event_value(self.plain, self.mechanism, &mut self.system, event, &step.end, &self.step.new)
    }

    /// Checks that the `switch` crosses zero with the `contact` in all neighbouring designs: at the end of the step `h`.
    fn check_simultaneous(&mut self, step: &ConvergedStep, h: T, contact: usize, switch: usize) -> Result<()> {
        let fixed = self.event_value(step, T::from(step.h), switch)?.derivatives();
        let moved = self.event_value(step, h, switch)?.derivatives();
        let names = [contact, switch].map(|k| self.plain.events[k].gap.name.as_str());
        check_simultaneous(names, [fixed, moved], step.end.t)
    }

    /// Applies the impact or the switch of the contact that the last step has closed, if any.
    fn apply_event(&mut self) -> Result<()> {
        let Some(closed) = self.closed.take() else { return Ok(()) };
        let (mut state, step) = (self.step.new.clone(), self.settings.step);
        let Self { plain, mechanism, system, held, .. } = self;
        saltation::apply_event(plain, mechanism, system, held, closed, step, &mut state)?;
        self.step.restart(&state);
        Ok(())
    }

    /// Returns whether the last step ends at an event that ends the motion.
    fn has_ended(&self) -> bool {
        self.closed.as_ref().is_some_and(|closed| closed.is_terminal(self.plain))
    }

    /// Records the derivatives of the outputs at the times that the step has reached.
    fn record_outputs(&mut self) -> Result<()> {
        let (end, has_ended) = (self.step.new.t.value(), self.has_ended());
        let at_event = match &self.closed {
            Some(closed) => {
                let Self { plain, mechanism, system, step, .. } = self;
                Some(saltation::consistent_at_event(plain, mechanism, system, &closed.values, &step.new)?)
            }
            None => None,
        };
        let new = at_event.as_ref().unwrap_or(&self.step.new);
        // After the end of the motion the outputs keep their values.
        while let Some(t) = self.times.next_until(if has_ended { f64::INFINITY } else { end }) {
            if has_ended && t >= end {
                self.at.copy_from(new);
            } else {
                interpolate(&self.step.old, new, t, &mut self.at);
            }
            self.sampler.outputs(self.mechanism, &self.at, &mut self.outputs);
            if let Some(held) = &self.held {
                held.replace(&mut self.outputs);
            }
            check_finite(self.mechanism, &self.outputs, t)?;
            self.derivatives.extend(self.outputs.iter().flat_map(|output| output.derivatives()));
        }
        Ok(())
    }
}

impl<T: DerivativeScalar<L>, const L: usize> StepConsumer<StepBlock> for ForwardSensitivity<'_, T, L>
where
    Jet2<T>: ElementScalar,
{
    fn propagate(&mut self, block: &StepBlock) -> Result<()> {
        self.propagate_along(block.steps())
    }
}
