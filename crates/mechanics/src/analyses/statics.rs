//! Static equilibrium.

use crate::analyses::sampling::Sampler;
use crate::diagnostics;
use crate::events::impact;
use crate::initial_conditions::{Assembly, assemble};
use crate::mechanism::Mechanism;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};

/// Settings of a static analysis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statics {
    /// Largest correction (m or rad) of the last iteration.
    pub tolerance: f64,
    /// Most iterations at one time.
    pub iterations: usize,
    /// Largest change of a position (m or rad) in one iteration.
    pub longest: f64,
}

impl Default for Statics {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations: 100, longest: 0.5 }
    }
}

/// Moves `state` to the static equilibrium at its time: balance with v = q̈ = 0, and Φ = 0.
///
/// The factor of the last iteration stays in `system`.
///
/// **Errors.** [`Error::Analysis`] naming what is out of balance.
pub fn find_equilibrium(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: &Statics,
) -> Result<()> {
    let mut rows = vec![[0.0]; system.size()];
    state.prescribe(mechanism);
    state.v.fill(0.0);
    state.a.fill(0.0);
    if mechanism.multipliers > 0 && state.l.iter().all(|l| *l == 0.0) {
        guess_reactions(system, mechanism, state, &mut rows)?;
    }
    for _ in 0..settings.iterations {
        system.assemble(mechanism, state, Linearization::statics(), &mut rows);
        diagnostics::factorize(system, mechanism, state)?;
        system.factor().solve(&mut rows);
        let moves = system.unknowns().iter().zip(&rows).filter(|(u, _)| matches!(u, Unknown::Coordinate(_)));
        let largest = moves.map(|(_, r)| r[0].abs()).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a });
        if !largest.is_finite() {
            break;
        }
        let part = if largest > settings.longest { settings.longest / largest } else { 1.0 };
        for (unknown, change) in system.unknowns().iter().zip(&rows) {
            match *unknown {
                Unknown::Coordinate(i) => state.q[i] -= part * change[0],
                Unknown::Multiplier(m) => state.l[m] -= change[0],
            }
        }
        if largest <= settings.tolerance {
            return Ok(());
        }
    }
    system.assemble(mechanism, state, Linearization::statics(), &mut rows);
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return Err(error);
    }
    let what = diagnostics::dominant_residual(system, mechanism, state, &rows);
    let why = format!("no static equilibrium found at t = {:.6e} s", state.t);
    Err(Error::analysis(what, why, "apply the load in more steps, or add stiffness to free motions"))
}

/// The reactions that come nearest to balance at the given positions.
///
/// A pendulum has no stiffness but that of its reactions: without a guess its equations would be singular.
fn guess_reactions(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    rows: &mut [[f64; 1]],
) -> Result<()> {
    let mut forces = vec![[0.0]; rows.len()];
    system.assemble(mechanism, state, Linearization::statics(), &mut forces);
    system.assemble(mechanism, state, Linearization::projection(), rows);
    diagnostics::factorize(system, mechanism, state)?;
    for ((row, force), unknown) in rows.iter_mut().zip(&forces).zip(system.unknowns()) {
        *row = if matches!(unknown, Unknown::Coordinate(_)) { *force } else { [0.0] };
    }
    system.factor().solve(rows);
    for (unknown, row) in system.unknowns().iter().zip(rows.iter()) {
        if let Unknown::Multiplier(m) = *unknown {
            state.l[m] = -row[0];
        }
    }
    Ok(())
}

/// Static equilibria at `times`, each started from the one before: a load path when loads are functions of time.
///
/// Returns one series per output.
pub fn equilibria(mechanism: &Mechanism<f64>, settings: &Statics, times: &[f64]) -> Result<Vec<Vec<f64>>> {
    impact::refuse(mechanism, "equilibria")?;
    let mut system = System::at(mechanism, times.first().copied().unwrap_or(0.0))?;
    let mut state = State::built(mechanism, times.first().copied().unwrap_or(0.0));
    assemble(&mut system, mechanism, &mut state, Assembly::default())?;
    let (mut sampler, mut outputs) = (Sampler::new(mechanism), Vec::new());
    let mut series = vec![Vec::with_capacity(times.len()); mechanism.outputs.len()];
    for &t in times {
        state.t = t;
        find_equilibrium(&mut system, mechanism, &mut state, settings)?;
        sampler.outputs(mechanism, &state, &mut outputs);
        diagnostics::check(mechanism, &state, &outputs)?;
        series.iter_mut().zip(&outputs).for_each(|(s, &value)| s.push(value));
    }
    Ok(series)
}
