//! Explicit steps that are repeated in numbers with derivatives: second derivatives, and motions with events.
//!
//! The stages of a step are the formulas of the method in numbers with derivatives. Its accelerations, and the projections at
//! its end, solve linear systems whose factorized matrices are recorded; their derivatives follow by one correction for each
//! order. A step that ends at an event has a length h(b) with g(x₁(h, b), b) = 0, and the step after it ends at a given time:
//! both lengths carry derivatives, see [`saltation`].

use crate::analyses::sampling::OutputRecorder;
use crate::derivatives::forward::dynamics::check_simultaneous;
use crate::derivatives::forward::explicit::explicit_steps::{ExplicitSteps, StepEvent};
use crate::derivatives::forward::explicit::relative_steps::propagate_relative;
use crate::derivatives::forward::initial_conditions::InitialDerivatives;
use crate::derivatives::forward::saltation::{self, ClosedContact};
use crate::derivatives::history::OutputGradients;
use crate::derivatives::indeterminate::check_outputs;
use crate::derivatives::propagation::{Schedule, StepConsumer, StepSource, propagate};
use crate::derivatives::seeding::{set_values, take_values};
use crate::diagnostics::check_finite;
use crate::elements::element::{ElementState, ElementWorkspace, SwitchSides};
use crate::events::held_outputs::HeldOutputs;
use crate::events::impact::simultaneous_switches;
use crate::events::mode_transition::events_at_once;
use crate::initial_conditions::acceleration_rows;
use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::mechanism::{
    ConsistentState, MechanismRhs, SAMPLE, StageRecord, StepRecord, sample, start,
};
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::tableau::Tableau;
use crate::integrators::settings::{StepSize, Work};
use crate::linalg::factor::{Factor, SolveWorkspace};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::system::outputs::Sampler;
use crate::system::state::{State, gather};
use crate::system::{System, Unknown};
use crate::{Error, Result};
use error::Seconds;

/// Simulates `plain` by explicit steps and propagates the `L` derivatives of each of the `mechanisms` to the last of `times`.
pub(crate) fn propagate_repeated<T: DerivativeScalar<L>, const L: usize>(
    plain: &Mechanism<f64>,
    mechanisms: &[Mechanism<T>],
    settings: &Explicit,
    times: &[f64],
) -> Result<(OutputRecorder, Work, OutputGradients)>
where
    Jet2<T>: ElementScalar,
{
    let (mut driver, begin) = start(plain, settings, times, true)?;
    let relative = driver.stepper.rhs.relative.as_ref().map(|relative| relative.dynamics.tree.clone());
    if let Some(tree) = relative {
        return propagate_relative(mechanisms, &tree, driver, &begin, times);
    }
    let (method, rhs) = (driver.stepper.method, &mut driver.stepper.rhs);
    let step = rhs.locator.as_ref().map_or(StepSize::Fixed(0.0), |locator| locator.step());
    check_outputs(&rhs.system, plain, &begin.state)?;
    let sensitivity =
        |mechanism| DualSteps::new((plain, mechanism), &mut rhs.system, method, &begin, (times.len(), step));
    let mut sensitivities = mechanisms.iter().map(sensitivity).collect::<Result<Vec<_>>>()?;
    let recorder = OutputRecorder::new(plain, times.len());
    let mut steps = RecordedSteps { mechanism: plain, steps: ExplicitSteps::new(driver, times), recorder };
    propagate(&mut steps, &mut sensitivities, Schedule::Parallel)?;
    let derivatives = sensitivities.into_iter().map(|sensitivity| sensitivity.derivatives).collect();
    let gradients = OutputGradients::new(plain.outputs.len(), L, derivatives);
    Ok((steps.recorder, steps.steps.driver.work(), gradients))
}

/// The function whose zero is the end of a step.
#[derive(Clone, Copy)]
enum StepEnd {
    /// The gap of a contact or the condition of an event.
    Event(usize),
    /// A switching function of an element, at whose zero the forces are continuous and their derivatives are not.
    Switch(usize),
}

/// The stages of a step.
struct RecordedStep {
    action: StepEvent,
    /// States and factorizations, moved here from the equations while derivatives are computed.
    record: Option<StepRecord>,
    /// The reason for a length that depends on the design, and the length in s.
    closed: Option<(StepEnd, f64)>,
    /// True if the rates at the beginning of the step are on other sides of switching functions than those at the end of the last one.
    is_restarted: bool,
    /// Distribution of the stages.
    grading: Grading,
}

