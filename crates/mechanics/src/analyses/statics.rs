//! Static equilibria over time.

use crate::Result;
use crate::analyses::sampling::OutputRecorder;
use crate::events::impact;
use crate::initial_conditions::{Assembly, assemble};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

pub use crate::initial_conditions::{Statics, find_equilibrium};

/// Static equilibria at `times` (s): one series per output.
///
/// Each equilibrium is computed from the previous one. With loads that are functions of time this follows a load path.
///
/// # Errors
///
/// [`Error::Unsupported`](crate::Error::Unsupported) for a mechanism with impacts or switches;
/// [`Error::Analysis`](crate::Error::Analysis) if it cannot be assembled or has no equilibrium at one of the times.
pub fn equilibria(mechanism: &Mechanism<f64>, settings: &Statics, times: &[f64]) -> Result<Vec<Vec<f64>>> {
    let mut recorder = OutputRecorder::new(mechanism, times.len());
    follow_equilibria(mechanism, settings, times, |state| recorder.record(mechanism, state))?;
    Ok(recorder.series)
}

/// Calls `visit` with the equilibrium at each of the `times` (s), see [`equilibria`].
pub(crate) fn follow_equilibria(
    mechanism: &Mechanism<f64>,
    settings: &Statics,
    times: &[f64],
    mut visit: impl FnMut(&State<f64>) -> Result<()>,
) -> Result<()> {
    impact::refuse(mechanism, "equilibria")?;
    let mut system = System::at(mechanism, times.first().copied().unwrap_or(0.0))?;
    let mut state = State::built(mechanism, times.first().copied().unwrap_or(0.0));
    assemble(&mut system, mechanism, &mut state, Assembly::default())?;
    for &t in times {
        state.t = t;
        find_equilibrium(&mut system, mechanism, &mut state, settings)?;
        visit(&state)?;
    }
    Ok(())
}
