//! Objective, errors, violation, design variables and move limits over the cycles.

use super::{MOST, OptimizationReport, stem};
use crate::Result;
use crate::problem::Problem;
use crate::report::figure::{
    Colour, Dash, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, literal, range,
};
use crate::report::outcome;
use crate::report::page::PageSection;
use crate::report::plots::{self, Convergence, ConvergenceMeasure};
use crate::report::table::{Cell, Table};
use crate::sao::Cycle;

/// Cells of a trial step: objective; errors E_f and E_g, violation and step in percent; numbers of variables at a move limit, of
/// retained constraints and of active constraints (each at one time point). Cells that a failed analysis cannot fill are empty.
pub fn step_cells(problem: &Problem, c: &Cycle, objective: f64) -> [Cell; 8] {
    let analysed = |value: Option<f64>| value.filter(|_| c.failure.is_none()).map_or(Cell::Empty, Cell::from);
    [
        analysed(Some(objective)),
        analysed(Some(c.objective_error_pct)),
        analysed(Some(c.constraint_error_pct)),
        analysed(outcome::violation(problem, c)),
        c.max_variable_change_pct.into(),
        c.active_limits.into(),
        c.retained.len().into(),
        c.active.len().into(),
    ]
}

impl OptimizationReport<'_> {
    pub(super) fn convergence(&self) -> Result<PageSection> {
        let history = &self.state.history;
        let section = PageSection::new("convergence", "Convergence");
        if history.len() < 2 {
            let text = "No cycle has been completed; only the first design has been analysed.";
            return Ok(section.paragraph(text));
        }
        let section = match self.every() {
            1 => section,
            every => section.paragraph(format!(
                "The run has {} trial steps. The figures and tables of this page show each {every}-th of them and the last; all are in cycles.csv.",
                history.len()
            )),
        };
        let section = match self.problem.objective.peak() {
            None => section,
            Some(_) => section.paragraph(
                "The objective is a peak: a variable bounds it, which is minimized in its place. The errors of the peak count in E_g; E_f is zero \
                 unless the approximate objective contains the curvature of the constraints.",
            ),
        };
        let mut section = section
            .paragraph(
                "A cycle solves an approximate problem inside move limits and analyses its solution. E_f and E_g are the errors \
                 of the approximate objective and constraints at the solution, V is the largest violation, step the largest change \
                 of a design variable. A cross is a rejected step; the cycle is then repeated with smaller move limits or a more \
                 conservative approximation.",
            )
            .figure("convergence", "Objective, approximation errors, violation and step over the cycles.", self.measures()?)
            .figure("move-limits", "Move-limit factors: half widths of the subregion, relative to the design or, with fixed limits, to the scale of the variable.", self.factors());
        let order = super::design_space_slice::by_change(self.problem, self.state);
        for &k in order.iter().take(MOST) {
            let name = &self.problem.variables[k].name;
            let caption = format!("{name}: designs, and the subregion of each cycle as a grey bar.");
            section = section.figure(format!("variable-{}-{}", k + 1, stem(name)), caption, self.variable(k));
        }
        if order.len() > MOST {
            let text = format!("The {MOST} design variables that change most are shown; all are in cycles.csv.");
            section = section.paragraph(text);
        }
        Ok(section.table(self.cycles()?))
    }

    fn measures(&self) -> Result<Figure> {
        let (history, objectives): (Vec<&Cycle>, Vec<f64>) = self.successful_steps().unzip();
        let of = |value: fn(&Cycle) -> f64| -> Vec<f64> { history.iter().map(|c| value(c)).collect() };
        let (e_f, e_g) = (of(|c| c.objective_error_pct), of(|c| c.constraint_error_pct));
        let (violation, step) = (of(|c| c.violation_pct.max(0.0)), of(|c| c.max_variable_change_pct));
        let figure = plots::convergence(&Convergence {
            cycles: &history.iter().map(|c| c.cycle).collect::<Vec<_>>(),
            accepted: &history.iter().map(|c| c.accepted).collect::<Vec<_>>(),
            objective: QuantityLabel::literal(&self.problem.objective.name, &self.problem.objective.unit),
            objective_values: &objectives,
            objective_logarithmic: self.spans_decades(),
            measures: &[
                ConvergenceMeasure { name: "*E*_f", values: &e_f },
                ConvergenceMeasure { name: "*E*_g", values: &e_g },
                ConvergenceMeasure { name: "*V*", values: &violation },
                ConvergenceMeasure { name: "step", values: &step },
            ],
            measure: QuantityLabel::new("errors, violation, step", "%"),
        })?;
        Ok(figure.sized(100.0, 105.0))
    }

    /// Returns `true` if the objective is positive and varies by more than a factor of 30.
    pub(super) fn spans_decades(&self) -> bool {
        let predicted = self.state.history.iter().filter_map(|c| outcome::predicted_objective(self.problem, c));
        let values = self.objectives.iter().copied().chain(predicted);
        let [low, high] = values.fold([f64::INFINITY, 0.0f64], |[l, h], v| [l.min(v), h.max(v)]);
        low > 0.0 && high > 30.0 * low
    }

    fn factors(&self) -> Figure {
        let steps = || self.shown_steps().map(|(c, _)| c).filter(|c| c.region.is_some());
        let mut panel =
            Panel::new(self.cycle_axis(), PlotAxis::new("move-limit factor", "").logarithmic()).legend(Legend::Below);
        for (k, variable) in self.problem.variables.iter().enumerate().take(MOST) {
            let at: Vec<[f64; 2]> = steps().map(|c| [c.cycle as f64, c.factors[k]]).collect();
            let dash = [Dash::Solid, Dash::Dashed][k / 7 % 2];
            let stroke = Stroke::solid(Colour::of_series(k), 0.9).dash(dash);
            panel.add(Mark::curve(at.clone(), stroke).named(literal(&variable.name)));
            panel.add(Mark::points(at, MarkerShape::Disc, Colour::of_series(k), 2.6));
        }
        Figure::new("Move-limit factors over the cycles", 100.0, 80.0).with(panel)
    }

    fn variable(&self, k: usize) -> Figure {
        let history: Vec<&Cycle> = self.shown_steps().map(|(c, _)| c).collect();
        let variable = &self.problem.variables[k];
        let regions = history.iter().filter_map(|c| {
            let region = c.region.as_ref()?;
            let x = c.cycle as f64;
            Some((c.cycle, [[x, region.lower[k]], [x, region.upper[k]]]))
        });
        let regions: Vec<(usize, [[f64; 2]; 2])> = regions.collect();
        let shown = regions.iter().flat_map(|(_, ends)| ends).map(|p| p[1]).chain(history.iter().map(|c| c.design[k]));
        let [low, high] = range(shown);
        let mut panel =
            Panel::new(self.cycle_axis(), PlotAxis::of(&QuantityLabel::literal(&variable.name, &variable.unit)));
        panel = panel.legend(Legend::Absent);
        for (cycle, region) in regions {
            let line = Mark::curve(region, Stroke::solid(Colour::LIGHT_GREY, 3.0));
            panel.add(line.described(format!("subregion of cycle {cycle}")));
        }
        let last = history.last().map_or(1.0, |c| c.cycle as f64);
        for (bound, ends) in [(variable.upper, [-0.3, last + 0.3]), (variable.lower, [last + 0.3, -0.3])] {
            // A distant bound would compress the curves.
            if bound.is_finite() && bound >= low - 0.3 * (high - low) && bound <= high + 0.3 * (high - low) {
                panel.extend(plots::bound_marks(ends.map(|end| [end, bound])));
            }
        }
        let of = |accepted: bool| -> Vec<[f64; 2]> {
            history.iter().filter(|c| c.accepted == accepted).map(|c| [c.cycle as f64, c.design[k]]).collect()
        };
        panel.add(Mark::curve(of(true), Stroke::solid(Colour::BLUE, 1.0)).described(&variable.name));
        panel.add(Mark::points(of(true), MarkerShape::Disc, Colour::BLUE, 3.4));
        let rejected = Mark::points(of(false), MarkerShape::Cross, Colour::VERMILLION, 4.6);
        panel.add(rejected.described("rejected step"));
        Figure::new(format!("{} over the cycles", literal(&variable.name)), 100.0, 54.0).with(panel)
    }

    pub(super) fn cycle_axis(&self) -> PlotAxis {
        let last = self.state.history.last().map_or(1, |c| c.cycle).max(1) as f64;
        PlotAxis::new("cycle", "").limits(-0.3, last + 0.3).whole()
    }

    fn cycles(&self) -> Result<Table> {
        let fixed = [
            "cycle",
            "outcome",
            "objective",
            "E_f in %",
            "E_g in %",
            "V in %",
            "step in %",
            "at move limits",
            "retained",
            "active",
        ];
        let names = self.problem.variables.iter().map(|v| v.name.as_str());
        let mut table = Table::new("Cycles", fixed.into_iter().chain(names));
        for (c, objective) in self.shown_steps() {
            let names = [c.cycle.into(), super::verdict(c).into()];
            table.push(
                names
                    .into_iter()
                    .chain(step_cells(self.problem, c, objective))
                    .chain(c.design.iter().map(|b| Cell::from(*b))),
            )?;
        }
        Ok(table)
    }
}
