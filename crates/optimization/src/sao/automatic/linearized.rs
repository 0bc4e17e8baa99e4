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
    pub gradient: Vec<f64>,
}

impl Linearized {
    /// The linearization at an analysed design whose retained rows were differentiated.
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
            c: rows.iter().map(|&row| evaluation.residual_of(row)).collect(),
            equality: rows.iter().map(|row| problem.constraints[row.constraint].is_equality()).collect(),
            gradient: total(problem.objective.signed(), 0),
            jacobian,
            rows,
        }
    }

    /// Removes what is left of the rows for which `is_identity` is true: their values and slopes are rounding errors.
    pub fn without(mut self, is_identity: impl Fn(&Self, usize) -> bool) -> Self {
        for i in (0..self.rows.len()).filter(|&i| is_identity(&self, i)).collect::<Vec<_>>() {
            self.c[i] = 0.0;
            self.jacobian.row_mut(i).fill(0.0);
        }
        self
    }

    /// The largest |∂ĝ/∂b| of each constraint over its rows, for each variable.
    pub fn largest_derivatives(&self, constraints: usize) -> Vec<Vec<f64>> {
        let n = self.gradient.len();
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

    /// Least-squares multipliers of the active rows over the variables that are not at a bound, in lengths. If the gradient of the
    /// Lagrangian then points from a bound into the interior, the multipliers of rows and bounds are determined together: the variables
    /// that are not at a bound may be too few for those of the rows.
    pub fn least_squares_multipliers(&self, problem: &Problem, b: &[f64], lengths: &[f64]) -> Vec<f64> {
        // −1 for a variable at its lower bound, 1 at its upper bound; both for one that is fixed.
        let bounds = |j: usize| {
            let (variable, near) = (&problem.variables[j], ACTIVE * lengths[j]);
            let at = [(b[j] - variable.lower <= near, -1.0), (variable.upper - b[j] <= near, 1.0)];
            at.into_iter().filter(|(is_at, _)| *is_at).map(move |(_, side)| (j, side))
        };
        let at_bounds: Vec<(usize, f64)> = (0..b.len()).flat_map(bounds).collect();
        let free: Vec<usize> = (0..b.len()).filter(|j| at_bounds.iter().all(|(k, _)| k != j)).collect();
        let has_slopes = |i: usize| self.jacobian.row(i).iter().any(|g| *g != 0.0);
        let active: Vec<usize> = (0..self.c.len()).filter(|&i| has_slopes(i) && self.is_active(i, lengths)).collect();
        let equality: Vec<bool> = active.iter().map(|&i| self.equality[i]).collect();
        let solve = |variables: &[usize], held: &[(usize, f64)]| {
            let gradient = |k: usize, a: usize| {
                let j = variables[k];
                match active.get(a) {
                    Some(&i) => self.jacobian[(i, j)] * lengths[j],
                    None => Some(held[a - active.len()]).filter(|(at, _)| *at == j).map_or(0.0, |(_, side)| side),
                }
            };
            let gradients = DMatrix::from_fn(variables.len(), active.len() + held.len(), gradient);
            let slope: Vec<f64> = variables.iter().map(|&j| self.gradient[j] * lengths[j]).collect();
            let equality = [&equality[..], &vec![false; held.len()]].concat();
            let mut multipliers = vec![0.0; self.c.len()];
            active
                .iter()
                .zip(nlp::least_squares_multipliers(&slope, &gradients, &equality))
                .for_each(|(&i, λ)| multipliers[i] = λ);
            multipliers
        };
        let multipliers = solve(&free, &[]);
        let slope = self.lagrangian_gradient(&multipliers);
        let leaves_bound = |&(j, side): &(usize, f64)| {
            let is_fixed = problem.variables[j].upper - problem.variables[j].lower <= ACTIVE * lengths[j];
            !is_fixed && side * slope[j] > ACTIVE * self.gradient[j].abs()
        };
        if active.is_empty() || !at_bounds.iter().any(leaves_bound) {
            return multipliers;
        }
        solve(&(0..b.len()).collect::<Vec<_>>(), &at_bounds)
    }

    /// ∂(F + Σ λᵢ cᵢ)/∂b.
    pub fn lagrangian_gradient(&self, multipliers: &[f64]) -> Vec<f64> {
        let of_rows = |j: usize| self.jacobian.column(j).iter().zip(multipliers).map(|(g, λ)| λ * g).sum::<f64>();
        (0..self.gradient.len()).map(|j| self.gradient[j] + of_rows(j)).collect()
    }
}
