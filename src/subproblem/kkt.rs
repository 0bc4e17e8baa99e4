//! The optimality conditions of Karush, Kuhn and Tucker, checked apart from every solver.

use super::{Solution, Status};
use crate::error::Result;
use crate::problem::{Gradients, Program};
use serde::{Deserialize, Serialize};

/// How far a point with multipliers is from the Karush–Kuhn–Tucker conditions. All entries are dimensionless.
///
/// Variables are measured in their scale sⱼ (see [`variable_scale`]), row i in rᵢ = maxⱼ sⱼ |∂gᵢ/∂xⱼ| (one for a row
/// of zeros), the objective in φ = maxⱼ sⱼ max(|∂f/∂xⱼ| at the point, at the start, |λᵢ ∂gᵢ/∂xⱼ|).
///
/// * stationarity: maxⱼ sⱼ |∂f/∂xⱼ + Σ λᵢ ∂gᵢ/∂xⱼ − μₗⱼ + μᵤⱼ| / φ
/// * primal: max of (gᵢ − t)⁺ / rᵢ, |hᵢ| − t for equalities, and the bounds' violation / sⱼ
/// * dual: the largest negative part of a multiplier, times its rᵢ or sⱼ, / φ
/// * complementarity: max of |λᵢ (gᵢ − t)| / φ and of |μ · distance to the bound| / φ
///
/// with tᵢ the relaxation, zero unless the program is infeasible.
///
/// **Source.** Nocedal & Wright, *Numerical Optimization*, 2nd ed., equations (12.34).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KktResidual {
    /// Gradient of the Lagrangian.
    pub stationarity: f64,
    /// Violation of rows and bounds, beyond the relaxation.
    pub primal: f64,
    /// Negative multipliers.
    pub dual: f64,
    /// Multipliers of rows and bounds that are not active.
    pub complementarity: f64,
}

/// The unit in which variable j is measured.
///
/// Between a hundredth of its range and its range, by the size of start and point. Where the range is infinite or
/// zero: the size of start and point, at least one if the start is zero.
pub fn variable_scale(lower: f64, upper: f64, start: f64, x: f64) -> f64 {
    let (range, size) = (upper - lower, start.abs().max(x.abs()));
    if range.is_finite() && range > 0.0 {
        size.clamp(0.01 * range, range)
    } else if start == 0.0 {
        size.max(1.0)
    } else {
        size
    }
}

impl KktResidual {
    /// The residual of `solution`, from fresh evaluations of `program` at the point and at `start`.
    pub fn of(program: &dyn Program, start: &[f64], solution: &Solution) -> Result<Self> {
        let here = program.gradients(&solution.x)?;
        let there = program.gradients(start).ok();
        Ok(Self::from_gradients(program, start, &here, there.as_ref().map(|g| g.objective.as_slice()), solution))
    }

