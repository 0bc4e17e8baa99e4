//! The approximate problem (10)–(12) of a cycle.

use super::blend::SeparableSum;
use super::drift::MovingPeak;
use super::fitting::Fitting;
use super::{AnyModel, Approximation, Evaluates, PreviousPoint, SubproblemBox};
use crate::problem::{Evaluation, Peak, Problem, ProblemScalar, Quantity, ResponseAt, Responses, RowId, Sensitivities};
use autodiff::{Dual, HyperDual, PolynomialDegree, hessian, jacobian};
use error::Result;
use nalgebra::{DMatrix, SymmetricEigen};
use nlp::separable::{self, Separable, Term};
use nlp::{Gradients, LowRank, Program, Structure, Values};
use std::borrow::Cow;
use std::sync::Arc;

/// Variables up to which the Hessian of each row is looked at, and rows up to which it is.
const SMALL: usize = 60;

/// Minimize F̃(b) subject to g̃_j(b, tₚ) ≤ c_j at the kept time points, inside the search subregion.
///
/// The approximate responses are models; objective and constraints are the problem's own functions of them. Rows read
/// ĝ − 1 ≤ 0, so a row value of 0.01 is a violation of 1 %; rows of equality constraints read ĝ − 1 = 0.
pub struct ApproximateProblem<'a> {
    pub(super) problem: &'a Problem,
    /// Kept constraints and time points, in order.
    pub kept: Vec<RowId>,
    /// Instants whose response is approximated, sorted, and the model of each.
    pub(super) models: Vec<(ResponseAt, Arc<dyn AnyModel>)>,
    /// Models of quantities that are approximated directly: the objective's, then one for each kept row.
    pub(super) direct: (DirectModel, Vec<DirectModel>),
    /// For each kept row the peak in continuous time, if it is one.
    pub(super) drifts: Vec<Option<MovingPeak>>,
    pub(super) origin: Vec<f64>,
    pub(super) subproblem_box: SubproblemBox,
    /// ρ of the objective, then of each constraint.
    pub(super) conservatism: Vec<f64>,
    /// What is added to the objective.
    curvature: Option<LowRank>,
    blend: Option<SeparableSum>,
    structure: Structure,
    factors: Option<Vec<Option<DMatrix<f64>>>>,
}

/// The model of a quantity that is approximated itself; none where its explicit form is kept.
pub(super) type DirectModel = Option<Arc<dyn AnyModel>>;

/// What is known at the start design of a cycle.
#[derive(Clone, Copy, Debug)]
pub struct LinearizationPoint<'a> {
    /// The design b₀.
    pub design: &'a [f64],
    /// Responses there.
    pub responses: &'a Responses,
    /// Objective and constraints there.
    pub evaluation: &'a Evaluation,
    /// Sensitivities at the instants of all kept quantities.
    pub sensitivities: &'a Sensitivities,
    /// Second derivatives at the same instants, if they were asked for.
    pub curvatures: Option<&'a [DMatrix<f64>]>,
    /// The kept peaks of constraints in continuous time.
    pub peaks: &'a [Peak],
    /// Designs accepted before, the newest first.
    pub past: &'a [PreviousPoint],
}

impl<'a> LinearizationPoint<'a> {
    /// What a first-order method knows: no second derivatives, no peaks in continuous time, no earlier designs.
    pub fn first_order(
        design: &'a [f64],
        responses: &'a Responses,
        evaluation: &'a Evaluation,
        sensitivities: &'a Sensitivities,
    ) -> Self {
        Self { design, responses, evaluation, sensitivities, curvatures: None, peaks: &[], past: &[] }
    }
}

/// How the approximate problem is made, apart from the approximation.
#[derive(Clone, Debug, Default)]
pub struct ApproximationOptions {
    /// ρ of the objective and of each constraint, in the unit of each: ρ·w(b) with
    /// w = ½ Σ ((bₖ − b₀ₖ)/scaleₖ)² is added. Empty for none.
    pub conservatism: Vec<f64>,
    /// Whether peaks in continuous time drift with the design.
    pub drifting: bool,
    /// A convex quadratic about the start design that is added to the objective.
    pub curvature: Option<LowRank>,
}

