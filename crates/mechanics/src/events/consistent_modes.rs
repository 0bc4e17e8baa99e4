//! Modes of rigid contacts and dry friction by complementarity, for states in which the release of one part after the other finds none.

use crate::Result;
use crate::events::complementarity::{DRIVEN, PartState, solve};
use crate::events::sticking_friction::{EXCESS, hold, is_friction, sliding_gradients};
use crate::events::unilateral::{STATIC_LIMIT, sign, sliding};
use crate::initial_conditions::AccelerationSolver;
use crate::mechanism::{Mechanism, Unilateral};
use crate::system::System;
use crate::system::state::State;
use nalgebra::DMatrix;

/// Largest number of states that are tried one by one.
const MOST_STATES: usize = 1000;

/// Result of the search for consistent modes.
pub(crate) enum ModeSearch {
    /// The state with consistent modes, accelerations and multipliers.
    Found(Box<State<f64>>),
    /// Number of states that have been tried: none is consistent.
    Inconsistent(usize),
    /// The search has found no modes, without having tried all states.
    Unknown,
}

/// Parts at rest whose modes are determined together.
#[derive(Clone, Copy)]
pub(crate) struct RestingParts<'a> {
    /// Events of contacts that touch and of friction, in the order in which they are held.
    pub all: &'a [usize],
    /// Parts that have reached their limit, with the direction of their force. The force of such friction is the Coulomb force.
    pub broken: &'a [(usize, f64)],
}

impl RestingParts<'_> {
    fn is_broken(&self, part: usize) -> bool {
        self.broken.iter().any(|(other, _)| *other == part)
    }
}

/// Finds modes of the `parts` in `state` for which all forces are within their limits and all parts move as their forces allow.
///
/// With forces that do not depend on reactions, the accelerations follow from a [complementarity problem](solve), which has a solution.
/// The static limit applies to friction that is held; after reaching it, the force of friction is the Coulomb force. With friction that depends on
/// reactions, there may be several solutions or none (Painlevé's paradox): all states are tried in order.
pub(crate) fn find(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    parts: RestingParts<'_>,
) -> ModeSearch {
    if let Some(found) = by_complementarity(system, mechanism, state, parts) {
        return ModeSearch::Found(Box::new(found));
    }
    if mechanism.reaction_loads().next().is_some() {
        return one_by_one(system, mechanism, state, parts);
    }
    ModeSearch::Unknown
}

/// Solves for the modes, with loads that do not depend on the reactions.
fn by_complementarity(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    parts: RestingParts<'_>,
) -> Option<State<f64>> {
    let free = without_forces(system, mechanism, state, parts.all).ok()?;
    let (rank, gradients) = sliding_gradients(system, mechanism, &free);
    let is_free = |k: &&usize| !is_friction(mechanism, **k) || !rank.depends(gradients[**k].clone());
    let among: Vec<usize> = parts.all.iter().filter(is_free).copied().collect();
    let accelerations: Vec<f64> = among.iter().map(|&k| acceleration(mechanism, k, &free)).collect();
    let compliance = compliance(system, mechanism, &free, &among);
    let limit = |k: usize, is_held: bool| match mechanism.events[k].unilateral {
        Some(Unilateral::Friction { joint, .. }) => {
            let coulomb = mechanism.elements[joint].parameters[0];
            let limit = if is_held { mechanism.events[k].gap.parameters[STATIC_LIMIT] } else { coulomb };
            [-limit, limit]
        }
        _ => [0.0, f64::INFINITY],
    };
    let mut limits: Vec<[f64; 2]> = among.iter().map(|&k| limit(k, !parts.is_broken(k))).collect();
    loop {
        let found = solve(&accelerations, &compliance, &limits)?;
        let reduced: Vec<[f64; 2]> = (0..among.len())
            .map(|i| if matches!(found[i], PartState::AtLimit(_)) { limit(among[i], false) } else { limits[i] })
            .collect();
        if reduced != limits {
            limits = reduced;
            continue;
        }
        let side = |i: usize| if let PartState::AtLimit(side) = found[i] { Some(side) } else { None };
        // Parts that are held come first, because they also hold the parts without force.
        let mut choices: Vec<(usize, Option<f64>)> = Vec::new();
        for is_held in [true, false] {
            let of = (0..among.len()).filter(|&i| (found[i] == PartState::Held) == is_held);
            choices.extend(of.map(|i| (among[i], side(i))));
        }
        let others = parts.all.iter().filter(|k| !among.contains(k));
        choices.extend(others.map(|&k| (k, parts.broken.iter().find(|(other, _)| *other == k).map(|&(_, to)| to))));
        return with_modes(system, mechanism, state, (&choices, largest(&free)));
    }
}

