//! The tables of iterates, and the optima.

use super::method::{HalfToDouble, iterate_with, with_approximated_objective};
use crate::approximation::{Approximation, Asymptotes, Conlin, Linear, Mma};
use crate::cases::{cantilever, eight_bar_truss, two_bar_truss};
use crate::papers::paper::{Observer, ReproducedRun, ReproducedTable};
use crate::problem::Problem;
use crate::report::table::{Cell, Printed, Table};
use crate::sao::Cycle;
use error::Result;

pub(super) const CANTILEVER: &str = include_str!("../../../papers/svanberg-1987/cantilever.csv");
pub(super) const TWO_BAR_TRUSS: &str = include_str!("../../../papers/svanberg-1987/two_bar_truss.csv");
pub(super) const EIGHT_BAR_TRUSS: &str = include_str!("../../../papers/svanberg-1987/eight_bar_truss.csv");
const OPTIMA: &str = include_str!("../../../papers/svanberg-1987/optima.csv");

/// Parameters t of the asymptotes l = t x and u = x/t.
const CANTILEVER_PARAMETERS: [(&str, f64); 7] = [
    ("t = 1/16", 1.0 / 16.0),
    ("t = 1/8", 1.0 / 8.0),
    ("t = 1/4", 1.0 / 4.0),
    ("t = 1/3", 1.0 / 3.0),
    ("t = 1/2", 1.0 / 2.0),
    ("t = 2/3", 2.0 / 3.0),
    ("t = 3/4", 3.0 / 4.0),
];

/// Rates s of the moving asymptotes.
const EIGHT_BAR_PARAMETERS: [(&str, f64); 3] = [("s = 3/4", 3.0 / 4.0), ("s = 1/2", 1.0 / 2.0), ("s = 1/4", 1.0 / 4.0)];

/// Iterations of CONLIN and SLP on the two-bar truss, far more than printed: the runs oscillate without end.
const OSCILLATING: usize = 30;
/// Largest number of iterations to an optimum.
const TO_OPTIMUM: usize = 100;

/// MMA with the asymptotes l = t x and u = x/t.
fn proportional(t: f64) -> Mma {
    Mma { asymptotes: Asymptotes::Proportional(t), ..Mma::SVANBERG_1987 }
}

/// Fixed proportional asymptotes for the area, moving ones for the half span.
fn two_bar_asymptotes() -> Mma {
    const RULES: Asymptotes = Asymptotes::Each(&[
        Asymptotes::Proportional(0.2),
        Asymptotes::Moving { initial: 1.0, shrink: 0.5, grow: 1.0 / 0.75, least: 1e-3, most: 100.0 },
    ]);
    Mma { asymptotes: RULES, ..Mma::SVANBERG_1987 }
}

/// MMA with asymptote distances relative to the area, divided by s on steady progress and multiplied by s on oscillation.
fn relative(s: f64) -> Mma {
    let asymptotes = Asymptotes::Relative { initial: [1.0, 4.0], rate: s, least: [0.6, 1.5], most: [51.0, 49.0] };
    Mma { asymptotes, ..Mma::SVANBERG_1987 }
}

fn run(
    [table, label]: [&'static str; 2],
    problem: Result<Problem>,
    approximation: impl Approximation + 'static,
    iterations: usize,
    observe: &mut Observer,
) -> Result<ReproducedRun> {
    let problem = with_approximated_objective(problem?);
    let method = iterate_with(approximation, HalfToDouble, iterations);
    let state = method.solve(&problem, |s| observe(table, s))?;
    Ok(ReproducedRun { label: Some(label), problem, state })
}

/// A column of a table of iterates: name in files, heading in text, run, and quantity of a cycle.
type IterateColumn<'a> = (&'a str, &'a str, &'a ReproducedRun, fn(&Cycle) -> f64);

/// A table with a row for each of the first `rows` designs, number 0 being the start.
fn iterates(title: &str, columns: &[IterateColumn], rows: usize) -> Result<Table> {
    let names = std::iter::once("iteration").chain(columns.iter().map(|c| c.0));
    let headings = std::iter::once("iteration").chain(columns.iter().map(|c| c.1));
    let mut table = Table::new(title, names).headed(headings)?;
    for k in 0..rows {
        let cell = |&(_, _, run, of): &IterateColumn| run.state.history.get(k).map_or(Cell::Empty, |c| of(c).into());
        table.push(std::iter::once(k.into()).chain(columns.iter().map(cell)))?;
    }
    Ok(table)
}

/// Weights of the cantilever for seven choices of fixed asymptotes.
pub(super) fn cantilever(observe: &mut Observer) -> Result<ReproducedTable> {
    let solve = |(label, t): (&'static str, f64)| {
        run(["cantilever", label], cantilever::problem(), proportional(t), 9, observe)
    };
    let runs = CANTILEVER_PARAMETERS.into_iter().map(solve).collect::<Result<Vec<_>>>()?;
    weights("cantilever", "Five-segment cantilever, weight, asymptotes l = t x and u = x/t", CANTILEVER, runs)
}

