//! Residual of the Karush–Kuhn–Tucker conditions, and the scales in which it is measured.

use crate::{Gradients, Program};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Residual of the Karush–Kuhn–Tucker conditions at a point with multipliers. All entries are dimensionless.
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
/// # Sources
/// Nocedal & Wright, *Numerical Optimization*, 2nd ed., equations (12.34).
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

/// Unit in which a variable is measured.
///
/// The larger of |start| and |x|, limited to between a hundredth of the variable's range and the range. If the range is
/// infinite or zero there is no limit, but a variable that starts at zero has a scale of at least one.
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

/// Scales of all variables of `program`.
pub(crate) fn variable_scales(program: &dyn Program, start: &[f64], x: &[f64]) -> Vec<f64> {
    let (lower, upper) = (program.lower(), program.upper());
    (0..x.len()).map(|j| variable_scale(lower[j], upper[j], start[j], x[j])).collect()
}

/// Largest change of a function over the scale of one variable: maxⱼ sⱼ |∂f/∂xⱼ|.
pub(crate) fn largest_change<'a>(scales: &[f64], gradient: impl IntoIterator<Item = &'a f64>) -> f64 {
    scales.iter().zip(gradient).fold(0.0f64, |largest, (s, slope)| largest.max((s * slope).abs()))
}

/// Units of the rows: their largest changes over the scales of the variables, one for rows of zeros.
pub(crate) fn row_units(scales: &[f64], rows: &DMatrix<f64>) -> Vec<f64> {
    rows.row_iter().map(|row| positive_or_one(largest_change(scales, row.iter()))).collect()
}

/// The value if it is positive, otherwise one.
pub(crate) fn positive_or_one(value: f64) -> f64 {
    if value > 0.0 { value } else { 1.0 }
}

/// Multipliers of all bounds from the gradient of the Lagrangian f + Σ λᵢ gᵢ; zero for variables off their bounds.
pub(crate) fn bound_multipliers(program: &dyn Program, x: &[f64], g: &Gradients, λ: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (lower, upper) = (program.lower(), program.upper());
    let slope = |j: usize| g.rows.column(j).iter().zip(λ).fold(g.objective[j], |a, (g, λ)| a + λ * g);
    let pair = |j: usize| VariableBounds::new((lower[j], upper[j]), x[j], x[j]).multipliers(slope(j));
    (0..x.len()).map(pair).map(|[l, u]| (l, u)).unzip()
}

/// A point with its multipliers and the amounts by which its rows are relaxed (empty: not relaxed).
pub(crate) struct PrimalDual<'a> {
    pub x: &'a [f64],
    pub multipliers: &'a [f64],
    pub lower: &'a [f64],
    pub upper: &'a [f64],
    pub relaxed: &'a [f64],
}

impl KktResidual {
    /// The residual from gradients at the point and the objective's gradient at the start.
    pub(crate) fn from_gradients(
        program: &dyn Program,
        start: &[f64],
        here: &Gradients,
        start_gradient: Option<&[f64]>,
        point: &PrimalDual<'_>,
    ) -> Self {
        let (lower, upper) = (program.lower(), program.upper());
        let mut accumulator = KktAccumulator::new(point.multipliers.len());
        for (j, &x) in point.x.iter().enumerate() {
            let column = here.rows.column(j);
            let bounds = VariableBounds::new((lower[j], upper[j]), x, start[j]);
            let at_start = start_gradient.map_or(0.0, |gradient| gradient[j]);
            let given = [point.lower[j], point.upper[j]];
            accumulator.add(&bounds, [here.objective[j], at_start], column.as_slice(), point.multipliers, |_| given);
        }
        accumulator.finish(program, &here.values.rows, point.multipliers, point.relaxed)
    }

    /// The largest of the four entries; NaN if one of them is.
    pub fn largest(&self) -> f64 {
        [self.stationarity, self.primal, self.dual, self.complementarity].into_iter().fold(0.0, larger)
    }
}

/// The larger absolute value; NaN is kept.
fn larger(a: f64, v: f64) -> f64 {
    if a.is_nan() || v.is_nan() { f64::NAN } else { a.max(v.abs()) }
}

/// A variable with its bounds and its scale.
pub(crate) struct VariableBounds {
    x: f64,
    lower: f64,
    upper: f64,
    scale: f64,
}

