//! Direct differentiation of a dynamic analysis by explicit steps.

use super::record::{Record, SensitiveHistory};
use super::seeded::{build_sensitive, set_values};
use super::start::StartSolver;
use crate::Result;
use crate::analysis::State;
use crate::analysis::dynamics::{History, Work};
use crate::analysis::explicit::{Explicit, ExplicitRun, Follower, Stages};
use crate::analysis::sampling::Sampler;
use crate::analysis::start::{Projection, acceleration_rows};
use crate::analysis::system::{System, Unknown};
use crate::analysis::tableau::Tableau;
use crate::multibody::element::Room;
use crate::multibody::{Jet, Mechanism, Model, Sensitive};
use crate::scalar::WIDTH;

/// Simulates `model` at the design `b` by explicit steps and differentiates its outputs at `times`.
///
/// At every stage the accelerations solve a linear saddle-point problem; its matrix is factorized already, and its
/// derivative is one residual in dual numbers and one back-substitution. Step sizes are held: the derivatives are those
/// of the discrete solution.
///
/// **Errors.** As [`simulate_explicitly`].
pub fn differentiate_explicitly<M: Model>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let sensitive = build_sensitive(model, b, &mechanism)?;
    settings.check(times)?;
    let mut run = ExplicitRun::new(&mechanism, settings)?;
    let mut companions = Vec::with_capacity(sensitive.len());
    for chunk in &sensitive {
        companions.push(Companion::start(chunk, &mut run, settings)?);
    }
    let mut record = Record::new(&mechanism, b.len(), times);
    let mut at = run.new.clone();
    for (k, &t) in times.iter().enumerate() {
        while t - run.new.t > 1e-12 * (1.0 + t.abs()) {
            run.advance(&mut companions)?;
        }
        let inside = run.new.t - t > 1e-12 * (1.0 + t.abs());
        if inside {
            run.sample(t, &mut companions, &mut at)?;
        } else {
            at.copy_from(&run.new);
        }
        record.values(k, &mechanism, &at)?;
        for (chunk, companion) in companions.iter_mut().enumerate() {
            companion.sample(&at, inside.then_some(&mut run.system));
            record.slopes(k, chunk * WIDTH, &companion.outputs);
        }
    }
    Ok(record.finish(Work { steps: run.steps, failed_steps: 0, iterations: run.evaluations }))
}

