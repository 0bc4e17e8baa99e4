//! The candidate approximations of one number, all exact in value and gradient at the current design.

use super::linearized::Linearized;
use super::numbers::{
    ApproximatedValue, NumberId, collect_numbers, find_number, gradient_in_design, gradient_in_intermediates,
    values_and_jacobian, weighted_hessian,
};
use super::quasi_newton::{SecantPair, bfgs, sr1};
use crate::approximation::CycleData;
use crate::problem::{Evaluation, Intermediates, Problem, Responses};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// A candidate approximation of a number r in its intermediate variables y (the design variables, unless given):
///
/// $$ \tilde r = r + \sum_j G_j φ_j(y_j) + \tfrac12 s^T B s ,\qquad
///    φ_j = \frac{y_j}{p_j} \Bigl[ \Bigl(\frac{y_j'}{y_j}\Bigr)^{p_j} - 1 \Bigr] . $$
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ApproximationKind {
    /// p = 1, B = 0.
    Linear,
    /// p = 1 and a diagonal B from the last two gradients.
    Diagonal,
    /// Two-point exponents in [−3, 3], B = 0.
    Power,
    /// p = 1 and B by BFGS updates.
    Bfgs,
    /// p = 1 and B by symmetric rank-one updates.
    Sr1,
    /// Two-point exponents, and B so that the Hessian at the current design is that of [`ApproximationKind::Sr1`].
    Sr1Power,
}

/// Limit of the exponents.
const EXPONENT: f64 = 3.0;
/// Least ratio x′/x of a variable to its present value for which a power is used.
const LEAST_RATIO: f64 = 0.1;
/// Change of a variable, relative to the largest one in lengths, below which it does not determine its curvature.
const UNCHANGED: f64 = 1e-3;
/// Largest curvature of a variable, in units of the largest change of the gradient over the largest step.
const STEEPEST: f64 = 10.0;

impl ApproximationKind {
    /// All candidates.
    pub const ALL: [Self; 6] = [Self::Linear, Self::Diagonal, Self::Power, Self::Bfgs, Self::Sr1, Self::Sr1Power];
}

/// An accepted design with its numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AcceptedPoint {
    /// Design.
    pub design: Vec<f64>,
    /// Numbers that were differentiated there, sorted.
    pub numbers: Vec<ApproximatedValue>,
    /// For each constraint the largest |∂ĝ/∂b| of its retained rows, for each variable.
    pub slopes: Vec<Vec<f64>>,
    /// True if the run was displaced to this design, without regard to its objective.
    #[serde(default)]
    pub is_displaced: bool,
}

impl AcceptedPoint {
    /// A design with its responses and evaluation, whose retained rows are differentiated.
    pub(in crate::sao) fn new(problem: &Problem, at: (&[f64], &Responses, &Evaluation), data: &CycleData) -> Self {
        let (design, responses, evaluation) = at;
        let slopes = Linearized::new(problem, at, data).largest_derivatives(problem.constraints.len());
        let numbers = collect_numbers(problem, design, (responses, evaluation), data);
        Self { design: design.to_vec(), numbers, slopes, is_displaced: false }
    }
}

enum FittedCurvature {
    None,
    Diagonal(Vec<f64>),
    Full(DMatrix<f64>),
}

/// A fitted candidate.
pub(super) struct FittedApproximation {
    value: f64,
    design: Vec<f64>,
    origin: Vec<f64>,
    slope: Vec<f64>,
    exponents: Option<Vec<f64>>,
    curvature: FittedCurvature,
    map: Intermediates,
    /// Terms ω (m · s)².
    corrections: Vec<(f64, Vec<f64>)>,
}

/// One number at all stored designs, in its intermediate variables.
pub(super) struct Samples<'a> {
    problem: &'a Problem,
    pub number: &'a ApproximatedValue,
    map: &'a Intermediates,
    design: &'a [f64],
    origin: Vec<f64>,
    slope: Vec<f64>,
    /// Lengths of the intermediate variables.
    lengths: Vec<f64>,
    /// (y, ∂r/∂y) of the number, or of its neighbour in time if it has none, at earlier designs, the oldest first.
    earlier: Vec<(Vec<f64>, Vec<f64>)>,
    /// ∂r/∂y of the same number at the current design.
    latest: Vec<f64>,
}

