//! Vector–Jacobian products of the steps around an event.
//!
//! The lengths of these steps and the time between them depend on the state in which they begin, and the event makes
//! velocities, forces and joints jump. The direct method computes the derivatives of their end and of the outputs within them with
//! respect to the state at their beginning and to the design; the adjoint method multiplies them by the adjoint state from the left.
//! With n coordinates and m multipliers this takes 4n + m directions besides those of the design, which is acceptable because events
//! are rare. With fixed steps there are two steps around an event, or a few if steps fail. With adaptive steps they are all steps
//! from the first event on, because their times depend on that of the event.

use crate::Result;
use crate::analyses::dynamics::Dynamics;
use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues, add};
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::adjoint::problem::{AdjointProblem, OutputTerm};
use crate::derivatives::forward::dynamics::ForwardSensitivity;
use crate::derivatives::forward::implicit_steps::ConvergedStep;
use crate::integrators::generalized_alpha::Step;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Dual8;
use crate::system::System;
use crate::system::state::State;
use autodiff::WIDTH;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// The steps around an event, from the last one, and the outputs within them.
pub(crate) struct EventWindow {
    /// The steps, the last one first.
    pub steps: Vec<ConvergedStep>,
    /// Output times in s with the terms of the responses there, the last time first.
    outputs: Vec<(f64, Vec<OutputTerm>)>,
    /// For each batch, the derivatives with respect to outputs that keep the value of an event.
    held: Vec<Vec<BatchValues>>,
    /// Contributions of the steps around events to the gradients of the responses, one row per response.
    pub gradients: DMatrix<f64>,
}

impl EventWindow {
    /// No steps, for the responses of `problem`.
    pub fn new(problem: &AdjointProblem<'_>) -> Self {
        let held = vec![vec![[0.0; BATCH]; problem.mechanism.outputs.len()]; problem.batches()];
        Self { steps: Vec::new(), outputs: Vec::new(), held, gradients: problem.no_gradients() }
    }

    /// Returns whether an output has the value of an event before the step that ends at `end`.
    pub fn is_held(&self, problem: &AdjointProblem<'_>, end: &State<f64>, output: usize) -> bool {
        problem.mechanism.outputs[output].held.is_some_and(|held| end.modes.has_happened(held.event))
    }

    /// Adds the `term` of an output that has the value of its event.
    pub fn add_held(&mut self, term: &OutputTerm) {
        add(&mut self.held[term.batch][term.output], 1.0, &term.weight);
    }

    /// Adds the `term` of an output at the time `t` (s) in the current step.
    pub fn add_output(&mut self, t: f64, term: &OutputTerm) {
        match self.outputs.last_mut() {
            Some((last, terms)) if *last == t => terms.push(term.clone()),
            _ => self.outputs.push((t, vec![term.clone()])),
        }
    }

    /// Propagates the adjoint states of `batches` to the beginning of the steps, which is the end of the step `begin`, and adds
    /// the gradients with respect to the design. The steps and outputs are removed.
    pub fn propagate(
        &mut self,
        problem: &AdjointProblem<'_>,
        system: &System,
        settings: &Dynamics,
        begin: &Step<f64>,
        batches: &mut [AdjointBatch],
    ) -> Result<()> {
        self.steps.reverse();
        self.outputs.reverse();
        let times: Vec<f64> = self.outputs.iter().map(|(t, _)| *t).collect();
        let unseeded = problem.unseeded.as_ref().expect("a mechanism with events");
        let variables = state_variables(&begin.new);
        let chunks = problem.chunks.iter().map(|mechanism| (mechanism, &[][..]));
        let chunks: Vec<(&Mechanism<Dual8>, &[StateVariable])> =
            chunks.chain(variables.chunks(WIDTH).map(|seeded| (unseeded, seeded))).collect();
        let sums = |&(mechanism, seeded): &(&Mechanism<Dual8>, &[StateVariable])| {
            let step = lifted(begin, seeded);
            let mut forward =
                ForwardSensitivity::after(&problem.mechanism, mechanism, system, (step, settings), &times);
            forward.propagate_along(&self.steps)?;
            Ok(batches.iter().enumerate().map(|(k, batch)| self.product(&forward, k, batch)).collect::<Vec<_>>())
        };
        let sums = chunks.par_iter().map(sums).collect::<Result<Vec<_>>>()?;
        let (by_design, by_state) = sums.split_at(problem.chunks.len());
        for (c, sums) in by_design.iter().enumerate() {
            self.add_gradients(sums, c * WIDTH);
        }
        for (k, batch) in batches.iter_mut().enumerate() {
            batch.state.clear();
            for (sums, seeded) in by_state.iter().zip(variables.chunks(WIDTH)) {
                seeded.iter().zip(sums[k]).for_each(|(variable, sum)| *variable.of_adjoint(&mut batch.state) = sum);
            }
        }
        // Backward in time, the steps before these precede the events: their outputs are not held yet.
        let end = &self.steps[0].end;
        for (output, data) in problem.mechanism.outputs.iter().enumerate() {
            if data.held.is_some_and(|held| !end.modes.has_happened(held.event)) {
                self.held.iter_mut().for_each(|held| held[output] = [0.0; BATCH]);
            }
        }
        self.steps.clear();
        self.outputs.clear();
        Ok(())
    }

