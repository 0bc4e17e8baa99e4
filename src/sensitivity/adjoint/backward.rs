//! The adjoint equations of implicit steps, from the last to the first.

use super::Functional;
use super::bars::{Bars, LANES, Lanes, add};
use super::design::{Dependence, DesignBars};
use super::local::{Probe, Rows, Slot};
use super::outputs::Sink;
use crate::Result;
use crate::analysis::dynamics::{Dynamics, is_before};
use crate::analysis::generalized_alpha::Prescribed;
use crate::analysis::sampling::{Weights, interpolate};
use crate::analysis::system::{Linearization, Unknown};
use crate::analysis::{Recording, State, System, blame};
use crate::multibody::Mechanism;
use crate::multibody::mechanism::PartData;

/// Up to [`LANES`] responses on their way back.
pub(super) struct Lane {
    /// Derivatives by the state that has been reached.
    pub now: Bars,
    /// Derivatives by parameters so far.
    pub design: DesignBars,
    before: Bars,
    at: Bars,
    /// ψ by equation.
    multipliers: Vec<Lanes>,
}

/// All responses on their way back along a recorded motion.
pub(super) struct Backward<'m> {
    pub lanes: Vec<Lane>,
    mechanism: &'m Mechanism<f64>,
    recording: &'m Recording,
    settings: &'m Dynamics,
    times: &'m [f64],
    /// For each time, the responses that it counts in: lane, output and weight.
    wanted: Vec<Vec<(usize, usize, Lanes)>>,
    dependence: &'m Dependence,
    slots: Vec<Vec<Slot>>,
    system: System,
    rows: Vec<[f64; 1]>,
    /// For each lane ψ of one element's rows.
    weights: Vec<Vec<Lanes>>,
    probe: Probe,
    old: State<f64>,
    new: State<f64>,
    between: State<f64>,
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
    ) -> Self {
        let system = recording.system.clone();
        let bars = Bars::new(mechanism);
        let lane = || Lane {
            now: bars.clone(),
            before: bars.clone(),
            at: bars.clone(),
            design: DesignBars::new(mechanism),
            multipliers: vec![[0.0; LANES]; system.size()],
        };
        let state = || recording.start.clone();
        let (count, size) =
            (functionals.len().div_ceil(LANES), |part: &PartData<f64>| part.coordinates.len() + part.closures);
        let most = mechanism.parts.iter().map(size).max().unwrap_or(0);
        Self {
            lanes: (0..count).map(|_| lane()).collect(),
            weights: vec![vec![[0.0; LANES]; most]; count],
            wanted: by_time(functionals, times.len()),
            slots: dependence.slots(mechanism),
            rows: vec![[0.0]; system.size()],
            probe: Probe::default(),
            old: state(),
            new: state(),
            between: state(),
            mechanism,
            recording,
            settings,
            times,
            dependence,
            system,
        }
    }

    /// Goes back to the start of the motion.
    pub fn run(&mut self) -> Result<()> {
        let mut left = self.wanted.iter().rposition(|wanted| !wanted.is_empty()).map_or(0, |last| last + 1);
        let start = self.settings.start;
        let last = left.checked_sub(1).map_or(start, |k| self.times[k]);
        let before = self.recording.ends().take_while(|&end| is_before(start, end, last)).count();
        let is_there = !is_before(start, self.recording.start.t, last);
        let steps = if is_there { 0 } else { (before + 1).min(self.recording.steps()) };
        if steps > 0 {
            self.recording.load(steps - 1, &mut self.new);
        }
        for k in (0..steps).rev() {
            let h = self.recording.length(k);
            match k {
                0 => self.old.copy_from(&self.recording.start),
                _ => _ = self.recording.load(k - 1, &mut self.old),
            }
            while left > 0 && is_before(start, self.old.t, self.times[left - 1]) {
                left -= 1;
                self.sample(left);
            }
            self.back(h)?;
            std::mem::swap(&mut self.old, &mut self.new);
        }
        self.old.copy_from(&self.recording.start);
        self.new.copy_from(&self.recording.start);
        (0..left).for_each(|k| self.sample(k));
        Ok(())
    }

    /// Takes in the outputs at time number `k`, which is in the current step.
    fn sample(&mut self, k: usize) {
        let t = self.times[k];
        let weights = Weights::of([self.old.t, self.new.t], t);
        interpolate(&self.old, &self.new, t, &mut self.between);
        for (lane, output, weight) in &self.wanted[k] {
            let Lane { now, before, at, design, .. } = &mut self.lanes[*lane];
            at.clear();
            let mut sink = Sink { bars: at, design };
            sink.output(self.mechanism, &self.between, *output, weight, &mut self.probe);
            at.spread(weights, [before, now]);
        }
    }

    /// From the end of the step `h` to its beginning.
    fn back(&mut self, h: f64) -> Result<()> {
        let (position, velocity) = self.settings.scheme.seeds(h);
        let how = Linearization::step(position, velocity);
        self.system.assemble(self.mechanism, &self.new, how, &mut self.rows);
        blame::factorize(&mut self.system, self.mechanism, &self.new)?;
        for lane in &mut self.lanes {
            lane.solve(&mut self.system, self.settings, h);
        }
        self.pull(how.closure);
        for lane in &mut self.lanes {
            lane.hand_on(self.mechanism, self.settings, self.dependence, h, self.new.t);
        }
        Ok(())
    }

    /// Adds ψᵀ ∂F/∂x for every variable x of every element.
    fn pull(&mut self, closure: f64) {
        for (k, (part, slots)) in self.mechanism.parts.iter().zip(&self.slots).enumerate() {
            if slots.is_empty() {
                continue;
            }
            let (rows, n) = (part.coordinates.len() + part.closures, part.coordinates.len());
            for (lane, weights) in self.lanes.iter().zip(&mut self.weights) {
                lane.weigh(&self.system, k, n, closure, weights);
            }
            let sets = self.weights.iter().map(|weights| &weights[..rows]);
            let lanes = &mut self.lanes;
            self.probe.pull(part, &self.new, slots, Rows::Residual, sets, |set, slot, bar| {
                let Lane { now, design, .. } = &mut lanes[set];
                let to = match slot {
                    Slot::Position(i) => &mut now.q[part.coordinates[i]],
                    Slot::Velocity(i) => &mut now.v[part.coordinates[i]],
                    Slot::Acceleration(i) => &mut now.a[part.coordinates[i]],
                    Slot::Multiplier(i) => &mut now.l[part.first_multiplier + i],
                    Slot::Parameter(i) => &mut design.parameters[k][i],
                };
                add(to, 1.0, &bar);
            });
        }
    }
}

