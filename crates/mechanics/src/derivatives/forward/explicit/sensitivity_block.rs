//! Sensitivities of a mechanism's motion by explicit steps, for a few design variables at a time.

use crate::Result;
use crate::derivatives::forward::explicit::explicit_steps::{LinearizedStages, StepEvent};
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::forward::explicit::nystrom::{NystromWeights, StepDerivatives};
use crate::derivatives::propagation::StepConsumer;
use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::mechanism::SAMPLE;
use crate::integrators::explicit::tableau::Tableau;
use crate::linalg::factor::SolveWorkspace;
use crate::linalg::simd::Gradient;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{Dual8, StateScalar};
use crate::system::outputs::Sampler;
use crate::system::state::State;
use crate::system::{System, Unknown};
use autodiff::WIDTH;

/// Data that the blocks of all design variables share.
pub(crate) struct BlockData {
    method: &'static Tableau,
    /// Weights of the stages, for each grading.
    weights: [Vec<NystromWeights>; 3],
    /// Coordinates on whose positions and velocities accelerations depend.
    state_coordinates: Vec<usize>,
    unknowns: Vec<Unknown>,
    /// Prescribed coordinates whose motion depends on the design.
    moving: Vec<usize>,
}

impl BlockData {
    pub fn new(method: &'static Tableau, linearizer: &Linearizer, system: &System) -> Self {
        Self {
            method,
            weights: Grading::ALL.map(|grading| NystromWeights::table(method, grading)),
            state_coordinates: linearizer.state_coordinates(),
            unknowns: system.unknowns().to_vec(),
            moving: linearizer.moving.clone(),
        }
    }
}

/// The derivatives of a motion with respect to `W` design variables, which are propagated along explicit steps.
///
/// Two chunks of [`WIDTH`] design variables may share a block: one back-substitution serves the columns of both.
pub(crate) struct SensitivityBlock<'m, const W: usize> {
    shared: &'m BlockData,
    /// Chunk by chunk of [`WIDTH`] design variables.
    outputs: Vec<DualOutputs<'m>>,
    step: StepDerivatives<W>,
    /// Derivatives of the sources: positions, velocities, accelerations of prescribed coordinates, parameters.
    sources: Vec<Gradient<W>>,
    /// For each parameter, true if it depends on these design variables.
    active: Vec<bool>,
    rows: Vec<Gradient<W>>,
    velocity_rows: Vec<Gradient<W>>,
    workspace: SolveWorkspace,
    is_dense: bool,
    /// Of the outputs, by time, output and design variable.
    pub derivatives: Vec<f64>,
}

impl<'m, const W: usize> SensitivityBlock<'m, W> {
    /// Block at the initial state `values` of a motion, and its derivatives `start` in each of the `chunks`.
    pub fn new(
        shared: &'m BlockData,
        chunks: &'m [Mechanism<Dual8>],
        start: &[State<Dual8>],
        linearizer: &Linearizer,
        system: &System,
        values: &State<f64>,
        times: usize,
    ) -> Self {
        let n = values.q.len();
        let mut sources = vec![[0.0; W]; linearizer.sources()];
        for (c, (chunk, state)) in chunks.iter().zip(start).enumerate() {
            let parameters =
                linearizer.parameters.iter().map(|&(element, local)| &chunk.elements[element].parameters[local]);
            let accelerations = state.a.iter().map(|_| &ZERO);
            let all = state.q.iter().chain(&state.v).chain(accelerations).chain(parameters);
            sources.iter_mut().zip(all).for_each(|(source, x)| columns(source, c).copy_from_slice(&x.eps));
        }
        let active = sources[3 * n..].iter().map(|derivatives| derivatives.iter().any(|x| *x != 0.0)).collect();
        let rows = vec![[0.0; W]; system.size()];
        let outputs = chunks.first().map_or(0, |chunk| chunk.outputs.len());
        Self {
            shared,
            outputs: chunks.iter().map(|chunk| DualOutputs::new(chunk, values)).collect(),
            step: StepDerivatives::new(values.t, &sources[..2 * n]),
            sources,
            active,
            velocity_rows: rows.clone(),
            rows,
            workspace: system.solve_workspace(),
            is_dense: false,
            derivatives: Vec::with_capacity(times * outputs * W),
        }
    }