/// The explicit steps of a mechanism, whose outputs are recorded.
struct RecordedSteps<'m> {
    mechanism: &'m Mechanism<f64>,
    steps: ExplicitSteps<'m, MechanismRhs<'m>>,
    recorder: OutputRecorder,
}

impl StepSource for RecordedSteps<'_> {
    type Block = RecordedStep;

    fn block(&mut self) -> RecordedStep {
        RecordedStep {
            action: StepEvent::Start,
            record: None,
            closed: None,
            is_restarted: false,
            grading: Grading::Even,
        }
    }

    /// Fills the block with one step, or with the state at one output time.
    fn fill(&mut self, step: &mut RecordedStep) -> Result<bool> {
        let Self { mechanism, steps, recorder } = self;
        if step.record.is_some() {
            steps.driver.stepper.rhs.record = step.record.take();
        }
        let Some(action) = steps.advance(sample)? else { return Ok(false) };
        let stepper = &mut steps.driver.stepper;
        step.action = action;
        match action {
            StepEvent::Start => {}
            StepEvent::Step([begin, end]) => {
                let event = stepper.rhs.locator.as_ref().and_then(|locator| locator.closed).map(StepEnd::Event);
                let switch = steps.driver.switches.crossed.map(StepEnd::Switch);
                step.closed = event.or(switch).map(|at| (at, end - begin));
                step.is_restarted = steps.driver.switches.is_restarted;
                step.grading = stepper.grading;
                if step.closed.is_some() {
                    stepper.make_dense()?; // the end is inside the steps of other designs
                }
            }
            StepEvent::Output { .. } => {
                let held = stepper.rhs.locator.as_ref().and_then(|locator| locator.held.as_ref());
                recorder.record_held(mechanism, &stepper.rhs.state, held)?;
            }
        }
        step.record = stepper.rhs.record.take();
        Ok(true)
    }
}

/// The state of a motion with `L` derivatives, which are propagated along repeated explicit steps.
struct DualSteps<'m, T, const L: usize> {
    plain: &'m Mechanism<f64>,
    mechanism: &'m Mechanism<T>,
    system: System,
    method: &'static Tableau,
    /// The state at the beginning of the step.
    begin: State<T>,
    /// The state at the end, with accelerations and multipliers.
    end: State<T>,
    /// Length of the step in s.
    h: T,
    /// Distribution of its stages.
    grading: Grading,
    /// Rates of positions and velocities, slot by slot; those of prescribed coordinates are zero.
    rates: Vec<Vec<T>>,
    /// The state at a stage.
    stage: State<T>,
    is_started: bool,
    /// True after the evaluation of the slots for dense output.
    is_dense: bool,
    /// The event at the end of the step.
    closed: Option<ClosedContact>,
    /// Longest time in s after an event at which forces are evaluated.
    event_step: StepSize,
    workspace: ElementWorkspace<T>,
    jets: ElementWorkspace<Jet2<T>>,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
    solve_workspace: SolveWorkspace,
    sampler: Sampler<T>,
    held: Option<HeldOutputs<T>>,
    outputs: Vec<T>,
    /// Of the outputs, by time, output and design variable.
    derivatives: Vec<f64>,
}

