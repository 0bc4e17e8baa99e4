//! A step, its end and states inside it, for one chunk of derivatives.

use crate::derivatives::forward::explicit::ode::{LinearOde, StepRecord};
use crate::integrators::explicit::ode::Ode;
use crate::integrators::explicit::tableau::Tableau;
use autodiff::WIDTH;

/// Derivatives of one quantity with respect to one chunk of design variables.
pub(crate) type Block = crate::derivatives::forward::explicit::Block<WIDTH>;

/// One chunk of derivatives that goes along with a [`Stepper`](crate::integrators::explicit::stepper::Stepper).
pub(crate) struct OdeForwardSensitivity<'o, O> {
    linear: LinearOde<'o, O>,
    method: &'static Tableau,
    /// Beginning and end of the step in s.
    t: [f64; 2],
    old: Vec<Block>,
    new: Vec<Block>,
    slots: Vec<Vec<Block>>,
    stage: Vec<Block>,
    started: bool,
    is_dense: bool,
}

impl<'o, O: Ode> OdeForwardSensitivity<'o, O> {
    /// At the start, after slot 0 was visited.
    pub fn new(
        linear: LinearOde<'o, O>,
        method: &'static Tableau,
        start: Vec<Block>,
        t: f64,
        tape: &StepRecord,
    ) -> Self {
        let (mut linear, stage) = (linear, start.clone());
        let mut slots = vec![vec![[0.0; WIDTH]; start.len()]; method.slots()];
        linear.rates(tape, 0, &stage, &mut slots[0]);
        let (started, is_dense) = (false, false);
        Self { linear, method, t: [t; 2], new: start.clone(), old: start, slots, stage, started, is_dense }
    }

    /// Goes along with the step that has just been accepted.
    pub fn follow(&mut self, tape: &StepRecord, t: [f64; 2]) {
        if self.started {
            std::mem::swap(&mut self.old, &mut self.new);
            self.slots.swap(0, self.method.end);
        }
        (self.t, self.started, self.is_dense) = (t, true, false);
        for slot in 1..self.method.end {
            self.evaluate(tape, slot);
        }
        let end = self.method.end;
        self.combine(end);
        self.new.copy_from_slice(&self.stage);
        self.linear.rates(tape, end, &self.stage, &mut self.slots[end]);
    }

    /// Goes along with the evaluations for dense output, once per step.
    pub fn make_dense(&mut self, tape: &StepRecord) {
        if !std::mem::replace(&mut self.is_dense, true) {
            for slot in self.method.end + 1..self.method.slots() {
                self.evaluate(tape, slot);
            }
        }
    }

    /// Derivatives of the state at the end of the step.
    pub fn end(&self) -> &[Block] {
        &self.new
    }

    /// Derivatives of the state at `t` inside the step.
    pub fn interpolate(&self, t: f64, y: &mut [Block]) {
        let h = self.t[1] - self.t[0];
        let weights = self.method.dense_weights((t - self.t[0]) / h);
        for ((y, old), new) in y.iter_mut().zip(&self.old).zip(&self.new) {
            *y = std::array::from_fn(|k| old[k] + weights.change * (new[k] - old[k]));
        }
        for (slot, weight) in self.slots.iter().zip(weights.slots).filter(|(_, weight)| *weight != 0.0) {
            add(y, h * weight, slot);
        }
    }

    fn evaluate(&mut self, tape: &StepRecord, slot: usize) {
        self.combine(slot);
        self.linear.rates(tape, slot, &self.stage, &mut self.slots[slot]);
    }

    fn combine(&mut self, slot: usize) {
        let h = self.t[1] - self.t[0];
        self.method.combine(
            slot,
            h,
            self.old.as_flattened(),
            |j| self.slots[j].as_flattened(),
            self.stage.as_flattened_mut(),
        );
    }
}

/// y += factor · k.
fn add(y: &mut [Block], factor: f64, k: &[Block]) {
    for (y, k) in y.as_flattened_mut().iter_mut().zip(k.as_flattened()) {
        *y += factor * k;
    }
}
