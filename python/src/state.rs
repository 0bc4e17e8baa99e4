//! The state of a run: history and results.

use super::work::work;
use linkwright::sao;
use linkwright::sao::Cycle;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// State of a run.
#[pyclass(module = "linkwright._core", frozen)]
pub struct State(pub sao::RunState);

#[pymethods]
impl State {
    /// Status as a word, and its reason.
    #[getter]
    fn status(&self) -> (String, &str) {
        (self.0.status.to_string(), &self.0.reason)
    }

    /// The accepted design.
    #[getter]
    fn design<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.design)
    }

    /// Minimized value of the objective, of a peak its own value and not the variable that bounds it, and the largest violation in percent.
    #[getter]
    fn values(&self) -> (f64, f64) {
        let last = self.0.history.iter().rev().find(|cycle| cycle.accepted);
        let objective = last.map_or(self.0.evaluation.objective, |cycle| cycle.peak.unwrap_or(cycle.objective));
        (objective, self.0.evaluation.max_violation_pct())
    }

    /// Numbers of accepted cycles, analyses, sensitivity analyses, and iterations of the subproblem solver.
    #[getter]
    fn counters(&self) -> (usize, usize, usize, usize) {
        let counters = self.0.counters;
        (self.0.cycles(), counters.analyses, counters.sensitivity_analyses, counters.subproblem_iterations)
    }

    /// Values of the responses.
    #[getter]
    fn responses<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray1<f64>>> {
        self.0.responses.values.iter().map(|values| PyArray1::from_slice(py, values)).collect()
    }

    /// Warnings of the analysis of the accepted design.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.responses.warnings.clone()
    }

    /// Values of the normalized constraints.
    #[getter]
    fn constraints<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray1<f64>>> {
        (0..self.0.evaluation.residuals.len())
            .map(|j| PyArray1::from_vec(py, self.0.evaluation.normalized(j)))
            .collect()
    }

    /// Active rows at the design: numbers of constraint and time point, multiplier.
    #[getter]
    fn active(&self) -> Vec<(usize, usize, f64)> {
        self.0.active_rows().iter().map(|a| (a.row.constraint, a.row.point, a.multiplier)).collect()
    }

    /// Columns of the history by name, without the designs; only the last row with `last`.
    #[pyo3(signature = (last=false))]
    fn history<'py>(&self, py: Python<'py>, last: bool) -> PyResult<Bound<'py, PyDict>> {
        let rows = self.rows(last);
        let columns = PyDict::new(py);
        let whole = |of: fn(&Cycle) -> usize| rows.iter().map(of).collect::<Vec<_>>();
        let number = |of: fn(&Cycle) -> f64| rows.iter().map(of).collect::<Vec<_>>();
        columns.set_item("cycle", whole(|c| c.cycle))?;
        columns.set_item("accepted", rows.iter().map(|c| c.accepted).collect::<Vec<_>>())?;
        columns.set_item("objective", number(|c| c.objective))?;
        columns.set_item("objective_error_pct", number(|c| c.objective_error_pct))?;
        columns.set_item("constraint_error_pct", number(|c| c.constraint_error_pct))?;
        columns.set_item("violation_pct", number(|c| c.violation_pct))?;
        columns.set_item("step_pct", number(|c| c.max_variable_change_pct))?;
        columns.set_item("at_limits", whole(|c| c.active_limits))?;
        columns.set_item("retained", whole(|c| c.retained.len()))?;
        columns.set_item("active", whole(|c| c.active.len()))?;
        columns.set_item("failure", rows.iter().map(|c| c.failure.as_deref()).collect::<Vec<_>>())?;
        Ok(columns)
    }

    /// Designs of the history, one row for each trial step; only the last one with `last`.
    #[pyo3(signature = (last=false))]
    fn designs<'py>(&self, py: Python<'py>, last: bool) -> Bound<'py, PyArray2<f64>> {
        let rows = self.rows(last);
        Array2::from_shape_fn((rows.len(), self.0.design.len()), |(i, k)| rows[i].design[k]).into_pyarray(py)
    }

    /// The state as JSON.
    fn to_json(&self, py: Python<'_>) -> PyResult<String> {
        work(py, || Ok(self.0.to_json()))
    }
}

impl State {
    fn rows(&self, last: bool) -> &[Cycle] {
        let history = &self.0.history[..];
        if last { &history[history.len().saturating_sub(1)..] } else { history }
    }
}
