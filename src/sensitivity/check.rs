//! Proving the derivatives of a mechanism, for instance of an element of one's own.

use super::differentiation::Differentiation;
use super::transient::{Integration, Transient};
use crate::Result;
use crate::analysis::Dynamics;
use crate::multibody::Model;
use crate::problem::check::Proof;
use crate::problem::{Analysis, Instant, check};

/// Derivatives of all outputs of `model` at `times` by the design `b`, forward and backward, against differences.
///
/// In a test of an element of one's own, one line: `check_model(model, &b, settings, &times)?.expect_right()`.
///
/// **Errors.** As [`Transient::analyze`](crate::problem::Analysis::analyze).
pub fn check_model<M: Model + Clone>(model: M, b: &[f64], settings: Dynamics, times: &[f64]) -> Result<Proof> {
    let towards =
        |method| Transient::new(model.clone(), Integration::Implicit(settings), times)?.differentiating(method);
    let (forward, backward) = (towards(Differentiation::Direct)?, towards(Differentiation::Adjoint)?);
    let outputs = model.build(b)?.outputs.len();
    let instants = |response| (0..times.len()).map(move |point| Instant { response, point });
    let wanted: Vec<Instant> = (0..outputs).flat_map(instants).collect();
    let scales: Vec<f64> = b.iter().map(|x| if *x == 0.0 { 1.0 } else { x.abs() }).collect();
    let methods: [(&str, &dyn Analysis); 2] = [("direct", &forward), ("adjoint", &backward)];
    check::check(&forward, &methods, b, &scales, &wanted)
}
