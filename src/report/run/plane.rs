//! A slice of the design space through the last design, with the path of the designs.

use super::OptimizationReport;
use super::line::Line;
use crate::Result;
use crate::problem::{Evaluation, PeakBound, Problem};
use crate::report::figure::{Grid, Quantity, literal};
use crate::report::page::Section;
use crate::report::plots::{Bound, DesignPlane, Iterate, Objective, design_plane};
use crate::sao::State;
use rayon::prelude::*;

/// Most constraints with a line of their own.
const MOST: usize = 3;

/// Objective and constraints over two design variables, or along one, by analyses; the others are as in the last design.
pub struct Slice(Kind);

enum Kind {
    Plane(Plane),
    Line(Line),
}

struct Plane {
    variables: [usize; 2],
    count: usize,
    failed: usize,
    objective: Grid,
    /// Whether the objective bounds a peak, which is shown in its place.
    is_peak: bool,
    /// Names and violations of constraints that change sign in the window.
    bounds: Vec<(String, Grid)>,
}

/// Design variables, those that change most relative to their scales first.
pub(super) fn changes(problem: &Problem, state: &State) -> Vec<usize> {
    let scales = problem.scales();
    let moved = |k: &usize| {
        let [low, high] = range(state, *k);
        (high - low) / scales[*k]
    };
    let mut order: Vec<usize> = (0..problem.n()).collect();
    order.sort_by(|a, b| moved(b).total_cmp(&moved(a)).then(a.cmp(b)));
    order
}

fn range(state: &State, k: usize) -> [f64; 2] {
    let all = state.history.iter().map(|c| c.design[k]);
    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
}

impl Slice {
    /// Analyses `count` × `count` designs in the plane of the two variables that change most, or as many along the only one;
    /// none where `count` is less than 2. Designs that cannot be analysed are left out.
    ///
    /// **Errors.** Not one of the designs can be analysed.
    pub fn sample(problem: &Problem, state: &State, count: usize) -> Result<Option<Self>> {
        let bound = problem.objective.peak().map(|peak| peak.variable);
        let is_free = |k: &usize| problem.variables[*k].lower < problem.variables[*k].upper;
        let mut order = changes(problem, state).into_iter().filter(is_free).filter(|k| bound != Some(*k));
        match (order.next(), order.next()) {
            _ if count < 2 => Ok(None),
            (Some(i), Some(j)) => Ok(Some(Self(Kind::Plane(Plane::sample(problem, state, [i, j], count)?)))),
            (Some(k), None) => Ok(Some(Self(Kind::Line(Line::sample(problem, state, k, count * count))))),
            (None, _) => Ok(None),
        }
    }
}

impl Plane {
    fn sample(problem: &Problem, state: &State, [i, j]: [usize; 2], count: usize) -> Result<Self> {
        let peak = problem.objective.peak();
        let [x, y] = [i, j].map(|k| axis(window(problem, state, k), count));
        let places: Vec<[f64; 2]> = y.iter().flat_map(|y| x.iter().map(|x| [*x, *y])).collect();
        let evaluated: Vec<Option<Evaluation>> =
            places.par_iter().map(|at| evaluate(problem, state, &[i, j], at)).collect();
        let failed = evaluated.iter().filter(|e| e.is_none()).count();
        let grid = |of: &dyn Fn(&Evaluation) -> f64| {
            let values: Vec<f64> = evaluated.iter().map(|e| e.as_ref().map_or(f64::NAN, of)).collect();
            Grid::with_holes(&x, &y, &values)
        };
        let objective = match peak {
            Some(peak) => grid(&|e| least_peak(problem, e, &state.design, peak))?,
            None => grid(&|e| e.objective)?,
        };
        let mut kept: Vec<(usize, Grid)> = vec![];
        for c in (0..problem.constraints.len()).filter(|c| peak.is_none_or(|peak| !peak.constraints.contains(c))) {
            let excess = grid(&|e| e.violations()[c])?;
            let [low, high] = excess.range();
            if low < 0.0 && high > 0.0 {
                kept.push((c, excess));
            }
        }
        let bounds = named(problem, state, kept)?;
        Ok(Self { variables: [i, j], count, failed, objective, is_peak: peak.is_some(), bounds })
    }
}

/// Where the path of a variable was, with room around it, within its bounds.
pub(super) fn window(problem: &Problem, state: &State, k: usize) -> [f64; 2] {
    let ([low, high], variable) = (range(state, k), &problem.variables[k]);
    let margin = (0.25 * (high - low)).max(0.02 * problem.scales()[k]);
    let [from, to] = [(low - margin).max(variable.lower), (high + margin).min(variable.upper)];
    if from < to { [from, to] } else { [low - margin, high + margin] }
}

pub(super) fn axis([from, to]: [f64; 2], count: usize) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * k as f64 / (count - 1) as f64).collect()
}

/// The last design with other values of some variables; none where it cannot be analysed.
pub(super) fn evaluate(problem: &Problem, state: &State, variables: &[usize], values: &[f64]) -> Option<Evaluation> {
    let mut design = state.design.clone();
    variables.iter().zip(values).for_each(|(k, value)| design[*k] = *value);
    let responses = problem.analyze(&design).ok()?;
    problem.evaluate(&design, &responses).ok()
}

