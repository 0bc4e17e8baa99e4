//! Trial steps of a run as pages show them.

use linkwright::problem::Problem;
use linkwright::report::outcome;
use linkwright::sao::{Cycle, RunState};
use serde_json::{Value, json};

/// The values of the variables that the model states: all but the bound of a peak.
pub fn own(problem: &Problem, values: &[f64]) -> Vec<f64> {
    let bound = problem.objective.peak().map(|peak| peak.variable);
    values.iter().enumerate().filter(|(k, _)| Some(*k) != bound).map(|(_, v)| *v).collect()
}

/// The trial steps of a run as pages show them.
pub fn cycles(problem: &Problem, state: &RunState) -> Vec<Value> {
    let one = |(k, cycle): (usize, &Cycle)| {
        json!({
            "cycle": cycle.cycle, "accepted": cycle.accepted, "design": own(problem, &cycle.design),
            "objective": outcome::objective_of_step(problem, state, k).ok(),
            "predicted": outcome::predicted_objective(problem, cycle),
            "violation": outcome::violation(problem, cycle),
            "objective_error": cycle.objective_error_pct, "constraint_error": cycle.constraint_error_pct,
            "retained": cycle.retained.len(), "active": cycle.active.len(), "failure": cycle.failure,
        })
    };
    state.history.iter().enumerate().map(one).collect()
}
