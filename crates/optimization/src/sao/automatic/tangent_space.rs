//! The tangent space of the active rows at a design, and the curvature of the Lagrangian on it as far as the steps of the run show it.
//!
//! All vectors are in lengths: components are divided by the lengths of the variables, and derivatives multiplied by them.

use super::candidates::AcceptedPoint;
use super::cycle_context::{CycleContext, SurrogateKind};
use super::numbers::find_number;
use super::quasi_newton::{SecantPair, sr1};
use nalgebra::{DMatrix, DVector};
use nlp::{orthogonal_part, orthonormal_basis};

/// Largest relative change of a slope between designs for which it counts as constant.
const CONSTANT: f64 = 0.5;
/// Largest norm of the part of a unit direction orthogonal to the steps, for which the steps determine the slope along it.
const DETERMINED: f64 = 0.5;
/// Distance from a bound in lengths within which a variable with a slope towards the bound is not free.
const NEAR_BOUND: f64 = 1e-6;
/// Least norm of the part of a direction orthogonal to others, relative to the direction, for which it is linearly independent of them.
pub(super) const INDEPENDENT: f64 = 1e-2;
/// Fraction of a length, and of the largest change of a row over the lengths, that counts as zero.
pub(super) const NO_EFFECT: f64 = 1e-6;
/// Fraction of the Lagrangian, and of its largest curvature, that counts as rounding.
pub(super) const ROUNDING: f64 = 1e-12;
/// Largest error of the trapezoidal rule along a step, relative to the change by the difference of the slopes at its ends, for which the
/// curvature along the step represents that at its ends. If the curvature changes linearly, an error of a third means that it is zero at
/// one end.
const LOCAL: f64 = 0.3;
/// Fraction of a length from which on a step of a variable counts as long.
const LONG: f64 = 0.9;
/// Least positive curvature, relative to the largest one.
pub(super) const FLAT: f64 = 1e-6;
/// Positive curvature, relative to the largest entry of a quasi-Newton matrix, up to which it is uncertain.
const UNCERTAIN: f64 = 1e-3;
/// Least magnitude of a negative curvature of an equilibrated matrix.
const NEGATIVE: f64 = 0.1;
/// Number of sweeps of equilibration: each halves the orders of magnitude between the rows.
const SWEEPS: usize = 12;

/// The directions in which a design can move to first order.
pub(super) struct TangentSpace<'a> {
    pub context: &'a CycleContext<'a>,
    /// The gradient of the Lagrangian with least-squares multipliers of the active rows.
    gradient: Vec<f64>,
    /// Weight of each number in the Lagrangian.
    weights: Vec<f64>,
    /// The Hessian of the functions in the Lagrangian that are given directly.
    explicit_hessian: DMatrix<f64>,
    /// Negligible change of the objective over a length.
    pub negligible: f64,
    /// Orthonormal basis of the gradients of the active rows over the free variables.
    pub active: Vec<DVector<f64>>,
    /// That of the equalities and the strongly active rows, on whose limits the Lagrangian depends. Weakly active rows may become inactive.
    pub strongly_active: Vec<DVector<f64>>,
}

impl<'a> TangentSpace<'a> {
    /// The tangent space at the current design; changes of the objective up to `negligible` are ignored.
    pub fn new(context: &'a CycleContext<'a>, negligible: f64) -> Self {
        let (design, lengths, here) = (&context.state.design, &context.units.lengths, &context.linearized);
        let multipliers = here.least_squares_multipliers(context.problem, design, lengths);
        let gradient = here.lagrangian_gradient(&multipliers);
        let weights = context.lagrangian_weights(&multipliers);
        let linear = context.surrogate(SurrogateKind::Linear).expect("only the Lagrangian may be missing");
        let hessian = linear.lagrangian_hessian(design, &multipliers);
        let scaled = |i: usize, j: usize| hessian[(i, j)] * lengths[i] * lengths[j];
        let explicit_hessian = DMatrix::from_fn(design.len(), design.len(), scaled);
        let (active, strongly_active) = (vec![], vec![]);
        let mut space = Self { context, gradient, weights, explicit_hessian, negligible, active, strongly_active };
        let is_strongly_active =
            |i: &usize| here.equality[*i] || multipliers[*i] * space.row_gradient(*i).amax() > negligible;
        let active = || (0..here.c.len()).filter(|&i| here.is_active(i, lengths));
        let strongly_active = orthonormal(active().filter(is_strongly_active).map(|i| space.row_gradient(i)));
        (space.active, space.strongly_active) = (orthonormal(active().map(|i| space.row_gradient(i))), strongly_active);
        space
    }