impl<'a> ApproximateProblem<'a> {
    /// Builds the approximate problem of the kept rows inside the search region of `subproblem_box`, and where the models hold.
    pub fn new(
        problem: &'a Problem,
        approximation: &dyn Approximation,
        known: LinearizationPoint,
        kept: Vec<RowId>,
        (mut subproblem_box, manner): (SubproblemBox, ApproximationOptions),
    ) -> Result<Self> {
        let fitting = Fitting { problem, approximation, known, subproblem_box: &subproblem_box };
        let models = fitting.responses()?;
        let direct = fitting.quantities(&kept)?;
        let drifts = fitting.peaks(&kept, manner.drifting)?;
        let all = models.iter().map(|(_, m)| m).chain(direct.0.iter()).chain(direct.1.iter().flatten());
        let domains: Vec<_> = all.chain(drifts.iter().flatten().flat_map(|d| &d.models)).cloned().collect();
        for [lower, upper] in domains.iter().filter_map(|m| m.domain()) {
            subproblem_box.lower.iter_mut().zip(lower).for_each(|(s, l)| *s = s.max(*l));
            subproblem_box.upper.iter_mut().zip(upper).for_each(|(s, u)| *s = s.min(*u));
        }
        let (origin, conservatism, curvature) = (known.design.to_vec(), manner.conservatism, manner.curvature);
        let mut approximate = Self {
            problem,
            kept,
            models,
            direct,
            drifts,
            origin,
            subproblem_box,
            conservatism,
            curvature,
            blend: None,
            structure: Structure::Nonlinear,
            factors: None,
        };
        approximate.recognize();
        Ok(approximate)
    }

    /// The instants that objective and kept rows need, sorted. Peaks in continuous time bring their own.
    pub fn instants(problem: &Problem, kept: &[RowId]) -> Vec<ResponseAt> {
        let on_grid = kept.iter().filter(|r| !problem.constraints[r.constraint].is_continuous);
        let rows = on_grid.flat_map(|r| problem.instants_of(&problem.constraints[r.constraint].quantity, r.point));
        let mut instants: Vec<ResponseAt> = rows.chain(problem.instants_of(&problem.objective, 0)).collect();
        instants.sort_unstable();
        instants.dedup();
        instants
    }

    /// w(b), the distance from the start design that conservatism is measured in.
    pub fn distance<S: ProblemScalar>(&self, b: &[S]) -> S {
        let step = |((&b, &o), &s): ((&S, &f64), &f64)| (b - o) / s;
        let steps = b.iter().zip(&self.origin).zip(&self.subproblem_box.scale).map(step);
        steps.fold(S::from(0.0), |sum, d| sum + d * d) * 0.5
    }

    /// ρ of the objective (0) or of a constraint (its index + 1).
    pub(super) fn rho(&self, i: usize) -> f64 {
        self.conservatism.get(i).copied().unwrap_or(0.0)
    }

    /// F̃ and the rows ĝ − 1, in any number type.
    fn all<S: ProblemScalar + Evaluates>(&self, b: &[S], wanted: impl Fn(usize) -> bool) -> (S, Vec<S>) {
        let responses: Vec<S> = self.models.iter().map(|(_, model)| S::of(&**model, b)).collect();
        let value = |quantity: &Quantity, p, direct: &DirectModel| match direct {
            Some(model) => S::of(&**model, b),
            None => quantity.value(p, &self.problem.grids, b, |h, p| {
                let instant = self.problem.instant(h, p);
                let index = self.models.binary_search_by_key(&instant, |(i, _)| *i);
                responses[index.expect("every instant of a kept quantity has a model")]
            }),
        };
        let guard = self.conservatism.iter().any(|rho| *rho != 0.0).then(|| self.distance(b));
        let guarded = |v: S, i: usize| guard.map_or(v, |w| if self.rho(i) == 0.0 { v } else { v + w * self.rho(i) });
        let bend = self.curvature.as_ref().map_or(S::from(0.0), |c| c.at(b));
        let objective = guarded(value(&self.problem.objective, 0, &self.direct.0) + bend, 0);
        let row = |(i, r): (usize, &RowId)| {
            if !wanted(i) {
                return S::from(0.0);
            }
            let constraint = &self.problem.constraints[r.constraint];
            let g = match &self.drifts[i] {
                Some(drift) => {
                    let seen: Vec<S> = drift.models.iter().map(|m| S::of(&**m, b)).collect();
                    let here = constraint.quantity.value_at(&seen, b, S::from(drift.peak.time));
                    constraint.normalised(here) + drift.rise(b, &self.origin)
                }
                None => constraint.normalised(value(&constraint.quantity, r.point, &self.direct.1[i])),
            };
            guarded(g, r.constraint + 1) - 1.0
        };
        (objective, self.kept.iter().enumerate().map(row).collect())
    }

