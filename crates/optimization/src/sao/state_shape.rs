//! Checks of a state from a file: every length and every index agrees with the problem, so that cycles and reports may rely on it.

use super::{Counters, Cycle, RunState, StartLengths};
use crate::approximation::{CycleData, PreviousPoint};
use crate::problem::{AnalyzedDesign, Evaluation, Peak, Problem, ResponseAt, RowId, Sensitivities};
use error::{Error, Result};
use nalgebra::DMatrix;

/// Largest number of analyses and iterations: far more than any run needs, and far below the largest number that can be stored.
const MOST: usize = usize::MAX / 1024;

impl RunState {
    /// Rejects a state whose parts do not have the shape of the problem, or contradict each other.
    pub(super) fn check_shape(&self, problem: &Problem) -> Result<()> {
        check(self, problem)
    }
}

fn check(state: &RunState, problem: &Problem) -> Result<()> {
    let n = problem.n();
    Error::check_length("design of the state", n, state.design.len())?;
    let Counters { analyses, sensitivity_analyses, subproblem_iterations } = state.counters;
    let counts = [analyses, sensitivity_analyses, subproblem_iterations];
    require(counts.iter().all(|count| *count <= MOST), || format!("a counter is above {MOST}"))?;
    Error::check_length("move-limit factors of the state", n, state.factors.len())?;
    require(state.factors.iter().all(|factor| *factor > 0.0), || "a move-limit factor is not positive".to_owned())?;
    let step = state.last_step.as_ref().map_or(n, Vec::len);
    Error::check_length("last step of the state", n, step)?;
    if let Some(StartLengths { lengths, guessed }) = &state.start_lengths {
        Error::check_length("start lengths of the state", n, lengths.len())?;
        Error::check_length("marks of guessed lengths of the state", n, guessed.len())?;
        require(lengths.iter().all(|d| *d > 0.0 && d.is_finite()), || "a start length is not positive".to_owned())?;
    }
    problem.check_shape(&state.responses)?;
    check_evaluation(&state.evaluation, problem)?;
    let conservatism = state.globalization.conservatism.len();
    if conservatism > 0 {
        Error::check_length("conservatism of the state", 1 + problem.constraints.len(), conservatism)?;
    }
    state.previous.iter().try_for_each(|point| check_previous(point, problem))?;
    state.data.as_ref().map_or(Ok(()), |data| check_data(data, &state.evaluation, problem))?;
    state.points.iter().try_for_each(|point| point.check(problem))?;
    if let (Some(memory), Some(data)) = (&state.automatic, &state.data) {
        let RunState { design, responses, evaluation, .. } = state.clone();
        memory.check(problem, &AnalyzedDesign { design, responses, evaluation }, data)?;
    }
    rows_exist(state.active.iter().flatten().map(|active| active.row), problem)?;
    check_history(&state.history, problem)?;
    let last = state.history.iter().rev().find(|cycle| cycle.accepted);
    let is_last = |cycle: &Cycle| same(&cycle.design, &state.design) && cycle.objective == state.evaluation.objective;
    require(last.is_some_and(is_last), || "the design is not that of the last accepted cycle".to_owned())
}

/// Equal bits, except for the sign of zero.
fn same(one: &[f64], other: &[f64]) -> bool {
    one == other
}

fn check_evaluation(evaluation: &Evaluation, problem: &Problem) -> Result<()> {
    Error::check_length("constraints of the state", problem.constraints.len(), evaluation.residuals.len())?;
    for (declared, values) in problem.constraints.iter().zip(&evaluation.residuals) {
        let what = format!("values of constraint `{}` in the state", declared.name);
        Error::check_length(&what, problem.points_of(&declared.quantity), values.len())?;
    }
    let equalities = (0..problem.constraints.len()).filter(|&j| problem.constraints[j].is_equality());
    require(evaluation.equalities.iter().copied().eq(equalities), || {
        format!("the equality constraints {:?} are not those of the problem", evaluation.equalities)
    })?;
    rows_exist(evaluation.peaks.iter().map(|peak| peak.row), problem)?;
    let is_continuous = |row: RowId| problem.constraints[row.constraint].is_continuous;
    require(evaluation.peaks.iter().all(|peak| is_continuous(peak.row)), || {
        "a constraint with a peak does not hold in continuous time".to_owned()
    })
}

fn check_previous(point: &PreviousPoint, problem: &Problem) -> Result<()> {
    Error::check_length("earlier design of the state", problem.n(), point.design.len())?;
    problem.check_shape(&point.responses)?;
    check_sensitivities(&point.sensitivities, problem)
}

fn check_sensitivities(sensitivities: &Sensitivities, problem: &Problem) -> Result<()> {
    let Sensitivities { at, rows } = sensitivities;
    let exists = |at: &ResponseAt| {
        let declared = problem.responses.get(at.response);
        declared.is_some_and(|response| at.point < response.grid.map_or(1, |grid| problem.grids[grid].len()))
    };
    require(at.iter().all(exists), || "a differentiated response does not exist".to_owned())?;
    require(at.is_sorted_by(|a, b| a < b), || "the differentiated responses are not sorted".to_owned())?;
    check_size("sensitivities", rows, [at.len(), problem.n()])
}

