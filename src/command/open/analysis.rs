//! The record of an analysed design: outputs, objective, constraints and motion, and the derivatives of all of them.

use super::super::budget::Budget;
use super::super::model::located;
use linkwright::model_file::{DrawnOutputs, Model};
use linkwright::problem::{
    AnalyzedDesign, Problem, Quantity, ResponseAt, Responses, RowId, Sensitivities, SignedQuantity,
};
use linkwright::report::outcome;
use linkwright::report::plots::Linkage;
use linkwright::{Error, Result};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// Largest number of equally spaced time points at which histories are differentiated; their extreme values are added.
const POINTS: usize = 240;
/// Step of the differences of the motion, relative to the range of the variable. The motion is only drawn.
const STEP: f64 = 1e-6;

/// A model with the design that was analysed last.
pub struct AnalysedModel {
    model: Model,
    /// `None` if the drawings have an analysis of their own.
    drawn: Option<DrawnOutputs>,
    /// `None` for a file without an objective.
    problem: Option<Result<Problem>>,
    /// With the time of its analysis in s.
    last: Option<(AnalyzedDesign, f64)>,
    budget: Budget,
}

/// An analysed design. Designs are those of the model's variables, without the one that bounds a peak.
#[derive(Serialize)]
pub struct DesignAnalysis {
    design: Vec<f64>,
    /// Time of the analysis in s.
    seconds: f64,
    /// Values of the outputs at their time points.
    outputs: Vec<Vec<f64>>,
    /// The objective as stated; `None` without one.
    objective: Option<f64>,
    constraints: Vec<ConstraintRecord>,
    /// `None` without a mechanism.
    motion: Option<MotionFrames>,
    warnings: Vec<String>,
    derivatives: Option<Derivatives>,
}

/// A constraint: its quantity where it holds, and the smallest margin.
#[derive(Serialize)]
struct ConstraintRecord {
    /// The limit, in the unit of the constraint.
    limit: f64,
    /// The quantity at each time point; `None` where the constraint does not hold.
    values: Vec<Option<f64>>,
    margin: f64,
    status: &'static str,
    /// Time of the smallest margin.
    time: Option<f64>,
}

/// The mechanism in motion: the same parts in all frames, and their numbers frame by frame.
#[derive(Serialize)]
struct MotionFrames {
    parts: PartCounts,
    /// Coordinates in m and, for sliders, angles in rad, in the order of the parts.
    frames: Vec<Vec<f32>>,
}

/// Numbers of parts; of plates and bars the numbers of their points.
#[derive(Clone, PartialEq, Serialize)]
struct PartCounts {
    guides: usize,
    plates: Vec<usize>,
    bars: Vec<usize>,
    /// Elements of beams with a cross-section: outlines of four points.
    beams: usize,
    springs: usize,
    lines: Vec<usize>,
    masses: usize,
    sliders: usize,
    ground: usize,
    joints: usize,
}

/// Derivatives with respect to the variables of the model.
#[derive(Serialize)]
struct Derivatives {
    outputs: Vec<HistoryGradients>,
    /// `None` without an objective, and for a peak.
    objective: Option<Vec<f64>>,
    /// Rows |f| of the peak that is the objective; empty for other objectives.
    peak: Vec<HistoryGradients>,
    constraints: Vec<HistoryGradients>,
    /// Derivatives of each frame of the motion: `motion[k][frame]` with respect to variable k.
    motion: Option<Vec<Vec<Vec<f32>>>>,
}

/// Gradients of a history at some of its time points.
#[derive(Serialize)]
struct HistoryGradients {
    /// Indices of the time points.
    points: Vec<usize>,
    values: Vec<f64>,
    /// `by[k][i]`: derivative at point i with respect to variable k.
    by: Vec<Vec<f32>>,
}

impl AnalysedModel {
    /// A model without an analysis. If its problem cannot be built, each analysis returns that error.
    pub fn new(model: Model, budget: Budget) -> Self {
        // The warnings of a simulation compare all outputs, and would name those of the drawing.
        let (model, drawn) = if model.is_problem() { model.with_drawn_outputs() } else { (model, None) };
        // If the start cannot be analysed, other designs may be.
        let problem = model.is_problem().then(|| model.problem().or_else(|_| model.unscaled_problem()));
        Self { model, drawn, problem, last: None, budget }
    }