/// The `state` in which the `parts` have no forces, with its accelerations and multipliers.
pub(super) fn without_forces(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    parts: &[usize],
) -> Result<State<f64>> {
    let mut free = state.clone();
    for law in parts.iter().filter_map(|&k| mechanism.events[k].unilateral) {
        law.open(&mut free.modes);
        law.rest(&mut free.modes, None);
    }
    AccelerationSolver::default().solve(system, mechanism, &mut free)?;
    Ok(free)
}

/// Lets friction that rests slide where drives accelerate it, in that direction. Returns these parts. Accelerations have the rounding errors of
/// numbers of a `size` (m/s² or rad/s²).
pub(super) fn slide_where_driven(mechanism: &Mechanism<f64>, size: f64, state: &mut State<f64>) -> Vec<(usize, f64)> {
    let is_driven = |k: &usize| {
        let event = &mechanism.events[*k];
        event.is_resting(&state.modes) && sliding(event, &state.a).abs() > DRIVEN * size
    };
    let driven = (0..mechanism.events.len()).filter(is_driven);
    let driven: Vec<_> = driven.map(|k| (k, sign(sliding(&mechanism.events[k], &state.a)))).collect();
    for &(k, direction) in &driven {
        mechanism.events[k].unilateral.iter().for_each(|law| law.slide(&mut state.modes, Some(direction)));
    }
    driven
}

/// Tries all states of the parts, of which there are at most [`MOST_STATES`].
fn one_by_one(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    parts: RestingParts<'_>,
) -> ModeSearch {
    let options: Vec<Vec<Option<f64>>> = parts
        .all
        .iter()
        .map(|&k| {
            let broken = parts.broken.iter().find(|(other, _)| *other == k).map(|&(_, to)| to);
            match (is_friction(mechanism, k), broken) {
                (true, Some(to)) => vec![Some(to), None, Some(-to)],
                (true, None) => vec![None, Some(1.0), Some(-1.0)],
                (false, Some(_)) => vec![Some(-1.0), None],
                (false, None) => vec![None, Some(-1.0)],
            }
        })
        .collect();
    let states = options.iter().try_fold(1usize, |states, of| states.checked_mul(of.len())).unwrap_or(usize::MAX);
    if states > MOST_STATES {
        return ModeSearch::Unknown;
    }
    let Ok(free) = without_forces(system, mechanism, state, parts.all) else { return ModeSearch::Unknown };
    for number in 0..states {
        let mut rest = number;
        let choices: Vec<(usize, Option<f64>)> = (parts.all.iter().zip(&options))
            .map(|(&k, of)| {
                let choice = of[rest % of.len()];
                rest /= of.len();
                (k, choice)
            })
            .collect();
        if let Some(found) = with_modes(system, mechanism, state, (&choices, largest(&free))) {
            return ModeSearch::Found(Box::new(found));
        }
    }
    ModeSearch::Inconsistent(states)
}