fn check_data(data: &CycleData, evaluation: &Evaluation, problem: &Problem) -> Result<()> {
    let CycleData { retained, sensitivities, curvatures, peaks } = data;
    rows_exist(retained.iter().copied(), problem)?;
    require(retained.is_sorted_by(|a, b| a < b), || "the retained rows are not sorted".to_owned())?;
    require(sensitivities.at == CycleData::needed(problem, retained), || {
        "the differentiated responses are not those of the retained rows".to_owned()
    })?;
    check_sensitivities(sensitivities, problem)?;
    if let Some(curvatures) = curvatures {
        Error::check_length("second derivatives of the state", sensitivities.at.len(), curvatures.len())?;
        curvatures.iter().try_for_each(|one| check_size("second derivatives", one, [problem.n(); 2]))?;
    }
    let wanted = evaluation.peaks.iter().map(|peak| peak.row).filter(|row| retained.contains(row));
    require(peaks.iter().map(|peak| peak.row).eq(wanted), || "the peaks are not those of the evaluation".to_owned())?;
    let continuous = retained.iter().filter(|row| problem.constraints[row.constraint].is_continuous).count();
    Error::check_length("peaks of the state", continuous, peaks.len())?;
    peaks.iter().try_for_each(|peak| check_peak(peak, problem))
}

fn check_peak(peak: &Peak, problem: &Problem) -> Result<()> {
    let (uses, n) = (problem.constraints[peak.row.constraint].quantity.responses().len(), problem.n());
    Error::check_length("responses of a peak", uses, peak.responses.len())?;
    Error::check_length("cross derivatives of a peak", n, peak.cross.len())?;
    check_size("gradients of a peak", &peak.gradients, [uses, n])?;
    if !peak.curvatures.is_empty() {
        Error::check_length("second derivatives of a peak", uses, peak.curvatures.len())?;
    }
    peak.curvatures.iter().try_for_each(|one| check_size("second derivatives of a peak", one, [n; 2]))
}

fn check_history(history: &[Cycle], problem: &Problem) -> Result<()> {
    let mut accepted = 0;
    for (k, cycle) in history.iter().enumerate() {
        require(cycle.cycle == accepted && (k > 0 || cycle.accepted), || {
            format!("line {k} of the history is cycle {}, expected cycle {accepted}", cycle.cycle)
        })?;
        accepted += usize::from(cycle.accepted);
        check_cycle(cycle, problem)?;
    }
    require(accepted > 0, || "the history is empty".to_owned())
}

fn check_cycle(cycle: &Cycle, problem: &Problem) -> Result<()> {
    let n = problem.n();
    let length = |what: &str, got| Error::check_length(&format!("{what} of cycle {}", cycle.cycle), n, got);
    length("design", cycle.design.len())?;
    length("move-limit factors", cycle.factors.len())?;
    if let Some(region) = &cycle.region {
        length("lower side of the subregion", region.lower.len())?;
        length("upper side of the subregion", region.upper.len())?;
        length("sides of the subregion", region.is_limit.len())?;
    }
    rows_exist(cycle.retained.iter().copied(), problem)?;
    rows_exist(cycle.active.iter().map(|active| active.row), problem)?;
    rows_exist(cycle.worst.into_iter(), problem)?;
    let Some(prediction) = &cycle.prediction else { return Ok(()) };
    let (rows, retained) = (format!("predicted rows of cycle {}", cycle.cycle), cycle.retained.len());
    Error::check_length(&rows, retained, prediction.rows.len())?;
    if prediction.analysed.is_empty() {
        Ok(())
    } else {
        Error::check_length(&rows, retained, prediction.analysed.len())
    }
}

fn rows_exist(mut rows: impl Iterator<Item = RowId>, problem: &Problem) -> Result<()> {
    let exists = |row: &RowId| {
        let declared = problem.constraints.get(row.constraint);
        declared.is_some_and(|constraint| row.point < problem.points_of(&constraint.quantity))
    };
    match rows.find(|row| !exists(row)) {
        None => Ok(()),
        Some(RowId { constraint, point }) => {
            let count = problem.constraints.len();
            require(false, || {
                format!("constraint {constraint} at time point {point} does not exist; there are {count} constraints")
            })
        }
    }
}

fn check_size(what: &str, matrix: &DMatrix<f64>, [rows, columns]: [usize; 2]) -> Result<()> {
    Error::check_length(&format!("rows of the {what} of the state"), rows, matrix.nrows())?;
    Error::check_length(&format!("columns of the {what} of the state"), columns, matrix.ncols())
}

fn require(is_met: bool, why: impl FnOnce() -> String) -> Result<()> {
    if is_met {
        Ok(())
    } else {
        Err(Error::definition("state", why(), "continue a state that a run of this problem wrote"))
    }
}
