//! Model files and problems: analyses, derivatives, checks, runs.

use super::function::{FunctionAnalysis, Functions};
use super::state::State;
use super::work::{raise, raise_as, raise_report, work, work_with_programs};
use linkwright::gradient_check::GradientStatus;
use linkwright::model_file::{self, Model};
use linkwright::problem::{Analysis, AnalyzedDesign, Evaluation, Goal, ResponseAt, Responses};
use linkwright::report::outcome;
use linkwright::responses::Differences;
use linkwright::sao::{Method, PostOptimal, RunState, Status, preset};
use linkwright::{Error, Result};
use nalgebra::DMatrix;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A problem: a model file, or a problem whose responses are computed by Python functions.
#[pyclass(module = "linkwright._core", frozen)]
pub struct Problem {
    /// The model file, or the part of a problem that is not a Python function in the same form.
    pub model: Model,
    /// The optimization problem.
    pub problem: linkwright::problem::Problem,
    /// True if Python functions compute the responses.
    pub is_function: bool,
}

/// Number of designs of the first call of a model's analysis between two checks for signals, and the time that a call should take.
const FIRST_CALL: usize = 16;
const CALL_TIME: Duration = Duration::from_millis(100);

/// The name of finite differences, and their relative step.
type Differencing = (String, Option<f64>);

/// Numbers of one response or constraint: 1-D arrays.
type Arrays<'py> = Vec<Bound<'py, PyArray1<f64>>>;

/// The row of a table of derivatives.
type CheckedRow = (String, Option<f64>, String, Vec<f64>, Option<f64>, Option<f64>, String, String);
/// Methods, rows, and methods that failed with the reasons.
type CheckedTable = (Vec<String>, Vec<CheckedRow>, Vec<(String, String)>);

#[pymethods]
impl Problem {
    /// Reads a model file; `name` is its name in messages. The functions replace the analysis. `programs` is the folder in which the program
    /// of the file may run.
    #[new]
    #[pyo3(signature = (name, text, functions=None, differences=None, programs=None))]
    fn new(
        py: Python<'_>,
        name: &str,
        text: &str,
        functions: Option<&Bound<'_, PyDict>>,
        differences: Option<Differencing>,
        programs: Option<PathBuf>,
    ) -> PyResult<Self> {
        let functions = functions.map(read_functions).transpose()?;
        let is_function = functions.is_some();
        let read = if is_function { model_file::read_generated } else { model_file::read };
        let has_program = programs.is_some();
        let (model, problem) = work_for(py, has_program, || {
            Ok(read(name, text).map(|mut model| {
                if let Some(folder) = programs {
                    model.allow_programs(&folder);
                }
                let problem = if model.is_problem() { model.problem() } else { model.simulation() };
                let problem = problem.map(|problem| with_functions(problem, functions, differences));
                (model, problem)
            }))
        })?
        .map_err(|report| raise_report(py, &report))?;
        let problem = problem.and_then(|problem| problem).map_err(|error| raise(py, &error))?;
        Ok(Self { model, problem, is_function })
    }

    /// Title, name of the objective with its unit, and its sign: −1 for a maximum. Without an objective its name is empty.
    #[getter]
    fn head(&self) -> (&str, &str, &str, f64) {
        let objective = &self.problem.objective;
        let sign = if objective.goal == Goal::Maximize { -1.0 } else { 1.0 };
        (self.model.title(), &objective.name, &objective.unit, sign)
    }

    /// Names, units, starts, lower and upper bounds.
    #[getter]
    fn variables(&self) -> Vec<(&str, &str, f64, f64, f64)> {
        let all = self.problem.variables.iter();
        all.map(|v| (v.name.as_str(), v.unit.as_str(), v.start, v.lower, v.upper)).collect()
    }

    /// Names and units of the responses; true if they have values over time.
    #[getter]
    fn responses(&self) -> Vec<(&str, &str, bool)> {
        self.problem.responses.iter().map(|r| (r.name.as_str(), r.unit.as_str(), r.grid.is_some())).collect()
    }

