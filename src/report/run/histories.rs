//! Responses and constraints over time.

use super::watched::Watched;
use super::{OptimizationReport, stem};
use crate::Result;
use crate::report::figure::{Quantity, literal};
use crate::report::page::Section;
use crate::report::plots::{History, TimeHistory, time_history};

/// Most constrained histories, and most others.
const MOST: usize = 12;
const OTHERS: usize = 6;

impl OptimizationReport<'_> {
    pub(super) fn histories(&self) -> Result<Section> {
        let watched = self.watched();
        let mut order: Vec<usize> = (0..watched.len()).filter(|&k| watched[k].points.len() > 1).collect();
        order.sort_by(|a, b| watched[*b].worst.total_cmp(&watched[*a].worst).then(a.cmp(b)));
        let hidden = order.len().saturating_sub(MOST);
        order.truncate(MOST);
        order.sort_unstable();
        let shown: Vec<usize> = watched.iter().filter_map(|w| w.response).collect();
        let is_other = |h: &usize| {
            let grid = self.problem.responses[*h].grid;
            grid.is_some_and(|g| self.problem.grids[g].len() > 1) && !shown.contains(h)
        };
        let enters = |h: &usize| self.problem.constraints.iter().any(|c| c.quantity.responses().contains(h));
        let mut others: Vec<usize> = (0..self.problem.responses.len()).filter(is_other).collect();
        // What enters no constraint is seen nowhere else.
        others.sort_by_key(enters);
        let mut section = Section::new("histories", "Histories over time");
        if order.is_empty() && others.is_empty() {
            return Ok(section);
        }
        section = section.paragraph(
            "Dashed: the first design; black: the last one. A bound is hatched on its forbidden side. Rings are time points that \
             the approximate problem of the last cycle kept, filled ones those that held its solution.",
        );
        for k in order {
            let caption = format!("{}{}.", watched[k].name, watched[k].remark);
            section = section.figure(
                format!("history-{}-{}", k + 1, stem(&watched[k].name)),
                caption,
                self.of_watched(&watched[k])?,
            );
        }
        let behind = others.len().saturating_sub(OTHERS);
        for h in others.into_iter().take(OTHERS) {
            let name = &self.problem.responses[h].name;
            let role = if enters(&h) { "which enters constraints" } else { "not constrained" };
            section = section.figure(
                format!("response-{}-{}", h + 1, stem(name)),
                format!("{name}, {role}."),
                self.of_response(h)?,
            );
        }
        if hidden + behind > 0 {
            let text = format!(
                "{} more histories, farther from their limits, are in constraints.csv and responses.csv.",
                hidden + behind
            );
            section = section.paragraph(text);
        }
        Ok(section)
    }

    fn of_watched(&self, w: &Watched) -> Result<crate::report::figure::Figure> {
        time_history(&TimeHistory {
            time: self.time(w.grid),
            response: Quantity::new(literal(&w.name), literal(&w.unit)),
            times: &self.problem.grids[w.grid].points[w.points.clone()],
            histories: &pair(&w.first, &w.last),
            bounds: &w.bounds,
            kept: &w.kept,
            active: &w.active,
        })
        .map(|figure| figure.sized(100.0, 70.0))
    }

    fn of_response(&self, h: usize) -> Result<crate::report::figure::Figure> {
        let response = &self.problem.responses[h];
        let grid = response.grid.unwrap_or(0);
        time_history(&TimeHistory {
            time: self.time(grid),
            response: Quantity::new(literal(&response.name), literal(&response.unit)),
            times: &self.problem.grids[grid].points,
            histories: &pair(&self.first.0.values[h], &self.state.responses.values[h]),
            bounds: &[],
            kept: &[],
            active: &[],
        })
        .map(|figure| figure.sized(100.0, 70.0))
    }

    fn time(&self, grid: usize) -> Quantity {
        let grid = &self.problem.grids[grid];
        Quantity::new(literal(&grid.name), literal(&grid.unit))
    }
}

fn pair<'v>(first: &'v [f64], last: &'v [f64]) -> [History<'v>; 2] {
    [History { name: "first design", values: first }, History { name: "last design", values: last }]
}
