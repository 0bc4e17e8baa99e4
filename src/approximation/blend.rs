//! Approximate problems that are sums over their variables.

use super::AnyModel;
use super::problem::ApproximateProblem;
use crate::problem::{Problem, ProblemScalar, Quantity, ResponseAt};
use autodiff::{Dual, PolynomialDegree, gradient};
use nlp::Program;
use nlp::separable::Term;
use std::sync::Arc;

/// Variables up to which slopes of explicit functions of the design are worth their cost, which grows with n².
const LARGE: usize = 5000;

/// Objective and rows as sums of convex functions of one variable each: constants, shares of separable models, slopes in the
/// design variables, and conservatism.
pub(super) struct SeparableSum {
    functions: Vec<Share>,
    origin: Vec<f64>,
    scale: Vec<f64>,
}

/// One function: the objective or a row.
struct Share {
    constant: f64,
    models: Vec<(f64, Arc<dyn AnyModel>)>,
    /// Empty where the function does not depend on the design but through models.
    slopes: Vec<f64>,
    conservatism: f64,
}

impl SeparableSum {
    /// The approximate problem as such a sum; none where a quantity is not linear in responses and design, a model is not
    /// separable, a term bends down, a row is an equality or drifts, or the box is not finite.
    pub fn of(problem: &ApproximateProblem) -> Option<Self> {
        let rows = problem.rows();
        let finite = problem.lower().iter().chain(problem.upper()).all(|v| v.is_finite());
        if !finite || problem.drifts.iter().any(Option::is_some) || (0..rows).any(|i| problem.is_equality(i)) {
            return None;
        }
        let definition = problem.problem;
        let objective = share(problem, &definition.objective, 0, &problem.direct.0, problem.rho(0))?;
        let mut functions = vec![objective];
        for (row, direct) in problem.kept.iter().zip(&problem.direct.1) {
            let constraint = &definition.constraints[row.constraint];
            let mut one = share(problem, &constraint.quantity, row.point, direct, 0.0)?;
            one.constant = (one.constant - constraint.limit) / constraint.scale;
            one.models.iter_mut().for_each(|(c, _)| *c /= constraint.scale);
            one.slopes.iter_mut().for_each(|s| *s /= constraint.scale);
            one.conservatism = problem.rho(row.constraint + 1);
            functions.push(one);
        }
        let blend = Self { functions, origin: problem.origin.clone(), scale: problem.subproblem_box.scale.clone() };
        // Each form keeps the sign of its curvature between the sides of the box.
        let convex = |share: &Share| {
            share
                .models
                .iter()
                .all(|(c, m)| (0..blend.origin.len()).all(|j| c * m.term(j, blend.origin[j]).curvature >= 0.0))
        };
        blend.functions.iter().all(convex).then_some(blend)
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

/// A quantity as a sum, before it is normalised.
fn share(
    problem: &ApproximateProblem,
    quantity: &Quantity,
    p: usize,
    direct: &Option<Arc<dyn AnyModel>>,
    conservatism: f64,
) -> Option<Share> {
    if let Some(model) = direct {
        let models = vec![(1.0, model.clone())];
        return Some(Share { constant: model.constant()?, models, slopes: vec![], conservatism });
    }
    let instants = problem.problem.instants_of(quantity, p);
    let model_of = |i: &ResponseAt| problem.models.binary_search_by_key(i, |(instant, _)| *instant);
    let models: Vec<&Arc<dyn AnyModel>> =
        instants.iter().map(|i| &problem.models[model_of(i).expect("every instant has a model")].1).collect();
    let explicit = Explicit { problem: problem.problem, quantity, p, instants: &instants };
    let mut z: Vec<f64> = models.iter().map(|m| m.real(&problem.origin)).collect();
    let seen = z.len();
    z.extend(&problem.origin);
    let degree = |from: usize| {
        let seeded = z
            .iter()
            .enumerate()
            .map(|(i, &v)| if i < from { PolynomialDegree::from(v) } else { PolynomialDegree::variable(v) });
        explicit.value(&seeded.collect::<Vec<_>>(), seen).degree
    };
    let uses_design = degree(seen) > 0;
    if degree(0) > 1 || (uses_design && problem.origin.len() > LARGE) {
        return None;
    }
    let (value, slopes) = if uses_design {
        gradient(|z| explicit.value(z, seen), &z)
    } else {
        let fixed: Vec<Dual> = problem.origin.iter().map(|&v| Dual::from_re(v)).collect();
        gradient(|z| explicit.value(&[z, &fixed].concat(), seen), &z[..seen])
    };
    let mut constant = value - slopes.iter().zip(&z).map(|(s, v)| s * v).sum::<f64>();
    let mut shares = Vec::with_capacity(seen);
    for (model, &weight) in models.into_iter().zip(&slopes).filter(|(_, w)| **w != 0.0) {
        constant += weight * model.constant()?;
        shares.push((weight, model.clone()));
    }
    Some(Share { constant, models: shares, slopes: slopes[seen..].to_vec(), conservatism })
}

/// A quantity as a function of its responses at `instants` and then of the design.
struct Explicit<'a> {
    problem: &'a Problem,
    quantity: &'a Quantity,
    p: usize,
    instants: &'a [ResponseAt],
}

impl Explicit<'_> {
    fn value<S: ProblemScalar>(&self, z: &[S], seen: usize) -> S {
        self.quantity.value(self.p, &self.problem.grids, &z[seen..], |h, p| {
            let instant = self.problem.instant(h, p);
            z[self.instants.binary_search(&instant).expect("it is among the instants of the quantity")]
        })
    }
}
