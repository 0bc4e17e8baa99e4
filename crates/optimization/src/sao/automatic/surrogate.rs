//! The approximate problem of a cycle: objective and rows as functions of the chosen models.

use super::candidates::FittedApproximation;
use super::numbers::{ApproximatedValue, NumberId};
use crate::approximation::CycleData;
use crate::problem::{Problem, Responses, RowId, Sensitivities, SignedQuantity};
use autodiff::{Dual, gradient};
use error::Result;
use nalgebra::DMatrix;
use nlp::{Gradients, Program, Structure, Values};

/// Dependence of the objective or of a row on the numbers.
enum RowForm {
    /// weight · number + constant − β · share, with the index of the number and of the design variable β.
    Affine { number: usize, weight: f64, constant: f64, bound: Option<(usize, f64)> },
    /// The explicit function of responses, design and time.
    Explicit,
    /// An identity, whose rounding errors are ignored.
    Zero,
}

/// Objective and retained rows as functions of the models of their numbers, with an optional quadratic in the objective.
pub(super) struct Surrogate<'a> {
    problem: &'a Problem,
    ids: Vec<NumberId>,
    models: Vec<FittedApproximation>,
    /// Responses at the current design, which define the shape.
    responses: &'a Responses,
    rows: &'a [RowId],
    forms: Vec<RowForm>,
    objective: RowForm,
    design: Vec<f64>,
    /// B of ½ sᵀBs, added to the objective.
    pub hessian: Option<DMatrix<f64>>,
}

/// Model values and gradients of all responses, in the shape of an analysis.
struct ModelAnalysis {
    responses: Responses,
    sensitivities: Sensitivities,
}

