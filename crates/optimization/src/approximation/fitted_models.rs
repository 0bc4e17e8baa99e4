//! Models of responses, quantities and peaks, fitted at the start design of a cycle.

use super::moving_peak::MovingPeak;
use super::{AnyModel, Approximation, Expansion, LinearizationPoint, Negated, PreviousPoint, Sample, SubproblemBox};
use crate::problem::{Problem, ResponseAt, Responses, RowId, SignedQuantity};
use autodiff::{Dual, gradient};
use error::Result;
use std::sync::Arc;

/// The model of a quantity that is approximated directly; `None` if its explicit form in the responses is used.
pub(super) type DirectModel = Option<Arc<dyn AnyModel>>;

/// All models of a cycle.
pub(super) struct FittedModels {
    /// Responses and time points, sorted, and the model of each.
    pub responses: Vec<(ResponseAt, Arc<dyn AnyModel>)>,
    /// The negatives of models that were fitted to −r, for functions that decrease with the response; in the same order.
    pub negated: Vec<DirectModel>,
    /// For the objective, then for each retained row: the responses whose negated model it uses, sorted.
    pub decreasing: Vec<Vec<ResponseAt>>,
    /// Model of the objective, if it is approximated directly.
    pub objective: DirectModel,
    /// Models of the retained rows that are approximated directly.
    pub rows: Vec<DirectModel>,
    /// The retained rows that are peaks in continuous time.
    pub peaks: Vec<Option<MovingPeak>>,
}

impl FittedModels {
    /// Fits all models; peaks move with the design if `moving_peaks`.
    pub fn new(
        problem: &Problem,
        approximation: &dyn Approximation,
        point: LinearizationPoint,
        subproblem_box: &SubproblemBox,
        moving_peaks: bool,
    ) -> Result<Self> {
        let fitting = Fitting { problem, approximation, point, subproblem_box };
        let decreasing = fitting.decreasing();
        Ok(Self {
            responses: fitting.responses()?,
            negated: fitting.negated(&decreasing)?,
            decreasing,
            objective: fitting.quantity(problem.objective.signed(), 0, &problem.objective.name)?,
            rows: fitting.rows()?,
            peaks: fitting.peaks(moving_peaks)?,
        })
    }

    /// The index of the model of a response.
    pub fn index_of(&self, at: ResponseAt) -> usize {
        let found = self.responses.binary_search_by_key(&at, |(at, _)| *at);
        found.expect("every response of a retained quantity has a model")
    }

    /// The model of a response for function `i`: the objective is 0, row i is i + 1.
    pub fn model_for(&self, i: usize, at: ResponseAt) -> &Arc<dyn AnyModel> {
        let k = self.index_of(at);
        let negated = self.negated[k].as_ref().filter(|_| self.decreasing[i].binary_search(&at).is_ok());
        negated.unwrap_or(&self.responses[k].1)
    }

    /// Reduces a box to the domain of all models.
    pub fn restrict(&self, subproblem_box: &mut SubproblemBox) {
        let direct = self.objective.iter().chain(self.rows.iter().flatten()).chain(self.negated.iter().flatten());
        let peaks = self.peaks.iter().flatten().flat_map(|peak| &peak.models);
        let all = self.responses.iter().map(|(_, model)| model).chain(direct).chain(peaks);
        for [lower, upper] in all.filter_map(|model| model.domain()) {
            subproblem_box.lower.iter_mut().zip(lower).for_each(|(s, l)| *s = s.max(*l));
            subproblem_box.upper.iter_mut().zip(upper).for_each(|(s, u)| *s = s.min(*u));
        }
    }
}

/// The data from which models are fitted.
struct Fitting<'a> {
    problem: &'a Problem,
    approximation: &'a dyn Approximation,
    point: LinearizationPoint<'a>,
    subproblem_box: &'a SubproblemBox,
}

/// Design, value and gradient at an earlier design.
type OwnedSample<'a> = (&'a [f64], f64, Vec<f64>);

