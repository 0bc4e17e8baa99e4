//! Check of the second-order conditions at a design that satisfies the first-order conditions.
//!
//! The first-order conditions also hold at saddle points and maxima. Two signs of these are a curvature of the Lagrangian on the
//! tangent space that is not positive, and a tangent direction in which no step was made. Before the run ends, the Lagrangian is evaluated
//! near the design in such a direction. If it is smaller there, the run continues from there. If not, its gradient there shows how this
//! direction is coupled with others, as in the method of Lanczos for the least eigenvalue.

use super::cycle_context::CycleContext;
use super::displacement::golden_fraction;
use super::lengths::spread;
use super::proposal::{Proposal, Purpose};
use super::quasi_newton::SecantPair;
use super::tangent_space::{
    FLAT, INDEPENDENT, NO_EFFECT, NonpositiveCurvature, ROUNDING, TangentSpace, conjugate, linear_combination,
    orthonormal,
};
use crate::problem::{AnalyzedDesign, RowId};
use crate::sao::Cycle;
use nalgebra::DVector;
use nlp::orthogonal_part;

/// Displacement of variables on which no function has depended, in lengths.
const DISPLACEMENT: f64 = 0.1;
/// Length of a step that determines a curvature.
const STEP: f64 = 0.01;
/// Length of a step in directions of zero curvature.
const FLAT_STEP: f64 = 0.5;
/// Factor of a step in the direction of one that was too long to show the curvature at the design.
const SHORTER: f64 = 0.01;
/// Least length of a step that determines a curvature, well above the length that counts as zero.
const SHORTEST: f64 = 10.0 * NO_EFFECT;
/// Decrease of the objective that a longer step must predict, as a multiple of the noise.
const ABOVE_NOISE: f64 = 1e6;
/// Distance from a bound in lengths within which a step to the bound is tried.
const CLOSE: f64 = 0.01;
/// Least cosine between a direction and a step for which the step has tried the direction.
const TRIED: f64 = 0.9;

/// Limits of the numbers of trial steps.
struct TrialLimits {
    /// Largest number of steps at a design that determine a curvature.
    steps: usize,
    /// Largest number of those in directions in which no step was made.
    new_directions: usize,
}

/// A run that has found its end by its own steps.
const USUAL: TrialLimits = TrialLimits { steps: 3, new_directions: 2 };
/// A confirmation of the end of another method, whose steps may have few directions.
const OF_CONFIRMATION: TrialLimits = TrialLimits { steps: 10, new_directions: 8 };

impl TrialLimits {
    /// Number of curvature trials at a design: those above and two in directions of zero curvature. A second design is checked if such
    /// a direction led to it.
    fn trials_per_design(&self) -> usize {
        self.steps + 2
    }
}

/// A trial step to learn more about the curvature.
struct CurvatureTrial {
    direction: DVector<f64>,
    purpose: Purpose,
    /// The negative curvature along the direction if only the equilibrated matrix shows it.
    equilibrated: Option<f64>,
}

