//! The adjoint equations of implicit steps, from the last to the first.

use crate::Result;
use crate::analyses::dynamics::{Dynamics, is_before};
use crate::analyses::sampling::{Weights, interpolate};
use crate::checkpointing::recording::Recording;
use crate::checkpointing::reverse_playback::Rewind;
use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::Functional;
use crate::derivatives::adjoint::adjoint_state::{Bars, LANES, Lanes};
use crate::derivatives::adjoint::batch::{Lane, Products};
use crate::derivatives::adjoint::replay_statistics::Spent;
use crate::diagnostics;
use crate::integrators::generalized_alpha::Prescribed;
use crate::integrators::time_stepper::Run;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::Unknown;
use crate::system::linearization::Linearization;
use crate::system::state::State;

/// All responses on their way back along a recorded motion.
pub(crate) struct Backward<'m> {
    pub lanes: Vec<Lane>,
    mechanism: &'m Mechanism<f64>,
    recording: &'m Recording,
    rewind: Rewind<'m, Run<'m>>,
    settings: &'m Dynamics,
    times: &'m [f64],
    /// For each time, the responses that it counts in: lane, output and weight.
    wanted: Vec<Vec<(usize, usize, Lanes)>>,
    dependence: &'m Dependence,
    products: Products,
    pub system: System,
    rows: Vec<[f64; 1]>,
    before: Vec<Bars>,
    old: State<f64>,
    new: State<f64>,
    between: State<f64>,
    between_bars: Bars,
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
        let rewind = Rewind::new(&recording.log, || Run::new(mechanism, settings, times))?;
        let system = recording.system.clone();
        let state = || recording.start.clone();
        let count = functionals.len().div_ceil(LANES);
        Ok(Self {
            lanes: vec![Lane::new(mechanism, system.size()); count],
            before: vec![Bars::new(mechanism); count],
            wanted: by_time(functionals, times.len()),
            products: Products::new(mechanism, dependence, &system, count),
            rows: vec![[0.0]; system.size()],
            old: state(),
            new: state(),
            between: state(),
            between_bars: Bars::new(mechanism),
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
    pub fn spent(&self) -> Spent {
        Spent::of(self.recording.steps(), &self.rewind)
    }

    /// Takes in the outputs at time number `k`, which is in the current step.
    fn sample(&mut self, k: usize) {
        let t = self.times[k];
        let weights = Weights::of([self.old.t, self.new.t], t);
        interpolate(&self.old, &self.new, t, &mut self.between);
        for (number, output, weight) in &self.wanted[k] {
            let (lane, before) = (&mut self.lanes[*number], &mut self.before[*number]);
            std::mem::swap(&mut lane.now, &mut self.between_bars);
            lane.output(self.mechanism, &self.between, *output, weight, &mut self.products.probe);
            std::mem::swap(&mut lane.now, &mut self.between_bars);
            self.between_bars.spread(weights, [before, &mut lane.now]);
            self.between_bars.clear();
        }
    }

    /// From the end of the step `h` to its beginning.
    fn back(&mut self, h: f64) -> Result<()> {
        let (position, velocity) = self.settings.scheme.seeds(h);
        let how = Linearization::step(position, velocity);
        self.system.assemble(self.mechanism, &self.new, how, &mut self.rows);
        diagnostics::factorize(&mut self.system, self.mechanism, &self.new)?;
        for lane in &mut self.lanes {
            lane.solve(&mut self.system, |bars, unknown| match unknown {
                Unknown::Coordinate(i) => bars.by_acceleration(&self.settings.scheme, h, i),
                Unknown::Multiplier(m) => bars.l[m],
            });
        }
        let mut lanes: Vec<&mut Lane> = self.lanes.iter_mut().collect();
        self.products.pull(self.mechanism, &self.system, &self.new, how.closure, &mut lanes);
        (0..self.lanes.len()).for_each(|lane| self.hand_on(lane, h));
        Ok(())
    }

    /// From the end of the step `h` to its beginning, where the step's own formulas lead.
    fn hand_on(&mut self, number: usize, h: f64) {
        let Dynamics { scheme, prescribed, .. } = self.settings;
        let (Lane { now, design, .. }, before) = (&mut self.lanes[number], &mut self.before[number]);
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
pub(crate) fn by_time(functionals: &[Functional], times: usize) -> Vec<Vec<(usize, usize, Lanes)>> {
    let mut wanted = vec![Vec::new(); times];
    for (f, functional) in functionals.iter().enumerate() {
        for term in &functional.terms {
            let mut weight = [0.0; LANES];
            weight[f % LANES] = term.weight;
            wanted[term.point].push((f / LANES, term.output, weight));
        }
    }
    wanted
}