fn samples<'a>(before: &'a [OwnedSample]) -> Vec<Sample<'a>> {
    before.iter().map(|(design, value, gradient)| Sample { design, value: *value, gradient }).collect()
}

impl<'a> Fitting<'a> {
    /// A model for each differentiated response.
    fn responses(&self) -> Result<Vec<(ResponseAt, Arc<dyn AnyModel>)>> {
        let at = self.point.data.sensitivities.at.iter().enumerate();
        at.map(|(row, &at)| Ok((at, self.response(row, at, 1.0)?))).collect()
    }

    /// The negatives of the models of −r for responses with which a function decreases, `None` for the others.
    fn negated(&self, decreasing: &[Vec<ResponseAt>]) -> Result<Vec<DirectModel>> {
        let one = |(row, at): (usize, &ResponseAt)| -> Result<DirectModel> {
            if !decreasing.iter().any(|used| used.binary_search(at).is_ok()) {
                return Ok(None);
            }
            Ok(Some(Arc::new(Negated(self.response(row, *at, -1.0)?))))
        };
        self.point.data.sensitivities.at.iter().enumerate().map(one).collect()
    }

    /// For the objective and each retained row the responses with which it decreases at the design.
    fn decreasing(&self) -> Vec<Vec<ResponseAt>> {
        let rows = self.point.data.retained.iter().map(|r| {
            let constraint = &self.problem.constraints[r.constraint];
            let is_open = !constraint.is_equality() && !constraint.is_continuous;
            if is_open { self.decreases_with(constraint.signed(), r.point) } else { vec![] }
        });
        std::iter::once(self.decreases_with(self.problem.objective.signed(), 0)).chain(rows).collect()
    }

    fn decreases_with(&self, signed: SignedQuantity, p: usize) -> Vec<ResponseAt> {
        if self.approximation.is_odd() || signed.quantity.direct.is_some() {
            return vec![];
        }
        let (problem, point) = (self.problem, self.point);
        let used = problem.responses_of(signed.quantity, p);
        let place =
            |h, p| used.binary_search(&problem.response_at(h, p)).expect("it is among the responses of the quantity");
        let here: Vec<f64> = used.iter().map(|at| point.responses.at(*at)).collect();
        let fixed: Vec<Dual> = point.design.iter().map(|&v| Dual::from(v)).collect();
        let slopes = gradient(|z| signed.value(p, &problem.grids, &fixed, |h, p| z[place(h, p)]), &here).1;
        used.iter().zip(slopes).filter(|(_, slope)| *slope < 0.0).map(|(at, _)| *at).collect()
    }

    /// The model of `sign` × a response.
    fn response(&self, row: usize, at: ResponseAt, sign: f64) -> Result<Arc<dyn AnyModel>> {
        let (declared, data) = (&self.problem.responses[at.response], self.point.data);
        let signed = |gradient: Vec<f64>| -> Vec<f64> { gradient.into_iter().map(|g| sign * g).collect() };
        let gradient = signed(data.sensitivities.rows.row(row).iter().copied().collect());
        let before = |p: &'a PreviousPoint| -> Option<OwnedSample<'a>> {
            let gradient = p.sensitivities.gradient(at)?;
            Some((&p.design[..], sign * p.responses.at(at), signed(gradient)))
        };
        let curvature = data.curvatures.as_ref().map(|c| &c[row] * sign);
        let before: Vec<OwnedSample> = self.previous().map_while(before).collect();
        self.approximation.fit(&Expansion {
            name: &declared.name,
            here: Sample { design: self.point.design, value: sign * self.point.responses.at(at), gradient: &gradient },
            before: &samples(&before),
            intermediates: &declared.intermediates,
            curvature: curvature.as_ref(),
            subproblem_box: self.subproblem_box,
        })
    }