impl<'a> Surrogate<'a> {
    /// The surrogate at `design` with a model for each of `numbers`.
    pub fn new(
        problem: &'a Problem,
        (design, responses): (&[f64], &'a Responses),
        data: &'a CycleData,
        numbers: &[ApproximatedValue],
        models: Vec<FittedApproximation>,
    ) -> Self {
        let ids: Vec<NumberId> = numbers.iter().map(|n| n.id).collect();
        let index = |id| ids.binary_search(&id).ok();
        let affine = |signed: SignedQuantity, p: usize, scale: f64, limit: f64| {
            let number = index(NumberId::Response(problem.response_at(signed.quantity.as_response()?, p)))?;
            let (weight, constant) = (signed.sign / scale, -limit / scale);
            Some(RowForm::Affine { number, weight, constant, bound: signed.bound.map(|k| (k, 1.0 / scale)) })
        };
        let row = |row: &RowId| {
            let constraint = &problem.constraints[row.constraint];
            if let Some(number) = index(NumberId::Row(*row)) {
                return RowForm::Affine { number, weight: 1.0, constant: 0.0, bound: None };
            }
            affine(constraint.signed(), row.point, constraint.scale, constraint.signed_limit())
                .unwrap_or(RowForm::Explicit)
        };
        let objective = match index(NumberId::Objective) {
            Some(number) => RowForm::Affine { number, weight: 1.0, constant: 0.0, bound: None },
            None => affine(problem.objective.signed(), 0, 1.0, 0.0).unwrap_or(RowForm::Explicit),
        };
        let forms = data.retained.iter().map(row).collect();
        let design = design.to_vec();
        Self { problem, ids, models, responses, rows: &data.retained, forms, objective, design, hessian: None }
    }

    /// Makes the rows zero that are `ignored`.
    pub fn ignore(&mut self, ignored: impl Fn(&RowId) -> bool) {
        let rows = self.forms.iter_mut().zip(self.rows);
        rows.filter(|(_, row)| ignored(row)).for_each(|(form, _)| *form = RowForm::Zero);
    }

    /// Adds the quadratics along the step to a rejected design that give all numbers their values there.
    pub fn correct(&mut self, design: &[f64], values: &[f64], lengths: &[f64]) {
        for (model, value) in self.models.iter_mut().zip(values) {
            model.correct(design, *value, lengths);
        }
        if let Some(b) = &mut self.hessian {
            // The corrected numbers contain all of the objective's error along this step.
            let n = lengths.len();
            let s = nalgebra::DVector::from_fn(n, |j, _| design[j] - self.design[j]);
            let m = nalgebra::DVector::from_fn(n, |j, _| s[j] / (lengths[j] * lengths[j]));
            let weight = -s.dot(&(&*b * &s)) / s.dot(&m).powi(2);
            if weight.is_finite() {
                b.ger(weight, &m, &m, 1.0);
            }
        }
    }

    /// The largest lower side of the domains of the models, for each variable.
    pub fn lower(&self, j: usize) -> f64 {
        self.models.iter().map(|m| m.lower(j)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// True if design `b` is in the domain of all models.
    pub fn is_defined(&self, b: &[f64]) -> bool {
        self.models.iter().all(|m| m.is_defined(b))
    }

    fn structure(&self) -> Structure {
        let is_affine = |form: &RowForm| match form {
            RowForm::Affine { number, .. } => self.models[*number].is_linear(),
            RowForm::Explicit => false,
            RowForm::Zero => true,
        };
        if !self.forms.iter().all(is_affine) {
            return Structure::Nonlinear;
        }
        match (&self.objective, &self.hessian) {
            (form, None) if is_affine(form) => Structure::Linear,
            (form, Some(_)) if is_affine(form) => Structure::Quadratic,
            _ => Structure::Nonlinear,
        }
    }

    fn signed(&self, i: Option<usize>) -> (SignedQuantity<'_>, usize) {
        match i {
            None => (self.problem.objective.signed(), 0),
            Some(i) => (self.problem.constraints[self.rows[i].constraint].signed(), self.rows[i].point),
        }
    }

    fn form(&self, i: Option<usize>) -> &RowForm {
        i.map_or(&self.objective, |i| &self.forms[i])
    }

    /// Objective (`None`) and rows.
    fn functions(&self) -> impl Iterator<Item = Option<usize>> + use<> {
        std::iter::once(None).chain((0..self.forms.len()).map(Some))
    }

    fn has_explicit_forms(&self) -> bool {
        self.functions().any(|i| matches!(self.form(i), RowForm::Explicit))
    }

    fn responses(&self, values: &[f64]) -> Responses {
        let mut responses = Responses::new(self.responses.values.clone());
        for (id, value) in self.ids.iter().zip(values) {
            if let NumberId::Response(at) = id {
                responses.values[at.response][at.point] = *value;
            }
        }
        responses
    }

    fn analysis(&self, values: &[f64], gradients: &[Vec<f64>]) -> ModelAnalysis {
        let of_responses = self.ids.iter().zip(gradients).filter_map(|(id, g)| match id {
            NumberId::Response(at) => Some((*at, g)),
            _ => None,
        });
        let (at, rows): (Vec<_>, Vec<_>) = of_responses.unzip();
        let flat = rows.iter().flat_map(|g| g.iter().copied());
        let rows = DMatrix::from_row_iterator(at.len(), self.design.len(), flat);
        ModelAnalysis { responses: self.responses(values), sensitivities: Sensitivities { at, rows } }
    }

    /// The normalization of a row: c = (signed − limit)/scale; that of the objective is trivial.
    fn normalization(&self, i: Option<usize>) -> (f64, f64) {
        i.map_or((0.0, 1.0), |i| {
            let constraint = &self.problem.constraints[self.rows[i].constraint];
            (constraint.signed_limit(), constraint.scale)
        })
    }

    fn step(&self, b: &[f64]) -> nalgebra::DVector<f64> {
        nalgebra::DVector::from_fn(b.len(), |j, _| b[j] - self.design[j])
    }

    /// Objective and rows c at design `b`.
    pub fn values(&self, b: &[f64]) -> Values {
        let numbers: Vec<f64> = self.models.iter().map(|m| m.value(b)).collect();
        let responses = self.has_explicit_forms().then(|| self.responses(&numbers));
        let value = |i: Option<usize>| match self.form(i) {
            RowForm::Affine { number, weight, constant, bound } => {
                weight * numbers[*number] + constant - bound.map_or(0.0, |(k, share)| share * b[k])
            }
            RowForm::Explicit => {
                let ((signed, p), (limit, scale)) = (self.signed(i), self.normalization(i));
                let responses = responses.as_ref().expect("there is an explicit form");
                let read = |h, p| responses.at(self.problem.response_at(h, p));
                (signed.value(p, &self.problem.grids, b, read) - limit) / scale
            }
            RowForm::Zero => 0.0,
        };
        let s = self.step(b);
        let quadratic = self.hessian.as_ref().map_or(0.0, |h| 0.5 * s.dot(&(h * &s)));
        Values { objective: value(None) + quadratic, rows: (0..self.forms.len()).map(|i| value(Some(i))).collect() }
    }

    /// Objective and rows c with their gradients at design `b`.
    pub fn gradients(&self, b: &[f64]) -> Gradients {
        let n = b.len();
        let values = self.values(b);
        let numbers: Vec<f64> = self.models.iter().map(|m| m.value(b)).collect();
        let gradients: Vec<Vec<f64>> = self.models.iter().map(|m| m.gradient(b)).collect();
        let analysis = self.has_explicit_forms().then(|| self.analysis(&numbers, &gradients));
        let slope = |i: Option<usize>| -> Vec<f64> {
            match self.form(i) {
                RowForm::Affine { number, weight, bound, .. } => {
                    let mut slope: Vec<f64> = gradients[*number].iter().map(|g| weight * g).collect();
                    bound.iter().for_each(|(k, share)| slope[*k] -= share);
                    slope
                }
                RowForm::Explicit => {
                    let ((signed, p), (_, scale)) = (self.signed(i), self.normalization(i));
                    let ModelAnalysis { responses, sensitivities } =
                        analysis.as_ref().expect("there is an explicit form");
                    let slope = self.problem.total_derivative(signed, p, b, responses, sensitivities);
                    slope.into_iter().map(|g| g / scale).collect()
                }
                RowForm::Zero => vec![0.0; n],
            }
        };
        let mut objective = slope(None);
        if let Some(h) = &self.hessian {
            let curved = h * self.step(b);
            objective.iter_mut().zip(curved.iter()).for_each(|(g, c)| *g += c);
        }
        let mut rows = DMatrix::zeros(self.forms.len(), n);
        for i in 0..self.forms.len() {
            slope(Some(i)).iter().enumerate().for_each(|(j, g)| rows[(i, j)] = *g);
        }
        Gradients { values, objective, rows }
    }

    /// Hessian of F + Σ λᵢ cᵢ at design `b`.
    pub fn lagrangian_hessian(&self, b: &[f64], multipliers: &[f64]) -> DMatrix<f64> {
        let n = b.len();
        let mut sum = self.hessian.clone().unwrap_or_else(|| DMatrix::zeros(n, n));
        let mut weights = vec![0.0; self.models.len()];
        let factor = |i: Option<usize>| i.map_or(1.0, |i| multipliers[i]);
        let mut explicit = vec![];
        for i in self.functions().filter(|&i| factor(i) != 0.0) {
            match self.form(i) {
                RowForm::Affine { number, weight, .. } => weights[*number] += factor(i) * weight,
                RowForm::Explicit => explicit.push(i),
                RowForm::Zero => {}
            }
        }
        for (model, weight) in self.models.iter().zip(&weights).filter(|(_, w)| **w != 0.0) {
            model.add_hessian(b, *weight, &mut sum);
        }
        if !explicit.is_empty() {
            let numbers: Vec<f64> = self.models.iter().map(|m| m.value(b)).collect();
            let gradients: Vec<Vec<f64>> = self.models.iter().map(|m| m.gradient(b)).collect();
            let ModelAnalysis { responses, sensitivities } = self.analysis(&numbers, &gradients);
            let is_response = |id: &NumberId| matches!(id, NumberId::Response(_));
            let of_responses = self.ids.iter().zip(&self.models).filter(|(id, _)| is_response(id));
            let curvatures: Vec<DMatrix<f64>> = of_responses
                .map(|(_, model)| {
                    let mut h = DMatrix::zeros(n, n);
                    model.add_hessian(b, 1.0, &mut h);
                    h
                })
                .collect();
            for i in explicit {
                let ((signed, p), (_, scale)) = (self.signed(i), self.normalization(i));
                let known = (&sensitivities, &curvatures[..]);
                sum += self.problem.total_curvature(signed, p, b, &responses, known) * (factor(i) / scale);
            }
        }
        sum
    }

    /// ∂(F + Σ λᵢ cᵢ)/∂r of each number r at the current design; `values` are the numbers there.
    pub fn number_weights(&self, multipliers: &[f64], values: &[f64]) -> Vec<f64> {
        let mut weights = vec![0.0; self.models.len()];
        let factor = |i: Option<usize>| i.map_or(1.0, |i| multipliers[i]);
        for i in self.functions().filter(|&i| factor(i) != 0.0) {
            match self.form(i) {
                RowForm::Affine { number, weight, .. } => weights[*number] += factor(i) * weight,
                RowForm::Explicit => {
                    let ((signed, p), (_, scale)) = (self.signed(i), self.normalization(i));
                    let used = self.problem.responses_of(signed.quantity, p);
                    let place = |h, p| {
                        let at = self.problem.response_at(h, p);
                        used.binary_search(&at).expect("it is among the responses of the quantity")
                    };
                    let index: Vec<usize> =
                        used.iter().filter_map(|at| self.ids.binary_search(&NumberId::Response(*at)).ok()).collect();
                    let here: Vec<f64> = index.iter().map(|&k| values[k]).collect();
                    let fixed: Vec<Dual> = self.design.iter().map(|&v| Dual::from(v)).collect();
                    let slopes =
                        gradient(|z| signed.value(p, &self.problem.grids, &fixed, |h, p| z[place(h, p)]), &here).1;
                    index.iter().zip(slopes).for_each(|(&k, s)| weights[k] += factor(i) * s / scale);
                }
                RowForm::Zero => {}
            }
        }
        weights
    }
}

/// A surrogate in its box as a program in z = 1 + s/w, with rows that may be relaxed.
pub(super) struct BoxedSurrogate<'a> {
    surrogate: &'a Surrogate<'a>,
    widths: &'a [f64],
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Index and sign of each row: a relaxed equality gives two rows.
    rows: Vec<(usize, f64)>,
    equality: Vec<bool>,
    /// Amount by which each row is relaxed.
    relaxation: Vec<f64>,
    /// Objective at the current design, which is subtracted.
    objective: f64,
}

impl<'a> BoxedSurrogate<'a> {
    /// The surrogate in a box of the half widths `widths` and inside `sides`; `relaxation` of each row, or none.
    pub fn new(
        surrogate: &'a Surrogate<'a>,
        widths: &'a [f64],
        [lower, upper]: [&[f64]; 2],
        equality: &[bool],
        relaxation: Option<Vec<f64>>,
        objective: f64,
    ) -> Self {
        let z = |b: &[f64]| (0..b.len()).map(|j| 1.0 + (b[j] - surrogate.design[j]) / widths[j]).collect();
        let mut rows = vec![];
        for (i, is_equality) in equality.iter().enumerate() {
            rows.push((i, 1.0));
            if *is_equality && relaxation.is_some() {
                rows.push((i, -1.0));
            }
        }
        let amount = |(i, _): &(usize, f64)| relaxation.as_ref().map_or(0.0, |t| t[*i]);
        let amounts = rows.iter().map(amount).collect();
        let kinds = rows.iter().map(|(i, _)| equality[*i] && relaxation.is_none()).collect();
        let (lower, upper) = (z(lower), z(upper));
        Self { surrogate, widths, lower, upper, rows, equality: kinds, relaxation: amounts, objective }
    }

    /// The design of a point z; exactly the current design in a variable with z = 1.
    pub fn design(&self, z: &[f64]) -> Vec<f64> {
        (0..z.len()).map(|j| self.surrogate.design[j] + (z[j] - 1.0) * self.widths[j]).collect()
    }

    /// Multipliers of the retained rows from those of the program.
    pub fn multipliers(&self, program: &[f64]) -> Vec<f64> {
        let mut multipliers = vec![0.0; self.surrogate.forms.len()];
        self.rows.iter().zip(program).for_each(|((i, sign), λ)| multipliers[*i] += sign * λ);
        multipliers
    }

    fn rows_of(&self, rows: &[f64]) -> Vec<f64> {
        self.rows.iter().zip(&self.relaxation).map(|((i, sign), t)| sign * rows[*i] - t).collect()
    }
}

impl Program for BoxedSurrogate<'_> {
    fn variables(&self) -> usize {
        self.lower.len()
    }
    fn rows(&self) -> usize {
        self.rows.len()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        self.equality[i]
    }
    fn structure(&self) -> Structure {
        self.surrogate.structure()
    }
    fn values(&self, z: &[f64]) -> Result<Values> {
        let v = self.surrogate.values(&self.design(z));
        Ok(Values { objective: v.objective - self.objective, rows: self.rows_of(&v.rows) })
    }
    fn gradients(&self, z: &[f64]) -> Result<Gradients> {
        let g = self.surrogate.gradients(&self.design(z));
        let n = z.len();
        let rows = DMatrix::from_fn(self.rows.len(), n, |k, j| {
            let (i, sign) = self.rows[k];
            sign * g.rows[(i, j)] * self.widths[j]
        });
        let values = Values { objective: g.values.objective - self.objective, rows: self.rows_of(&g.values.rows) };
        let objective = g.objective.iter().zip(self.widths).map(|(g, w)| g * w).collect();
        Ok(Gradients { values, objective, rows })
    }
    fn lagrangian_hessian(&self, z: &[f64], multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        let h = self.surrogate.lagrangian_hessian(&self.design(z), &self.multipliers(multipliers));
        let w = self.widths;
        Ok(Some(DMatrix::from_fn(z.len(), z.len(), |i, j| h[(i, j)] * w[i] * w[j])))
    }
}
