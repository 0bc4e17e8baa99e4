//! Responses and constraints over time.

use super::chosen_cycle::CycleCurves;
use super::constrained_histories::ConstrainedHistory;
use super::{OptimizationReport, stem};
use crate::Result;
use crate::report::figure::{Figure, QuantityLabel};
use crate::report::outcome;
use crate::report::page::PageSection;
use crate::report::plots::{ResponseHistory, TimeHistory, time_history};

/// Largest numbers of plots: of constrained histories, and of other responses.
const MOST: usize = 12;
const OTHERS: usize = 6;

impl OptimizationReport<'_> {
    /// The section; the curves of cycles are added to `curves`.
    pub(super) fn histories(&self, curves: &mut Vec<CycleCurves>) -> Result<PageSection> {
        let constrained = self.constrained_histories();
        let mut order: Vec<usize> = (0..constrained.len()).filter(|&k| constrained[k].points.len() > 1).collect();
        order.sort_by(|a, b| constrained[*b].largest.total_cmp(&constrained[*a].largest).then(a.cmp(b)));
        let hidden = order.len().saturating_sub(MOST);
        order.truncate(MOST);
        order.sort_unstable();
        let shown: Vec<usize> = constrained.iter().filter_map(|w| w.response).collect();
        let is_other = |h: &usize| {
            let grid = self.problem.responses[*h].grid;
            grid.is_some_and(|g| self.problem.grids[g].len() > 1) && !shown.contains(h)
        };
        let uses = |j: usize, h: &usize| self.problem.constraints[j].quantity.responses().contains(h);
        let enters = |h: &usize| outcome::stated_constraints(self.problem).any(|j| uses(j, h));
        let enters_peak = |h: &usize| outcome::peak_constraints(self.problem).any(|j| uses(j, h));
        let mut others: Vec<usize> = (0..self.problem.responses.len()).filter(is_other).collect();
        // Responses that enter no constraint come first: no other plot shows them.
        others.sort_by_key(enters);
        let over = self.problem.grids.first().map_or("time", |grid| grid.name.as_str());
        let mut section = PageSection::new("histories", format!("Histories over {over}"));
        if order.is_empty() && others.is_empty() {
            return Ok(section);
        }
        section = section.paragraph(
            "Dashed: first design. Black: last design. Bounds are hatched on their infeasible side. Rings mark the points that \
             the approximate problem of the last cycle retained, discs those with an active constraint at its solution.",
        );
        for k in order {
            let caption = format!("{}{}.", constrained[k].name, constrained[k].remark);
            let name = format!("history-{}-{}", k + 1, stem(&constrained[k].name));
            let times = self.problem.grids[constrained[k].grid].shown_points()[constrained[k].points.clone()].to_vec();
            curves.push(CycleCurves { figure: name.clone(), times, values: constrained[k].cycles.clone() });
            section = section.figure(name, caption, self.constrained_plot(&constrained[k])?);
        }
        let more = others.len().saturating_sub(OTHERS);
        for h in others.into_iter().take(OTHERS) {
            let name = &self.problem.responses[h].name;
            let is_in_objective = self.problem.objective.quantity.responses().contains(&h) || enters_peak(&h);
            let role = match (enters(&h), is_in_objective) {
                (true, _) => "which enters constraints",
                (false, true) => "which enters the objective",
                (false, false) => "not constrained",
            };
            let figure = format!("response-{}-{}", h + 1, stem(name));
            let times = self.problem.grids[self.problem.responses[h].grid.unwrap_or(0)].shown_points();
            let values = self.cycles.iter().map(|shown| shown.responses.values[h].clone()).collect();
            curves.push(CycleCurves { figure: figure.clone(), times, values });
            section = section.figure(figure, format!("{name}, {role}."), self.response_plot(h)?);
        }
        if hidden + more > 0 {
            let text = format!("{} more histories are in constraints.csv and responses.csv.", hidden + more);
            section = section.paragraph(text);
        }
        Ok(section)
    }

    fn constrained_plot(&self, w: &ConstrainedHistory) -> Result<Figure> {
        time_history(&TimeHistory {
            time: self.time(w.grid),
            response: QuantityLabel::literal(&w.name, &w.unit),
            times: &self.problem.grids[w.grid].shown_points()[w.points.clone()],
            histories: &pair(&w.first, &w.last),
            bounds: &w.bounds,
            kept: &w.retained,
            active: &w.active,
        })
        .map(|figure| figure.sized(100.0, 70.0))
    }

    fn response_plot(&self, h: usize) -> Result<Figure> {
        let response = &self.problem.responses[h];
        let grid = response.grid.unwrap_or(0);
        time_history(&TimeHistory {
            time: self.time(grid),
            response: QuantityLabel::literal(&response.name, &response.unit),
            times: &self.problem.grids[grid].shown_points(),
            histories: &pair(&self.first.0.values[h], &self.state.responses.values[h]),
            bounds: &[],
            kept: &[],
            active: &[],
        })
        .map(|figure| figure.sized(100.0, 70.0))
    }

    fn time(&self, grid: usize) -> QuantityLabel {
        let grid = &self.problem.grids[grid];
        QuantityLabel::literal(&grid.name, &grid.unit)
    }
}

fn pair<'v>(first: &'v [f64], last: &'v [f64]) -> [ResponseHistory<'v>; 2] {
    [ResponseHistory { name: "first design", values: first }, ResponseHistory { name: "last design", values: last }]
}