    /// The earlier designs that the approximation uses.
    fn previous(&self) -> impl Iterator<Item = &'a PreviousPoint> {
        self.point.previous.iter().take(self.approximation.memory())
    }

    /// Models of the retained rows that are approximated directly, `None` for the others.
    fn rows(&self) -> Result<Vec<DirectModel>> {
        let row = |r: &RowId| {
            let constraint = &self.problem.constraints[r.constraint];
            self.quantity(constraint.signed(), r.point, &constraint.name)
        };
        self.point.data.retained.iter().map(row).collect()
    }

    fn quantity(&self, signed: SignedQuantity, p: usize, name: &str) -> Result<DirectModel> {
        let Some(intermediates) = &signed.quantity.direct else { return Ok(None) };
        let (problem, LinearizationPoint { design, responses, data, .. }) = (self.problem, self.point);
        let value = |b: &[f64], responses: &Responses| {
            signed.value(p, &problem.grids, b, |h, p| responses.at(problem.response_at(h, p)))
        };
        let gradient = problem.total_derivative(signed, p, design, responses, &data.sensitivities);
        let needed = problem.responses_of(signed.quantity, p);
        let before = |previous: &'a PreviousPoint| -> Option<OwnedSample<'a>> {
            let PreviousPoint { design, responses, sensitivities } = previous;
            let has_all = needed.iter().all(|at| sensitivities.row_of(*at).is_some());
            let gradient = || problem.total_derivative(signed, p, design, responses, sensitivities);
            has_all.then(|| (&design[..], value(design, responses), gradient()))
        };
        let before: Vec<OwnedSample> = self.previous().map_while(before).collect();
        let second = |c: &Vec<_>| problem.total_curvature(signed, p, design, responses, (&data.sensitivities, &c[..]));
        let curvature = data.curvatures.as_ref().map(second);
        self.approximation
            .fit(&Expansion {
                name,
                here: Sample { design, value: value(design, responses), gradient: &gradient },
                before: &samples(&before),
                intermediates,
                curvature: curvature.as_ref(),
                subproblem_box: self.subproblem_box,
            })
            .map(Some)
    }

    /// Models of the responses at each retained peak. A peak has no earlier samples, because its time was different.
    fn peaks(&self, is_moving: bool) -> Result<Vec<Option<MovingPeak>>> {
        let moving = |row: &RowId| -> Result<Option<MovingPeak>> {
            let Some(peak) = self.point.data.peaks.iter().find(|p| p.row == *row) else { return Ok(None) };
            let constraint = &self.problem.constraints[row.constraint];
            let quantity = &constraint.quantity;
            let slopes = if self.approximation.is_odd() {
                vec![1.0; peak.responses.len()]
            } else {
                let fixed: Vec<Dual> = self.point.design.iter().map(|&v| Dual::from(v)).collect();
                gradient(|z| constraint.signed().value_at(z, &fixed, Dual::from(peak.time)), &peak.responses).1
            };
            let model = |(i, &h): (usize, &usize)| -> Result<Arc<dyn AnyModel>> {
                let declared = &self.problem.responses[h];
                let sign = if slopes[i] < 0.0 { -1.0 } else { 1.0 };
                let gradient: Vec<f64> = peak.gradients.row(i).iter().map(|g| sign * g).collect();
                let curvature = peak.curvatures.get(i).map(|c| c * sign);
                let fitted = self.approximation.fit(&Expansion {
                    name: &declared.name,
                    here: Sample { design: self.point.design, value: sign * peak.responses[i], gradient: &gradient },
                    before: &[],
                    intermediates: &declared.intermediates,
                    curvature: curvature.as_ref(),
                    subproblem_box: self.subproblem_box,
                })?;
                Ok(if sign < 0.0 { Arc::new(Negated(fitted)) } else { fitted })
            };
            let models = quantity.responses().iter().enumerate().map(model).collect::<Result<_>>()?;
            Ok(Some(MovingPeak { models, peak: peak.clone(), is_moving }))
        };
        self.point.data.retained.iter().map(moving).collect()
    }
}
