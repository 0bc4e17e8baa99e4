//! Warnings about load paths that jump from one equilibrium to a distant one, such as by snap-through.

use crate::analyses::statics::{Statics, follow_equilibria};
use crate::equilibrium::advance_equilibrium;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::coordinate_scales::CoordinateScales;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use error::two_times;

/// Ratio of the change of the positions between two times to those between the times before and after, above which it is examined.
const LARGE_CHANGE: f64 = 2.0;
/// Smallest change that is examined, in tolerances of the equilibria.
const SMALLEST_CHANGE: f64 = 1e3;
/// Number of times that the interval with the larger change is halved.
const BISECTIONS: usize = 20;
/// Part of the change that remains at a jump. At a limit point positions change with the square root of the time before they jump.
const REMAINING: f64 = 0.25;
/// Part of the unbalanced forces that remains where the loads themselves jump.
const REMAINING_LOAD: f64 = 0.01;

/// Warning about the largest jump of the equilibria of `mechanism` at `times` (s), each of which is computed from the previous one.
///
/// An interval with a large change is halved by further equilibria: at a jump the change does not become smaller. Where loads or
/// drives jump, the equilibria are meant to. `None` if there is no other jump, or if an equilibrium does not exist, which the analysis
/// says.
pub fn warn_of_equilibrium_jumps(mechanism: &Mechanism<f64>, settings: &Statics, times: &[f64]) -> Option<String> {
    let mut path: Vec<State<f64>> = vec![];
    let add = |state: &State<f64>| {
        path.push(state.clone());
        Ok(())
    };
    follow_equilibria(mechanism, settings, times, add).ok()?;
    let changes: Vec<f64> = path.windows(2).map(|ends| largest_change(&ends[0], &ends[1]).1).collect();
    let smallest = SMALLEST_CHANGE * settings.tolerance * CoordinateScales::at(mechanism, &path.first()?.q).length();
    let is_large = |k: &usize| {
        let neighbours = [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter_map(|i| changes.get(i));
        let larger = neighbours.fold(0.0f64, |a, change| a.max(*change));
        changes[*k] > smallest && changes[*k] > LARGE_CHANGE * larger
    };
    let mut system = System::at(mechanism, *times.first()?).ok()?;
    let jumps = (0..changes.len()).filter(is_large).filter_map(|k| {
        let ends = [path[k].clone(), path[k + 1].clone()];
        find_jump(&mut system, mechanism, settings, ends)
    });
    let jump = jumps.max_by(|a, b| a.change.total_cmp(&b.change))?;
    let [before, after] = two_times(jump.times);
    Some(format!(
        "{}: the equilibrium jumps between t = {before} and t = {after} by {:.3e} m or rad, as by snap-through: the equilibria before and after it are not \
         connected at increasing time, and derivatives hold on each side only; take kind = \"dynamics\" for the motion between them",
        mechanism.coordinates[jump.coordinate].name, jump.change
    ))
}

/// A jump of the equilibria.
struct EquilibriumJump {
    /// Times in s between which it happens.
    times: [f64; 2],
    /// Coordinate with the largest change.
    coordinate: usize,
    /// This change in m or rad.
    change: f64,
}

/// The jump between two equilibria, if there is one.
fn find_jump(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    settings: &Statics,
    [mut first, mut last]: [State<f64>; 2],
) -> Option<EquilibriumJump> {
    let enough = REMAINING * largest_change(&first, &last).1;
    let load = unbalanced(system, mechanism, &first, last.t);
    let mut is_connected = true;
    for _ in 0..BISECTIONS {
        let mut middle = first.clone();
        let t = 0.5 * (first.t + last.t);
        // Beyond a limit point, other equilibria may be too far away to be found.
        is_connected = advance_equilibrium(system, mechanism, &mut middle, t, settings).is_ok();
        if !is_connected {
            break;
        }
        if largest_change(&first, &middle).1 > largest_change(&middle, &last).1 {
            last = middle;
        } else {
            first = middle;
        }
        if largest_change(&first, &last).1 < enough {
            return None;
        }
    }
    if is_connected && unbalanced(system, mechanism, &first, last.t) > REMAINING_LOAD * load {
        return None;
    }
    let (coordinate, change) = largest_change(&first, &last);
    Some(EquilibriumJump { times: [first.t, last.t], coordinate, change })
}

/// The largest residual of the equilibrium `at` another time `t` (s), with the drives of that time.
fn unbalanced(system: &mut System, mechanism: &Mechanism<f64>, at: &State<f64>, t: f64) -> f64 {
    let mut state = at.clone();
    state.t = t;
    state.prescribe(mechanism);
    state.v.fill(0.0);
    state.a.fill(0.0);
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, &state, Linearization::statics(), &mut rows);
    rows.iter().map(|row| row[0].abs()).fold(0.0, f64::max)
}

/// The coordinate that changes most between two states, and its change in m or rad.
fn largest_change(first: &State<f64>, last: &State<f64>) -> (usize, f64) {
    let changes = first.q.iter().zip(&last.q).map(|(a, b)| (b - a).abs()).enumerate();
    changes.fold((0, 0.0), |largest, change| if change.1 > largest.1 { change } else { largest })
}
