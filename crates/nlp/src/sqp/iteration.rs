//! One iteration, as an argmin `Solver`.

use super::merit::{Calls, Merit, violation};
use super::state::SqpState;
use super::{Curvature, Sqp, curvature, step};
use crate::kkt::variable_scale;
use crate::solver::check_finite;
use crate::{Gradients, Program};
use crate::{KktResidual, Solution, Status};
use argmin::core::{KV, Problem, Solver, TerminationReason, TerminationStatus};
use argmin::kv;
use error::{Error, Result};
use nalgebra::DVector;

/// Steps without measurable gain before a run stops.
const QUIET: usize = 4;
/// Decrease of the objective, in units of its change over the scales of the variables, that counts as bottomless.
const BOTTOMLESS: f64 = 1e9;

/// The error of ours inside an error of argmin.
pub(crate) fn from_argmin(e: argmin::core::Error) -> Error {
    e.downcast::<Error>().unwrap_or_else(|e| Error::Subproblem {
        solver: "SQP",
        status: e.to_string(),
        iterations: 0,
        remedy: "report this as a bug",
    })
}

type Step = Result<(SqpState, Option<KV>), argmin::core::Error>;

impl<'a> Solver<&'a dyn Program, SqpState> for Sqp {
    fn name(&self) -> &'static str {
        "SQP"
    }

    fn init(&mut self, problem: &mut Problem<&'a dyn Program>, mut state: SqpState) -> Step {
        let program = program_of(problem);
        let x = state.x.clone();
        let gradients = problem.problem("gradients", |p| Ok(p.gradients(&x)?))?;
        check_finite(program, &x, &gradients)?;
        state.evaluations.gradients += 1;
        state.start.clone_from(&x);
        state.first_slope.clone_from(&gradients.objective);
        state.first_objective = gradients.values.objective;
        state.move_to(x, gradients);
        let (n, m) = (state.x.len(), state.rows.len());
        state.multipliers = vec![0.0; m];
        (state.lower_multipliers, state.upper_multipliers) = (vec![0.0; n], vec![0.0; n]);
        state.curvature = curvature::initial(&scales(program, &state), unit(program, &state));
        state.fresh = true;
        Ok((state, None))
    }

    fn next_iter(&mut self, problem: &mut Problem<&'a dyn Program>, mut state: SqpState) -> Step {
        let program = program_of(problem);
        let exact = self.exact_curvature(program, &mut state)?;
        state.violation = violation(program, &state.rows);
        let qp = step::linearized(program, &state);
        let Some(full) = step::full_step(&qp, &self.conic, &state, guessed_penalty(program, &state))? else {
            return Ok((without_progress(program, state, exact, self.accepted()), None));
        };
        state.was_elastic = full.left > 0.0;
        take_multipliers(&mut state, &full);
        state.kkt = residual(program, &state);
        if state.kkt.largest() <= self.tolerance {
            return Ok((stopped(state, Status::Solved), None));
        }
        let merit = merit(program, &mut state, &full);
        state.quiet = if -merit.slope <= merit.noise { state.quiet + 1 } else { 0 };
        let (x, mut count) = (state.x.clone(), state.evaluations);
        let found = {
            let mut values = |y: &[f64]| {
                count.values += 1;
                program.values(y)
            };
            let mut slopes = 0;
            let mut gradients = |y: &[f64]| {
                slopes += 1;
                program.gradients(y)
            };
            let mut calls = Calls { values: &mut values, gradients: &mut gradients };
            let again = |v: &crate::Values| step::corrected(&qp, &self.conic, &full.to.x, &v.rows);
            let found = merit.search(&x, &full.to.x, &mut calls, again);
            count.gradients += slopes;
            found
        };
        state.evaluations = count;
        let Some(accepted) = found else { return Ok((without_progress(program, state, exact, self.accepted()), None)) };
        state.fraction = accepted.fraction;
        if !exact {
            learn(program, &mut state, &accepted.x, &accepted.gradients);
        }
        state.move_to(accepted.x, accepted.gradients);
        Ok(after_step(program, state))
    }

    fn terminate(&mut self, state: &SqpState) -> TerminationStatus {
        match state.verdict {
            Some(verdict) => TerminationStatus::Terminated(TerminationReason::SolverExit(verdict.to_string())),
            None => TerminationStatus::NotTerminated,
        }
    }
}

impl Sqp {
    /// Puts the exact Hessian into the state, made convex; false if BFGS is to be used.
    fn exact_curvature(&self, program: &dyn Program, state: &mut SqpState) -> Result<bool> {
        if self.curvature == Curvature::QuasiNewton {
            return Ok(false);
        }
        let Some(h) = program.lagrangian_hessian(&state.x, &state.multipliers)? else { return Ok(false) };
        state.evaluations.hessians += 1;
        if !h.iter().all(|v| v.is_finite()) {
            return Ok(false);
        }
        state.curvature = curvature::convexified(&h, state, &scales(program, state), unit(program, state));
        Ok(true)
    }
}

fn program_of<'a>(problem: &Problem<&'a dyn Program>) -> &'a dyn Program {
    problem.problem.expect("argmin holds the problem during a run")
}

fn scales(program: &dyn Program, s: &SqpState) -> Vec<f64> {
    (0..s.x.len()).map(|j| variable_scale(program.lower()[j], program.upper()[j], s.start[j], s.x[j])).collect()
}