/// The number, or the one of the same response at the nearest time point that was also differentiated at the last design.
fn with_history<'a>(
    problem: &Problem,
    points: &'a [AcceptedPoint],
    number: &'a ApproximatedValue,
) -> &'a ApproximatedValue {
    let (Some((here, [.., before])), NumberId::Response(at)) = (points.split_last(), number.id) else { return number };
    let is_known = |id| find_number(problem, &before.numbers, id).is_some();
    if is_known(number.id) {
        return number;
    }
    let distance = |other: &ApproximatedValue| match other.id {
        NumberId::Response(o) if o.response == at.response => Some(o.point.abs_diff(at.point)),
        _ => None,
    };
    let near = here.numbers.iter().filter_map(|other| Some((distance(other)?, other)));
    near.filter(|(_, other)| is_known(other.id)).min_by_key(|(d, _)| *d).map_or(number, |(_, other)| other)
}

impl<'a> Samples<'a> {
    /// The samples of number `k` of the last of `points`.
    pub fn new(problem: &'a Problem, points: &'a [AcceptedPoint], k: usize, lengths: &[f64]) -> Self {
        const IDENTITY: &Intermediates = &Intermediates::Identity;
        let (here, before) = points.split_last().expect("the current design is stored");
        let number = &here.numbers[k];
        let declared = number.id.intermediates(problem);
        let (y, rows) = values_and_jacobian(declared, &here.design);
        // Singular intermediate variables cannot be used; the design variables themselves always can.
        let usable = gradient_in_intermediates(&rows, &number.gradient).filter(|_| y.iter().all(|v| v.is_finite()));
        let (map, origin, slope, rows) = match usable {
            Some(slope) => (declared, y, slope, rows),
            None => (IDENTITY, here.design.clone(), number.gradient.clone(), None),
        };
        let length = |j: usize| match &rows {
            None => lengths[j],
            Some(rows) => rows.row(j).iter().zip(lengths).map(|(v, l)| v.abs() * l).sum(),
        };
        let lengths = (0..lengths.len()).map(length).collect();
        let known = with_history(problem, points, number);
        let latest = gradient_in_intermediates(&rows, &known.gradient).unwrap_or_else(|| slope.clone());
        let earlier = |point: &AcceptedPoint| {
            let found = find_number(problem, &point.numbers, known.id)?;
            let (y, rows) = values_and_jacobian(map, &point.design);
            Some((y, gradient_in_intermediates(&rows, &found.gradient)?))
        };
        let earlier = before.iter().filter_map(earlier).collect();
        Self { problem, number, map, design: &here.design, origin, slope, lengths, earlier, latest }
    }

    /// Steps and changes of the gradient in lengths, the oldest first.
    fn pairs(&self) -> Vec<SecantPair> {
        let n = self.lengths.len();
        let here = (&self.origin, &self.latest);
        let all: Vec<_> = self.earlier.iter().map(|(y, g)| (y, g)).chain([here]).collect();
        let pair = |w: &[(&Vec<f64>, &Vec<f64>)]| -> SecantPair {
            let step = DVector::from_fn(n, |j, _| (w[1].0[j] - w[0].0[j]) / self.lengths[j]);
            [step, DVector::from_fn(n, |j, _| (w[1].1[j] - w[0].1[j]) * self.lengths[j])]
        };
        all.windows(2).map(pair).filter(|[s, _]| s.norm_squared() > 0.0).collect()
    }

