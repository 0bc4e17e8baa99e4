//! The quadratic program of an SQP iteration.

use super::state::SqpState;
use crate::solution::Candidate;
use crate::solvers::elastic::Elastic;
use crate::solvers::qp::Conic;
use crate::{Program, ProgramStatus, QuadraticProgram};
use error::Result;

/// Factor by which the penalty grows while a relaxed step does not reduce the violation enough.
const GROWTH: f64 = 10.0;
/// A larger penalty is kept if it reduces the remaining violation at least to this fraction.
const REDUCTION: f64 = 0.9;
/// Largest number of penalties in one iteration.
const PENALTIES: usize = 7;

/// The solution of the quadratic program.
pub(super) struct FullStep {
    pub to: Candidate,
    /// Violation of the linearized rows at the end of the step; zero if they have a common point.
    pub remaining_violation: f64,
    /// The penalty of the relaxed quadratic program; zero if it was not relaxed.
    pub penalty: f64,
}

/// The Taylor expansion of `program` at the state, with the state's Hessian.
pub(super) fn linearized(program: &dyn Program, state: &SqpState) -> QuadraticProgram {
    QuadraticProgram {
        center: state.x.clone(),
        constant: state.objective,
        gradient: state.objective_gradient.clone(),
        hessian: Some(state.hessian.clone()),
        offset: state.rows.clone(),
        rows: state.row_gradients.clone(),
        equality: (0..state.rows.len()).map(|i| program.is_equality(i)).collect(),
        lower: program.lower().to_vec(),
        upper: program.upper().to_vec(),
    }
}

/// Solves the quadratic program, relaxed if the linearized rows have no common point within the bounds.
pub(super) fn full_step(
    qp: &QuadraticProgram,
    conic: &Conic,
    state: &SqpState,
    penalty: f64,
) -> Result<Option<FullStep>> {
    let to = conic.candidate(qp)?;
    if to.status == ProgramStatus::Solved {
        return Ok(Some(FullStep { to, remaining_violation: 0.0, penalty: 0.0 }));
    }
    let mut penalty = state.penalty.max(penalty);
    let mut last: Option<FullStep> = None;
    for _ in 0..PENALTIES {
        let elastic = Elastic::with_objective(qp, vec![1.0; qp.offset.len()], penalty);
        let matrices = QuadraticProgram::of(&elastic, &elastic.start(&qp.center)?)?;
        let solved = conic.candidate(&matrices)?;
        if solved.status == ProgramStatus::Solved {
            let (to, remaining_violation) = elastic.split(solved);
            // A larger penalty without further reduction is discarded.
            if last.as_ref().is_some_and(|s| remaining_violation > REDUCTION * s.remaining_violation) {
                break;
            }
            last = Some(FullStep { to, remaining_violation, penalty });
            if remaining_violation <= 0.5 * state.violation {
                break;
            }
        }
        penalty *= GROWTH;
    }
    Ok(last)
}

/// The second-order correction: the quadratic program with the values of the rows at the end of the full step.
pub(super) fn corrected(qp: &QuadraticProgram, conic: &Conic, to: &[f64], rows: &[f64]) -> Option<Vec<f64>> {
    let d = qp.step(to);
    let linear = &qp.rows * &d;
    let offset = rows.iter().zip(linear.iter()).map(|(g, a)| g - a).collect();
    let solved = conic.candidate(&QuadraticProgram { offset, ..qp.clone() }).ok()?;
    (solved.status == ProgramStatus::Solved).then_some(solved.x)
}
