//! The quadratic program of an iteration.

use super::state::SqpState;
use crate::Program;
use crate::elastic::Elastic;
use crate::solver::Candidate;
use crate::{Conic, QuadraticProgram, Status};
use error::Result;

/// Growth of the penalty while a relaxed step leaves the violation as it is.
const GROWTH: f64 = 10.0;
/// A larger penalty is kept if it leaves at most this part of the violation that the smaller one left.
const WORTH: f64 = 0.9;
/// Penalties tried in one iteration.
const PENALTIES: usize = 7;

/// Where a full step leads.
pub(super) struct Step {
    pub to: Candidate,
    /// Violation that the linearized rows keep, zero where they have a common point.
    pub left: f64,
    /// The penalty that the step was computed with, zero where it did not matter.
    pub penalty: f64,
}

/// The Taylor expansion of `program` at the state, with the state's curvature.
pub(super) fn linearized(program: &dyn Program, state: &SqpState) -> QuadraticProgram {
    QuadraticProgram {
        center: state.x.clone(),
        constant: state.objective,
        gradient: state.slope.clone(),
        hessian: Some(state.curvature.clone()),
        offset: state.rows.clone(),
        rows: state.row_slopes.clone(),
        equality: (0..state.rows.len()).map(|i| program.is_equality(i)).collect(),
        lower: program.lower().to_vec(),
        upper: program.upper().to_vec(),
    }
}

/// The step of the quadratic program; relaxed where the linearized rows have no common point within the bounds.
pub(super) fn full_step(qp: &QuadraticProgram, conic: &Conic, state: &SqpState, penalty: f64) -> Result<Option<Step>> {
    let to = conic.candidate(qp)?;
    if to.status == Status::Solved {
        return Ok(Some(Step { to, left: 0.0, penalty: 0.0 }));
    }
    let mut penalty = state.penalty.max(penalty);
    let mut last: Option<Step> = None;
    for _ in 0..PENALTIES {
        let elastic = Elastic::with_objective(qp, vec![1.0; qp.offset.len()], penalty);
        let matrices = QuadraticProgram::of(&elastic, &elastic.start(&qp.center)?)?;
        let solved = conic.candidate(&matrices)?;
        if solved.status == Status::Solved {
            let (to, left) = elastic.unwrap(solved);
            // A penalty that brings nothing more is not kept.
            if last.as_ref().is_some_and(|s| left > WORTH * s.left) {
                break;
            }
            last = Some(Step { to, left, penalty });
            if left <= 0.5 * state.violation {
                break;
            }
        }
        penalty *= GROWTH;
    }
    Ok(last)
}

/// The step again, with the rows' values at the full step: they are met to second order.
pub(super) fn corrected(qp: &QuadraticProgram, conic: &Conic, to: &[f64], rows: &[f64]) -> Option<Vec<f64>> {
    let d = qp.step(to);
    let linear = &qp.rows * &d;
    let offset = rows.iter().zip(linear.iter()).map(|(g, a)| g - a).collect();
    let again = conic.candidate(&QuadraticProgram { offset, ..qp.clone() }).ok()?;
    (again.status == Status::Solved).then_some(again.x)
}