    /// True for a variable that is not held at a bound by its slope. If the slope is negligible, the curvature decides whether the
    /// variable leaves its bound.
    fn is_free(&self, j: usize) -> bool {
        let (variable, value) = (&self.context.problem.variables[j], self.context.state.design[j]);
        let (length, [below, above]) =
            (self.context.units.lengths[j], [value - variable.lower, variable.upper - value]);
        let distance = match self.gradient[j] * length {
            change if change.abs() <= self.negligible => below.max(above),
            change if change > 0.0 => below,
            _ => above,
        };
        distance > NEAR_BOUND * length
    }

    /// The bound of a variable that is not at it, but within this distance in lengths, and up to which its slope changes the Lagrangian by no
    /// more than `change`.
    pub fn near_bound(&self, j: usize, distance: f64, change: f64) -> Option<f64> {
        let (variable, value) = (&self.context.problem.variables[j], self.context.state.design[j]);
        let is_near = |bound: &f64| {
            let step = (bound - value).abs();
            step <= distance * self.context.units.lengths[j] && (self.gradient[j] * step).abs() <= change
        };
        [variable.lower, variable.upper].into_iter().find(is_near)
    }

    /// A vector with these components for the free variables, and zeros for the others.
    fn of_free_variables(&self, component: impl Fn(usize) -> f64) -> DVector<f64> {
        DVector::from_fn(self.context.n(), |j, _| if self.is_free(j) { component(j) } else { 0.0 })
    }

    /// ∂cᵢ/∂b over the free variables.
    fn row_gradient(&self, i: usize) -> DVector<f64> {
        let CycleContext { linearized, units, .. } = self.context;
        self.of_free_variables(|j| linearized.jacobian[(i, j)] * units.lengths[j])
    }

    /// An orthonormal basis of the directions along the strongly active rows.
    pub fn basis(&self) -> Vec<DVector<f64>> {
        let n = self.context.n();
        let unit = |j: usize| DVector::from_fn(n, |i, _| if i == j { 1.0 } else { 0.0 });
        let free = (0..n).filter(|&j| self.is_free(j)).map(unit);
        let mut all = orthonormal(self.strongly_active.iter().cloned().chain(free));
        all.split_off(self.strongly_active.len())
    }

    /// −∂L/∂b, projected onto the tangent space of the active rows.
    pub fn projected_descent(&self) -> DVector<f64> {
        orthogonal_part(&self.of_free_variables(|j| -self.gradient[j] * self.context.units.lengths[j]), &self.active)
    }

    /// True if no number has a weight in the Lagrangian: all its functions are given directly, and its Hessian is known.
    pub fn has_known_hessian(&self) -> bool {
        self.weights.iter().all(|w| *w == 0.0)
    }

    /// An orthonormal basis of the steps of the run without their components along the orthonormal `normals`; if `are_local`, only of
    /// those along which the curvature represents that at the design.
    pub fn step_directions(&self, normals: &[DVector<f64>], are_local: bool) -> Vec<DVector<f64>> {
        let points = &self.context.memory.points;
        let is_meant = |ends: &&[AcceptedPoint]| !are_local || self.shows_local_curvature([&ends[0], &ends[1]]);
        let tangential = |step: DVector<f64>| {
            let rest = orthogonal_part(&step, normals);
            (has_effect(&step) && rest.norm() > INDEPENDENT * step.norm()).then_some(rest)
        };
        let step = |ends: &[AcceptedPoint]| self.step_between([&ends[0], &ends[1]]);
        orthonormal(points.windows(2).filter(is_meant).map(step).filter_map(tangential))
    }

