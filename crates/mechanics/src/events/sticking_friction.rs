//! Dry friction at rest: what is held by a constraint, and what rests because others hold it.

use crate::constraint_rank::ConstraintRank;
use crate::mechanism::{EventElement, Mechanism, Unilateral};
use crate::system::System;
use crate::system::state::State;

/// Largest relative excess of a force over its limit that counts as rounding.
pub(super) const EXCESS: f64 = 1e-9;

/// Sets the modes of friction `at_rest` to sticking if its constraint is independent of those before it, and to resting otherwise.
/// Friction that is `released` slides, or rests with its Coulomb force.
pub(super) fn hold(
    system: &System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    (at_rest, released): (&[usize], &[(usize, f64)]),
) {
    if at_rest.is_empty() && !released.iter().any(|(k, _)| is_friction(mechanism, *k)) {
        return;
    }
    let (mut rank, gradients) = sliding_gradients(system, mechanism, state);
    let is_released = |k: &usize| released.iter().any(|(other, _)| other == k);
    for &k in at_rest.iter().filter(|k| !is_released(k)) {
        let is_independent = rank.add(k, gradients[k].clone());
        mechanism.events[k].unilateral.iter().for_each(|law| match is_independent {
            true => law.slide(&mut state.modes, None),
            false => law.rest(&mut state.modes, None),
        });
    }
    for &(k, direction) in released.iter().filter(|(k, _)| is_friction(mechanism, *k)) {
        let is_held = rank.depends(gradients[k].clone());
        mechanism.events[k].unilateral.iter().for_each(|law| match is_held {
            true => law.rest(&mut state.modes, Some(direction)),
            false => law.slide(&mut state.modes, Some(direction)),
        });
    }
}

/// Returns whether the event belongs to dry friction.
pub(super) fn is_friction(mechanism: &Mechanism<f64>, event: usize) -> bool {
    matches!(mechanism.events[event].unilateral, Some(Unilateral::Friction { .. }))
}

/// The rank of the joints, drives and closed contacts, and for each event the gradient of the sliding velocity of its friction.
///
/// The coordinate that stores the position of friction is constant while it sticks: its entry in the gradient is zero.
pub(super) fn sliding_gradients(
    system: &System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
) -> (ConstraintRank, Vec<Vec<f64>>) {
    let mut rows = system.constraint_jacobian(mechanism, state);
    let mut gradient = |event: &EventElement<f64>| match event.unilateral {
        Some(Unilateral::Friction { joint, multiplier, .. }) => {
            let mut row = std::mem::take(&mut rows[multiplier]);
            row[mechanism.elements[joint].coordinates[2]] = 0.0;
            row
        }
        _ => Vec::new(),
    };
    let gradients = mechanism.events.iter().map(&mut gradient).collect();
    let mut rank = ConstraintRank::none();
    for (m, row) in rows.into_iter().enumerate().filter(|(_, row)| !row.is_empty()) {
        rank.add(m, row);
    }
    (rank, gradients)
}
