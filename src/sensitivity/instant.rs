//! Derivatives of analyses that need no history: kinematics with inverse dynamics, and statics.

use super::record::{Record, SensitiveHistory};
use super::seeded::{build_sensitive, set_values};
use super::start::StartSolver;
use crate::analysis::State;
use crate::analysis::dynamics::Work;
use crate::analysis::kinematics::Walk;
use crate::analysis::sampling::Sampler;
use crate::analysis::start::{Assembly, assemble};
use crate::analysis::statics::{Statics, balance};
use crate::analysis::system::{System, Unknown};
use crate::multibody::element::Room;
use crate::multibody::{Mechanism, Model, Sensitive};
use crate::scalar::WIDTH;
use crate::{Error, Result};

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
    let sensitive = build_sensitive(model, b, &mechanism)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let Some(&first) = times.first() else { return Ok(record.finish(Work::default())) };
    let mut walk = Walk::new(&mechanism, assembly, first)?;
    check_driven(&walk)?;
    for (k, &t) in times.iter().enumerate() {
        if t != walk.state.t {
            walk.go(t)?;
        }
        record.values(k, &mechanism, &walk.state)?;
        for (chunk, mechanism) in sensitive.iter().enumerate() {
            let mut state = State::built(mechanism, t);
            let mut solver = StartSolver::new(walk.mechanism, mechanism, &mut walk.system);
            solver.positions(&walk.state, &walk.projection, &mut state)?;
            solver.velocities(&walk.state, &walk.projection, &mut state)?;
            solver.accelerations(&walk.state, &mut state)?;
            let outputs = outputs(mechanism, &state);
            record.slopes(k, chunk * WIDTH, outputs.iter().map(|output| &output.eps[..]));
        }
    }
    Ok(record.finish(Work { steps: times.len(), ..Work::default() }))
}

/// **Errors.** [`Error::Definition`] unless every degree of freedom is driven.
pub(super) fn check_driven(walk: &Walk<'_>) -> Result<()> {
    let freedom = walk.system.size() as isize - 2 * walk.mechanism.multipliers as isize;
    if freedom == 0 {
        return Ok(());
    }
    let why = format!("{freedom} degrees of freedom are not driven");
    Err(Error::definition("kinematics", why, "drive them, or simulate the motion"))
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
    let sensitive = build_sensitive(model, b, &mechanism)?;
    let mut record = Record::new(&mechanism, b.len(), times);
    let mut system = System::at(&mechanism, times.first().copied().unwrap_or(0.0))?;
    let mut values = State::built(&mechanism, times.first().copied().unwrap_or(0.0));
    assemble(&mut system, &mechanism, &mut values, Assembly::default())?;
    for (k, &t) in times.iter().enumerate() {
        values.t = t;
        balance(&mut system, &mechanism, &mut values, settings)?;
        record.values(k, &mechanism, &values)?;
        for (chunk, mechanism) in sensitive.iter().enumerate() {
            let state = equilibrium(mechanism, &values, &mut system);
            let outputs = outputs(mechanism, &state);
            record.slopes(k, chunk * WIDTH, outputs.iter().map(|output| &output.eps[..]));
        }
    }
    Ok(record.finish(Work { steps: times.len(), ..Work::default() }))
}

/// Derivatives of the equilibrium `values`, with the factorization that found it.
pub(super) fn equilibrium(
    mechanism: &Mechanism<Sensitive>,
    values: &State<f64>,
    system: &mut System,
) -> State<Sensitive> {
    let mut state = State::built(mechanism, values.t);
    for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
        if coordinate.motion.is_none() {
            state.q[i] = Sensitive::constant(values.q[i]);
        }
    }
    set_values(&mut state.v, &values.v);
    set_values(&mut state.a, &values.a);
    set_values(&mut state.l, &values.l);
    let mut rows = vec![Sensitive::constant(0.0); system.size()];
    system.residual(mechanism, &state, 1.0, &mut Room::default(), &mut rows);
    let mut changes: Vec<[f64; WIDTH]> = rows.iter().map(|row| row.eps.map(|x| -x)).collect();
    system.factor().solve(&mut changes);
    for (unknown, change) in system.unknowns().iter().zip(&changes) {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i].eps = *change,
            Unknown::Multiplier(m) => state.l[m].eps = *change,
        }
    }
    state
}

fn outputs(mechanism: &Mechanism<Sensitive>, state: &State<Sensitive>) -> Vec<Sensitive> {
    let mut outputs = Vec::new();
    Sampler::new(mechanism).outputs(mechanism, state, &mut outputs);
    outputs
}
