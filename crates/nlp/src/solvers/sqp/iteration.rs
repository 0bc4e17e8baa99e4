//! One SQP iteration, as an argmin `Solver`.

use super::curvature;
use super::least_squares;
use super::merit::{CountedProgram, MeritFunction};
use super::negative_curvature;
use super::quadratic_subproblem::{self as subproblem, FullStep};
use super::state::{Curvature, Sqp, SqpState};
use crate::ProgramStatus;
use crate::kkt::{largest_change, positive_or_one, variable_scales};
use crate::program::{Gradients, Program, Values, check_finite, largest_violation};
use crate::solvers::argmin_state::{IterationResult, termination};
use argmin::core::{KV, Problem, Solver, TerminationStatus};
use argmin::kv;
use error::Result;
use nalgebra::{DMatrix, DVector};

/// Consecutive steps with a predicted decrease below rounding after which there is no progress.
const STAGNANT_STEPS: usize = 4;
/// Decrease of the objective that counts as unbounded, in units of its largest change when one variable changes by its
/// scale.
const UNBOUNDED: f64 = 1e9;

impl<'a> Solver<&'a dyn Program, SqpState> for Sqp {
    fn name(&self) -> &'static str {
        "SQP"
    }

    fn init(&mut self, problem: &mut Problem<&'a dyn Program>, mut state: SqpState) -> IterationResult<SqpState> {
        let program = program_of(problem);
        let x = state.x.clone();
        let gradients = match state.known_gradients.take() {
            Some(known) => known,
            None => problem.problem("gradients", |p| Ok(p.gradients(&x)?))?,
        };
        check_finite(program, &x, &gradients)?;
        state.evaluations.gradients += 1;
        state.start.clone_from(&x);
        state.start_gradient.clone_from(&gradients.objective);
        state.start_objective = gradients.values.objective;
        state.move_to(x, gradients);
        let (n, m) = (state.x.len(), state.rows.len());
        state.multipliers = vec![0.0; m];
        (state.lower_multipliers, state.upper_multipliers) = (vec![0.0; n], vec![0.0; n]);
        state.hessian = curvature::initial(&scales(program, &state), objective_unit(program, &state));
        state.hessian_is_initial = true;
        Ok((state, None))
    }

    fn next_iter(&mut self, problem: &mut Problem<&'a dyn Program>, mut state: SqpState) -> IterationResult<SqpState> {
        let program = program_of(problem);
        let exact = self.use_exact_hessian(program, &mut state)?;
        state.violation = largest_violation(program, &state.rows, |_| 1.0);
        let qp = subproblem::linearized(program, &state);
        let Some(full) = subproblem::full_step(&qp, &self.conic, &state, initial_penalty(program, &state))? else {
            return Ok(logged(without_progress(program, state, exact, self.accepted())?));
        };
        state.relaxed = full.remaining_violation > 0.0;
        store_multipliers(&mut state, &full);
        state.kkt = state.residual(program);
        if state.kkt.largest() <= self.tolerance {
            state.status = Some(ProgramStatus::Solved);
            return Ok(logged(state));
        }
        let merit = merit(program, &mut state, &full);
        state.stagnant_steps = if -merit.slope <= merit.noise { state.stagnant_steps + 1 } else { 0 };
        let mut evaluator = CountedProgram { program, count: state.evaluations };
        let corrected = |v: &Values| subproblem::corrected(&qp, &self.conic, &full.to.x, &v.rows);
        let found = merit.search(&state.x, &full.to.x, &mut evaluator, corrected);
        state.evaluations = evaluator.count;
        let Some(accepted) = found else {
            return Ok(logged(without_progress(program, state, exact, self.accepted())?));
        };
        state.step_length = accepted.step_length;
        if !exact {
            update_hessian(program, &mut state, &accepted.x, &accepted.gradients);
        }
        state.move_to(accepted.x, accepted.gradients);
        if is_unbounded(program, &state) {
            state.status = Some(ProgramStatus::Unbounded);
        } else if state.stagnant_steps >= STAGNANT_STEPS {
            state.stagnant_steps = 0;
            state = without_progress(program, state, exact, self.accepted())?;
        }
        Ok(logged(state))
    }

    fn terminate(&mut self, state: &SqpState) -> TerminationStatus {
        termination(state.status)
    }
}

impl Sqp {
    /// Stores the convexified exact Hessian in the state. Returns false if BFGS is to be used.
    fn use_exact_hessian(&self, program: &dyn Program, state: &mut SqpState) -> Result<bool> {
        if self.curvature == Curvature::QuasiNewton {
            return Ok(false);
        }
        let (scale, unit) = (scales(program, state), objective_unit(program, state));
        let is_absolute = self.curvature == Curvature::Absolute;
        let weights =
            if is_absolute { least_squares::multipliers(program, state, &scale) } else { state.multipliers.clone() };
        let Some(h) = program.lagrangian_hessian(&state.x, &weights)? else { return Ok(false) };
        state.evaluations.hessians += 1;
        if !h.iter().all(|v| v.is_finite()) {
            return Ok(false);
        }
        state.hessian = if is_absolute {
            let normals = least_squares::normals(program, state, &scale, &weights);
            curvature::absolute(&h, &normals, (&scale, unit), state.has_uniform_floor)
        } else {
            curvature::convexified(&h, state, &scale, unit)
        };
        Ok(true)
    }
}

fn program_of<'a>(problem: &Problem<&'a dyn Program>) -> &'a dyn Program {
    problem.problem.expect("argmin holds the problem during a run")
}

