//! Derivatives of analyses that need no history: kinematics with inverse dynamics, and statics.

use crate::analyses::dynamics::Work;
use crate::analyses::kinematics::KinematicDriver;
use crate::analyses::sampling::Sampler;
use crate::analyses::statics::{Statics, find_equilibrium};
use crate::derivatives::forward::dynamics::Slopes;
use crate::derivatives::forward::initial_conditions::StartSolver;
use crate::derivatives::history::{Record, SensitiveHistory};
use crate::derivatives::seeding::{build_sensitive, set_values};
use crate::diagnostics;
use crate::elements::element::ElementWorkspace;
use crate::events::impact;
use crate::initial_conditions::{Assembly, assemble};
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2, StateScalar};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use autodiff::WIDTH;

/// Kinematics and inverse dynamics of `model` at `times` with derivatives of all outputs.
///
/// **Errors.** [`Error::Definition`] unless every degree of freedom is driven (then an instant depends on the design
/// alone and not on its predecessors); [`Error::Analysis`] where the mechanism cannot be assembled.
pub fn differentiate_kinematics<M: ParametricMechanism>(
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
pub(crate) fn check_driven(walk: &KinematicDriver<'_>) -> Result<()> {
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
/// **Errors.** As [`crate::analyses::statics::equilibria`].
pub fn differentiate_equilibria<M: ParametricMechanism>(
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
pub(crate) fn follow_kinematics<T: DerivativeScalar<L>, const L: usize>(
    mechanism: &Mechanism<f64>,
    carriers: &[Mechanism<T>],
    assembly: Assembly,
    times: &[f64],
    record: &mut Record,
) -> Result<Vec<Vec<f64>>>
where
    Jet2<T>: ElementScalar,
{
    let mut chunks = vec![Vec::new(); carriers.len()];
    let Some(&first) = times.first() else { return Ok(chunks) };
    let mut walk = KinematicDriver::new(mechanism, assembly, first)?;
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
            chunk.extend(outputs(carrier, &state).iter().flat_map(DerivativeScalar::derivatives));
        }
    }
    Ok(chunks)
}

/// The same for equilibria.
pub(crate) fn follow_equilibria<T: DerivativeScalar<L>, const L: usize>(
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
        find_equilibrium(&mut system, mechanism, &mut values, settings)?;
        record.values(k, mechanism, &values)?;
        system.assemble(mechanism, &values, Linearization::statics(), &mut rows);
        diagnostics::factorize(&mut system, mechanism, &values)?;
        for (chunk, carrier) in chunks.iter_mut().zip(carriers) {
            let state = equilibrium(carrier, &values, &mut system);
            chunk.extend(outputs(carrier, &state).iter().flat_map(DerivativeScalar::derivatives));
        }
    }
    Ok(chunks)
}

/// Derivatives of the equilibrium `values`, with the factorization there.
pub(crate) fn equilibrium<T: DerivativeScalar<L>, const L: usize>(
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
    let mut workspace = ElementWorkspace::default();
    for _ in 0..T::ORDER {
        system.residual(mechanism, &state, 1.0, &mut workspace, &mut rows);
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

fn outputs<T: StateScalar>(mechanism: &Mechanism<T>, state: &State<T>) -> Vec<T> {
    let mut outputs = Vec::new();
    Sampler::new(mechanism).outputs(mechanism, state, &mut outputs);
    outputs
}
