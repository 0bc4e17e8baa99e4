//! One damped Newton step of the dual solver, as an argmin `Solver`.

use super::dual_function::{self, DualEvaluation};
use super::state::{Falk, FalkState};
use crate::program::Separable;
use crate::solution::ProgramStatus;
use crate::solvers::argmin_state::{IterationResult, termination};
use argmin::core::{Problem, Solver, TerminationStatus};
use argmin::kv;
use nalgebra::{DMatrix, DVector};

/// Normalized multiplier above which the rows are considered contradictory.
const LARGEST_MULTIPLIER: f64 = 1e9;
/// Smallest number of variables for which the last evaluation is skipped if convergence is predicted.
const MANY: usize = 10_000;
/// Largest number of damping values in one iteration.
const TRIALS: usize = 40;

impl<'a> Solver<&'a dyn Separable, FalkState> for Falk {
    fn name(&self) -> &'static str {
        "Falk dual"
    }

    fn init(&mut self, problem: &mut Problem<&'a dyn Separable>, mut state: FalkState) -> IterationResult<FalkState> {
        let program = problem.problem.expect("argmin holds the problem during a run");
        let m = program.rows();
        state.row_units.resize(m, 1.0);
        state.objective_unit = if state.objective_unit > 0.0 { state.objective_unit } else { 1.0 };
        state.multipliers.resize(m, 0.0);
        state.damping = if state.damping > 0.0 { state.damping } else { 1e-6 };
        let dual = evaluate(program, problem, &state.multipliers)?;
        state.evaluations += 1;
        self.update(program, &mut state, &dual);
        Ok((state, None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<&'a dyn Separable>,
        mut state: FalkState,
    ) -> IterationResult<FalkState> {
        let program = problem.problem.expect("argmin holds the problem during a run");
        let m = program.rows();
        let λ = DVector::from_column_slice(&state.multipliers);
        let rows = DVector::from_column_slice(&state.rows);
        let negative_hessian = DMatrix::from_column_slice(m, m, &state.negative_hessian);
        let is_equality = equalities(program);
        let noise = 1e-14 * state.cost.abs().max(f64::MIN_POSITIVE);
        for _ in 0..TRIALS {
            let damping = DVector::from_fn(m, |i, _| state.damping * state.diagonal_scale(i));
            let Some(d) = newton_step(&λ, &rows, &negative_hessian, &damping, &is_equality) else {
                state.damping = (10.0 * state.damping).max(1e-12);
                continue;
            };
            let predicted = rows.dot(&d) - 0.5 * d.dot(&(&negative_hessian * &d));
            let next: Vec<f64> =
                (0..m).map(|i| if is_equality[i] { λ[i] + d[i] } else { (λ[i] + d[i]).max(0.0) }).collect();
            if self.converges_next(program, &state) {
                (state.multipliers, state.convergence_predicted, state.status) =
                    (next, true, Some(ProgramStatus::Solved));
                return Ok((state, None));
            }
            let dual = evaluate(program, problem, &next)?;
            state.evaluations += 1;
            let increase = dual.value + state.cost;
            let converges = || state.residual(&next, dual.rows.as_slice(), &is_equality) < state.residual;
            if increase >= 1e-4 * predicted && increase.is_finite() || (predicted <= noise && converges()) {
                state.damping *= if increase > 0.75 * predicted {
                    0.05
                } else if increase > 0.25 * predicted {
                    0.5
                } else {
                    4.0
                };
                state.damping = state.damping.max(1e-15);
                state.multipliers = next;
                self.update(program, &mut state, &dual);
                let log = kv!("residual" => state.residual; "damping" => state.damping;);
                return Ok((state, Some(log)));
            }
            if predicted <= noise {
                break;
            }
            state.damping = (8.0 * state.damping).max(1e-12);
        }
        state.status = Some(ProgramStatus::Stalled);
        Ok((state, None))
    }

    fn terminate(&mut self, state: &FalkState) -> TerminationStatus {
        termination(state.status)
    }
}

/// True for the rows that are equalities.
pub(super) fn equalities(program: &dyn Separable) -> Vec<bool> {
    (0..program.rows()).map(|i| program.is_equality(i)).collect()
}

fn evaluate(
    program: &dyn Separable,
    problem: &mut Problem<&dyn Separable>,
    λ: &[f64],
) -> Result<DualEvaluation, argmin::core::Error> {
    let weights: Vec<f64> = [1.0].into_iter().chain(λ.iter().copied()).collect();
    problem.problem("dual", |_| Ok(dual_function::dual(program, &weights)))
}

impl Falk {
    /// Stores the dual function at the state's multipliers, and the status if the run ends here.
    fn update(&self, program: &dyn Separable, state: &mut FalkState, dual: &DualEvaluation) {
        state.cost = -dual.value;
        state.rows = dual.rows.as_slice().to_vec();
        state.negative_hessian = dual.negative_hessian.as_slice().to_vec();
        state.previous_residual = state.residual;
        state.residual = state.residual(&state.multipliers, dual.rows.as_slice(), &equalities(program));
        let normalized = |i: usize| state.multipliers[i].abs() * state.row_units[i] / state.objective_unit;
        if state.residual <= self.attainable_tolerance(program) {
            state.status = Some(ProgramStatus::Solved);
        } else if (0..program.rows()).any(|i| normalized(i) > LARGEST_MULTIPLIER) || !state.residual.is_finite() {
            state.status = Some(ProgramStatus::Stalled);
        }
    }

    /// True if the next Newton step is predicted to converge, so that an evaluation over many variables can be skipped.
    ///
    /// The prediction is that of quadratic convergence, r₊ ≈ r (r/r₋)². The KKT residual of the solution checks it.
    fn converges_next(&self, program: &dyn Separable, state: &FalkState) -> bool {
        let rate = state.residual / state.previous_residual;
        let damped = state.damping > 1e-6;
        program.variables() >= MANY
            && !damped
            && rate < 0.1
            && state.residual * rate * rate < 1e-3 * self.attainable_tolerance(program)
    }
}

impl FalkState {
    /// Scale of −∂²W/∂λᵢ²: its value, or that of the units if all variables are at their bounds.
    fn diagonal_scale(&self, i: usize) -> f64 {
        let m = self.rows.len();
        let unit = self.row_units[i] * self.row_units[i] / self.objective_unit;
        self.negative_hessian[i * m + i].max(unit)
    }
}

/// The step d that maximizes g·d − ½ dᵀ(B + μD) d subject to λ + d ≥ 0 for inequality rows; `None` if there is none.
///
/// An active set method: rows are held at λ + d = 0 and released one at a time.
fn newton_step(
    λ: &DVector<f64>,
    rows: &DVector<f64>,
    negative_hessian: &DMatrix<f64>,
    damping: &DVector<f64>,
    is_equality: &[bool],
) -> Option<DVector<f64>> {
    let m = λ.len();
    let k = negative_hessian + DMatrix::from_diagonal(damping);
    // Initially held at zero: satisfied rows with a zero multiplier.
    let mut held: Vec<bool> = (0..m).map(|i| !is_equality[i] && λ[i] == 0.0 && rows[i] <= 0.0).collect();
    for _ in 0..3 * m + 3 {
        let d = solve(&k, λ, rows, &held)?;
        let negative = (0..m).filter(|&i| !held[i] && !is_equality[i] && λ[i] + d[i] < 0.0).collect::<Vec<_>>();
        if !negative.is_empty() {
            negative.into_iter().for_each(|i| held[i] = true);
            continue;
        }
        let gradient = rows - &k * &d;
        let released = (0..m).filter(|&i| held[i] && gradient[i] > 1e-14 * rows[i].abs());
        match released.max_by(|&a, &b| gradient[a].total_cmp(&gradient[b])) {
            Some(i) => held[i] = false,
            None => return Some(d),
        }
    }
    // The active sets cycle: use a diagonal matrix that dominates K, which decouples the rows.
    Some(DVector::from_fn(m, |i, _| {
        let d = rows[i] / (k.row(i).iter().map(|v| v.abs()).sum::<f64>());
        if is_equality[i] { d } else { d.max(-λ[i]) }
    }))
}

/// The step with dᵢ = −λᵢ for the rows that are held.
fn solve(k: &DMatrix<f64>, λ: &DVector<f64>, rows: &DVector<f64>, held: &[bool]) -> Option<DVector<f64>> {
    let free: Vec<usize> = (0..λ.len()).filter(|&i| !held[i]).collect();
    let mut d = DVector::from_fn(λ.len(), |i, _| if held[i] { -λ[i] } else { 0.0 });
    if free.is_empty() {
        return Some(d);
    }
    let right = rows - k * &d;
    let right = DVector::from_iterator(free.len(), free.iter().map(|&i| right[i]));
    let system = k.select_rows(&free).select_columns(&free);
    let solution = system.cholesky()?.solve(&right);
    free.iter().zip(solution.iter()).for_each(|(&i, v)| d[i] = *v);
    solution.iter().all(|v| v.is_finite()).then_some(d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_at_zero_and_releases() {
        let k = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let (λ, g) = (DVector::from_vec(vec![1.0, 0.0]), DVector::from_vec(vec![-4.0, 1.0]));
        let d = newton_step(&λ, &g, &k, &DVector::zeros(2), &[false, false]).unwrap();
        // Unconstrained: (−3, 2), which makes λ₁ negative; with λ₁ held at 0 the other is 1.
        assert!((d[0] + 1.0).abs() < 1e-15 && (d[1] - 1.0).abs() < 1e-15);
    }
}