    /// For each seed of `forward`, the derivative of the responses of batch number `k` through the outputs in the steps, the
    /// outputs that keep values of their events, and the state at the end.
    fn product(
        &self,
        forward: &ForwardSensitivity<'_, Dual8, WIDTH>,
        k: usize,
        batch: &AdjointBatch,
    ) -> [BatchValues; WIDTH] {
        let mut sums = [[0.0; BATCH]; WIDTH];
        let mut add_all = |derivatives: &[f64], weight: &BatchValues| {
            sums.iter_mut().zip(derivatives).for_each(|(sum, derivative)| add(sum, *derivative, weight));
        };
        let outputs = self.held[k].len();
        for (point, (_, terms)) in self.outputs.iter().enumerate() {
            for term in terms.iter().filter(|term| term.batch == k) {
                let at = (point * outputs + term.output) * WIDTH;
                add_all(&forward.derivatives[at..at + WIDTH], &term.weight);
            }
        }
        for (output, weight) in self.held[k].iter().enumerate() {
            if let Some(value) = forward.held.as_ref().and_then(|held| held.value(output)) {
                add_all(&value.eps, weight);
            }
        }
        let (end, AdjointState { q, v, a, l, w }) = (&forward.step.new, &batch.state);
        let auxiliary = forward.step.auxiliary();
        for (values, weights) in [(&end.q[..], q), (&end.v, v), (&end.a, a), (&end.l, l), (auxiliary, w)] {
            values.iter().zip(weights).for_each(|(value, weight)| add_all(&value.eps, weight));
        }
        sums
    }

    /// Adds the derivatives with respect to the design variables from number `first` on, by batch.
    fn add_gradients(&mut self, sums: &[[BatchValues; WIDTH]], first: usize) {
        let (responses, variables) = self.gradients.shape();
        for row in 0..responses {
            for k in 0..WIDTH.min(variables - first) {
                self.gradients[(row, first + k)] += sums[row / BATCH][k][row % BATCH];
            }
        }
    }
}

/// A variable of the state at the end of a step.
#[derive(Clone, Copy)]
enum StateVariable {
    Position(usize),
    Velocity(usize),
    Acceleration(usize),
    Auxiliary(usize),
    Multiplier(usize),
}

impl StateVariable {
    fn of_adjoint(self, state: &mut AdjointState) -> &mut BatchValues {
        match self {
            Self::Position(i) => &mut state.q[i],
            Self::Velocity(i) => &mut state.v[i],
            Self::Acceleration(i) => &mut state.a[i],
            Self::Auxiliary(i) => &mut state.w[i],
            Self::Multiplier(m) => &mut state.l[m],
        }
    }
}

/// All variables of the state at the end of a step.
fn state_variables(state: &State<f64>) -> Vec<StateVariable> {
    use StateVariable::{Acceleration, Auxiliary, Multiplier, Position, Velocity};
    let coordinates = [Position, Velocity, Acceleration, Auxiliary].into_iter();
    let coordinates = coordinates.flat_map(|variable| (0..state.q.len()).map(variable));
    coordinates.chain((0..state.l.len()).map(Multiplier)).collect()
}

/// The end of the step `begin` in dual numbers, with these variables seeded.
fn lifted(begin: &Step<f64>, seeded: &[StateVariable]) -> Step<Dual8> {
    let lift = |x: &[f64]| -> Vec<Dual8> { x.iter().map(|&x| Dual8::constant(x)).collect() };
    let State { t, q, v, a, l, modes } = &begin.new;
    let (t, modes) = (Dual8::constant(*t), modes.clone());
    let mut state = State { t, q: lift(q), v: lift(v), a: lift(a), l: lift(l), modes };
    let mut auxiliary = lift(begin.auxiliary());
    for (k, variable) in seeded.iter().enumerate() {
        let to = match *variable {
            StateVariable::Position(i) => &mut state.q[i],
            StateVariable::Velocity(i) => &mut state.v[i],
            StateVariable::Acceleration(i) => &mut state.a[i],
            StateVariable::Auxiliary(i) => &mut auxiliary[i],
            StateVariable::Multiplier(m) => &mut state.l[m],
        };
        to.eps[k] = 1.0;
    }
    let [since_event, _] = begin.steps_since_event();
    Step::ending_at(state, auxiliary, begin.length(), since_event)
}
