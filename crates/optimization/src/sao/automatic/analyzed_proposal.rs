//! The analysis of a proposed design, and the resulting changes of the data of the run.

use super::acceptance::{
    AcceptanceTest, Decision, DesignMerit, MAX_VIOLATION, widths_after_acceptance, widths_after_rejection,
};
use super::convergence::largest_change;
use super::cycle_context::CycleContext;
use super::displacement::{DISPLACEMENTS, SIZES, displacement_factor};
use super::proposal::{Proposal, Purpose};
use super::state::{AutomaticState, FilterEntry, RejectedPoint};
use super::{ApproximatedValue, Scores};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, RowId};
use crate::sao::trial::{AnalysedProposal, Trial};
use crate::sao::{Cycle, Method, StepVerdict};
use error::Result;

/// A proposed design with its analysis.
pub(super) struct AnalyzedProposal {
    pub decision: Decision,
    /// The analysed design; the bound variable of a min–max objective is at the peak that was found, not at the predicted one.
    pub analyzed: Result<AnalyzedDesign>,
    /// The derivatives there, if it was accepted or determines a curvature.
    pub derivatives: Option<CycleData>,
    /// Violated rows that were not retained: the step is repeated with them.
    pub missed: Vec<RowId>,
}

/// Changes of the data of the run by a trial step, except for its points.
pub(super) struct StateChanges {
    scores: Scores,
    curvature_trials: usize,
    widths: Vec<f64>,
    filter: FilterChange,
    /// The violations at a stationary point from which a displacement was made.
    displaced_from: Option<Vec<f64>>,
    rejections: RejectionChange,
    has_common_unit: bool,
}

enum FilterChange {
    None,
    Add(FilterEntry),
    Clear,
}

enum RejectionChange {
    None,
    /// Adds one; without numbers if the analysis failed.
    Add(Option<RejectedPoint>),
    Clear,
}

/// Half widths of the box after a return, as fractions of the steps that led away.
const RETURNED: f64 = 0.25;

impl AutomaticState {
    pub(super) fn update(&mut self, changes: StateChanges) {
        let StateChanges { scores, curvature_trials, widths, filter, displaced_from, rejections, has_common_unit } =
            changes;
        (self.scores, self.curvature_trials, self.widths) = (scores, curvature_trials, widths);
        self.has_common_unit = has_common_unit;
        self.displaced_from.extend(displaced_from);
        match filter {
            FilterChange::None => {}
            FilterChange::Add(entry) => self.filter.push(entry),
            FilterChange::Clear => self.filter.clear(),
        }
        match rejections {
            RejectionChange::None => {}
            RejectionChange::Add(point) => {
                self.rejections += 1;
                self.rejected.extend(point);
            }
            RejectionChange::Clear => (self.rejections, self.rejected) = (0, vec![]),
        }
    }
}

