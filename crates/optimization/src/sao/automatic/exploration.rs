//! Steps in directions of unknown curvature, from a design that satisfies the first-order conditions.
//!
//! The conditions hold at saddle points and maxima, too. Two signs of these are a curvature of the Lagrangian on the
//! tangent space of the active rows that is not positive, and a tangent direction that no step had. The value of the Lagrangian next to
//! the design, in this direction, is computed before the run ends. If it is smaller, the run continues from there. If not, its gradient there
//! shows how this direction is coupled with others, as in the method of Lanczos for the least eigenvalue.

use super::candidates::AcceptedPoint;
use super::lengths::spread;
use super::numbers::find;
use super::proposal::{Proposal, Purpose};
use super::quasi_newton::{SecantPair, sr1};
use super::situation::{CycleContext, Kind};
use super::stationary::shortening;
use crate::problem::{AnalyzedDesign, RowId};
use crate::sao::Region;
use nalgebra::{DMatrix, DVector};
use nlp::{KktResidual, Solution, orthogonal_part, orthonormal_basis};

/// Displacement of variables on which no function has depended, step that determines a curvature, and step along a zero curvature, in lengths.
const DISPLACEMENT: f64 = 0.1;
const STEP: f64 = 0.01;
const FLAT_STEP: f64 = 0.5;
/// First-order decrease of the objective by such a step where there is a slope, as a multiple of the negligible change.
const MATTERS: f64 = 1e6;
/// Largest relative change of a slope between designs for which it counts as unchanged.
const STEADY: f64 = 0.5;
/// Largest number of steps of a run that show a curvature, and of those in directions that no step had.
const MOST_EXPLORATIONS: usize = 3;
const MOST_UNKNOWN: usize = 2;
/// Largest norm of the part of a unit direction orthogonal to the steps, up to which the steps determine the curvature along it.
const MOSTLY: f64 = 0.5;
/// Number of explorations from a design. A second design is explored if a flat direction led to it.
const ROUND: usize = MOST_EXPLORATIONS + 2;
/// Distance from a bound in lengths within which a variable with a slope towards the bound is not free.
const NEAR_BOUND: f64 = 1e-6;
/// Relative norm of the part of a direction orthogonal to others, from which on it counts as another direction.
const INDEPENDENT: f64 = 1e-2;
/// Fraction of a length, and of the largest change of a row over the lengths, that counts as zero.
const NO_EFFECT: f64 = 1e-6;
/// Fraction of the Lagrangian, and of its largest curvature, that counts as rounding.
const ROUNDING: f64 = 1e-12;
/// Error of the trapezoidal rule along a step, relative to the change by the difference of the slopes at its ends, up to which the
/// curvature along it is that of its ends. At a third, an even change of the curvature has made one of them zero.
const LOCAL: f64 = 0.3;
/// Fraction of a length from which on a step of a variable counts as long.
const LONG: f64 = 0.9;
/// Factor of the step in a direction in which the one before was too long to show the curvature.
const SHORTER: f64 = 0.01;
/// Least length of a step that determines a curvature, well above the length that counts as zero.
const SHORTEST: f64 = 10.0 * NO_EFFECT;
/// Least curvature relative to the largest one that counts as positive.
const FLAT: f64 = 1e-6;
/// Least magnitude of a negative curvature, in units in which the largest curvature of each variable is 1.
const NEGATIVE: f64 = 0.1;
/// Number of sweeps that bring the curvatures to these units: each halves their orders of magnitude.
const SWEEPS: usize = 12;

/// The directions in which a design can move to first order, in lengths.
struct TangentSpace<'a> {
    situation: &'a CycleContext<'a>,
    /// Multipliers of the active rows, and the slope of the Lagrangian with them.
    multipliers: Vec<f64>,
    slope: Vec<f64>,
    /// Weight of each number in the Lagrangian.
    weights: Vec<f64>,
    /// The Hessian of the functions in the Lagrangian that are given directly, in lengths.
    explicit: DMatrix<f64>,
    /// Negligible change of the objective over a length.
    negligible: f64,
    /// Orthonormal gradients of the active rows over the free variables.
    normals: Vec<DVector<f64>>,
    /// Those of the equalities and of the rows on which the Lagrangian depends. The others may become inactive.
    binding: Vec<DVector<f64>>,
}

