//! Weight over the iterations, computed and printed.

use super::tables::{CANTILEVER, EIGHT_BAR_TRUSS, TWO_BAR_TRUSS};
use crate::papers::paper::ReproducedTable;
use crate::report::figure::{Colour, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, Stroke};
use error::Result;

/// The convergence of the runs of a table, by file stem; none for the table of optima.
pub(super) fn figures(table: &ReproducedTable) -> Result<Vec<(String, Figure)>> {
    let (printed, columns): (&str, &[usize]) = match table.name {
        "cantilever" => (CANTILEVER, &[1, 2, 3, 4, 5, 6, 7]),
        "two_bar_truss" => (TWO_BAR_TRUSS, &[1, 4, 5]),
        "eight_bar_truss" => (EIGHT_BAR_TRUSS, &[1, 2, 3]),
        _ => return Ok(vec![]),
    };
    let last = table.table.rows().len().max(2) as f64 - 1.0;
    let iteration = PlotAxis::new("iteration", "").limits(-0.3, last + 0.3).whole();
    let mut panel = Panel::new(iteration, PlotAxis::new("weight", "")).legend(Legend::Below);
    for (k, run) in table.runs.iter().enumerate() {
        let weights = run.state.history.iter().take(last as usize + 1).enumerate();
        let ours: Vec<[f64; 2]> = weights.map(|(k, c)| [k as f64, c.objective]).collect();
        panel.add(Mark::curve(ours, Stroke::solid(Colour::of_series(k), 0.8)).named(run.name()));
    }
    for (k, &column) in columns.iter().enumerate() {
        let points = printed_column(printed, column);
        panel.add(Mark::points(points, MarkerShape::Circle, Colour::of_series(k), 3.6).named("printed"));
    }
    let figure = Figure::new("Weight over the iterations, computed as lines, printed as circles", 120.0, 90.0);
    Ok(vec![(format!("{}_convergence", table.name), figure.with(panel))])
}

/// Iteration and value of the printed numbers of a column.
fn printed_column(csv: &str, column: usize) -> Vec<[f64; 2]> {
    let cell = |line: &str, c: usize| line.split(',').nth(c)?.parse::<f64>().ok();
    csv.lines().skip(1).filter_map(|line| Some([cell(line, 0)?, cell(line, column)?])).collect()
}
