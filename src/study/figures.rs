//! Figures of the rows of a study.

use super::plan::{Column, Phase};
use super::rows::{Row, Rows};
use crate::Result;
use crate::report::figure::{
    Anchor, Colour, ColourBar, ColourMap, Figure, Grid, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel,
    Stroke, literal,
};

/// Largest number of panels in a row and in a column.
const PANELS: usize = 4;
/// Largest number of points of a scatter plot; of more rows, every n-th one is drawn.
const SCATTER_POINTS: usize = 2000;

/// Largest number of nodes of a grid that are marked.
const NODES: usize = 600;

/// The label of a column.
pub fn label(column: &Column) -> QuantityLabel {
    let name = column.name.strip_suffix("_pct").filter(|_| column.unit == "%").unwrap_or(&column.name);
    QuantityLabel::literal(name, &column.unit)
}

/// The axis of a column.
pub fn axis(column: &Column) -> PlotAxis {
    let axis = PlotAxis::of(&label(column));
    let axis = if column.is_count { axis.whole() } else { axis };
    if column.is_logarithmic { axis.logarithmic() } else { axis }
}

/// Rows with results.
fn finished(rows: &Rows, phase: usize) -> Vec<&Row> {
    rows.of(phase).filter(|row| !row.has_failed()).collect()
}

/// A scatter plot for each quantity (downwards) over each variable (to the right); the first `inputs` columns are variables. `None` without rows.
pub fn over_sample(phase: &Phase, rows: &Rows, inputs: usize) -> Result<Option<Figure>> {
    let rows = finished(rows, 0);
    let shown: Vec<&&Row> = rows.iter().step_by(rows.len().div_ceil(SCATTER_POINTS).max(1)).collect();
    let across = inputs.min(PANELS);
    let down = (phase.columns.len() - inputs).min(PANELS);
    if shown.is_empty() || across == 0 || down == 0 {
        return Ok(None);
    }
    let mut figure = Figure::new("Results over the variables", 45.0 * across as f64 + 15.0, 42.0 * down as f64 + 8.0)
        .in_columns(across);
    for y in inputs..inputs + down {
        for x in 0..across {
            let points: Vec<[f64; 2]> = shown
                .iter()
                .map(|row| [row.value(x), row.value(y)])
                .filter(|p| p.iter().all(|v| v.is_finite()))
                .collect();
            let mut panel = Panel::new(axis(&phase.columns[x]), axis(&phase.columns[y])).legend(Legend::Absent);
            panel.add(Mark::points(points, MarkerShape::Disc, Colour::BLUE, 1.6));
            figure = figure.with(panel);
        }
    }
    Ok(Some(figure))
}

/// The first quantities over a grid: curves over one variable, fields over the first two (at the first values of the others).
pub fn over_grid(phase: &Phase, rows: &Rows, values: &[Vec<f64>]) -> Result<Option<Figure>> {
    let inputs = values.len();
    let all = finished(rows, 0);
    let quantities = inputs..phase.columns.len().min(inputs + PANELS);
    if all.is_empty() || quantities.is_empty() {
        return Ok(None);
    }
    if inputs == 1 {
        let mut figure = Figure::new("Results over the variable", 85.0, 50.0 * quantities.len() as f64);
        for y in quantities {
            figure = figure.with(curve(phase, &all, 0, y));
        }
        return Ok(Some(figure));
    }
    let y = inputs;
    let mut field = vec![f64::NAN; values[0].len() * values[1].len()];
    let rest: usize = values[2..].iter().map(Vec::len).product();
    for row in &all {
        if row.run % rest == 0 {
            let cell = row.run / rest;
            let (i, j) = (cell / values[1].len(), cell % values[1].len());
            field[j * values[0].len() + i] = row.value(y);
        }
    }
    let increasing = |values: &[f64]| values.windows(2).all(|pair| pair[0] < pair[1]);
    if !(increasing(&values[0]) && increasing(&values[1])) || field.iter().all(|v| !v.is_finite()) {
        return over_sample(phase, rows, inputs);
    }
    let grid = Grid::with_holes(&values[0], &values[1], &field)?;
    let range = grid.range();
    let mut panel = Panel::new(axis(&phase.columns[0]), axis(&phase.columns[1])).legend(Legend::Absent);
    panel.add(Mark::field(grid, ColourMap::Sequential, range));
    let analysed: Vec<[f64; 2]> = values[0].iter().flat_map(|x| values[1].iter().map(|y| [*x, *y])).collect();
    if analysed.len() <= NODES {
        panel.add(Mark::points(analysed, MarkerShape::Disc, Colour::BLACK, 1.2).described("analysed designs"));
    }
    let bar = ColourBar { quantity: label(&phase.columns[y]), map: ColourMap::Sequential, range };
    Ok(Some(Figure::new("Result over two variables", 110.0, 80.0).with(panel).with_colour_bar(bar)))
}

/// A panel with a column over another one as a curve with points, in the order of the values.
pub fn curve(phase: &Phase, rows: &[&Row], x: usize, y: usize) -> Panel {
    let mut points: Vec<[f64; 2]> =
        rows.iter().map(|row| [row.value(x), row.value(y)]).filter(|p| p.iter().all(|v| v.is_finite())).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut panel = Panel::new(axis(&phase.columns[x]), axis(&phase.columns[y])).legend(Legend::Absent);
    panel.add(Mark::curve(points.clone(), Stroke::solid(Colour::BLUE, 0.8)));
    panel.add(Mark::points(points, MarkerShape::Disc, Colour::BLUE, 3.0));
    panel
}

