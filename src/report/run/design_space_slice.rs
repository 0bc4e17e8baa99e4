//! Slice of the design space through the last design, along two variables or the only free one, with the path of the designs.

use super::OptimizationReport;
use crate::Result;
use crate::problem::{Evaluation, PeakBound, Problem};
use crate::report::figure::{
    self, Colour, Figure, Grid, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, literal,
};
use crate::report::outcome;
use crate::report::page::PageSection;
use crate::report::plots::{Bound, DesignSpaceSlice, Iterate, ObjectiveContours, bound_marks, design_space_slice};
use crate::sao::{Cycle, RunState};
use rayon::prelude::*;

/// Largest number of constraints with separate contours.
const MOST: usize = 3;

/// Objective and constraints on a grid of two design variables, or along one, from analyses. The other variables keep their values
/// at the last design.
pub struct Slice(SliceKind);

enum SliceKind {
    Plane(PlaneSlice),
    Line(LineSlice),
}

struct PlaneSlice {
    variables: [usize; 2],
    count: usize,
    failed: usize,
    objective: Grid,
    /// `true` if the objective bounds a peak; the peak is shown instead.
    is_peak: bool,
    /// Constraints that are violated in a part of the window.
    bounds: Vec<Limit>,
}

/// A constraint over the window.
struct Limit {
    /// Its name as markup.
    name: String,
    /// The violation as a fraction, negative where it is satisfied; of an equality the relative distance of the value from its limit, with sign.
    excess: Grid,
    is_equality: bool,
}

/// Design variables in decreasing order of their change relative to their scales.
pub(super) fn by_change(problem: &Problem, state: &RunState) -> Vec<usize> {
    let scales = problem.scales();
    let change = |k: &usize| {
        let [low, high] = range(state, *k);
        (high - low) / scales[*k]
    };
    let mut order: Vec<usize> = (0..problem.n()).collect();
    order.sort_by(|a, b| change(b).total_cmp(&change(a)).then(a.cmp(b)));
    order
}

fn range(state: &RunState, k: usize) -> [f64; 2] {
    let all = state.history.iter().map(|c| c.design[k]);
    figure::range(all)
}

impl Slice {
    /// Analyses `count` × `count` designs on a grid of the two variables that changed most, or as many along the only free one.
    /// The variable that bounds a peak does not count. Returns `None` if `count` is less than 2 or no variable is free. Designs
    /// whose analysis fails are omitted.
    ///
    /// # Errors
    /// [`Error::Definition`](crate::Error::Definition) if all analyses fail.
    pub fn sample(problem: &Problem, state: &RunState, count: usize) -> Result<Option<Self>> {
        Self::sample_until(problem, state, count, &|| false)
    }