impl CycleContext<'_> {
    /// Analyses a proposal, decides about it, and differentiates it if the derivatives are needed. A failure rejects it.
    pub(super) fn analyze_proposal(&self, method: &Method, proposal: &Proposal) -> AnalyzedProposal {
        let analyzed = self.problem.analyze_design(&proposal.design);
        let mut analyzed = analyzed.and_then(|analyzed| self.problem.with_bound_at_peak(analyzed));
        let mut decision = analyzed.as_ref().map_or(Decision::Rejected, |a| self.decide(proposal, a));
        let missed = match &analyzed {
            Ok(next) if decision != Decision::Rejected => {
                method.screening.missed(self.problem, &self.data.retained, &next.evaluation, false)
            }
            _ => vec![],
        };
        if !missed.is_empty() {
            decision = Decision::Rejected;
        }
        // The change of the gradient along a curvature trial determines more of the Hessian than the change of the value.
        let needs_derivatives =
            decision != Decision::Rejected || (missed.is_empty() && self.determines_curvature(proposal));
        let derivatives =
            analyzed.as_ref().ok().filter(|_| needs_derivatives).map(|a| method.differentiate(self.problem, a));
        let derivatives = match derivatives.transpose() {
            Ok(derivatives) => derivatives,
            Err(error) => {
                (analyzed, decision) = (Err(error), Decision::Rejected);
                None
            }
        };
        AnalyzedProposal { decision, analyzed, derivatives, missed }
    }

    /// The row of the history for a proposal.
    pub(super) fn record(&self, method: &Method, proposal: &Proposal, step: &AnalyzedProposal) -> Cycle {
        let Self { problem, state, .. } = self;
        let Proposal { region, at_limit, solution, .. } = proposal;
        let analyzed = match &step.analyzed {
            Ok(analyzed) if problem.objective.peak().is_some() => &self.as_proposed(proposal, analyzed),
            analyzed => analyzed,
        };
        let record = AnalysedProposal { data: self.data, region, solution, distance: 0.0, at_limit, analyzed };
        let from = (&state.design[..], &state.evaluation);
        let trial = Trial::new(problem, &method.screening, from, state.last_step.as_deref(), &record);
        let verdict = if step.decision == Decision::Rejected { StepVerdict::Reject } else { StepVerdict::Accept };
        let cycle =
            Cycle::new(problem, state.cycles() + 1, &self.factors(&self.memory.widths), &trial, verdict, &record);
        let is_displaced = cycle.accepted && proposal.purpose != Purpose::Improvement;
        let cycle = Cycle { is_displaced, ..cycle };
        match (problem.objective.peak(), &step.analyzed) {
            (Some(peak), Ok(analyzed)) => cycle.at(analyzed, peak.variable),
            _ => cycle,
        }
    }

    /// The analysis with the proposed bound variable of a min–max objective, to which the predictions belong.
    fn as_proposed(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> Result<AnalyzedDesign> {
        let (design, responses) = (proposal.design.clone(), analyzed.responses.clone());
        let evaluation = self.problem.evaluate(&design, &responses)?;
        Ok(AnalyzedDesign { design, responses, evaluation })
    }

    /// The changes of the data of the run by a trial step.
    pub(super) fn changes(&self, proposal: &Proposal, trial: &AnalyzedProposal) -> StateChanges {
        let AnalyzedProposal { decision, analyzed, derivatives, missed } = trial;
        let (memory, purpose, analyzed) = (self.memory, proposal.purpose, analyzed.as_ref().ok());
        let is_accepted = *decision != Decision::Rejected;
        let mut changes = StateChanges {
            scores: memory.scores.clone(),
            curvature_trials: self.curvature_trials_after(purpose, is_accepted),
            widths: memory.widths.clone(),
            filter: FilterChange::None,
            displaced_from: None,
            rejections: if is_accepted { RejectionChange::Clear } else { RejectionChange::None },
            has_common_unit: memory.has_common_unit,
        };
        if let Some(analyzed) = analyzed {
            self.score(proposal, analyzed, derivatives.as_ref(), &mut changes.scores);
        }
        let widths = &mut changes.widths;
        let step: Vec<f64> = proposal.design.iter().zip(&self.state.design).map(|(to, from)| to - from).collect();
        if is_accepted && purpose == Purpose::Improvement {
            let ratio = analyzed.map_or(f64::NAN, |a| self.acceptance_test(proposal, a).ratio());
            widths_after_acceptance(widths, &step, &proposal.at_limit, ratio);
            changes.has_common_unit &= proposal.restoration.is_some();
            if *decision == Decision::Violation {
                changes.filter = FilterChange::Add(self.filter_entry());
            }
        } else if is_accepted && purpose == Purpose::Return {
            // The step that led away must not be repeated.
            widths.iter_mut().zip(&step).filter(|(_, s)| **s != 0.0).for_each(|(w, s)| *w = RETURNED * s.abs());
            changes.filter = FilterChange::Add(self.filter_entry());
        } else if is_accepted {
            let factor = if self.is_flat_start() { displacement_factor(memory.rejections) } else { 1.0 };
            let least = |l: &f64| DISPLACEMENTS[0] * factor * l;
            widths.iter_mut().zip(&self.units.lengths).for_each(|(w, l)| *w = w.max(least(l)));
            changes.filter = FilterChange::Clear;
            let is_stationary = purpose == Purpose::Displacement && self.violation > 0.0;
            changes.displaced_from = is_stationary.then(|| self.state.evaluation.violations());
        } else if missed.is_empty() && !matches!(purpose, Purpose::Curvature | Purpose::Flat | Purpose::Bound) {
            widths_after_rejection(widths, &step, analyzed.is_some() && memory.rejections == 0);
            changes.rejections = RejectionChange::Add(analyzed.map(|a| self.rejected_point(a)));
        }
        changes
    }

    /// Half widths divided by the lengths.
    pub(super) fn factors(&self, widths: &[f64]) -> Vec<f64> {
        widths.iter().zip(&self.units.lengths).map(|(w, l)| w / l).collect()
    }

    /// The comparison of an analysed proposal with the current design and with its prediction.
    fn acceptance_test(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> AcceptanceTest {
        let evaluation = &analyzed.evaluation;
        let rows = self.linearized.rows.iter().map(|row| row.constraint);
        let weighted = proposal.solution.multipliers.iter().copied().zip(rows);
        AcceptanceTest {
            from: DesignMerit { objective: self.state.evaluation.objective, violation: self.violation },
            predicted: proposal.predicted,
            to: DesignMerit::new(evaluation.objective, &evaluation.violations(), &self.units),
            restoration: proposal.restoration,
            objective_per_violation: self.units.objective_per_violation(weighted),
            objective_range: self.units.objective_range,
        }
    }

    /// The decision on an analysed proposal.
    fn decide(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> Decision {
        let accept_if = |is_accepted| if is_accepted { Decision::Decrease } else { Decision::Rejected };
        match proposal.purpose {
            Purpose::Improvement => {
                let entries = self.memory.filter.iter();
                let filter = entries.map(|e| DesignMerit::new(e.objective, &e.violations, &self.units));
                self.acceptance_test(proposal, analyzed).decide(filter)
            }
            Purpose::Curvature | Purpose::Flat | Purpose::Bound => {
                // With the peak that was found as its bound, no row of a peak would be violated.
                let refutes = |a: &AnalyzedDesign| self.refutes_minimum(proposal, a) && !self.is_much_worse(a);
                accept_if(match self.problem.objective.peak() {
                    Some(_) => self.as_proposed(proposal, analyzed).is_ok_and(|proposed| refutes(&proposed)),
                    None => refutes(analyzed),
                })
            }
            Purpose::Displacement => {
                // The lengths of variables that start at zero are guesses: shorter displacements from a flat start are tried first.
                let must_decrease = self.is_flat_start() && self.memory.rejections < SIZES;
                let increases = analyzed.evaluation.objective >= self.state.evaluation.objective;
                accept_if(!(must_decrease && increases))
            }
            Purpose::Return => Decision::Decrease,
        }
    }

    /// True for a design whose violation or objective is so much larger that a smaller Lagrangian does not show a better region.
    fn is_much_worse(&self, analyzed: &AnalyzedDesign) -> bool {
        let evaluation = &analyzed.evaluation;
        let change = largest_change(&self.linearized.gradient, &self.units.lengths) + self.units.objective_range;
        self.units.violation(&evaluation.violations()) > MAX_VIOLATION * self.violation.max(1.0)
            || evaluation.objective > self.state.evaluation.objective + MAX_VIOLATION * change
    }

    /// The current design as an entry of the filter.
    fn filter_entry(&self) -> FilterEntry {
        let evaluation = &self.state.evaluation;
        FilterEntry { objective: evaluation.objective, violations: evaluation.violations() }
    }

    fn rejected_point(&self, analyzed: &AnalyzedDesign) -> RejectedPoint {
        let value = |n: &ApproximatedValue| n.id.value(&analyzed.responses, &analyzed.evaluation);
        RejectedPoint { design: analyzed.design.clone(), values: self.current().numbers.iter().map(value).collect() }
    }
}
