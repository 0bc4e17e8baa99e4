//! Falk's dual of a separable convex program: one concave function of m multipliers, whatever n is.

mod evaluation;
mod iteration;
mod judgement;
mod sample;
mod step;
mod units;

use super::bookkeeping::{Bookkeeping, impl_argmin_state};
use super::kkt::supported;
use super::solver::{SubproblemSolver, check_finite, feasible_start};
use super::{Evaluations, InteriorPoint, Solution, Status};
use crate::{Gradients, Program, Separable};
use argmin::core::{Executor, State};
use error::{Error, Result};
use sample::Sample;
use serde::{Deserialize, Serialize};
use units::Units;

/// KKT residual up to which a dual solution is called one.
const ACCEPTED: f64 = 1e-8;
/// Tolerance of first prices from a sample, which are no better than the sample.
const ROUGH: f64 = 1e-3;

/// The solver of separable, strictly convex programs with few rows and up to millions of variables.
///
/// The dual function W(λ) = min f + Σ λᵢ gᵢ over the box falls apart into n problems of one variable. It is maximized
/// over λ ≥ 0 by Newton's method with adaptive damping. Sums run in parallel chunks of fixed size and are added in order:
/// the same bits for any number of threads. Memory beyond the program: one vector of length n.
///
/// Where the dual has no maximum (the rows contradict each other) or the minimizers jump (terms without curvature), the
/// program goes to [`InteriorPoint`], which also relaxes it. It is also an argmin `Solver`.
///
/// **Source.** Falk, *J. Math. Anal. Appl.* 19 (1967) 141–159; Fleury, *Int. J. Numer. Meth. Eng.* 14 (1979) 1761–1783.
///
/// **Errors.** [`Error::Definition`] if the program is not [`Separable`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Falk {
    tolerance: f64,
    iterations: usize,
    fallback: InteriorPoint,
}

impl Default for Falk {
    fn default() -> Self {
        Self { tolerance: 1e-11, iterations: 200, fallback: InteriorPoint::default() }
    }
}

impl Falk {
    /// With settings:
    ///
    /// * `tolerance` — largest violation and complementarity of a solution, relative as in
    ///   [`KktResidual`](super::KktResidual), in 1e-14 … 1e-4 (1e-11);
    /// * `iterations` — limit, at least 1 (200).
    ///
    /// **Errors.** [`Error::Option`] outside these ranges.
    pub fn new(tolerance: f64, iterations: usize) -> Result<Self> {
        let good = (1e-14..=1e-4).contains(&tolerance);
        Error::check_option("tolerance of the dual solver", "between 1e-14 and 1e-4", tolerance, good)?;
        Error::check_option("iterations of the dual solver", "at least 1", iterations as f64, iterations >= 1)?;
        Ok(Self { tolerance, iterations, ..Self::default() })
    }
}

/// Everything that changes during a run of the dual solver. It can be written to a file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct FalkState {
    /// λ, length m.
    pub multipliers: Vec<f64>,
    /// −W(λ): the cost that falls.
    pub cost: f64,
    /// Rows at the minimizer, length m.
    pub rows: Vec<f64>,
    /// Damping of the Newton step, relative.
    pub damping: f64,
    /// Largest relative violation and complementarity.
    pub residual: f64,
    /// Evaluations of the dual function.
    pub evaluations: usize,
    /// Whether the last step was taken without an evaluation, as its end was foreseen.
    #[serde(default)]
    pub foreseen: bool,
    /// The residual before the last one.
    #[serde(default)]
    before: f64,
    /// The verdict, once there is one.
    pub verdict: Option<Status>,
    bend: Vec<f64>,
    /// Change of each row over the scales of the variables, and of the objective.
    row_units: Vec<f64>,
    objective_unit: f64,
    pub(super) book: Bookkeeping,
}

impl_argmin_state!(FalkState, multipliers, cost);

/// The program as a sum over its variables, or an error naming the solver that would do.
pub(super) fn separable<'a>(program: &'a dyn Program, solver: &str) -> Result<&'a dyn Separable> {
    program.separable().ok_or_else(|| {
        let why = "the program is not a sum over its variables";
        Error::definition(solver, why, "use the automatic solver")
    })
}

