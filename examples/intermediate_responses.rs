//! Shows that linearizing intermediate responses takes fewer cycles than linearizing the objective itself:
//! `cargo run --example intermediate_responses`.
//!
//! The comfort criterion is the mean of ÿ² over time, the path error of the slider-crank a sum of squared distances that depend
//! on the pose of the coupler. With *intermediate responses* (13) only ÿ and the pose are linearized. The explicit functions of
//! them are kept, so the approximate problem is quadratic or nonlinear. *Directly*, the objective is linearized: a linear
//! program.

use linkwright::Result;
use linkwright::cases::{Optimum, impact_absorber, slider_crank};
use linkwright::problem::{Intermediates, Problem};
use linkwright::sao::{Method, RunState};

fn directly(mut problem: Problem) -> Problem {
    problem.objective = problem.objective.clone().directly(Intermediates::Identity);
    problem
}

fn run(name: &str, problem: &Problem, optimum: &Optimum) -> Result<RunState> {
    let state = Method::slp().solve(problem, |_| ())?;
    let trials = state.history.len() - 1;
    let first = &state.history[1];
    println!(
        "{name:<36} {:>6} {trials:>6} {:>12.1} {:>12.6} {:>12.6}  {:?}",
        state.cycles(),
        first.objective_error_pct,
        state.evaluation.objective,
        optimum.objective,
        state.status
    );
    Ok(state)
}

fn main() -> Result<()> {
    println!("{:<36} {:>6} {:>6} {:>12} {:>12} {:>12}", "", "cycles", "trials", "first E_f[%]", "F", "known F");
    let optimum = impact_absorber::comfort_optimum();
    let kept = run("comfort, intermediate responses", &impact_absorber::comfort()?, &optimum)?;
    let direct = run("comfort, directly", &directly(impact_absorber::comfort()?), &optimum)?;
    assert!(kept.status.is_success() && kept.cycles() == 8);
    assert!(direct.history.len() > kept.history.len(), "the linear objective takes more trial steps");

    let path = || slider_crank::path_generation(slider_crank::STAND_IN_START);
    let optimum = slider_crank::optimum();
    let kept = run("slider-crank, intermediate responses", &path()?, &optimum)?;
    let direct = run("slider-crank, directly", &directly(path()?), &optimum)?;
    assert!(kept.status.is_success() && (kept.evaluation.objective - optimum.objective).abs() < 1e-5);
    assert!(
        direct.evaluation.objective > kept.evaluation.objective + 1e-3,
        "the linear objective oscillates in the curved valley"
    );
    Ok(())
}
