//! One iteration of the dual, as an argmin `Solver`.

use super::evaluation::{self, Dual};
use super::{Falk, FalkState, step};
use crate::Separable;
use crate::{Solution, Status};
use argmin::core::{KV, Problem, Solver, TerminationReason, TerminationStatus};
use argmin::kv;
use nalgebra::{DMatrix, DVector};

/// Normalized price above which the rows are taken to contradict each other.
const TOO_DEAR: f64 = 1e9;
/// Variables from which on an evaluation is saved where its outcome is foreseen.
const MANY: usize = 10_000;
/// Damping tried in one iteration at most.
const TRIALS: usize = 40;

type Step = Result<(FalkState, Option<KV>), argmin::core::Error>;

impl<'a> Solver<&'a dyn Separable, FalkState> for Falk {
    fn name(&self) -> &'static str {
        "Falk dual"
    }

    fn init(&mut self, problem: &mut Problem<&'a dyn Separable>, mut state: FalkState) -> Step {
        let program = problem.problem.expect("argmin holds the problem during a run");
        let m = program.rows();
        state.row_units.resize(m, 1.0);
        state.objective_unit = if state.objective_unit > 0.0 { state.objective_unit } else { 1.0 };
        state.multipliers.resize(m, 0.0);
        state.damping = if state.damping > 0.0 { state.damping } else { 1e-6 };
        let dual = evaluate(program, problem, &state.multipliers)?;
        state.evaluations += 1;
        self.take(program, &mut state, &dual);
        Ok((state, None))
    }

    fn next_iter(&mut self, problem: &mut Problem<&'a dyn Separable>, mut state: FalkState) -> Step {
        let program = problem.problem.expect("argmin holds the problem during a run");
        let m = program.rows();
        let λ = DVector::from_column_slice(&state.multipliers);
        let rows = DVector::from_column_slice(&state.rows);
        let bend = DMatrix::from_column_slice(m, m, &state.bend);
        let signed: Vec<bool> = (0..m).map(|i| program.is_equality(i)).collect();
        let noise = 1e-14 * state.cost.abs().max(f64::MIN_POSITIVE);
        for _ in 0..TRIALS {
            let damping = DVector::from_fn(m, |i, _| state.damping * state.stiffness(i));
            let Some(d) = step::newton(&λ, &rows, &bend, &damping, &signed) else {
                state.damping = (10.0 * state.damping).max(1e-12);
                continue;
            };
            let gain = rows.dot(&d) - 0.5 * d.dot(&(&bend * &d));
            let next: Vec<f64> = (0..m).map(|i| if signed[i] { λ[i] + d[i] } else { (λ[i] + d[i]).max(0.0) }).collect();
            if self.foresees(program, &state) {
                (state.multipliers, state.foreseen, state.verdict) = (next, true, Some(Status::Solved));
                return Ok((state, None));
            }
            let dual = evaluate(program, problem, &next)?;
            state.evaluations += 1;
            let risen = dual.value + state.cost;
            let before = state.residual;
            if risen >= 1e-4 * gain && risen.is_finite()
                || (gain <= noise && state.residual_of(&next, dual.rows.as_slice(), &signed) < before)
            {
                state.damping *= if risen > 0.75 * gain {
                    0.05
                } else if risen > 0.25 * gain {
                    0.5
                } else {
                    4.0
                };
                state.damping = state.damping.max(1e-15);
                state.multipliers = next;
                self.take(program, &mut state, &dual);
                let log = kv!("residual" => state.residual; "damping" => state.damping;);
                return Ok((state, Some(log)));
            }
            if gain <= noise {
                break;
            }
            state.damping = (8.0 * state.damping).max(1e-12);
        }
        state.verdict = Some(Status::Stalled);
        Ok((state, None))
    }

    fn terminate(&mut self, state: &FalkState) -> TerminationStatus {
        match state.verdict {
            Some(verdict) => TerminationStatus::Terminated(TerminationReason::SolverExit(verdict.to_string())),
            None => TerminationStatus::NotTerminated,
        }
    }
}

fn evaluate(
    program: &dyn Separable,
    problem: &mut Problem<&dyn Separable>,
    λ: &[f64],
) -> Result<Dual, argmin::core::Error> {
    let weights: Vec<f64> = [1.0].into_iter().chain(λ.iter().copied()).collect();
    problem.problem("dual", |_| Ok(evaluation::dual(program, &weights)))
}

impl Falk {
    /// Takes over the dual function at the state's multipliers, and decides whether that is the end.
    fn take(&self, program: &dyn Separable, state: &mut FalkState, dual: &Dual) {
        state.cost = -dual.value;
        state.rows = dual.rows.as_slice().to_vec();
        state.bend = dual.bend.as_slice().to_vec();
        let signed: Vec<bool> = (0..program.rows()).map(|i| program.is_equality(i)).collect();
        state.before = state.residual;
        state.residual = state.residual_of(&state.multipliers, dual.rows.as_slice(), &signed);
        let price = |i: usize| state.multipliers[i].abs() * state.row_units[i] / state.objective_unit;
        if state.residual <= self.least_residual(program) {
            state.verdict = Some(Status::Solved);
        } else if (0..program.rows()).any(|i| price(i) > TOO_DEAR) || !state.residual.is_finite() {
            state.verdict = Some(Status::Stalled);
        }
    }
}

impl Falk {
    /// Whether the next Newton step surely ends the run: with many variables an evaluation just to see this is not cheap.
    ///
    /// Quadratic convergence, by the last step: r₊ ≈ r (r/r₋)². The judgement of the solution checks it.
    fn foresees(&self, program: &dyn Separable, state: &FalkState) -> bool {
        let rate = state.residual / state.before;
        let damped = state.damping > 1e-6;
        program.variables() >= MANY
            && !damped
            && rate < 0.1
            && state.residual * rate * rate < 1e-3 * self.least_residual(program)
    }
}

impl FalkState {
    /// Relative violation and complementarity of a solution at the state's multipliers.
    pub(super) fn residual_at(&self, program: &dyn Separable, solution: &Solution) -> f64 {
        let signed: Vec<bool> = (0..program.rows()).map(|i| program.is_equality(i)).collect();
        self.residual_of(&self.multipliers, &solution.rows, &signed)
    }

    /// Relative violation and complementarity.
    fn residual_of(&self, λ: &[f64], rows: &[f64], signed: &[bool]) -> f64 {
        (0..λ.len()).fold(0.0f64, |worst, i| {
            let g = rows[i];
            let violated = if signed[i] { g.abs() } else { g.max(0.0) } / self.row_units[i];
            let slack = if signed[i] { 0.0 } else { (λ[i] * g).abs() / self.objective_unit };
            if violated.is_nan() || slack.is_nan() { f64::INFINITY } else { worst.max(violated).max(slack) }
        })
    }

    /// The natural size of −∂²W/∂λᵢ²: as it is, or from the units where all variables are at bounds.
    fn stiffness(&self, i: usize) -> f64 {
        let m = self.rows.len();
        let unit = self.row_units[i] * self.row_units[i] / self.objective_unit;
        self.bend[i * m + i].max(unit)
    }
}
