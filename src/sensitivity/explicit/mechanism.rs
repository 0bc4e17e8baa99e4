//! Direct differentiation of a mechanism's motion by explicit steps.

use super::Block;
use super::follower::{Follower, Linear};
use super::linearize::{Entry, Linearizer, Rooms};
use crate::Result;
use crate::analysis::explicit::mechanism::{MechanismFlow, SAMPLE, Tape, Visit};
use crate::analysis::explicit::simulation::{Start, sample, start};
use crate::analysis::explicit::{Explicit, March};
use crate::analysis::sampling::Sampler;
use crate::analysis::system::Unknown;
use crate::analysis::{State, System};
use crate::linalg::SolveRoom;
use crate::multibody::{Mechanism, Model, Real, Sensitive};
use crate::scalar::WIDTH;
use crate::sensitivity::record::{Record, SensitiveHistory};
use crate::sensitivity::seeded::build_sensitive;
use crate::sensitivity::start::StartSolver;
use rayon::prelude::*;

/// Simulates `model` at the design `b` by explicit steps and differentiates its outputs at `times` with respect to `b`.
///
/// At every stage the accelerations solve K x = r with a factorized matrix. Their derivatives solve
///
/// $$ K \frac{dx}{db} = \frac{dr}{db} - \frac{dK}{db} x $$
///
/// with the same factorization; the right-hand side comes from one evaluation of every element in dual numbers. The
/// projections at the ends of steps are differentiated alike; initial positions and velocities may depend on the design.
/// Steps are frozen: the derivatives are those of the discrete solution. Same bits for any number of threads.
///
/// **Errors.** As [`simulate_explicitly`](crate::analysis::explicit::simulate_explicitly), and
/// [`crate::Error::Definition`] if the model makes another mechanism in dual numbers than in `f64`.
pub fn differentiate_explicitly<M: Model>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let chunks = build_sensitive(model, b, &mechanism)?;
    let (mut march, begin) = start(&mechanism, settings, times, true)?;
    let mut team = Team::new(&mechanism, &chunks, &mut march, &begin)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let mut y = march.stepper.old.clone();
    for (k, &t) in times.iter().enumerate() {
        while march.lags(t) {
            march.advance()?;
            team.follow(&mut march);
        }
        let dense = sample(&mut march, &mut y, t)?;
        record.values(k, &mechanism, &march.stepper.flow.state)?;
        team.sample(&mut march, t, dense);
        for (chunk, follower) in team.followers.iter().enumerate() {
            record.slopes(k, chunk * WIDTH, follower.linear.outputs.iter().map(|output| &output.eps[..]));
        }
    }
    Ok(record.finish(march.work()))
}

/// Unknowns times chunks from which on threads pay.
const WORTH_THREADS: usize = 400;

/// All chunks of derivatives, and what they share.
struct Team<'m> {
    mechanism: &'m Mechanism<f64>,
    linearizer: Linearizer,
    followers: Vec<Follower<LinearMechanism<'m>>>,
    visits: Visits,
    rooms: Vec<Rooms>,
    parallel: bool,
    dense: bool,
}

/// What a step leaves behind for its derivatives.
struct Visits {
    tape: Option<Tape>,
    /// Derivatives of the rows at each visit.
    entries: Vec<Vec<Entry>>,
    projections: [Vec<Entry>; 3],
    /// Positions before the projection with the correction of velocities.
    corrections: State<f64>,
}

impl Visits {
    fn tape(&self) -> &Tape {
        self.tape.as_ref().expect("the tape is here while derivatives follow")
    }
}

impl<'m> Team<'m> {
    /// Derivatives of the initial state.
    fn new(
        mechanism: &'m Mechanism<f64>,
        chunks: &'m [Mechanism<Sensitive>],
        march: &mut March<MechanismFlow<'m>>,
        begin: &Start,
    ) -> Result<Self> {
        let flow = &mut march.stepper.flow;
        let linearizer = Linearizer::new(mechanism, chunks, &flow.system);
        let visits = Visits {
            tape: flow.tape.take(),
            entries: vec![Vec::new(); SAMPLE + 1],
            projections: Default::default(),
            corrections: begin.state.clone(),
        };
        let parallel = flow.system.size() * chunks.len() >= WORTH_THREADS;
        let rooms = vec![Rooms::default(); SAMPLE + 2];
        let followers = Vec::with_capacity(chunks.len());
        let mut team = Self { mechanism, linearizer, followers, visits, rooms, parallel, dense: false };
        team.linearize(0..1);
        for chunk in chunks {
            let y = initial_derivatives(mechanism, chunk, &mut march.stepper.flow.system, begin)?;
            let linear = LinearMechanism::new(chunk, &team.linearizer, &march.stepper.flow.system, &begin.state);
            let t = march.stepper.t[0];
            team.followers.push(Follower::new(linear, march.stepper.method, y, t, &team.visits));
        }
        march.stepper.flow.tape = team.visits.tape.take();
        Ok(team)
    }

