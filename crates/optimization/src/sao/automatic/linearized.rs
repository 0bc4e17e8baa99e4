//! Objective and retained rows at the current design with their gradients.

use crate::approximation::CycleData;
use crate::problem::{Evaluation, Problem, Responses, RowId};
use nalgebra::DMatrix;

/// Distance from a limit or bound, in lengths, within which it is active.
const ACTIVE: f64 = 1e-6;

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

    /// True for an equality, and for a row whose distance from its limit is negligible compared with its terms.
    pub fn is_active(&self, i: usize, lengths: &[f64]) -> bool {
        let terms = || self.jacobian.row(i).iter().zip(lengths).map(|(g, l)| g.abs() * l).sum::<f64>();
        self.equality[i] || self.c[i] > -ACTIVE * terms()
    }

    /// Multipliers of the active rows by least squares over the variables off their bounds, in lengths.
    pub fn balanced(&self, problem: &Problem, b: &[f64], lengths: &[f64]) -> Vec<f64> {
        let is_free = |&j: &usize| {
            let (variable, near) = (&problem.variables[j], ACTIVE * lengths[j]);
            b[j] - variable.lower > near && variable.upper - b[j] > near
        };
        let free: Vec<usize> = (0..b.len()).filter(is_free).collect();
        let active: Vec<usize> = (0..self.c.len()).filter(|&i| self.is_active(i, lengths)).collect();
        let gradients =
            DMatrix::from_fn(free.len(), active.len(), |k, a| self.jacobian[(active[a], free[k])] * lengths[free[k]]);
        let slope: Vec<f64> = free.iter().map(|&j| self.slope[j] * lengths[j]).collect();
        let equality: Vec<bool> = active.iter().map(|&i| self.equality[i]).collect();
        let mut multipliers = vec![0.0; self.c.len()];
        active.iter().zip(nlp::balance(&slope, &gradients, &equality)).for_each(|(&i, λ)| multipliers[i] = λ);
        multipliers
    }

    /// ∂(F + Σ λᵢ cᵢ)/∂b.
    pub fn lagrangian_slope(&self, multipliers: &[f64]) -> Vec<f64> {
        let held = |j: usize| self.jacobian.column(j).iter().zip(multipliers).map(|(g, λ)| λ * g).sum::<f64>();
        (0..self.slope.len()).map(|j| self.slope[j] + held(j)).collect()
    }
}