/// Weights of the eight-bar truss for three rates of the moving asymptotes.
pub(super) fn eight_bar_truss(observe: &mut Observer) -> Result<ReproducedTable> {
    let solve = |(label, s): (&'static str, f64)| {
        run(["eight_bar_truss", label], eight_bar_truss::problem(), relative(s), 14, observe)
    };
    let runs = EIGHT_BAR_PARAMETERS.into_iter().map(solve).collect::<Result<Vec<_>>>()?;
    weights("eight_bar_truss", "Eight-bar truss, weight, asymptotes that move at the rate s", EIGHT_BAR_TRUSS, runs)
}

/// A table of the weights of several runs, as long as the longest one, with the columns of the printed table.
fn weights(
    name: &'static str,
    title: &str,
    printed: &'static str,
    runs: Vec<ReproducedRun>,
) -> Result<ReproducedTable> {
    let names = printed.lines().next().unwrap_or_default().split(',').skip(1);
    let column = |(name, run)| -> IterateColumn { (name, ReproducedRun::name(run), run, |c| c.objective) };
    let columns: Vec<IterateColumn> = names.zip(&runs).map(column).collect();
    let rows = runs.iter().map(|run| run.state.history.len()).max().unwrap_or(0);
    let table = iterates(title, &columns, rows)?;
    let printed = Some(Printed::from_csv(&format!("{name}.csv"), printed)?);
    Ok(ReproducedTable { name, table, printed, keys: 1, notes: vec![NOT_AVAILABLE], runs })
}

/// Iterates of the two-bar truss: MMA converges, CONLIN and SLP oscillate.
pub(super) fn two_bar_truss(observe: &mut Observer) -> Result<ReproducedTable> {
    const NAME: &str = "two_bar_truss";
    let runs = vec![
        run([NAME, "MMA"], two_bar_truss::problem(), two_bar_asymptotes(), 5, observe)?,
        run([NAME, "CONLIN"], two_bar_truss::problem(), Conlin, OSCILLATING, observe)?,
        run([NAME, "SLP"], two_bar_truss::problem(), Linear, OSCILLATING, observe)?,
    ];
    let [mma, conlin, slp] = [&runs[0], &runs[1], &runs[2]];
    let columns: [IterateColumn; 5] = [
        ("mma_weight", "MMA: weight", mma, |c| c.objective),
        ("mma_x1", "x1", mma, |c| c.design[0]),
        ("mma_x2", "x2", mma, |c| c.design[1]),
        ("conlin_weight", "CONLIN: weight", conlin, |c| c.objective),
        ("slp_weight", "SLP: weight", slp, |c| c.objective),
    ];
    Ok(ReproducedTable {
        name: NAME,
        table: iterates("Two-bar truss, area x1 and half span x2", &columns, 8)?,
        printed: Some(Printed::from_csv("two_bar_truss.csv", TWO_BAR_TRUSS)?),
        keys: 1,
        notes: vec!["CONLIN and SLP run for 30 iterations; the oscillation does not decay.", NOT_AVAILABLE],
        runs,
    })
}

/// The optima of the three problems.
pub(super) fn optima(observe: &mut Observer) -> Result<ReproducedTable> {
    let mut solve = |label, problem, mma| run(["optima", label], problem, mma, TO_OPTIMUM, observe);
    let runs = vec![
        solve("cantilever", cantilever::problem(), proportional(1.0 / 3.0))?,
        solve("two-bar truss", two_bar_truss::problem(), two_bar_asymptotes())?,
        solve("eight-bar truss", eight_bar_truss::problem(), relative(1.0 / 4.0))?,
    ];
    let names = ["problem", "weight", "x1", "x2", "x3", "x4", "x5", "x6", "x7", "x8"];
    let mut table = Table::new("Optima", names);
    for run in &runs {
        let numbers = std::iter::once(run.state.evaluation.objective).chain(run.state.design.iter().copied());
        let cells = numbers.map(Cell::from).chain(std::iter::repeat(Cell::Empty)).take(names.len() - 1);
        table.push(std::iter::once(run.name().into()).chain(cells))?;
    }
    let notes = vec![
        "Cantilever: x4 = 3.50147 by the closed form of the optimum, printed 3.502.",
        "Eight-bar truss: the weight is unique, the design is not; the first four bars share their load in many ways.",
    ];
    let printed = Some(Printed::from_csv("optima.csv", OPTIMA)?);
    Ok(ReproducedTable { name: "optima", table, printed, keys: 1, notes, runs })
}

const NOT_AVAILABLE: &str = "A dash in a column of printed numbers: not printed or not available here.";
