//! Separable approximate problems: sums of functions of one variable each.

use super::AnyModel;
use super::approximate_functions::ApproximateFunctions;
use super::fitted_models::DirectModel;
use crate::problem::{Problem, ProblemScalar, ResponseAt, SignedQuantity};
use autodiff::{Dual, PolynomialDegree, gradient};
use nlp::separable::Term;
use std::sync::Arc;

/// Number of variables up to which slopes of explicit functions of the design are computed: their cost grows with n².
const LARGE: usize = 5000;

/// Objective and rows as sums of convex functions of one variable each: constants, weighted separable models, slopes in the
/// design variables, and conservatism.
pub(super) struct SeparableSum {
    functions: Vec<SeparableFunction>,
    origin: Vec<f64>,
    scale: Vec<f64>,
}

/// The objective or a row: a constant, weighted separable models, slopes in the design variables, and conservatism.
struct SeparableFunction {
    constant: f64,
    models: Vec<(f64, Arc<dyn AnyModel>)>,
    /// Empty if the function depends on the design through models only.
    slopes: Vec<f64>,
    conservatism: f64,
}

impl SeparableSum {
    /// Converts the approximate problem to a sum.
    ///
    /// `None` if a quantity is not linear in responses and design, a model is not separable, a term is concave, a row is an
    /// equality or a peak in continuous time, or the box is not finite.
    pub fn of(all: &ApproximateFunctions) -> Option<Self> {
        let (lower, upper) = (&all.subproblem_box.lower, &all.subproblem_box.upper);
        let finite = lower.iter().chain(upper).all(|v| v.is_finite());
        if !finite || all.models.peaks.iter().any(Option::is_some) || all.retained.iter().any(|r| all.is_equality(r)) {
            return None;
        }
        let objective = share(all, 0, (all.problem.objective.signed(), 0), &all.models.objective, all.rho(0))?;
        let mut functions = vec![objective];
        for (i, (row, direct)) in all.retained.iter().zip(&all.models.rows).enumerate() {
            let constraint = &all.problem.constraints[row.constraint];
            let mut one = share(all, i + 1, (constraint.signed(), row.point), direct, 0.0)?;
            one.constant = (one.constant - constraint.signed_limit()) / constraint.scale;
            one.models.iter_mut().for_each(|(c, _)| *c /= constraint.scale);
            one.slopes.iter_mut().for_each(|s| *s /= constraint.scale);
            one.conservatism = all.rho(row.constraint + 1);
            functions.push(one);
        }
        let sum = Self { functions, origin: all.origin.clone(), scale: all.subproblem_box.scale.clone() };
        // The curvature of each form has one sign inside the box.
        let convex = |share: &SeparableFunction| {
            share
                .models
                .iter()
                .all(|(c, m)| (0..sum.origin.len()).all(|j| c * m.term(j, sum.origin[j]).curvature >= 0.0))
        };
        sum.functions.iter().all(convex).then_some(sum)
    }

    pub fn constant(&self, i: usize) -> f64 {
        self.functions[i].constant
    }

    pub fn term(&self, i: usize, j: usize, x: f64) -> Term {
        let share = &self.functions[i];
        let mut sum = Term::default();
        if let Some(&slope) = share.slopes.get(j) {
            sum = Term { value: slope * x, slope, curvature: 0.0 };
        }
        if share.conservatism != 0.0 {
            let (step, scale) = (x - self.origin[j], self.scale[j]);
            let c = share.conservatism / (scale * scale);
            sum = sum.plus(1.0, Term { value: 0.5 * c * step * step, slope: c * step, curvature: c });
        }
        share.models.iter().fold(sum, |sum, (c, m)| sum.plus(*c, m.term(j, x)))
    }
}

/// A quantity as a sum, before it is normalized; function 0 is the objective, function i + 1 is row i.
fn share(
    all: &ApproximateFunctions,
    function: usize,
    (signed, p): (SignedQuantity, usize),
    direct: &DirectModel,
    conservatism: f64,
) -> Option<SeparableFunction> {
    if let Some(model) = direct {
        let models = vec![(1.0, model.clone())];
        return Some(SeparableFunction { constant: model.constant()?, models, slopes: vec![], conservatism });
    }
    let used = all.problem.responses_of(signed.quantity, p);
    let model = |at: &ResponseAt| all.models.model_for(function, *at);
    let models: Vec<&Arc<dyn AnyModel>> = used.iter().map(model).collect();
    let explicit = ExplicitQuantity { problem: all.problem, signed, p, used: &used };
    let mut z: Vec<f64> = models.iter().map(|m| m.real(&all.origin)).collect();
    let count = z.len();
    z.extend(&all.origin);
    let degree = |from: usize| {
        let seeded = z
            .iter()
            .enumerate()
            .map(|(i, &v)| if i < from { PolynomialDegree::from(v) } else { PolynomialDegree::variable(v) });
        explicit.value(&seeded.collect::<Vec<_>>(), count).degree
    };
    let uses_design = degree(count) > 0;
    if degree(0) > 1 || (uses_design && all.origin.len() > LARGE) {
        return None;
    }
    let (value, slopes) = if uses_design {
        gradient(|z| explicit.value(z, count), &z)
    } else {
        let fixed: Vec<Dual> = all.origin.iter().map(|&v| Dual::from_re(v)).collect();
        gradient(|z| explicit.value(&[z, &fixed].concat(), count), &z[..count])
    };
    let mut constant = value - slopes.iter().zip(&z).map(|(s, v)| s * v).sum::<f64>();
    let mut shares = Vec::with_capacity(count);
    for (model, &weight) in models.into_iter().zip(&slopes).filter(|(_, w)| **w != 0.0) {
        constant += weight * model.constant()?;
        shares.push((weight, model.clone()));
    }
    Some(SeparableFunction { constant, models: shares, slopes: slopes[count..].to_vec(), conservatism })
}

/// A quantity as a function of the responses that it uses, followed by the design.
struct ExplicitQuantity<'a> {
    problem: &'a Problem,
    signed: SignedQuantity<'a>,
    p: usize,
    used: &'a [ResponseAt],
}

impl ExplicitQuantity<'_> {
    fn value<S: ProblemScalar>(&self, z: &[S], count: usize) -> S {
        self.signed.value(self.p, &self.problem.grids, &z[count..], |h, p| {
            let at = self.problem.response_at(h, p);
            z[self.used.binary_search(&at).expect("it is among the responses of the quantity")]
        })
    }
}