    /// As [`sample`](Self::sample); once `is_stopped` returns true, the other designs are omitted without an analysis.
    ///
    /// # Errors
    /// As [`sample`](Self::sample).
    pub fn sample_until(
        problem: &Problem,
        state: &RunState,
        count: usize,
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self>> {
        let bound = problem.objective.peak().map(|peak| peak.variable);
        let is_free = |k: &usize| problem.variables[*k].lower < problem.variables[*k].upper;
        let mut order = by_change(problem, state).into_iter().filter(is_free).filter(|k| bound != Some(*k));
        match (order.next(), order.next()) {
            _ if count < 2 => Ok(None),
            (Some(i), Some(j)) => {
                Ok(Some(Self(SliceKind::Plane(PlaneSlice::sample(problem, state, [i, j], count, is_stopped)?))))
            }
            (Some(k), None) => {
                Ok(Some(Self(SliceKind::Line(LineSlice::sample(problem, state, k, count * count, is_stopped)))))
            }
            (None, _) => Ok(None),
        }
    }
}

impl PlaneSlice {
    fn sample(
        problem: &Problem,
        state: &RunState,
        [i, j]: [usize; 2],
        count: usize,
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self> {
        let peak = problem.objective.peak();
        let [x, y] = [i, j].map(|k| figure::spaced(window(problem, state, k), count));
        let points: Vec<[f64; 2]> = y.iter().flat_map(|y| x.iter().map(|x| [*x, *y])).collect();
        let one = |at: &[f64; 2]| if is_stopped() { None } else { evaluate(problem, state, &[i, j], at) };
        let evaluated: Vec<Option<Evaluation>> = points.par_iter().map(one).collect();
        let failed = evaluated.iter().filter(|e| e.is_none()).count();
        let grid = |of: &dyn Fn(&Evaluation) -> f64| {
            let values: Vec<f64> = evaluated.iter().map(|e| e.as_ref().map_or(f64::NAN, of)).collect();
            Grid::with_holes(&x, &y, &values)
        };
        let objective = match peak {
            Some(peak) => grid(&|e| least_peak(problem, e, &state.design, peak))?,
            None => grid(&|e| outcome::stated(problem, e.objective))?,
        };
        let mut crossing: Vec<(usize, Grid)> = vec![];
        for c in outcome::stated_constraints(problem) {
            let is_equality = problem.constraints[c].is_equality();
            let excess = match is_equality {
                true => grid(&|e| e.worst_of(c).map_or(f64::NAN, |(_, residual)| residual))?,
                false => grid(&|e| e.violations()[c])?,
            };
            let [low, high] = excess.range();
            if low < 0.0 && high > 0.0 {
                crossing.push((c, excess));
            }
        }
        let bounds = named(problem, state, crossing)?;
        Ok(Self { variables: [i, j], count, failed, objective, is_peak: peak.is_some(), bounds })
    }
}

/// Objective and largest violation along a variable.
struct LineSlice {
    variable: usize,
    /// Variable, objective (or peak), and largest violation in percent, for each successful analysis.
    points: Vec<[f64; 3]>,
}

impl LineSlice {
    /// Analyses `count` designs along the variable.
    fn sample(
        problem: &Problem,
        state: &RunState,
        variable: usize,
        count: usize,
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Self {
        let peak = problem.objective.peak();
        let values = figure::spaced(window(problem, state, variable), count);
        let one = |x: &f64| {
            let evaluation = if is_stopped() { None } else { evaluate(problem, state, &[variable], &[*x]) }?;
            let (value, violation) = match peak {
                Some(peak) => (
                    least_peak(problem, &evaluation, &state.design, peak),
                    violation_without_peak(problem, &evaluation),
                ),
                None => (outcome::stated(problem, evaluation.objective), evaluation.max_violation_pct()),
            };
            Some([*x, value, violation])
        };
        Self { variable, points: values.par_iter().filter_map(one).collect() }
    }
}

/// The largest violation in percent, without the constraints that bound a peak.
fn violation_without_peak(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let violations = evaluation.violations();
    outcome::stated_constraints(problem).map(|j| 100.0 * violations[j]).fold(-100.0, f64::max)
}

/// Range of a variable over the path with a margin, within its bounds.
fn window(problem: &Problem, state: &RunState, k: usize) -> [f64; 2] {
    let ([low, high], variable) = (range(state, k), &problem.variables[k]);
    let margin = (0.25 * (high - low)).max(0.02 * problem.scales()[k]);
    let [from, to] = [(low - margin).max(variable.lower), (high + margin).min(variable.upper)];
    if from < to { [from, to] } else { [low - margin, high + margin] }
}

/// Evaluation at the last design with other values of some variables; `None` if the analysis fails.
fn evaluate(problem: &Problem, state: &RunState, variables: &[usize], values: &[f64]) -> Option<Evaluation> {
    let mut design = state.design.clone();
    variables.iter().zip(values).for_each(|(k, value)| design[*k] = *value);
    Some(problem.analyze_values(&design).ok()?.evaluation)
}

/// The peak: the smallest β for which its two constraints are satisfied, β + s·max c.
fn least_peak(problem: &Problem, evaluation: &Evaluation, design: &[f64], peak: PeakBound) -> f64 {
    let values = outcome::peak_constraints(problem).map(|j| &evaluation.residuals[j]);
    let largest = values.flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    design[peak.variable] + problem.constraints[peak.constraints[0]].scale * largest
}

/// The [`MOST`] inequalities nearest to their limits at the last design, all equalities, and the largest violation of the other
/// inequalities.
fn named(problem: &Problem, state: &RunState, crossing: Vec<(usize, Grid)>) -> Result<Vec<Limit>> {
    let limit = |(c, excess): (usize, Grid)| {
        let is_equality = problem.constraints[c].is_equality();
        Limit { name: literal(&problem.constraints[c].name), excess, is_equality }
    };
    let nearest = state.evaluation.violations();
    let (equalities, mut crossing): (Vec<_>, Vec<_>) =
        crossing.into_iter().partition(|(c, _)| problem.constraints[*c].is_equality());
    crossing.sort_by(|a, b| nearest[b.0].total_cmp(&nearest[a.0]).then(a.0.cmp(&b.0)));
    let rest = crossing.split_off(crossing.len().min(MOST));
    let mut bounds: Vec<Limit> = crossing.into_iter().chain(equalities).map(limit).collect();
    if let Some((_, first)) = rest.first() {
        let largest = |i: usize, j: usize| rest.iter().map(|(_, g)| g.value(i, j)).fold(f64::NAN, f64::max);
        let points = (0..first.y().len()).flat_map(|j| (0..first.x().len()).map(move |i| (i, j)));
        let values: Vec<f64> = points.map(|(i, j)| largest(i, j)).collect();
        let excess = Grid::with_holes(first.x(), first.y(), &values)?;
        bounds.push(Limit { name: format!("{} other constraints", rest.len()), excess, is_equality: false });
    }
    Ok(bounds)
}

impl OptimizationReport<'_> {
    pub(super) fn design_space(&self, slice: Option<&Slice>) -> Result<PageSection> {
        let section = PageSection::new("design-space", "Design space");
        let slice = match slice.map(|slice| &slice.0) {
            None => return Ok(section),
            Some(SliceKind::Line(line)) => return Ok(self.line_section(section, line)),
            Some(SliceKind::Plane(plane)) => plane,
        };
        let [i, j] = slice.variables.map(|k| &self.problem.variables[k]);
        let what = if slice.is_peak { "the peak that the objective bounds" } else { "the objective" };
        let failed = match slice.failed {
            0 => String::new(),
            failed => format!(" {failed} of the analyses failed; their designs are omitted."),
        };
        let [low, high] = slice.objective.range();
        let curves = if low < high {
            format!("Contours of {what} and the limits of the constraints come")
        } else {
            format!("There, {what} is constant; the limits of the constraints come")
        };
        let text = format!(
            "Slice through the last design along the two design variables that changed most, {} and {}; all other variables have \
             their last values. {curves} from analyses of {n} × {n} designs, not from an approximation.{failed} Earlier designs differ in the other variables, too; they are projected onto the slice.",
            i.name,
            j.name,
            n = slice.count
        );
        let has_equality = slice.bounds.iter().any(|bound| bound.is_equality);
        let lines = if has_equality { " Lines without hatching are equality constraints." } else { "" };
        let caption = format!("Numbers are cycles; limits are hatched on their infeasible side.{lines}");
        Ok(section.paragraph(text).figure("design-plane", caption, self.plane_figure(slice)?))
    }

