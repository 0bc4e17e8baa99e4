//! Data at the start design of a cycle, from which the approximations are fitted.

use crate::problem::{
    AnalyzedDesign, Evaluation, Peak, Problem, ResponseAt, Responses, RowId, Sensitivities, violation,
};
use error::Result;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Retained rows and derivatives at the start design of a cycle, reused when the cycle is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CycleData {
    /// Retained constraints and time points.
    #[serde(rename = "kept")]
    pub retained: Vec<RowId>,
    /// Sensitivities of the responses that they and the objective need.
    pub sensitivities: Sensitivities,
    /// Second derivatives of the same responses, if the approximation uses them.
    #[serde(default, deserialize_with = "crate::storage::matrix::maybe")]
    pub curvatures: Option<Vec<DMatrix<f64>>>,
    /// Retained local maxima of constraints in continuous time.
    pub peaks: Vec<Peak>,
}

impl CycleData {
    /// Differentiates the responses that the objective and the `retained` rows need, at an analyzed design.
    ///
    /// Peaks are those of the evaluation that are retained. Second derivatives are computed only if `second_order`.
    ///
    /// # Errors
    ///
    /// As [`Problem::sensitivities`] and [`Problem::check_derivatives`].
    pub fn differentiate(
        problem: &Problem,
        design: &[f64],
        responses: &Responses,
        evaluation: &Evaluation,
        retained: Vec<RowId>,
        second_order: bool,
    ) -> Result<Self> {
        let peak = |at: &_| {
            let peak = problem.peak(*at, design, responses, &evaluation.residuals[at.row.constraint])?;
            if second_order { problem.curved(peak, design, responses) } else { Ok(peak) }
        };
        let peaks =
            evaluation.peaks.iter().filter(|peak| retained.contains(&peak.row)).map(peak).collect::<Result<_>>()?;
        let at = Self::needed(problem, &retained);
        let rows = match at.is_empty() {
            true => DMatrix::zeros(0, problem.n()),
            false => problem.sensitivities(design, responses, &at)?,
        };
        let curvatures = if second_order { problem.curvatures(design, responses, &at)? } else { None };
        let sensitivities = Sensitivities { at, rows };
        // Constraints in continuous time are differentiated at their peaks.
        let is_on_grid = |row: &RowId| !problem.constraints[row.constraint].is_continuous;
        let on_grid: Vec<RowId> = retained.iter().copied().filter(is_on_grid).collect();
        problem.check_derivatives(design, responses, &sensitivities, &on_grid)?;
        Ok(Self { retained, sensitivities, curvatures, peaks })
    }

    /// First derivatives at an analyzed design.
    ///
    /// # Errors
    ///
    /// As [`Problem::sensitivities`].
    pub fn first_order(problem: &Problem, at: &AnalyzedDesign, retained: Vec<RowId>) -> Result<Self> {
        Self::differentiate(problem, &at.design, &at.responses, &at.evaluation, retained, false)
    }

    /// Responses and time points that the objective and the retained rows need, sorted, without those of peaks in continuous
    /// time.
    pub fn needed(problem: &Problem, retained: &[RowId]) -> Vec<ResponseAt> {
        let on_grid = retained.iter().filter(|r| !problem.constraints[r.constraint].is_continuous);
        let rows = on_grid.flat_map(|r| problem.responses_of(&problem.constraints[r.constraint].quantity, r.point));
        let mut needed: Vec<ResponseAt> = rows.chain(problem.responses_of(&problem.objective.quantity, 0)).collect();
        needed.sort_unstable();
        needed.dedup();
        needed
    }

    /// True if anything was differentiated.
    pub fn has_derivatives(&self) -> bool {
        !self.sensitivities.at.is_empty() || !self.peaks.is_empty()
    }

    /// The largest violation of the retained rows ĝ − 1, as a fraction, at least zero.
    pub fn violation(&self, problem: &Problem, rows: &[f64]) -> f64 {
        let one = |(r, &row): (&RowId, &f64)| violation(problem.constraints[r.constraint].is_equality(), row);
        self.retained.iter().zip(rows).map(one).fold(0.0, f64::max)
    }
}

/// The start design of a cycle, with all data that approximations may use.
#[derive(Clone, Copy, Debug)]
pub struct LinearizationPoint<'a> {
    /// Design b₀.
    pub design: &'a [f64],
    /// Responses there.
    pub responses: &'a Responses,
    /// Retained rows and derivatives there.
    pub data: &'a CycleData,
    /// Earlier accepted designs, the newest first.
    pub previous: &'a [PreviousPoint],
}

impl<'a> LinearizationPoint<'a> {
    /// A point with first derivatives and without earlier designs.
    pub fn first_order(at: &'a AnalyzedDesign, data: &'a CycleData) -> Self {
        Self { design: &at.design, responses: &at.responses, data, previous: &[] }
    }
}

/// An earlier accepted design with its derivatives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PreviousPoint {
    /// Design.
    pub design: Vec<f64>,
    /// Responses there.
    pub responses: Responses,
    /// Those of their sensitivities that were needed.
    pub sensitivities: Sensitivities,
}