/// Simulates `mechanism` by explicit steps and records its outputs at `times` (increasing, s).
///
/// **Errors.** [`crate::Error::Analysis`] if the mechanism cannot be assembled, its accelerations are not determined,
/// or the step shrinks to nothing.
pub fn simulate_explicitly(mechanism: &Mechanism<f64>, settings: &Explicit, times: &[f64]) -> Result<History> {
    settings.check(times)?;
    let mut run = ExplicitRun::new(mechanism, settings)?;
    let mut record = Record::new(mechanism, 0, times);
    let mut at = run.new.clone();
    for (k, &t) in times.iter().enumerate() {
        while t - run.new.t > 1e-12 * (1.0 + t.abs()) {
            run.advance(&mut [] as &mut [Companion<'_>])?;
        }
        if run.new.t - t > 1e-12 * (1.0 + t.abs()) {
            run.sample(t, &mut [] as &mut [Companion<'_>], &mut at)?;
        } else {
            at.copy_from(&run.new);
        }
        record.values(k, mechanism, &at)?;
    }
    let work = Work { steps: run.steps, failed_steps: 0, iterations: run.evaluations };
    let SensitiveHistory { names, times, values, .. } = record.finish(work);
    Ok(History { names, times, values, last: at, work })
}

/// One chunk of derivatives that goes along with explicit steps.
struct Companion<'m> {
    plain: &'m Mechanism<f64>,
    mechanism: &'m Mechanism<Sensitive>,
    tableau: Tableau,
    stages: Stages<Sensitive>,
    old: State<Sensitive>,
    new: State<Sensitive>,
    at: State<Sensitive>,
    /// Whether the step in `new` is finished and the next stage begins another one.
    finished: bool,
    rows: Vec<Sensitive>,
    changes: Vec<[f64; WIDTH]>,
    room: Room<Sensitive>,
    jets: Room<Jet<Sensitive>>,
    sampler: Sampler<Sensitive>,
    outputs: Vec<Sensitive>,
}

impl<'m> Companion<'m> {
    fn start(mechanism: &'m Mechanism<Sensitive>, run: &mut ExplicitRun<'m>, settings: &Explicit) -> Result<Self> {
        let mut state = State::built(mechanism, run.new.t);
        let values = run.new.clone();
        let mut solver = StartSolver::new(run.mechanism, mechanism, &mut run.system);
        if mechanism.multipliers > 0 {
            solver.positions(&values, &run.projection, &mut state)?;
            solver.velocities(&values, &run.projection, &mut state)?;
        }
        solver.accelerations(&values, &mut state)?;
        let (rows, changes) = solver.into_room();
        Ok(Self {
            plain: run.mechanism,
            mechanism,
            tableau: settings.tableau,
            stages: Stages::new(&settings.tableau, mechanism.coordinates.len()),
            old: state.clone(),
            new: state.clone(),
            at: state,
            finished: false,
            rows,
            changes,
            room: Room::default(),
            jets: Room::default(),
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
        })
    }

    /// Outputs at the instant `at` inside the step (then `system` has its factorization) or at its end.
    fn sample(&mut self, at: &State<f64>, system: Option<&mut System>) {
        match system {
            None => self.at.copy_from(&self.new),
            Some(system) => {
                let x = (at.t - self.old.t) / (self.new.t - self.old.t);
                let ends = [&self.old, &self.new];
                self.stages.between(self.mechanism, &self.tableau, x, ends, &mut self.at);
                self.accelerate(at, system);
            }
        }
        self.sampler.outputs(self.mechanism, &self.at, &mut self.outputs);
    }

    /// Derivatives of the accelerations and multipliers at `values`, whose factorization is in `system`.
    fn accelerate(&mut self, values: &State<f64>, system: &mut System) {
        self.at.take_values(values);
        for unknown in system.unknowns() {
            match *unknown {
                Unknown::Coordinate(i) => self.at.a[i].eps = [0.0; WIDTH],
                Unknown::Multiplier(m) => self.at.l[m].eps = [0.0; WIDTH],
            }
        }
        acceleration_rows(system, self.mechanism, &self.at, &mut self.room, &mut self.jets, &mut self.rows);
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.eps.map(|x| -x));
        system.factor().solve(&mut self.changes);
        for (unknown, change) in system.unknowns().iter().zip(&self.changes) {
            match *unknown {
                Unknown::Coordinate(i) => self.at.a[i].eps = *change,
                Unknown::Multiplier(m) => self.at.l[m].eps = *change,
            }
        }
    }
}

impl Follower for Companion<'_> {
    fn stage(&mut self, s: usize, h: f64, at: &State<f64>, system: &mut System) {
        if s == 0 && std::mem::take(&mut self.finished) {
            std::mem::swap(&mut self.old, &mut self.new);
        }
        self.stages.state(self.mechanism, &self.tableau, s, h, &self.old, &mut self.at);
        self.accelerate(at, system);
        self.stages.keep(s, &self.at);
    }

    fn accepted(
        &mut self,
        h: f64,
        end: &State<f64>,
        projection: Option<&Projection>,
        system: &mut System,
    ) -> Result<()> {
        self.stages.result(self.mechanism, &self.tableau, h, &self.old, &mut self.new);
        set_values(&mut self.new.a, &end.a);
        self.new.prescribe(self.mechanism);
        self.new.take_values(end);
        let mut solver = StartSolver::new(self.plain, self.mechanism, system);
        if let Some(projection) = projection {
            solver.positions(end, projection, &mut self.new)?;
            solver.velocities(end, projection, &mut self.new)?;
        }
        solver.accelerations(end, &mut self.new)?;
        self.finished = true;
        Ok(())
    }
}
