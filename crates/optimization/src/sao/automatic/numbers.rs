//! The approximated numbers of a problem: values of responses at time points, and of quantities that are approximated directly.

use crate::approximation::CycleData;
use crate::problem::{Evaluation, Intermediates, Problem, ResponseAt, Responses, RowId};
use autodiff::{HyperDual, hessian, jacobian};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Identity of an approximated number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum NumberId {
    /// A response at a time point.
    Response(ResponseAt),
    /// The objective, if it is approximated directly.
    Objective,
    /// c = ĝ − 1 of a constraint that is approximated directly, or of a peak in continuous time.
    Row(RowId),
}

/// The numbers that share one choice of approximation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum NumberGroup {
    /// All time points of a response.
    Response(usize),
    /// The objective.
    Objective,
    /// All rows of a constraint.
    Constraint(usize),
}

impl NumberId {
    /// The group of this number.
    pub fn group(self) -> NumberGroup {
        match self {
            Self::Response(at) => NumberGroup::Response(at.response),
            Self::Objective => NumberGroup::Objective,
            Self::Row(row) => NumberGroup::Constraint(row.constraint),
        }
    }

    /// The intermediate variables in which the number is approximated.
    pub(super) fn intermediates(self, problem: &Problem) -> &Intermediates {
        const IDENTITY: &Intermediates = &Intermediates::Identity;
        let direct = match self {
            Self::Response(at) => return &problem.responses[at.response].intermediates,
            Self::Objective => &problem.objective.quantity.direct,
            Self::Row(row) => &problem.constraints[row.constraint].quantity.direct,
        };
        direct.as_ref().unwrap_or(IDENTITY)
    }

    /// The value of the number at an analysed design.
    pub(super) fn value(self, responses: &Responses, evaluation: &Evaluation) -> f64 {
        match self {
            Self::Response(at) => responses.at(at),
            Self::Objective => evaluation.objective,
            Self::Row(row) => evaluation.residual_of(row),
        }
    }
}

/// Value and gradient of a number at a design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ApproximatedValue {
    /// Identity.
    pub id: NumberId,
    /// Value.
    pub value: f64,
    /// Derivatives with respect to the design variables (length n).
    pub gradient: Vec<f64>,
}

/// All numbers that the objective and the retained rows need, sorted.
pub(super) fn collect_numbers(
    problem: &Problem,
    design: &[f64],
    (responses, evaluation): (&Responses, &Evaluation),
    data: &CycleData,
) -> Vec<ApproximatedValue> {
    let CycleData { retained, sensitivities, peaks, .. } = data;
    let mut numbers = vec![];
    let objective = &problem.objective;
    let is_through_responses = |row: &&RowId| {
        let constraint = &problem.constraints[row.constraint];
        constraint.quantity.direct.is_none() && !constraint.is_continuous
    };
    let rows = retained.iter().filter(is_through_responses);
    let mut used: Vec<ResponseAt> =
        rows.flat_map(|r| problem.responses_of(&problem.constraints[r.constraint].quantity, r.point)).collect();
    if objective.quantity.direct.is_none() {
        used.extend(problem.responses_of(&objective.quantity, 0));
    } else {
        let gradient = problem.total_derivative(objective.signed(), 0, design, responses, sensitivities);
        numbers.push(ApproximatedValue { id: NumberId::Objective, value: evaluation.objective, gradient });
    }
    used.sort_unstable();
    used.dedup();
    for at in used {
        let gradient = sensitivities.gradient(at).expect("every response of a retained quantity is differentiated");
        numbers.push(ApproximatedValue { id: NumberId::Response(at), value: responses.at(at), gradient });
    }
    for &row in retained.iter().filter(|row| !is_through_responses(row)) {
        let constraint = &problem.constraints[row.constraint];
        let gradient = match peaks.iter().find(|p| p.row == row) {
            Some(peak) => problem.peak_gradient(peak, design),
            None => {
                let slope = problem.total_derivative(constraint.signed(), row.point, design, responses, sensitivities);
                slope.into_iter().map(|s| s / constraint.scale).collect()
            }
        };
        numbers.push(ApproximatedValue { id: NumberId::Row(row), value: evaluation.residual_of(row), gradient });
    }
    numbers.sort_unstable_by_key(|number| number.id);
    numbers
}

/// The number of this identity; for a peak in continuous time the nearest one of its constraint.
pub(super) fn find_number<'a>(
    problem: &Problem,
    numbers: &'a [ApproximatedValue],
    id: NumberId,
) -> Option<&'a ApproximatedValue> {
    if let Ok(k) = numbers.binary_search_by_key(&id, |number| number.id) {
        return Some(&numbers[k]);
    }
    let NumberId::Row(row) = id else { return None };
    let same = numbers.iter().filter_map(|number| match number.id {
        NumberId::Row(other) if other.constraint == row.constraint => Some((other.point.abs_diff(row.point), number)),
        _ => None,
    });
    let nearest = same.min_by_key(|(distance, _)| *distance)?.1;
    problem.constraints[row.constraint].is_continuous.then_some(nearest)
}

/// Intermediate variables y(b) with their derivatives ∂y/∂b; `None` stands for the identity.
pub(super) fn values_and_jacobian(intermediates: &Intermediates, b: &[f64]) -> (Vec<f64>, Option<DMatrix<f64>>) {
    if let Intermediates::Identity = intermediates {
        return (b.to_vec(), None);
    }
    let (y, rows) = jacobian(|b| (0..b.len()).map(|k| intermediates.component(k, b)).collect(), b);
    (y, Some(rows))
}

/// Σ wₖ ∂²yₖ/∂b².
pub(super) fn weighted_hessian(intermediates: &Intermediates, weights: &[f64], b: &[f64]) -> DMatrix<f64> {
    let sum = |b: &[HyperDual]| {
        let terms = weights.iter().enumerate().map(|(k, &w)| intermediates.component(k, b) * w);
        terms.fold(HyperDual::from(0.0), |a, t| a + t)
    };
    hessian(sum, b).2
}

/// The solution s of (∂y/∂b)ᵀ s = `gradient`: the gradient with respect to y. `None` if ∂y/∂b is singular.
pub(super) fn gradient_in_intermediates(rows: &Option<DMatrix<f64>>, gradient: &[f64]) -> Option<Vec<f64>> {
    let Some(rows) = rows else { return Some(gradient.to_vec()) };
    let solution = rows.transpose().lu().solve(&DVector::from_column_slice(gradient))?;
    solution.iter().all(|v| v.is_finite()).then(|| solution.as_slice().to_vec())
}

/// (∂y/∂b)ᵀ s: the gradient with respect to b from the gradient s with respect to y.
pub(super) fn gradient_in_design(rows: &Option<DMatrix<f64>>, slope: Vec<f64>) -> Vec<f64> {
    match rows {
        None => slope,
        Some(rows) => rows.tr_mul(&DVector::from_vec(slope)).as_slice().to_vec(),
    }
}