impl<'a> TangentSpace<'a> {
    /// Changes of the objective up to `negligible` are ignored.
    fn new(situation: &'a CycleContext<'a>, negligible: f64) -> Self {
        let (design, lengths, here) = (&situation.state.design, &situation.units.lengths, &situation.here);
        let multipliers = here.balanced(situation.problem, design, lengths);
        let slope = here.lagrangian_slope(&multipliers);
        let weights = situation.lagrangian_weights(&multipliers);
        let linear = situation.surrogate(Kind::Linear).expect("only the Lagrangian may be missing");
        let explicit = linear.lagrangian_hessian(design, &multipliers);
        let explicit = DMatrix::from_fn(design.len(), design.len(), |i, j| explicit[(i, j)] * lengths[i] * lengths[j]);
        let (normals, binding) = (vec![], vec![]);
        let mut tangent = Self { situation, multipliers, slope, weights, explicit, negligible, normals, binding };
        let gradient = |i: usize| tangent.free(|j| here.jacobian[(i, j)] * lengths[j]);
        let is_binding = |i: &usize| here.equality[*i] || tangent.multipliers[*i] * gradient(*i).amax() > negligible;
        let active = || (0..here.c.len()).filter(|&i| here.is_active(i, lengths));
        let binding = basis(active().filter(is_binding).map(gradient));
        (tangent.normals, tangent.binding) = (basis(active().map(gradient)), binding);
        tangent
    }

    /// True for a variable that is not held at a bound by its slope. If the slope is negligible, the curvature decides whether the
    /// variable leaves its bound.
    fn is_free(&self, j: usize) -> bool {
        let (variable, here) = (&self.situation.problem.variables[j], self.situation.state.design[j]);
        let (length, [below, above]) =
            (self.situation.units.lengths[j], [here - variable.lower, variable.upper - here]);
        let distance = match self.slope[j] * length {
            change if change.abs() <= self.negligible => below.max(above),
            change if change > 0.0 => below,
            _ => above,
        };
        distance > NEAR_BOUND * length
    }

    /// A vector of the free variables.
    fn free(&self, component: impl Fn(usize) -> f64) -> DVector<f64> {
        DVector::from_fn(self.situation.n(), |j, _| if self.is_free(j) { component(j) } else { 0.0 })
    }

    /// −∂L/∂b, projected onto the tangent space of the active rows.
    fn descent(&self) -> DVector<f64> {
        orthogonal_part(&self.free(|j| -self.slope[j] * self.situation.units.lengths[j]), &self.normals)
    }

    /// Orthonormal steps of the run without their components along orthonormal vectors; if `are_local`, only those along which the
    /// curvature represents that at the design.
    fn steps(&self, normals: &[DVector<f64>], are_local: bool) -> Vec<DVector<f64>> {
        let (points, lengths) = (&self.situation.memory.points, &self.situation.units.lengths);
        let step = |ends: &[AcceptedPoint]| self.free(|j| (ends[1].design[j] - ends[0].design[j]) / lengths[j]);
        let is_meant = |ends: &&[AcceptedPoint]| !are_local || self.is_local(ends);
        let along = |step: DVector<f64>| {
            let rest = orthogonal_part(&step, normals);
            (is_long(&step) && rest.norm() > INDEPENDENT * step.norm()).then_some(rest)
        };
        basis(points.windows(2).filter(is_meant).map(step).filter_map(along))
    }

    /// The steps of the run and the changes of ∂L/∂b, in lengths.
    fn pairs(&self) -> Vec<SecantPair> {
        let mut pairs = self.situation.lagrangian_pairs(&self.weights);
        pairs.retain(|[step, _]| is_long(step));
        pairs
    }

    /// The pairs of [`Self::pairs`] along which the curvature represents that at the design.
    fn local_pairs(&self) -> Vec<SecantPair> {
        let steps =
            self.situation.lagrangian_steps(&self.weights).into_iter().zip(self.situation.memory.points.windows(2));
        steps.filter(|([step, _], ends)| is_long(step) && self.is_local(ends)).map(|(pair, _)| pair).collect()
    }