    /// Names of the constraints, sides, limits and scales; true if they have values over time.
    #[getter]
    fn constraints(&self) -> Vec<(&str, String, f64, f64, bool)> {
        let all = self.problem.constraints.iter();
        all.map(|c| (c.name.as_str(), format!("{:?}", c.side), c.limit, c.scale, c.quantity.is_transient())).collect()
    }

    /// Name, unit and points of the time grid.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Option<(&str, &str, Bound<'py, PyArray1<f64>>)> {
        let grid = self.problem.grids.first()?;
        Some((&grid.name, &grid.unit, PyArray1::from_vec(py, grid.shown_points())))
    }

    /// Names of the methods by which the analysis can be differentiated.
    #[getter]
    fn gradient_methods(&self) -> Vec<&'static str> {
        self.problem.analysis.gradient_methods().iter().map(|method| method.name).collect()
    }

    /// A number that identifies the problem.
    #[getter]
    fn fingerprint(&self) -> u64 {
        if self.is_function { self.problem.fingerprint() } else { self.model.fingerprint() }
    }

    /// A note about a file of an earlier version.
    #[getter]
    fn note(&self) -> Option<String> {
        self.model.note().map(|note| note.to_string())
    }

    /// Responses, objective, normalized constraints and largest violation in percent at a design.
    fn analyze<'py>(
        &self,
        py: Python<'py>,
        b: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Arrays<'py>, f64, Arrays<'py>, f64, Vec<String>)> {
        let b = vector(&b);
        let AnalyzedDesign { responses, evaluation, .. } = self.located(py, || self.problem.analyze_design(&b))?;
        let arrays = |values: &[Vec<f64>]| values.iter().map(|v| PyArray1::from_slice(py, v)).collect();
        let violation = evaluation.max_violation_pct();
        let constraints: Vec<_> = (0..evaluation.residuals.len()).map(|j| evaluation.normalized(j)).collect();
        let [values, constraints] = [&responses.values, &constraints].map(|all| arrays(all));
        Ok((values, evaluation.objective, constraints, violation, responses.warnings))
    }

    /// Analyses of many designs, one row of each array for each: NaN where the analysis failed, with the reason. An error that concerns all
    /// designs is raised.
    #[expect(clippy::type_complexity, reason = "one tuple for one call of the Python part")]
    fn analyze_many<'py>(
        &self,
        py: Python<'py>,
        designs: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(
        Vec<Bound<'py, PyArray2<f64>>>,
        Bound<'py, PyArray1<f64>>,
        Vec<Bound<'py, PyArray2<f64>>>,
        Bound<'py, PyArray1<f64>>,
        Vec<Option<String>>,
    )> {
        let designs: Vec<Vec<f64>> = designs.as_array().outer_iter().map(|b| b.to_vec()).collect();
        let all = self.analyze_in_calls(py, &designs)?;
        if let Some(error) = all.iter().filter_map(|a| a.as_ref().err()).find(|error| error.ends_run()) {
            return Err(raise(py, error));
        }
        let problem = &self.problem;
        let number = |of: fn(&Evaluation) -> f64| -> Bound<'py, PyArray1<f64>> {
            all.iter().map(|a| a.as_ref().map_or(f64::NAN, |a| of(&a.evaluation))).collect::<Vec<_>>().into_pyarray(py)
        };
        let table = |points: usize, of: &dyn Fn(&AnalyzedDesign) -> Cow<'_, [f64]>| -> Bound<'py, PyArray2<f64>> {
            let mut table = Array2::from_elem((all.len(), points), f64::NAN);
            for (mut row, analyzed) in table.outer_iter_mut().zip(&all) {
                let Ok(analyzed) = analyzed else { continue };
                row.iter_mut().zip(&*of(analyzed)).for_each(|(to, value)| *to = *value);
            }
            table.into_pyarray(py)
        };
        let points = |grid: Option<usize>| grid.map_or(1, |g| problem.grids[g].len());
        let responses = (0..problem.responses.len())
            .map(|h| table(points(problem.responses[h].grid), &move |a| Cow::from(&a.responses.values[h])))
            .collect();
        let constraints = (0..problem.constraints.len())
            .map(|j| {
                table(problem.points_of(&problem.constraints[j].quantity), &move |a| {
                    Cow::from(a.evaluation.normalized(j))
                })
            })
            .collect();
        let failures = all.iter().map(|a| a.as_ref().err().map(ToString::to_string)).collect();
        Ok((responses, number(|e| e.objective), constraints, number(Evaluation::max_violation_pct), failures))
    }

    /// Derivatives of the responses with these numbers: one array (time points × variables) for each.
    #[pyo3(signature = (b, responses, method=None))]
    fn sensitivities<'py>(
        &self,
        py: Python<'py>,
        b: PyReadonlyArray1<'py, f64>,
        responses: Vec<usize>,
        method: Option<String>,
    ) -> PyResult<Vec<Bound<'py, PyArray2<f64>>>> {
        let (b, problem) = (vector(&b), &self.problem);
        let points = |h: usize| problem.responses[h].grid.map_or(1, |g| problem.grids[g].len());
        let at = |&h: &usize| (0..points(h)).map(move |point| ResponseAt { response: h, point });
        let wanted: Vec<ResponseAt> = responses.iter().flat_map(at).collect();
        let rows = self.located(py, || {
            let here = problem.analyze(&b)?;
            self.differentiate(method.as_deref(), &b, &here, &wanted)
        })?;
        let mut first = 0;
        let mut arrays = vec![];
        for &h in &responses {
            let block = rows.rows(first, points(h));
            arrays.push(Array2::from_shape_fn((block.nrows(), block.ncols()), |(p, k)| block[(p, k)]).into_pyarray(py));
            first += points(h);
        }
        Ok(arrays)
    }

    /// A check of the derivatives: methods, rows of the table, methods that failed with the reasons.
    fn check(
        &self,
        py: Python<'_>,
        b: PyReadonlyArray1<'_, f64>,
        points: usize,
        responses: Vec<usize>,
    ) -> PyResult<CheckedTable> {
        let (b, problem) = (vector(&b), &self.problem);
        let checked = self.located(py, || problem.check_responses(&b, points, &responses))?;
        let row = |d: &linkwright::gradient_check::CheckedDerivative| -> CheckedRow {
            let response = &problem.responses[d.at.response];
            let status = match d.status {
                GradientStatus::Wrong => "wrong",
                other => other.text(),
            };
            (
                response.name.clone(),
                response.grid.map(|g| problem.grids[g].shown(problem.grids[g].points[d.at.point])),
                problem.variables[d.variable].name.clone(),
                d.computed.clone(),
                d.difference.map(|slope| slope.value),
                d.difference.map(|slope| slope.error),
                status.to_owned(),
                d.explanation(&checked.methods),
            )
        };
        let rows = checked.derivatives.iter().map(row).collect();
        Ok((checked.methods.clone(), rows, checked.failed))
    }

    /// Runs a method from `start`, or continues a run. `observe` receives the state after each trial step; it returns
    /// true to stop.
    #[pyo3(signature = (start, method, observe, state=None))]
    fn optimize<'py>(
        &self,
        py: Python<'py>,
        start: PyReadonlyArray1<'py, f64>,
        method: Option<&str>,
        observe: &Bound<'py, PyAny>,
        state: Option<&State>,
    ) -> PyResult<Py<State>> {
        self.check_objective(py)?;
        let chosen = method.map(|text| method_of(py, text)).transpose()?;
        let method = chosen.as_ref().map_or(self.model.method(), Model::method);
        let (problem, start) = (&self.problem, vector(&start));
        // The rows of the history that have been observed. The end of a run need not add one.
        let (mut state, mut rows) = match state {
            Some(state) => {
                let state = state.0.clone();
                let rows = state.history.len();
                (self.located(py, || method.restart(problem, state))?, rows)
            }
            None => (self.located(py, || method.start_at(problem, start))?, 0),
        };
        loop {
            if state.history.len() > rows {
                rows = state.history.len();
                if observe.call1((State(state.clone()),))?.is_truthy()? {
                    return Py::new(py, State(state));
                }
            }
            if state.status != Status::Running {
                return Py::new(py, State(state));
            }
            state = self.located(py, || method.step(problem, state))?;
            py.check_signals()?;
        }
    }

    /// The state of a run of this problem from JSON.
    fn state(&self, py: Python<'_>, text: &str) -> PyResult<State> {
        work(py, || RunState::from_json(text, &self.problem)).map(State)
    }

    /// Runs a method to its end: status, objective as it is stated, violation in percent, accepted cycles, analyses, sensitivity analyses,
    /// residual of the optimality conditions; or the reason why it did not run.
    #[expect(clippy::type_complexity, reason = "one tuple for one row of a table")]
    fn compare(&self, py: Python<'_>, name: &str) -> PyResult<(String, f64, f64, usize, usize, usize, f64, Vec<f64>)> {
        self.check_objective(py)?;
        let preset = preset(name).map_err(|error| raise(py, &error))?;
        let method = Method { stop: self.model.method().stop, ..(preset.method)() };
        let outcome = self.work(py, || {
            Ok(method.solve(&self.problem, |_| ()).map(|end| {
                let kkt = PostOptimal::new(&self.problem, &end).map_or(f64::NAN, |post| post.kkt(&self.problem));
                (end, kkt)
            }))
        })?;
        py.check_signals()?;
        Ok(match outcome {
            Ok((end, kkt)) => {
                let (counters, evaluation) = (end.counters, &end.evaluation);
                let violation = evaluation.max_violation_pct();
                let status = end.status.to_string();
                let (analyses, derivatives) = (counters.analyses, counters.sensitivity_analyses);
                let objective = outcome::objective(&self.problem, &end.design, evaluation);
                (status, objective, violation, end.cycles(), analyses, derivatives, kkt, end.design)
            }
            Err(error) => (format!("refused: {error}"), f64::NAN, f64::NAN, 0, 0, 0, f64::NAN, vec![]),
        })
    }
}

