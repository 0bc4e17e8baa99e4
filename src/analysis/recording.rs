//! The converged steps of a motion, kept for derivatives.

use super::dynamics::Run;
use super::generalized_alpha::Step;
use super::start::Projection;
use super::state::State;
use super::system::System;

/// The converged steps of a motion: from them derivatives are had without another iteration.
#[derive(Clone)]
pub struct Recording {
    /// The equations, for their numbering.
    pub(crate) system: System,
    /// Multipliers of the initial projections.
    pub(crate) projection: Projection,
    /// Where the motion starts: assembled and consistent.
    pub(crate) start: State<f64>,
    /// End and length of every step in s.
    steps: Vec<[f64; 2]>,
    /// Positions, velocities, accelerations and multipliers at the end of every step.
    values: Vec<f64>,
    limit: usize,
}

impl Recording {
    /// Of a motion that has not begun; `limit` is the most memory in bytes.
    pub(crate) fn of(run: &Run<'_>, limit: usize) -> Self {
        let (system, projection) = (run.integrator.system.clone(), run.projection.clone());
        let start = run.integrator.step.new.clone();
        Self { system, projection, start, steps: Vec::new(), values: Vec::new(), limit }
    }

    /// Keeps the step of length `h` that ends in `step.new`. Once the memory is used up nothing more is kept.
    pub(crate) fn keep(&mut self, step: &Step<f64>, h: f64) {
        let State { t, q, v, a, l } = &step.new;
        if self.is_whole() {
            self.steps.push([*t, h]);
            [q, v, a, l].into_iter().for_each(|values| self.values.extend_from_slice(values));
        }
        if !self.is_whole() {
            self.give_up();
        }
    }

    /// Keeps nothing: what happens between the steps is not known here.
    pub(crate) fn give_up(&mut self) {
        (self.steps, self.values) = (Vec::new(), Vec::new());
        self.limit = 0;
    }

    /// Whether every step was kept: the memory sufficed.
    pub fn is_whole(&self) -> bool {
        self.limit > 0 && self.bytes() <= self.limit
    }

    /// Memory of the steps in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.steps[..]) + size_of_val(&self.values[..])
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// When each step ends, in s.
    pub(crate) fn ends(&self) -> impl Iterator<Item = f64> + '_ {
        self.steps.iter().map(|[end, _]| *end)
    }

    /// Length of step `k` (from 0) in s.
    pub(crate) fn length(&self, k: usize) -> f64 {
        self.steps[k][1]
    }

    /// Copies the end of step `k` (from 0) to `state`; returns the length of the step in s.
    pub(crate) fn load(&self, k: usize, state: &mut State<f64>) -> f64 {
        let [t, h] = self.steps[k];
        state.t = t;
        let size = 3 * state.q.len() + state.l.len();
        let mut rest = &self.values[k * size..(k + 1) * size];
        for to in [&mut state.q, &mut state.v, &mut state.a, &mut state.l] {
            let (these, others) = rest.split_at(to.len());
            to.copy_from_slice(these);
            rest = others;
        }
        h
    }
}