    /// Structure, cones and separability, from numbers that know their polynomial degree.
    fn recognize(&mut self) {
        let middle = self.lower().iter().zip(self.upper()).map(|(l, u)| PolynomialDegree::variable(0.5 * (l + u)));
        let (objective, rows) = self.all(&middle.collect::<Vec<_>>(), |_| true);
        let bent = |(i, row): (usize, &PolynomialDegree)| match &self.drifts[i] {
            Some(d) if !d.stays_quadratic(&self.origin, self.lower(), self.upper()) => PolynomialDegree::NONLINEAR,
            // In the middle of the box the peak may stand still by chance.
            Some(d) if d.corrects && d.peak.reach.iter().any(|t| *t > 0.0) => row.degree.max(2),
            _ => row.degree,
        };
        let degrees: Vec<u8> = rows.iter().enumerate().map(bent).collect();
        let most = degrees.iter().copied().max().unwrap_or(0);
        self.structure = match objective.degree {
            0 | 1 if most <= 1 => Structure::Linear,
            2 if most <= 1 => Structure::Quadratic,
            _ => Structure::Nonlinear,
        };
        let small = self.kept.len() <= SMALL && self.origin.len() <= SMALL;
        if self.structure == Structure::Nonlinear && objective.degree <= 2 && most == 2 && small {
            self.factors = self.cones(&degrees);
        }
        let large = self.curvature.is_some() && self.origin.len() > SMALL;
        if large || (self.structure == Structure::Nonlinear && self.factors.is_none()) {
            self.blend = SeparableSum::of(self);
        }
    }

    /// A factor of the Hessian of each quadratic row; none unless objective and all rows are convex.
    fn cones(&self, degrees: &[u8]) -> Option<Vec<Option<DMatrix<f64>>>> {
        factor(hessian(|b: &[HyperDual]| self.all(b, |_| false).0, &self.origin).2)?;
        let row = |(i, &degree): (usize, &u8)| -> Option<Option<DMatrix<f64>>> {
            if degree <= 1 {
                return Some(None);
            }
            if self.is_equality(i) {
                return None;
            }
            factor(hessian(|b: &[HyperDual]| self.all(b, |k| k == i).1[i], &self.origin).2).map(Some)
        };
        degrees.iter().enumerate().map(row).collect()
    }
}

/// C with CᵀC = H for a positive semidefinite H; none for any other.
fn factor(h: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let eigen = SymmetricEigen::new(h);
    let most = eigen.eigenvalues.amax();
    if eigen.eigenvalues.iter().any(|&v| v < -1e-12 * most) {
        return None;
    }
    let good: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] > 1e-14 * most).collect();
    let n = eigen.eigenvalues.len();
    Some(DMatrix::from_fn(good.len(), n, |i, j| eigen.eigenvalues[good[i]].sqrt() * eigen.eigenvectors[(j, good[i])]))
}

impl Program for ApproximateProblem<'_> {
    fn variables(&self) -> usize {
        self.problem.n()
    }
    fn rows(&self) -> usize {
        self.kept.len()
    }
    fn lower(&self) -> &[f64] {
        &self.subproblem_box.lower
    }
    fn upper(&self) -> &[f64] {
        &self.subproblem_box.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        self.problem.constraints[self.kept[i].constraint].is_equality
    }
    /// Recognized once by evaluating everything with numbers that know their polynomial degree.
    fn structure(&self) -> Structure {
        self.structure
    }
    fn row_factors(&self) -> Option<Vec<Option<DMatrix<f64>>>> {
        self.factors.clone()
    }
    fn separable(&self) -> Option<&dyn Separable> {
        (self.blend.is_some() && self.curvature.is_none()).then_some(self as &dyn Separable)
    }
    fn coupled(&self) -> Option<(&dyn Separable, Cow<'_, LowRank>)> {
        let curvature = self.curvature.as_ref().filter(|_| self.blend.is_some())?;
        Some((self as &dyn Separable, Cow::Borrowed(curvature)))
    }

    fn values(&self, x: &[f64]) -> Result<Values> {
        if self.blend.is_some() {
            let mut values = separable::values(self, x)?;
            values.objective += self.curvature.as_ref().map_or(0.0, |c| c.value_and_slope(x).0);
            return Ok(values);
        }
        let (objective, rows) = self.all(x, |_| true);
        Ok(Values { objective, rows })
    }

    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        if self.blend.is_some() {
            let mut gradients = separable::gradients(self, x)?;
            if let Some(curvature) = &self.curvature {
                let (value, slope) = curvature.value_and_slope(x);
                gradients.values.objective += value;
                gradients.objective.iter_mut().zip(slope).for_each(|(g, s)| *g += s);
            }
            return Ok(gradients);
        }
        let both = |x: &[Dual]| {
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
        if self.blend.is_some() {
            let bend = self.curvature.as_ref();
            return Ok(separable::hessian(self, x, multipliers).map(|h| bend.map_or(h.clone(), |c| h + c.dense())));
        }
        let lagrangian = |x: &[HyperDual]| {
            let (objective, rows) = self.all(x, |i| multipliers[i] != 0.0);
            let active = rows.iter().zip(multipliers).filter(|(_, l)| **l != 0.0);
            active.fold(objective, |sum, (&g, &l)| sum + g * l)
        };
        Ok(Some(hessian(lagrangian, x).2))
    }
}

impl Separable for ApproximateProblem<'_> {
    fn constant(&self, i: usize) -> f64 {
        self.blend.as_ref().map_or(0.0, |blend| blend.constant(i))
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        self.blend.as_ref().map_or_else(Term::default, |blend| blend.term(i, j, x))
    }
}