fn scales(program: &dyn Program, s: &SqpState) -> Vec<f64> {
    variable_scales(program, &s.start, &s.x)
}

/// Largest change of the objective over the scale of a variable, at the point or at the start.
fn objective_unit(program: &dyn Program, s: &SqpState) -> f64 {
    let scales = scales(program, s);
    let both = [&s.objective_gradient, &s.start_gradient].map(|gradient| largest_change(&scales, gradient));
    positive_or_one(both[0].max(both[1]))
}

/// A penalty for the first iteration, before multipliers are known.
fn initial_penalty(program: &dyn Program, s: &SqpState) -> f64 {
    let scales = scales(program, s);
    let largest = s.row_gradients.row_iter().map(|row| largest_change(&scales, row.iter())).fold(0.0, f64::max);
    10.0 * objective_unit(program, s) / positive_or_one(largest)
}

fn store_multipliers(state: &mut SqpState, full: &FullStep) {
    state.multipliers.clone_from(&full.to.multipliers);
    state.lower_multipliers.clone_from(&full.to.lower);
    state.upper_multipliers.clone_from(&full.to.upper);
}

/// The merit function of this iteration; its penalty exceeds the sum of the multipliers.
fn merit<'a>(program: &'a dyn Program, state: &mut SqpState, full: &FullStep) -> MeritFunction<'a> {
    let sum: f64 = state.multipliers.iter().map(|λ| λ.abs()).sum();
    state.penalty = (1.1 * sum).max(0.5 * (state.penalty + sum)).max(full.penalty);
    let change: f64 =
        state.objective_gradient.iter().zip(full.to.x.iter().zip(&state.x)).map(|(g, (y, x))| g * (y - x)).sum();
    let reduction = state.penalty * (state.violation - full.remaining_violation).max(0.0);
    let here = state.objective + state.penalty * state.violation;
    let size = state.objective.abs() + state.penalty * state.rows.iter().fold(0.0f64, |a, g| a.max(g.max(0.0)));
    MeritFunction { program, penalty: state.penalty, here, slope: (change - reduction).min(0.0), noise: 1e-15 * size }
}

/// Updates the Hessian by BFGS for the step to `x`.
fn update_hessian(program: &dyn Program, state: &mut SqpState, x: &[f64], g: &Gradients) {
    let d = DVector::from_iterator(x.len(), x.iter().zip(&state.x).map(|(a, b)| a - b));
    let λ = DVector::from_column_slice(&state.multipliers);
    let lagrangian = |objective: &[f64], rows: &DMatrix<f64>| DVector::from_column_slice(objective) + rows.tr_mul(&λ);
    let y = lagrangian(&g.objective, &g.rows) - lagrangian(&state.objective_gradient, &state.row_gradients);
    if state.hessian_is_initial {
        let unit = curvature::initial(&scales(program, state), 1.0);
        let (curvature, length) = (d.dot(&y), d.dot(&(&unit * &d)));
        if curvature > 0.0 && length > 0.0 {
            state.hessian = unit * (curvature / length);
        }
        state.hessian_is_initial = false;
    }
    curvature::damped_bfgs(&mut state.hessian, &d, &y);
}

/// Handles an iteration without an acceptable step: resets the Hessian, or gives an exact one more curvature and leaves a stationary
/// violation along negative curvature; stops if none of these helps.
fn without_progress(program: &dyn Program, mut state: SqpState, exact: bool, accepted: f64) -> Result<SqpState> {
    let was_reset = if exact { state.has_uniform_floor } else { state.hessian_is_initial };
    if state.kkt.largest() <= accepted {
        state.status = Some(ProgramStatus::Stalled);
    } else if exact && !was_reset {
        state.has_uniform_floor = true;
    } else if !was_reset {
        state.hessian = curvature::initial(&scales(program, &state), objective_unit(program, &state));
        state.hessian_is_initial = true;
    } else if !exact || !leaves_stationary_violation(program, &mut state)? {
        state.status = Some(ProgramStatus::Stalled);
    }
    Ok(state)
}

/// Moves the state along negative curvature of the violation; false if there is none.
fn leaves_stationary_violation(program: &dyn Program, state: &mut SqpState) -> Result<bool> {
    let mut evaluator = CountedProgram { program, count: state.evaluations };
    let found = negative_curvature::step(&mut evaluator, state, &scales(program, state))?;
    state.evaluations = evaluator.count;
    let Some(accepted) = found else { return Ok(false) };
    state.step_length = accepted.step_length;
    state.move_to(accepted.x, accepted.gradients);
    Ok(true)
}

/// True for a decrease of the objective that counts as unbounded, without more violation.
fn is_unbounded(program: &dyn Program, state: &SqpState) -> bool {
    let decrease = state.start_objective - state.objective;
    let violation = largest_violation(program, &state.rows, |_| 1.0);
    decrease > UNBOUNDED * start_unit(program, state) && violation <= state.violation
}

/// The state with the values that argmin's observers receive.
fn logged(state: SqpState) -> (SqpState, Option<KV>) {
    let values = kv!(
        "violation" => state.violation;
        "step length" => state.step_length;
        "kkt" => state.kkt.largest();
        "penalty" => state.penalty;
        "relaxed" => state.relaxed;
    );
    (state, Some(values))
}

/// Unit of the objective at the start: the larger of its size and of its largest change when one variable changes by
/// its scale.
fn start_unit(program: &dyn Program, s: &SqpState) -> f64 {
    let scales = variable_scales(program, &s.start, &s.start);
    s.start_objective.abs().max(largest_change(&scales, &s.start_gradient))
}
