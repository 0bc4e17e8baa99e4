//! Accelerations and projections of a mechanism, differentiated for a few design variables at a time.

use crate::analyses::sampling::Sampler;
use crate::derivatives::forward::explicit::Block;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::forward::explicit::nystrom::Nystrom;
use crate::derivatives::forward::explicit::step_records::StageRecords;
use crate::derivatives::forward::explicit::steps::Steps;
use crate::integrators::explicit::mechanism::SAMPLE;
use crate::integrators::explicit::tableau::Tableau;
use crate::linalg::factor::SolveWorkspace;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{Dual8, StateScalar};
use crate::system::System;
use crate::system::Unknown;
use crate::system::state::State;
use autodiff::WIDTH;

/// How a method visits states: the same for all tiles.
pub(crate) struct SensitivityPlan {
    pub method: &'static Tableau,
    pub weights: Vec<Nystrom>,
    /// Coordinates whose positions and velocities accelerations depend on.
    pub felt: Vec<usize>,
    pub unknowns: Vec<Unknown>,
    pub moving: Vec<usize>,
}

/// Derivatives with respect to `W` design variables, along with the steps in `f64`.
///
/// Two chunks of dual numbers may share a tile: their columns go through one back-substitution.
pub(crate) struct SensitivityBlock<'m, const W: usize> {
    /// Output side, chunk by chunk of [`WIDTH`] design variables.
    pub probes: Vec<Probe<'m>>,
    steps: Steps<W>,
    /// Derivatives of the sources: positions, velocities, accelerations of prescribed coordinates, parameters.
    sources: Vec<Block<W>>,
    /// Which parameters change with these design variables.
    active: Vec<bool>,
    rows: Vec<Block<W>>,
    velocity_rows: Vec<Block<W>>,
    workspace: SolveWorkspace,
    is_dense: bool,
}

/// Outputs in dual numbers.
pub(crate) struct Probe<'m> {
    mechanism: &'m Mechanism<Dual8>,
    state: State<Dual8>,
    sampler: Sampler<Dual8>,
    /// The outputs that were sampled last.
    pub outputs: Vec<Dual8>,
}

impl<'m, const W: usize> SensitivityBlock<'m, W> {
    /// At the start, after slot 0 was visited; each of the `chunks` has initial derivatives.
    pub fn new(
        chunks: &'m [Mechanism<Dual8>],
        start: &[State<Dual8>],
        linearizer: &Linearizer,
        system: &System,
        values: &State<f64>,
    ) -> Self {
        let n = values.q.len();
        let mut sources = vec![[0.0; W]; linearizer.sources()];
        for (c, (chunk, state)) in chunks.iter().zip(start).enumerate() {
            let parameters = linearizer.parameters.iter().map(|&(part, local)| &chunk.parts[part].parameters[local]);
            let rest = state.a.iter().map(|_| &ZERO);
            for (source, x) in sources.iter_mut().zip(state.q.iter().chain(&state.v).chain(rest).chain(parameters)) {
                columns(source, c).copy_from_slice(&x.eps);
            }
        }
        let active = sources[3 * n..].iter().map(|slopes| slopes.iter().any(|x| *x != 0.0)).collect();
        let rows = vec![[0.0; W]; system.size()];
        Self {
            probes: chunks.iter().map(|chunk| Probe::new(chunk, values)).collect(),
            steps: Steps::new(values.t, &sources[..2 * n]),
            sources,
            active,
            velocity_rows: rows.clone(),
            rows,
            workspace: system.solve_workspace(),
            is_dense: false,
        }
    }

    /// Goes along with the first visit, or with the step from `t[0]` to `t[1]` that has just been accepted.
    pub fn follow(&mut self, plan: &SensitivityPlan, visits: &StageRecords, step: Option<[f64; 2]>) {
        let Some(t) = step else { return self.accelerate(plan, visits, 0) };
        self.is_dense = false;
        self.steps.advance(plan.method, t);
        let (end, n) = (plan.method.end, self.n());
        (1..end).for_each(|slot| self.evaluate(plan, visits, slot));
        self.steps.combine(&plan.weights[end], 0..n, &mut self.sources);
        self.project(plan, visits);
        self.steps.finish(&self.sources[..2 * n]);
        self.accelerate(plan, visits, end);
    }

    /// Outputs at `t`, where the values were visited: inside the step or at its end.
    pub fn sample(&mut self, plan: &SensitivityPlan, visits: &StageRecords, t: f64, dense: bool) {
        let n = self.n();
        if dense && !std::mem::replace(&mut self.is_dense, true) {
            (plan.method.end + 1..plan.method.slots()).for_each(|slot| self.evaluate(plan, visits, slot));
        }
        if dense {
            self.steps.interpolate(plan.method, t, &mut self.sources[..2 * n]);
        } else {
            self.steps.end(&mut self.sources[..2 * n]);
        }
        let values = &visits.tape().visits[SAMPLE].state;
        self.solve_accelerations(plan, visits, SAMPLE);
        for (c, probe) in self.probes.iter_mut().enumerate() {
            probe.fill(values, &self.sources, &self.rows, plan, c);
            probe.sampler.outputs(probe.mechanism, &probe.state, &mut probe.outputs);
        }
    }

