//! Falk's dual of a separable convex program: a concave function of m multipliers, for any number of variables.
//!
//! | file | content |
//! |---|---|
//! | `state` | settings and state |
//! | `dual_function` | the dual function, and the solution at given multipliers |
//! | `newton` | one damped Newton step, as an argmin `Solver` |
//! | `sample` | units and initial multipliers, from a sample of the variables if there are many |

mod dual_function;
mod newton;
mod sample;
mod state;

pub use state::{Falk, FalkState};

use crate::program::{Program, Separable, check_finite, feasible_start};
use crate::solution::{Evaluations, ProgramStatus, Solution, SubproblemSolver};
use crate::solvers::argmin_state;
use argmin::core::State;
use error::{Error, Result};
use sample::{DualStart, SampledProgram};

/// Largest KKT residual of a solution.
const ACCEPTED: f64 = 1e-8;
/// Tolerance of the multipliers of a sample, which approximate those of the whole program.
const SAMPLE_TOLERANCE: f64 = 1e-3;

impl SubproblemSolver for Falk {
    fn name(&self) -> &'static str {
        "Falk dual"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let separable = program.separable().ok_or_else(|| {
            let why = "the program is not a sum over its variables";
            Error::unsupported("dual solver", why, "use the automatic solver")
        })?;
        let start = feasible_start(program, start)?;
        let bounded = |j: usize| program.lower()[j].is_finite() && program.upper()[j].is_finite();
        if !(0..start.len()).all(bounded) {
            return self.fallback.solve(program, &start);
        }
        let mut state = self.maximize(separable, self.initial_state(separable, &start)?)?;
        let mut solution = dual_function::solution(program, separable, &start, &state);
        if state.convergence_predicted && !self.converged(separable, &state, &solution) {
            state = self.maximize(separable, FalkState { convergence_predicted: false, status: None, ..state })?;
            solution = dual_function::solution(program, separable, &start, &state);
        }
        solution.iterations = state.get_iter() as usize;
        solution.evaluations = Evaluations { values: state.evaluations, gradients: 2, hessians: 0 };
        if solution.status == ProgramStatus::Stalled && solution.kkt.largest() <= ACCEPTED {
            solution.status = ProgramStatus::Solved;
        }
        let solution = solution.checked(ACCEPTED);
        if solution.status == ProgramStatus::Solved {
            return Ok(solution);
        }
        let fallback = self.fallback.solve(program, &start)?;
        Ok(Solution { iterations: fallback.iterations + solution.iterations, ..fallback })
    }
}

impl Falk {
    /// Newton's method from the state `first`.
    fn maximize(&self, program: &dyn Separable, mut first: FalkState) -> Result<FalkState> {
        first.record = Default::default();
        first.record.limit = self.iterations as u64;
        argmin_state::run(program, *self, first)
    }

    /// True if `solution` meets the tolerance at the multipliers of `state`.
    fn converged(&self, program: &dyn Separable, state: &FalkState, solution: &Solution) -> bool {
        let residual = state.residual(&state.multipliers, &solution.rows, &newton::equalities(program));
        !(residual > self.attainable_tolerance(program))
    }

    /// Units and initial multipliers: those of samples of increasing size if there are many variables.
    fn initial_state(&self, program: &dyn Separable, start: &[f64]) -> Result<FalkState> {
        let mut first: Option<FalkState> = None;
        for sample in sample::SIZES.iter().map_while(|&size| SampledProgram::new(program, size)) {
            let Some(units) = DualStart::at(&sample, &sample.pick(start)) else { break };
            let begin = FalkState::new(units.clone());
            let previous = first.map(|f| (f.multipliers, f.damping));
            let (multipliers, damping) = previous.unwrap_or((begin.multipliers.clone(), begin.damping));
            let solver = Self { tolerance: SAMPLE_TOLERANCE, ..*self };
            let found = solver.maximize(&sample, FalkState { multipliers, damping, ..begin })?;
            let whole = FalkState::new(sample.units_of_program(units));
            if found.status != Some(ProgramStatus::Solved) {
                return Ok(whole);
            }
            first = Some(FalkState { multipliers: found.multipliers, damping: found.damping, ..whole });
        }
        if let Some(first) = first {
            return Ok(first);
        }
        if let Some(units) = DualStart::at(program, start) {
            return Ok(FalkState::new(units));
        }
        // Find the number that is not finite, for the message.
        check_finite(program, start, &program.gradients(start)?)?;
        Err(Error::definition("dual solver", "sums over the variables are not finite", "measure in smaller units"))
    }
}

impl FalkState {
    fn new(DualStart { rows, objective, multipliers }: DualStart) -> Self {
        Self { multipliers, row_units: rows, objective_unit: objective, ..Self::default() }
    }
}