impl SubproblemSolver for Falk {
    fn name(&self) -> &'static str {
        "Falk dual"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let parts = separable(program, "dual solver")?;
        let start = feasible_start(program, start)?;
        let bounded = |j: usize| program.lower()[j].is_finite() && program.upper()[j].is_finite();
        if !(0..start.len()).all(bounded) {
            return self.fallback.solve(program, &start);
        }
        let mut state = self.maximize(parts, self.first(parts, &start)?)?;
        let mut solution = judgement::certified(program, parts, &start, &state);
        if state.foreseen && state.residual_at(parts, &solution) > self.least_residual(parts) {
            state = self.maximize(parts, FalkState { foreseen: false, verdict: None, ..state })?;
            solution = judgement::certified(program, parts, &start, &state);
        }
        solution.iterations = state.get_iter() as usize;
        solution.evaluations = Evaluations { values: state.evaluations, gradients: 2, hessians: 0 };
        if solution.status == Status::Stalled && solution.kkt.largest() <= ACCEPTED {
            solution.status = Status::Solved;
        }
        solution.status = supported(solution.status, &solution.kkt, ACCEPTED);
        if solution.status == Status::Solved {
            return Ok(solution);
        }
        let mut fallback_solution = self.fallback.solve(program, &start)?;
        fallback_solution.iterations += solution.iterations;
        Ok(fallback_solution)
    }
}

impl Falk {
    /// Newton's method from a first state to its verdict.
    fn maximize(&self, parts: &dyn Separable, first: FalkState) -> Result<FalkState> {
        let limit = self.iterations as u64;
        let executor = Executor::new(parts, *self).configure(|s: FalkState| s.with_limit(first, limit));
        Ok(executor.ctrlc(false).timer(false).run().map_err(super::sqp::from_argmin)?.state)
    }

    /// Units of rows and objective at the start, and first prices: those of samples of the variables where there are many.
    fn first(&self, parts: &dyn Separable, start: &[f64]) -> Result<FalkState> {
        let mut first: Option<FalkState> = None;
        for sample in sample::SIZES.iter().map_while(|&size| Sample::of(parts, size)) {
            let Some(units) = Units::at(&sample, &sample.pick(start)) else { break };
            let begin = FalkState::new(units.clone());
            let known = first.map(|f| (f.multipliers, f.damping));
            let (multipliers, damping) = known.unwrap_or((begin.multipliers.clone(), begin.damping));
            let rough =
                Self { tolerance: ROUGH, ..*self }.maximize(&sample, FalkState { multipliers, damping, ..begin })?;
            let whole = FalkState::new(sample.restore(units));
            if rough.verdict != Some(Status::Solved) {
                return Ok(whole);
            }
            first = Some(FalkState { multipliers: rough.multipliers, damping: rough.damping, ..whole });
        }
        if let Some(first) = first {
            return Ok(first);
        }
        if let Some(units) = Units::at(parts, start) {
            return Ok(FalkState::new(units));
        }
        // The slow way knows which number is not finite.
        check_finite(parts, start, &parts.gradients(start)?)?;
        Err(Error::definition("dual solver", "sums over the variables are not finite", "measure in smaller units"))
    }

    /// The residual that is asked for; sums of n terms carry a rounding.
    fn least_residual(&self, parts: &dyn Separable) -> f64 {
        self.tolerance.max(16.0 * f64::EPSILON * parts.variables() as f64)
    }
}

impl FalkState {
    fn new(Units { rows, objective, multipliers }: Units) -> Self {
        Self { multipliers: multipliers, row_units: rows, objective_unit: objective, ..Self::default() }
    }

    fn with_limit(self, first: Self, limit: u64) -> Self {
        let mut state = Self { book: self.book, ..first };
        state.book.limit = limit;
        state
    }
}

/// Multipliers of the bounds from the slope of the Lagrangian.
pub(super) fn reduced(program: &dyn Program, x: &[f64], g: &Gradients, λ: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut lower = vec![0.0; x.len()];
    let mut upper = vec![0.0; x.len()];
    for j in 0..x.len() {
        let slope = g.rows.column(j).iter().zip(λ).fold(g.objective[j], |a, (g, λ)| a + λ * g);
        if x[j] <= program.lower()[j] && slope > 0.0 {
            lower[j] = slope;
        } else if x[j] >= program.upper()[j] && slope < 0.0 {
            upper[j] = -slope;
        }
    }
    (lower, upper)
}
