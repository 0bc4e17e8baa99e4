//! Objective and constraints as functions of the fitted models.

use super::fitted_models::{DirectModel, FittedModels};
use super::{Evaluates, SubproblemBox};
use crate::problem::{Problem, ProblemScalar, RowId, SignedQuantity};
use nlp::LowRank;

/// F̃ and the rows ĝ − 1 of the approximate problem, in any number type.
pub(super) struct ApproximateFunctions<'a> {
    pub problem: &'a Problem,
    /// Retained constraints and time points, in order.
    pub retained: Vec<RowId>,
    pub models: FittedModels,
    /// Start design of the cycle.
    pub origin: Vec<f64>,
    pub subproblem_box: SubproblemBox,
    /// ρ of the objective, then of each constraint.
    pub conservatism: Vec<f64>,
    /// A quadratic that is added to the objective.
    pub curvature: Option<LowRank>,
}

impl ApproximateFunctions<'_> {
    /// w(b) = ½ Σ ((bₖ − b₀ₖ)/scaleₖ)², the distance from the start design in which conservatism is measured.
    pub fn distance<S: ProblemScalar>(&self, b: &[S]) -> S {
        let step = |((&b, &o), &s): ((&S, &f64), &f64)| (b - o) / s;
        let steps = b.iter().zip(&self.origin).zip(&self.subproblem_box.scale).map(step);
        steps.fold(S::from(0.0), |sum, d| sum + d * d) * 0.5
    }

    /// ρ of the objective (0) or of a constraint (its index + 1).
    pub fn rho(&self, i: usize) -> f64 {
        self.conservatism.get(i).copied().unwrap_or(0.0)
    }

    pub fn is_equality(&self, row: &RowId) -> bool {
        self.problem.constraints[row.constraint].is_equality()
    }

    /// F̃ and the rows that `wanted` selects; zero for the other rows.
    pub fn values<S: ProblemScalar + Evaluates>(&self, b: &[S], wanted: impl Fn(usize) -> bool) -> (S, Vec<S>) {
        let responses: Vec<S> = self.models.responses.iter().map(|(_, model)| S::of(&**model, b)).collect();
        let negated: Vec<Option<S>> =
            self.models.negated.iter().map(|model| model.as_ref().map(|m| S::of(&**m, b))).collect();
        let value = |signed: SignedQuantity, p, direct: &DirectModel, function: usize| match direct {
            Some(model) => S::of(&**model, b),
            None => signed.value(p, &self.problem.grids, b, |h, p| {
                let at = self.problem.response_at(h, p);
                let k = self.models.index_of(at);
                let opposite = negated[k].filter(|_| self.models.decreasing[function].binary_search(&at).is_ok());
                opposite.unwrap_or(responses[k])
            }),
        };
        let distance = self.conservatism.iter().any(|rho| *rho != 0.0).then(|| self.distance(b));
        let conservative =
            |v: S, i: usize| distance.map_or(v, |w| if self.rho(i) == 0.0 { v } else { v + w * self.rho(i) });
        let quadratic = self.curvature.as_ref().map_or(S::from(0.0), |c| c.at(b));
        let objective = value(self.problem.objective.signed(), 0, &self.models.objective, 0);
        let objective = conservative(objective + quadratic, 0);
        let row = |(i, r): (usize, &RowId)| {
            if !wanted(i) {
                return S::from(0.0);
            }
            let constraint = &self.problem.constraints[r.constraint];
            let g = match &self.models.peaks[i] {
                Some(moving) => {
                    let responses: Vec<S> = moving.models.iter().map(|m| S::of(&**m, b)).collect();
                    let here = constraint.signed().value_at(&responses, b, S::from(moving.peak.time));
                    constraint.normalized(here) + moving.rise(b, &self.origin)
                }
                None => constraint.normalized(value(constraint.signed(), r.point, &self.models.rows[i], i + 1)),
            };
            conservative(g, r.constraint + 1) - 1.0
        };
        (objective, self.retained.iter().enumerate().map(row).collect())
    }
}
