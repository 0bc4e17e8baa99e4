//! Derivatives of the solution of a differential equation.

use crate::Result;
use crate::derivatives::forward::explicit::explicit_steps::{ExplicitSteps, StepEvent};
use crate::derivatives::history::OutputGradients;
use crate::derivatives::propagation::{Schedule, StepConsumer, StepSource, propagate};
use crate::derivatives::seeding::seed_chunk;
use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::ode::{Ode, OdeHistory, OdeModelRhs};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::tableau::Tableau;
use crate::linalg::simd::Gradient;
use crate::mechanism::scalars::Dual8;
use autodiff::WIDTH;

/// A solution with its gradients.
#[derive(Clone, Debug, PartialEq)]
pub struct OdeSensitivity {
    /// The solution.
    pub history: OdeHistory,
    /// `gradients[component][time]` is the gradient with respect to the design variables.
    pub gradients: Vec<Vec<Vec<f64>>>,
}

/// Integrates `ode` at the design `b` and differentiates its state at `times` (s) with respect to `b`.
///
/// The right-hand side is evaluated once more at every stage, in dual numbers of [`WIDTH`] design variables at a time.
/// Chunks run in parallel; the result has the same bits for any number of threads.
///
/// # Errors
/// As [`integrate`](crate::integrators::explicit::integrate).
///
/// # Sources
/// Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993), Section II.6,
/// "internal differentiation" after Bock (1981).
pub fn differentiate_ode<O: Ode>(ode: &O, b: &[f64], settings: &Explicit, times: &[f64]) -> Result<OdeSensitivity> {
    let start = ode.start(b);
    let mut rhs = OdeModelRhs::new(ode, b);
    rhs.stages = Some(vec![(settings.start, start.clone()); settings.method.slots()]);
    let size = start.len();
    let driver = OdeDriver::new(rhs, settings, start, times)?;
    let sensitivity = |first| OdeForwardSensitivity::new(ode, seed_chunk(b, first), settings, times.len());
    let mut sensitivities: Vec<_> = (0..b.len()).step_by(WIDTH).map(sensitivity).collect();
    let values = vec![Vec::with_capacity(times.len()); size];
    let mut steps = OdeSteps { steps: ExplicitSteps::new(driver, times), values };
    propagate(&mut steps, &mut sensitivities, Schedule::Parallel)?;
    let chunks = sensitivities.into_iter().map(|sensitivity| sensitivity.derivatives).collect();
    let gradients = OutputGradients::new(size, WIDTH, chunks).to_series(times.len(), b.len());
    let OdeSteps { steps: ExplicitSteps { driver, .. }, values } = steps;
    let work = driver.work();
    Ok(OdeSensitivity { history: OdeHistory { times: times.to_vec(), values, steps: driver.steps, work }, gradients })
}

/// The states at which the right-hand side was evaluated.
#[derive(Default)]
struct OdeStages {
    event: Option<StepEvent>,
    /// Time and state of each slot, moved here from the right-hand side while derivatives are computed.
    records: Option<Vec<(f64, Vec<f64>)>>,
}

/// The steps of a differential equation, whose solution is recorded.
struct OdeSteps<'o, O> {
    steps: ExplicitSteps<'o, OdeModelRhs<'o, O>>,
    /// One series per component.
    values: Vec<Vec<f64>>,
}

impl<O: Ode> StepSource for OdeSteps<'_, O> {
    type Block = OdeStages;

    fn block(&mut self) -> OdeStages {
        OdeStages::default()
    }

    /// Fills the block with one step, or with the state at one output time.
    fn fill(&mut self, stages: &mut OdeStages) -> Result<bool> {
        let Self { steps, values } = self;
        if stages.records.is_some() {
            steps.driver.stepper.rhs.stages = stages.records.take();
        }
        stages.event = steps.advance(|driver, y, t| driver.sample(t, y))?;
        stages.records = steps.driver.stepper.rhs.stages.take();
        if let Some(StepEvent::Output { .. }) = stages.event {
            values.iter_mut().zip(&steps.output_state).for_each(|(series, y)| series.push(*y));
        }
        Ok(stages.event.is_some())
    }
}

/// The derivatives of a solution with respect to one chunk of design variables, propagated along explicit steps.
struct OdeForwardSensitivity<'o, O> {
    ode: &'o O,
    method: &'static Tableau,
    b: Vec<Dual8>,
    /// Beginning and end of the step in s.
    t: [f64; 2],
    old: Vec<Gradient<WIDTH>>,
    new: Vec<Gradient<WIDTH>>,
    slots: Vec<Vec<Gradient<WIDTH>>>,
    stage: Vec<Gradient<WIDTH>>,
    is_started: bool,
    is_dense: bool,
    state: Vec<Dual8>,
    rates: Vec<Dual8>,
    /// Of the components, by time, component and design variable.
    derivatives: Vec<f64>,
}

