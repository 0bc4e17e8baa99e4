//! Advice on scales: starts and bounds of variables, and scales of constraints, that do not match the changes of the functions.

use super::{DirectCoupling, Problem, RowId};
use error::Result;
use nlp::{Gradients, Program};

/// Least part of a finite range that counts as the length of a variable.
const LEAST_OF_RANGE: f64 = 0.02;
/// Ratio from which on two sizes are far apart.
const FAR: f64 = 1e3;

/// A scale that is far off.
#[derive(Clone, Debug, PartialEq)]
pub enum ScalingAdvice {
    /// Over its length, a variable changes every function by much less than the other variables do.
    ShortVariable {
        /// Index of the variable.
        variable: usize,
        /// Its length: |b|, at least 2 % of a finite range.
        length: f64,
        /// The largest part of the first-order change of a function that is due to it; zero or rounding if nothing depends on it.
        share: f64,
        /// The length over which it would change that function as much as the others do on average; infinite for a share of zero.
        suggested: f64,
    },
    /// A normalized constraint is far larger or far smaller than one, and so is its change.
    Constraint {
        /// Index of the constraint.
        constraint: usize,
        /// Its scale, in the unit of the constrained quantity.
        scale: f64,
        /// The size of the quantity at this design, or its first-order change over the lengths if that is larger.
        suggested: f64,
    },
}

impl Problem {
    /// Scales that are far off at a design, from one analysis and one sensitivity analysis.
    ///
    /// The length ℓ of a variable is |b|, at least 2 % of a finite range, and 1 for a variable without range at zero. A function f
    /// changes by up to Σ |∂f/∂bⱼ| ℓⱼ. A variable is reported if its part of this sum is below 1e-3/n for the objective and all
    /// constraints; a constraint if this sum and the distance from the limit are both above 1000 or both below 1/1000
    /// times its scale. Only the [`Automatic`](crate::sao::Automatic) method finds lengths and units by itself; the steps of the
    /// others depend on them.
    ///
    /// # Errors
    ///
    /// Those of the analysis and of its sensitivities at this design.
    pub fn scaling_advice(&self, design: &[f64]) -> Result<Vec<ScalingAdvice>> {
        let coupling = DirectCoupling::new(self);
        let at = coupling.gradients(design)?;
        let lengths: Vec<f64> = (0..self.n()).map(|j| self.length(j, design[j])).collect();
        let mut advice = self.short_variables(&at, &lengths);
        advice.extend(self.unscaled_constraints(&at, &lengths, &self.all_rows()));
        Ok(advice)
    }

    fn length(&self, j: usize, here: f64) -> f64 {
        let range = self.variables[j].upper - self.variables[j].lower;
        let least = if range.is_finite() { LEAST_OF_RANGE * range } else { 0.0 };
        let length = here.abs().max(least);
        if length > 0.0 { length } else { 1.0 }
    }

    fn short_variables(&self, at: &Gradients, lengths: &[f64]) -> Vec<ScalingAdvice> {
        let n = self.n();
        let rows = (0..at.rows.nrows()).map(|i| at.rows.row(i).iter().copied().collect());
        let functions: Vec<Vec<f64>> = std::iter::once(at.objective.clone()).chain(rows).collect();
        let change = |gradient: &[f64], j: usize| (gradient[j] * lengths[j]).abs();
        let of = |variable: usize| {
            let share = |gradient: &Vec<f64>| {
                let all: f64 = (0..n).map(|j| change(gradient, j)).sum();
                let own = change(gradient, variable);
                let others = (all - own) / (n - 1) as f64;
                (others > 0.0).then(|| (own / all, lengths[variable] * others / own))
            };
            let is_bound = self.objective.peak().is_some_and(|peak| peak.variable == variable);
            let largest = functions.iter().filter_map(share).max_by(|a, b| a.0.total_cmp(&b.0));
            let (share, suggested) = largest.filter(|(share, _)| !is_bound && share * FAR * (n as f64) < 1.0)?;
            Some(ScalingAdvice::ShortVariable { variable, length: lengths[variable], share, suggested })
        };
        if n < 2 { vec![] } else { (0..n).filter_map(of).collect() }
    }

    fn unscaled_constraints(&self, at: &Gradients, lengths: &[f64], rows: &[RowId]) -> Vec<ScalingAdvice> {
        let of = |constraint: usize| {
            let own = (0..rows.len()).filter(|&i| rows[i].constraint == constraint);
            let size = |i: usize| {
                let change: f64 = at.rows.row(i).iter().zip(lengths).map(|(g, l)| (g * l).abs()).sum();
                [change, at.values.rows[i].abs()]
            };
            let [change, distance] = own.map(size).fold([0.0f64; 2], |[a, b], [c, d]| [a.max(c), b.max(d)]);
            let scale = self.constraints[constraint].scale;
            let is_far = change.min(distance) > FAR || (change.max(distance) * FAR < 1.0 && change > 0.0);
            is_far.then(|| ScalingAdvice::Constraint { constraint, scale, suggested: scale * change.max(distance) })
        };
        (0..self.constraints.len()).filter_map(of).collect()
    }
}
