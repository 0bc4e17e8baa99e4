//! The state of a run: history, results, report, figures.

use super::problem::Problem;
use super::work::{raise, work, work_until};
use linkwright::report::animation::{Animation, Scene};
use linkwright::report::figure::{QuantityLabel, literal};
use linkwright::report::page::{Page, PageSection};
use linkwright::report::run::{OptimizationReport, Slice};
use linkwright::sao::{Cycle, Status};
use linkwright::{Result, sao};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::Ordering;

/// State of a run.
#[pyclass(module = "linkwright._core", frozen)]
pub struct State(pub sao::RunState);

/// The status as a word.
pub fn word(status: Status) -> &'static str {
    match status {
        Status::Running => "running",
        Status::Converged => "converged",
        Status::CycleLimit => "cycle limit",
        Status::Stalled => "stalled",
        Status::Infeasible => "infeasible",
        _ => "ended",
    }
}

#[pymethods]
impl State {
    /// Status as a word, and its reason.
    #[getter]
    fn status(&self) -> (&'static str, &str) {
        (word(self.0.status), &self.0.reason)
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
        self.0.evaluation.constraints.iter().map(|values| PyArray1::from_slice(py, values)).collect()
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

    /// The state from JSON.
    #[staticmethod]
    fn from_json(py: Python<'_>, text: &str, problem: &Problem) -> PyResult<Self> {
        work(py, || sao::RunState::from_json(text, &problem.problem)).map(Self)
    }

    /// The report as a page; `slice` is the number of points along each side of the slice of the design space.
    fn report(&self, py: Python<'_>, problem: &Problem, slice: usize) -> PyResult<String> {
        self.page(py, problem, slice, |page| {
            let foot = format!("Written by linkwright {} from Python.", env!("CARGO_PKG_VERSION"));
            page.foot(foot).html()
        })
    }

    /// Figures of the report: names and SVG.
    fn figures(&self, py: Python<'_>, problem: &Problem) -> PyResult<Vec<(String, String)>> {
        self.page(py, problem, 0, |page| {
            page.figures().map(|(name, figure)| Ok((name.to_owned(), figure.svg()?))).collect()
        })
    }
}

impl State {
    fn rows(&self, last: bool) -> &[Cycle] {
        let history = &self.0.history[..];
        if last { &history[history.len().saturating_sub(1)..] } else { history }
    }

    /// Makes the page of the report and converts it.
    fn page<T: Send>(
        &self,
        py: Python<'_>,
        problem: &Problem,
        slice: usize,
        convert: impl FnOnce(Page) -> Result<T> + Send,
    ) -> PyResult<T> {
        if self.0.fingerprint != problem.problem.fingerprint() {
            let error =
                linkwright::Error::definition("report", "the run belongs to another problem", "give its problem");
            return Err(raise(py, &error));
        }
        let draw = |slice: Option<Slice>| {
            let run = OptimizationReport::new(problem.model.title(), &problem.problem, &self.0)?;
            convert(run.page(slice.as_ref(), self.mechanism(problem).into_iter().collect())?)
        };
        // Designs of a slice are analysed in several threads, which Python functions are not.
        if problem.is_function || slice < 2 {
            return problem.work(py, || draw(None));
        }
        work_until(py, |is_stopped| {
            let is_stopped = || is_stopped.load(Ordering::Relaxed);
            draw(Slice::sample_until(&problem.problem, &self.0, slice, &is_stopped).ok().flatten())
        })
    }

    /// The mechanism in motion at the first and the last design; `None` if there is none, or if it cannot be drawn.
    fn mechanism(&self, problem: &Problem) -> Option<PageSection> {
        let (times, grid) = (problem.model.drawing_times()?, problem.model.grid()?);
        let mut designs = vec![("first design", &self.0.history.first()?.design)];
        if *designs[0].1 != self.0.design {
            designs.push(("last design", &self.0.design));
        }
        let drawn = problem.model.drawings(&designs.iter().map(|(_, b)| &b[..]).collect::<Vec<_>>(), &times).ok()??;
        let titles = designs.iter().map(|(title, _)| (*title).to_owned());
        let scenes = titles.zip(drawn).map(|(title, frames)| Scene { title, frames, traces: vec![] }).collect();
        let axes = [QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")];
        let times = times.iter().map(|&t| grid.shown(t)).collect();
        let time = QuantityLabel::literal(&grid.name, &grid.unit);
        let description = literal(&format!("The mechanism over the {}.", grid.name));
        let motion = Animation::new(description, axes, times, scenes).ok()?.lasting(5.0).ok()?.over(time).compared();
        Some(PageSection::new("mechanism", "Mechanism").html(motion.fragment()))
    }
}
