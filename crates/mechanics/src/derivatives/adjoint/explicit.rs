//! The discrete adjoint of a mechanism's motion by explicit steps.

use crate::Result;
use crate::analyses::dynamics::InitialConfiguration;
use crate::analyses::dynamics::simulate_with_recording;
use crate::checkpointing::recording::ExplicitRecording;
use crate::checkpointing::reverse_playback::ReversePlayback;
use crate::checkpointing::trajectory_store::Checkpointable;
use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues};
use crate::derivatives::adjoint::backward::by_time;
use crate::derivatives::adjoint::batch::{AdjointBatch, ElementProducts};
use crate::derivatives::adjoint::initial_conditions::InitialConditionAdjoint;
use crate::derivatives::adjoint::replay_statistics::ReplayStatistics;
use crate::derivatives::adjoint::stages::{Stages, Way};
use crate::derivatives::adjoint::{Functional, check, contract};
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::forward::explicit::step_records::StageRecords;
use crate::derivatives::seeding::build_sensitive;
use crate::integrators::explicit::mechanism::{MechanismRhs, SAMPLE, sample, start};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;

use crate::integrators::explicit::stepper::OdeRhs;
use crate::mechanism::{Mechanism, ParametricMechanism};
use nalgebra::DMatrix;

/// Simulates `model` at the design `b` by explicit steps and differentiates `responses` of its outputs at `times`, a row
/// each, with respect to `b`, backwards in time.
///
/// The steps are frozen, as they are by [`differentiate_explicitly`](crate::derivatives::forward::explicit::mechanism::differentiate_explicitly),
/// whose result this is up to rounding. Every step is taken once more, for its stages; those are gone through in reverse,
/// with the transposed matrix of each, and so are the projection at its end and the states inside it.
///
/// **Errors.** As there, and [`crate::Error::Definition`] if a response has a term that there is not.
pub fn differentiate_explicitly_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
    responses: &[Functional],
) -> Result<DMatrix<f64>> {
    differentiate_explicitly_backwards_within(usize::MAX, model, b, settings, times, responses).map(|(rows, _)| rows)
}

/// The same in at most `memory` bytes for the states between steps, and what of them it took.
///
/// **Errors.** As [`differentiate_explicitly_backwards`], and [`crate::Error::Definition`] if the memory does not hold four
/// check-points.
pub fn differentiate_explicitly_backwards_within<M: ParametricMechanism>(
    memory: usize,
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
    responses: &[Functional],
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let (_, recording) = simulate_with_recording(&model.build(b)?, settings, times, memory)?;
    differentiate_explicit_recording_backwards(model, b, settings, times, responses, &recording)
}

/// The same at the steps of a recording of `model` at `b`.
pub fn differentiate_explicit_recording_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
    responses: &[Functional],
    recording: &ExplicitRecording,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let mechanism = model.build(b)?;
    check(responses, mechanism.outputs.len(), times.len())?;
    let sensitive = build_sensitive(model, b, &mechanism)?;
    let dependence = Dependence::of(&sensitive, &mechanism);
    let mut backward = Backward::new(&mechanism, &dependence, settings, times, responses, recording)?;
    backward.run()?;
    let Backward { ways, rewind, .. } = backward;
    let spent = ReplayStatistics::of(recording.log.steps(), &rewind);
    let (mut batches, mut system): (Vec<AdjointBatch>, _) =
        (ways.into_iter().map(|way| way.batch).collect(), recording.system.clone());
    let (mut all, begin): (Vec<&mut AdjointBatch>, _) = (batches.iter_mut().collect(), &recording.start);
    InitialConditionAdjoint::new(&mechanism, &dependence, &system).back(
        &mut system,
        &begin.state,
        &begin.projection,
        false,
        InitialConfiguration::Built,
        &mut all,
    )?;
    Ok((contract(&batches, &sensitive, responses.len(), b.len()), spent))
}

/// All responses on their way back.
struct Backward<'m> {
    ways: Vec<Way>,
    rewind: ReversePlayback<'m, OdeDriver<MechanismRhs<'m>>>,
    recording: &'m ExplicitRecording,
    /// Takes every step once more, and remembers its stages.
    march: OdeDriver<MechanismRhs<'m>>,
    stages: Stages<'m>,
    times: &'m [f64],
    /// For each time, the responses that it counts in: lane, output and weight.
    wanted: Vec<Vec<(usize, usize, BatchValues)>>,
    /// Number of `times` that are still to come.
    left: usize,
    between: Vec<f64>,
}

