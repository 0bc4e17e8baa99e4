//! The approximate problem (10)–(12) of a cycle.

use super::{AnyModel, Approximation, Evaluates, Expansion, Sample};
use crate::error::Result;
use crate::problem::{
    Evaluation, Gradients, Instant, Number, Problem, Program, Quantity, Responses, RowId, Sensitivities, Structure,
    Values,
};
use crate::scalar::{Degree, HyperDual, hessian, jacobian};
use nalgebra::DMatrix;
use std::sync::Arc;

/// Minimize F̃(b) subject to g̃_j(b, tₚ) ≤ c_j at the kept time points, inside the search subregion.
///
/// The approximate responses are models; objective and constraints are the problem's own functions of them. Rows read
/// ĝ − 1 ≤ 0, so a row value of 0.01 is a violation of 1 %.
pub struct ApproximateProblem<'a> {
    problem: &'a Problem,
    /// Kept constraints and time points, in order.
    pub kept: Vec<RowId>,
    /// Instants whose response is approximated, sorted, and the model of each.
    models: Vec<(Instant, Arc<dyn AnyModel>)>,
    /// Models of quantities that are approximated directly: the objective's, then one for each kept row.
    direct: (DirectModel, Vec<DirectModel>),
    lower: Vec<f64>,
    upper: Vec<f64>,
}

/// The model of a quantity that is approximated itself; none where its explicit form is kept.
type DirectModel = Option<Arc<dyn AnyModel>>;

/// What is known at the start design of a cycle.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a> {
    /// The design b₀.
    pub design: &'a [f64],
    /// Responses there.
    pub responses: &'a Responses,
    /// Objective and constraints there.
    pub evaluation: &'a Evaluation,
    /// Sensitivities at the instants of all kept quantities.
    pub sensitivities: &'a Sensitivities,
}

impl<'a> ApproximateProblem<'a> {
    /// Builds the approximate problem of the kept rows inside `lower ≤ b ≤ upper`.
    pub fn new(
        problem: &'a Problem,
        approximation: &dyn Approximation,
        known: Known,
        kept: Vec<RowId>,
        (lower, upper): (Vec<f64>, Vec<f64>),
    ) -> Result<Self> {
        let mut models = Vec::with_capacity(known.sensitivities.instants.len());
        for (row, &instant) in known.sensitivities.instants.iter().enumerate() {
            let declared = &problem.responses[instant.response];
            let gradient: Vec<f64> = known.sensitivities.rows.row(row).iter().copied().collect();
            let here = Sample { design: known.design, value: known.responses.at(instant), gradient: &gradient };
            let intermediates = &declared.intermediates;
            models.push((
                instant,
                approximation.fit(&Expansion { name: &declared.name, here, before: None, intermediates })?,
            ));
        }
        let fit = |quantity: &Quantity, p, name: &str| -> Result<DirectModel> {
            let Some(intermediates) = &quantity.direct else { return Ok(None) };
            let Known { design, responses, sensitivities, .. } = known;
            let gradient = problem.total_derivative(quantity, p, design, responses, sensitivities);
            let value = quantity.value(p, &problem.grids, design, |h, p| responses.at(problem.instant(h, p)));
            let here = Sample { design, value, gradient: &gradient };
            approximation.fit(&Expansion { name, here, before: None, intermediates }).map(Some)
        };
        let objective = fit(&problem.objective, 0, &problem.objective_name)?;
        let row = |r: &RowId| {
            fit(&problem.constraints[r.constraint].quantity, r.point, &problem.constraints[r.constraint].name)
        };
        let rows = kept.iter().map(row).collect::<Result<_>>()?;
        Ok(Self { problem, kept, models, direct: (objective, rows), lower, upper })
    }

    /// The instants that objective and kept rows need, sorted.
    pub fn instants(problem: &Problem, kept: &[RowId]) -> Vec<Instant> {
        let rows = kept.iter().flat_map(|r| problem.instants_of(&problem.constraints[r.constraint].quantity, r.point));
        let mut instants: Vec<Instant> = rows.chain(problem.instants_of(&problem.objective, 0)).collect();
        instants.sort_unstable();
        instants.dedup();
        instants
    }

    /// F̃ and the rows ĝ − 1, in any number type.
    fn all<S: Number + Evaluates>(&self, b: &[S], wanted: impl Fn(usize) -> bool) -> (S, Vec<S>) {
        let responses: Vec<S> = self.models.iter().map(|(_, model)| S::of(&**model, b)).collect();
        let value = |quantity: &Quantity, p, direct: &DirectModel| match direct {
            Some(model) => S::of(&**model, b),
            None => quantity.value(p, &self.problem.grids, b, |h, p| {
                let instant = self.problem.instant(h, p);
                let index = self.models.binary_search_by_key(&instant, |(i, _)| *i);
                responses[index.expect("every instant of a kept quantity has a model")]
            }),
        };
        let objective = value(&self.problem.objective, 0, &self.direct.0);
        let row = |(i, r): (usize, &RowId)| {
            if !wanted(i) {
                return S::from(0.0);
            }
            let constraint = &self.problem.constraints[r.constraint];
            constraint.normalised(value(&constraint.quantity, r.point, &self.direct.1[i])) - 1.0
        };
        (objective, self.kept.iter().enumerate().map(row).collect())
    }
}

impl Program for ApproximateProblem<'_> {
    fn variables(&self) -> usize {
        self.problem.n()
    }
    fn rows(&self) -> usize {
        self.kept.len()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }

    /// Recognized by evaluating everything once with numbers that know their polynomial degree.
    fn structure(&self) -> Structure {
        let middle = self.lower.iter().zip(&self.upper).map(|(l, u)| Degree::variable(0.5 * (l + u)));
        let (objective, rows) = self.all(&middle.collect::<Vec<_>>(), |_| true);
        let linear = rows.iter().all(|r| r.degree <= 1);
        match objective.degree {
            0 | 1 if linear => Structure::Linear,
            2 if linear => Structure::Quadratic,
            _ => Structure::Nonlinear,
        }
    }

    fn values(&self, x: &[f64]) -> Result<Values> {
        let (objective, rows) = self.all(x, |_| true);
        Ok(Values { objective, rows })
    }

    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let both = |x: &[crate::scalar::Dual]| {
            let (objective, mut rows) = self.all(x, |_| true);
            rows.push(objective);
            rows
        };
        let (mut rows, mut slopes) = jacobian(both, x);
        let objective = rows.pop().expect("the objective was pushed last");
        let gradient = slopes.row(rows.len()).iter().copied().collect();
        slopes = slopes.remove_row(rows.len());
        Ok(Gradients { values: Values { objective, rows }, objective: gradient, rows: slopes })
    }

    fn lagrangian_hessian(&self, x: &[f64], multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        let lagrangian = |x: &[HyperDual]| {
            let (objective, rows) = self.all(x, |i| multipliers[i] != 0.0);
            let active = rows.iter().zip(multipliers).filter(|(_, l)| **l != 0.0);
            active.fold(objective, |sum, (&g, &l)| sum + g * l)
        };
        Ok(Some(hessian(lagrangian, x).2))
    }
}
