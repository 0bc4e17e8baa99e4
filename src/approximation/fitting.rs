//! Fitting the models of a cycle.

use super::drift::MovingPeak;
use super::problem::{DirectModel, LinearizationPoint};
use super::{AnyModel, Approximation, Expansion, PreviousPoint, Sample, SubproblemBox};
use crate::problem::{Problem, Quantity, ResponseAt, RowId};
use error::Result;
use std::sync::Arc;

/// All that the models of a cycle are fitted from.
pub(super) struct Fitting<'a> {
    pub problem: &'a Problem,
    pub approximation: &'a dyn Approximation,
    pub known: LinearizationPoint<'a>,
    pub subproblem_box: &'a SubproblemBox,
}

/// Design, value and gradient before.
type Owned<'a> = (&'a [f64], f64, Vec<f64>);

fn samples<'a>(before: &'a [Owned]) -> Vec<Sample<'a>> {
    before.iter().map(|(design, value, gradient)| Sample { design, value: *value, gradient }).collect()
}

impl<'a> Fitting<'a> {
    /// A model for each differentiated instant.
    pub fn responses(&self) -> Result<Vec<(ResponseAt, Arc<dyn AnyModel>)>> {
        let instants = self.known.sensitivities.instants.iter().enumerate();
        instants.map(|(row, &instant)| Ok((instant, self.response(row, instant)?))).collect()
    }

    fn response(&self, row: usize, instant: ResponseAt) -> Result<Arc<dyn AnyModel>> {
        let declared = &self.problem.responses[instant.response];
        let gradient: Vec<f64> = self.known.sensitivities.rows.row(row).iter().copied().collect();
        let here = Sample { design: self.known.design, value: self.known.responses.at(instant), gradient: &gradient };
        let past = |p: &'a PreviousPoint| -> Option<Owned<'a>> {
            p.sensitivities.gradient(instant).map(|gradient| (&p.design[..], p.responses.at(instant), gradient))
        };
        let before: Vec<Owned> = self.remembered().map_while(past).collect();
        self.approximation.fit(&Expansion {
            name: &declared.name,
            here,
            before: &samples(&before),
            intermediates: &declared.intermediates,
            curvature: self.known.curvatures.map(|c| &c[row]),
            subproblem_box: self.subproblem_box,
        })
    }

    fn remembered(&self) -> impl Iterator<Item = &'a PreviousPoint> {
        self.known.past.iter().take(self.approximation.memory())
    }

    /// Models of the objective and of the kept rows, where they are approximated directly.
    pub fn quantities(&self, kept: &[RowId]) -> Result<(DirectModel, Vec<DirectModel>)> {
        let objective = self.quantity(&self.problem.objective, 0, &self.problem.objective_name)?;
        let row = |r: &RowId| {
            let constraint = &self.problem.constraints[r.constraint];
            self.quantity(&constraint.quantity, r.point, &constraint.name)
        };
        Ok((objective, kept.iter().map(row).collect::<Result<_>>()?))
    }

    fn quantity(&self, quantity: &Quantity, p: usize, name: &str) -> Result<DirectModel> {
        let Some(intermediates) = &quantity.direct else { return Ok(None) };
        let (problem, LinearizationPoint { design, responses, sensitivities, .. }) = (self.problem, self.known);
        let value = |b: &[f64], responses: &crate::problem::Responses| {
            quantity.value(p, &problem.grids, b, |h, p| responses.at(problem.instant(h, p)))
        };
        let gradient = problem.total_derivative(quantity, p, design, responses, sensitivities);
        let here = Sample { design, value: value(design, responses), gradient: &gradient };
        let needed = problem.instants_of(quantity, p);
        let past = |past: &'a PreviousPoint| -> Option<Owned<'a>> {
            let known = needed.iter().all(|i| past.sensitivities.row_of(*i).is_some());
            let slope = || problem.total_derivative(quantity, p, &past.design, &past.responses, &past.sensitivities);
            known.then(|| (&past.design[..], value(&past.design, &past.responses), slope()))
        };
        let before: Vec<Owned> = self.remembered().map_while(past).collect();
        let second = |c| problem.total_curvature(quantity, p, design, responses, (sensitivities, c));
        let curvature = self.known.curvatures.map(second);
        self.approximation
            .fit(&Expansion {
                name,
                here,
                before: &samples(&before),
                intermediates,
                curvature: curvature.as_ref(),
                subproblem_box: self.subproblem_box,
            })
            .map(Some)
    }

    /// Models of the responses at each kept peak. A peak has no samples before: its time was another one.
    pub fn peaks(&self, kept: &[RowId], corrects: bool) -> Result<Vec<Option<MovingPeak>>> {
        let drift = |row: &RowId| -> Result<Option<MovingPeak>> {
            let Some(peak) = self.known.peaks.iter().find(|p| p.row == *row) else { return Ok(None) };
            let quantity = &self.problem.constraints[row.constraint].quantity;
            let model = |(i, &h): (usize, &usize)| {
                let declared = &self.problem.responses[h];
                let gradient: Vec<f64> = peak.gradients.row(i).iter().copied().collect();
                self.approximation.fit(&Expansion {
                    name: &declared.name,
                    here: Sample { design: self.known.design, value: peak.responses[i], gradient: &gradient },
                    before: &[],
                    intermediates: &declared.intermediates,
                    curvature: peak.curvatures.get(i),
                    subproblem_box: self.subproblem_box,
                })
            };
            let models = quantity.responses().iter().enumerate().map(model).collect::<Result<_>>()?;
            Ok(Some(MovingPeak { models, peak: peak.clone(), corrects }))
        };
        kept.iter().map(drift).collect()
    }
}