    /// Analyses a design, and differentiates it if `derivatives`. The design that was analysed last is not analysed again.
    pub fn analyse(&mut self, design: &[f64], derivatives: bool) -> anyhow::Result<DesignAnalysis> {
        let begin = Instant::now();
        self.model.variables().iter().zip(design).try_for_each(|(variable, value)| {
            let inside = (variable.lower..=variable.upper).contains(value);
            Error::check_option(&variable.name, "within its bounds", *value, inside)
        })?;
        Error::check_length("design", self.model.variables().len(), design.len())?;
        let Self { model, drawn, problem, last, budget } = self;
        let drawn = drawn.as_ref();
        let Some(problem) = problem else {
            budget.check_simulation(model)?;
            let (responses, frames) = rayon::join(|| model.simulate(design), || frames(model, design));
            return Ok(simulated(design, located(&*model, responses)?, located(&*model, frames)?, begin));
        };
        let problem = located(&*model, problem.as_ref().map_err(Clone::clone))?;
        match derivatives {
            true => budget.check_table(problem, model.method())?,
            false => budget.check_analysis(problem, model.method())?,
        }
        let full = full_design(problem, design);
        let known = last.take().filter(|(known, _)| known.design == full);
        let seconds = known.as_ref().map(|(_, seconds)| *seconds);
        let analysed = || known.map_or_else(|| problem.analyze_design(&full), |(known, _)| Ok(known));
        let found = with_frames(model, drawn, design, analysed);
        let (analysed, frames) = located(&*model, found)?;
        let mut record = DesignAnalysis {
            design: design.to_vec(),
            seconds: seconds.unwrap_or_else(|| begin.elapsed().as_secs_f64()),
            outputs: own_outputs(drawn, analysed.responses.values.clone()),
            objective: Some(outcome::objective(problem, &full, &analysed.evaluation)),
            constraints: constraints(problem, &analysed),
            motion: frames.and_then(|frames| MotionFrames::new(&frames)),
            warnings: analysed.responses.warnings.clone(),
            derivatives: None,
        };
        if derivatives {
            let found = DesignDerivatives::new(problem, &analysed, record.outputs.len()).and_then(|found| {
                let motion = record.motion.as_ref().map(|at| motion_derivatives(model, design, at));
                found.record(motion.transpose()?.flatten())
            });
            record.derivatives = Some(located(&*model, found)?);
        }
        *last = Some((analysed, record.seconds));
        Ok(record)
    }
}

fn simulated(design: &[f64], responses: Responses, frames: Option<Vec<Linkage>>, begin: Instant) -> DesignAnalysis {
    DesignAnalysis {
        design: design.to_vec(),
        seconds: begin.elapsed().as_secs_f64(),
        outputs: responses.values,
        objective: None,
        constraints: vec![],
        motion: frames.and_then(|frames| MotionFrames::new(&frames)),
        warnings: responses.warnings,
        derivatives: None,
    }
}

/// The values of the outputs of the file.
fn own_outputs(drawn: Option<&DrawnOutputs>, mut values: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    values.truncate(drawn.map_or(values.len(), |drawn| drawn.first));
    values
}

/// An analysed design with the frames of the motion: from its responses, or by an analysis of their own at the same time.
fn with_frames(
    model: &Model,
    drawn: Option<&DrawnOutputs>,
    design: &[f64],
    analyse: impl FnOnce() -> Result<AnalyzedDesign> + Send,
) -> Result<(AnalyzedDesign, Option<Vec<Linkage>>)> {
    let Some(drawn) = drawn else {
        let (analysed, frames) = rayon::join(analyse, || frames(model, design));
        return Ok((analysed?, frames?));
    };
    let analysed = analyse()?;
    let frames = model.frames_of(drawn, design, &analysed.responses.values)?;
    Ok((analysed, Some(frames)))
}

/// The design with the variable that bounds a peak, on which no response depends.
pub fn full_design(problem: &Problem, design: &[f64]) -> Vec<f64> {
    let mut full = design.to_vec();
    if let Some(peak) = problem.objective.peak() {
        full.insert(peak.variable, problem.variables[peak.variable].start);
    }
    full
}

fn constraints(problem: &Problem, analysed: &AnalyzedDesign) -> Vec<ConstraintRecord> {
    let AnalyzedDesign { design, evaluation, .. } = analysed;
    let record = |c: outcome::ConstraintValue| ConstraintRecord {
        limit: c.limit,
        values: outcome::values(problem, c.row.constraint, design, evaluation),
        margin: c.margin,
        status: c.status(),
        time: c.time,
    };
    outcome::constraints(problem, design, evaluation).into_iter().map(record).collect()
}