/// Horizontal bars with names above them; for each name, a value of each series.
pub fn bars(quantity: &str, names: &[String], series: &[(&str, Vec<f64>)]) -> Panel {
    let low = 0.8 - names.len().max(1) as f64;
    let mut panel = Panel::new(PlotAxis::new(quantity, ""), PlotAxis::new("", "").limits(low - 0.5, 0.5).unlabelled())
        .legend(Legend::Below);
    let width = 0.6 / series.len().max(1) as f64;
    for (s, (name, values)) in series.iter().enumerate() {
        for (k, value) in values.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            let top = -(k as f64) - s as f64 * width;
            let outline = [[0.0, top], [*value, top], [*value, top - 0.9 * width], [0.0, top - 0.9 * width]];
            let bar = Mark::region(outline, Colour::of_series(s + 1), 1.0);
            panel.add(if k == 0 && series.len() > 1 { bar.named(*name) } else { bar });
        }
    }
    for (k, name) in names.iter().enumerate() {
        panel.add(Mark::text([0.0, -(k as f64)], literal(name), Anchor::Start, [1.0, 5.0]));
    }
    panel
}

/// At most four panels of bars, one below the other; `None` without a panel.
pub fn stacked(description: &str, panels: Vec<Panel>, bars: usize) -> Option<Figure> {
    let shown = panels.len().min(PANELS);
    let height = (25.0 + 9.0 * bars as f64).min(220.0);
    let figure = Figure::new(description, 100.0, height * shown.max(1) as f64);
    (shown > 0).then(|| panels.into_iter().take(PANELS).fold(figure, Figure::with))
}

/// Starts and ends of optimizations: the plane of the first two variables, or objectives alone for one variable.
///
/// `starts` and `ends` have the columns of the first two variables.
pub fn starts_and_ends(phase: &Phase, rows: &[&Row], starts: [usize; 2], ends: [usize; 2]) -> Panel {
    let point = |row: &Row, at: [usize; 2]| at.map(|column| row.value(column));
    let is_finite = |p: &[f64; 2]| p.iter().all(|v| v.is_finite());
    let pairs: Vec<[[f64; 2]; 2]> = rows
        .iter()
        .map(|row| [point(row, starts), point(row, ends)])
        .filter(|pair| pair.iter().all(is_finite))
        .collect();
    let mut panel =
        Panel::new(PlotAxis::of(&label(&phase.columns[ends[0]])), PlotAxis::of(&label(&phase.columns[ends[1]])))
            .legend(Legend::Below);
    let lines = pairs.iter().map(|pair| pair.to_vec()).collect();
    panel.add(Mark::curves(lines, Stroke::solid(Colour::of_series(3), 0.3)));
    panel.add(
        Mark::points(pairs.iter().map(|p| p[0]).collect::<Vec<_>>(), MarkerShape::Circle, Colour::of_series(1), 2.5)
            .named("start"),
    );
    panel.add(
        Mark::points(pairs.iter().map(|p| p[1]).collect::<Vec<_>>(), MarkerShape::Disc, Colour::BLUE, 3.5).named("end"),
    );
    panel
}

/// Values in increasing order over their rank. Values whose difference is below `least` are drawn as one value.
pub fn ranked(quantity: &QuantityLabel, series: &[(String, Vec<f64>)], least: f64) -> Panel {
    let all = || series.iter().flat_map(|(_, values)| values).copied().filter(|v| v.is_finite());
    let [low, high] = all().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    let mut axis = PlotAxis::of(quantity);
    if high - low < least {
        axis = axis.limits(0.5 * (low + high - least), 0.5 * (low + high + least));
    }
    let mut panel = Panel::new(PlotAxis::new("rank", "").whole(), axis).legend(Legend::Below);
    for (s, (name, values)) in series.iter().enumerate() {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let points: Vec<[f64; 2]> = sorted.iter().enumerate().map(|(k, v)| [k as f64 + 1.0, *v]).collect();
        panel.add(Mark::points(points, MarkerShape::Disc, Colour::of_series(s), 3.0).named(literal(name)));
    }
    panel
}

/// A histogram of values, with the share of values in each of its intervals.
pub fn histogram(column: &Column, values: &[f64]) -> Option<Panel> {
    let values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let low = values.iter().copied().reduce(f64::min)?;
    let high = values.iter().copied().reduce(f64::max).filter(|high| *high > low)?;
    let count = ((values.len() as f64).sqrt() as usize).clamp(5, 50);
    let width = (high - low) / count as f64;
    let mut shares = vec![0.0; count];
    values.iter().for_each(|v| shares[(((v - low) / width) as usize).min(count - 1)] += 1.0 / values.len() as f64);
    let mut panel = Panel::new(PlotAxis::of(&label(column)), PlotAxis::new("share", "")).legend(Legend::Absent);
    for (k, share) in shares.iter().enumerate() {
        let (left, right) = (low + k as f64 * width, low + (k + 1) as f64 * width);
        panel.add(Mark::region([[left, 0.0], [left, *share], [right, *share], [right, 0.0]], Colour::SKY, 1.0));
    }
    Some(panel)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::Scale;

    #[test]
    fn a_logarithmic_range_has_a_logarithmic_axis() {
        let columns = vec![Column::new("k", "N/m").on_scale(true), Column::new("f", "Hz")];
        let phase = Phase::independent("runs", columns, 0);
        let panel = curve(&phase, &[], 0, 1);
        assert_eq!([panel.x.scale, panel.y.scale], [Scale::Logarithmic, Scale::Linear]);
        assert_eq!(Scale::Logarithmic.between([1.0, 100.0], 0.5), 10.0);
    }
}
