//! One explicit step backwards: its stages, its projection, and the states inside it.

use crate::derivatives::activity::Dependence;
use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues, add};
use crate::derivatives::adjoint::batch::{AdjointBatch, ElementProducts};
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::forward::explicit::step_records::StageRecords;
use crate::integrators::explicit::mechanism::{SAMPLE, StepRecord};
use crate::integrators::explicit::tableau::DenseWeights;
use crate::integrators::explicit::tableau::Tableau;
use crate::mechanism::Mechanism;
use crate::system::Unknown;

/// What all responses share on their way back through a step.
pub(crate) struct Stages<'m> {
    pub mechanism: &'m Mechanism<f64>,
    pub dependence: &'m Dependence,
    pub method: &'static Tableau,
    pub linearizer: Linearizer,
    pub visits: StageRecords,
    pub unknowns: Vec<Unknown>,
    pub products: ElementProducts,
    /// By each variable of the entries.
    pub sources: Vec<BatchValues>,
    /// Length of the step in s.
    pub h: f64,
}

/// Up to [`BATCH`] responses on their way back through a step.
///
/// With k = f(Y) at the states Y = y₀ + h Σ a k of the stages and y₁ = P(Y_e), from the last stage to the first
///
/// $$ \bar Y_i = \left(\frac{\partial f}{\partial Y_i}\right)^{\!T}\bar k_i,\qquad
///    \bar k_j \mathrel{+}= h\,a_{ij}\bar Y_i,\qquad \bar y_0 \mathrel{+}= \bar Y_i $$
///
/// **Source.** Hager, *Numer. Math.* 87 (2000) 247–282; Sandu, *Lect. Notes Comput. Sci.* 3994 (2006) 550–557.
pub(crate) struct Way {
    pub batch: AdjointBatch,
    /// By the state at the end of the step, positions and then velocities.
    end: Vec<BatchValues>,
    /// By the state at its beginning.
    begin: Vec<BatchValues>,
    /// By the rates of each slot.
    rates: Vec<Vec<BatchValues>>,
}

impl Way {
    /// At the end of the motion.
    pub fn new(mechanism: &Mechanism<f64>, stages: &Stages<'_>) -> Self {
        let zeros = vec![[0.0; BATCH]; 2 * mechanism.coordinates.len()];
        Self {
            batch: AdjointBatch::new(mechanism, stages.unknowns.len()),
            rates: vec![zeros.clone(); stages.method.slots()],
            begin: zeros.clone(),
            end: zeros,
        }
    }

    /// Takes in the `wanted` outputs (with their weights) of the state that was visited for output: inside the step where
    /// dense output says, or at its end.
    pub fn sample<'w>(
        &mut self,
        stages: &mut Stages<'_>,
        wanted: impl Iterator<Item = (usize, &'w BatchValues)>,
        dense: Option<DenseWeights>,
    ) {
        self.batch.now.clear();
        let visits = stages.visits.tape();
        for (output, weight) in wanted {
            let state = &visits.visits[SAMPLE].state;
            self.batch.output(stages.mechanism, state, output, weight, &mut stages.products.probe);
        }
        self.visit_back(stages, SAMPLE);
        let Some(weights) = dense else { return self.batch.add_state(1.0, &mut self.end) };
        self.batch.add_state(1.0 - weights.change, &mut self.begin);
        self.batch.add_state(weights.change, &mut self.end);
        for (rates, weight) in self.rates.iter_mut().zip(weights.slots).filter(|(_, weight)| *weight != 0.0) {
            self.batch.add_state(stages.h * weight, rates);
        }
    }

    /// From the end of a step to its beginning; `dense` if states inside it were sampled.
    pub fn back(&mut self, stages: &mut Stages<'_>, dense: bool) {
        let (method, end) = (stages.method, stages.method.end);
        if dense {
            (end + 1..method.slots()).rev().for_each(|slot| self.stage_back(stages, slot));
        }
        self.rates_back(stages, end, end);
        self.batch.add_state(1.0, &mut self.end);
        self.project_back(stages);
        self.propagate_to_step_start(stages, end, &self.end.clone());
        (1..end).rev().for_each(|slot| self.stage_back(stages, slot));
        std::mem::swap(&mut self.begin, &mut self.end);
        self.begin.fill([0.0; BATCH]);
        self.rates.swap(0, end);
        self.rates.iter_mut().enumerate().filter(|(slot, _)| *slot != end).for_each(|(_, r)| r.fill([0.0; BATCH]));
    }