/// An analysed design with the derivatives of its responses.
struct DesignDerivatives<'p> {
    problem: &'p Problem,
    analysed: &'p AnalyzedDesign,
    /// The variable that bounds a peak.
    bound: Option<usize>,
    /// Number of the outputs of the file, which are the first responses.
    outputs: usize,
    /// The differentiated time points of each grid, in their order.
    points: Vec<Vec<usize>>,
    sensitivities: Sensitivities,
}

impl<'p> DesignDerivatives<'p> {
    /// Differentiates all responses at some of their time points, or at all of them if a quantity integrates over time.
    fn new(problem: &'p Problem, analysed: &'p AnalyzedDesign, outputs: usize) -> Result<Self> {
        let whole = |quantity: &Quantity| quantity.grid().is_some() && !quantity.is_transient();
        let is_complete = whole(&problem.objective.quantity) || problem.constraints.iter().any(|c| whole(&c.quantity));
        let points = differentiated_points(problem, analysed, outputs);
        let mut at: Vec<ResponseAt> = vec![];
        for (response, values) in analysed.responses.values[..outputs].iter().enumerate() {
            let thinned = problem.responses[response].grid.map(|grid| &points[grid]).filter(|_| !is_complete);
            let points = thinned.cloned().unwrap_or_else(|| (0..values.len()).collect());
            at.extend(points.into_iter().map(|point| ResponseAt { response, point }));
        }
        let rows = problem.sensitivities(&analysed.design, &analysed.responses, &at)?;
        let bound = problem.objective.peak().map(|peak| peak.variable);
        Ok(Self { problem, analysed, bound, outputs, points, sensitivities: Sensitivities { at, rows } })
    }

    /// The differentiated points of a history on a grid, or the single point of a value without one.
    fn points_of(&self, grid: Option<usize>) -> Vec<usize> {
        grid.map_or_else(|| vec![0], |grid| self.points[grid].clone())
    }

    fn record(&self, motion: Option<Vec<Vec<Vec<f32>>>>) -> Result<Derivatives> {
        let Self { problem, analysed, bound, .. } = self;
        let outputs = analysed.responses.values[..self.outputs].iter().enumerate().map(|(h, values)| {
            let points = self.points_of(problem.responses[h].grid);
            let gradient = |point: usize| {
                let gradient = self.sensitivities.gradient(ResponseAt { response: h, point });
                self.without_bound(gradient.unwrap_or_else(|| vec![0.0; problem.n()]))
            };
            let gradients = points.iter().map(|&p| gradient(p)).collect();
            HistoryGradients::new(points.iter().map(|&p| values[p]).collect(), points, gradients)
        });
        let of = |j: usize, sign: f64| {
            let values = outcome::values(problem, j, &analysed.design, &analysed.evaluation);
            self.rows(j, &values, sign)
        };
        let quantity = SignedQuantity { quantity: &problem.objective.quantity, sign: 1.0, bound: None };
        let objective = bound.is_none().then(|| self.without_bound(self.total(quantity, 0)));
        Ok(Derivatives {
            outputs: outputs.collect(),
            objective,
            peak: outcome::peak_constraints(problem)
                .map(|j| of(j, problem.constraints[j].sign()))
                .collect::<Result<_>>()?,
            constraints: outcome::stated_constraints(problem).map(|j| of(j, 1.0)).collect::<Result<_>>()?,
            motion,
        })
    }

    /// The gradients of sign · g of a constraint at the time points at which it holds.
    fn rows(&self, j: usize, values: &[Option<f64>], sign: f64) -> Result<HistoryGradients> {
        let quantity = &self.problem.constraints[j].quantity;
        let points = self.points_of(quantity.grid().filter(|_| quantity.is_transient()));
        let held: Vec<(usize, f64)> = points.into_iter().filter_map(|p| Some((p, sign * values[p]?))).collect();
        let gradient = |(point, _): &(usize, f64)| {
            let row = RowId { constraint: j, point: *point };
            let all = self.problem.row_derivative(row, sign, self.analysed, &self.sensitivities)?;
            Ok(self.without_bound(all))
        };
        let gradients = held.iter().map(gradient).collect::<Result<_>>()?;
        Ok(HistoryGradients::new(held.iter().map(|h| h.1).collect(), held.iter().map(|h| h.0).collect(), gradients))
    }