    /// True for a step along which the curvature has the same sign at both ends, if it changes evenly: the change of the
    /// Lagrangian agrees with its slopes at both ends, up to a fraction of the effect of their difference. Along a step as long as a length of several
    /// variables, uneven changes can cancel out.
    fn is_local(&self, ends: &[AcceptedPoint]) -> bool {
        let lengths = &self.situation.units.lengths;
        let is_long = |j: &usize| (ends[1].design[*j] - ends[0].design[*j]).abs() > LONG * lengths[*j];
        if (0..lengths.len()).filter(is_long).count() > 1 {
            return false;
        }
        let (problem, numbers) = (self.situation.problem, &self.situation.current().numbers);
        let along = |gradient: &[f64]| -> f64 {
            gradient.iter().zip(ends[1].design.iter().zip(&ends[0].design)).map(|(g, (to, from))| g * (to - from)).sum()
        };
        let [mut error, mut bending, mut rounding] = [0.0; 3];
        for (number, weight) in numbers.iter().zip(&self.weights) {
            let [from, to] = [0, 1].map(|k| find(problem, &ends[k].numbers, number.id));
            let (Some(from), Some(to)) = (from, to) else { continue };
            let [first, second] = [from, to].map(|number| along(&number.gradient));
            error += weight * (to.value - from.value - 0.5 * (first + second));
            bending += weight * 0.5 * (second - first);
            rounding += ROUNDING * weight.abs() * (from.value.abs() + to.value.abs());
        }
        error.abs() <= LOCAL * bending.abs() + rounding
    }

    /// Number of the last exploring steps that were too long to determine the curvature.
    fn too_long(&self) -> usize {
        let last = self.situation.memory.points.windows(2).rev().take(self.situation.memory.explorations % ROUND);
        last.filter(|ends| !self.is_local(ends)).count()
    }

    /// True if steps along a direction have hardly changed the slope along it. The lengths then do not bound the step along it.
    fn is_steady(&self, direction: &DVector<f64>, slope: f64) -> bool {
        let mut change = 0.0;
        let is_known = orthogonal_part(direction, &self.steps(&self.binding, false)).norm() < MOSTLY;
        is_known
            && self.pairs().iter().rev().all(|[_, of_slope]| {
                change += of_slope.dot(direction);
                change.abs() < STEADY * slope.abs()
            })
    }

    /// The known curvatures along orthonormal directions. `None` before a step that determines a curvature.
    fn curvatures(&self, known: &[DVector<f64>], pairs: &[SecantPair]) -> Option<DMatrix<f64>> {
        let n = self.situation.n();
        let is_explicit = self.weights.iter().all(|w| *w == 0.0);
        let of_numbers = if is_explicit { Some(DMatrix::zeros(n, n)) } else { sr1(pairs) };
        let hessian = of_numbers.filter(|_| !known.is_empty())? + &self.explicit;
        let sizes = hessian.abs();
        let between = |i: usize, k: usize| {
            let rounding = ROUNDING * known[i].abs().dot(&(&sizes * known[k].abs()));
            Some(known[i].dot(&(&hessian * &known[k]))).filter(|c| c.abs() > rounding).unwrap_or(0.0)
        };
        Some(DMatrix::from_fn(known.len(), known.len(), between))
    }

    /// The directions among orthonormal ones in which no step has shown a positive curvature.
    fn flat(&self, known: &[DVector<f64>], pairs: &[SecantPair]) -> Option<Flat> {
        let curvatures = self.curvatures(known, pairs)?;
        let hidden = hidden_descent(&curvatures)
            .map(|(weights, curvature)| (combined(known, weights.iter().copied()), curvature));
        let reduced = curvatures.symmetric_eigen();
        let positive = (FLAT * reduced.eigenvalues.amax()).max(self.negligible);
        let mut flat: Vec<usize> = (0..known.len()).filter(|&k| reduced.eigenvalues[k] <= positive).collect();
        flat.sort_by(|&a, &b| reduced.eigenvalues[a].total_cmp(&reduced.eigenvalues[b]));
        let has_negative_curvature = flat.first().is_some_and(|&k| reduced.eigenvalues[k] < -positive);
        let direction = |k: usize| combined(known, reduced.eigenvectors.column(k).iter().copied());
        let hidden = hidden.filter(|_| !has_negative_curvature);
        Some(Flat { directions: flat.into_iter().map(direction).collect(), has_negative_curvature, hidden })
    }