impl<'m, T: DerivativeScalar<L>, const L: usize> DualSteps<'m, T, L>
where
    Jet2<T>: ElementScalar,
{
    /// Derivatives at the start of a motion with a number of output `times`.
    fn new(
        (plain, mechanism): (&'m Mechanism<f64>, &'m Mechanism<T>),
        system: &mut System,
        method: &'static Tableau,
        begin: &ConsistentState,
        (times, event_step): (usize, StepSize),
    ) -> Result<Self> {
        let state = InitialDerivatives::new(plain, mechanism, system).consistent(&begin.state, &begin.projection)?;
        let zero = T::from(0.0);
        Ok(Self {
            plain,
            mechanism,
            solve_workspace: system.solve_workspace(),
            system: system.clone(),
            method,
            begin: state.clone(),
            end: state.clone(),
            h: zero,
            grading: Grading::Even,
            rates: vec![vec![zero; 2 * state.q.len()]; method.slots()],
            stage: state,
            is_started: false,
            is_dense: false,
            closed: None,
            event_step,
            workspace: ElementWorkspace::default(),
            jets: ElementWorkspace::default(),
            rows: vec![zero; system.size()],
            changes: vec![[0.0; L]; system.size()],
            sampler: Sampler::new(mechanism),
            held: HeldOutputs::new(mechanism),
            outputs: Vec::new(),
            derivatives: Vec::with_capacity(times * mechanism.outputs.len() * L),
        })
    }

    /// Evaluates the state at the start of the motion.
    fn start(&mut self, record: &StepRecord) {
        self.stage.copy_from(&self.begin);
        self.solve_accelerations(&record.stages[0]);
        self.store_rates(0);
        self.end.copy_from(&self.stage);
    }

    /// Propagates the derivatives to the end of the `step`, which is at `end` (s), and at the zero of the function `step.closed`.
    fn advance(&mut self, record: &StepRecord, end: f64, step: &RecordedStep) -> Result<()> {
        if self.is_started {
            self.accept()?;
        }
        if step.is_restarted {
            self.stage.copy_from(&self.begin);
            self.solve_accelerations(&record.stages[0]);
            self.store_rates(0);
        }
        (self.is_started, self.is_dense, self.grading) = (true, false, step.grading);
        match step.closed {
            Some((at, length)) => self.end_at_zero(record, at, length),
            None => {
                self.repeat_step(record, -self.begin.t + end);
                Ok(())
            }
        }
    }

    /// Makes the end of the step the beginning of the next one, after the event there.
    fn accept(&mut self) -> Result<()> {
        self.rates.swap(0, self.method.end);
        if let Some(closed) = self.closed.take() {
            let Self { plain, mechanism, system, held, end, .. } = self;
            saltation::apply_event(plain, mechanism, system, held, closed, self.event_step, end)?;
            self.stage.copy_from(end);
            self.store_rates(0);
        }
        self.begin.copy_from(&self.end);
        Ok(())
    }

    /// Repeats the step with the length `h`, which may carry derivatives.
    fn repeat_step(&mut self, record: &StepRecord, h: T) {
        self.h = h;
        (1..self.method.end).for_each(|slot| self.evaluate(record, slot));
        self.combine(self.method.end, &record.stages[self.method.end].state);
        if self.plain.multipliers > 0 {
            self.project(record);
        }
        self.solve_accelerations(&record.stages[self.method.end]);
        self.store_rates(self.method.end);
        self.end.copy_from(&self.stage);
    }

    /// The function `at` at the end of the step.
    fn end_function(&mut self, at: StepEnd) -> T {
        let k = match at {
            StepEnd::Event(event) => return self.mechanism.events[event].gap(&self.end),
            StepEnd::Switch(k) => k,
        };
        let mut values = Vec::new();
        for instance in &self.mechanism.elements {
            gather(instance, &self.end, &mut self.workspace);
            let local = self.workspace.local(self.end.t);
            let local = ElementState { p: &instance.parameters, sides: SwitchSides::default(), ..local };
            T::switching_functions(instance.element.as_ref(), &local, &mut values);
        }
        values[k]
    }

    /// Name of the element with the function `at`.
    fn name_of(&self, at: StepEnd) -> &str {
        match at {
            StepEnd::Event(event) => &self.plain.events[event].gap.name,
            StepEnd::Switch(_) => "a contact",
        }
    }

    /// Repeats a step of the given `length` (s) that ends at a zero of the function `at`, at a time that depends on the design.
    fn end_at_zero(&mut self, record: &StepRecord, at: StepEnd, length: f64) -> Result<()> {
        let values = &record.stages[self.method.end].state;
        let given = T::from(length);
        let unit = T::with(0.0, std::array::from_fn(|k| f64::from(u8::from(k == 0))));
        let [fixed, moved] = [given, given + unit].map(|h| {
            self.repeat_step(record, h);
            self.end_function(at).derivatives()[0]
        });
        let speed = moved - fixed;
        if let StepEnd::Event(contact) = at {
            let event = &self.plain.events[contact];
            event.check_crossing(event.gap(values), values)?;
        }
        if speed == 0.0 || !speed.is_finite() {
            let why = format!("it is touched with zero speed at t = {}: there is no derivative", Seconds(values.t));
            return Err(Error::analysis(self.name_of(at), why, "change the design a little"));
        }
        let mut h = given;
        for _ in 0..T::ORDER {
            self.repeat_step(record, h);
            h -= T::with(0.0, self.end_function(at).derivatives().map(|value| value / speed));
        }
        let StepEnd::Event(contact) = at else {
            self.repeat_step(record, h);
            return Ok(());
        };
        let simultaneous = simultaneous_switches(self.plain, contact, values, length);
        for &event in &simultaneous {
            let rates = [given, h].map(|h| {
                self.repeat_step(record, h);
                self.mechanism.events[event].gap(&self.end).derivatives()
            });
            let names = [contact, event].map(|k| self.plain.events[k].gap.name.as_str());
            check_simultaneous(names, rates, values.t)?;
        }
        self.repeat_step(record, h);
        let nominal = self.event_step.nominal();
        let at_event = events_at_once(&self.system, self.plain, (contact, &simultaneous), values, nominal)?;
        self.closed = Some(ClosedContact { contact, at_event, values: values.clone() });
        Ok(())
    }

    /// The rates of a slot.
    fn evaluate(&mut self, record: &StepRecord, slot: usize) {
        self.combine(slot, &record.stages[slot].state);
        self.solve_accelerations(&record.stages[slot]);
        self.store_rates(slot);
    }

    /// Writes time, positions and velocities at which a slot is evaluated to the stage: y = y₀ + h Σ a k. `values` is the state
    /// there.
    fn combine(&mut self, slot: usize, values: &State<f64>) {
        let Self { method, begin, stage, rates, h, grading, .. } = self;
        let n = begin.q.len();
        let sum = |i: usize| {
            let zero = T::from(0.0);
            method.row(slot, *grading).fold(zero, |sum, (j, weight)| sum + rates[j][i] * weight)
        };
        stage.t = begin.t + *h * grading.fraction(method.nodes[slot]);
        for i in 0..n {
            stage.q[i] = begin.q[i] + *h * sum(i);
            stage.v[i] = begin.v[i] + *h * sum(n + i);
        }
        stage.t = T::with(values.t, stage.t.derivatives());
        stage.modes.copy_from(&values.modes);
        stage.prescribe(self.mechanism);
    }

    /// Solves for the derivatives of accelerations and multipliers at the stage.
    fn solve_accelerations(&mut self, StageRecord { state: values, factor }: &StageRecord) {
        take_values(&mut self.stage, values);
        self.stage.modes.copy_from(&values.modes);
        for unknown in self.system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                self.stage.a[i] = T::from(values.a[i]);
            }
        }
        set_values(&mut self.stage.l, &values.l);
        for _ in 0..T::ORDER {
            let Self { system, mechanism, stage, workspace, jets, rows, .. } = self;
            acceleration_rows(system, mechanism, stage, workspace, jets, rows);
            self.solve_changes(factor);
            for (unknown, change) in self.system.unknowns().iter().zip(&self.changes) {
                let change = T::with(0.0, *change);
                match *unknown {
                    Unknown::Coordinate(i) => self.stage.a[i] += change,
                    Unknown::Multiplier(m) => self.stage.l[m] += change,
                }
            }
        }
    }

    /// Solves for the corrections of the unknowns, from the residuals in the rows.
    fn solve_changes(&mut self, factor: &Factor) {
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
        factor.solve_in(&mut self.changes, &mut self.solve_workspace);
    }

    /// Stores the rates at the stage in a slot.
    fn store_rates(&mut self, slot: usize) {
        let (rates, n) = (&mut self.rates[slot], self.stage.q.len());
        rates.fill(T::from(0.0));
        for unknown in self.system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                (rates[i], rates[n + i]) = (self.stage.v[i], self.stage.a[i]);
            }
        }
    }

    /// Projects positions and velocities of the stage, at the end of the step, onto the constraints.
    fn project(&mut self, record: &StepRecord) {
        let StepRecord { projected, stages } = record;
        let at_end = &stages[self.method.end].state;
        let set = |to: &mut [T], from: &[f64]| {
            to.iter_mut().zip(from).for_each(|(to, &from)| *to = T::with(from, to.derivatives()));
        };
        set(&mut self.stage.q, &projected.before.q);
        set(&mut self.stage.v, &projected.before.v);
        let before = self.stage.clone();
        let change = self.correction(&before, &projected.before, &projected.factor, 0);
        self.add_to_free(|stage| &mut stage.q, &change);
        set(&mut self.stage.q, &projected.after.q);
        let change = self.correction(&before, &projected.after, &projected.factor, 1);
        self.add_to_free(|stage| &mut stage.v, &change);
        set(&mut self.stage.q, &at_end.q);
        set(&mut self.stage.v, &at_end.v);
    }

    /// Adds a change to positions or velocities of free coordinates.
    fn add_to_free(&mut self, which: impl Fn(&mut State<T>) -> &mut Vec<T>, change: &[T]) {
        for unknown in self.system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                which(&mut self.stage)[i] += change[i];
            }
        }
    }

    /// The correction δ of positions (`order` 0) or velocities (`order` 1) of the stage, by coordinate:
    /// δ + Φ_qᵀ μ = 0 and Φ_q δ + r = 0, with r = Φ or Φ̇ of the stage, and Φ_q in the state `before` both corrections. Its values
    /// are the accelerations and multipliers of `stored`.
    fn correction(&mut self, before: &State<T>, stored: &State<f64>, factor: &Factor, order: usize) -> Vec<T> {
        let mut change = before.clone();
        set_values(&mut change.v, &stored.a);
        set_values(&mut change.l, &stored.l);
        let mut still = before.clone();
        still.v.fill(T::from(0.0));
        let (mut moving_rows, mut still_rows, mut stage_rows) =
            (self.rows.clone(), self.rows.clone(), self.rows.clone());
        for _ in 0..T::ORDER {
            let Self { system, mechanism, stage, workspace, jets, rows, .. } = self;
            system.constraint_rows(mechanism, &change, workspace, rows);
            // Φ_q δ is the difference of Φ̇ with the velocities δ and 0. Rows of inactive constraints stay as they are.
            for (all, state, order) in
                [(&mut moving_rows, &change, 1), (&mut still_rows, &still, 1), (&mut stage_rows, &*stage, order)]
            {
                all.copy_from_slice(rows);
                system.constraint_rates(mechanism, state, order, jets, all);
            }
            for (i, unknown) in system.unknowns().iter().enumerate() {
                rows[i] = stage_rows[i] + moving_rows[i] - still_rows[i];
                if let Unknown::Coordinate(k) = *unknown {
                    rows[i] += change.v[k];
                }
            }
            self.solve_changes(factor);
            for (unknown, correction) in self.system.unknowns().iter().zip(&self.changes) {
                let correction = T::with(0.0, *correction);
                match *unknown {
                    Unknown::Coordinate(i) => change.v[i] += correction,
                    Unknown::Multiplier(m) => change.l[m] += correction,
                }
            }
        }
        change.v
    }

    /// Records the derivatives of the outputs at `t` (s), inside the step (`is_dense`) or at its end.
    fn record_outputs(&mut self, record: &StepRecord, t: f64, is_dense: bool) -> Result<()> {
        let has_ended = self.closed.as_ref().is_some_and(|closed| closed.is_terminal(self.plain));
        if is_dense || !(has_ended || self.end.t.is_constant()) {
            self.interpolate(record, t);
            self.solve_accelerations(&record.stages[SAMPLE]);
        } else {
            self.stage.copy_from(&self.end);
        }
        self.sampler.outputs(self.mechanism, &self.stage, &mut self.outputs);
        if let Some(held) = &self.held {
            held.replace(&mut self.outputs);
        }
        check_finite(self.mechanism, &self.outputs, t)?;
        self.derivatives.extend(self.outputs.iter().flat_map(|output| output.derivatives()));
        Ok(())
    }

    /// Writes the state at `t` (s) to the stage, by dense output.
    fn interpolate(&mut self, record: &StepRecord, t: f64) {
        if !std::mem::replace(&mut self.is_dense, true) {
            (self.method.end + 1..self.method.slots()).for_each(|slot| self.evaluate(record, slot));
        }
        let Self { method, begin, end, stage, rates, h, grading, .. } = self;
        let weights = method.graded_dense_weights((-begin.t + t) / *h, *grading);
        let n = begin.q.len();
        let value = |i: usize, old: T, new: T| {
            let slots = rates.iter().zip(&weights.slots);
            let sum = slots.fold(T::from(0.0), |sum, (slot, &weight)| sum + slot[i] * weight);
            old + weights.change * (new - old) + *h * sum
        };
        for i in 0..n {
            stage.q[i] = value(i, begin.q[i], end.q[i]);
            stage.v[i] = value(n + i, begin.v[i], end.v[i]);
        }
        stage.t = T::from(t);
        stage.modes.copy_from(&begin.modes);
        stage.prescribe(self.mechanism);
    }
}

impl<T: DerivativeScalar<L>, const L: usize> StepConsumer<RecordedStep> for DualSteps<'_, T, L>
where
    Jet2<T>: ElementScalar,
{
    fn propagate(&mut self, step: &RecordedStep) -> Result<()> {
        let record = step.record.as_ref().expect("the states are here while derivatives are computed");
        match step.action {
            StepEvent::Start => {
                self.start(record);
                Ok(())
            }
            StepEvent::Step([_, end]) => self.advance(record, end, step),
            StepEvent::Output { t, is_dense } => self.record_outputs(record, t, is_dense),
        }
    }
}
