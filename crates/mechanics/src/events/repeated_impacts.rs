//! Impacts that follow each other at several contacts, infinitely many of them in a finite time.
//!
//! A box that lands on two corners hits the ground with one after the other. The times between the impacts and the velocities become smaller by a
//! constant factor, and both corners rest at a finite time.

use crate::Result;
use crate::events::complementarity::is_independent;
use crate::events::impact::{BorderedSystem, gap_rounding};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;
use nalgebra::{DMatrix, DVector};

/// Velocity, as a fraction of the velocities before the first impact, that counts as zero after the last one.
const AT_REST: f64 = 1e-9;

/// Largest number of impacts that are computed.
const MOST_IMPACTS: usize = 10_000;

/// The other contacts at which impacts alternate with those at `contact`, infinitely many in a finite time, until all
/// of them rest.
///
/// * `state`: the one before the impact at `contact`, with the modes during the impact;
/// * `shortest`: time in s; the contacts considered are those that close within it, or whose gap is a rounding error.
///
/// In the positions of `state`, an impact at the contact k changes the rates of the gaps by ġ_j − (1 + e_k) ġ_k G_jk /
/// G_kk, where G = Φ_q M⁻¹ Φ_qᵀ with the joints. The contact that approaches fastest, by ġ_k / √G_kk, is the next one.
/// If the rates decrease to zero, the result equals that of one impact after which the contacts remain closed: both
/// changes are combinations of the same columns of G. If no contact approaches any more after a number of impacts,
/// these happen one by one, and the result is empty. Contacts that rest only because others do stay open.
pub(crate) fn dying_out(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    (contact, shortest): (usize, f64),
    state: &State<f64>,
) -> Vec<usize> {
    let rate = |k: usize| mechanism.events[k].gap_jet(state, &state.v).v1;
    let is_near = |&k: &usize| {
        let event = &mechanism.events[k];
        let is_open = k != contact && event.unilateral.is_some() && event.is_open_contact(&state.modes);
        is_open && event.gap(state).abs() <= (shortest * rate(k).abs()).max(gap_rounding(event, state, 0.0))
    };
    let others: Vec<usize> = (0..mechanism.events.len()).filter(is_near).collect();
    if others.is_empty() {
        return others;
    }
    let near = [&[contact], &others[..]].concat();
    let mut at = |&k: &usize| BorderedSystem::new(system, mechanism, &mechanism.events[k], state);
    let Ok(impacts) = near.iter().map(&mut at).collect::<Result<Vec<_>>>() else { return Vec::new() };
    let scale: Vec<f64> = impacts.iter().map(|impact| impact.compliance().sqrt()).collect();
    let coupling = |j: usize, k: usize| impacts[j].change_by(&impacts[k]) / (scale[j] * scale[k]);
    let coupling = DMatrix::from_fn(near.len(), near.len(), coupling);
    let mut rates = DVector::from_fn(near.len(), |j, _| rate(near[j]) / scale[j]);
    let rest = AT_REST * rates.amax();
    let (mut next, mut takes_part) = (0, vec![false; near.len()]);
    for _ in 0..MOST_IMPACTS {
        takes_part[next] = true;
        let change = -(1.0 + mechanism.events[near[next]].restitution.unwrap_or(0.0)) * rates[next];
        rates += change * coupling.column(next);
        next = rates.imin();
        if rates[next] >= -rest {
            break;
        }
    }
    let rests = |j: usize| takes_part[j] && rates[j].abs() <= rest;
    let mut closed = vec![0];
    for j in (1..near.len()).filter(|&j| rests(0) && rests(j)) {
        if is_independent(&coupling, &closed, j) {
            closed.push(j);
        }
    }
    closed[1..].iter().map(|&j| near[j]).collect()
}
