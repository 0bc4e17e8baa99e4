//! Derivatives of analyses that need no history: kinematics with inverse dynamics, and statics.

use super::direct::Slopes;
use super::record::{Record, SensitiveHistory};
use super::seeded::{build_sensitive, set_values};
use super::start::StartSolver;
use crate::analysis::dynamics::Work;
use crate::analysis::kinematics::Walk;
use crate::analysis::sampling::Sampler;
use crate::analysis::start::{Assembly, assemble};
use crate::analysis::statics::{Statics, balance};
use crate::analysis::system::{Linearization, System, Unknown};
use crate::analysis::{State, blame, impact};
use crate::multibody::element::Room;
use crate::multibody::{Carrier, Jet, Mechanism, Model, Number, Real};
use crate::{Error, Result};
use autodiff::WIDTH;

/// Kinematics and inverse dynamics of `model` at `times` with derivatives of all outputs.
///
/// **Errors.** [`Error::Definition`] unless every degree of freedom is driven (then an instant depends on the design
/// alone and not on its predecessors); [`Error::Analysis`] where the mechanism cannot be assembled.
pub fn differentiate_kinematics<M: Model>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let carriers = build_sensitive::<M, WIDTH>(model, b, &mechanism)?;
    let chunks = follow_kinematics(&mechanism, &carriers, assembly, times, &mut record)?;
    Slopes { outputs: mechanism.outputs.len(), width: WIDTH, chunks }.enter(&mut record, times.len());
    Ok(record.finish(Work { steps: times.len(), ..Work::default() }))
}

/// **Errors.** [`Error::Definition`] unless every degree of freedom is driven.
pub(super) fn check_driven(walk: &Walk<'_>) -> Result<()> {
    match walk.system.size() as isize - 2 * walk.mechanism.multipliers as isize {
        0 => Ok(()),
        freedom => {
            let why = format!("{freedom} degrees of freedom are not driven");
            Err(Error::definition("kinematics", why, "drive them, or simulate the motion"))
        }
    }
}

/// Static equilibria of `model` at `times` (a load path) with derivatives of all outputs.
///
/// **Errors.** As [`crate::analysis::statics::equilibria`].
pub fn differentiate_equilibria<M: Model>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let carriers = build_sensitive::<M, WIDTH>(model, b, &mechanism)?;
    let chunks = follow_equilibria(&mechanism, &carriers, settings, times, &mut record)?;
    Slopes { outputs: mechanism.outputs.len(), width: WIDTH, chunks }.enter(&mut record, times.len());
    Ok(record.finish(Work { steps: times.len(), ..Work::default() }))
}

/// The driven motion of `mechanism`, its values to `record`. For each of the mechanisms that carry `L` derivatives those of
/// the outputs, by time, output and number.
pub(super) fn follow_kinematics<T: Carrier<L>, const L: usize>(
    mechanism: &Mechanism<f64>,
    carriers: &[Mechanism<T>],
    assembly: Assembly,
    times: &[f64],
    record: &mut Record,
) -> Result<Vec<Vec<f64>>>
where
    Jet<T>: Number,
{
    let mut chunks = vec![Vec::new(); carriers.len()];
    let Some(&first) = times.first() else { return Ok(chunks) };
    let mut walk = Walk::new(mechanism, assembly, first)?;
    check_driven(&walk)?;
    for (k, &t) in times.iter().enumerate() {
        if t != walk.state.t {
            walk.go(t)?;
        }
        record.values(k, mechanism, &walk.state)?;
        for (chunk, carrier) in chunks.iter_mut().zip(carriers) {
            let mut state = State::built(carrier, t);
            let mut solver = StartSolver::new(walk.mechanism, carrier, &mut walk.system);
            solver.positions(&walk.state, &walk.projection, &mut state)?;
            solver.velocities(&walk.state, &walk.projection, &mut state)?;
            solver.accelerations(&walk.state, &mut state)?;
            chunk.extend(outputs(carrier, &state).iter().flat_map(Carrier::derivatives));
        }
    }
    Ok(chunks)
}

/// The same for equilibria.
pub(super) fn follow_equilibria<T: Carrier<L>, const L: usize>(
    mechanism: &Mechanism<f64>,
    carriers: &[Mechanism<T>],
    settings: &Statics,
    times: &[f64],
    record: &mut Record,
) -> Result<Vec<Vec<f64>>> {
    let mut chunks = vec![Vec::new(); carriers.len()];
    impact::refuse(mechanism, "equilibria")?;
    let first = times.first().copied().unwrap_or(0.0);
    let (mut system, mut values) = (System::at(mechanism, first)?, State::built(mechanism, first));
    assemble(&mut system, mechanism, &mut values, Assembly::default())?;
    let mut rows = vec![[0.0]; system.size()];
    for (k, &t) in times.iter().enumerate() {
        values.t = t;
        balance(&mut system, mechanism, &mut values, settings)?;
        record.values(k, mechanism, &values)?;
        system.assemble(mechanism, &values, Linearization::statics(), &mut rows);
        blame::factorize(&mut system, mechanism, &values)?;
        for (chunk, carrier) in chunks.iter_mut().zip(carriers) {
            let state = equilibrium(carrier, &values, &mut system);
            chunk.extend(outputs(carrier, &state).iter().flat_map(Carrier::derivatives));
        }
    }
    Ok(chunks)
}

/// Derivatives of the equilibrium `values`, with the factorization there.
pub(super) fn equilibrium<T: Carrier<L>, const L: usize>(
    mechanism: &Mechanism<T>,
    values: &State<f64>,
    system: &mut System,
) -> State<T> {
    let mut state = State::built(mechanism, values.t);
    for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
        if coordinate.motion.is_none() {
            state.q[i] = T::from(values.q[i]);
        }
    }
    set_values(&mut state.v, &values.v);
    set_values(&mut state.a, &values.a);
    set_values(&mut state.l, &values.l);
    let mut rows = vec![T::from(0.0); system.size()];
    let mut room = Room::default();
    for _ in 0..T::ORDER {
        system.residual(mechanism, &state, 1.0, &mut room, &mut rows);
        let mut changes: Vec<[f64; L]> = rows.iter().map(|row| row.derivatives().map(|x| -x)).collect();
        system.factor().solve(&mut changes);
        for (unknown, change) in system.unknowns().iter().zip(&changes) {
            match *unknown {
                Unknown::Coordinate(i) => state.q[i] += T::with(0.0, *change),
                Unknown::Multiplier(m) => state.l[m] += T::with(0.0, *change),
            }
        }
    }
    state
}

fn outputs<T: Real>(mechanism: &Mechanism<T>, state: &State<T>) -> Vec<T> {
    let mut outputs = Vec::new();
    Sampler::new(mechanism).outputs(mechanism, state, &mut outputs);
    outputs
}