impl TangentSpace<'_> {
    /// Possible next trial steps, the preferred one first; none if the known curvatures are positive.
    fn trials(&self) -> Vec<CurvatureTrial> {
        let tangent = self.basis();
        if tangent.is_empty() {
            return vec![];
        }
        let limits = self.context.trial_limits();
        let trial = |direction| CurvatureTrial { direction, purpose: Purpose::Curvature, equilibrated: None };
        let known =
            if self.has_known_hessian() { tangent.clone() } else { self.step_directions(&self.strongly_active, true) };
        let orthogonal = tangent.iter().map(|v| orthogonal_part(v, &known));
        let unknown = orthonormal(orthogonal.filter(|v| v.norm() > INDEPENDENT));
        let is_partly_unknown = !unknown.is_empty() && known.len() < tangent.len();
        let pairs = self.local_secant_pairs();
        let among_unknown =
            |direction: &DVector<f64>| orthogonal_part(&conjugate(direction, &pairs), &self.strongly_active);
        let too_long = self.num_too_long();
        let trials = self.context.trials_at_design() - too_long;
        if is_partly_unknown && trials == 0 && too_long < limits.steps {
            return vec![trial(among_unknown(&generic_combination(&unknown)))];
        }
        let determined = if is_partly_unknown { &known } else { &tangent };
        let Some(NonpositiveCurvature { directions, has_negative, equilibrated, uncertain }) =
            self.nonpositive_curvature(determined, &pairs)
        else {
            return vec![];
        };
        let is_conclusive = has_negative || !is_partly_unknown;
        let may_determine = trials < limits.steps;
        let may_be_new = !is_conclusive && trials < limits.new_directions;
        let coupled = may_be_new.then(|| coupled_direction(&unknown, &pairs)).flatten();
        let coupled = coupled.map(|direction| trial(among_unknown(&direction)));
        let of_equilibrated =
            |(direction, curvature)| CurvatureTrial { equilibrated: Some(curvature), ..trial(direction) };
        let equilibrated = equilibrated.filter(|_| may_determine).map(of_equilibrated);
        let tried = self.tried_directions(self.context.trials_at_design());
        let is_untried = |direction: &DVector<f64>| tried.iter().all(|step| step.dot(direction).abs() < TRIED);
        let uncertain = if self.context.confirms() { uncertain } else { vec![] };
        let untried = directions.iter().cloned().chain(uncertain).filter(is_untried).map(trial);
        let untried = untried.filter(|_| is_conclusive && may_determine);
        // Rows at fixed times do not show the motion of peaks.
        let is_over_time = |row: &RowId| self.context.problem.constraints[row.constraint].quantity.is_transient();
        let is_flat = !directions.is_empty() && !self.context.linearized.rows.iter().any(is_over_time);
        let flat = (is_conclusive && is_flat)
            .then(|| CurvatureTrial { purpose: Purpose::Flat, ..trial(generic_combination(&directions)) });
        equilibrated.into_iter().chain(coupled).chain(untried).chain(flat).collect()
    }

    /// Number of the last curvature trials that were too long to determine the curvature.
    fn num_too_long(&self) -> usize {
        let last = self.context.memory.points.windows(2).rev().take(self.context.trials_at_design());
        last.filter(|ends| !self.shows_local_curvature([&ends[0], &ends[1]])).count()
    }

    /// The size of a step along a direction whose predicted effect is far above the noise; zero if the effect cannot be predicted.
    fn size_above_noise(&self, direction: &DVector<f64>, slope: f64, equilibrated: Option<f64>, noise: f64) -> f64 {
        if slope.abs() > noise && self.has_constant_slope(direction, slope) {
            (ABOVE_NOISE * noise / slope).abs()
        } else {
            equilibrated.map_or(0.0, |curvature| (2.0 * ABOVE_NOISE * noise / -curvature).sqrt())
        }
    }
}

/// The part of the newest change of the gradient in the span of `unknown` directions: the next vector of the Krylov space of the step.
/// `None` if no step has such a part.
fn coupled_direction(unknown: &[DVector<f64>], pairs: &[SecantPair]) -> Option<DVector<f64>> {
    pairs.iter().rev().find_map(|[_, change]| {
        let part = linear_combination(unknown, unknown.iter().map(|v| v.dot(change)));
        (part.norm() > INDEPENDENT * change.norm()).then_some(part)
    })
}

/// A combination of the vectors with generic weights, so that it is orthogonal to no particular vector.
fn generic_combination(vectors: &[DVector<f64>]) -> DVector<f64> {
    linear_combination(vectors, (0..vectors.len()).map(|k| golden_fraction(k) - 0.5))
}

