//! Direct differentiation of a mechanism's motion by explicit steps.

use crate::Result;
use crate::analyses::dynamics::Work;
use crate::derivatives::activity::Dependence;
use crate::derivatives::forward::explicit::block::{SensitivityBlock, SensitivityPlan};
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::forward::explicit::nystrom::Nystrom;
use crate::derivatives::forward::explicit::step_records::StageRecords;
use crate::derivatives::forward::initial_conditions::StartSolver;
use crate::derivatives::history::{Record, SensitiveHistory};
use crate::derivatives::seeding::build_sensitive;
use crate::integrators::explicit::mechanism::{MechanismRhs, SAMPLE, Start, sample, start};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use crate::mechanism::scalars::Dual8;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::System;
use crate::system::state::State;
use autodiff::WIDTH;
use rayon::prelude::*;

/// Simulates `model` at the design `b` by explicit steps and differentiates its outputs at `times` with respect to `b`.
///
/// At every stage the accelerations solve K x = r with a factorized matrix. Their derivatives solve
///
/// $$ K \frac{dx}{db} = \frac{dr}{db} - \frac{dK}{db} x $$
///
/// with the same factorization; the right-hand side comes from derivatives of every element with respect to its own few
/// variables, which serve all design variables. The projections at the ends of steps are differentiated alike; initial positions and velocities may depend on the design.
/// Steps are frozen: the derivatives are those of the discrete solution. Same bits for any number of threads.
///
/// **Errors.** As [`simulate_explicitly`](crate::analyses::dynamics::simulate_explicitly), and
/// [`crate::Error::Definition`] if the model makes another mechanism in dual numbers than in `f64`.
pub fn differentiate_explicitly<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let chunks = build_sensitive(model, b, &mechanism)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let run = if chunks.len() > 1 { run::<{ 2 * WIDTH }> } else { run::<WIDTH> };
    let work = run(&mechanism, &chunks, settings, times, &mut record)?;
    Ok(record.finish(work))
}

/// Unknowns times design variables from which on threads pay.
const WORTH_THREADS: usize = 3200;

/// The whole motion, for `W` design variables at a time.
fn run<const W: usize>(
    mechanism: &Mechanism<f64>,
    chunks: &[Mechanism<Dual8>],
    settings: &Explicit,
    times: &[f64],
    record: &mut Record,
) -> Result<Work> {
    let (mut march, begin) = start(mechanism, settings, times, true)?;
    let mut team = Team::<W>::new(mechanism, chunks, &mut march, &begin)?;
    if team.parallel {
        rayon::scope(|_| team.go(&mut march, times, record))?; // once into the pool, not at every step
    } else {
        team.go(&mut march, times, record)?;
    }
    Ok(march.work())
}

/// All tiles of derivatives, and what they share.
struct Team<'m, const W: usize> {
    mechanism: &'m Mechanism<f64>,
    linearizer: Linearizer,
    plan: SensitivityPlan,
    tiles: Vec<SensitivityBlock<'m, W>>,
    visits: StageRecords,
    parallel: bool,
    dense: bool,
}

impl<'m, const W: usize> Team<'m, W> {
    /// Derivatives of the initial state.
    fn new(
        mechanism: &'m Mechanism<f64>,
        chunks: &'m [Mechanism<Dual8>],
        march: &mut OdeDriver<MechanismRhs<'m>>,
        begin: &Start,
    ) -> Result<Self> {
        let (method, system) = (march.stepper.method, &mut march.stepper.flow.system);
        let linearizer = Linearizer::new(mechanism, &Dependence::of(chunks, mechanism), system);
        let mut tiles = Vec::new();
        for chunks in chunks.chunks(W / WIDTH) {
            let starts = chunks.iter().map(|chunk| initial_derivatives(mechanism, chunk, system, begin));
            tiles.push(SensitivityBlock::new(
                chunks,
                &starts.collect::<Result<Vec<_>>>()?,
                &linearizer,
                system,
                &begin.state,
            ));
        }
        let plan = SensitivityPlan {
            method,
            weights: Nystrom::table(method),
            felt: linearizer.felt(),
            unknowns: system.unknowns().to_vec(),
            moving: linearizer.moving.clone(),
        };
        let parallel = system.size() * chunks.len() * WIDTH >= WORTH_THREADS;
        let visits = StageRecords::new(&linearizer, &begin.state);
        let mut team = Self { mechanism, linearizer, plan, tiles, visits, parallel, dense: false };
        team.with_tape(march, |team| {
            team.linearize(0..1);
            team.each(|tile, plan, visits| tile.follow(plan, visits, None));
        });
        Ok(team)
    }

