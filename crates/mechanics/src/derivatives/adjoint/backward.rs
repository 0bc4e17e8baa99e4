//! The adjoint equations of implicit steps, from the last to the first.

use crate::Result;
use crate::analyses::dynamics::{Dynamics, is_before};
use crate::analyses::sampling::{Weights, interpolate};
use crate::checkpointing::recording::Recording;
use crate::checkpointing::reverse_playback::ReversePlayback;
use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::Functional;
use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues};
use crate::derivatives::adjoint::batch::{AdjointBatch, ElementProducts};
use crate::derivatives::adjoint::replay_statistics::ReplayStatistics;
use crate::diagnostics;
use crate::integrators::generalized_alpha::Prescribed;
use crate::integrators::time_stepper::TimeStepper;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::Unknown;
use crate::system::linearization::Linearization;
use crate::system::state::State;

/// All responses on their way back along a recorded motion.
pub(crate) struct Backward<'m> {
    pub batches: Vec<AdjointBatch>,
    mechanism: &'m Mechanism<f64>,
    recording: &'m Recording,
    rewind: ReversePlayback<'m, TimeStepper<'m>>,
    settings: &'m Dynamics,
    times: &'m [f64],
    /// For each time, the responses that it counts in: lane, output and weight.
    wanted: Vec<Vec<(usize, usize, BatchValues)>>,
    dependence: &'m Dependence,
    products: ElementProducts,
    pub system: System,
    rows: Vec<[f64; 1]>,
    before: Vec<AdjointState>,
    old: State<f64>,
    new: State<f64>,
    between: State<f64>,
    between_bars: AdjointState,
}

impl<'m> Backward<'m> {
    /// Before the last step.
    pub fn new(
        mechanism: &'m Mechanism<f64>,
        recording: &'m Recording,
        settings: &'m Dynamics,
        times: &'m [f64],
        functionals: &[Functional],
        dependence: &'m Dependence,
    ) -> Result<Self> {
        let rewind = ReversePlayback::new(&recording.log, || TimeStepper::new(mechanism, settings, times))?;
        let system = recording.system.clone();
        let state = || recording.start.clone();
        let count = functionals.len().div_ceil(BATCH);
        Ok(Self {
            batches: vec![AdjointBatch::new(mechanism, system.size()); count],
            before: vec![AdjointState::new(mechanism); count],
            wanted: by_time(functionals, times.len()),
            products: ElementProducts::new(mechanism, dependence, &system, count),
            rows: vec![[0.0]; system.size()],
            old: state(),
            new: state(),
            between: state(),
            between_bars: AdjointState::new(mechanism),
            mechanism,
            recording,
            rewind,
            settings,
            times,
            dependence,
            system,
        })
    }

    /// Goes back to the start of the motion.
    pub fn run(&mut self) -> Result<()> {
        let mut left = self.wanted.iter().rposition(|wanted| !wanted.is_empty()).map_or(0, |last| last + 1);
        let steps = left.checked_sub(1).map_or(0, |last| self.recording.log.steps_to(self.times[last]));
        let mut h = if steps > 0 { self.new.read(self.rewind.row(steps - 1)?) } else { 0.0 };
        for k in (0..steps).rev() {
            let length = match k {
                0 => {
                    self.old.copy_from(&self.recording.start);
                    0.0
                }
                _ => self.old.read(self.rewind.row(k - 1)?),
            };
            while left > 0 && is_before(self.settings.start, self.old.t, self.times[left - 1]) {
                left -= 1;
                self.sample(left);
            }
            self.back(h)?;
            std::mem::swap(&mut self.old, &mut self.new);
            h = length;
        }
        self.old.copy_from(&self.recording.start);
        self.new.copy_from(&self.recording.start);
        (0..left).for_each(|k| self.sample(k));
        Ok(())
    }

    /// What the way back takes.
    pub fn spent(&self) -> ReplayStatistics {
        ReplayStatistics::of(self.recording.steps(), &self.rewind)
    }

    /// Takes in the outputs at time number `k`, which is in the current step.
    fn sample(&mut self, k: usize) {
        let t = self.times[k];
        let weights = Weights::of([self.old.t, self.new.t], t);
        interpolate(&self.old, &self.new, t, &mut self.between);
        for (number, output, weight) in &self.wanted[k] {
            let (batch, before) = (&mut self.batches[*number], &mut self.before[*number]);
            std::mem::swap(&mut batch.now, &mut self.between_bars);
            batch.output(self.mechanism, &self.between, *output, weight, &mut self.products.probe);
            std::mem::swap(&mut batch.now, &mut self.between_bars);
            self.between_bars.spread(weights, [before, &mut batch.now]);
            self.between_bars.clear();
        }
    }

    /// From the end of the step `h` to its beginning.
    fn back(&mut self, h: f64) -> Result<()> {
        let (position, velocity) = self.settings.scheme.newmark_coefficients(h);
        let how = Linearization::step(position, velocity);
        self.system.assemble(self.mechanism, &self.new, how, &mut self.rows);
        diagnostics::factorize(&mut self.system, self.mechanism, &self.new)?;
        for batch in &mut self.batches {
            batch.solve(&mut self.system, |bars, unknown| match unknown {
                Unknown::Coordinate(i) => bars.by_acceleration(&self.settings.scheme, h, i),
                Unknown::Multiplier(m) => bars.l[m],
            });
        }
        let mut batches: Vec<&mut AdjointBatch> = self.batches.iter_mut().collect();
        self.products.vjp(self.mechanism, &self.system, &self.new, how.constraint_scale, &mut batches);
        (0..self.batches.len()).for_each(|batch| self.propagate_to_step_start(batch, h));
        Ok(())
    }

    /// From the end of the step `h` to its beginning, where the step's own formulas lead.
    fn propagate_to_step_start(&mut self, number: usize, h: f64) {
        let Dynamics { scheme, prescribed, .. } = self.settings;
        let (AdjointBatch { now, design, .. }, before) = (&mut self.batches[number], &mut self.before[number]);
        for (i, coordinate) in self.mechanism.coordinates.iter().enumerate() {
            if coordinate.motion.is_none() {
                now.free_to(before, scheme, h, i);
            } else if self.dependence.motions[i] {
                let position = match prescribed {
                    Prescribed::Exact => now.q[i],
                    Prescribed::Newmark => now.prescribed_to(before, scheme, h, i),
                };
                let bars = [&position, &now.v[i], &now.a[i]];
                design.take_motion(self.mechanism, i, self.new.t, *prescribed, bars);
            }
        }
        std::mem::swap(now, before);
        before.clear();
    }
}

/// The responses' terms by time.
pub(crate) fn by_time(functionals: &[Functional], times: usize) -> Vec<Vec<(usize, usize, BatchValues)>> {
    let mut wanted = vec![Vec::new(); times];
    for (f, functional) in functionals.iter().enumerate() {
        for term in &functional.terms {
            let mut weight = [0.0; BATCH];
            weight[f % BATCH] = term.weight;
            wanted[term.point].push((f / BATCH, term.output, weight));
        }
    }
    wanted
}
