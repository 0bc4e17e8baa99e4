//! Prediction errors of the candidate approximations at an analysed design.

use super::Scores;
use super::candidates::Samples;
use super::cycle_context::{CycleContext, SurrogateKind};
use super::linearized::Linearized;
use super::numbers::{NumberGroup, collect_numbers, find_number};
use super::proposal::Proposal;
use super::selection::{Observation, ObservedLagrangian, discount};
use super::surrogate::Surrogate;
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, RowId};

impl CycleContext<'_> {
    /// Updates the scores by the prediction errors of all candidates at an analysed design, whose derivatives are known if it
    /// was accepted.
    pub(super) fn score(
        &self,
        proposal: &Proposal,
        analyzed: &AnalyzedDesign,
        derivatives: Option<&CycleData>,
        scores: &mut Scores,
    ) {
        let numbers = &self.current().numbers;
        let AnalyzedDesign { design, responses, evaluation } = analyzed;
        let found = derivatives.map(|data| collect_numbers(self.problem, design, (responses, evaluation), data));
        let observed = numbers.iter().map(|number| {
            let there = found.as_ref().and_then(|found| find_number(self.problem, found, number.id));
            let value = number.id.value(responses, evaluation);
            (value, there.map_or_else(Vec::new, |there| there.gradient.clone()))
        });
        let origin = &self.state.design;
        let observation = Observation::new(design, origin, &self.units.lengths, observed.collect());
        let samples: Vec<Samples> = (0..numbers.len()).map(|k| self.samples(k)).collect();
        let mut groups: Vec<(NumberGroup, Vec<usize>)> = vec![];
        for (k, number) in numbers.iter().enumerate() {
            match groups.iter_mut().find(|(group, _)| *group == number.id.group()) {
                Some((_, members)) => members.push(k),
                None => groups.push((number.id.group(), vec![k])),
            }
        }
        let weights = &observation.weights;
        if let Some(lagrangian) = self.observed_lagrangian(proposal, analyzed, derivatives) {
            let λ = &proposal.solution.multipliers;
            let error = |surrogate: &Surrogate| lagrangian.error(&surrogate.gradients(design), λ, weights);
            let linear = self.surrogate(SurrogateKind::Linear).map_or(0.0, |s| error(&s));
            let of = |kind| {
                let surrogate = self.surrogate(kind)?;
                Some(lagrangian.quotient(error(&surrogate), linear, surrogate.is_defined(design)))
            };
            let (selected, whole) = (of(SurrogateKind::Selected), of(SurrogateKind::Lagrangian));
            discount(&mut scores.selected, selected);
            discount(&mut scores.lagrangian, whole);
        }
        for (group, members) in groups {
            let current = (&numbers[..], &origin[..]);
            scores.update(group, observation.quotients(&members, current, |k, candidate| samples[k].fit(candidate)));
        }
    }

    /// The Lagrangian at an analysed design with the multipliers of the subproblem.
    pub(super) fn observed_lagrangian(
        &self,
        proposal: &Proposal,
        analyzed: &AnalyzedDesign,
        derivatives: Option<&CycleData>,
    ) -> Option<ObservedLagrangian> {
        let λ = &proposal.solution.multipliers;
        let rows = self.linearized.rows.iter().zip(λ).filter(|(_, λ)| **λ != 0.0);
        let sum: f64 = rows.map(|(row, λ)| λ * analyzed.evaluation.residual_of(*row)).sum();
        let value = analyzed.evaluation.objective + sum;
        let gradient = derivatives.and_then(|data| {
            let AnalyzedDesign { design, responses, evaluation } = analyzed;
            let there = Linearized::new(self.problem, (design, responses, evaluation), data);
            let of = |row: &RowId| there.rows.iter().position(|r| r == row);
            let mut multipliers = vec![0.0; there.rows.len()];
            for (row, λ) in self.linearized.rows.iter().zip(λ).filter(|(_, λ)| **λ != 0.0) {
                multipliers[of(row)?] = *λ;
            }
            Some(there.lagrangian_gradient(&multipliers))
        });
        Some(ObservedLagrangian { value, gradient })
    }
}
