//! Several methods on the problem of a model file.

use linkwright::model_file::Model;
use linkwright::problem::Problem;
use linkwright::report::table::{Cell, Table};
use linkwright::sao::{Method, PostOptimal, Preset, State};
use rayon::prelude::*;

/// A method with the end of its run, or why it did not run.
pub struct Row {
    pub method: &'static str,
    end: Result<End, String>,
}

struct End {
    state: State,
    /// Largest residual of the optimality conditions, apart from any method.
    kkt: f64,
}

/// The name of the method that the file has itself.
const OWN: &str = "(the file's)";

/// Runs the file's own method and others on its problem, several at a time. The stop test is the file's.
///
/// **Errors.** If the problem cannot be made.
pub fn rows(model: &Model, presets: &[&'static Preset]) -> linkwright::Result<Vec<Row>> {
    let problem = model.problem()?;
    let stop = model.method().stop;
    let own = [row(OWN, model.method(), &problem)];
    let others: Vec<Row> =
        presets.par_iter().map(|preset| row(preset.name, &Method { stop, ..(preset.method)() }, &problem)).collect();
    let mut all: Vec<Row> = own.into_iter().chain(others).collect();
    all.sort_by_key(Row::rank);
    Ok(all)
}

fn row(method: &'static str, settings: &Method, problem: &Problem) -> Row {
    let end = settings.solve(problem, |_| ()).map(|state| {
        let kkt = PostOptimal::new(problem, &state).map_or(f64::NAN, |post| post.kkt(problem));
        End { state, kkt }
    });
    Row { method, end: end.map_err(|error| error.to_string()) }
}

impl Row {
    /// Why the method did not run.
    pub fn refused(&self) -> Option<&str> {
        self.end.as_ref().err().map(String::as_str)
    }

    /// Solutions first, then the least work.
    fn rank(&self) -> (u8, usize) {
        match &self.end {
            Ok(End { state, .. }) => {
                let counters = state.counters;
                (u8::from(!state.status.is_success()), counters.analyses + counters.sensitivity_analyses)
            }
            Err(_) => (2, 0),
        }
    }
}

/// One row for each method, solutions with the least work first. `above_best` is (F − F*) / |F*| with the least objective F* of
/// all solutions.
pub fn table(model: &Model, rows: &[Row]) -> linkwright::Result<Table> {
    let columns = [
        "method",
        "end",
        "cycles",
        "analyses",
        "sensitivity_analyses",
        "objective",
        "above_best",
        "violation_pct",
        "kkt_residual",
    ];
    let solutions = rows.iter().filter_map(|row| row.end.as_ref().ok()).filter(|end| end.state.status.is_success());
    let best = solutions.map(|end| end.state.evaluation.objective).fold(f64::INFINITY, f64::min);
    let mut table = Table::new(model.title(), columns);
    for row in rows {
        let name = Cell::from(row.method);
        let Ok(End { state, kkt }) = &row.end else {
            let nothing = std::iter::repeat_n(Cell::Empty, columns.len() - 2);
            table.push([name, "refused".into()].into_iter().chain(nothing))?;
            continue;
        };
        let objective = state.evaluation.objective;
        let number = |v: f64| if v.is_finite() { Cell::Number(v) } else { Cell::Empty };
        table.push([
            name,
            format!("{:?}", state.status).as_str().into(),
            state.cycles().into(),
            state.counters.analyses.into(),
            state.counters.sensitivity_analyses.into(),
            number(objective),
            number((objective - best) / best.abs()),
            number(state.evaluation.max_violation_pct()),
            number(*kkt),
        ])?;
    }
    Ok(table)
}