    /// The residual from gradients at the point and the objective's gradient at the start.
    pub(crate) fn from_gradients(
        program: &dyn Program,
        start: &[f64],
        here: &Gradients,
        first: Option<&[f64]>,
        solution: &Solution,
    ) -> Self {
        let x = &solution.x;
        let (lower, upper) = (program.lower(), program.upper());
        let scale: Vec<f64> = (0..x.len()).map(|j| variable_scale(lower[j], upper[j], start[j], x[j])).collect();
        let mut slope = here.objective.clone();
        let mut unit = largest(scale.iter().zip(&slope).map(|(s, g)| s * g));
        if let Some(first) = first {
            unit = unit.max(largest(scale.iter().zip(first).map(|(s, g)| s * g)));
        }
        let mut row_units = vec![0.0f64; here.values.rows.len()];
        for (j, slope) in slope.iter_mut().enumerate() {
            for ((unit, λ), g) in row_units.iter_mut().zip(&solution.multipliers).zip(here.rows.column(j).iter()) {
                *slope += λ * g;
                *unit = unit.max((scale[j] * g).abs());
            }
        }
        let mut residual = Self::default();
        let (mut dual, mut complementarity): (f64, f64) = (0.0, 0.0);
        for (i, &g) in here.values.rows.iter().enumerate() {
            let λ = solution.multipliers[i];
            unit = unit.max(λ.abs() * row_units[i]);
            let row = if row_units[i] > 0.0 { row_units[i] } else { 1.0 };
            let relaxed = solution.relaxed_rows.get(i).copied().unwrap_or(0.0);
            let equality = program.is_equality(i);
            let beyond = if equality { g.abs() } else { g } - relaxed;
            residual.primal = residual.primal.max(beyond / row);
            if !equality {
                dual = dual.max(-λ * row);
            }
            if !equality || relaxed > 0.0 {
                complementarity = complementarity.max((λ * beyond).abs());
            }
        }
        for j in 0..x.len() {
            let (l, u) = (solution.lower_multipliers[j], solution.upper_multipliers[j]);
            slope[j] += u - l;
            residual.primal = residual.primal.max((lower[j] - x[j]).max(x[j] - upper[j]) / scale[j]);
            dual = dual.max(-l.min(u) * scale[j]);
            let product = |μ: f64, gap: f64| if μ == 0.0 { 0.0 } else { (μ * gap).abs() };
            complementarity = complementarity.max(product(l, x[j] - lower[j])).max(product(u, upper[j] - x[j]));
        }
        // A constant objective and rows of zeros have no unit.
        let unit = if unit > 0.0 { unit } else { 1.0 };
        let relative = |v: f64| v / unit;
        residual.stationarity = relative(largest(scale.iter().zip(&slope).map(|(s, g)| s * g)));
        residual.dual = relative(dual);
        residual.complementarity = relative(complementarity);
        residual
    }

    /// The largest of the four; NaN if one of them is.
    pub fn largest(&self) -> f64 {
        largest([self.stationarity, self.primal, self.dual, self.complementarity].into_iter())
    }
}

/// Largest absolute value; NaN is kept.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a, v| if v.is_nan() || v.abs() > a { v.abs() } else { a })
}

/// What holds the solution in place.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ActiveSet {
    /// Rows without slack or with a multiplier.
    pub rows: Vec<usize>,
    /// Variables at their lower bound.
    pub lower: Vec<usize>,
    /// Variables at their upper bound.
    pub upper: Vec<usize>,
}

impl ActiveSet {
    /// The active set of `solution`: a row or bound whose slack is at most `tolerance` of its scale (see
    /// [`KktResidual`]), and every equality row.
    pub fn of(program: &dyn Program, start: &[f64], solution: &Solution, tolerance: f64) -> Result<Self> {
        let here = program.gradients(&solution.x)?;
        let (lower, upper, x) = (program.lower(), program.upper(), &solution.x);
        let scale: Vec<f64> = (0..x.len()).map(|j| variable_scale(lower[j], upper[j], start[j], x[j])).collect();
        let near = |&i: &usize| {
            let row = largest((0..x.len()).map(|j| scale[j] * here.rows[(i, j)]));
            let relaxed = solution.relaxed_rows.get(i).copied().unwrap_or(0.0);
            program.is_equality(i) || here.values.rows[i] - relaxed >= -tolerance * if row > 0.0 { row } else { 1.0 }
        };
        Ok(Self {
            rows: (0..program.rows()).filter(near).collect(),
            lower: (0..x.len()).filter(|&j| x[j] - lower[j] <= tolerance * scale[j]).collect(),
            upper: (0..x.len()).filter(|&j| upper[j] - x[j] <= tolerance * scale[j]).collect(),
        })
    }
}

/// The status that the conditions support: `Solved` or `Relaxed` only within `tolerance`.
pub(crate) fn supported(status: Status, kkt: &KktResidual, tolerance: f64) -> Status {
    let holds = kkt.largest() <= tolerance;
    if status.is_usable() && !holds { Status::Stalled } else { status }
}
