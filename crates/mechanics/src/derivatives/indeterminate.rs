//! Outputs that redundant constraints leave indeterminate: they have no derivative.

use crate::analyses::indeterminate_outputs::indeterminate_outputs;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};

/// Checks that no output whose derivatives are needed depends on reactions that redundant constraints leave indeterminate.
///
/// An analysis returns the reactions of least norm. Their derivatives would contain those of the directions of all
/// constraints, which no method computes.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the output.
pub(crate) fn check_outputs(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    let why = "redundant constraints leave this reaction indeterminate: it has one of many values, but no derivative";
    let remedy = "remove the output, or the constraints that follow from others";
    let mut found = indeterminate_outputs(system, mechanism, state).into_iter().map(|k| &mechanism.outputs[k]);
    match found.find(|output| output.is_differentiated) {
        Some(output) => Err(Error::unsupported(&output.name, why, remedy)),
        None => Ok(()),
    }
}
