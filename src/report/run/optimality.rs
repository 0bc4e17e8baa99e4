//! Residuals of the optimality conditions, and multipliers.

use super::{OptimizationReport, number};
use crate::Result;
use crate::report::figure::{Colour, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, Stroke};
use crate::report::outcome;
use crate::report::page::PageSection;
use crate::report::table::{Cell, Table};
use crate::sao::{ActiveRow, Cycle};

/// Largest number of multipliers in the table.
const MOST: usize = 40;

/// Residual below which differences are rounding errors.
const LEAST: f64 = 1e-12;

impl OptimizationReport<'_> {
    pub(super) fn optimality(&self) -> Result<PageSection> {
        let mut section = PageSection::new("optimality", "Optimality conditions");
        let Some(last) = self.last() else { return Ok(section) };
        let active = self.state.active_rows();
        let has_residuals = self.state.history.iter().any(|cycle| cycle.residual.is_some());
        if has_residuals {
            section = section.paragraph(
                "The residual of the problem is that of the first-order optimality conditions at the start of a cycle, relative to the \
                 objective; it is computed once the objective has nearly converged. The residual of the subproblem is that of its \
                 solution, computed independently of the solver.",
            );
        }
        if let Some(residual) = last.residual {
            section = section.paragraph(format!("At the end the residual of the problem is {}.", number(residual)));
        }
        if let Some(figure) = self.residuals().filter(|_| has_residuals) {
            section = section.figure(
                "residuals",
                "Residuals of the optimality conditions. Smaller ones are drawn at 1e-12.",
                figure,
            );
        }
        if active.is_empty() {
            let text = "No constraint is active at the last design; only bounds or move limits may be.";
            return Ok(section.paragraph(text));
        }
        section = section.paragraph(
            "A multiplier is the sensitivity of the objective to a limit: relaxing the limit by one percent of its scale \
             improves the objective by about a hundredth of the multiplier.",
        );
        Ok(section.table(self.multipliers(active)?))
    }

    fn residuals(&self) -> Option<Figure> {
        let of = |value: fn(&Cycle) -> Option<f64>| -> Vec<[f64; 2]> {
            let steps = self.shown_steps().map(|(c, _)| c).filter(|c| c.region.is_some());
            steps.filter_map(|c| Some([c.cycle as f64, value(c)?.max(LEAST)])).collect()
        };
        let (problem, subproblem) = (of(|c| c.residual), of(|c| Some(c.kkt)));
        if problem.is_empty() && subproblem.is_empty() {
            return None;
        }
        let mut panel =
            Panel::new(self.cycle_axis(), PlotAxis::new("residual", "").logarithmic()).legend(Legend::Below);
        for (points, name, marker, colour) in [
            (problem, "problem", MarkerShape::Disc, Colour::VERMILLION),
            (subproblem, "subproblem", MarkerShape::Square, Colour::BLUE),
        ] {
            if !points.is_empty() {
                panel.add(Mark::curve(points.clone(), Stroke::solid(colour, 0.9)).named(name));
                panel.add(Mark::points(points, marker, colour, 3.6).named(name));
            }
        }
        Some(Figure::new("Residuals of the optimality conditions over the cycles", 100.0, 70.0).with(panel))
    }

    fn multipliers(&self, active: &[ActiveRow]) -> Result<Table> {
        let unit = match self.problem.objective.unit.as_str() {
            "" => "multiplier".to_owned(),
            unit => format!("multiplier in {unit}"),
        };
        let cycle = self.last().map_or(0, |cycle| cycle.cycle);
        let title = format!("Multipliers of the active constraints of cycle {cycle}");
        let mut table = Table::new(
            title,
            ["constraint".to_owned(), unit, "value at the last design".to_owned(), "unit".to_owned()],
        );
        let mut active = active.to_vec();
        active.sort_by(|a, b| b.multiplier.abs().total_cmp(&a.multiplier.abs()).then(a.row.cmp(&b.row)));
        for a in active.iter().take(MOST) {
            let j = a.row.constraint;
            let values = outcome::values(self.problem, j, &self.state.design, &self.state.evaluation);
            let value = values[a.row.point].map_or(Cell::Empty, Cell::from);
            let (name, unit) = (self.problem.row_in_words(a.row), outcome::unit(self.problem, j));
            table.push([name.as_str().into(), a.multiplier.into(), value, unit.into()])?;
        }
        Ok(table)
    }
}