impl<'m> Backward<'m> {
    fn new(
        mechanism: &'m Mechanism<f64>,
        dependence: &'m Dependence,
        settings: &'m Explicit,
        times: &'m [f64],
        responses: &[Functional],
        recording: &'m ExplicitRecording,
    ) -> Result<Self> {
        let rewind = ReversePlayback::new(&recording.log, || Ok(start(mechanism, settings, times, false)?.0))?;
        let (march, begin) = start(mechanism, settings, times, true)?;
        let system = &march.stepper.flow.system;
        let (linearizer, batches) = (Linearizer::new(mechanism, dependence, system), responses.len().div_ceil(BATCH));
        let stages = Stages {
            mechanism,
            dependence,
            method: march.stepper.method,
            visits: StageRecords::new(&linearizer, &begin.state),
            sources: vec![[0.0; BATCH]; linearizer.sources()],
            linearizer,
            unknowns: system.unknowns().to_vec(),
            products: ElementProducts::new(mechanism, dependence, system, batches),
            h: 0.0,
        };
        let wanted = by_time(responses, times.len());
        let left = wanted.iter().rposition(|wanted| !wanted.is_empty()).map_or(0, |last| last + 1);
        let ways = (0..batches).map(|_| Way::new(mechanism, &stages)).collect();
        let between = march.stepper.old.clone();
        Ok(Self { ways, rewind, recording, march, stages, times, wanted, left, between })
    }

    /// Goes back to the start of the motion.
    fn run(&mut self) -> Result<()> {
        let mut first = Vec::new();
        self.march.write(&mut first);
        let steps = self.left.checked_sub(1).map_or(0, |last| self.recording.log.steps_to(self.times[last]));
        let mut end = if steps > 0 { self.rewind.row(steps - 1)?[0] } else { first[0] };
        for k in (0..steps).rev() {
            let begin = if k > 0 { self.rewind.row(k - 1)? } else { &first };
            self.march.stepper.put(begin, false);
            let before = begin[0];
            self.back(k, end)?;
            end = before;
        }
        self.march.stepper.put(&first, false);
        self.stages.h = 0.0;
        self.sample_all(0)?;
        let OdeDriver { stepper, scratch, .. } = &mut self.march;
        scratch.resize(stepper.old.len(), 0.0);
        stepper.flow.rates(0, stepper.t[0], &stepper.old, scratch)?;
        self.with_tape(|ways, stages| {
            linearize(stages, 0..1);
            ways.iter_mut().for_each(|way| way.finish(stages));
        });
        Ok(())
    }

    /// From the end of step number `k`, at the time `end`, to its beginning, where the march stands.
    fn back(&mut self, k: usize, end: f64) -> Result<()> {
        self.march.stepper.attempt(end, None)?;
        self.stages.h = self.march.stepper.length();
        let dense = self.sample_all(k + 1)?;
        self.with_tape(|ways, stages| {
            linearize(stages, 1..stages.method.end + 1);
            if dense {
                linearize(stages, stages.method.end + 1..stages.method.slots());
            }
            stages.visits.linearize_projections(&stages.linearizer, stages.mechanism);
            ways.iter_mut().for_each(|way| way.back(stages, dense));
        });
        Ok(())
    }

    /// Takes in all outputs at times that were reached after `steps` steps. Returns whether dense output was needed.
    fn sample_all(&mut self, steps: usize) -> Result<bool> {
        let mut any = false;
        while self.left > 0 && self.recording.log.steps_to(self.times[self.left - 1]) == steps {
            self.left -= 1;
            if self.wanted[self.left].is_empty() {
                continue;
            }
            let t = self.times[self.left];
            let dense = sample(&mut self.march, &mut self.between, t)?;
            let stepper = &self.march.stepper;
            let weights = dense.then(|| stepper.method.dense_weights((t - stepper.t[0]) / stepper.length()));
            any |= dense;
            let wanted = std::mem::take(&mut self.wanted[self.left]);
            self.with_tape(|ways, stages| {
                linearize(stages, SAMPLE..SAMPLE + 1);
                for (k, way) in ways.iter_mut().enumerate() {
                    let mut of_way = wanted.iter().filter(|w| w.0 == k).map(|w| (w.1, &w.2)).peekable();
                    if of_way.peek().is_some() {
                        way.sample(stages, of_way, weights);
                    }
                }
            });
        }
        Ok(any)
    }

    /// Borrows the tape of the flow meanwhile.
    fn with_tape(&mut self, action: impl FnOnce(&mut [Way], &mut Stages<'m>)) {
        self.stages.visits.tape = self.march.stepper.flow.tape.take();
        action(&mut self.ways, &mut self.stages);
        self.march.stepper.flow.tape = self.stages.visits.tape.take();
    }
}

fn linearize(stages: &mut Stages<'_>, slots: std::ops::Range<usize>) {
    stages.visits.linearize(&stages.linearizer, stages.mechanism, slots, false);
}
