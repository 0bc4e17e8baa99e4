//! Warning about motions that start far from the positions of the model.

use crate::constraint_rank::ConstraintRank;
use crate::elements::spatial::bodies::normalization::normalized_frame;
use crate::mechanism::Mechanism;
use crate::mechanism::rotation::{conjugate, quaternion_product, rotation_vector};
use crate::mechanism::vector::norm;
use crate::system::System;
use crate::system::state::State;

/// Change of a position, in extents of the mechanism, or of an angle in rad, from which on the assembly is told. The
/// rounded and estimated positions of all shipped models are nearer.
const FAR: f64 = 0.1;

/// Warning about positions of the model that the joints do not allow, if the assembled `start` is far from them. It names coordinates
/// that can move only: positions that joints and drives determine are estimates.
pub(crate) fn positions_that_do_not_fit(mechanism: &Mechanism<f64>, start: &State<f64>) -> Option<String> {
    let extent = Some(mechanism.extent(&start.q)).filter(|extent| *extent > 0.0).unwrap_or(1.0);
    let mut changes = Vec::new();
    for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
        let (before, after) = (coordinate.position, start.q[i]);
        let scale = coordinate.axis.map_or(1.0, |_| extent);
        if coordinate.motion.is_none() && !coordinate.is_follower && (after - before).abs() > FAR * scale {
            changes.push((vec![i], format!("{} is given {before:.6} and becomes {after:.6}", coordinate.name)));
        }
    }
    for instance in &mechanism.elements {
        let Some(body) = normalized_frame(instance) else { continue };
        let own = &instance.coordinates[3..];
        changes.retain(|(of, _)| !own.contains(&of[0]));
        let of = |number: &dyn Fn(usize) -> f64| std::array::from_fn(|k| number(own[k]));
        let (before, after) = (of(&|i| mechanism.coordinates[i].position), of(&|i| start.q[i]));
        let angle = norm(rotation_vector(&quaternion_product::<f64>(&after, &conjugate(&before))));
        if angle > FAR {
            changes.push((own.to_vec(), format!("{body} is turned by {angle:.6} rad")));
        }
    }
    if changes.is_empty() {
        return None;
    }
    let rank = ConstraintRank::of(&System::at(mechanism, start.t).ok()?, mechanism, start);
    let is_free = |i: usize| {
        let mut direction = vec![0.0; start.q.len()];
        direction[i] = 1.0;
        mechanism.coordinates[i].motion.is_none() && !rank.depends(direction)
    };
    changes.retain(|(coordinates, _)| coordinates.iter().any(|&i| is_free(i)));
    let names: Vec<String> = changes.into_iter().map(|(_, change)| change).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the positions of the model do not fit the joints; the motion starts at the nearest ones that do: {} (m or rad); give positions \
             and joint angles that agree",
            names.join(", ")
        )
    })
}