impl Problem {
    /// Analyses designs. Signals are checked between two calls; during Python functions, Python checks them.
    fn analyze_in_calls(&self, py: Python<'_>, designs: &[Vec<f64>]) -> PyResult<Vec<Result<AnalyzedDesign>>> {
        if self.is_function {
            return work(py, || Ok(self.problem.analyze_designs(designs)));
        }
        let (mut all, mut size) = (Vec::with_capacity(designs.len()), FIRST_CALL);
        while all.len() < designs.len() {
            let begun = Instant::now();
            let some = &designs[all.len()..designs.len().min(all.len() + size)];
            all.extend(self.work(py, || Ok(self.problem.analyze_designs(some)))?);
            py.check_signals()?;
            size = if begun.elapsed() < CALL_TIME { 2 * size } else { size };
        }
        Ok(all)
    }

    /// Rejects an optimization of a simulation.
    fn check_objective(&self, py: Python<'_>) -> PyResult<()> {
        if self.is_function || self.model.is_problem() {
            return Ok(());
        }
        let why = "there is no objective";
        Err(raise(py, &Error::definition(self.model.title(), why, "add [objective] with minimize = \"…\"")))
    }

    /// Does work, which may use the program of the model.
    pub fn work<T: Send>(&self, py: Python<'_>, task: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
        work_for(py, self.model.program().is_some(), task)
    }