    /// Number of coordinates.
    fn n(&self) -> usize {
        self.steps.accelerations.len()
    }

    fn evaluate(&mut self, plan: &SensitivityPlan, visits: &StageRecords, slot: usize) {
        self.steps.combine(&plan.weights[slot], plan.felt.iter().copied(), &mut self.sources);
        self.accelerate(plan, visits, slot);
    }

    fn accelerate(&mut self, plan: &SensitivityPlan, visits: &StageRecords, slot: usize) {
        self.solve_accelerations(plan, visits, slot);
        for (unknown, &slopes) in plan.unknowns.iter().zip(&self.rows) {
            if let Unknown::Coordinate(i) = *unknown {
                self.steps.accelerations[i][slot] = slopes;
            }
        }
    }

    fn solve_accelerations(&mut self, plan: &SensitivityPlan, visits: &StageRecords, slot: usize) {
        let visit = &visits.tape().visits[slot];
        self.place(plan, visit.state.t);
        self.rows.fill([0.0; W]);
        visits.entries[slot].subtract(&self.sources, &self.active, &mut self.rows);
        visit.factor.solve_in(&mut self.rows, &mut self.workspace);
    }

    /// Puts the derivatives of prescribed coordinates at the time `t` among the sources.
    fn place(&mut self, plan: &SensitivityPlan, t: f64) {
        let n = self.n();
        for (c, probe) in self.probes.iter().enumerate() {
            for &i in &plan.moving {
                let (motion, parameters) = probe.mechanism.coordinates[i].motion.as_ref().expect("it is prescribed");
                for (k, x) in Dual8::motion(motion.as_ref(), parameters, Dual8::constant(t)).iter().enumerate() {
                    columns(&mut self.sources[k * n + i], c).copy_from_slice(&x.eps);
                }
            }
        }
    }

    fn project(&mut self, plan: &SensitivityPlan, visits: &StageRecords) {
        let (n, projected) = (self.n(), &visits.tape().projected);
        if visits.is_free {
            return;
        }
        let [positions, num_constraints, corrections] = &visits.projections;
        self.place(plan, projected.before.t);
        let clear = |rows: &mut Vec<Block<W>>| rows.fill([0.0; W]);
        let subtract = |entries: &Entries, sources: &[Block<W>], active: &[bool], rows: &mut [Block<W>]| {
            entries.subtract(sources, active, rows);
        };
        clear(&mut self.velocity_rows);
        subtract(corrections, &self.sources, &self.active, &mut self.velocity_rows);
        clear(&mut self.rows);
        subtract(positions, &self.sources, &self.active, &mut self.rows);
        projected.factor.solve_in(&mut self.rows, &mut self.workspace);
        add_changes(plan, &self.rows, &mut self.sources[..n]);
        subtract(num_constraints, &self.sources, &self.active, &mut self.velocity_rows);
        projected.factor.solve_in(&mut self.velocity_rows, &mut self.workspace);
        add_changes(plan, &self.velocity_rows, &mut self.sources[n..2 * n]);
    }
}

/// Adds the solution of a projection to positions or velocities.
fn add_changes<const W: usize>(plan: &SensitivityPlan, rows: &[Block<W>], y: &mut [Block<W>]) {
    for (unknown, changes) in plan.unknowns.iter().zip(rows) {
        if let Unknown::Coordinate(i) = *unknown {
            y[i].iter_mut().zip(changes).for_each(|(y, change)| *y += change);
        }
    }
}

const ZERO: Dual8 = Dual8 { re: 0.0, eps: [0.0; WIDTH] };

/// The columns of the chunk `c` of a tile.
fn columns<const W: usize>(block: &mut Block<W>, c: usize) -> &mut [f64] {
    &mut block[c * WIDTH..(c + 1) * WIDTH]
}

impl<'m> Probe<'m> {
    fn new(mechanism: &'m Mechanism<Dual8>, values: &State<f64>) -> Self {
        let zeros = |x: &[f64]| vec![ZERO; x.len()];
        let [q, v, a, l] = [&values.q, &values.v, &values.a, &values.l].map(|x| zeros(x));
        let state = State { t: Dual8::constant(values.t), q, v, a, l };
        Self { mechanism, state, sampler: Sampler::new(mechanism), outputs: Vec::new() }
    }

    /// Takes over `values` with their derivatives: chunk `c` of `sources`, and of the solution `rows`.
    fn fill<const W: usize>(
        &mut self,
        values: &State<f64>,
        sources: &[Block<W>],
        rows: &[Block<W>],
        plan: &SensitivityPlan,
        c: usize,
    ) {
        let (n, state) = (values.q.len(), &mut self.state);
        let dual = |re: f64, block: &Block<W>| {
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
        for (unknown, slopes) in plan.unknowns.iter().zip(rows) {
            match *unknown {
                Unknown::Coordinate(i) => state.a[i] = dual(values.a[i], slopes),
                Unknown::Multiplier(m) => state.l[m] = dual(values.l[m], slopes),
            }
        }
    }
}
