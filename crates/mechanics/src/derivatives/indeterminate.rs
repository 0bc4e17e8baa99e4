//! Outputs that redundant constraints leave indeterminate: they have no derivative.

use crate::analyses::sampling::Sampler;
use crate::constraint_rank::self_stresses;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};

/// Relative change of an output by reactions without effect on the motion, above which it is indeterminate.
const CHANGED: f64 = 1e-8;

/// Checks that no output depends on reactions that redundant constraints leave indeterminate.
///
/// An analysis returns the reactions of least norm. Their derivatives would contain those of the directions of all
/// constraints, which no method computes.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the output.
pub(crate) fn check_outputs(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    if !system.allows_redundancy() {
        return Ok(());
    }
    let mut sampler = Sampler::new(mechanism);
    let (mut here, mut moved) = (Vec::new(), Vec::new());
    sampler.outputs(mechanism, state, &mut here);
    for stress in self_stresses(system, mechanism, state) {
        let mut stressed = state.clone();
        stressed.l.iter_mut().zip(&stress).for_each(|(l, n)| *l += n);
        sampler.outputs(mechanism, &stressed, &mut moved);
        let changed = here.iter().zip(&moved).position(|(a, b)| (a - b).abs() > CHANGED * (1.0 + a.abs()));
        if let Some(k) = changed {
            let why = "redundant constraints leave this reaction indeterminate: it has a value of least norm, but no derivative";
            let remedy = "remove the output, or the constraints that follow from others";
            return Err(Error::unsupported(&mechanism.outputs[k].name, why, remedy));
        }
    }
    Ok(())
}