/// The least value of the bound variable that its two constraints allow: β + s·max(ĝ − 1).
pub(super) fn least_peak(problem: &Problem, evaluation: &Evaluation, design: &[f64], peak: PeakBound) -> f64 {
    let values = peak.constraints.map(|j| &evaluation.constraints[j]);
    let largest = values.into_iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    design[peak.variable] + problem.constraints[peak.constraints[0]].scale * (largest - 1.0)
}

/// The constraints nearest to their limits at the last design under their names, the others as one.
fn named(problem: &Problem, state: &State, mut kept: Vec<(usize, Grid)>) -> Result<Vec<(String, Grid)>> {
    let nearest = state.evaluation.violations();
    kept.sort_by(|a, b| nearest[b.0].total_cmp(&nearest[a.0]).then(a.0.cmp(&b.0)));
    let rest = kept.split_off(kept.len().min(MOST));
    let mut bounds: Vec<(String, Grid)> =
        kept.into_iter().map(|(c, grid)| (literal(&problem.constraints[c].name), grid)).collect();
    if let Some((_, first)) = rest.first() {
        let largest = |i: usize, j: usize| rest.iter().map(|(_, g)| g.value(i, j)).fold(f64::NAN, f64::max);
        let places = (0..first.y().len()).flat_map(|j| (0..first.x().len()).map(move |i| (i, j)));
        let values: Vec<f64> = places.map(|(i, j)| largest(i, j)).collect();
        bounds.push((format!("{} other constraints", rest.len()), Grid::with_holes(first.x(), first.y(), &values)?));
    }
    Ok(bounds)
}

impl OptimizationReport<'_> {
    pub(super) fn plane(&self, slice: Option<&Slice>) -> Result<Section> {
        let section = Section::new("design-space", "Design space");
        let slice = match slice.map(|slice| &slice.0) {
            None => return Ok(section),
            Some(Kind::Line(line)) => return Ok(self.line(section, line)),
            Some(Kind::Plane(plane)) => plane,
        };
        let [i, j] = slice.variables.map(|k| &self.problem.variables[k]);
        let what = if slice.is_peak { "the peak that it bounds" } else { "the objective" };
        let failed = match slice.failed {
            0 => String::new(),
            failed => format!(" {failed} of them could not be analysed and are left out."),
        };
        let text = format!(
            "The plane of the two design variables that changed most, {} and {}, through the last design: all other variables \
             have their last values. Contours of {what} and the limits of constraints come from analyses of {n} × {n} designs, \
             not from an approximation.{failed} Earlier designs differ in the other variables, too, and are seen from above.",
            i.name,
            j.name,
            n = slice.count
        );
        let caption = "Numbers are cycles; limits are hatched on their forbidden side.";
        Ok(section.paragraph(text).figure("design-plane", caption, self.plane_figure(slice)?))
    }

    fn plane_figure(&self, slice: &Plane) -> Result<crate::report::figure::Figure> {
        let [i, j] = slice.variables;
        let quantity = |k: usize| {
            let variable = &self.problem.variables[k];
            Quantity::new(literal(&variable.name), literal(&variable.unit))
        };
        let path: Vec<Iterate> = self
            .state
            .history
            .iter()
            .map(|c| Iterate {
                cycle: c.cycle,
                design: [c.design[i], c.design[j]],
                accepted: c.accepted,
                move_limits: None,
            })
            .collect();
        let bounds: Vec<Bound> = slice.bounds.iter().map(|(name, excess)| Bound { name, excess }).collect();
        let name = literal(&self.problem.objective.name);
        let plane = DesignPlane {
            variables: [quantity(i), quantity(j)],
            objective: Objective { name: &name, grid: &slice.objective, levels: &[] },
            bounds: &bounds,
            path: &path,
            optimum: None,
        };
        Ok(design_plane(&plane)?.sized(110.0, 105.0))
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
        let state = Method::default().solve(&problem, |_| ()).unwrap();
        let peak = problem.objective.peak().unwrap();
        let acceleration = problem.responses.iter().position(|r| r.name == "acceleration").unwrap();
        for at in [[0.9, 0.2], [0.4, 0.5], [state.design[0], state.design[1]]] {
            let evaluation = evaluate(&problem, &state, &[0, 1], &at).unwrap();
            let found = least_peak(&problem, &evaluation, &state.design, peak);
            let responses = problem.analyze(&[at[0], at[1], 0.0]).unwrap();
            let expected = responses.values[acceleration].iter().fold(0.0f64, |a, v| a.max(v.abs()));
            assert!((found - expected).abs() < 1e-9, "{found} and {expected}");
        }
        let Some(Slice(Kind::Plane(plane))) = Slice::sample(&problem, &state, 5).unwrap() else {
            panic!("two variables")
        };
        assert_eq!((plane.variables.len(), plane.failed, plane.bounds.len()), (2, 0, 1));
        assert!(Slice::sample(&problem, &state, 1).unwrap().is_none());
    }
}
