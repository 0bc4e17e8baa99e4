//! Functionals of histories as additional responses, for analyses whose derivatives cost one pass for each response.

use super::quantity::{QuantityForm, SignedQuantity};
use super::{
    Analysis, ContinuousTime, GradientMethod, Problem, Quantity, Response, ResponseAt, ResponseSum, Responses, TimeGrid,
};
use autodiff::{Dual, gradient};
use error::Result;
use nalgebra::DMatrix;

impl Problem {
    /// Makes each objective or constraint that is a functional of whole histories (an integral, a mean, a norm) a
    /// time-independent response of the analysis.
    ///
    /// Its gradient is that of one weighted sum of responses: one pass of the adjoint method, instead of one for each time
    /// point. Approximations then have this one response instead of the histories; it is linearized in the intermediate
    /// variables of the quantity, or in those of its first response.
    #[must_use]
    pub fn with_reduced_histories(self) -> Self {
        let first = self.responses.len();
        let mut problem = self;
        let (mut quantities, mut responses) = (Vec::new(), Vec::new());
        let declared = problem.responses.clone();
        let mut replace = |quantity: &mut Quantity, name: &str, unit: &str| {
            if !matches!(quantity.form, QuantityForm::Whole(..)) || quantity.uses.is_empty() {
                return;
            }
            let of_first = declared[quantity.uses[0]].intermediates.clone();
            let intermediates = quantity.direct.take().unwrap_or(of_first);
            let name = format!("{name} (value)");
            responses.push(Response { name, unit: unit.to_owned(), grid: None, intermediates });
            let number = first + quantities.len();
            quantities.push(std::mem::replace(quantity, Quantity::response(None, number)));
        };
        replace(&mut problem.objective.quantity, &problem.objective.name, &problem.objective.unit);
        for constraint in &mut problem.constraints {
            replace(&mut constraint.quantity, &constraint.name, "");
        }
        if quantities.is_empty() {
            return problem;
        }
        problem.responses.extend(responses);
        let reduction = HistoryFunctionals { grids: problem.grids.clone(), quantities, first };
        problem.analysis = Box::new(ReducedHistories { analysis: problem.analysis, reduction });
        problem
    }
}

/// Functionals of the histories of an analysis.
struct HistoryFunctionals {
    grids: Vec<TimeGrid>,
    quantities: Vec<Quantity>,
    /// Number of the responses of the analysis, which is the index of the first functional.
    first: usize,
}

/// An analysis with further responses, which are functionals of its histories.
struct ReducedHistories {
    analysis: Box<dyn Analysis>,
    reduction: HistoryFunctionals,
}

impl HistoryFunctionals {
    /// Appends the functionals at the design `b` to the `responses` of the analysis.
    fn append(&self, b: &[f64], responses: &mut Responses) {
        let value =
            |quantity| signed(quantity).value(0, &self.grids, b, |h, p| responses.at(at(&responses.values, h, p)));
        let values: Vec<f64> = self.quantities.iter().map(value).collect();
        responses.values.extend(values.into_iter().map(|value| vec![value]));
    }

    /// The responses of the analysis alone.
    fn without(&self, responses: &Responses) -> Responses {
        let count = self.first.min(responses.values.len());
        Responses { values: responses.values[..count].to_vec(), ..responses.clone() }
    }

    /// Partial derivatives of functional number `k` with respect to the responses, as weights, and to the design.
    fn partial_derivatives(&self, k: usize, b: &[f64], responses: &Responses) -> (ResponseSum, Vec<f64>) {
        let (quantity, values) = (&self.quantities[k], &responses.values);
        let points = |h: usize| (0..values[h].len()).map(move |point| ResponseAt { response: h, point });
        let mut used: Vec<ResponseAt> = quantity.uses.iter().flat_map(|&h| points(h)).collect();
        used.sort_unstable();
        used.dedup();
        let numbers: Vec<f64> = used.iter().map(|at| responses.at(*at)).collect();
        let place = |h, p| used.binary_search(&at(values, h, p)).expect("all points of its responses are used");
        let design: Vec<Dual> = b.iter().map(|&b| Dual::from(b)).collect();
        let functional = signed(quantity);
        let (_, weights) = gradient(|r| functional.value(0, &self.grids, &design, |h, p| r[place(h, p)]), &numbers);
        let response = |h, p| Dual::from(responses.at(at(values, h, p)));
        let (_, explicit) = gradient(|b| functional.value(0, &self.grids, b, response), b);
        let terms = used.into_iter().zip(weights).filter(|(_, weight)| *weight != 0.0).collect();
        (ResponseSum { terms }, explicit)
    }