/// The state in which each part is held, or moves in the direction that is chosen for it, if this state is consistent. Accelerations have the rounding
/// errors of numbers of a `size` (m/s² or rad/s²).
fn with_modes(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    (choices, size): (&[(usize, Option<f64>)], f64),
) -> Option<State<f64>> {
    let mut found = state.clone();
    let released: Vec<(usize, f64)> = choices.iter().filter_map(|&(k, side)| Some((k, side?))).collect();
    let is_released = |k: usize| released.iter().any(|(other, _)| *other == k);
    for &(k, _) in choices {
        if let Some(Unilateral::Contact { closed, .. }) = mechanism.events[k].unilateral {
            found.modes.set(closed, !is_released(k));
        }
    }
    let at_rest: Vec<usize> = choices.iter().map(|&(k, _)| k).filter(|&k| is_friction(mechanism, k)).collect();
    hold(system, mechanism, &mut found, (&at_rest, &released));
    AccelerationSolver::default().solve(system, mechanism, &mut found).ok()?;
    let size = size.max(largest(&found));
    let driven = slide_where_driven(mechanism, size, &mut found);
    if !driven.is_empty() {
        AccelerationSolver::default().solve(system, mechanism, &mut found).ok()?;
    }
    let force = found.l.iter().fold(0.0f64, |a, l| a.max(l.abs()));
    let is_within = |&(k, _): &(usize, Option<f64>)| {
        let (event, modes) = (&mechanism.events[k], &found.modes);
        let law = event.unilateral.filter(|law| law.is_held(modes));
        law.is_none_or(|law| law.excess(event, &found, force) <= EXCESS)
    };
    let is_returning = |&part: &(usize, f64)| returns((mechanism, size), &found, part);
    let is_consistent = choices.iter().all(is_within) && !released.iter().chain(&driven).any(is_returning);
    is_consistent.then_some(found)
}

/// Largest acceleration in `state`.
pub(crate) fn largest(state: &State<f64>) -> f64 {
    state.a.iter().fold(0.0f64, |a, x| a.max(x.abs()))
}

/// Returns whether a part that is released moves against the direction of its release: friction, or a contact into its overlap. Accelerations have
/// the rounding errors of numbers of a `size` (m/s² or rad/s²).
pub(crate) fn returns(
    (mechanism, size): (&Mechanism<f64>, f64),
    state: &State<f64>,
    (part, direction): (usize, f64),
) -> bool {
    let event = &mechanism.events[part];
    let opening = match event.unilateral {
        Some(Unilateral::Contact { .. }) => event.gap_jet(state, &state.v).v2,
        Some(law) if law.is_resting(&state.modes) => 0.0,
        _ => direction * sliding(event, &state.a),
    };
    opening < -EXCESS * size
}

/// Acceleration that the force of a part opposes: that of sliding, or that with which a gap closes.
fn acceleration(mechanism: &Mechanism<f64>, part: usize, state: &State<f64>) -> f64 {
    let event = &mechanism.events[part];
    match event.unilateral {
        Some(Unilateral::Friction { .. }) => sliding(event, &state.a),
        _ => -event.gap_jet(state, &state.v).v2,
    }
}

/// Decrease of the accelerations of the parts `among` per unit force of each, for the matrix that is factorized in `system`.
fn compliance(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>, among: &[usize]) -> DMatrix<f64> {
    let directions: Vec<Vec<f64>> = among
        .iter()
        .map(|&k| {
            let mut rows = vec![0.0; system.size()];
            let event = &mechanism.events[k];
            match event.unilateral {
                Some(Unilateral::Friction { joint, .. }) => {
                    let [from, to, _] = mechanism.elements[joint].coordinates[..] else { return rows };
                    for (coordinate, side) in [(from, -1.0), (to, 1.0)] {
                        system.equation_of(coordinate).into_iter().for_each(|equation| rows[equation] += side);
                    }
                }
                _ => event.add_impulse(system, state, -1.0, &mut rows),
            }
            rows
        })
        .collect();
    let mut compliance = DMatrix::zeros(among.len(), among.len());
    for (j, direction) in directions.iter().enumerate() {
        let mut response: Vec<[f64; 1]> = direction.iter().map(|x| [*x]).collect();
        system.factor().solve(&mut response);
        for (i, other) in directions.iter().enumerate() {
            compliance[(i, j)] = other.iter().zip(&response).map(|(u, w)| u * w[0]).sum();
        }
    }
    0.5 * (&compliance + compliance.transpose())
}
