//! Objective and violation along the only design variable that is free.

use super::OptimizationReport;
use super::plane::{axis, evaluate, least_peak, window};
use crate::problem::{Evaluation, PeakBound, Problem};
use crate::report::figure::{Axis, Colour, Figure, Legend, Mark, Marker, Panel, Stroke, literal};
use crate::report::page::Section;
use crate::sao::State;
use rayon::prelude::*;

/// Objective and largest violation along a variable.
pub(super) struct Line {
    variable: usize,
    /// Variable, objective, and violation in percent at each design that could be analysed.
    points: Vec<[f64; 3]>,
}

impl Line {
    /// Analyses `count` designs along the variable.
    pub fn sample(problem: &Problem, state: &State, variable: usize, count: usize) -> Self {
        let peak = problem.objective.peak();
        let places = axis(window(problem, state, variable), count);
        let one = |x: &f64| {
            let evaluation = evaluate(problem, state, &[variable], &[*x])?;
            let (value, violation) = match peak {
                Some(peak) => (least_peak(problem, &evaluation, &state.design, peak), without(&evaluation, peak)),
                None => (evaluation.objective, evaluation.max_violation_pct()),
            };
            Some([*x, value, violation])
        };
        Self { variable, points: places.par_iter().filter_map(one).collect() }
    }
}

/// The largest violation in percent of all constraints but the two that bound a peak.
fn without(evaluation: &Evaluation, peak: PeakBound) -> f64 {
    let kept = evaluation.violations().into_iter().enumerate().filter(|(j, _)| !peak.constraints.contains(j));
    kept.map(|(_, v)| 100.0 * v).fold(-100.0, f64::max)
}

impl OptimizationReport<'_> {
    pub(super) fn line(&self, section: Section, line: &Line) -> Section {
        if line.points.len() < 2 {
            return section;
        }
        let variable = &self.problem.variables[line.variable];
        let text = format!(
            "Objective and largest violation along {}, the only free design variable, by analyses of {} designs, not from an \
             approximation.",
            variable.name,
            line.points.len()
        );
        section.paragraph(text).figure("design-line", "Dots are the designs of the cycles.", self.line_figure(line))
    }

    fn line_figure(&self, line: &Line) -> Figure {
        let (problem, k) = (self.problem, line.variable);
        let x = Axis::new(literal(&problem.variables[k].name), literal(&problem.variables[k].unit));
        let ends = [line.points[0][0], line.points[line.points.len() - 1][0]];
        let x = x.limits(ends[0], ends[1]);
        let curve = |i: usize| {
            Mark::curve(line.points.iter().map(|p| [p[0], p[i]]).collect::<Vec<_>>(), Stroke::solid(Colour::BLACK, 1.0))
        };
        let designs = |value: fn(&crate::sao::Cycle) -> f64| {
            let at: Vec<[f64; 2]> = self.tries().filter(|c| c.accepted).map(|c| [c.design[k], value(c)]).collect();
            Mark::points(at, Marker::Disc, Colour::BLUE, 3.6)
        };
        let objective = Axis::new(literal(&problem.objective.name), literal(&problem.objective.unit));
        let mut top = Panel::new(x.clone().unlabelled(), objective).legend(Legend::Absent);
        top.add(curve(1)).add(designs(|c| c.objective));
        let mut bottom = Panel::new(x, Axis::new("largest violation", "%")).legend(Legend::Absent);
        let zero = vec![[ends[0], 0.0], [ends[1], 0.0]];
        bottom.add(curve(2)).add(designs(|c| c.violation_pct));
        bottom.add(Mark::hatching(vec![zero.clone()], Stroke::solid(Colour::BLACK, 0.4), 3.6));
        bottom.add(Mark::curve(zero, Stroke::solid(Colour::BLACK, 0.8)));
        Figure::new("Objective and largest violation along the design variable", 100.0, 100.0).with(top).with(bottom)
    }
}
