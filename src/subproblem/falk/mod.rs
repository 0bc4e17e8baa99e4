//! Falk's dual of a separable convex program: one concave function of m multipliers, whatever n is.

mod evaluation;
mod iteration;
mod step;

use super::bookkeeping::{Bookkeeping, impl_argmin_state};
use super::kkt::supported;
use super::solver::{Candidate, SubproblemSolver, feasible_start};
use super::{Evaluations, InteriorPoint, Solution, Status};
use crate::error::{Error, Result};
use crate::problem::{Gradients, Program, Separable};
use argmin::core::{Executor, State};
use serde::{Deserialize, Serialize};

/// KKT residual up to which a dual solution is called one.
const ACCEPTED: f64 = 1e-8;

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
    rescue: InteriorPoint,
}

impl Default for Falk {
    fn default() -> Self {
        Self { tolerance: 1e-11, iterations: 200, rescue: InteriorPoint::default() }
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
            return self.rescue.solve(program, &start);
        }
        let limit = self.iterations as u64;
        let here = program.gradients(&start)?;
        super::solver::check_finite(program, &start, &here)?;
        let first = FalkState::scaled(program, &start, &here);
        let executor = Executor::new(parts, *self).configure(|s: FalkState| s.with_limit(first, limit));
        let state = executor.ctrlc(false).timer(false).run().map_err(super::sqp::from_argmin)?.state;
        let solution = finished(program, parts, &start, &here, &state)?;
        if solution.status == Status::Solved {
            return Ok(solution);
        }
        let mut rescued = self.rescue.solve(program, &start)?;
        rescued.iterations += solution.iterations;
        Ok(rescued)
    }
}

impl FalkState {
    /// Units of rows and objective at the start, and first prices.
    fn scaled(program: &dyn Program, start: &[f64], here: &Gradients) -> Self {
        let scale: Vec<f64> = (0..start.len())
            .map(|j| super::variable_scale(program.lower()[j], program.upper()[j], start[j], start[j]))
            .collect();
        let (mut row_units, mut row_sums) = (vec![0.0f64; program.rows()], vec![0.0f64; program.rows()]);
        let (mut objective, mut objective_sum) = (0.0f64, 0.0);
        for (j, s) in scale.iter().enumerate() {
            for ((unit, sum), g) in row_units.iter_mut().zip(&mut row_sums).zip(here.rows.column(j).iter()) {
                let change = (s * g).abs();
                (*unit, *sum) = (unit.max(change), *sum + change);
            }
            let change = (s * here.objective[j]).abs();
            (objective, objective_sum) = (objective.max(change), objective_sum + change);
        }
        let or_one = |v: f64| if v > 0.0 { v } else { 1.0 };
        row_units.iter_mut().for_each(|r| *r = or_one(*r));
        // Prices at which objective and rows pull alike: most variables are then off their bounds.
        let prices = (0..program.rows()).map(|i| match program.is_equality(i) || row_sums[i] == 0.0 {
            true => 0.0,
            false => objective_sum / row_sums[i] / program.rows() as f64,
        });
        let multipliers = prices.collect();
        Self { multipliers, row_units, objective_unit: or_one(objective), ..Self::default() }
    }

    fn with_limit(mut self, first: Self, limit: u64) -> Self {
        (self.multipliers, self.row_units, self.objective_unit) =
            (first.multipliers, first.row_units, first.objective_unit);
        self.book.limit = limit;
        self
    }
}

/// The point of the multipliers, judged.
fn finished(
    program: &dyn Program,
    parts: &dyn Separable,
    start: &[f64],
    here: &Gradients,
    state: &FalkState,
) -> Result<Solution> {
    let weights: Vec<f64> = [1.0].into_iter().chain(state.multipliers.iter().copied()).collect();
    let x = evaluation::minimizer(parts, &weights);
    let gradients = program.gradients(&x)?;
    let (lower, upper) = reduced(program, &x, &gradients, &state.multipliers);
    let candidate = Candidate {
        x,
        multipliers: state.multipliers.clone(),
        lower,
        upper,
        iterations: state.get_iter() as usize,
        status: state.verdict.unwrap_or(Status::IterationLimit),
        relaxation: None,
    };
    let evaluations = Evaluations { values: state.evaluations, gradients: 2, hessians: 0 };
    let mut solution = candidate.judged(program, start, evaluations, &gradients, Some(&here.objective));
    if solution.status == Status::Stalled && solution.kkt.largest() <= ACCEPTED {
        solution.status = Status::Solved;
    }
    solution.status = supported(solution.status, &solution.kkt, ACCEPTED);
    Ok(solution)
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
