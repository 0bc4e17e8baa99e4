//! Responses of an analysis, the loop over its steps in reverse, and the gradients with respect to the design.

use crate::checkpointing::reverse_playback::ReversePlayback;
use crate::checkpointing::trajectory_store::Checkpointable;
use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues};
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::history::OutputGradients;
use crate::derivatives::seeding::{Activity, build_chunks, build_seeded};
use crate::mechanism::scalars::Dual8;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::{Error, Result};
use autodiff::WIDTH;
use nalgebra::DMatrix;

/// One output at one time point, with a weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted {
    /// Number of the output.
    pub output: usize,
    /// Number of the time point.
    pub point: usize,
    /// Its weight.
    pub weight: f64,
}

/// A response of a motion: a weighted sum of outputs at time points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdjointFunctional {
    /// The terms.
    pub terms: Vec<Weighted>,
}

impl AdjointFunctional {
    /// An output at one time point.
    pub fn at(output: usize, point: usize) -> Self {
        Self { terms: vec![Weighted { output, point, weight: 1.0 }] }
    }

    /// The integral of an output over `times` (s) by the trapezoidal rule.
    pub fn integral(output: usize, times: &[f64]) -> Self {
        let width = |from: usize, to: usize| times[to] - times[from];
        let last = times.len().saturating_sub(1);
        let weight = |point: usize| 0.5 * width(point.saturating_sub(1), (point + 1).min(last));
        Self { terms: (0..times.len()).map(|point| Weighted { output, point, weight: weight(point) }).collect() }
    }
}

/// Cost of the reverse pass: peak memory, and steps that did not fit into memory and were recomputed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReplayStatistics {
    /// Largest number of bytes in use for steps and checkpoints.
    pub memory: usize,
    /// Steps of the motion.
    pub steps: usize,
    /// Steps integrated again.
    pub repeated: usize,
}

impl ReplayStatistics {
    pub(crate) fn of<C: Checkpointable>(steps: usize, playback: &ReversePlayback<'_, C>) -> Self {
        Self { memory: playback.peak(), steps, repeated: playback.repeated() }
    }
}

/// An output at one time point, as it enters the responses of a batch.
#[derive(Clone, Debug)]
pub(crate) struct OutputTerm {
    /// Number of the batch.
    pub batch: usize,
    pub output: usize,
    /// Its weight in each response of the batch.
    pub weight: BatchValues,
}

/// A mechanism at a design, and the responses to differentiate.
pub(crate) struct AdjointProblem<'t> {
    pub mechanism: Mechanism<f64>,
    pub activity: Activity,
    /// Output times, up to the last one that enters a response.
    pub times: &'t [f64],
    /// For each of the times, the outputs that enter responses.
    pub terms: Vec<Vec<OutputTerm>>,
    /// The mechanism once per chunk of seeded design variables.
    pub chunks: Vec<Mechanism<Dual8>>,
    /// The mechanism in dual numbers without seeds, if it has events.
    pub unseeded: Option<Mechanism<Dual8>>,
    responses: usize,
    variables: usize,
}

impl<'t> AdjointProblem<'t> {
    /// Problem for the `responses` of the outputs of `model` at the design `b` and `times`.
    ///
    /// # Errors
    /// [`Error::Definition`] if a response refers to a missing output or time point, or if the model builds other elements
    /// in dual numbers than in `f64`.
    pub fn build<M: ParametricMechanism>(
        model: &M,
        b: &[f64],
        times: &'t [f64],
        responses: &[AdjointFunctional],
    ) -> Result<Self> {
        let mechanism = model.build(b)?;
        check(responses, mechanism.outputs.len(), times.len())?;
        let chunks = build_chunks(model, b, &mechanism)?;
        let constant: Vec<Dual8> = b.iter().map(|&value| Dual8::constant(value)).collect();
        let unseeded = mechanism.has_events().then(|| build_seeded(model, &constant, &mechanism)).transpose()?;
        let activity = Activity::of(&chunks, &mechanism);
        let terms = terms_by_time(responses, times.len());
        let count = terms.iter().rposition(|terms| !terms.is_empty()).map_or(0, |last| last + 1);
        let (times, responses, variables) = (&times[..count], responses.len(), b.len());
        Ok(Self { mechanism, activity, times, terms, chunks, unseeded, responses, variables })
    }

