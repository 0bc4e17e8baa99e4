//! Points that no step improves: a stationary violation, and subproblems without a step.

use super::convergence::stalled;
use super::proposal::{Next, Proposal, Purpose};
use super::restoration::{is_stationary, largest_first_order_change, least_violation};
use super::situation::{CycleContext, Kind};
use crate::sao::{Cycle, Status};
use error::Result;

/// Displacements from a stationary point in lengths; the next one is used if those before led back. The second one is opposite to the first.
pub(super) const DISPLACEMENTS: [f64; 3] = [0.1, 0.5, 0.5];
/// Number of sizes of a displacement that is rejected, each [`SHORTER`] times the one before.
pub(super) const SIZES: usize = 3;
const SHORTER: f64 = 0.01;
/// Factor by which an increase of the objective may deviate from the square of the displacement, because the directions of displacements
/// differ; and the part of the objective that is rounding.
const EVENLY: f64 = 50.0;
const ROUNDING: f64 = 1e-14;
/// Largest number of displacements in a run.
const MOST_DISPLACEMENTS: usize = 6;
/// A stationary point of the violation is better than earlier ones if its violation is below this fraction of theirs.
const BETTER: f64 = 0.99;
/// Part of the largest violation by which others may be smaller and still count as equal to it.
const EQUAL: f64 = 1e-4;
/// Lengths within which the violation must be stationary. A length may be underestimated, above all for a variable that
/// started at zero.
pub(super) const WIDE: f64 = 100.0;
/// Violation of the largest row, relative to its scale, up to which a design counts as feasible, and largest number of returns to it.
const FEASIBLE: f64 = 1e-6;
const MOST_RETURNS: usize = 3;
/// Violation in units of the rows from which on a run that has stalled is displaced.
const LEAST_VIOLATION: f64 = 1e-6;

/// Factor of a displacement after so many rejected ones; after the smallest one, the first one follows again.
pub(super) fn shortening(rejections: usize) -> f64 {
    SHORTER.powi((rejections % SIZES) as i32)
}