    /// The unit vectors from the current design to its last `count` trial designs, if the curvature along them represents that at the design, and
    /// to those from which the run has come back.
    pub fn tried_directions(&self, count: usize) -> Vec<DVector<f64>> {
        let (points, here) = (&self.context.memory.points, self.context.current());
        let first = (points.len() - 1).saturating_sub(count);
        let is_meant = |(k, to): &(usize, &AcceptedPoint)| {
            to.is_displaced || (*k >= first && self.shows_local_curvature([to, here]))
        };
        let steps = points.iter().enumerate().filter(is_meant).map(|(_, to)| self.step_between([here, to]));
        steps.filter(has_effect).map(|step| step.normalize()).collect()
    }

    /// The step between two designs over the free variables.
    fn step_between(&self, [from, to]: [&AcceptedPoint; 2]) -> DVector<f64> {
        let lengths = &self.context.units.lengths;
        self.of_free_variables(|j| (to.design[j] - from.design[j]) / lengths[j])
    }

    /// The steps of the run and the changes of ∂L/∂b along them.
    pub fn secant_pairs(&self) -> Vec<SecantPair> {
        let mut pairs = self.context.lagrangian_pairs(&self.weights);
        pairs.retain(|[step, _]| has_effect(step));
        pairs
    }

    /// The pairs of [`Self::secant_pairs`] along which the curvature represents that at the design.
    pub fn local_secant_pairs(&self) -> Vec<SecantPair> {
        let pairs = self.context.lagrangian_steps(&self.weights).into_iter();
        let steps = pairs.zip(self.context.memory.points.windows(2));
        let is_local = |([step, _], ends): &(SecantPair, &[AcceptedPoint])| {
            has_effect(step) && self.shows_local_curvature([&ends[0], &ends[1]])
        };
        steps.filter(is_local).map(|(pair, _)| pair).collect()
    }

    /// True for a step along which the curvature, if it changes linearly, has the same sign at both ends: the change of the Lagrangian
    /// agrees with its slopes at both ends, up to a fraction of the effect of their difference. False for a step that is long in
    /// several variables, along which other changes of the curvature can cancel out.
    pub fn shows_local_curvature(&self, ends: [&AcceptedPoint; 2]) -> bool {
        let lengths = &self.context.units.lengths;
        let is_long = |j: &usize| (ends[1].design[*j] - ends[0].design[*j]).abs() > LONG * lengths[*j];
        if (0..lengths.len()).filter(is_long).count() > 1 {
            return false;
        }
        let (problem, numbers) = (self.context.problem, &self.context.current().numbers);
        let along = |gradient: &[f64]| -> f64 {
            gradient.iter().zip(ends[1].design.iter().zip(&ends[0].design)).map(|(g, (to, from))| g * (to - from)).sum()
        };
        let [mut error, mut by_curvature, mut rounding] = [0.0; 3];
        for (number, weight) in numbers.iter().zip(&self.weights) {
            let [from, to] = [0, 1].map(|k| find_number(problem, &ends[k].numbers, number.id));
            let (Some(from), Some(to)) = (from, to) else { continue };
            let [first, second] = [from, to].map(|number| along(&number.gradient));
            error += weight * (to.value - from.value - 0.5 * (first + second));
            by_curvature += weight * 0.5 * (second - first);
            rounding += ROUNDING * weight.abs() * (from.value.abs() + to.value.abs());
        }
        error.abs() <= LOCAL * by_curvature.abs() + rounding
    }