    fn plane_figure(&self, slice: &PlaneSlice) -> Result<Figure> {
        let [i, j] = slice.variables;
        let quantity = |k: usize| {
            let variable = &self.problem.variables[k];
            QuantityLabel::literal(&variable.name, &variable.unit)
        };
        let path: Vec<Iterate> = self
            .shown_steps()
            .map(|(c, _)| Iterate {
                cycle: c.cycle,
                design: [c.design[i], c.design[j]],
                accepted: c.accepted,
                move_limits: None,
            })
            .collect();
        let bounds: Vec<Bound> = slice
            .bounds
            .iter()
            .map(|Limit { name, excess, is_equality }| Bound { name, excess, is_equality: *is_equality })
            .collect();
        let name = literal(&self.problem.objective.name);
        let plane = DesignSpaceSlice {
            variables: [quantity(i), quantity(j)],
            objective: ObjectiveContours { name: &name, grid: &slice.objective, levels: &[] },
            bounds: &bounds,
            path: &path,
            optimum: None,
        };
        Ok(design_space_slice(&plane)?.sized(110.0, 105.0))
    }

    fn line_section(&self, section: PageSection, line: &LineSlice) -> PageSection {
        if line.points.len() < 2 {
            return section;
        }
        let variable = &self.problem.variables[line.variable];
        let text = format!(
            "Objective and largest violation along {}, the only free design variable, from analyses of {} designs, not from an \
             approximation.",
            variable.name,
            line.points.len()
        );
        section.paragraph(text).figure("design-line", "Dots are the designs of the cycles.", self.line_figure(line))
    }