impl CycleContext<'_> {
    /// A displacement or the end if the violation is stationary within so many lengths; `None` if it is not.
    ///
    /// Rows are measured by their slopes over the lengths, which makes restorations independent of their scales. A row without slopes can
    /// then outweigh violations of any size. Where the violation in these units is stationary, restoration continues with a common unit of
    /// the rows. A point is left, or reported as infeasible, only where the largest violation of the problem itself is stationary.
    pub(super) fn stationary_violation(&self, within: f64) -> Result<Option<Next>> {
        let widths: Vec<f64> = self.units.lengths.iter().map(|l| within * l).collect();
        let region = self.sides(&widths);
        let design = &self.state.design;
        let least = least_violation(&self.here, &self.units, design, [&region.lower, &region.upper])?;
        if !is_stationary(self.violation, least, largest_first_order_change(&self.here, &self.units)) {
            return Ok(None);
        }
        if let Some(design) = self.best_feasible() {
            let region = self.sides(&vec![f64::INFINITY; self.n()]);
            let proposal = self.by_linear_surrogate(design.to_vec(), region, Purpose::Return);
            return Ok(Some(Next::Analyse(Box::new(proposal))));
        }
        if !self.memory.has_common_unit {
            return Ok(Some(Next::CommonUnit));
        }
        if let Some(displacement) = self.displaced() {
            return Ok(Some(Next::Analyse(Box::new(displacement))));
        }
        if self.futile_displacements() < DISPLACEMENTS.len() {
            let reason = format!(
                "the violation is nearly stationary, but each of {MOST_DISPLACEMENTS} displacements led to a smaller one"
            );
            return Ok(Some(Next::End(Status::Stalled, reason, vec![])));
        }
        if self.feasible().next().is_some() {
            let reason = format!(
                "the violation is stationary here, {}, but another design of the run is feasible: start there, with a smaller first step",
                self.largest_violation_in_words()
            );
            return Ok(Some(Next::End(Status::Stalled, reason, vec![])));
        }
        let share = (self.violation - least).max(0.0) / self.violation;
        let at_most = if share > 0.0 { format!(" by more than {share:.1e} of it") } else { String::new() };
        let reason = format!(
            "the violation is stationary here: {}, and to first order no change of the variables, up to {within} times as large as in this \
             run, reduces the largest violation{at_most}; other regions were not searched",
            self.largest_violation_in_words()
        );
        Ok(Some(Next::End(Status::Infeasible, reason, vec![])))
    }

    /// The accepted designs of the run that are feasible.
    fn feasible(&self) -> impl Iterator<Item = &Cycle> {
        let is_feasible = |cycle: &&Cycle| cycle.accepted && cycle.violation_pct <= 100.0 * FEASIBLE;
        self.state.history.iter().filter(is_feasible)
    }

    /// The best feasible design of the run, unless the run has come back to it [`MOST_RETURNS`] times.
    fn best_feasible(&self) -> Option<&[f64]> {
        let best = self.feasible().min_by(|a, b| a.objective.total_cmp(&b.objective))?;
        let visits = self.feasible().filter(|cycle| cycle.design == best.design).count();
        (visits <= MOST_RETURNS).then_some(&best.design[..])
    }

    /// The constraints with the largest violation, and by how much they are exceeded.
    pub(super) fn largest_violation_in_words(&self) -> String {
        let evaluation = &self.state.evaluation;
        let violated = |j: usize| {
            let (row, g) = evaluation.worst_of(j)?;
            Some((row, evaluation.violation(j, g)))
        };
        let all: Vec<_> = (0..evaluation.constraints.len()).filter_map(violated).collect();
        let largest = all.iter().fold(0.0f64, |a, (_, v)| a.max(*v));
        let equal = all.iter().filter(|(_, v)| *v >= largest * (1.0 - EQUAL));
        let names: Vec<String> = equal.map(|(row, _)| self.problem.row_in_words(*row)).collect();
        let verb = if names.len() == 1 { "is" } else { "are" };
        format!("{} {verb} exceeded by {:.3} %", names.join(" and "), 100.0 * largest)
    }

    /// True if the objective has increased with the square of the displacement from a flat start, for all sizes: its gradients may then show
    /// whether it has a minimum there. They do not for an objective that is given directly, unless it is constant.
    pub(super) fn rises_evenly(&self) -> bool {
        let Self { state, problem, .. } = self;
        let accepted = state.history.iter().rposition(|cycle| cycle.accepted).map_or(0, |last| last + 1);
        let here = state.evaluation.objective;
        let rises: Vec<f64> =
            state.history[accepted..].iter().take(SIZES).map(|cycle| cycle.objective - here).collect();
        let is_even = |pair: &[f64]| {
            let expected = SHORTER * SHORTER * pair[0];
            pair[1] <= EVENLY * expected && (pair[1] >= expected / EVENLY || expected <= ROUNDING * here.abs())
        };
        let is_constant = rises.iter().all(|rise| *rise == 0.0);
        let is_shown = is_constant || !problem.objective.quantity.is_explicit();
        rises.len() == SIZES && is_shown && rises.windows(2).all(is_even)
    }

    /// Number of displacements since the last one that led to a better point, in the units of the current cycle.
    pub(super) fn futile_displacements(&self) -> usize {
        let left: Vec<f64> = self.memory.left.iter().map(|violations| self.units.violation(violations)).collect();
        let best = left.iter().copied().fold(f64::INFINITY, f64::min);
        let is_better = self.violation < BETTER * best;
        if is_better { 0 } else { left.iter().rev().take_while(|v| **v < best / BETTER).count() }
    }

    /// A displacement from a point where steps do not reduce the violation; `None` after several that led to no better point.
    fn displaced(&self) -> Option<Proposal> {
        let futile = self.futile_displacements();
        let may_be_left = futile < DISPLACEMENTS.len() && self.memory.left.len() < MOST_DISPLACEMENTS;
        may_be_left.then(|| self.displacement(DISPLACEMENTS[futile], |_| true))
    }

    /// The next step, or the end, where the subproblem gives no step; `None` if there is neither.
    pub(super) fn after_stalling(&self, restoration: Option<f64>) -> Result<Option<Next>> {
        let analyse = |step| Next::Analyse(Box::new(step));
        if let Some(step) = self.by_another_surrogate(restoration)? {
            return Ok(Some(analyse(step)));
        }
        // Curvatures make the steps zero long before the slopes, which decrease with the last step, predict no decrease within wide limits.
        if restoration.is_some()
            && let Some(next) = self.stationary_violation(1.0)?
        {
            return Ok(Some(next));
        }
        // The rows may depend on some variables in second order only.
        let is_violated = self.violation > LEAST_VIOLATION || !self.is_feasible(1.0);
        Ok(if is_violated { self.displaced().map(analyse) } else { None })
    }

    /// A step by another surrogate than the chosen one, whose subproblem gives none; `None` if no surrogate predicts a better design.
    /// They have no corrections by rejected steps: the box, which shrinks with each of these, limits their steps.
    fn by_another_surrogate(&self, restoration: Option<f64>) -> Result<Option<Proposal>> {
        if self.memory.rejections > 0 && restoration.is_some() {
            return Ok(None);
        }
        for kind in [Kind::Lagrangian, Kind::Mixture, Kind::Linear] {
            let Some(surrogate) = self.surrogate(kind) else { continue };
            let region = self.domain(&surrogate);
            let proposal = self.solve(&surrogate, region, restoration)?;
            let step: Vec<f64> = proposal.design.iter().zip(&self.state.design).map(|(to, from)| to - from).collect();
            let is_better = match restoration {
                Some(_) => proposal.predicted.violation < self.violation,
                None => proposal.predicted.objective < self.state.evaluation.objective,
            };
            if is_better && stalled(&step, &self.memory.widths, &self.units.lengths).is_none() {
                return Ok(Some(proposal));
            }
        }
        Ok(None)
    }
}