    /// True if steps along a direction have hardly changed the slope along it. The lengths then do not limit the step along it.
    pub fn has_constant_slope(&self, direction: &DVector<f64>, slope: f64) -> bool {
        let mut change = 0.0;
        let steps = self.step_directions(&self.strongly_active, false);
        let is_determined = orthogonal_part(direction, &steps).norm() < DETERMINED;
        is_determined
            && self.secant_pairs().iter().rev().all(|[_, of_gradient]| {
                change += of_gradient.dot(direction);
                change.abs() < CONSTANT * slope.abs()
            })
    }

    /// The Hessian of the Lagrangian on orthonormal directions that the steps have determined, and the largest entry of the whole Hessian.
    /// `None` before a step that determines a curvature.
    fn reduced_hessian(&self, directions: &[DVector<f64>], pairs: &[SecantPair]) -> Option<(DMatrix<f64>, f64)> {
        let n = self.context.n();
        let of_numbers = if self.has_known_hessian() { Some(DMatrix::zeros(n, n)) } else { sr1(pairs) };
        let hessian = of_numbers.filter(|_| !directions.is_empty())? + &self.explicit_hessian;
        let sizes = hessian.abs();
        let between = |i: usize, k: usize| {
            let rounding = ROUNDING * directions[i].abs().dot(&(&sizes * directions[k].abs()));
            Some(directions[i].dot(&(&hessian * &directions[k]))).filter(|c| c.abs() > rounding).unwrap_or(0.0)
        };
        Some((DMatrix::from_fn(directions.len(), directions.len(), between), sizes.amax()))
    }

    /// The combinations of orthonormal directions in which no step has shown a positive curvature.
    pub fn nonpositive_curvature(
        &self,
        directions: &[DVector<f64>],
        pairs: &[SecantPair],
    ) -> Option<NonpositiveCurvature> {
        let (hessian, scale) = self.reduced_hessian(directions, pairs)?;
        let equilibrated = equilibrated_negative_curvature(&hessian)
            .map(|(weights, curvature)| (linear_combination(directions, weights.iter().copied()), curvature));
        let eigen = hessian.symmetric_eigen();
        // At a horizontal point of inflection all curvatures may vanish.
        let largest = eigen.eigenvalues.amax().max(FLAT * self.context.units.objective_range);
        let positive = (FLAT * largest).max(self.negligible);
        let mut found: Vec<usize> = (0..directions.len()).filter(|&k| eigen.eigenvalues[k] <= positive).collect();
        found.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let has_negative = found.first().is_some_and(|&k| eigen.eigenvalues[k] < -positive);
        let is_uncertain = |k: &usize| {
            let curvature = eigen.eigenvalues[*k];
            !self.has_known_hessian() && curvature > positive && curvature <= UNCERTAIN * scale
        };
        let uncertain: Vec<usize> = (0..directions.len()).filter(is_uncertain).collect();
        let direction = |k: usize| linear_combination(directions, eigen.eigenvectors.column(k).iter().copied());
        let equilibrated = equilibrated.filter(|_| !has_negative);
        Some(NonpositiveCurvature {
            directions: found.into_iter().map(direction).collect(),
            uncertain: uncertain.into_iter().map(direction).collect(),
            has_negative,
            equilibrated,
        })
    }

    /// The violation of weakly active rows by a step along a direction, divided by the first-order changes of the rows.
    pub fn weakly_active_violation(&self, direction: &DVector<f64>) -> f64 {
        let CycleContext { linearized, units, .. } = self.context;
        let change = |gradient: DVector<f64>| {
            let tangential = orthogonal_part(&gradient, &self.strongly_active);
            tangential.dot(direction) / gradient.norm().max(f64::MIN_POSITIVE)
        };
        let is_active = |i: &usize| !linearized.equality[*i] && linearized.is_active(*i, &units.lengths);
        let active = (0..linearized.c.len()).filter(is_active);
        active.map(|i| change(self.row_gradient(i)).max(0.0)).sum()
    }
}

