//! Reasons why a mechanism cannot be assembled that concern its drives: two for one degree of freedom, and positions beyond its reach.

use crate::Error;
use crate::constraint_rank::ConstraintRank;
use crate::mechanism::element::Family;
use crate::mechanism::{CoordinateData, ElementInstance, Mechanism};
use crate::system::assembly::constraint_gradients;
use crate::system::state::State;
use error::{Readable, Seconds};

/// Distance (m or rad) of the position next to another one in which drives must be dependent, too.
const NEARBY: f64 = 0.02;

/// The error of drives that prescribe the same degree of freedom; `None` if all drives are independent, in `state` or in a position next to it.
pub(crate) fn conflicting_drives(mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Error> {
    let drives = drives(mechanism);
    if drives.len() < 2 {
        return None;
    }
    let first = conflict(&drives, mechanism, state)?;
    // In a singular position, drives depend on each other that are independent elsewhere.
    let mut nearby = state.clone();
    nearby.q.iter_mut().enumerate().for_each(|(i, q)| *q += NEARBY * (1.0 + 2.3 * i as f64).sin());
    conflict(&drives, mechanism, &nearby)?;
    let names: Vec<&str> = first.iter().map(|drive| drive.name.as_str()).collect();
    let (last, others) = names.split_last().filter(|(_, others)| !others.is_empty())?;
    let why = format!(
        "the drives of {} and {last} prescribe the same degree of freedom, and the mechanism cannot be assembled at t = {}",
        others.join(", "),
        Seconds(state.t)
    );
    Some(Error::analysis(names[0], why, "remove one of these drives, or a joint that connects what they move"))
}

/// Returns whether a drive moves the mechanism.
pub(crate) fn has_drives(mechanism: &Mechanism<f64>) -> bool {
    !drives(mechanism).is_empty()
}

/// A drive: a coordinate that is a function of time, or an element with this constraint.
struct Drive {
    name: String,
    place: DrivePlace,
}

enum DrivePlace {
    Coordinate(usize),
    Multiplier(usize),
}

fn is_driven(coordinate: &CoordinateData<f64>) -> bool {
    coordinate.motion.as_ref().is_some_and(|(motion, _)| !motion.is_fixed())
}

fn drives(mechanism: &Mechanism<f64>) -> Vec<Drive> {
    let driven = mechanism.coordinates.iter().enumerate().filter(|(_, coordinate)| is_driven(coordinate));
    let coordinates = driven.map(|(i, c)| Drive { name: c.name.to_string(), place: DrivePlace::Coordinate(i) });
    let elements = mechanism.elements.iter().filter(|instance| {
        let is_drive = instance.element.descriptor().is_some_and(|descriptor| descriptor.family == Family::Drive);
        is_drive && instance.num_constraints == 1
    });
    let of_element = |instance: &ElementInstance<f64>| Drive {
        name: instance.name.to_string(),
        place: DrivePlace::Multiplier(instance.first_multiplier),
    };
    coordinates.chain(elements.map(of_element)).collect()
}

/// The first drive that depends on the joints and the drives before it, after those of them on which it depends.
fn conflict<'d>(drives: &'d [Drive], mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Vec<&'d Drive>> {
    let is_free = |i: usize| mechanism.coordinates[i].motion.is_none() || is_driven(&mechanism.coordinates[i]);
    let mut rows = constraint_gradients(mechanism, state, is_free);
    let gradients: Vec<Vec<f64>> = drives
        .iter()
        .map(|drive| match drive.place {
            DrivePlace::Coordinate(i) => (0..state.q.len()).map(|k| if k == i { 1.0 } else { 0.0 }).collect(),
            DrivePlace::Multiplier(m) => std::mem::take(&mut rows[m]),
        })
        .collect();
    let mut joints = ConstraintRank::none();
    rows.into_iter().enumerate().filter(|(_, row)| row.iter().any(|x| *x != 0.0)).for_each(|(m, row)| {
        joints.add(m, row);
    });
    let mut rank = joints.clone();
    let k = (0..drives.len()).find(|&k| !rank.add(k, gradients[k].clone()))?;
    let is_involved = |j: &usize| {
        let mut without = joints.clone();
        (0..k).filter(|i| i != j).for_each(|i| {
            without.add(i, gradients[i].clone());
        });
        !without.depends(gradients[k].clone())
    };
    Some((0..k).filter(is_involved).chain([k]).map(|i| &drives[i]).collect())
}

/// Largest number of driven coordinates that a message names.
const MOST_NAMED: usize = 3;

/// The positions of driven coordinates as an addition to the reason of a failure, such as ", with crank.theta at 2.1 m or rad"; empty without any.
pub(crate) fn driven_positions(mechanism: &Mechanism<f64>, state: &State<f64>) -> String {
    let driven = mechanism.coordinates.iter().zip(&state.q).filter(|(coordinate, _)| is_driven(coordinate));
    let rounded = |q: f64| Readable(format!("{q:.3e}").parse().unwrap_or(q));
    let names: Vec<String> =
        driven.take(MOST_NAMED).map(|(c, &q)| format!("{} driven to {} m or rad", c.name, rounded(q))).collect();
    if names.is_empty() { String::new() } else { format!(", with {}", names.join(", ")) }
}