impl<'o, O: Ode> OdeForwardSensitivity<'o, O> {
    /// Sensitivity at the start, for the seeded design `b`.
    fn new(ode: &'o O, b: Vec<Dual8>, settings: &Explicit, times: usize) -> Self {
        let start: Vec<Gradient<WIDTH>> = ode.start(&b).iter().map(|y| y.eps).collect();
        let (size, method) = (start.len(), settings.method);
        Self {
            ode,
            method,
            b,
            t: [settings.start; 2],
            new: start.clone(),
            slots: vec![vec![[0.0; WIDTH]; size]; method.slots()],
            stage: start.clone(),
            old: start,
            is_started: false,
            is_dense: false,
            state: vec![Dual8::constant(0.0); size],
            rates: vec![Dual8::constant(0.0); size],
            derivatives: Vec::with_capacity(times * size * WIDTH),
        }
    }

    /// Propagates the derivatives from the beginning of the step between `t[0]` and `t[1]` to its end.
    fn advance(&mut self, records: &[(f64, Vec<f64>)], t: [f64; 2]) {
        if self.is_started {
            std::mem::swap(&mut self.old, &mut self.new);
            self.slots.swap(0, self.method.end);
        }
        (self.t, self.is_started, self.is_dense) = (t, true, false);
        let end = self.method.end;
        (1..end).for_each(|slot| self.evaluate(records, slot));
        self.combine(end);
        self.new.copy_from_slice(&self.stage);
        self.differentiate_rates(records, end);
    }

    /// Records the derivatives of the state at `t`, inside the step (`is_dense`) or at its end.
    fn record_state(&mut self, records: &[(f64, Vec<f64>)], t: f64, is_dense: bool) {
        if !is_dense {
            return self.derivatives.extend_from_slice(self.new.as_flattened());
        }
        if !std::mem::replace(&mut self.is_dense, true) {
            (self.method.end + 1..self.method.slots()).for_each(|slot| self.evaluate(records, slot));
        }
        let (h, first) = (self.t[1] - self.t[0], self.derivatives.len());
        let weights = self.method.dense_weights((t - self.t[0]) / h);
        let ends = self.old.as_flattened().iter().zip(self.new.as_flattened());
        self.derivatives.extend(ends.map(|(old, new)| old + weights.change * (new - old)));
        let y = &mut self.derivatives[first..];
        for (slot, weight) in self.slots.iter().zip(weights.slots).filter(|(_, weight)| *weight != 0.0) {
            y.iter_mut().zip(slot.as_flattened()).for_each(|(y, k)| *y += h * weight * k);
        }
    }

    /// Derivatives of the state and of the rates at a stage.
    fn evaluate(&mut self, records: &[(f64, Vec<f64>)], slot: usize) {
        self.combine(slot);
        self.differentiate_rates(records, slot);
    }

    fn combine(&mut self, slot: usize) {
        let h = self.t[1] - self.t[0];
        let (old, rates) = (self.old.as_flattened(), |j: usize| self.slots[j].as_flattened());
        self.method.combine(slot, (h, Grading::Even), old, rates, self.stage.as_flattened_mut());
    }

    /// Derivatives of dy/dt in `slot`, where those of the state are in the stage.
    fn differentiate_rates(&mut self, records: &[(f64, Vec<f64>)], slot: usize) {
        let (t, values) = &records[slot];
        for ((dual, &re), &eps) in self.state.iter_mut().zip(values).zip(&self.stage) {
            *dual = Dual8 { re, eps };
        }
        self.ode.rates(&self.b, *t, &self.state, &mut self.rates);
        self.slots[slot].iter_mut().zip(&self.rates).for_each(|(k, dual)| *k = dual.eps);
    }
}

impl<O: Ode> StepConsumer<OdeStages> for OdeForwardSensitivity<'_, O> {
    fn propagate(&mut self, stages: &OdeStages) -> Result<()> {
        let records = stages.records.as_ref().expect("the states are here while derivatives are computed");
        match stages.event {
            Some(StepEvent::Start) => self.differentiate_rates(records, 0),
            Some(StepEvent::Step(t)) => self.advance(records, t),
            Some(StepEvent::Output { t, is_dense }) => self.record_state(records, t, is_dense),
            None => {}
        }
        Ok(())
    }
}
