//! Warnings of elements about states of a motion in which their laws are doubtful.

use crate::mechanism::Mechanism;
use crate::mechanism::element::{ElementState, ElementWorkspace};
use crate::system::state::{State, gather};
use error::Seconds;

/// The first warning of each element, at the output times of a simulation.
#[derive(Default)]
pub(crate) struct StateWatch {
    workspace: ElementWorkspace<f64>,
    /// Numbers of elements, and sentences.
    found: Vec<(usize, String)>,
}

impl StateWatch {
    /// Records the warnings about `state`.
    pub fn add(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let Self { workspace, found } = self;
        for (k, instance) in mechanism.elements.iter().enumerate() {
            if found.iter().any(|(known, _)| *known == k) {
                continue;
            }
            gather(instance, state, workspace);
            let local = ElementState { p: &instance.parameters, ..workspace.local(state.t) };
            if let Some(why) = instance.element.warn_of_state(&local) {
                found.push((k, format!("{}: at t = {} {why}", instance.name, Seconds(state.t))));
            }
        }
    }

    /// All warnings, in the order of their times.
    pub fn warnings(self) -> impl Iterator<Item = String> {
        self.found.into_iter().map(|(_, warning)| warning)
    }
}
