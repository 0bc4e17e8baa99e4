//! Objective and retained rows at the current design with their gradients.

use crate::approximation::CycleData;
use crate::problem::{Evaluation, Problem, Responses, RowId};
use nalgebra::DMatrix;

/// Values and first derivatives of the objective and of the retained rows c = ĝ − 1.
pub(super) struct Linearized {
    /// Retained rows.
    pub rows: Vec<RowId>,
    /// c of each row.
    pub c: Vec<f64>,
    /// True for equalities.
    pub equality: Vec<bool>,
    /// ∂c/∂b.
    pub jacobian: DMatrix<f64>,
    /// ∂F/∂b.
    pub slope: Vec<f64>,
}

impl Linearized {
    /// At an analysed design whose retained rows were differentiated.
    pub fn new(
        problem: &Problem,
        (design, responses, evaluation): (&[f64], &Responses, &Evaluation),
        data: &CycleData,
    ) -> Self {
        let total = |signed, p| problem.total_derivative(signed, p, design, responses, &data.sensitivities);
        let rows = data.retained.clone();
        let mut jacobian = DMatrix::zeros(rows.len(), design.len());
        for (i, row) in rows.iter().enumerate() {
            let constraint = &problem.constraints[row.constraint];
            let slope = match data.peaks.iter().find(|p| p.row == *row) {
                Some(peak) => problem.peak_gradient(peak, design),
                None => total(constraint.signed(), row.point).into_iter().map(|s| s / constraint.scale).collect(),
            };
            slope.iter().enumerate().for_each(|(j, s)| jacobian[(i, j)] = *s);
        }
        Self {
            c: rows.iter().map(|&row| evaluation.value_of(row) - 1.0).collect(),
            equality: rows.iter().map(|row| problem.constraints[row.constraint].is_equality()).collect(),
            slope: total(problem.objective.signed(), 0),
            jacobian,
            rows,
        }
    }

    /// The largest |∂ĝ/∂b| of each constraint over its rows, for each variable.
    pub fn slopes(&self, constraints: usize) -> Vec<Vec<f64>> {
        let n = self.slope.len();
        let mut slopes = vec![vec![0.0f64; n]; constraints];
        for (i, row) in self.rows.iter().enumerate() {
            let largest = &mut slopes[row.constraint];
            (0..n).for_each(|j| largest[j] = largest[j].max(self.jacobian[(i, j)].abs()));
        }
        slopes
    }

    /// ∂(F + Σ λᵢ cᵢ)/∂b.
    pub fn lagrangian_slope(&self, multipliers: &[f64]) -> Vec<f64> {
        let held = |j: usize| self.jacobian.column(j).iter().zip(multipliers).map(|(g, λ)| λ * g).sum::<f64>();
        (0..self.slope.len()).map(|j| self.slope[j] + held(j)).collect()
    }
}