/// Directions in which no step has shown a positive curvature.
pub(super) struct NonpositiveCurvature {
    /// The least curvature first.
    pub directions: Vec<DVector<f64>>,
    /// Directions of positive curvatures that are small compared with the largest entry of the Hessian.
    pub uncertain: Vec<DVector<f64>>,
    /// True if the least curvature is negative.
    pub has_negative: bool,
    /// A direction of negative curvature that only the equilibrated matrix shows, and its curvature over the lengths, where it is
    /// negligible: the length of a variable that was at a point of symmetry is meaningless.
    pub equilibrated: Option<(DVector<f64>, f64)>,
}

/// A direction of negative curvature of a symmetric matrix after equilibration, and this curvature in the units of the given matrix;
/// `None` if there is none. Equilibration makes the largest entry of each row 1, so that the result does not depend on lengths.
///
/// # Sources
///
/// Ruiz, *A scaling algorithm to equilibrate both rows and columns norms in matrices*, report RAL-TR-2001-034 (2001).
fn equilibrated_negative_curvature(hessian: &DMatrix<f64>) -> Option<(DVector<f64>, f64)> {
    let (r, mut scaled) = (hessian.nrows(), hessian.clone());
    let mut units = DVector::from_element(r, 1.0);
    for _ in 0..SWEEPS {
        let largest = |k: usize| Some(scaled.row(k).amax()).filter(|largest| *largest > 0.0);
        let factors: Vec<f64> = (0..r).map(|k| largest(k).map_or(1.0, |largest| 1.0 / largest.sqrt())).collect();
        units.iter_mut().zip(&factors).for_each(|(unit, factor)| *unit *= factor);
        scaled = DMatrix::from_fn(r, r, |i, k| scaled[(i, k)] * factors[i] * factors[k]);
    }
    let eigen = scaled.symmetric_eigen();
    let (least, curvature) = eigen.eigenvalues.argmin();
    let weights = eigen.eigenvectors.column(least).component_mul(&units);
    let norm = weights.norm();
    (curvature < -NEGATIVE && norm > 0.0 && norm.is_finite()).then(|| (weights / norm, curvature / norm.powi(2)))
}

/// Σ wₖ vₖ, for at least one vector.
pub(super) fn linear_combination(vectors: &[DVector<f64>], weights: impl Iterator<Item = f64>) -> DVector<f64> {
    vectors.iter().zip(weights).fold(DVector::zeros(vectors[0].len()), |sum, (v, weight)| sum + v * weight)
}

/// The direction, with components along the steps of the pairs added so that it is conjugate to them: yᵀd = 0 for the change y of the
/// gradient along each step.
pub(super) fn conjugate(direction: &DVector<f64>, pairs: &[SecantPair]) -> DVector<f64> {
    if pairs.is_empty() {
        return direction.clone();
    }
    let known = DMatrix::from_fn(pairs.len(), pairs.len(), |i, k| pairs[i][1].dot(&pairs[k][0]));
    let along = DVector::from_fn(pairs.len(), |i, _| pairs[i][1].dot(direction));
    let svd = known.svd(true, true);
    let largest = svd.singular_values.amax();
    let weights =
        svd.solve(&along, INDEPENDENT * INDEPENDENT * largest).unwrap_or_else(|_| DVector::zeros(pairs.len()));
    let conjugate =
        pairs.iter().zip(weights.iter()).fold(direction.clone(), |rest, ([step, _], &weight)| rest - step * weight);
    // Steps along which the gradient has hardly changed have meaningless weights.
    if conjugate.norm() * INDEPENDENT > direction.norm() { direction.clone() } else { conjugate }
}

/// An orthonormal basis of the span of the vectors.
pub(super) fn orthonormal(vectors: impl Iterator<Item = DVector<f64>>) -> Vec<DVector<f64>> {
    orthonormal_basis(vectors, INDEPENDENT)
}

/// True for a step that is larger than rounding errors.
fn has_effect(step: &DVector<f64>) -> bool {
    step.amax() > NO_EFFECT
}