    /// Does work; an error shows the part of the model file that it names.
    fn located<T: Send>(&self, py: Python<'_>, task: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
        self.work(py, || Ok(task()))?.map_err(|error| {
            let report = if self.is_function { None } else { self.model.locate(&error) };
            let text = report.map_or_else(|| error.to_string(), |report| report.to_string());
            raise_as(py, &error, text)
        })
    }

    /// ∂r/∂b of the wanted responses, by the method of this name if it is given.
    fn differentiate(
        &self,
        method: Option<&str>,
        b: &[f64],
        here: &Responses,
        wanted: &[ResponseAt],
    ) -> Result<DMatrix<f64>> {
        let analysis = &*self.problem.analysis;
        let Some(name) = method else { return self.problem.sensitivities(b, here, wanted) };
        if let Some(method) = analysis.gradient_methods().into_iter().find(|method| method.name == name) {
            return method.sensitivities(b, here, wanted);
        }
        if !DIFFERENCES.contains(&name) {
            let mut known: Vec<&str> = analysis.gradient_methods().iter().map(|method| method.name).collect();
            known.extend(DIFFERENCES.iter().filter(|name| !known.contains(*name)).collect::<Vec<_>>());
            let remedy = format!("choose from {}", known.join(", "));
            return Err(Error::definition(
                format!("method of derivatives `{name}`"),
                "there is no such method",
                remedy,
            ));
        }
        differences(analysis, name, None)?.with_variables(&self.problem.variables).sensitivities(b, here, wanted)
    }
}