    /// At the start of the motion: what is left are derivatives by positions and velocities there.
    pub fn finish(&mut self, stages: &mut Stages<'_>) {
        self.rates_back(stages, stages.method.end, 0);
        self.batch.add_state(1.0, &mut self.end);
        self.batch.now.clear();
        let n = self.end.len() / 2;
        self.batch.now.q.copy_from_slice(&self.end[..n]);
        self.batch.now.v.copy_from_slice(&self.end[n..]);
    }

    fn stage_back(&mut self, stages: &mut Stages<'_>, slot: usize) {
        self.rates_back(stages, slot, slot);
        let Self { batch, begin, rates, .. } = self;
        batch.add_state(1.0, begin);
        for &(j, weight) in stages.method.stages[slot] {
            batch.add_state(stages.h * weight, &mut rates[j]);
        }
    }

    /// The derivatives `bars` by the state at which `slot` is evaluated, handed on to what it is combined from.
    fn propagate_to_step_start(&mut self, stages: &Stages<'_>, slot: usize, bars: &[BatchValues]) {
        let hand =
            |to: &mut [BatchValues], factor: f64| to.iter_mut().zip(bars).for_each(|(to, bar)| add(to, factor, bar));
        hand(&mut self.begin, 1.0);
        for &(j, weight) in stages.method.stages[slot] {
            hand(&mut self.rates[j], stages.h * weight);
        }
    }

    /// From the rates in a slot to the state that was visited for them, which the lane then has.
    fn rates_back(&mut self, stages: &mut Stages<'_>, rates: usize, visit: usize) {
        let (now, bars) = (&mut self.batch.now, &self.rates[rates]);
        let n = now.q.len();
        now.clear();
        for unknown in &stages.unknowns {
            if let Unknown::Coordinate(i) = *unknown {
                (now.v[i], now.a[i]) = (bars[i], bars[n + i]);
            }
        }
        self.visit_back(stages, visit);
    }

    /// From accelerations and multipliers to positions and velocities.
    fn visit_back(&mut self, stages: &mut Stages<'_>, slot: usize) {
        let Stages { visits, linearizer, sources, unknowns, .. } = stages;
        let visit = &mut tape(&mut visits.tape).visits[slot];
        self.batch.solve_accelerations(unknowns, &mut visit.factor);
        self.batch.vjp(&visits.entries[slot], linearizer, sources);
        self.batch.take_motions(stages.mechanism, stages.dependence, visit.state.t);
    }

    /// From the projected state to the one before.
    fn project_back(&mut self, stages: &mut Stages<'_>) {
        let Stages { visits, linearizer, sources, unknowns, .. } = stages;
        if visits.is_free {
            return;
        }
        let (batch, n) = (&mut self.batch, self.end.len() / 2);
        let projected = &mut tape(&mut visits.tape).projected;
        let [positions, num_constraints, corrections] = &visits.projections;
        batch.now.clear();
        batch.now.q.copy_from_slice(&self.end[..n]);
        batch.solve_free(unknowns, &mut projected.factor, &self.end[n..]);
        batch.vjp(num_constraints, linearizer, sources);
        let by_positions = batch.now.q.clone();
        batch.vjp(corrections, linearizer, sources);
        let velocities = std::mem::replace(&mut batch.now.v, vec![[0.0; BATCH]; n]);
        batch.solve_free(unknowns, &mut projected.factor, &by_positions);
        batch.vjp(positions, linearizer, sources);
        batch.now.v.iter_mut().zip(&velocities).for_each(|(to, bar)| add(to, 1.0, bar));
        batch.take_motions(stages.mechanism, stages.dependence, projected.before.t);
        let Self { batch, end, .. } = self;
        end[..n].fill([0.0; BATCH]);
        batch.add_state(1.0, end);
    }
}

fn tape(tape: &mut Option<StepRecord>) -> &mut StepRecord {
    tape.as_mut().expect("the tape is here while derivatives go back")
}

impl AdjointBatch {
    /// Adds `factor` times the derivatives by positions and velocities to those by a state or its rates.
    fn add_state(&self, factor: f64, to: &mut [BatchValues]) {
        self.now.q.iter().chain(&self.now.v).zip(to).for_each(|(bar, to)| add(to, factor, bar));
    }
}