    /// Goes along with the step that was just accepted.
    fn follow(&mut self, march: &mut March<MechanismFlow<'_>>) {
        self.visits.tape = march.stepper.flow.tape.take();
        self.dense = false;
        self.linearize(1..march.stepper.method.end + 1);
        if self.mechanism.multipliers > 0 {
            self.linearize_projections();
        }
        let span = march.stepper.t;
        self.each(|follower, visits| follower.follow(visits, span));
        march.stepper.flow.tape = self.visits.tape.take();
    }

    /// Outputs at `t`, where the flow stands.
    fn sample(&mut self, march: &mut March<MechanismFlow<'_>>, t: f64, dense: bool) {
        self.visits.tape = march.stepper.flow.tape.take();
        if dense && !std::mem::replace(&mut self.dense, true) {
            self.linearize(march.stepper.method.end + 1..march.stepper.method.slots());
        }
        self.linearize(SAMPLE..SAMPLE + 1);
        self.each(|follower, visits| {
            if dense {
                follower.make_dense(visits);
            }
            let mut y = std::mem::take(&mut follower.linear.at);
            if dense {
                follower.interpolate(t, &mut y);
            } else {
                y.copy_from_slice(follower.end());
            }
            follower.linear.sample(visits, &mut y);
            follower.linear.at = y;
        });
        march.stepper.flow.tape = self.visits.tape.take();
    }

    fn each(&mut self, action: impl Fn(&mut Follower<LinearMechanism<'m>>, &Visits) + Sync) {
        let visits = &self.visits;
        if self.parallel {
            self.followers.par_iter_mut().for_each(|follower| action(follower, visits));
        } else {
            self.followers.iter_mut().for_each(|follower| action(follower, visits));
        }
    }

    fn linearize(&mut self, slots: std::ops::Range<usize>) {
        let Self { mechanism, linearizer, visits, rooms, .. } = self;
        let (tape, entries) = (visits.tape.as_ref().expect("the tape is here"), &mut visits.entries[slots.clone()]);
        let tasks = (entries, &tape.visits[slots.clone()], &mut rooms[slots]);
        let task = |(entries, visit, rooms): (&mut Vec<Entry>, &Visit, &mut Rooms)| {
            linearizer.accelerations(mechanism, &visit.state, rooms, entries);
        };
        if self.parallel {
            tasks.into_par_iter().for_each(task);
        } else {
            tasks.0.iter_mut().zip(tasks.1).zip(tasks.2).for_each(|((e, v), r)| task((e, v, r)));
        }
    }

    fn linearize_projections(&mut self) {
        let Self { mechanism, linearizer, visits, rooms, .. } = self;
        let projected = &visits.tape.as_ref().expect("the tape is here").projected;
        let corrections = &mut visits.corrections;
        corrections.copy_from(&projected.before);
        corrections.a.copy_from_slice(&projected.after.a);
        corrections.l.copy_from_slice(&projected.after.l);
        linearizer.projections(mechanism, projected, corrections, &mut rooms[SAMPLE + 1], &mut visits.projections);
    }
}

/// Derivatives of the consistent initial positions and velocities.
fn initial_derivatives(
    plain: &Mechanism<f64>,
    chunk: &Mechanism<Sensitive>,
    system: &mut System,
    begin: &Start,
) -> Result<Vec<Block>> {
    let mut state = State::built(chunk, begin.state.t);
    if plain.multipliers > 0 {
        let mut solver = StartSolver::new(plain, chunk, system);
        solver.positions(&begin.state, &begin.projection, &mut state)?;
        solver.velocities(&begin.state, &begin.projection, &mut state)?;
    }
    Ok(state.q.iter().chain(&state.v).map(|x| x.eps).collect())
}

/// Accelerations and projections of a mechanism, differentiated for one chunk of design variables.
struct LinearMechanism<'m> {
    mechanism: &'m Mechanism<Sensitive>,
    unknowns: Vec<Unknown>,
    moving: Vec<usize>,
    /// Derivatives of the sources after positions and velocities: accelerations of prescribed coordinates, parameters.
    sources: Vec<Block>,
    /// Which parameters change with this chunk's design variables.
    active: Vec<bool>,
    rows: Vec<Block>,
    velocity_rows: Vec<Block>,
    room: SolveRoom,
    state: State<Sensitive>,
    sampler: Sampler<Sensitive>,
    outputs: Vec<Sensitive>,
    at: Vec<Block>,
}

