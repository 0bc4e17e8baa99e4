//! Direct differentiation of a mechanism's motion by explicit steps.

use crate::Result;
use crate::analyses::sampling::OutputRecorder;
use crate::derivatives::forward::explicit::dual_steps::propagate_repeated;
use crate::derivatives::forward::explicit::explicit_steps::{ExplicitSteps, LinearizedStages, StepEvent};
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::forward::explicit::relative_block::propagate_relative_blocks;
use crate::derivatives::forward::explicit::relative_steps::propagate_relative;
use crate::derivatives::forward::explicit::sensitivity_block::{BlockData, SensitivityBlock};
use crate::derivatives::forward::initial_conditions::InitialDerivatives;
use crate::derivatives::history::{OutputGradients, SensitiveHistory};
use crate::derivatives::indeterminate::check_outputs;
use crate::derivatives::propagation::{Schedule, StepSource, propagate};
use crate::derivatives::seeding::{Activity, build_chunks};
use crate::integrators::explicit::mechanism::{ConsistentState, MechanismRhs, SAMPLE, sample, start};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use crate::mechanism::scalars::Dual8;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::modes::Modes;
use crate::system::state::State;
use autodiff::WIDTH;

/// Simulates `model` at the design `b` by explicit steps and differentiates its outputs at `times` (s) with respect to `b`.
///
/// At every stage the accelerations solve K x = r with a factorized matrix. Their derivatives solve
///
/// $$ K \frac{dx}{db} = \frac{dr}{db} - \frac{dK}{db} x $$
///
/// with the same factorization. The right-hand side is computed from derivatives of every element with respect to its own
/// few variables, which are used for all design variables. The projections at the ends of steps are differentiated in the same way.
/// Initial positions and velocities may depend on the design. Steps are frozen: the derivatives are those of the discrete
/// solution, with the same bits for any number of threads. Where a step ends at an event, its length and that of the next step
/// carry derivatives, and the steps are repeated in dual numbers. So are steps in relative coordinates in space or with loops. In those
/// of planar trees the rows of the joints are differentiated by sweeps, with derivatives of each joint that all design variables share.
///
/// # Errors
/// As [`simulate_explicitly`](crate::analyses::dynamics::simulate_explicitly), and
/// [`Error::Definition`](crate::Error::Definition) if the model builds other elements in dual numbers than in `f64`.
pub fn differentiate_explicitly<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let chunks = build_chunks(model, b, &mechanism)?;
    differentiate_seeded(&mechanism, &chunks, b.len(), settings, times)
}

/// Smallest product of unknowns and design variables for which threads are faster.
const WORTH_THREADS: usize = 3200;

/// Simulates and differentiates. Not generic over the model: compiled once, in this crate.
fn differentiate_seeded(
    mechanism: &Mechanism<f64>,
    chunks: &[Mechanism<Dual8>],
    variables: usize,
    settings: &Explicit,
    times: &[f64],
) -> Result<SensitiveHistory> {
    if mechanism.has_events() {
        let (recorder, work, gradients) = propagate_repeated(mechanism, chunks, settings, times)?;
        return Ok(SensitiveHistory::new(mechanism, times, recorder, (&gradients, variables), work));
    }
    let (driver, begin) = start(mechanism, settings, times, true)?;
    let relative = driver.stepper.rhs.relative.as_ref().map(|relative| relative.dynamics.tree.clone());
    if relative.as_ref().is_some_and(|tree| tree.space.nodes.is_empty() && tree.cuts.is_empty()) {
        let propagate_blocks = match chunks.len() {
            0 | 1 => propagate_relative_blocks::<WIDTH>,
            _ => propagate_relative_blocks::<{ 2 * WIDTH }>,
        };
        let (recorder, work, gradients) = propagate_blocks(chunks, driver, &begin, times)?;
        return Ok(SensitiveHistory::new(mechanism, times, recorder, (&gradients, variables), work));
    }
    if let Some(tree) = relative {
        let (recorder, work, gradients) = propagate_relative(chunks, &tree, driver, &begin, times)?;
        return Ok(SensitiveHistory::new(mechanism, times, recorder, (&gradients, variables), work));
    }
    let propagate_blocks = if chunks.len() > 1 { propagate_blocks::<{ 2 * WIDTH }> } else { propagate_blocks::<WIDTH> };
    let (steps, gradients) = propagate_blocks(mechanism, chunks, (driver, begin), times)?;
    let work = steps.steps.driver.work();
    Ok(SensitiveHistory::new(mechanism, times, steps.recorder, (&gradients, variables), work))
}

