//! Static equilibria over time.

use crate::analyses::element_warnings::StateWatch;
use crate::analyses::equilibrium_stability::StabilityWatch;
use crate::analyses::sampling::OutputRecorder;
use crate::analyses::tensioned_beams::TensionWatch;
use crate::assembly_failures::{conflicting_drives, has_drives};
use crate::constraint_rank::singular_instant;
use crate::equilibrium::advance_equilibrium;
use crate::events::impact;
use crate::initial_conditions::{Assembly, CONTRADICTION, LARGE_GAP, assemble, check_contradictions, largest_gap};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::coordinate_scales::CoordinateScales;
use crate::system::state::State;
use crate::{Error, Result};

pub use crate::initial_conditions::{Statics, find_equilibrium};

/// Static equilibria at `times` (s): one series per output.
///
/// Each equilibrium is computed from the previous one, with substeps where drives move far: the assembly stays on its branch. With loads that
/// are functions of time this follows a load path. Beyond a limit point
/// the next equilibrium may be a distant one:
/// [`warn_of_equilibrium_jumps`](super::equilibrium_jumps::warn_of_equilibrium_jumps).
///
/// # Errors
///
/// [`Error::Unsupported`] for a mechanism with impacts or switches;
/// [`Error::Analysis`] if it cannot be assembled or has no equilibrium at one of the times.
pub fn equilibria(mechanism: &Mechanism<f64>, settings: &Statics, times: &[f64]) -> Result<Vec<Vec<f64>>> {
    let mut recorder = OutputRecorder::new(mechanism, times.len());
    follow_equilibria(mechanism, settings, times, |state| recorder.record(mechanism, state))?;
    Ok(recorder.series)
}

/// The static equilibrium at each of the `times` (s), each one computed from the previous one.
///
/// # Errors
///
/// As [`equilibria`].
pub fn equilibrium_states(mechanism: &Mechanism<f64>, settings: &Statics, times: &[f64]) -> Result<Vec<State<f64>>> {
    let mut states = Vec::with_capacity(times.len());
    follow_equilibria(mechanism, settings, times, |state| {
        states.push(state.clone());
        Ok(())
    })?;
    Ok(states)
}

/// Warnings about the equilibria at `times` (s): unstable ones, beam elements under a normal force above which they are unstable, and elements
/// with a doubtful law, such as Euler angles without derivatives. Empty if the analysis fails, which the analysis says.
pub fn warn_of_equilibria(mechanism: &Mechanism<f64>, settings: &Statics, times: &[f64]) -> Vec<String> {
    let (mut tension, mut states) = (TensionWatch::new(mechanism), StateWatch::default());
    let mut stability = StabilityWatch::new(mechanism, times.len());
    let add = |state: &State<f64>| {
        stability.add(mechanism, state);
        tension.add(mechanism, state);
        states.add(mechanism, state);
        Ok(())
    };
    match follow_equilibria(mechanism, settings, times, add) {
        Ok(()) => {
            let of_parts = tension.warning(mechanism).into_iter().chain(states.warnings());
            stability.warning(mechanism).into_iter().chain(of_parts).collect()
        }
        Err(_) => vec![],
    }
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
    let gap = gap_of(&system, mechanism, &state);
    assemble(&mut system, mechanism, &mut state, Assembly::default())?;
    for (k, &t) in times.iter().enumerate() {
        let before = state.clone();
        advance_equilibrium(&mut system, mechanism, &mut state, t, settings).map_err(|error| {
            let error = check_reach(&system, mechanism, &before, t).err().unwrap_or(error);
            gap.as_ref().filter(|_| k == 0).map_or(error.clone(), |gap| from_a_gap(error, gap))
        })?;
        check_closed(&system, mechanism, &state)?;
        visit(&state)?;
    }
    Ok(())
}

/// Checks that an equilibrium with redundant constraints satisfies all of them.
///
/// # Errors
///
/// [`Error::Analysis`] naming drives of the same degree of freedom, or else the constraint with the largest error.
fn check_closed(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    if !system.allows_redundancy() {
        return Ok(());
    }
    let (mut system, mut rows) = (system.clone(), vec![[0.0]; system.size()]);
    let allowed = CONTRADICTION * CoordinateScales::at(mechanism, &state.q).length();
    if largest_gap(&mut system, mechanism, state, &mut rows) <= allowed {
        return Ok(());
    }
    conflicting_drives(mechanism, state).map_or(Ok(()), Err)?;
    check_contradictions(&system, mechanism, state.t, (rows.as_flattened(), "m or rad"), allowed)
}

/// Number of positions on the way to the next time at which a failed equilibrium is assembled.
const STEPS: usize = 16;

/// Independent part of the gradient of a constraint below which a position on the way is singular.
const SINGULAR: f64 = 1e-6;

/// Checks that the drives can move a mechanism from its positions at one time to the time `t` (s).
///
/// # Errors
///
/// That of the first time on the way at which the mechanism cannot be assembled, or is in a singular position: its drives lock.
fn check_reach(system: &System, mechanism: &Mechanism<f64>, from: &State<f64>, t: f64) -> Result<()> {
    if mechanism.multipliers == 0 || !has_drives(mechanism) {
        return Ok(());
    }
    let (mut system, mut state) = (system.clone(), from.clone());
    (1..=STEPS).try_for_each(|k| {
        state.t = if k == STEPS { t } else { from.t + (t - from.t) * k as f64 / STEPS as f64 };
        state.prescribe(mechanism);
        assemble(&mut system, mechanism, &mut state, Assembly::default())?;
        singular_instant(SINGULAR, &system, mechanism, &state).map_or(Ok(()), Err)
    })
}

/// The joint with the largest gap in the positions of the model, and the gap in m or rad, if the assembly moves parts far.
fn gap_of(system: &System, mechanism: &Mechanism<f64>, built: &State<f64>) -> Option<(String, f64)> {
    let mut at = built.clone();
    at.prescribe(mechanism);
    let mut rows = vec![[0.0]; system.size()];
    let mut system = system.clone();
    let gap = largest_gap(&mut system, mechanism, &at, &mut rows);
    (gap > LARGE_GAP).then(|| (system.dominant_residual(mechanism, &rows), gap))
}

/// The `error` of a missing equilibrium after an assembly that has closed this gap: it bends elastic parts next to the joint.
fn from_a_gap(error: Error, (joint, gap): &(String, f64)) -> Error {
    let Error::Analysis { why, .. } = error else { return error };
    let why = format!(
        "{why}; the built positions miss this joint by {gap:.3} m or rad, and the assembly bends the parts next to it"
    );
    Error::analysis(joint, why, "build the parts so that they fit this joint, or use fewer or shear-flexible elements")
}
