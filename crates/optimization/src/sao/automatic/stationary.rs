//! Points that no step improves: a stationary violation, and subproblems without a step.

use super::convergence::stalled;
use super::cycle_context::{CycleContext, SurrogateKind};
use super::displacement::{DISPLACEMENTS, MAX_DISPLACEMENTS};
use super::proposal::{Next, Proposal, Purpose};
use super::restoration::{is_stationary, largest_first_order_change, least_violation};
use crate::problem::RowId;
use crate::sao::{Cycle, Status};
use error::Result;

/// Part of the largest violation by which others may be smaller and still count as equal to it.
const EQUAL: f64 = 1e-4;
/// Lengths within which the violation must be stationary. A length may be underestimated, above all for a variable that
/// started at zero.
pub(super) const WIDE: f64 = 100.0;
/// Violation of the largest row, relative to its scale, up to which a design counts as feasible, and largest number of returns to it.
const FEASIBLE: f64 = 1e-6;
const MAX_RETURNS: usize = 3;
/// Part of a violation below which another one is clearly less.
const LESS: f64 = 0.9;
/// Violation in units of the rows from which on a run that has stalled is displaced.
const LEAST_VIOLATION: f64 = 1e-6;

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
        let least = least_violation(&self.linearized, &self.units, design, [&region.lower, &region.upper])?;
        if !is_stationary(self.violation, least, largest_first_order_change(&self.linearized, &self.units)) {
            return Ok(None);
        }
        if let Some(design) = self.best_feasible_design() {
            let region = self.sides(&vec![f64::INFINITY; self.n()]);
            let proposal = self.with_linear_prediction(design.to_vec(), region, Purpose::Return);
            return Ok(Some(Next::Analyse(Box::new(proposal))));
        }
        if !self.memory.has_common_unit {
            return Ok(Some(Next::CommonUnit));
        }
        if let Some(design) = self.less_violated_design(MAX_RETURNS) {
            let region = self.sides(&vec![f64::INFINITY; self.n()]);
            let proposal = self.with_linear_prediction(design.to_vec(), region, Purpose::Return);
            return Ok(Some(Next::Analyse(Box::new(proposal))));
        }
        if let Some(displacement) = self.next_displacement() {
            return Ok(Some(Next::Analyse(Box::new(displacement))));
        }
        let (status, reason) = self.end_at_stationary_violation(within, least);
        Ok(Some(Next::End(status, reason, vec![])))
    }

    /// The status and the reason of the end where the violation is stationary within so many lengths and no displacement is left;
    /// `least` is the least violation of the linearized rows there.
    fn end_at_stationary_violation(&self, within: f64, least: f64) -> (Status, String) {
        if self.unsuccessful_displacements() < DISPLACEMENTS.len() {
            let reason = format!(
                "the violation is nearly stationary, but each of {MAX_DISPLACEMENTS} displacements led to a smaller one"
            );
            return (Status::Stalled, reason);
        }
        if self.feasible_cycles().next().is_some() {
            let reason = format!(
                "the violation is stationary here, {}, but another design of the run is feasible: start there, with a smaller first step",
                self.largest_violation_in_words()
            );
            return (Status::Stalled, reason);
        }
        if self.less_violated_design(usize::MAX).is_some() {
            let reason = format!(
                "the violation is stationary here, {}, but another design of the run violates the constraints less: start there, with a smaller \
                 first step",
                self.largest_violation_in_words()
            );
            return (Status::Stalled, reason);
        }
        if let Some(reason) = self.largest_violation_without_derivatives() {
            return (Status::Stalled, reason);
        }
        let share = (self.violation - least).max(0.0) / self.violation;
        let at_most = if share > 0.0 { format!(" by more than {share:.1e} of it") } else { String::new() };
        let reason = format!(
            "the violation is stationary here: {}, and to first order no change of the variables, up to {within} times as large as in this \
             run, reduces the largest violation{at_most}; other regions were not searched",
            self.largest_violation_in_words()
        );
        (Status::Infeasible, reason)
    }

    /// The accepted trial steps of the run whose designs are feasible.
    fn feasible_cycles(&self) -> impl Iterator<Item = &Cycle> {
        let is_feasible = |cycle: &&Cycle| cycle.accepted && cycle.violation_pct <= 100.0 * FEASIBLE;
        self.state.history.iter().filter(is_feasible)
    }

    /// The best feasible design of the run, unless the run has come back to it [`MAX_RETURNS`] times.
    fn best_feasible_design(&self) -> Option<&[f64]> {
        let best = self.feasible_cycles().min_by(|a, b| a.objective.total_cmp(&b.objective))?;
        let visits = self.feasible_cycles().filter(|cycle| cycle.design == best.design).count();
        (visits <= MAX_RETURNS).then_some(&best.design[..])
    }

    /// The accepted design of the run with the least violation, if that is clearly less than here, and the run has been there at most so many
    /// times.
    fn less_violated_design(&self, visits: usize) -> Option<&[f64]> {
        let accepted = || self.state.history.iter().filter(|cycle| cycle.accepted);
        let least = accepted().min_by(|a, b| a.violation_pct.total_cmp(&b.violation_pct))?;
        let is_less = least.violation_pct < LESS * self.state.evaluation.max_violation_pct();
        (is_less && accepted().filter(|cycle| cycle.design == least.design).count() <= visits)
            .then_some(&least.design[..])
    }

    /// The reason of the end if the largest violation is that of constraints that depend on no variable, neither here nor at the designs of
    /// the displacements: such a constraint shows no direction, and nothing about other regions.
    fn largest_violation_without_derivatives(&self) -> Option<String> {
        let tried = || self.memory.points.iter().rev().take(1 + DISPLACEMENTS.len());
        let is_constant = |row: &RowId| tried().all(|point| point.slopes[row.constraint].iter().all(|s| *s == 0.0));
        let (rows, _) = self.largest_violations();
        rows.iter().all(is_constant).then(|| {
            format!(
                "{}, and does not depend on the design in this region: all its derivatives are zero, here and at the designs tried around, so \
                 that no direction to feasible designs is known. A contact that stays open, a switch that does not switch or a limit that cuts \
                 off has this effect: start where the quantity changes with the variables",
                self.largest_violation_in_words()
            )
        })
    }

    /// The constraints with the largest violation, and by how much they are violated.
    pub(super) fn largest_violation_in_words(&self) -> String {
        let (rows, largest) = self.largest_violations();
        let names: Vec<String> = rows.into_iter().map(|row| self.problem.row_in_words(row)).collect();
        let verb = if names.len() == 1 { "is" } else { "are" };
        format!("{} {verb} violated by {:.3} %", names.join(" and "), 100.0 * largest)
    }

    /// The rows with the largest violation, and this violation.
    fn largest_violations(&self) -> (Vec<RowId>, f64) {
        let evaluation = &self.state.evaluation;
        let violated = |j: usize| {
            let (row, c) = evaluation.worst_of(j)?;
            Some((row, evaluation.violation(j, c)))
        };
        let all: Vec<_> = (0..evaluation.residuals.len()).filter_map(violated).collect();
        let largest = all.iter().fold(0.0f64, |a, (_, v)| a.max(*v));
        let equal = all.into_iter().filter(|(_, v)| *v >= largest * (1.0 - EQUAL));
        (equal.map(|(row, _)| row).collect(), largest)
    }

    /// The next step, or the end, where the subproblem gives no step; `None` if there is no such step and no reason for this end.
    pub(super) fn step_after_stalling(&self, restoration: Option<f64>) -> Result<Option<Next>> {
        let analyse = |step| Next::Analyse(Box::new(step));
        if let Some(step) = self.step_by_other_surrogate(restoration)? {
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
        Ok(if is_violated { self.next_displacement().map(analyse) } else { None })
    }

    /// A step by another surrogate where the subproblem of the selected one gives none; `None` if no surrogate predicts a better design.
    /// The other surrogates are not corrected by rejected steps, whose only effect is the smaller box.
    fn step_by_other_surrogate(&self, restoration: Option<f64>) -> Result<Option<Proposal>> {
        if self.memory.rejections > 0 && restoration.is_some() {
            return Ok(None);
        }
        for kind in [SurrogateKind::Lagrangian, SurrogateKind::Selected, SurrogateKind::Linear] {
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
