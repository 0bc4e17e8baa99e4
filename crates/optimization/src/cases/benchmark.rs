//! Runs of methods on a problem with known optima.

use super::{CatalogueEntry, Optimum};
use crate::problem::{Problem, Sensitivities};
use crate::sao::{Method, PostOptimal, Preset, RunState, Status, Stop};
use error::Result;
use rayon::prelude::*;

/// Relative error of the objective up to which an optimum is reached, unless its uncertainty is larger.
const ACCURACY: f64 = 1e-5;
/// Violation, as a fraction, up to which an optimum is reached.
const VIOLATION: f64 = 1e-6;
/// KKT residual at which a run may end, and up to which a design that is not among the known optima counts as an optimum.
const RESIDUAL: f64 = 1e-3;

/// Largest number of cycles of a run, accepted or not.
const CYCLES: usize = 100;

/// Numbers of analyses and sensitivity analyses of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnalysisCounts {
    /// Analyses, the first one included.
    pub analyses: usize,
    /// Sensitivity analyses.
    pub sensitivity_analyses: usize,
}

impl AnalysisCounts {
    /// Sum of both numbers.
    pub fn total(&self) -> usize {
        self.analyses + self.sensitivity_analyses
    }
}

/// Conclusion about a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Conclusion {
    /// Converged to a known optimum.
    Reached(&'static Optimum),
    /// Converged to a design that is not among the known optima but satisfies the optimality conditions.
    OtherOptimum,
    /// Reported as converged although the optimality conditions do not hold.
    False,
    /// Ended without convergence, and reported so.
    Unfinished(Status),
    /// The method does not apply to this problem, with the reason.
    Refused(String),
}

impl std::fmt::Display for Conclusion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Reached(_) => f.write_str("optimum"),
            Self::OtherOptimum => f.write_str("other optimum"),
            Self::False => f.write_str("FALSE"),
            Self::Unfinished(status) => status.fmt(f),
            Self::Refused(_) => f.write_str("refused"),
        }
    }
}

/// A run of a method on a problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Attempt {
    /// Name of the problem.
    pub problem: &'static str,
    /// Name of the method.
    pub method: &'static str,
    /// Conclusion about the run.
    pub conclusion: Conclusion,
    /// Accepted cycles.
    pub cycles: usize,
    /// Numbers of analyses of the whole run.
    pub work: AnalysisCounts,
    /// Numbers of analyses up to and including the first accepted design at the known optimum: objective within 1e-5 (or the
    /// uncertainty of the optimum), violation at most 1e-6.
    pub to_optimum: Option<AnalysisCounts>,
    /// Objective at the end.
    pub objective: f64,
    /// Largest violation at the end, as a fraction; negative if no constraint is active.
    pub violation: f64,
    /// Largest KKT residual at the end, independent of the method; see [`kkt_residual`].
    pub residual: f64,
    /// (F − F*) / |F*| for the nearest known optimum.
    pub excess: Option<f64>,
    /// For every accepted design: the total number of analyses, and the distance from the nearest known optimum in objective
    /// or constraints.
    pub approach: Vec<[f64; 2]>,
}

/// Runs one method on one problem, for at most 100 cycles, with accuracy 1e-6 of the objective and KKT residual 1e-3.
///
/// # Errors
/// If the problem cannot be built. A method that does not apply to it gives [`Conclusion::Refused`].
pub fn attempt(entry: &'static CatalogueEntry, preset: &'static Preset) -> Result<Attempt> {
    let problem = (entry.build)()?;
    match benchmark_method(preset).solve(&problem, |_| ()) {
        Ok(state) => Ok(conclude(entry.optima(), [entry.name, preset.name], &problem, &state)),
        Err(error) => Ok(refused([entry.name, preset.name], error.to_string())),
    }
}

/// The method with the stop test of all comparisons.
pub(super) fn benchmark_method(preset: &Preset) -> Method {
    let stop = Stop { accuracy: VIOLATION, residual: RESIDUAL, max_cycles: CYCLES, ..Stop::default() };
    Method { stop, ..(preset.method)() }
}

/// Runs any method on any problem; `names` are those of problem and method.
///
/// # Errors
/// If the method does not apply to the problem.
pub fn attempt_with(
    problem: &Problem,
    method: &Method,
    optima: &'static [Optimum],
    names: [&'static str; 2],
) -> Result<Attempt> {
    Ok(conclude(optima, names, problem, &method.solve(problem, |_| ())?))
}

/// Runs methods on one problem in parallel; results are in the order of the methods.
///
/// # Errors
/// As [`attempt`].
pub fn compare(entry: &'static CatalogueEntry, presets: &[&'static Preset]) -> Result<Vec<Attempt>> {
    presets.par_iter().map(|preset| attempt(entry, preset)).collect()
}

