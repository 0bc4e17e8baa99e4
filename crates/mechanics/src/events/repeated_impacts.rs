//! Impacts that follow each other at several contacts, infinitely many of them in a finite time.
//!
//! A box that lands on two corners hits the ground with one after the other. The times between the impacts and the velocities become smaller by a
//! constant factor, and both corners rest at a finite time.

use crate::Result;
use crate::events::impact::{BorderedSystem, gap_rounding};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

/// Part of the first velocities that is zero after the last impact.
const AT_REST: f64 = 1e-9;

/// Largest number of impacts that are followed.
const MOST_IMPACTS: usize = 10_000;

/// The contacts other than `contact` with which the impacts at it follow each other without end, until all of them rest.
///
/// * `state`: the one before the impact at `contact`, with the modes during the impact;
/// * `shortest`: time in s; contacts take part that close within it, or whose gap is a rounding error.
///
/// In the positions of `state`, an impact at the contact k changes the rates of the gaps by ġ_j − (1 + e_k) ġ_k G_jk / G_kk, where G = Φ_q M⁻¹ Φ_qᵀ
/// with the joints. The contact that approaches fastest, by ġ_k / √G_kk, is the next one. If the rates decrease to zero, they all end as those
/// of one impact in which the contacts remain closed: both changes are combinations of the same columns of G. If no contact
/// approaches any more after a number of impacts, these happen one by one, and the result is empty.
pub(crate) fn dying_out(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    (contact, shortest): (usize, f64),
    state: &State<f64>,
) -> Result<Vec<usize>> {
    let rate = |k: usize| mechanism.events[k].gap_jet(state, &state.v).v1;
    let is_near = |&k: &usize| {
        let event = &mechanism.events[k];
        let is_open = k != contact && event.unilateral.is_some() && event.is_open_contact(&state.modes);
        is_open && event.gap(state).abs() <= (shortest * rate(k).abs()).max(gap_rounding(event, state, 0.0))
    };
    let mut near: Vec<usize> = (0..mechanism.events.len()).filter(is_near).collect();
    if near.is_empty() {
        return Ok(near);
    }
    near.insert(0, contact);
    let impacts = near
        .iter()
        .map(|&k| BorderedSystem::new(system, mechanism, &mechanism.events[k], state))
        .collect::<Result<Vec<_>>>()?;
    let scale: Vec<f64> = impacts.iter().map(|impact| impact.compliance().sqrt()).collect();
    let coupling = |j: usize, k: usize| impacts[j].change_by(&impacts[k]) / (scale[j] * scale[k]);
    let coupling: Vec<Vec<f64>> = (0..near.len()).map(|j| (0..near.len()).map(|k| coupling(j, k)).collect()).collect();
    let restitution: Vec<f64> = near.iter().map(|&k| mechanism.events[k].restitution.unwrap_or(0.0)).collect();
    let mut rates: Vec<f64> = near.iter().zip(&scale).map(|(&k, scale)| rate(k) / scale).collect();
    let rest = AT_REST * rates.iter().fold(0.0f64, |a, rate| a.max(rate.abs()));
    let (mut next, mut takes_part) = (0, vec![false; near.len()]);
    for _ in 0..MOST_IMPACTS {
        takes_part[next] = true;
        let change = -(1.0 + restitution[next]) * rates[next];
        rates.iter_mut().enumerate().for_each(|(j, rate)| *rate += change * coupling[j][next]);
        let fastest = (0..near.len()).min_by(|&j, &k| rates[j].total_cmp(&rates[k])).unwrap_or(0);
        if rates[fastest] >= -rest {
            break;
        }
        next = fastest;
    }
    let rests = |j: &usize| takes_part[*j] && rates[*j].abs() <= rest;
    if !rests(&0) {
        return Ok(Vec::new());
    }
    Ok((1..near.len()).filter(rests).map(|j| near[j]).collect())
}