impl<'m> LinearMechanism<'m> {
    fn new(mechanism: &'m Mechanism<Sensitive>, linearizer: &Linearizer, system: &System, state: &State<f64>) -> Self {
        let n = mechanism.coordinates.len();
        let zero = [0.0; WIDTH];
        let mut sources = vec![zero; linearizer.sources() - 2 * n];
        for (source, &(part, local)) in sources[n..].iter_mut().zip(&linearizer.parameters) {
            *source = mechanism.parts[part].parameters[local].eps;
        }
        let active = sources[n..].iter().map(|slopes| slopes.iter().any(|x| *x != 0.0)).collect();
        Self {
            mechanism,
            unknowns: system.unknowns().to_vec(),
            moving: linearizer.moving.clone(),
            sources,
            active,
            rows: vec![zero; system.size()],
            velocity_rows: vec![zero; system.size()],
            room: system.solve_room(),
            state: State::built(mechanism, state.t),
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
            at: vec![zero; 2 * n],
        }
    }

    /// Takes over the derivatives of the state, and those of prescribed coordinates at time `t`.
    fn place(&mut self, t: f64, y: &mut [Block]) {
        let n = self.mechanism.coordinates.len();
        for &i in &self.moving {
            let (motion, parameters) = self.mechanism.coordinates[i].motion.as_ref().expect("it is prescribed");
            let [position, velocity, acceleration] = Sensitive::motion(motion.as_ref(), parameters, t);
            (y[i], y[n + i], self.sources[i]) = (position.eps, velocity.eps, acceleration.eps);
        }
    }

    /// rows −= entries · sources, where `y` has the derivatives of positions and velocities.
    fn subtract(&mut self, entries: &[Entry], y: &[Block]) {
        let (others, parameters) = (y.len(), y.len() + y.len() / 2);
        for entry in entries {
            let source = entry.source as usize;
            if source >= parameters && !self.active[source - parameters] {
                continue;
            }
            let source = if source < others { &y[source] } else { &self.sources[source - others] };
            let row = &mut self.rows[entry.row as usize];
            row.iter_mut().zip(source).for_each(|(row, source)| *row -= entry.value * source);
        }
    }

    fn solve_accelerations(&mut self, visits: &Visits, slot: usize, y: &mut [Block]) {
        let visit = &visits.tape().visits[slot];
        self.place(visit.state.t, y);
        self.rows.fill([0.0; WIDTH]);
        self.subtract(&visits.entries[slot], y);
        visit.factor.solve_in(&mut self.rows, &mut self.room);
    }

    /// Outputs with their derivatives at the state that was visited for output.
    fn sample(&mut self, visits: &Visits, y: &mut [Block]) {
        self.solve_accelerations(visits, SAMPLE, y);
        let (values, n) = (&visits.tape().visits[SAMPLE].state, self.mechanism.coordinates.len());
        self.state.t = values.t;
        let dual = |re: f64, eps: Block| Sensitive { re, eps };
        for i in 0..n {
            self.state.q[i] = dual(values.q[i], y[i]);
            self.state.v[i] = dual(values.v[i], y[n + i]);
            self.state.a[i] = dual(values.a[i], self.sources[i]);
        }
        for (unknown, &eps) in self.unknowns.iter().zip(&self.rows) {
            match *unknown {
                Unknown::Coordinate(i) => self.state.a[i].eps = eps,
                Unknown::Multiplier(m) => self.state.l[m] = dual(values.l[m], eps),
            }
        }
        self.sampler.outputs(self.mechanism, &self.state, &mut self.outputs);
    }

    /// Adds the solution of a projection to positions (`first` 0) or velocities (`first` n).
    fn add_changes(&self, first: usize, y: &mut [Block]) {
        for (unknown, change) in self.unknowns.iter().zip(&self.rows) {
            if let Unknown::Coordinate(i) = *unknown {
                y[first + i].iter_mut().zip(change).for_each(|(y, change)| *y += change);
            }
        }
    }
}

impl Linear for LinearMechanism<'_> {
    type Tape = Visits;

    fn rates(&mut self, visits: &Visits, slot: usize, y: &mut [Block], k: &mut [Block]) {
        self.solve_accelerations(visits, slot, y);
        let n = self.mechanism.coordinates.len();
        for (unknown, &eps) in self.unknowns.iter().zip(&self.rows) {
            if let Unknown::Coordinate(i) = *unknown {
                (k[i], k[n + i]) = (y[n + i], eps);
            }
        }
    }

    fn project(&mut self, visits: &Visits, y: &mut [Block]) {
        if self.mechanism.multipliers == 0 {
            return;
        }
        let (n, projected) = (self.mechanism.coordinates.len(), &visits.tape().projected);
        let [positions, closures, corrections] = &visits.projections;
        self.place(projected.before.t, y);
        self.rows.fill([0.0; WIDTH]);
        self.subtract(corrections, y);
        std::mem::swap(&mut self.rows, &mut self.velocity_rows);
        self.rows.fill([0.0; WIDTH]);
        self.subtract(positions, y);
        projected.factor.solve_in(&mut self.rows, &mut self.room);
        self.add_changes(0, y);
        std::mem::swap(&mut self.rows, &mut self.velocity_rows);
        self.subtract(closures, y);
        projected.factor.solve_in(&mut self.rows, &mut self.room);
        self.add_changes(n, y);
    }
}
