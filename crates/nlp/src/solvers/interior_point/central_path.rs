//! Settings of the interior point method, and Newton's method along the central path as an argmin `Solver`.

use super::conditions::{LocalDerivatives, PerturbedConditions, PrimalDualIterate};
use super::newton;
use crate::kkt::bound_multipliers;
use crate::program::{Program, check_finite, feasible_start};
use crate::solution::{Candidate, Evaluations, ProgramStatus, Solution};
use crate::solvers::argmin_state::{self, ExecutorRecord, IterationResult, impl_argmin_state, termination};
use crate::solvers::scaling::Normalized;
use argmin::core::{Problem, Solver, TerminationStatus};
use argmin::kv;
use error::{Error, Result};

/// Largest KKT residual of a solution.
pub(super) const ACCEPTED: f64 = 1e-8;
/// Largest number of Newton steps for one value of the perturbation.
const STEPS_PER_PERTURBATION: usize = 60;
/// Largest number of times that a step is halved.
const HALVINGS: usize = 30;
/// Distance to a bound, relative to the range, below which a variable is moved onto the bound.
const ON_BOUND: f64 = 1e-10;

/// A primal–dual interior point method for separable convex programs.
///
/// Use it for many rows, for terms without curvature, and for programs that are separable except for a convex quadratic
/// of low rank in the objective ([`Program::coupled`]). For few rows and strictly convex terms
/// [`Falk`](crate::Falk) is faster.
///
/// Newton's method solves the optimality conditions with complementarity λ s = μ, for μ → 0. The linear system is reduced
/// to the smaller of n and m. If there are many rows, only violated rows are included. A program without a feasible
/// point is relaxed. The solver returns [`Error::Unsupported`] for a program of any other structure.
///
/// # Sources
/// Svanberg, *MMA and GCMMA – two methods for nonlinear optimization* (2007), section 5; Wright,
/// *Primal-Dual Interior-Point Methods* (1997).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InteriorPoint {
    tolerance: f64,
    iterations: usize,
}

impl Default for InteriorPoint {
    fn default() -> Self {
        Self { tolerance: 1e-12, iterations: 300 }
    }
}

impl InteriorPoint {
    /// Sets the last value of the perturbation μ, in units of the program at the start, in 1e-14 … 1e-4 (default 1e-12).
    ///
    /// # Errors
    /// [`Error::Option`] outside this range.
    pub fn with_tolerance(self, tolerance: f64) -> Result<Self> {
        let is_valid = (1e-14..=1e-4).contains(&tolerance);
        Error::check_option("tolerance of the interior point solver", "between 1e-14 and 1e-4", tolerance, is_valid)?;
        Ok(Self { tolerance, ..self })
    }

    /// Sets the largest number of Newton steps, at least 1 (default 300).
    ///
    /// # Errors
    /// [`Error::Option`] for zero.
    pub fn with_iterations(self, iterations: usize) -> Result<Self> {
        let got = iterations as f64;
        Error::check_option("iterations of the interior point solver", "at least 1", got, iterations >= 1)?;
        Ok(Self { iterations, ..self })
    }

    /// One run with all rows and without relaxation.
    pub(super) fn run(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let start = feasible_start(program, start)?;
        let here = program.gradients(&start)?;
        check_finite(program, &start, &here)?;
        let normalized = Normalized::new(program, &start, &here);
        let conditions = PerturbedConditions::new(&normalized);
        let first = CentralPathState::new(&conditions, &normalized.to_normalized(&start), self.iterations)?;
        let last = argmin_state::run(&conditions, *self, first)?;
        let evaluations = last.evaluations();
        let central = moved_onto_bounds(program, normalized.restore(last.candidate()));
        let gradients = program.gradients(&central.x)?;
        let certified = |c: Candidate| c.certified(program, &start, evaluations, &gradients, Some(&here.objective));
        let (lower, upper) = bound_multipliers(program, &central.x, &gradients, &central.multipliers);
        let mut solution = certified(Candidate { lower, upper, ..central.clone() });
        if !(solution.kkt.largest() <= ACCEPTED) {
            // Near a weakly active bound the multipliers of the central path are more accurate.
            let with_central_multipliers = certified(central);
            if with_central_multipliers.kkt.largest() < solution.kkt.largest() {
                solution = with_central_multipliers;
            }
        }
        if solution.kkt.largest() <= ACCEPTED {
            solution.status = ProgramStatus::Solved;
        }
        Ok(solution)
    }
}