/// Does work with a program or without one.
fn work_for<T: Send>(py: Python<'_>, has_program: bool, task: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    if has_program { work_with_programs(py, task) } else { work(py, task) }
}

/// Names of finite differences.
const DIFFERENCES: [&str; 4] = ["forward", "central", "richardson", "noise-aware"];

/// Finite differences of whole analyses, with a relative step that suits smooth responses unless it is given.
fn differences<A: Analysis>(analysis: A, name: &str, step: Option<f64>) -> Result<Differences<A>> {
    match (name, step) {
        ("forward", step) => Differences::forward(analysis, step.unwrap_or(1e-6)),
        ("central", step) => Differences::central(analysis, step.unwrap_or(1e-6)),
        ("richardson", step) => Differences::richardson(analysis, step.unwrap_or(1e-3)),
        ("noise-aware", None) => Ok(Differences::noise_aware(analysis)),
        ("noise-aware", Some(_)) => {
            let why = "noise-aware differences choose their steps themselves";
            Err(Error::definition("differences", why, "omit the step, or use central differences"))
        }
        _ => Err(Error::unknown("kind of differences", name, DIFFERENCES)),
    }
}

/// The text of a model file with the files that it names.
#[pyfunction]
pub fn model_text(py: Python<'_>, path: &str, text: &str) -> PyResult<String> {
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    model_file::with_files(path, text, folder).map_err(|report| raise_report(py, &report))
}

fn read_functions(functions: &Bound<'_, PyDict>) -> PyResult<Functions> {
    let get = |key: &str| -> PyResult<Option<Py<PyAny>>> { Ok(functions.get_item(key)?.map(Bound::unbind)) };
    Ok(Functions {
        analyze: get("analyze")?.ok_or_else(|| pyo3::exceptions::PyKeyError::new_err("analyze"))?,
        derivatives: get("derivatives")?,
        second: get("second")?,
        analyze_many: get("analyze_many")?,
    })
}

/// The problem with the analysis by Python functions, and finite differences where they have no derivatives.
fn with_functions(
    mut problem: linkwright::problem::Problem,
    functions: Option<Functions>,
    differencing: Option<Differencing>,
) -> Result<linkwright::problem::Problem> {
    let Some(functions) = functions else { return Ok(problem) };
    let points: Vec<usize> = problem.responses.iter().map(|r| r.grid.map_or(1, |g| problem.grids[g].len())).collect();
    let analysis = FunctionAnalysis::new(functions, &points);
    let (name, step) = differencing.unwrap_or_else(|| ("central".to_owned(), None));
    problem.analysis = match analysis.has_derivatives() {
        true => Box::new(analysis),
        false => Box::new(differences(analysis, &name, step)?.with_variables(&problem.variables)),
    };
    Ok(problem)
}

/// Reads a minimal model with this `[method]`, and returns its method: a `Method` cannot be copied.
fn method_of(py: Python<'_>, text: &str) -> PyResult<Model> {
    let whole = format!("version = 2\n[design.x]\nstart = 1.0\n[objective]\nminimize = \"x\"\n{text}");
    model_file::read("method", &whole).map_err(|report| raise_report(py, &report))
}

fn vector(b: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    b.as_array().to_vec()
}