    /// The next step to learn more about the curvature, and its curvature where only its own unit shows that it is negative; `None` if
    /// the known curvatures are positive.
    fn uncertain(&self) -> Option<(DVector<f64>, Purpose, Option<f64>)> {
        let n = self.situation.n();
        let unit = |j: usize| DVector::from_fn(n, |i, _| if i == j { 1.0 } else { 0.0 });
        let free = (0..n).filter(|&j| self.is_free(j)).map(unit);
        let all = basis(self.binding.iter().cloned().chain(free));
        let tangent = &all[self.binding.len()..];
        if tangent.is_empty() {
            return None;
        }
        let (pairs, explorations) = (self.local_pairs(), self.situation.memory.explorations % ROUND);
        // The curvature of functions that are given directly is known.
        let is_explicit = self.weights.iter().all(|w| *w == 0.0);
        let steps = if is_explicit { tangent.to_vec() } else { self.steps(&self.binding, true) };
        let unknown = basis(tangent.iter().map(|v| orthogonal_part(v, &steps)).filter(|v| v.norm() > INDEPENDENT));
        let is_partly_unknown = !unknown.is_empty() && steps.len() < tangent.len();
        let among_unknown = |direction: &DVector<f64>| orthogonal_part(&conjugate(direction, &pairs), &self.binding);
        let too_long = self.too_long();
        let explorations = explorations - too_long;
        if is_partly_unknown && explorations == 0 && too_long < MOST_EXPLORATIONS {
            return Some((among_unknown(&generic(&unknown)), Purpose::Curvature, None));
        }
        let Flat { directions: flat, has_negative_curvature, hidden } =
            self.flat(if is_partly_unknown { &steps } else { tangent }, &pairs)?;
        if let Some((direction, curvature)) = hidden.filter(|_| explorations < MOST_EXPLORATIONS) {
            return Some((direction, Purpose::Curvature, Some(curvature)));
        }
        if is_partly_unknown && explorations < MOST_UNKNOWN && !has_negative_curvature {
            // The change of the slope along a step is the next vector of its Krylov space.
            let coupled = |[_, change]: &SecantPair| {
                let part = combined(&unknown, unknown.iter().map(|v| v.dot(change)));
                (part.norm() > INDEPENDENT * change.norm()).then_some(part)
            };
            return Some((among_unknown(&pairs.iter().rev().find_map(coupled)?), Purpose::Curvature, None));
        }
        if is_partly_unknown && !has_negative_curvature {
            return None;
        }
        // One direction at a time.
        let next = if has_negative_curvature { 0 } else { explorations };
        if let (Some(direction), true) = (flat.get(next), explorations < MOST_EXPLORATIONS) {
            return Some((direction.clone(), Purpose::Curvature, None));
        }
        // Rows at fixed times do not show the motion of peaks.
        let is_over_time = |row: &RowId| self.situation.problem.constraints[row.constraint].quantity.is_transient();
        let is_known = !flat.is_empty() && !self.situation.here.rows.iter().any(is_over_time);
        is_known.then(|| (generic(&flat), Purpose::Flat, None))
    }

    /// Violation of active rows that do not bind by a step along a direction, in its first-order changes of them.
    fn violation(&self, direction: &DVector<f64>) -> f64 {
        let CycleContext { here, units, .. } = self.situation;
        let gradient = |i: usize| self.free(|j| here.jacobian[(i, j)] * units.lengths[j]);
        let change =
            |g: DVector<f64>| orthogonal_part(&g, &self.binding).dot(direction) / g.norm().max(f64::MIN_POSITIVE);
        let active = (0..here.c.len()).filter(|&i| !here.equality[i] && here.is_active(i, &units.lengths));
        active.map(|i| change(gradient(i)).max(0.0)).sum()
    }
}

/// Directions in which no step has shown a positive curvature.
struct Flat {
    /// The least curvature first.
    directions: Vec<DVector<f64>>,
    /// True if the least curvature is negative.
    has_negative_curvature: bool,
    /// A direction of negative curvature that is negligible over the lengths, and its curvature over them: the length of
    /// a variable that was at a point of symmetry is meaningless.
    hidden: Option<(DVector<f64>, f64)>,
}