    /// To the last of `times`.
    fn go(&mut self, march: &mut OdeDriver<MechanismRhs<'m>>, times: &[f64], record: &mut Record) -> Result<()> {
        let mut y = march.stepper.old.clone();
        for (k, &t) in times.iter().enumerate() {
            while march.is_before(t) {
                march.advance()?;
                self.follow(march);
            }
            let dense = sample(march, &mut y, t)?;
            record.values(k, self.mechanism, &march.stepper.flow.state)?;
            self.sample(march, t, dense);
            for (chunk, probe) in self.tiles.iter().flat_map(|tile| &tile.probes).enumerate() {
                record.slopes(k, chunk * WIDTH, probe.outputs.iter().map(|output| &output.eps[..]));
            }
        }
        Ok(())
    }

    /// Goes along with the step that was just accepted.
    fn follow(&mut self, march: &mut OdeDriver<MechanismRhs<'_>>) {
        let step = march.stepper.t;
        self.dense = false;
        self.with_tape(march, |team| {
            team.linearize(1..team.plan.method.end + 1);
            team.visits.linearize_projections(&team.linearizer, team.mechanism);
            team.each(|tile, plan, visits| tile.follow(plan, visits, Some(step)));
        });
    }

    /// Outputs at `t`, where the flow stands.
    fn sample(&mut self, march: &mut OdeDriver<MechanismRhs<'_>>, t: f64, dense: bool) {
        self.with_tape(march, |team| {
            if dense && !std::mem::replace(&mut team.dense, true) {
                team.linearize(team.plan.method.end + 1..team.plan.method.slots());
            }
            team.linearize(SAMPLE..SAMPLE + 1);
            team.each(|tile, plan, visits| tile.sample(plan, visits, t, dense));
        });
    }

    /// Borrows the tape of the flow meanwhile.
    fn with_tape(&mut self, march: &mut OdeDriver<MechanismRhs<'_>>, action: impl FnOnce(&mut Self)) {
        self.visits.tape = march.stepper.flow.tape.take();
        action(self);
        march.stepper.flow.tape = self.visits.tape.take();
    }

    fn each(&mut self, action: impl Fn(&mut SensitivityBlock<'m, W>, &SensitivityPlan, &StageRecords) + Sync) {
        let (plan, visits) = (&self.plan, &self.visits);
        if self.parallel {
            self.tiles.par_iter_mut().for_each(|tile| action(tile, plan, visits));
        } else {
            self.tiles.iter_mut().for_each(|tile| action(tile, plan, visits));
        }
    }

    fn linearize(&mut self, slots: std::ops::Range<usize>) {
        self.visits.linearize(&self.linearizer, self.mechanism, slots, self.parallel);
    }
}

/// Derivatives of the consistent initial positions and velocities.
fn initial_derivatives(
    plain: &Mechanism<f64>,
    chunk: &Mechanism<Dual8>,
    system: &mut System,
    begin: &Start,
) -> Result<State<Dual8>> {
    let mut state = State::built(chunk, begin.state.t);
    if plain.multipliers > 0 {
        let mut solver = StartSolver::new(plain, chunk, system);
        solver.positions(&begin.state, &begin.projection, &mut state)?;
        solver.velocities(&begin.state, &begin.projection, &mut state)?;
    }
    Ok(state)
}