    /// Zero gradients of the responses, a row each.
    pub fn no_gradients(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.responses, self.variables)
    }

    /// Number of batches of responses.
    pub fn batches(&self) -> usize {
        self.responses.div_ceil(BATCH)
    }

    /// Gradients of the responses with respect to the design, a row each, from the derivatives of the outputs by the direct
    /// method.
    pub fn products(&self, derivatives: &OutputGradients) -> DMatrix<f64> {
        let mut rows = self.no_gradients();
        let (responses, variables) = rows.shape();
        for (point, terms) in self.terms.iter().enumerate() {
            for term in terms {
                let weights = (term.batch * BATCH..responses).zip(term.weight);
                for (row, weight) in weights.filter(|(_, weight)| *weight != 0.0) {
                    (0..variables).for_each(|i| rows[(row, i)] += weight * derivatives.at(point, term.output, i));
                }
            }
        }
        rows
    }

    /// Gradients of the responses with respect to the design, a row each, from their derivatives with respect to the
    /// parameters and the initial state.
    pub fn gradients<'b>(&self, batches: impl IntoIterator<Item = &'b AdjointBatch>) -> DMatrix<f64> {
        let batches: Vec<_> = batches.into_iter().collect();
        let mut rows = self.no_gradients();
        for (c, chunk) in self.chunks.iter().enumerate() {
            for (k, batch) in batches.iter().enumerate() {
                batch.design.add_gradients(chunk, &batch.state, &mut rows, [k * BATCH, c * WIDTH]);
            }
        }
        rows
    }
}

/// The steps of a motion, recorded or integrated again, and the adjoint equations of each.
pub(crate) trait ReverseSteps {
    /// Number of steps of the motion that reach the output time `t` (s).
    fn steps_to(&self, t: f64) -> usize;

    /// Loads step number `k` (from 0).
    fn load_step(&mut self, k: usize) -> Result<()>;

    /// Returns whether the output time `t` (s) is in the loaded step `k`, not in an earlier one.
    fn contains(&self, k: usize, t: f64) -> bool;

    /// Adds the derivatives of the `terms`, outputs at the time `t` (s) in the loaded step.
    fn add_outputs(&mut self, t: f64, terms: &[OutputTerm]) -> Result<()>;

    /// Propagates the adjoint states from the end of the loaded step to its beginning.
    fn propagate_to_step_start(&mut self) -> Result<()>;

    /// Loads the initial state.
    fn load_start(&mut self) -> Result<()>;
}

/// Propagates the adjoint states from the last output time of `problem` to the start of the motion.
pub(crate) fn propagate_backwards(problem: &AdjointProblem<'_>, steps: &mut impl ReverseSteps) -> Result<()> {
    let mut left = problem.times;
    let count = left.last().map_or(0, |&last| steps.steps_to(last));
    for k in (0..count).rev() {
        steps.load_step(k)?;
        while left.last().is_some_and(|&t| steps.contains(k, t)) {
            add_last_outputs(problem, steps, &mut left)?;
        }
        steps.propagate_to_step_start()?;
    }
    steps.load_start()?;
    while !left.is_empty() {
        add_last_outputs(problem, steps, &mut left)?;
    }
    Ok(())
}

/// Adds the outputs at the last of the times that are `left`, and removes it.
fn add_last_outputs(problem: &AdjointProblem<'_>, steps: &mut impl ReverseSteps, left: &mut &[f64]) -> Result<()> {
    let Some((&t, rest)) = left.split_last() else { return Ok(()) };
    *left = rest;
    match &problem.terms[rest.len()][..] {
        [] => Ok(()),
        terms => steps.add_outputs(t, terms),
    }
}

/// The terms of the responses by time point.
fn terms_by_time(responses: &[AdjointFunctional], times: usize) -> Vec<Vec<OutputTerm>> {
    let mut by_time = vec![Vec::new(); times];
    for (k, response) in responses.iter().enumerate() {
        for term in &response.terms {
            let mut weight = [0.0; BATCH];
            weight[k % BATCH] = term.weight;
            by_time[term.point].push(OutputTerm { batch: k / BATCH, output: term.output, weight });
        }
    }
    by_time
}

fn check(responses: &[AdjointFunctional], outputs: usize, points: usize) -> Result<()> {
    let terms = responses.iter().enumerate().flat_map(|(k, response)| response.terms.iter().map(move |term| (k, term)));
    let mut wrong = terms.filter(|(_, term)| term.output >= outputs || term.point >= points);
    wrong.next().map_or(Ok(()), |(k, term)| {
        let why = format!("it has output {} at time point {}", term.output, term.point);
        let remedy = format!("outputs go to {}, time points to {}", outputs.max(1) - 1, points.max(1) - 1);
        Err(Error::definition(format!("response {k}"), why, remedy))
    })
}