    fn total(&self, quantity: SignedQuantity<'_>, point: usize) -> Vec<f64> {
        let AnalyzedDesign { design, responses, .. } = self.analysed;
        self.problem.total_derivative(quantity, point, design, responses, &self.sensitivities)
    }

    fn without_bound(&self, mut gradient: Vec<f64>) -> Vec<f64> {
        if let Some(bound) = self.bound {
            gradient.remove(bound);
        }
        gradient
    }
}

impl HistoryGradients {
    fn new(values: Vec<f64>, points: Vec<usize>, gradients: Vec<Vec<f64>>) -> Self {
        let n = gradients.first().map_or(0, Vec::len);
        let by = (0..n).map(|k| gradients.iter().map(|g| g[k] as f32).collect()).collect();
        Self { points, values, by }
    }
}

/// The time points of each grid at which its histories are differentiated: at most [`POINTS`] equally spaced ones, and those at which an
/// output or a constrained quantity is largest or smallest. A margin is smallest, and a peak is reached, at one of the latter.
fn differentiated_points(problem: &Problem, analysed: &AnalyzedDesign, outputs: usize) -> Vec<Vec<usize>> {
    let AnalyzedDesign { design, responses, evaluation, .. } = analysed;
    let spaced = |count: usize| (0..count).step_by(count.div_ceil(POINTS).max(1)).collect();
    let mut points: Vec<Vec<usize>> = problem.grids.iter().map(|grid| spaced(grid.len())).collect();
    for (response, values) in problem.responses.iter().zip(&responses.values[..outputs]) {
        if let Some(grid) = response.grid {
            points[grid].extend(extremes(values.iter().copied().enumerate()));
        }
    }
    for (j, constraint) in problem.constraints.iter().enumerate() {
        if let Some(grid) = constraint.quantity.grid().filter(|_| constraint.quantity.is_transient()) {
            let values = outcome::values(problem, j, design, evaluation);
            points[grid].extend(extremes(values.into_iter().enumerate().filter_map(|(p, value)| Some((p, value?)))));
        }
    }
    points.iter_mut().for_each(|points| {
        points.sort_unstable();
        points.dedup();
    });
    points
}

/// The first points of the largest and of the smallest value.
fn extremes(values: impl Iterator<Item = (usize, f64)> + Clone) -> impl Iterator<Item = usize> {
    let first = |is_better: fn(f64, f64) -> bool| {
        values.clone().reduce(move |best, next| if is_better(next.1, best.1) { next } else { best })
    };
    [first(|a, b| a > b), first(|a, b| a < b)].into_iter().flatten().map(|(point, _)| point)
}

/// The frames of a motion, by an analysis of their own; none without a mechanism or with a single time point.
fn frames(model: &Model, design: &[f64]) -> Result<Option<Vec<Linkage>>> {
    let Some(times) = model.drawing_times() else { return Ok(None) };
    model.frames(design, &times)
}

/// Derivatives of a motion by differences towards the inside of the bounds; `None` if the parts change.
fn motion_derivatives(model: &Model, design: &[f64], at: &MotionFrames) -> Result<Option<Vec<Vec<Vec<f32>>>>> {
    let step = |k: usize| {
        let variable = &model.variables()[k];
        let range = variable.upper - variable.lower;
        let size = if range.is_finite() && range > 0.0 { range } else { design[k].abs().max(1e-3) };
        if design[k] + STEP * size <= variable.upper { STEP * size } else { -STEP * size }
    };
    // Single precision would lose a small step: both motions are computed in double precision.
    let flat = |design: &[f64]| -> Result<Option<Vec<Vec<f64>>>> {
        Ok(frames(model, design)?.map(|frames| frames.iter().map(numbers).collect()))
    };
    let Some(here) = flat(design)? else { return Ok(None) };
    let one = |k: usize| {
        let (mut moved, step) = (design.to_vec(), step(k));
        moved[k] += step;
        let Some(there) = flat(&moved)? else { return Ok(None) };
        let is_same = there.iter().zip(&at.frames).all(|(a, b)| a.len() == b.len());
        let slope = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| ((a - b) / step) as f32).collect();
        Ok(is_same.then(|| there.iter().zip(&here).map(slope).collect()))
    };
    (0..design.len()).into_par_iter().map(one).collect::<Result<Option<Vec<_>>>>()
}