    /// Propagates the derivatives from the beginning of the step between `t[0]` and `t[1]` to its end.
    fn advance(&mut self, stages: &LinearizedStages, t: [f64; 2]) {
        let (shared, n) = (self.shared, self.coordinates());
        let (method, end) = (shared.method, shared.method.end);
        self.is_dense = false;
        self.step.advance(method, t);
        if stages.is_restarted {
            self.step.begin(&mut self.sources[..2 * n]);
            self.accelerate(stages, 0);
        }
        (1..end).for_each(|slot| self.evaluate(stages, slot));
        self.step.combine(&shared.weights[stages.grading as usize][end], 0..n, &mut self.sources);
        self.project(stages);
        self.step.finish(&self.sources[..2 * n]);
        self.accelerate(stages, end);
    }

    /// Records the derivatives of the outputs at `t`, inside the step (`is_dense`) or at its end.
    fn record_outputs(&mut self, stages: &LinearizedStages, t: f64, is_dense: bool) {
        let (method, n) = (self.shared.method, self.coordinates());
        if is_dense && !std::mem::replace(&mut self.is_dense, true) {
            (method.end + 1..method.slots()).for_each(|slot| self.evaluate(stages, slot));
        }
        if is_dense {
            self.step.interpolate(method, stages.grading, t, &mut self.sources[..2 * n]);
        } else {
            self.step.end(&mut self.sources[..2 * n]);
        }
        self.solve_accelerations(stages, SAMPLE);
        let values = &stages.record().stages[SAMPLE].state;
        for (c, outputs) in self.outputs.iter_mut().enumerate() {
            outputs.evaluate(values, &self.sources, &self.rows, &self.shared.unknowns, c);
        }
        for output in 0..self.outputs[0].values.len() {
            let first = self.derivatives.len();
            self.outputs.iter().for_each(|chunk| self.derivatives.extend(chunk.values[output].eps));
            self.derivatives.resize(first + W, 0.0);
        }
    }

    /// Number of coordinates.
    fn coordinates(&self) -> usize {
        self.step.accelerations.len()
    }

    /// Derivatives of the state and of the accelerations at a stage.
    fn evaluate(&mut self, stages: &LinearizedStages, slot: usize) {
        let shared = self.shared;
        self.step.combine(
            &shared.weights[stages.grading as usize][slot],
            shared.state_coordinates.iter().copied(),
            &mut self.sources,
        );
        self.accelerate(stages, slot);
    }

    /// Derivatives of the accelerations at a stage.
    fn accelerate(&mut self, stages: &LinearizedStages, slot: usize) {
        self.solve_accelerations(stages, slot);
        for (unknown, &derivatives) in self.shared.unknowns.iter().zip(&self.rows) {
            if let Unknown::Coordinate(i) = *unknown {
                self.step.accelerations[i][slot] = derivatives;
            }
        }
    }

    /// Solves for the derivatives of accelerations and multipliers; they are then in the rows.
    fn solve_accelerations(&mut self, stages: &LinearizedStages, slot: usize) {
        let stage = &stages.record().stages[slot];
        self.prescribe(stage.state.t);
        self.rows.fill([0.0; W]);
        stages.entries[slot].subtract(&self.sources, &self.active, &mut self.rows);
        stage.factor.solve_in(&mut self.rows, &mut self.workspace);
    }

    /// Writes the derivatives of prescribed coordinates at the time `t` (s) to the sources.
    fn prescribe(&mut self, t: f64) {
        for (c, outputs) in self.outputs.iter().enumerate() {
            outputs.prescribe(&self.shared.moving, t, c, &mut self.sources);
        }
    }

    /// Differentiates the projections of positions and velocities at the end of a step.
    fn project(&mut self, stages: &LinearizedStages) {
        if stages.is_free {
            return;
        }
        let (n, projected) = (self.coordinates(), &stages.record().projected);
        let [positions, velocities, corrections] = &stages.projections;
        self.prescribe(projected.before.t);
        self.velocity_rows.fill([0.0; W]);
        corrections.subtract(&self.sources, &self.active, &mut self.velocity_rows);
        self.rows.fill([0.0; W]);
        positions.subtract(&self.sources, &self.active, &mut self.rows);
        projected.factor.solve_in(&mut self.rows, &mut self.workspace);
        add_changes(&self.shared.unknowns, &self.rows, &mut self.sources[..n]);
        velocities.subtract(&self.sources, &self.active, &mut self.velocity_rows);
        projected.factor.solve_in(&mut self.velocity_rows, &mut self.workspace);
        add_changes(&self.shared.unknowns, &self.velocity_rows, &mut self.sources[n..2 * n]);
    }
}

