//! The optimality conditions of Karush, Kuhn and Tucker, checked apart from every solver.

use super::{Solution, Status};
use crate::{Gradients, Program};
use error::Result;
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
        let mut survey = KktAccumulator::new(solution.multipliers.len());
        for (j, &at) in x.iter().enumerate() {
            let column = here.rows.column(j);
            let sides = VariableBounds::of((lower[j], upper[j]), at, start[j]);
            let first = first.map_or(0.0, |first| first[j]);
            let own = [solution.lower_multipliers[j], solution.upper_multipliers[j]];
            survey.add(&sides, [here.objective[j], first], column.as_slice(), &solution.multipliers, |_| own);
        }
        survey.finish(program, &here.values.rows, &solution.multipliers, &solution.relaxed_rows)
    }

    /// The largest of the four; NaN if one of them is.
    pub fn largest(&self) -> f64 {
        largest([self.stationarity, self.primal, self.dual, self.complementarity].into_iter())
    }
}

/// Largest absolute value; NaN is kept.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, larger)
}

fn larger(a: f64, v: f64) -> f64 {
    if a.is_nan() || v.is_nan() { f64::NAN } else { a.max(v.abs()) }
}

/// A variable between its bounds.
pub(super) struct VariableBounds {
    x: f64,
    lower: f64,
    upper: f64,
    scale: f64,
}

impl VariableBounds {
    pub fn of((lower, upper): (f64, f64), x: f64, start: f64) -> Self {
        Self { x, lower, upper, scale: variable_scale(lower, upper, start, x) }
    }

    /// The multipliers of the bounds that a slope of the Lagrangian asks for, none off the bounds.
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

/// What the variables contribute to a [`KktResidual`], taken in one by one; the formulas are those given there.
#[derive(Clone, Debug)]
pub(super) struct KktAccumulator {
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

    /// Takes in a variable with the slopes of the objective at the point and at the start, and those of the rows; `price`
    /// gives the multipliers of its bounds from the slope of f + Σ λᵢ gᵢ, which are returned.
    pub fn add(
        &mut self,
        at: &VariableBounds,
        objective: [f64; 2],
        rows: &[f64],
        λ: &[f64],
        price: impl Fn(f64) -> [f64; 2],
    ) -> [f64; 2] {
        let mut slope = objective[0];
        for ((unit, λ), g) in self.row_units.iter_mut().zip(λ).zip(rows) {
            slope += λ * g;
            *unit = unit.max((at.scale * g).abs());
        }
        let [l, u] = price(slope);
        self.unit = larger(larger(self.unit, at.scale * objective[0]), at.scale * objective[1]);
        self.stationarity = larger(self.stationarity, at.scale * (slope + u - l));
        self.primal = self.primal.max((at.lower - at.x).max(at.x - at.upper) / at.scale);
        self.dual = self.dual.max(-l.min(u) * at.scale);
        let product = |μ: f64, gap: f64| if μ == 0.0 { 0.0 } else { (μ * gap).abs() };
        self.complementarity = self.complementarity.max(product(l, at.x - at.lower)).max(product(u, at.upper - at.x));
        [l, u]
    }

    /// Takes in other variables.
    pub fn join(&mut self, other: &Self) {
        self.row_units.iter_mut().zip(&other.row_units).for_each(|(a, b)| *a = a.max(*b));
        self.unit = larger(self.unit, other.unit);
        self.stationarity = larger(self.stationarity, other.stationarity);
        self.primal = self.primal.max(other.primal);
        self.dual = self.dual.max(other.dual);
        self.complementarity = self.complementarity.max(other.complementarity);
    }

    /// The residual, with the rows and by how much each is relaxed.
    pub fn finish(mut self, program: &dyn Program, rows: &[f64], λ: &[f64], relaxed: &[f64]) -> KktResidual {
        for (i, (&g, &λ)) in rows.iter().zip(λ).enumerate() {
            self.unit = larger(self.unit, λ * self.row_units[i]);
            let row = if self.row_units[i] > 0.0 { self.row_units[i] } else { 1.0 };
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
        // A constant objective and rows of zeros have no unit.
        let unit = if self.unit > 0.0 { self.unit } else { 1.0 };
        KktResidual {
            stationarity: self.stationarity / unit,
            primal: self.primal,
            dual: self.dual / unit,
            complementarity: self.complementarity / unit,
        }
    }
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