impl VariableBounds {
    pub fn new((lower, upper): (f64, f64), x: f64, start: f64) -> Self {
        Self { x, lower, upper, scale: variable_scale(lower, upper, start, x) }
    }

    /// Multipliers of the lower and upper bound that balance a slope of the Lagrangian; zero off the bounds.
    pub fn multipliers(&self, slope: f64) -> [f64; 2] {
        if self.x <= self.lower && slope > 0.0 {
            [slope, 0.0]
        } else if self.x >= self.upper && slope < 0.0 {
            [0.0, -slope]
        } else {
            [0.0, 0.0]
        }
    }
}

/// Contributions of the variables to a [`KktResidual`], added one by one.
#[derive(Clone, Debug)]
pub(crate) struct KktAccumulator {
    row_units: Vec<f64>,
    unit: f64,
    stationarity: f64,
    primal: f64,
    dual: f64,
    complementarity: f64,
}

impl KktAccumulator {
    pub fn new(rows: usize) -> Self {
        let row_units = vec![0.0; rows];
        Self { row_units, unit: 0.0, stationarity: 0.0, primal: 0.0, dual: 0.0, complementarity: 0.0 }
    }

    /// Adds a variable with the slopes of the objective at the point and at the start, and the slopes of the rows.
    ///
    /// `bound_multipliers` gives the multipliers of the bounds from the slope of f + Σ λᵢ gᵢ; they are returned.
    pub fn add(
        &mut self,
        at: &VariableBounds,
        objective: [f64; 2],
        rows: &[f64],
        λ: &[f64],
        bound_multipliers: impl Fn(f64) -> [f64; 2],
    ) -> [f64; 2] {
        let mut slope = objective[0];
        for ((unit, λ), g) in self.row_units.iter_mut().zip(λ).zip(rows) {
            slope += λ * g;
            *unit = unit.max((at.scale * g).abs());
        }
        let [l, u] = bound_multipliers(slope);
        self.unit = larger(larger(self.unit, at.scale * objective[0]), at.scale * objective[1]);
        self.stationarity = larger(self.stationarity, at.scale * (slope + u - l));
        self.primal = self.primal.max((at.lower - at.x).max(at.x - at.upper) / at.scale);
        self.dual = self.dual.max(-l.min(u) * at.scale);
        let product = |μ: f64, gap: f64| if μ == 0.0 { 0.0 } else { (μ * gap).abs() };
        self.complementarity = self.complementarity.max(product(l, at.x - at.lower)).max(product(u, at.upper - at.x));
        [l, u]
    }

    /// Adds the contributions of other variables.
    pub fn merge(&mut self, other: &Self) {
        self.row_units.iter_mut().zip(&other.row_units).for_each(|(a, b)| *a = a.max(*b));
        self.unit = larger(self.unit, other.unit);
        self.stationarity = larger(self.stationarity, other.stationarity);
        self.primal = self.primal.max(other.primal);
        self.dual = self.dual.max(other.dual);
        self.complementarity = self.complementarity.max(other.complementarity);
    }

    /// The residual, after the rows with their multipliers and relaxations have been added.
    pub fn finish(mut self, program: &dyn Program, rows: &[f64], λ: &[f64], relaxed: &[f64]) -> KktResidual {
        for (i, (&g, &λ)) in rows.iter().zip(λ).enumerate() {
            self.unit = larger(self.unit, λ * self.row_units[i]);
            let row = positive_or_one(self.row_units[i]);
            let relaxed = relaxed.get(i).copied().unwrap_or(0.0);
            let equality = program.is_equality(i);
            let beyond = if equality { g.abs() } else { g } - relaxed;
            self.primal = self.primal.max(beyond / row);
            if !equality {
                self.dual = self.dual.max(-λ * row);
            }
            if !equality || relaxed > 0.0 {
                self.complementarity = self.complementarity.max((λ * beyond).abs());
            }
        }
        // A constant objective with rows of zeros has no unit.
        let unit = positive_or_one(self.unit);
        KktResidual {
            stationarity: self.stationarity / unit,
            primal: self.primal,
            dual: self.dual / unit,
            complementarity: self.complementarity / unit,
        }
    }
}