impl<const W: usize> StepConsumer<LinearizedStages> for SensitivityBlock<'_, W> {
    fn propagate(&mut self, stages: &LinearizedStages) -> Result<()> {
        match stages.event {
            StepEvent::Start => self.accelerate(stages, 0),
            StepEvent::Step(t) => self.advance(stages, t),
            StepEvent::Output { t, is_dense } => self.record_outputs(stages, t, is_dense),
        }
        Ok(())
    }
}

/// Adds the solution of a projection to positions or velocities.
fn add_changes<const W: usize>(unknowns: &[Unknown], rows: &[Gradient<W>], y: &mut [Gradient<W>]) {
    for (unknown, changes) in unknowns.iter().zip(rows) {
        if let Unknown::Coordinate(i) = *unknown {
            y[i].iter_mut().zip(changes).for_each(|(y, change)| *y += change);
        }
    }
}

const ZERO: Dual8 = Dual8 { re: 0.0, eps: [0.0; WIDTH] };

/// The columns of chunk number `c`.
pub(crate) fn columns<const W: usize>(block: &mut Gradient<W>, c: usize) -> &mut [f64] {
    &mut block[c * WIDTH..(c + 1) * WIDTH]
}

/// The outputs of a mechanism in dual numbers.
pub(crate) struct DualOutputs<'m> {
    mechanism: &'m Mechanism<Dual8>,
    state: State<Dual8>,
    sampler: Sampler<Dual8>,
    pub values: Vec<Dual8>,
}

impl<'m> DualOutputs<'m> {
    pub fn new(mechanism: &'m Mechanism<Dual8>, values: &State<f64>) -> Self {
        let zeros = |x: &[f64]| vec![ZERO; x.len()];
        let [q, v, a, l] = [&values.q, &values.v, &values.a, &values.l].map(|x| zeros(x));
        let state = State { t: Dual8::constant(values.t), q, v, a, l, modes: values.modes.clone() };
        Self { mechanism, state, sampler: Sampler::new(mechanism), values: Vec::new() }
    }

    /// Writes the derivatives of the coordinates `moving`, which are prescribed, at the time `t` (s) to chunk `c` of `sources`.
    pub fn prescribe<const W: usize>(&self, moving: &[usize], t: f64, c: usize, sources: &mut [Gradient<W>]) {
        let n = self.mechanism.coordinates.len();
        for &i in moving {
            let motion = self.mechanism.coordinates[i].motion.as_ref();
            let (motion, parameters) = motion.expect("the coordinate is prescribed");
            for (k, x) in Dual8::motion(motion.as_ref(), parameters, Dual8::constant(t)).iter().enumerate() {
                columns(&mut sources[k * n + i], c).copy_from_slice(&x.eps);
            }
        }
    }

    /// Evaluates the outputs at `values`, with the derivatives in chunk `c` of `sources` and of the solution `rows`.
    pub fn evaluate<const W: usize>(
        &mut self,
        values: &State<f64>,
        sources: &[Gradient<W>],
        rows: &[Gradient<W>],
        unknowns: &[Unknown],
        c: usize,
    ) {
        let (n, state) = (values.q.len(), &mut self.state);
        state.modes.copy_from(&values.modes);
        let dual = |re: f64, block: &Gradient<W>| {
            let mut eps = [0.0; WIDTH];
            eps.copy_from_slice(&block[c * WIDTH..(c + 1) * WIDTH]);
            Dual8 { re, eps }
        };
        state.t = Dual8::constant(values.t);
        for i in 0..n {
            state.q[i] = dual(values.q[i], &sources[i]);
            state.v[i] = dual(values.v[i], &sources[n + i]);
            state.a[i] = dual(values.a[i], &sources[2 * n + i]);
        }
        for (unknown, derivatives) in unknowns.iter().zip(rows) {
            match *unknown {
                Unknown::Coordinate(i) => state.a[i] = dual(values.a[i], derivatives),
                Unknown::Multiplier(m) => state.l[m] = dual(values.l[m], derivatives),
            }
        }
        self.sampler.outputs(self.mechanism, &self.state, &mut self.values);
    }
}