/// State of a run along the central path.
#[derive(Default)]
pub(super) struct CentralPathState {
    point: PrimalDualIterate,
    derivatives: LocalDerivatives,
    /// The perturbation μ.
    perturbation: f64,
    /// Newton steps since the last reduction of μ.
    steps: usize,
    /// Sum of squares of the residual of the perturbed conditions.
    residual: f64,
    gradients: usize,
    /// Set at the end of the path. The KKT residual decides whether the point is a solution.
    status: Option<ProgramStatus>,
    record: ExecutorRecord,
}

impl_argmin_state!(CentralPathState, point.x, residual);

impl CentralPathState {
    /// The state for μ = 1 at a point inside the bounds near `start`.
    fn new(conditions: &PerturbedConditions<'_>, start: &[f64], iterations: usize) -> Result<Self> {
        let point = conditions.interior_point(start)?;
        let derivatives = conditions.derivatives(&point)?;
        let record = ExecutorRecord { limit: iterations as u64, ..ExecutorRecord::default() };
        Ok(Self { point, derivatives, perturbation: 1.0, gradients: 2, record, ..Self::default() })
    }

    /// Reduces μ until a Newton step is needed, or ends the path at μ = `tolerance`.
    fn reduce_perturbation(&mut self, conditions: &PerturbedConditions<'_>, tolerance: f64) {
        loop {
            let μ = self.perturbation;
            let (largest, squares) = conditions.residual(&self.point, &self.derivatives, μ);
            self.residual = squares;
            if self.steps < STEPS_PER_PERTURBATION && !(largest <= 0.9 * μ) {
                return;
            }
            if μ <= tolerance {
                self.status = Some(ProgramStatus::Solved);
                return;
            }
            self.perturbation = (0.1 * μ).min(μ.powf(1.5)).max(tolerance);
            self.steps = 0;
        }
    }

    fn evaluations(&self) -> Evaluations {
        Evaluations { values: 1, gradients: self.gradients, hessians: self.record.iteration as usize }
    }

    fn candidate(self) -> Candidate {
        let limit = self.record.iteration == self.record.limit;
        let PrimalDualIterate { x, λ, ξ, η, .. } = self.point;
        Candidate {
            x,
            multipliers: λ,
            lower: ξ,
            upper: η,
            iterations: self.record.iteration as usize,
            status: if limit { ProgramStatus::IterationLimit } else { ProgramStatus::Stalled },
            relaxation: None,
        }
    }
}

impl<'a> Solver<&'a PerturbedConditions<'a>, CentralPathState> for InteriorPoint {
    fn name(&self) -> &str {
        "interior point"
    }

    fn init(
        &mut self,
        problem: &mut Problem<&'a PerturbedConditions<'a>>,
        mut state: CentralPathState,
    ) -> IterationResult<CentralPathState> {
        let conditions = problem.problem.expect("argmin holds the problem during a run");
        state.reduce_perturbation(conditions, self.tolerance);
        Ok((state, None))
    }

    /// One Newton step, halved until the residual decreases, and reductions of μ.
    fn next_iter(
        &mut self,
        problem: &mut Problem<&'a PerturbedConditions<'a>>,
        mut state: CentralPathState,
    ) -> IterationResult<CentralPathState> {
        let conditions = problem.problem.expect("argmin holds the problem during a run");
        let μ = state.perturbation;
        let Some(d) = newton::step(conditions, &state.point, &state.derivatives, μ) else {
            state.status = Some(ProgramStatus::Stalled);
            return Ok((state, None));
        };
        let mut length = conditions.longest_step(&state.point, &d);
        let mut accepted = false;
        for _ in 0..HALVINGS {
            let next = conditions.moved(&state.point, &d, length);
            let derivatives = conditions.derivatives(&next)?;
            state.gradients += 1;
            if conditions.residual(&next, &derivatives, μ).1 < state.residual {
                (state.point, state.derivatives, accepted) = (next, derivatives, true);
                break;
            }
            length *= 0.5;
        }
        state.steps = if accepted { state.steps + 1 } else { STEPS_PER_PERTURBATION };
        state.reduce_perturbation(conditions, self.tolerance);
        let log = kv!("perturbation" => state.perturbation; "step length" => length;);
        Ok((state, Some(log)))
    }

    fn terminate(&mut self, state: &CentralPathState) -> TerminationStatus {
        termination(state.status)
    }
}

/// The candidate with each variable that is very close to a bound moved onto it.
fn moved_onto_bounds(program: &dyn Program, mut c: Candidate) -> Candidate {
    for (j, x) in c.x.iter_mut().enumerate() {
        let (l, u) = (program.lower()[j], program.upper()[j]);
        let range = if (u - l).is_finite() { u - l } else { x.abs().max(1.0) };
        if *x - l <= ON_BOUND * range {
            *x = l;
        } else if u - *x <= ON_BOUND * range {
            *x = u;
        }
    }
    c
}