    fn unscaled(&self, b: DMatrix<f64>) -> DMatrix<f64> {
        DMatrix::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] / self.lengths[i] / self.lengths[j])
    }

    /// The fitted candidate; `None` if the stored designs do not determine it.
    pub fn fit(&self, candidate: ApproximationKind) -> Option<FittedApproximation> {
        let (mut exponents, mut curvature) = (None, FittedCurvature::None);
        match candidate {
            ApproximationKind::Linear => {}
            ApproximationKind::Diagonal => curvature = FittedCurvature::Diagonal(self.diagonal()?),
            ApproximationKind::Power => exponents = Some(self.exponents()?),
            ApproximationKind::Bfgs => curvature = FittedCurvature::Full(self.unscaled(bfgs(&self.pairs())?)),
            ApproximationKind::Sr1 => curvature = FittedCurvature::Full(self.unscaled(sr1(&self.pairs())?)),
            ApproximationKind::Sr1Power => {
                let p = self.exponents()?;
                let mut b = self.unscaled(sr1(&self.pairs())?);
                for j in (0..p.len()).filter(|&j| p[j] != 1.0) {
                    b[(j, j)] -= self.slope[j] * (p[j] - 1.0) / self.origin[j];
                }
                (exponents, curvature) = (Some(p), FittedCurvature::Full(b));
            }
        }
        Some(FittedApproximation {
            value: self.number.value,
            design: self.design.to_vec(),
            origin: self.origin.clone(),
            slope: self.slope.clone(),
            exponents,
            curvature,
            map: self.map.clone(),
            corrections: vec![],
        })
    }

    fn diagonal(&self) -> Option<Vec<f64>> {
        let pairs = self.pairs();
        let [s, y] = pairs.last()?;
        let mean = s.dot(y) / s.norm_squared();
        let cap = STEEPEST * y.amax() / s.amax();
        let one = |j: usize| {
            let scaled = if s[j].abs() < UNCHANGED * s.amax() { mean } else { y[j] / s[j] };
            scaled.clamp(-cap, cap) / (self.lengths[j] * self.lengths[j])
        };
        Some((0..s.len()).map(one).collect())
    }

    /// Two-point exponents of the design variables; `None` if no variable has one.
    fn exponents(&self) -> Option<Vec<f64>> {
        if !matches!(self.map, Intermediates::Identity) {
            return None;
        }
        let before = self.earlier.last();
        let one = |j: usize| {
            let (x, g) = (self.origin[j], self.slope[j]);
            if !(self.problem.variables[j].lower >= 0.0 && x > 1e-3 * self.lengths[j]) || g == 0.0 {
                return 1.0;
            }
            let found = before.and_then(|(y, slope)| {
                let ratio = slope[j] / self.latest[j];
                let p = 1.0 + ratio.ln() / (y[j] / x).ln();
                (ratio > 0.0 && y[j] > 0.0 && p.is_finite()).then_some(p.clamp(-EXPONENT, EXPONENT))
            });
            found.unwrap_or(if g < 0.0 { -1.0 } else { 1.0 })
        };
        let exponents: Vec<f64> = (0..self.origin.len()).map(one).collect();
        exponents.iter().any(|p| *p != 1.0).then_some(exponents)
    }
}

impl FittedApproximation {
    /// Adds the quadratic along the step to `design` that gives the model this `value` there.
    pub fn correct(&mut self, design: &[f64], value: f64, lengths: &[f64]) {
        let error = value - self.value(design);
        let m: Vec<f64> =
            (0..lengths.len()).map(|j| (design[j] - self.design[j]) / (lengths[j] * lengths[j])).collect();
        let size: f64 = m.iter().zip(design.iter().zip(&self.design)).map(|(m, (x, o))| m * (x - o)).sum();
        let weight = error / (size * size);
        if weight.is_finite() {
            self.corrections.push((weight, m));
        }
    }

    /// Lower bound of the domain of variable `j`; −∞ if there is none.
    pub fn lower(&self, j: usize) -> f64 {
        match &self.exponents {
            Some(p) if p[j] != 1.0 => LEAST_RATIO * self.origin[j],
            _ => f64::NEG_INFINITY,
        }
    }

    /// True if design `b` is in the domain of the model.
    pub fn is_defined(&self, b: &[f64]) -> bool {
        (0..b.len()).all(|j| b[j] >= self.lower(j) * (1.0 - 1e-9))
    }

    /// True for a linear function of the design variables.
    pub fn is_linear(&self) -> bool {
        let curved = match &self.curvature {
            FittedCurvature::None => false,
            FittedCurvature::Diagonal(d) => d.iter().any(|v| *v != 0.0),
            FittedCurvature::Full(b) => b.iter().any(|v| *v != 0.0),
        };
        !curved
            && self.exponents.is_none()
            && self.corrections.is_empty()
            && matches!(self.map, Intermediates::Identity)
    }

    fn exponent(&self, j: usize) -> f64 {
        self.exponents.as_ref().map_or(1.0, |p| p[j])
    }

    /// φ, φ′ and φ″ of variable `j` at `y`.
    fn term(&self, j: usize, y: f64) -> [f64; 3] {
        let (x, p) = (self.origin[j], self.exponent(j));
        if p == 1.0 {
            return [y - x, 1.0, 0.0];
        }
        let ratio = (y / x).max(1e-3);
        let value = if p.abs() < 1e-12 { x * ratio.ln() } else { x / p * (ratio.powf(p) - 1.0) };
        [value, ratio.powf(p - 1.0), (p - 1.0) / x * ratio.powf(p - 2.0)]
    }

    fn step(&self, y: &[f64]) -> DVector<f64> {
        DVector::from_fn(y.len(), |j, _| y[j] - self.origin[j])
    }