impl Lane {
    /// Aᵀ ψ = −(∂/∂a, ∂/∂λ).
    fn solve(&mut self, system: &mut System, settings: &Dynamics, h: f64) {
        for (bar, unknown) in self.multipliers.iter_mut().zip(system.unknowns()) {
            let by_unknown = match *unknown {
                Unknown::Coordinate(i) => self.now.by_acceleration(&settings.scheme, h, i),
                Unknown::Multiplier(m) => self.now.l[m],
            };
            *bar = by_unknown.map(|x| -x);
        }
        system.factor().solve_transposed(&mut self.multipliers);
    }

    /// Looks up ψ of the rows of element number `part`, the first `coordinates` of which are not scaled.
    fn weigh(&self, system: &System, part: usize, coordinates: usize, closure: f64, weights: &mut [Lanes]) {
        weights.fill([0.0; LANES]);
        for (row, equation) in system.rows_of(part) {
            let scale = if row < coordinates { 1.0 } else { closure };
            add(&mut weights[row], scale, &self.multipliers[equation]);
        }
    }

    /// From the end of the step `h` at time `t` to its beginning.
    fn hand_on(&mut self, mechanism: &Mechanism<f64>, settings: &Dynamics, dependence: &Dependence, h: f64, t: f64) {
        let Dynamics { scheme, prescribed, .. } = settings;
        for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
            if coordinate.motion.is_none() {
                self.now.free_to(&mut self.before, scheme, h, i);
            } else if dependence.motions[i] {
                let Bars { q, v, a, .. } = &self.now;
                let position = match prescribed {
                    Prescribed::Exact => q[i],
                    Prescribed::Newmark => self.now.prescribed_to(&mut self.before, scheme, h, i),
                };
                self.design.take_motion(mechanism, i, t, *prescribed, [&position, &v[i], &a[i]]);
            }
        }
        std::mem::swap(&mut self.now, &mut self.before);
        self.before.clear();
    }
}

/// The responses' terms by time.
fn by_time(functionals: &[Functional], times: usize) -> Vec<Vec<(usize, usize, Lanes)>> {
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