impl CycleContext<'_> {
    /// A trial step from a design that seems to be an optimum, in a direction in which it may be none; `None` if there is no such
    /// direction.
    ///
    /// A variable on which no function has depended to first order may be at a maximum. A curvature that no step has determined is a
    /// guess: if a length was underestimated, it is far too large, and the step and the predicted decrease are far too small.
    ///
    /// A slope in a direction without a step is ignored if the run `has_settled`: with more variables than stored steps, there is
    /// always one.
    pub(super) fn second_order_step(&self, negligible: f64, has_settled: bool) -> Option<Proposal> {
        if !self.is_flat_start() && (0..self.n()).any(|j| self.has_no_known_effect(j)) {
            return Some(self.displacement(DISPLACEMENT, |j| self.has_no_known_effect(j)));
        }
        let tangent = TangentSpace::new(self, negligible);
        let descent = tangent.projected_descent();
        let is_new = |trial: &Proposal| !self.was_rejected(&trial.design);
        let may_improve = !has_settled && self.memory.rejections == 0;
        let improvement = may_improve.then(|| self.step_in_new_direction(&tangent, &descent)).flatten();
        let next = improvement.filter(is_new).or_else(|| self.step_to_bounds(&tangent).filter(is_new));
        next.or_else(|| self.curvature_step(&tangent, &descent))
    }

    /// True for a design that was proposed at the current one and rejected.
    fn was_rejected(&self, design: &[f64]) -> bool {
        let bound = self.problem.objective.peak().map(|peak| peak.variable);
        let proposed = |cycle: &Cycle, j: usize| {
            let bound = cycle.prediction.as_ref().filter(|_| Some(j) == bound).and_then(|prediction| prediction.bound);
            bound.unwrap_or(cycle.design[j])
        };
        let mut rejected = self.state.history.iter().rev().take_while(|cycle| !cycle.accepted);
        rejected.any(|cycle| (0..self.n()).all(|j| proposed(cycle, j) == design[j]))
    }

    /// A step to the move limits along the part of the descent direction in which no step was made; `None` if this part is negligible.
    fn step_in_new_direction(&self, tangent: &TangentSpace, descent: &DVector<f64>) -> Option<Proposal> {
        let new = orthogonal_part(descent, &tangent.step_directions(&tangent.active, false));
        (new.amax() > tangent.negligible).then(|| {
            let (lengths, widths) = (&self.units.lengths, &self.memory.widths);
            let direction = orthogonal_part(&conjugate(&new, &tangent.secant_pairs()), &tangent.active);
            let to_limit = |j: usize| widths[j] / (lengths[j] * direction[j].abs());
            let size = (0..self.n()).map(to_limit).fold(f64::INFINITY, f64::min);
            self.step_along(&direction, size, widths, Purpose::Improvement)
        })
    }

    /// A step that moves variables near their bounds to them, if their slopes are negligible, in a confirmation before any other trial was
    /// accepted; `None` if there are no such variables. Some methods approach bounds without reaching them. The design at the bound may be no
    /// optimum: the slope of a row such as x₁x₂ ≤ 0 by x₁ vanishes where x₂ = 0.
    fn step_to_bounds(&self, tangent: &TangentSpace) -> Option<Proposal> {
        if !self.confirms() || self.memory.points.iter().any(|point| point.is_displaced) {
            return None;
        }
        let (design, flat) = (&self.state.design, FLAT * self.units.objective_range);
        let to: Vec<f64> = (0..self.n()).map(|j| tangent.near_bound(j, CLOSE, flat).unwrap_or(design[j])).collect();
        let region = || self.sides(&self.units.lengths);
        (to != *design).then(|| self.with_linear_prediction(to, region(), Purpose::Bound))
    }

    /// The next curvature trial, with the sign and size of its step.
    fn curvature_step(&self, tangent: &TangentSpace, descent: &DVector<f64>) -> Option<Proposal> {
        if self.memory.curvature_trials >= 2 * self.trial_limits().trials_per_design() {
            return None;
        }
        let mut proposals = tangent.trials().into_iter().map(|trial| self.trial_step(tangent, descent, trial));
        proposals.find(|trial| !self.was_rejected(&trial.design))
    }

    /// The step of a trial, with its sign and size.
    fn trial_step(&self, tangent: &TangentSpace, descent: &DVector<f64>, trial: CurvatureTrial) -> Proposal {
        let CurvatureTrial { direction, purpose, equilibrated } = trial;
        let noise = tangent.negligible.max(f64::EPSILON * self.units.objective_range);
        let too_long = tangent.num_too_long();
        // At a point of inflection, the Lagrangian decreases on one side only.
        let is_other_side = purpose == Purpose::Curvature
            && too_long % 2 == 1
            && descent.dot(&direction).abs() <= noise * direction.norm();
        let is_reversed = self.is_reversed_flat_step() || is_other_side;
        let direction = direction.normalize() * if is_reversed { -1.0 } else { 1.0 };
        let slope = descent.dot(&direction);
        let least_size = tangent.size_above_noise(&direction, slope, equilibrated, noise);
        let step = match purpose {
            Purpose::Flat => FLAT_STEP,
            _ => (STEP * SHORTER.powi(too_long as i32)).max(SHORTEST),
        };
        let violates_less_backwards =
            || tangent.weakly_active_violation(&-&direction) < tangent.weakly_active_violation(&direction);
        let is_either_side = slope.abs() <= noise && !is_reversed;
        let sign = if is_either_side && violates_less_backwards() { -1.0 } else { slope };
        let size = (step / direction.amax()).max(least_size).copysign(sign);
        let box_size = (size.abs() * direction.amax()).max(1.0);
        let widths: Vec<f64> = self.units.lengths.iter().map(|l| l * box_size).collect();
        self.step_along(&direction, size, &widths, purpose)
    }

    /// A step of `size` times a direction in lengths, inside a box and the bounds; backwards if they shorten it much less there.
    fn step_along(&self, direction: &DVector<f64>, size: f64, widths: &[f64], purpose: Purpose) -> Proposal {
        let (design, lengths, region) = (&self.state.design, &self.units.lengths, self.sides(widths));
        let moved = |size: f64| -> Vec<f64> {
            let to = |j: usize| design[j] + size * lengths[j] * direction[j];
            (0..self.n()).map(|j| to(j).clamp(region.lower[j], region.upper[j])).collect()
        };
        let distance = |to: &[f64]| (0..self.n()).map(|j| ((to[j] - design[j]) / lengths[j]).powi(2)).sum::<f64>();
        let (forwards, backwards) = (moved(size), moved(-size));
        let is_shorter = purpose != Purpose::Improvement && distance(&forwards) < 0.5 * distance(&backwards);
        self.with_linear_prediction(if is_shorter { backwards } else { forwards }, region, purpose)
    }

    /// True if this run confirms the end of another method.
    fn confirms(&self) -> bool {
        self.memory.tolerance > 0.0
    }

    /// The limits of the numbers of trial steps in this run.
    fn trial_limits(&self) -> TrialLimits {
        if self.confirms() { OF_CONFIRMATION } else { USUAL }
    }

    /// Number of curvature trials at the current design.
    fn trials_at_design(&self) -> usize {
        self.memory.curvature_trials % self.trial_limits().trials_per_design()
    }

    /// Number of curvature trials after this one. Steps in directions of zero curvature, forwards and backwards, are the last ones of the
    /// run, unless the first of them is accepted: the design there is checked as well.
    pub(super) fn curvature_trials_after(&self, purpose: Purpose, is_accepted: bool) -> usize {
        let per_design = self.trial_limits().trials_per_design();
        match purpose {
            Purpose::Curvature => self.memory.curvature_trials + 1,
            Purpose::Flat if is_accepted && self.memory.curvature_trials < per_design => per_design,
            Purpose::Flat if self.is_reversed_flat_step() || is_accepted => 2 * per_design,
            Purpose::Flat => 2 * per_design - 1,
            Purpose::Improvement | Purpose::Displacement | Purpose::Return | Purpose::Bound => {
                self.memory.curvature_trials
            }
        }
    }

    /// True if the step in directions of zero curvature was rejected, so that its reverse is next.
    fn is_reversed_flat_step(&self) -> bool {
        self.memory.curvature_trials == 2 * self.trial_limits().trials_per_design() - 1
    }

    /// True if the derivatives at a proposal determine the curvature here: it is at most one length away.
    pub(super) fn determines_curvature(&self, proposal: &Proposal) -> bool {
        let is_meant = match proposal.purpose {
            Purpose::Curvature => true,
            Purpose::Displacement => self.is_flat_start(),
            Purpose::Improvement | Purpose::Flat | Purpose::Return | Purpose::Bound => false,
        };
        let steps = proposal.design.iter().zip(&self.state.design).zip(&self.units.lengths);
        is_meant && { steps }.all(|((to, from), length)| (to - from).abs() <= *length)
    }

    /// True if a curvature trial shows that the current design is no minimum: the Lagrangian is smaller there, and no inequality
    /// without a multiplier is violated there. After a step in directions of zero curvature or to bounds, it suffices that the
    /// Lagrangian has hardly increased: other rows may be active there, or rows may have other slopes.
    pub(super) fn refutes_minimum(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> bool {
        let multipliers = &proposal.solution.multipliers;
        let there = self.observed_lagrangian(proposal, analyzed, None).map_or(f64::INFINITY, |l| l.value);
        let rows: f64 = multipliers.iter().zip(&self.linearized.c).map(|(λ, c)| λ * c).sum();
        let here = self.state.evaluation.objective + rows;
        let range = match proposal.purpose {
            Purpose::Bound => Some(self.units.objective_range),
            Purpose::Flat => Some(spread(self.objectives().into_iter())),
            _ => None,
        };
        if let Some(range) = range {
            return there < here + FLAT * range;
        }
        let is_without_multiplier = |i: &usize| multipliers[*i] == 0.0 && !self.linearized.equality[*i];
        let violation = |i: usize| {
            let row = self.linearized.rows[i];
            analyzed.evaluation.residual_of(row) / self.units.rows[row.constraint]
        };
        let mut violations = (0..multipliers.len()).filter(is_without_multiplier).map(violation);
        violations.all(|v| v <= NO_EFFECT) && there < here - ROUNDING * here.abs()
    }
}
