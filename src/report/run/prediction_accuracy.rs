//! Accuracy of the approximate problems: predicted and computed values of each cycle.

use super::OptimizationReport;
use crate::Result;
use crate::report::figure::{Colour, Dash, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke};
use crate::report::outcome;
use crate::report::page::PageSection;
use crate::report::table::{Cell, Table};
use crate::sao::{Cycle, Prediction};

impl OptimizationReport<'_> {
    pub(super) fn prediction_accuracy(&self) -> Result<PageSection> {
        let section = PageSection::new("approximation", "Predicted and computed responses");
        let known: Vec<(&Cycle, &Prediction)> =
            self.shown_steps().filter_map(|(c, _)| Some((c, c.prediction.as_ref()?))).collect();
        if known.is_empty() {
            let done = self.state.history.len() > 1;
            let text =
                if done { "The history has no predictions of the approximate problems." } else { "No cycle yet." };
            return Ok(section.paragraph(text));
        }
        let section = section
            .paragraph(
                "The approximate problem of each cycle predicts the objective and the retained constraints at the proposed \
                 design; the analysis of that design computes them. The smaller the differences, the wider the move limits may be.",
            )
            .figure("predicted-objective", "Predicted and computed objective.", self.objectives(&known));
        let rows = known.iter().any(|(_, p)| !p.analysed.is_empty());
        let section = match rows {
            true => section.figure(
                "predicted-constraints",
                "Retained constraints at retained time points, normalized: on the diagonal, prediction and computation agree; to \
                 the right of 1, the limit is violated.",
                rows_figure(&known),
            ),
            false => section,
        };
        Ok(section.table(self.predictions()?))
    }

    fn objectives(&self, known: &[(&Cycle, &Prediction)]) -> Figure {
        let problem = self.problem;
        let objective = PlotAxis::of(&QuantityLabel::literal(&problem.objective.name, &problem.objective.unit));
        let objective = if self.spans_decades() { objective.logarithmic() } else { objective };
        let mut panel = Panel::new(self.cycle_axis(), objective).legend(Legend::Below);
        let of = |accepted: bool| -> Vec<[f64; 2]> {
            let steps = self.successful_steps().filter(|(c, _)| c.accepted == accepted);
            steps.map(|(c, objective)| [c.cycle as f64, objective]).collect()
        };
        let predicted_at = |c: &Cycle| outcome::predicted_objective(problem, c);
        let gap =
            |(c, objective): (&Cycle, f64)| Some([objective, predicted_at(c)?].map(|v| [c.cycle as f64, v]).to_vec());
        let gaps = self.successful_steps().filter_map(gap).collect();
        let predicted = known.iter().filter_map(|(c, _)| Some([c.cycle as f64, predicted_at(c)?]));
        let predicted: Vec<[f64; 2]> = predicted.collect();
        panel.add(Mark::curves(gaps, Stroke::solid(Colour::VERMILLION, 1.1)));
        panel.add(Mark::curve(of(true), Stroke::solid(Colour::BLACK, 0.9)).named("computed"));
        panel.add(Mark::points(of(true), MarkerShape::Disc, Colour::BLACK, 3.4).named("computed"));
        panel.add(Mark::points(predicted, MarkerShape::Circle, Colour::BLUE, 4.4).named("predicted"));
        if !of(false).is_empty() {
            panel.add(Mark::points(of(false), MarkerShape::Cross, Colour::VERMILLION, 4.6).named("rejected step"));
        }
        Figure::new("Predicted and computed objective", 100.0, 78.0).with(panel)
    }

    fn predictions(&self) -> Result<Table> {
        let columns = [
            "cycle",
            "outcome",
            "objective predicted",
            "objective computed",
            "E_f in %",
            "E_g in %",
            "largest error at",
            "constraint predicted",
            "constraint computed",
        ];
        let mut table =
            Table::new("Predicted and computed values; constraints are normalized, their limit is 1", columns);
        for (cycle, objective) in self.shown_steps() {
            let Some(p) = &cycle.prediction else { continue };
            let differences = p.rows.iter().zip(&p.analysed).map(|(a, b)| (a - b).abs());
            let largest = differences.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k);
            let failed = cycle.failure.is_some();
            let value = |v: f64| if failed { Cell::Empty } else { Cell::from(v) };
            let row = largest
                .and_then(|k| cycle.retained.get(k))
                .map_or_else(String::new, |row| self.problem.row_in_words(*row));
            table.push([
                cycle.cycle.into(),
                super::verdict(cycle).into(),
                outcome::predicted_objective(self.problem, cycle).map_or(Cell::Empty, Cell::from),
                value(objective),
                value(cycle.objective_error_pct),
                value(cycle.constraint_error_pct),
                row.as_str().into(),
                largest.map_or(Cell::Empty, |k| p.rows[k].into()),
                largest.map_or(Cell::Empty, |k| p.analysed[k].into()),
            ])?;
        }
        Ok(table)
    }
}

/// Plot of predicted over computed values of the retained constraints; the points of the last cycle are drawn last.
fn rows_figure(known: &[(&Cycle, &Prediction)]) -> Figure {
    let points = |p: &Prediction| -> Vec<[f64; 2]> { p.analysed.iter().zip(&p.rows).map(|(a, b)| [*a, *b]).collect() };
    let earlier: Vec<[f64; 2]> = known.iter().rev().skip(1).flat_map(|(_, p)| points(p)).collect();
    let last = known.last().map_or_else(Vec::new, |(_, p)| points(p));
    let all = earlier.iter().chain(&last).flatten();
    let [low, high] = all.fold([1.0f64, 1.0f64], |[l, h], v| [l.min(*v), h.max(*v)]);
    let margin = 0.06 * (high - low).max(0.02);
    let [low, high] = [low - margin, high + margin];
    let axis = |name: &str| PlotAxis::new(name, "").limits(low, high);
    let mut panel = Panel::new(axis("computed"), axis("predicted")).legend(Legend::Below).plane();
    let limit = Stroke::solid(Colour::GREY, 0.7).dash(Dash::Dashed);
    panel.add(Mark::curve(vec![[1.0, low], [1.0, high]], limit).named("limit"));
    panel.add(Mark::curve(vec![[low, 1.0], [high, 1.0]], limit));
    panel.add(Mark::curve(vec![[low, low], [high, high]], Stroke::solid(Colour::BLACK, 0.7)));
    if !earlier.is_empty() {
        panel.add(Mark::points(earlier, MarkerShape::Disc, Colour::SKY, 2.6).named("earlier cycles"));
    }
    panel.add(Mark::points(last, MarkerShape::Disc, Colour::VERMILLION, 3.4).named("last cycle"));
    Figure::new("Predicted and computed retained constraints", 100.0, 98.0).with(panel)
}