/// Largest change of the objective over the scale of a variable, here or at the start.
fn unit(program: &dyn Program, s: &SqpState) -> f64 {
    let largest = scales(program, s)
        .iter()
        .zip(s.slope.iter().zip(&s.first_slope))
        .fold(0.0f64, |a, (s, (g, h))| a.max(s * g.abs().max(h.abs())));
    if largest > 0.0 { largest } else { 1.0 }
}

/// A penalty of the right size before any multiplier is known.
fn guessed_penalty(program: &dyn Program, s: &SqpState) -> f64 {
    let scale = scales(program, s);
    let rows = (0..s.rows.len()).flat_map(|i| (0..s.x.len()).map(move |j| (i, j)));
    let largest = rows.fold(0.0f64, |a, (i, j)| a.max((s.row_slopes[(i, j)] * scale[j]).abs()));
    10.0 * unit(program, s) / if largest > 0.0 { largest } else { 1.0 }
}

fn take_multipliers(state: &mut SqpState, full: &step::Step) {
    state.multipliers.clone_from(&full.to.multipliers);
    state.lower_multipliers.clone_from(&full.to.lower);
    state.upper_multipliers.clone_from(&full.to.upper);
}

fn residual(program: &dyn Program, s: &SqpState) -> KktResidual {
    let c = s.candidate();
    let solution = Solution {
        x: c.x,
        objective: s.objective,
        rows: vec![],
        multipliers: c.multipliers,
        lower_multipliers: c.lower,
        upper_multipliers: c.upper,
        iterations: 0,
        evaluations: s.evaluations,
        status: Status::Solved,
        relaxation: None,
        relaxed_rows: vec![],
        kkt: KktResidual::default(),
    };
    KktResidual::from_gradients(program, &s.start, &s.gradients(), Some(&s.first_slope), &solution)
}

/// The merit function of this iteration; its penalty exceeds the sum of the multipliers.
fn merit<'a>(program: &'a dyn Program, state: &mut SqpState, full: &step::Step) -> Merit<'a> {
    let sum: f64 = state.multipliers.iter().map(|λ| λ.abs()).sum();
    state.penalty = (1.1 * sum).max(0.5 * (state.penalty + sum)).max(full.penalty);
    let change: f64 = state.slope.iter().zip(full.to.x.iter().zip(&state.x)).map(|(g, (y, x))| g * (y - x)).sum();
    let gain = state.penalty * (state.violation - full.left).max(0.0);
    let here = state.objective + state.penalty * state.violation;
    let size = state.objective.abs() + state.penalty * state.rows.iter().fold(0.0f64, |a, g| a.max(g.max(0.0)));
    Merit { program, penalty: state.penalty, here, slope: (change - gain).min(0.0), noise: 1e-15 * size }
}

/// Curvature from the step to `x`.
fn learn(program: &dyn Program, state: &mut SqpState, x: &[f64], g: &Gradients) {
    let d = DVector::from_iterator(x.len(), x.iter().zip(&state.x).map(|(a, b)| a - b));
    let λ = DVector::from_column_slice(&state.multipliers);
    let lagrangian = |slope: &[f64], rows: &nalgebra::DMatrix<f64>| DVector::from_column_slice(slope) + rows.tr_mul(&λ);
    let y = lagrangian(&g.objective, &g.rows) - lagrangian(&state.slope, &state.row_slopes);
    if state.fresh {
        let unit = curvature::initial(&scales(program, state), 1.0);
        let (seen, length) = (d.dot(&y), d.dot(&(&unit * &d)));
        if seen > 0.0 && length > 0.0 {
            state.curvature = unit * (seen / length);
        }
        state.fresh = false;
    }
    curvature::damped_bfgs(&mut state.curvature, &d, &y);
}

/// Without a quadratic program that can be solved or an acceptable step: once more with fresh curvature, or the end.
fn without_progress(program: &dyn Program, mut state: SqpState, exact: bool, accepted: f64) -> SqpState {
    if exact || state.fresh || state.kkt.largest() <= accepted {
        return stopped(state, Status::Stalled);
    }
    state.curvature = curvature::initial(&scales(program, &state), unit(program, &state));
    state.fresh = true;
    state
}

fn after_step(program: &dyn Program, mut state: SqpState) -> (SqpState, Option<KV>) {
    let fallen = state.first_objective - state.objective;
    if fallen > BOTTOMLESS * first_unit(program, &state) && violation(program, &state.rows) <= state.violation {
        state = stopped(state, Status::Unbounded);
    } else if state.quiet >= QUIET {
        state = stopped(state, Status::Stalled);
    }
    let log = kv!(
        "violation" => state.violation;
        "fraction" => state.fraction;
        "kkt" => state.kkt.largest();
        "penalty" => state.penalty;
        "relaxed" => state.was_elastic;
    );
    (state, Some(log))
}

/// Change of the objective over the scales of the variables at the start.
fn first_unit(program: &dyn Program, s: &SqpState) -> f64 {
    let scale = |j: usize| variable_scale(program.lower()[j], program.upper()[j], s.start[j], s.start[j]);
    (0..s.x.len()).fold(s.first_objective.abs(), |a, j| a.max(scale(j) * s.first_slope[j].abs()))
}

fn stopped(mut state: SqpState, verdict: Status) -> SqpState {
    state.verdict = Some(verdict);
    state
}