    fn curved(&self, s: &DVector<f64>) -> DVector<f64> {
        match &self.curvature {
            FittedCurvature::None => DVector::zeros(s.len()),
            FittedCurvature::Diagonal(d) => DVector::from_fn(s.len(), |j, _| d[j] * s[j]),
            FittedCurvature::Full(b) => b * s,
        }
    }

    fn along(&self, m: &[f64], b: &[f64]) -> f64 {
        (0..b.len()).map(|j| m[j] * (b[j] - self.design[j])).sum()
    }

    /// The value at design `b`.
    pub fn value(&self, b: &[f64]) -> f64 {
        let y = intermediate_values(&self.map, b);
        let s = self.step(&y);
        let linear: f64 = (0..y.len()).map(|j| self.slope[j] * self.term(j, y[j])[0]).sum();
        let correction: f64 = self.corrections.iter().map(|(w, m)| w * self.along(m, b).powi(2)).sum();
        self.value + linear + 0.5 * s.dot(&self.curved(&s)) + correction
    }

    fn slope_in_y(&self, y: &[f64]) -> Vec<f64> {
        let curved = self.curved(&self.step(y));
        (0..y.len()).map(|j| self.slope[j] * self.term(j, y[j])[1] + curved[j]).collect()
    }

    /// The gradient at design `b`.
    pub fn gradient(&self, b: &[f64]) -> Vec<f64> {
        let (y, rows) = values_and_jacobian(&self.map, b);
        let mut gradient = gradient_in_design(&rows, self.slope_in_y(&y));
        for (w, m) in &self.corrections {
            let factor = 2.0 * w * self.along(m, b);
            gradient.iter_mut().zip(m).for_each(|(g, m)| *g += factor * m);
        }
        gradient
    }

    /// Adds `weight` times the Hessian at design `b` to `sum`.
    pub fn add_hessian(&self, b: &[f64], weight: f64, sum: &mut DMatrix<f64>) {
        let (y, rows) = values_and_jacobian(&self.map, b);
        let n = b.len();
        if let Some(rows) = rows {
            let mut inner = DMatrix::zeros(n, n);
            self.add_hessian_in_y(&y, 1.0, &mut inner);
            let whole = rows.tr_mul(&(inner * &rows)) + weighted_hessian(&self.map, &self.slope_in_y(&y), b);
            *sum += whole * weight;
        } else {
            self.add_hessian_in_y(&y, weight, sum);
        }
        for (w, m) in &self.corrections {
            let m = DVector::from_column_slice(m);
            sum.ger(2.0 * w * weight, &m, &m, 1.0);
        }
    }

    fn add_hessian_in_y(&self, y: &[f64], weight: f64, sum: &mut DMatrix<f64>) {
        match &self.curvature {
            FittedCurvature::None => {}
            FittedCurvature::Diagonal(d) => (0..y.len()).for_each(|j| sum[(j, j)] += weight * d[j]),
            FittedCurvature::Full(b) => sum.zip_apply(b, |s, b| *s += weight * b),
        }
        if self.exponents.is_some() {
            (0..y.len()).for_each(|j| sum[(j, j)] += weight * self.slope[j] * self.term(j, y[j])[2]);
        }
    }
}

fn intermediate_values(map: &Intermediates, b: &[f64]) -> Vec<f64> {
    match map {
        Intermediates::Identity => b.to_vec(),
        other => (0..b.len()).map(|k| other.component(k, b)).collect(),
    }
}

/// (∂y/∂b)ᵀ Δ(∂r/∂y) of a number along each step between consecutive `points`; `None` for a step at one of whose ends neither
/// the number nor its neighbour in time was differentiated.
pub(super) fn gradient_changes(
    problem: &Problem,
    points: &[AcceptedPoint],
    number: &ApproximatedValue,
) -> Vec<Option<Vec<f64>>> {
    let id = with_history(problem, points, number).id;
    let map = id.intermediates(problem);
    let slope = |point: &AcceptedPoint| {
        let number = find_number(problem, &point.numbers, id)?;
        let (_, rows) = values_and_jacobian(map, &point.design);
        Some((gradient_in_intermediates(&rows, &number.gradient)?, rows))
    };
    let slopes: Vec<_> = points.iter().map(slope).collect();
    let steps = slopes.iter().zip(slopes.iter().skip(1));
    steps
        .map(|(from, to)| {
            let ((from, _), (to, rows)) = (from.as_ref()?, to.as_ref()?);
            Some(gradient_in_design(rows, to.iter().zip(from).map(|(a, b)| a - b).collect()))
        })
        .collect()
}
