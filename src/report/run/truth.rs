//! What approximate problems promised beside what analyses found.

use super::OptimizationReport;
use crate::Result;
use crate::report::figure::{Axis, Colour, Dash, Figure, Legend, Mark, Marker, Panel, Stroke, literal};
use crate::report::page::Section;
use crate::report::table::{Cell, Table};
use crate::sao::{Cycle, Prediction};

impl OptimizationReport<'_> {
    pub(super) fn truth(&self) -> Result<Section> {
        let section = Section::new("approximation", "Approximation against truth");
        let known: Vec<(&Cycle, &Prediction)> =
            self.state.history.iter().filter_map(|c| Some((c, c.prediction.as_ref()?))).collect();
        if known.is_empty() {
            let done = self.state.history.len() > 1;
            let text = if done {
                "The history does not hold what the approximate problems promised."
            } else {
                "No cycle yet."
            };
            return Ok(section.paragraph(text));
        }
        let section = section
            .paragraph(
                "Each cycle promises an objective and the values of the constraints that it kept; the analysis of the proposed \
                 design says what is true. The closer the two, the wider the move limits may be.",
            )
            .figure("promised-objective", "The objective as promised and as analysed.", self.objectives(&known));
        let rows = known.iter().any(|(_, p)| !p.analysed.is_empty());
        let section = match rows {
            true => section.figure(
                "promised-constraints",
                "Kept constraints at kept time points, normalised: a point on the diagonal keeps its promise, one to the right \
                 of 1 violates its limit.",
                rows_figure(&known),
            ),
            false => section,
        };
        Ok(section.table(self.promises(&known)?))
    }

    fn objectives(&self, known: &[(&Cycle, &Prediction)]) -> Figure {
        let problem = self.problem;
        let objective = Axis::new(literal(&problem.objective.name), literal(&problem.objective.unit));
        let objective = if self.spans_decades() { objective.logarithmic() } else { objective };
        let mut panel = Panel::new(self.cycle_axis(), objective).legend(Legend::Below);
        let of = |accepted: bool| -> Vec<[f64; 2]> {
            self.tries().filter(|c| c.accepted == accepted).map(|c| [c.cycle as f64, c.objective]).collect()
        };
        let succeeded = known.iter().filter(|(c, _)| c.failure.is_none());
        let gaps = succeeded.map(|(c, p)| [c.objective, p.objective].map(|v| [c.cycle as f64, v]).to_vec()).collect();
        let promised: Vec<[f64; 2]> = known.iter().map(|(c, p)| [c.cycle as f64, p.objective]).collect();
        panel.add(Mark::curves(gaps, Stroke::solid(Colour::VERMILLION, 1.1)));
        panel.add(Mark::curve(of(true), Stroke::solid(Colour::BLACK, 0.9)).named("analysed"));
        panel.add(Mark::points(of(true), Marker::Disc, Colour::BLACK, 3.4).named("analysed"));
        panel.add(Mark::points(promised, Marker::Circle, Colour::BLUE, 4.4).named("promised"));
        if !of(false).is_empty() {
            panel.add(Mark::points(of(false), Marker::Cross, Colour::VERMILLION, 4.6).named("rejected try"));
        }
        Figure::new("Objective as promised by the approximate problems and as analysed", 100.0, 78.0).with(panel)
    }

    fn promises(&self, known: &[(&Cycle, &Prediction)]) -> Result<Table> {
        let columns = [
            "cycle",
            "try",
            "objective promised",
            "objective analysed",
            "E_f in %",
            "E_g in %",
            "largest miss",
            "constraint promised",
            "constraint analysed",
        ];
        let mut table = Table::new("Promised and analysed; constraints are normalised so that 1 is the limit", columns);
        for (cycle, p) in known {
            let misses = p.rows.iter().zip(&p.analysed).map(|(a, b)| (a - b).abs());
            let most = misses.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k);
            let failed = cycle.failure.is_some();
            let value = |v: f64| if failed { Cell::Empty } else { Cell::from(v) };
            let row = most
                .and_then(|k| cycle.retained.get(k))
                .map_or_else(String::new, |row| self.problem.row_in_words(*row));
            table.push([
                cycle.cycle.into(),
                super::verdict(cycle).into(),
                p.objective.into(),
                value(cycle.objective),
                value(cycle.objective_error_pct),
                value(cycle.constraint_error_pct),
                row.as_str().into(),
                most.map_or(Cell::Empty, |k| p.rows[k].into()),
                most.map_or(Cell::Empty, |k| p.analysed[k].into()),
            ])?;
        }
        Ok(table)
    }
}

/// Promised over analysed values of kept rows; those of the last cycle on top.
fn rows_figure(known: &[(&Cycle, &Prediction)]) -> Figure {
    let points = |p: &Prediction| -> Vec<[f64; 2]> { p.analysed.iter().zip(&p.rows).map(|(a, b)| [*a, *b]).collect() };
    let earlier: Vec<[f64; 2]> = known.iter().rev().skip(1).flat_map(|(_, p)| points(p)).collect();
    let last = known.last().map_or_else(Vec::new, |(_, p)| points(p));
    let all = earlier.iter().chain(&last).flatten();
    let [low, high] = all.fold([1.0f64, 1.0f64], |[l, h], v| [l.min(*v), h.max(*v)]);
    let margin = 0.06 * (high - low).max(0.02);
    let [low, high] = [low - margin, high + margin];
    let axis = |name: &str| Axis::new(name, "").limits(low, high);
    let mut panel = Panel::new(axis("analysed"), axis("promised")).legend(Legend::Below);
    let limit = Stroke::solid(Colour::GREY, 0.7).dash(Dash::Dashed);
    panel.add(Mark::curve(vec![[1.0, low], [1.0, high]], limit).named("limit"));
    panel.add(Mark::curve(vec![[low, 1.0], [high, 1.0]], limit));
    panel.add(Mark::curve(vec![[low, low], [high, high]], Stroke::solid(Colour::BLACK, 0.7)));
    if !earlier.is_empty() {
        panel.add(Mark::points(earlier, Marker::Disc, Colour::SKY, 2.6).named("earlier cycles"));
    }
    panel.add(Mark::points(last, Marker::Disc, Colour::VERMILLION, 3.4).named("last cycle"));
    Figure::new("Kept constraints as promised and as analysed", 100.0, 98.0).with(panel)
}