fn refused([problem, method]: [&'static str; 2], why: String) -> Attempt {
    Attempt {
        problem,
        method,
        conclusion: Conclusion::Refused(why),
        cycles: 0,
        work: AnalysisCounts { analyses: 0, sensitivity_analyses: 0 },
        to_optimum: None,
        objective: f64::NAN,
        violation: f64::NAN,
        residual: f64::NAN,
        excess: None,
        approach: vec![],
    }
}

fn conclude(optima: &'static [Optimum], names: [&'static str; 2], problem: &Problem, state: &RunState) -> Attempt {
    let objective = state.evaluation.objective;
    let violation = state.evaluation.max_violation_pct() / 100.0;
    let residual = kkt_residual(problem, state).unwrap_or(f64::INFINITY);
    let known = nearest(optima, objective);
    let conclusion = match (state.status, known) {
        (Status::Converged, Some(optimum)) if is_at(optimum, objective, violation) => Conclusion::Reached(optimum),
        (Status::Converged, _) if violation <= VIOLATION && residual <= RESIDUAL => Conclusion::OtherOptimum,
        (Status::Converged, _) => Conclusion::False,
        (status, _) => Conclusion::Unfinished(status),
    };
    let designs = accepted(state);
    let first = |optimum: &Optimum| designs.iter().find(|d| is_at(optimum, d.objective, d.violation)).map(|d| d.work);
    let apart = |d: &AcceptedDesign| known.map_or(f64::NAN, |o| o.excess(d.objective).abs().max(d.violation));
    Attempt {
        problem: names[0],
        method: names[1],
        conclusion,
        cycles: state.cycles(),
        work: AnalysisCounts {
            analyses: state.counters.analyses,
            sensitivity_analyses: state.counters.sensitivity_analyses,
        },
        to_optimum: known.and_then(first),
        objective,
        violation,
        residual,
        excess: known.map(|o| o.excess(objective)),
        approach: designs.iter().map(|d| [d.work.total() as f64, apart(d)]).collect(),
    }
}

/// Largest residual of the Karush–Kuhn–Tucker conditions at the last design of a run, computed independently of the method: the largest first-order
/// change of the objective over the scale of a variable. It is relative to the objective or, if that is larger, to its change during the run; or
/// relative to the largest derivative of the objective there, if that makes it smaller.
///
/// The derivatives at the last design alone are not a suitable unit: they are zero at an optimum in the interior.
///
/// # Errors
/// Those of an analysis and a sensitivity analysis.
pub fn kkt_residual(problem: &Problem, state: &RunState) -> Result<f64> {
    let relative = PostOptimal::new(problem, state)?.kkt(problem);
    let objective = state.evaluation.objective;
    let change = state.history.first().map_or(0.0, |cycle| (cycle.objective - objective).abs());
    let unit = objective.abs().max(change);
    let absolute = relative * steepest(problem, &state.design)?;
    Ok(if absolute > 0.0 { relative.min(absolute / unit) } else { absolute })
}

/// Largest derivative of the objective at a design, in scaled variables.
fn steepest(problem: &Problem, design: &[f64]) -> Result<f64> {
    let responses = problem.analyze(design)?;
    let at = problem.responses_of(&problem.objective.quantity, 0);
    let sensitivities = Sensitivities { rows: problem.sensitivities(design, &responses, &at)?, at };
    let slopes = problem.total_derivative(problem.objective.signed(), 0, design, &responses, &sensitivities);
    let scaled = slopes.iter().zip(problem.scales()).map(|(slope, scale)| (slope * scale).abs());
    Ok(scaled.fold(0.0, f64::max))
}

/// The known optimum whose objective is nearest to `objective`.
fn nearest(optima: &'static [Optimum], objective: f64) -> Option<&'static Optimum> {
    let apart = |o: &Optimum| o.excess(objective).abs();
    optima.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))
}

fn is_at(optimum: &Optimum, objective: f64, violation: f64) -> bool {
    optimum.excess(objective).abs() <= ACCURACY.max(optimum.uncertainty) && violation <= VIOLATION
}

/// An accepted design and the numbers of analyses up to and including its own.
struct AcceptedDesign {
    work: AnalysisCounts,
    objective: f64,
    violation: f64,
}

fn accepted(state: &RunState) -> Vec<AcceptedDesign> {
    let mut sensitivity_analyses = 0;
    let mut found = vec![];
    for (k, cycle) in state.history.iter().enumerate() {
        if cycle.accepted {
            let work = AnalysisCounts { analyses: k + 1, sensitivity_analyses };
            found.push(AcceptedDesign { work, objective: cycle.objective, violation: cycle.violation_pct / 100.0 });
            sensitivity_analyses = (sensitivity_analyses + 1).min(state.counters.sensitivity_analyses);
        }
    }
    found
}