/// A direction of negative curvature of a symmetric matrix in its own units, and this curvature; `None` if there is none. In these units the
/// largest curvature of each variable is 1; they do not depend on lengths.
fn hidden_descent(curvatures: &DMatrix<f64>) -> Option<(DVector<f64>, f64)> {
    let (r, mut scaled) = (curvatures.nrows(), curvatures.clone());
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
fn combined(vectors: &[DVector<f64>], weights: impl Iterator<Item = f64>) -> DVector<f64> {
    vectors.iter().zip(weights).fold(DVector::zeros(vectors[0].len()), |sum, (v, weight)| sum + v * weight)
}

/// A combination of the vectors in a generic direction.
fn generic(vectors: &[DVector<f64>]) -> DVector<f64> {
    combined(vectors, (0..vectors.len()).map(|k| golden_fraction(k) - 0.5))
}

/// True for a step, in lengths, that is larger than rounding errors and has an effect.
fn is_long(step: &DVector<f64>) -> bool {
    step.amax() > NO_EFFECT
}

/// The direction, with components along known steps added so that it is conjugate to them: yᵀd = 0 for the change y of the
/// gradient along each step.
fn conjugate(direction: &DVector<f64>, pairs: &[SecantPair]) -> DVector<f64> {
    if pairs.is_empty() {
        return direction.clone();
    }
    let known = DMatrix::from_fn(pairs.len(), pairs.len(), |i, k| pairs[i][1].dot(&pairs[k][0]));
    let along = DVector::from_fn(pairs.len(), |i, _| pairs[i][1].dot(direction));
    let svd = known.svd(true, true);
    let largest = svd.singular_values.amax();
    let weights =
        svd.solve(&along, INDEPENDENT * INDEPENDENT * largest).unwrap_or_else(|_| DVector::zeros(pairs.len()));
    pairs.iter().zip(weights.iter()).fold(direction.clone(), |rest, ([step, _], &weight)| rest - step * weight)
}

impl CycleContext<'_> {
    /// A step along directions of unknown curvature, for a design that seems to be an optimum; `None` if there is none.
    ///
    /// A variable on which no function has depended to first order may be at a maximum. A curvature that no step has determined is a
    /// guess: if a length was underestimated, it is far too large, and the step and the predicted decrease are far too small.
    ///
    /// A slope in a direction without a step is ignored if the run `has_settled`: with more variables than stored steps, there is
    /// always one.
    pub(super) fn unexplored(&self, negligible: f64, has_settled: bool) -> Option<Proposal> {
        if !self.is_flat_start() && (0..self.n()).any(|j| self.is_unknown(j)) {
            return Some(self.displacement(DISPLACEMENT, |j| self.is_unknown(j)));
        }
        let tangent = TangentSpace::new(self, negligible);
        let (lengths, widths) = (&self.units.lengths, &self.memory.widths);
        let descent = tangent.descent();
        let new = orthogonal_part(&descent, &tangent.steps(&tangent.normals, false));
        if !has_settled && self.memory.rejections == 0 && new.amax() > negligible {
            let direction = orthogonal_part(&conjugate(&new, &tangent.pairs()), &tangent.normals);
            let to_limit = |j: usize| widths[j] / (lengths[j] * direction[j].abs());
            let size = (0..self.n()).map(to_limit).fold(f64::INFINITY, f64::min);
            return Some(self.along(&direction, size, widths, Purpose::Improvement));
        }
        if self.memory.explorations >= 2 * ROUND {
            return None;
        }
        let (direction, purpose, hidden) = tangent.uncertain()?;
        let noise = negligible.max(f64::EPSILON * self.units.objective_range);
        // At a point of inflection, only one side shows that it is no minimum.
        let is_other_side = purpose == Purpose::Curvature
            && tangent.too_long() % 2 == 1
            && descent.dot(&direction).abs() <= noise * direction.norm();
        let direction = direction.normalize() * if self.is_backwards() || is_other_side { -1.0 } else { 1.0 };
        let slope = descent.dot(&direction);
        let is_slope = slope.abs() > noise && tangent.is_steady(&direction, slope);
        let by_curvature = hidden.map_or(0.0, |curvature| (2.0 * MATTERS * noise / -curvature).sqrt());
        let to_matter = if is_slope { MATTERS * noise / slope } else { by_curvature };
        let shortened = || (STEP * SHORTER.powi(tangent.too_long() as i32)).max(SHORTEST);
        let step = if purpose == Purpose::Flat { FLAT_STEP } else { shortened() };
        let is_better_backwards = || tangent.violation(&-&direction) < tangent.violation(&direction);
        let may_turn = slope.abs() <= noise && !self.is_backwards() && !is_other_side;
        let sign = if may_turn && is_better_backwards() { -1.0 } else { slope };
        let size = (step / direction.amax()).max(to_matter.abs()).copysign(sign);
        let box_size = (size.abs() * direction.amax()).max(1.0);
        let widths: Vec<f64> = lengths.iter().map(|l| l * box_size).collect();
        Some(self.along(&direction, size, &widths, purpose))
    }

    /// A step of `size` times a direction in lengths, inside a box and the bounds; backwards if this is longer.
    fn along(&self, direction: &DVector<f64>, size: f64, widths: &[f64], purpose: Purpose) -> Proposal {
        let (design, lengths, region) = (&self.state.design, &self.units.lengths, self.sides(widths));
        let moved = |size: f64| -> Vec<f64> {
            let to = |j: usize| design[j] + size * lengths[j] * direction[j];
            (0..self.n()).map(|j| to(j).clamp(region.lower[j], region.upper[j])).collect()
        };
        let distance = |to: &[f64]| (0..self.n()).map(|j| ((to[j] - design[j]) / lengths[j]).powi(2)).sum::<f64>();
        let (forwards, backwards) = (moved(size), moved(-size));
        let is_shorter = purpose != Purpose::Improvement && distance(&forwards) < 0.5 * distance(&backwards);
        self.by_linear_surrogate(if is_shorter { backwards } else { forwards }, region, purpose)
    }

    /// Number of explorations after this one; steps along flat directions, forwards and backwards, are the last ones, or the last but a
    /// round if one is accepted for the first time.
    pub(super) fn explorations_after(&self, purpose: Purpose, is_accepted: bool) -> usize {
        match purpose {
            Purpose::Curvature => self.memory.explorations + 1,
            Purpose::Flat if is_accepted && self.memory.explorations < ROUND => ROUND,
            Purpose::Flat if self.is_backwards() || is_accepted => 2 * ROUND,
            Purpose::Flat => 2 * ROUND - 1,
            Purpose::Improvement | Purpose::Displacement | Purpose::Return => self.memory.explorations,
        }
    }

    /// True if a step along flat directions was rejected.
    fn is_backwards(&self) -> bool {
        self.memory.explorations == 2 * ROUND - 1
    }

    /// True if the derivatives at a proposal determine the curvature here: it is at most one length away.
    pub(super) fn shows_curvature(&self, proposal: &Proposal) -> bool {
        let is_meant = match proposal.purpose {
            Purpose::Curvature => true,
            Purpose::Displacement => self.is_flat_start(),
            Purpose::Improvement | Purpose::Flat | Purpose::Return => false,
        };
        let steps = proposal.design.iter().zip(&self.state.design).zip(&self.units.lengths);
        is_meant && { steps }.all(|((to, from), length)| (to - from).abs() <= *length)
    }

    /// True if a step shows that the run must continue: the Lagrangian decreases along a tangent direction, and no inequality without
    /// a multiplier is violated there; or it hardly increases along a flat direction, at whose end other rows may be active.
    pub(super) fn leads_on(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> bool {
        let multipliers = &proposal.solution.multipliers;
        let there = self.observed_lagrangian(proposal, analyzed, None).map_or(f64::INFINITY, |l| l.value);
        let rows: f64 = multipliers.iter().zip(&self.here.c).map(|(λ, c)| λ * c).sum();
        let here = self.state.evaluation.objective + rows;
        if proposal.purpose == Purpose::Flat {
            return there < here + FLAT * spread(self.objectives().into_iter());
        }
        let is_free = |i: &usize| multipliers[*i] == 0.0 && !self.here.equality[*i];
        let violation = |i: usize| {
            let row = self.here.rows[i];
            (analyzed.evaluation.value_of(row) - 1.0) / self.units.rows[row.constraint]
        };
        let is_feasible = (0..multipliers.len()).filter(is_free).map(violation).all(|v| v <= NO_EFFECT);
        is_feasible && there < here - ROUNDING * here.abs()
    }

    /// True for a variable that has never moved because no function has depended on it to first order, apart from rounding.
    fn is_unknown(&self, j: usize) -> bool {
        let (variable, lengths) = (&self.problem.variables[j], &self.units.lengths);
        let [least, most] = self.state.trace().designs.extent(j);
        let has_no_effect =
            |slope: &Vec<f64>| slope[j].abs() * lengths[j] <= NO_EFFECT * largest_single(slope, lengths);
        let mut points = self.memory.points.iter();
        variable.upper > variable.lower
            && [least, most].iter().all(|b| (b - self.state.design[j]).abs() <= NO_EFFECT * lengths[j])
            && has_no_effect(&self.here.slope)
            && points.all(|p| p.slopes.iter().chain(p.numbers.iter().map(|r| &r.gradient)).all(has_no_effect))
    }

    /// A step of some variables in a generic direction, by the fraction `size` of the lengths.
    pub(super) fn displacement(&self, size: f64, is_moved: impl Fn(usize) -> bool) -> Proposal {
        let region = self.sides(&self.units.lengths);
        let rejections = self.memory.rejections;
        let is_flat_start = self.is_flat_start();
        let tries = self.memory.left.len() + rejections;
        // Better points may be on one side only.
        let is_opposite = if is_flat_start { tries % 2 == 1 } else { self.futile_displacements() == 1 };
        let direction = tries - usize::from(is_opposite);
        let shortening = if is_flat_start { shortening(rejections) } else { 0.25f64.powi(rejections as i32) };
        let design: Vec<f64> = (0..self.n())
            .map(|j| {
                if !is_moved(j) {
                    return self.state.design[j];
                }
                let fraction = golden_fraction(j + 7 * direction);
                let sign = if (fraction < 0.5) != is_opposite { -1.0 } else { 1.0 };
                let size = size * self.units.lengths[j] * (0.5 + fraction) * shortening;
                let (here, lower, upper) = (self.state.design[j], region.lower[j], region.upper[j]);
                let there = here + sign * size;
                let inside = (lower..=upper).contains(&there);
                if inside { there } else { (here - sign * size).clamp(lower, upper) }
            })
            .collect();
        self.by_linear_surrogate(design, region, Purpose::Displacement)
    }

    /// A design that is not the solution of a subproblem, with the prediction of the linear surrogate.
    pub(super) fn by_linear_surrogate(&self, design: Vec<f64>, region: Region, purpose: Purpose) -> Proposal {
        let surrogate = self.surrogate(Kind::Linear).expect("only the Lagrangian may be missing");
        let values = surrogate.values(&design);
        let mut predicted = self.merit(values.objective, &values.rows);
        if purpose != Purpose::Improvement {
            predicted.violation = f64::INFINITY;
        }
        let solution = Solution {
            x: design.clone(),
            objective: values.objective,
            multipliers: self.here.balanced(self.problem, &self.state.design, &self.units.lengths),
            rows: values.rows,
            lower_multipliers: vec![],
            upper_multipliers: vec![],
            iterations: 0,
            evaluations: nlp::Evaluations::default(),
            status: nlp::ProgramStatus::Relaxed,
            relaxation: None,
            relaxed_rows: vec![],
            kkt: KktResidual::default(),
        };
        let at_limit = self.at_limit(&design, &region, None);
        Proposal { design, region, at_limit, solution, restoration: None, predicted, purpose }
    }
}

/// The fractional part of the k-th multiple of the golden ratio, counted from one: evenly spread.
fn golden_fraction(k: usize) -> f64 {
    (0.618_033_988_749_894_9 * (1 + k) as f64).fract()
}

/// max |∂ⱼ| ℓⱼ.
fn largest_single(slope: &[f64], lengths: &[f64]) -> f64 {
    slope.iter().zip(lengths).map(|(g, l)| (g * l).abs()).fold(0.0, f64::max)
}

/// Orthonormal vectors that span the given ones.
fn basis(vectors: impl Iterator<Item = DVector<f64>>) -> Vec<DVector<f64>> {
    orthonormal_basis(vectors, INDEPENDENT)
}
