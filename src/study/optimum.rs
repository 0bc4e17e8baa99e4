//! Optimizations as runs of a study.

use super::error::StudyError;
use super::model::ModelSource;
use super::plan::Column;
use crate::model_file::Model;
use crate::problem::Problem;
use crate::report::outcome;
use crate::sao::RunState;

/// The end of an optimization.
pub struct OptimizationEnd {
    /// The problem.
    pub problem: Problem,
    /// The last state.
    pub state: RunState,
}

/// Optimizes the problem of a source by its method.
///
/// # Errors
/// If the source has errors, or the method breaks down.
pub fn optimize(source: &ModelSource) -> Result<OptimizationEnd, StudyError> {
    let model = source.model()?;
    let problem = model.problem()?;
    let state = model.method().solve(&problem, |_| ())?;
    Ok(OptimizationEnd { problem, state })
}

impl OptimizationEnd {
    /// The columns of [`values`](Self::values) for a model.
    ///
    /// # Errors
    /// If the model has no objective.
    pub fn columns(model: &Model) -> Result<Vec<Column>, StudyError> {
        let problem = model.problem()?;
        let mut columns = vec![
            Column::new(&problem.objective.name, &problem.objective.unit),
            Column::new("violation_pct", "%"),
            Column::of_counts("cycles"),
            Column::of_counts("analyses"),
            Column::of_counts("sensitivity_analyses"),
        ];
        columns.extend(model.variables().iter().map(|v| Column::new(&v.name, &v.unit)));
        Ok(columns)
    }

    /// Objective, violation, work, design.
    pub fn values(&self) -> Vec<f64> {
        let Self { problem, state } = self;
        let objective = outcome::objective(problem, &state.design, &state.evaluation);
        let counters = [state.cycles(), state.counters.analyses, state.counters.sensitivity_analyses];
        let bound = problem.objective.peak().map(|peak| peak.variable);
        let design = state.design.iter().enumerate().filter(|(k, _)| Some(*k) != bound).map(|(_, v)| *v);
        let head = [objective, state.evaluation.max_violation_pct()];
        head.into_iter().chain(counters.map(|n| n as f64)).chain(design).collect()
    }

    /// The objective at the start, of a min–max problem the peak.
    ///
    /// # Errors
    /// As [`outcome::objective_of_step`].
    pub fn objective_at_start(&self) -> crate::Result<f64> {
        outcome::objective_of_step(&self.problem, &self.state, 0)
    }

    /// The status in one word.
    pub fn status(&self) -> String {
        format!("{:?}", self.state.status)
    }
}

/// Number of columns before the design.
pub const WORK: usize = 5;

/// The source with another start, which is moved inside the bounds of the model.
///
/// # Errors
/// If the source has errors.
pub fn with_start(source: &ModelSource, start: &[f64]) -> Result<ModelSource, StudyError> {
    let model = source.model()?;
    let all = model.variables().iter().zip(start).filter(|(_, value)| value.is_finite());
    let edits = all.map(|(v, value)| (format!("design.{}.start", v.name), value.clamp(v.lower, v.upper)));
    source.with_numbers(&model, edits)
}
