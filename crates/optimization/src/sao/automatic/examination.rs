//! The analysis of a proposed design, and the resulting changes of the data of the run.

use super::acceptance::{
    Decision, DesignMerit, LARGEST, TrialDecision, widths_after_acceptance, widths_after_rejection,
};
use super::convergence::largest_change;
use super::proposal::{Proposal, Purpose};
use super::situation::CycleContext;
use super::state::{AutomaticState, FilterEntry, RejectedPoint};
use super::stationary::{DISPLACEMENTS, SIZES, shortening};
use super::{ApproximatedValue, Scores};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, RowId};
use crate::sao::trial::{AnalysedProposal, Trial};
use crate::sao::{Cycle, Method, StepVerdict};
use error::Result;

/// A proposed design with its analysis.
pub(super) struct Examined {
    pub decision: Decision,
    pub analyzed: Result<AnalyzedDesign>,
    /// The derivatives there, if it was accepted or shows a curvature.
    pub derivatives: Option<CycleData>,
    /// Rows without prediction that are violated at it: the step is repeated with them.
    pub missed: Vec<RowId>,
}

/// Changes of the data of the run by a trial step, except for its points.
pub(super) struct DataChanges {
    scores: Scores,
    explorations: usize,
    widths: Vec<f64>,
    filter: FilterChange,
    /// The violations at a point that was left by a displacement.
    left: Option<Vec<f64>>,
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
    pub(super) fn update(&mut self, changes: DataChanges) {
        let DataChanges { scores, explorations, widths, filter, left, rejections, has_common_unit } = changes;
        (self.scores, self.explorations, self.widths) = (scores, explorations, widths);
        self.has_common_unit = has_common_unit;
        self.left.extend(left);
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
    pub(super) fn examine(&self, method: &Method, proposal: &Proposal) -> Examined {
        let mut analyzed = self.problem.analyze_design(&proposal.design);
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
        // The derivatives of a step that was made to see a curvature show more of it than its value.
        let is_wanted = decision != Decision::Rejected || (missed.is_empty() && self.shows_curvature(proposal));
        let derivatives = analyzed.as_ref().ok().filter(|_| is_wanted).map(|a| method.differentiate(self.problem, a));
        let derivatives = match derivatives.transpose() {
            Ok(derivatives) => derivatives,
            Err(error) => {
                (analyzed, decision) = (Err(error), Decision::Rejected);
                None
            }
        };
        Examined { decision, analyzed, derivatives, missed }
    }

    /// The row of the history for a proposal.
    pub(super) fn record(&self, method: &Method, proposal: &Proposal, examined: &Examined) -> Cycle {
        let Self { problem, state, .. } = self;
        let Proposal { region, at_limit, solution, .. } = proposal;
        let record = AnalysedProposal {
            data: self.data,
            region,
            solution,
            distance: 0.0,
            at_limit,
            analyzed: &examined.analyzed,
        };
        let from = (&state.design[..], &state.evaluation);
        let trial = Trial::new(problem, &method.screening, from, state.last_step.as_deref(), &record);
        let verdict = if examined.decision == Decision::Rejected { StepVerdict::Reject } else { StepVerdict::Accept };
        let cycle =
            Cycle::new(problem, state.cycles() + 1, &self.factors(&self.memory.widths), &trial, verdict, &record);
        Cycle { is_displaced: cycle.accepted && proposal.purpose != Purpose::Improvement, ..cycle }
    }

    /// The changes by a trial step.
    pub(super) fn changes(&self, proposal: &Proposal, examined: &Examined) -> DataChanges {
        let Examined { decision, analyzed, derivatives, missed } = examined;
        let (memory, purpose, analyzed) = (self.memory, proposal.purpose, analyzed.as_ref().ok());
        let is_accepted = *decision != Decision::Rejected;
        let mut changes = DataChanges {
            scores: memory.scores.clone(),
            explorations: self.explorations_after(purpose, is_accepted),
            widths: memory.widths.clone(),
            filter: FilterChange::None,
            left: None,
            rejections: if is_accepted { RejectionChange::Clear } else { RejectionChange::None },
            has_common_unit: memory.has_common_unit,
        };
        if let Some(analyzed) = analyzed {
            self.score(proposal, analyzed, derivatives.as_ref(), &mut changes.scores);
        }
        let widths = &mut changes.widths;
        let step: Vec<f64> = proposal.design.iter().zip(&self.state.design).map(|(to, from)| to - from).collect();
        if is_accepted && purpose == Purpose::Improvement {
            let ratio = analyzed.map_or(f64::NAN, |a| self.step(proposal, a).ratio());
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
            let shortening = if self.is_flat_start() { shortening(memory.rejections) } else { 1.0 };
            let least = |l: &f64| DISPLACEMENTS[0] * shortening * l;
            widths.iter_mut().zip(&self.units.lengths).for_each(|(w, l)| *w = w.max(least(l)));
            changes.filter = FilterChange::Clear;
            let is_left = purpose == Purpose::Displacement && self.violation > 0.0;
            changes.left = is_left.then(|| self.state.evaluation.violations());
        } else if missed.is_empty() && !matches!(purpose, Purpose::Curvature | Purpose::Flat) {
            widths_after_rejection(widths, &step, analyzed.is_some() && memory.rejections == 0);
            changes.rejections = RejectionChange::Add(analyzed.map(|a| self.rejected(a)));
        }
        changes
    }

    /// Half widths in lengths.
    pub(super) fn factors(&self, widths: &[f64]) -> Vec<f64> {
        widths.iter().zip(&self.units.lengths).map(|(w, l)| w / l).collect()
    }

    fn step(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> TrialDecision {
        let evaluation = &analyzed.evaluation;
        let rows = self.here.rows.iter().map(|row| row.constraint);
        let weighted = proposal.solution.multipliers.iter().copied().zip(rows);
        TrialDecision {
            from: DesignMerit { objective: self.state.evaluation.objective, violation: self.violation },
            predicted: proposal.predicted,
            to: DesignMerit::new(evaluation.objective, &evaluation.violations(), &self.units),
            restoration: proposal.restoration,
            objective_per_violation: self.units.objective_per_violation(weighted),
            objective_range: self.units.objective_range,
        }
    }

    fn decide(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> Decision {
        match proposal.purpose {
            Purpose::Improvement => {}
            Purpose::Curvature | Purpose::Flat if !self.leads_on(proposal, analyzed) => return Decision::Rejected,
            // The lengths of variables that start at zero are guesses.
            Purpose::Displacement
                if self.is_flat_start()
                    && self.memory.rejections < SIZES
                    && analyzed.evaluation.objective >= self.state.evaluation.objective =>
            {
                return Decision::Rejected;
            }
            Purpose::Curvature | Purpose::Flat if self.is_far_off(analyzed) => return Decision::Rejected,
            Purpose::Curvature | Purpose::Flat | Purpose::Displacement | Purpose::Return => return Decision::Decrease,
        }
        let filter = self.memory.filter.iter().map(|e| DesignMerit::new(e.objective, &e.violations, &self.units));
        self.step(proposal, analyzed).decide(filter)
    }

    /// True for a design whose violation or objective is so much larger that the Lagrangian says nothing of it.
    fn is_far_off(&self, analyzed: &AnalyzedDesign) -> bool {
        let evaluation = &analyzed.evaluation;
        let change = largest_change(&self.here.slope, &self.units.lengths) + self.units.objective_range;
        self.units.violation(&evaluation.violations()) > LARGEST * self.violation.max(1.0)
            || evaluation.objective > self.state.evaluation.objective + LARGEST * change
    }

    fn filter_entry(&self) -> FilterEntry {
        let evaluation = &self.state.evaluation;
        FilterEntry { objective: evaluation.objective, violations: evaluation.violations() }
    }

    fn rejected(&self, analyzed: &AnalyzedDesign) -> RejectedPoint {
        let value = |n: &ApproximatedValue| n.id.value(&analyzed.responses, &analyzed.evaluation);
        RejectedPoint { design: analyzed.design.clone(), values: self.current().numbers.iter().map(value).collect() }
    }
}