    /// The gradients of `wanted` responses, from those of weighted sums of the analysis' responses.
    fn gradients(
        &self,
        b: &[f64],
        responses: &Responses,
        wanted: &[ResponseAt],
        of_sums: impl FnOnce(&Responses, &[ResponseSum]) -> Result<DMatrix<f64>>,
    ) -> Result<DMatrix<f64>> {
        let partial = |at: &ResponseAt| match at.response.checked_sub(self.first) {
            Some(k) => self.partial_derivatives(k, b, responses),
            None => (ResponseSum::of(*at), vec![0.0; b.len()]),
        };
        let (sums, explicit): (Vec<ResponseSum>, Vec<Vec<f64>>) = wanted.iter().map(partial).unzip();
        let rows = of_sums(&self.without(responses), &sums)?;
        Ok(DMatrix::from_fn(wanted.len(), b.len(), |i, k| rows[(i, k)] + explicit[i][k]))
    }

    /// The method `inner` of the analysis, for its responses and the functionals of them.
    fn with_functionals<'a>(&'a self, inner: GradientMethod<'a>) -> GradientMethod<'a> {
        let (name, step) = (inner.name, inner.step);
        let differentiate = move |step: f64, b: &[f64], responses: &Responses, wanted: &[ResponseAt]| {
            let of_sums = |responses: &Responses, sums: &[ResponseSum]| inner.sums_by(step, b, responses, sums);
            self.gradients(b, responses, wanted, of_sums)
        };
        match step {
            Some(step) => GradientMethod::approximate(name, step, differentiate),
            None => GradientMethod::exact(name, move |b, responses, wanted| differentiate(0.0, b, responses, wanted)),
        }
    }

    /// Appends the functionals to the responses at each of the `designs`.
    fn append_to_all(&self, designs: &[Vec<f64>], mut all: Vec<Result<Responses>>) -> Vec<Result<Responses>> {
        for (b, responses) in designs.iter().zip(&mut all) {
            responses.iter_mut().for_each(|responses| self.append(b, responses));
        }
        all
    }

    fn is_of_analysis(&self, at: &ResponseAt) -> bool {
        at.response < self.first
    }
}

fn signed(quantity: &Quantity) -> SignedQuantity<'_> {
    SignedQuantity { quantity, sign: 1.0, bound: None }
}

/// Response `h` at time point `p`, or its only value if it is time-independent.
fn at(values: &[Vec<f64>], h: usize, p: usize) -> ResponseAt {
    ResponseAt { response: h, point: p.min(values[h].len() - 1) }
}

impl Analysis for ReducedHistories {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mut responses = self.analysis.analyze(b)?;
        self.reduction.append(b, &mut responses);
        Ok(responses)
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.reduction.append_to_all(designs, self.analysis.analyze_many(designs))
    }

    fn analyze_around(&self, b: &[f64], designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.reduction.append_to_all(designs, self.analysis.analyze_around(b, designs))
    }

    fn step_tolerance(&self, b: &[f64]) -> f64 {
        self.analysis.step_tolerance(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let of_sums = |responses: &Responses, sums: &[ResponseSum]| self.analysis.sum_sensitivities(b, responses, sums);
        self.reduction.gradients(b, responses, wanted, of_sums)
    }

    /// Second derivatives of the analysis' own responses only.
    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        match wanted.iter().all(|at| self.reduction.is_of_analysis(at)) {
            true => self.analysis.curvatures(b, &self.reduction.without(responses), wanted),
            false => Ok(None),
        }
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        self.analysis.gradient_methods().into_iter().map(|method| self.reduction.with_functionals(method)).collect()
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        self.analysis.differentiation(variables, wanted)
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.analysis.warnings(b, &self.reduction.without(responses))
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}