    fn line_figure(&self, line: &LineSlice) -> Figure {
        let (problem, k) = (self.problem, line.variable);
        let x = PlotAxis::of(&QuantityLabel::literal(&problem.variables[k].name, &problem.variables[k].unit));
        let ends = [line.points[0][0], line.points[line.points.len() - 1][0]];
        let x = x.limits(ends[0], ends[1]);
        let curve = |i: usize| {
            Mark::curve(line.points.iter().map(|p| [p[0], p[i]]).collect::<Vec<_>>(), Stroke::solid(Colour::BLACK, 1.0))
        };
        let designs = |value: fn(&Cycle, f64) -> f64| {
            let accepted = self.successful_steps().filter(|(c, _)| c.accepted);
            let at: Vec<[f64; 2]> = accepted.map(|(c, objective)| [c.design[k], value(c, objective)]).collect();
            Mark::points(at, MarkerShape::Disc, Colour::BLUE, 3.6)
        };
        let objective = PlotAxis::of(&QuantityLabel::literal(&problem.objective.name, &problem.objective.unit));
        let mut top = Panel::new(x.clone().unlabelled(), objective).legend(Legend::Absent);
        top.add(curve(1)).add(designs(|_, objective| objective));
        let mut bottom = Panel::new(x, PlotAxis::new("largest violation", "%")).legend(Legend::Absent);
        bottom.add(curve(2)).add(designs(|c, _| c.violation_pct));
        bottom.extend(bound_marks(ends.map(|end| [end, 0.0])));
        Figure::new("Objective and largest violation along the design variable", 100.0, 100.0).with(top).with(bottom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::impact_absorber;
    use crate::sao::Method;

    /// Away from the last design the objective of a peak problem is the peak itself.
    #[test]
    fn the_least_bound_is_the_peak() {
        let problem = impact_absorber::peak_acceleration().unwrap();
        let state = Method::slp().solve(&problem, |_| ()).unwrap();
        let peak = problem.objective.peak().unwrap();
        let acceleration = problem.responses.iter().position(|r| r.name == "acceleration").unwrap();
        for at in [[0.9, 0.2], [0.4, 0.5], [state.design[0], state.design[1]]] {
            let evaluation = evaluate(&problem, &state, &[0, 1], &at).unwrap();
            let found = least_peak(&problem, &evaluation, &state.design, peak);
            let responses = problem.analyze(&[at[0], at[1], 0.0]).unwrap();
            let expected = responses.values[acceleration].iter().fold(0.0f64, |a, v| a.max(v.abs()));
            assert!((found - expected).abs() < 1e-9, "{found} and {expected}");
        }
        let Some(Slice(SliceKind::Plane(plane))) = Slice::sample(&problem, &state, 5).unwrap() else {
            panic!("two variables")
        };
        assert_eq!((plane.variables.len(), plane.failed, plane.bounds.len()), (2, 0, 1));
        assert!(Slice::sample(&problem, &state, 1).unwrap().is_none());
    }
}