/// Propagates the derivatives with respect to all design variables along the steps of `driver` to the last of `times`, in blocks
/// of `W` variables.
fn propagate_blocks<'m, const W: usize>(
    mechanism: &'m Mechanism<f64>,
    chunks: &[Mechanism<Dual8>],
    (mut driver, begin): (OdeDriver<MechanismRhs<'m>>, ConsistentState),
    times: &'m [f64],
) -> Result<(MechanismSteps<'m>, OutputGradients)> {
    let (method, system) = (driver.stepper.method, &mut driver.stepper.rhs.system);
    check_outputs(system, mechanism, &begin.state)?;
    let linearizer = Linearizer::new(mechanism, &Activity::of(chunks, mechanism), system, &Modes::initial(mechanism));
    let shared = BlockData::new(method, &linearizer, system);
    let initial =
        |chunk| InitialDerivatives::new(mechanism, chunk, &mut *system).consistent(&begin.state, &begin.projection);
    let states = chunks.iter().map(initial).collect::<Result<Vec<_>>>()?;
    let blocks = chunks.chunks(W / WIDTH).zip(states.chunks(W / WIDTH));
    let block = |(chunks, states)| {
        SensitivityBlock::<W>::new(&shared, chunks, states, &linearizer, system, &begin.state, times.len())
    };
    let mut blocks: Vec<_> = blocks.map(block).collect();
    let is_parallel = system.size() * chunks.len() * WIDTH >= WORTH_THREADS;
    let mut steps = MechanismSteps {
        mechanism,
        recorder: OutputRecorder::new(mechanism, times.len()),
        steps: ExplicitSteps::new(driver, times),
        start: begin.state,
        linearizer,
        is_parallel,
        is_dense: false,
    };
    propagate(&mut steps, &mut blocks, if is_parallel { Schedule::Parallel } else { Schedule::Sequential })?;
    let derivatives = blocks.into_iter().map(|block| block.derivatives).collect();
    Ok((steps, OutputGradients::new(mechanism.outputs.len(), W, derivatives)))
}

/// The explicit steps of a mechanism, whose outputs are recorded and whose stages are linearized.
struct MechanismSteps<'m> {
    mechanism: &'m Mechanism<f64>,
    steps: ExplicitSteps<'m, MechanismRhs<'m>>,
    recorder: OutputRecorder,
    start: State<f64>,
    linearizer: Linearizer,
    is_parallel: bool,
    /// True after the stages for dense output of the current step are linearized.
    is_dense: bool,
}

impl StepSource for MechanismSteps<'_> {
    type Block = LinearizedStages;

    fn block(&mut self) -> LinearizedStages {
        LinearizedStages::new(&self.linearizer, &self.start)
    }

    /// Fills the block with one step, or with the state at one output time.
    fn fill(&mut self, stages: &mut LinearizedStages) -> Result<bool> {
        stages.return_record(&mut self.steps.driver.stepper.rhs.record);
        let Some(event) = self.steps.advance(sample)? else { return Ok(false) };
        let Self { mechanism, steps, recorder, linearizer, is_parallel, is_dense, .. } = self;
        let (method, rhs) = (steps.driver.stepper.method, &mut steps.driver.stepper.rhs);
        stages.take_record(&mut rhs.record);
        (stages.event, stages.is_restarted) = (event, steps.driver.switches.is_restarted);
        stages.grading = steps.driver.stepper.grading;
        let first = if stages.is_restarted { 0 } else { 1 };
        let mut linearize = |slots| stages.linearize(linearizer, mechanism, slots, *is_parallel);
        match event {
            StepEvent::Start => linearize(0..1),
            StepEvent::Step(_) => {
                *is_dense = false;
                linearize(first..method.end + 1);
                stages.linearize_projections(linearizer, mechanism);
            }
            StepEvent::Output { is_dense: needs_dense, .. } => {
                recorder.record(mechanism, &rhs.state)?;
                if needs_dense && !std::mem::replace(is_dense, true) {
                    linearize(method.end + 1..method.slots());
                }
                linearize(SAMPLE..SAMPLE + 1);
            }
        }
        Ok(true)
    }
}