impl MotionFrames {
    /// `None` without frames, or if the frames have different parts.
    fn new(frames: &[Linkage]) -> Option<Self> {
        let parts = PartCounts::of(frames.first()?);
        let is_same = frames.iter().all(|frame| PartCounts::of(frame) == parts);
        let frames = frames.iter().map(|frame| numbers(frame).into_iter().map(|v| v as f32).collect()).collect();
        is_same.then_some(Self { parts, frames })
    }
}

impl PartCounts {
    fn of(linkage: &Linkage) -> Self {
        Self {
            guides: linkage.guides.len(),
            plates: linkage.plates.iter().map(Vec::len).collect(),
            bars: linkage.bars.iter().map(Vec::len).collect(),
            beams: linkage.stressed.len(),
            springs: linkage.springs.len(),
            lines: linkage.lines.iter().map(Vec::len).collect(),
            masses: linkage.masses.len(),
            sliders: linkage.sliders.len(),
            ground: linkage.ground_joints.len(),
            joints: linkage.joints.len(),
        }
    }
}

/// The numbers of a frame in the order of [`PartCounts`].
fn numbers(linkage: &Linkage) -> Vec<f64> {
    let Linkage { guides, plates, bars, springs, lines, masses, sliders, ground_joints, joints, .. } = linkage;
    let beams = linkage.stressed.iter().map(|(outline, _)| outline);
    let mut all: Vec<f64> = vec![];
    all.extend(guides.iter().flatten().flatten());
    all.extend(plates.iter().chain(bars).flatten().flatten());
    all.extend(beams.flatten().flatten());
    all.extend(springs.iter().flatten().flatten());
    all.extend(lines.iter().flatten().flatten());
    all.extend(masses.iter().flatten());
    all.extend(sliders.iter().flat_map(|([x, y], angle)| [*x, *y, *angle]));
    all.extend(ground_joints.iter().chain(joints).flatten());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwright::model_file::read;

    fn model(name: &str) -> Model {
        let path = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        read(name, &std::fs::read_to_string(path).unwrap()).unwrap()
    }

    fn largest(values: impl Iterator<Item = f64>) -> f64 {
        values.fold(0.0, |largest, v| largest.max(v.abs()))
    }

    /// Outputs, objective, margins and motion at a near design are those of the derivatives, up to the square of the step.
    #[test]
    fn the_derivatives_predict_a_near_design() {
        for name in ["impact-absorber", "shaper", "slider-crank-assembled", "two-bar-truss"] {
            let mut at = AnalysedModel::new(model(name), Budget::default());
            let design: Vec<f64> = at.model.variables().iter().map(|v| v.start).collect();
            let here = at.analyse(&design, true).unwrap();
            let found = here.derivatives.as_ref().unwrap();
            for k in 0..design.len() {
                let variable = &at.model.variables()[k];
                let range = variable.upper - variable.lower;
                let size = if range.is_finite() { range } else { design[k].abs().max(1.0) };
                let step = if design[k] + 1e-4 * size <= variable.upper { 1e-4 * size } else { -1e-4 * size };
                let mut moved = design.clone();
                moved[k] += step;
                let there = at.analyse(&moved, false).unwrap();
                let near = |what: &str, before: f64, after: f64, slope: f64, scale: f64| {
                    let (change, predicted) = (after - before, slope * step);
                    let error = (change - predicted).abs();
                    assert!(error <= 0.02 * change.abs() + 2e-4 * scale, "{name} {what}: {change} and {predicted}");
                };
                for (h, gradients) in found.outputs.iter().enumerate() {
                    let scale = largest(here.outputs[h].iter().copied());
                    for (i, &p) in gradients.points.iter().enumerate() {
                        near("output", here.outputs[h][p], there.outputs[h][p], gradients.by[k][i].into(), scale);
                    }
                }
                if let Some(gradient) = &found.objective {
                    let (before, after) = (here.objective.unwrap(), there.objective.unwrap());
                    near("objective", before, after, gradient[k], before.abs());
                }
                if !found.peak.is_empty() {
                    let rows = found.peak.iter().flat_map(|g| g.values.iter().zip(&g.by[k]));
                    let predicted = rows.map(|(v, d)| v + f64::from(*d) * step).fold(f64::NEG_INFINITY, f64::max);
                    let after = there.objective.unwrap();
                    assert!((predicted - after).abs() <= 1e-2 * after.abs(), "{name} peak: {predicted} and {after}");
                }
                if let (Some(slopes), Some(before), Some(after)) = (&found.motion, &here.motion, &there.motion) {
                    let scale = largest(before.frames.iter().flatten().map(|v| f64::from(*v)));
                    for ((a, b), slope) in before.frames.iter().zip(&after.frames).zip(&slopes[k]) {
                        for i in 0..a.len() {
                            near("motion", a[i].into(), b[i].into(), slope[i].into(), scale);
                        }
                    }
                }
            }
        }
    }

    /// Drawings from the analysis of the outputs are those of an analysis of their own: bodies, sliders, beams, in the plane and in space.
    #[test]
    fn one_analysis_gives_outputs_and_drawings() {
        for name in ["impact-absorber", "shaper", "four-bar", "trebuchet", "quadruped-leg"] {
            let (joint, drawn) = model(name).with_drawn_outputs();
            let design: Vec<f64> = joint.variables().iter().map(|v| v.start).collect();
            let Some(drawn) = drawn else { panic!("{name} is analysed twice") };
            let values = joint.simulate(&design).unwrap().values;
            assert_eq!(drawn.first, model(name).output_names().count());
            let joint = joint.frames_of(&drawn, &design, &values).unwrap();
            let alone = frames(&model(name), &design).unwrap().unwrap();
            assert_eq!(joint.len(), alone.len(), "{name}");
            let scale = largest(alone.iter().flat_map(numbers));
            for (a, b) in joint.iter().zip(&alone) {
                let difference = largest(numbers(a).iter().zip(numbers(b)).map(|(a, b)| a - b));
                assert!(PartCounts::of(a) == PartCounts::of(b) && difference <= 1e-9 * scale, "{name}: {difference}");
            }
        }
    }

    /// A file without an objective has the warnings of its own outputs, also those of the comparison with longer steps.
    #[test]
    fn a_simulation_has_the_warnings_of_its_outputs() {
        let path = format!("{}/examples/models/trebuchet.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).unwrap().replace("step = 1e-3", "step = 0.1");
        let text = &text[..text.find("[objective]").unwrap()];
        let read = || read("throw", text).unwrap();
        let design: Vec<f64> = read().variables().iter().map(|v| v.start).collect();
        let warnings = AnalysedModel::new(read(), Budget::default()).analyse(&design, false).unwrap().warnings;
        assert_eq!(warnings, read().simulate(&design).unwrap().warnings);
        assert!(!warnings.is_empty());
    }

    /// The derivatives include those of the smallest margins, and of the peak, even where the histories are thinned.
    #[test]
    fn thinned_histories_keep_the_points_of_the_margins() {
        for (name, from, to) in [
            ("vehicle-suspension", "", ""),
            ("shaper", "points = 101", "points = 601"),
            ("impact-absorber", "points = 101", "points = 1001"),
        ] {
            let path = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            let text = std::fs::read_to_string(path).unwrap();
            assert!(text.contains(from), "{name}");
            let mut at = AnalysedModel::new(read(name, &text.replacen(from, to, 1)).unwrap(), Budget::default());
            let design: Vec<f64> = at.model.variables().iter().map(|v| v.start).collect();
            let here = at.analyse(&design, true).unwrap();
            let found = here.derivatives.as_ref().unwrap();
            assert!(here.outputs.iter().any(|values| values.len() > POINTS), "{name} is not thinned");
            for (record, rows) in here.constraints.iter().zip(&found.constraints) {
                let margin = |value: f64| (value - record.limit).abs();
                let worst = |values: &mut dyn Iterator<Item = f64>| {
                    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
                    [low, high].map(margin)
                };
                let whole = worst(&mut record.values.iter().flatten().copied());
                assert_eq!(worst(&mut rows.values.iter().copied()), whole, "{name}");
            }
            if !found.peak.is_empty() {
                let largest = found.peak.iter().flat_map(|g| &g.values).fold(f64::NEG_INFINITY, |a, b| a.max(*b));
                let objective = here.objective.unwrap();
                assert!((largest - objective).abs() <= 1e-12 * objective.abs(), "{name}: {largest} {objective}");
            }
        }
    }

    #[test]
    fn a_design_outside_its_bounds_or_of_another_length_is_refused() {
        let mut at = AnalysedModel::new(model("impact-absorber"), Budget::default());
        for wrong in [vec![], vec![0.5], vec![0.5, 0.5, 0.5], vec![2.0, 0.5], vec![f64::NAN, 0.5]] {
            assert!(at.analyse(&wrong, true).is_err(), "{wrong:?}");
        }
        assert!(at.analyse(&[0.5, 0.5], true).is_ok());
    }
}
