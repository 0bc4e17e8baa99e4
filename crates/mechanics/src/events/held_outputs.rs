//! Outputs that keep their value from an event on.

use crate::mechanism::Mechanism;
use crate::mechanism::output::EventSide;
use crate::mechanism::scalars::StateScalar;
use crate::system::outputs::Sampler;
use crate::system::state::State;

/// Values of outputs at their events, with the derivatives of the state there.
#[derive(Clone, Debug)]
pub(crate) struct HeldOutputs<T> {
    sampler: Sampler<T>,
    outputs: Vec<T>,
    /// For each output, its value at its event, after that has happened.
    values: Vec<Option<T>>,
}

impl<T: StateScalar> HeldOutputs<T> {
    /// Held outputs at the start of the motion; `None` if `mechanism` has no such output.
    pub fn new(mechanism: &Mechanism<T>) -> Option<Self> {
        mechanism.outputs.iter().any(|output| output.held.is_some()).then(|| Self {
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
            values: vec![None; mechanism.outputs.len()],
        })
    }

    /// Stores the outputs that are held from one of the `events` on, in the `state` on this `side` of it.
    pub fn hold(&mut self, mechanism: &Mechanism<T>, side: EventSide, events: &[usize], state: &State<T>) {
        let is_held = |output: usize| {
            mechanism.outputs[output].held.is_some_and(|from| from.side == side && events.contains(&from.event))
        };
        if !(0..self.values.len()).any(is_held) {
            return;
        }
        self.sampler.outputs(mechanism, state, &mut self.outputs);
        for output in (0..self.values.len()).filter(|&output| is_held(output)) {
            self.values[output].get_or_insert(self.outputs[output]);
        }
    }

    /// The value of an output at its event, if that has happened.
    pub fn value(&self, output: usize) -> Option<&T> {
        self.values[output].as_ref()
    }

    /// Replaces the `outputs` whose events have happened by their values at these.
    pub fn replace(&self, outputs: &mut [T]) {
        for (output, held) in outputs.iter_mut().zip(&self.values) {
            *output = held.unwrap_or(*output);
        }
    }
}
