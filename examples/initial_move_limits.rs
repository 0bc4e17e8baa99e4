//! Shows that smaller initial move limits reduce the error of the first trial step and lead to the same optimum:
//! `cargo run --example initial_move_limits`.
//!
//! With initial move limits of 40 % on the slider-crank, the paper's run rejects the first trial step and takes ten cycles.
//! With 30 % the paper reports eight cycles and a much smaller error in the first cycle. The paper does not print its start.
//! From the substitute used here, 30 % takes nine cycles.

use linkwright::Result;
use linkwright::cases::slider_crank;
use linkwright::sao::{Method, RelativeLimits, RunState};

fn main() -> Result<()> {
    let problem = slider_crank::path_generation(slider_crank::STAND_IN_START)?;
    let run = |initial: f64| -> Result<RunState> {
        let limits = RelativeLimits { initial, ..RelativeLimits::default() };
        Method { move_limits: Box::new(limits), ..Method::slp() }.solve(&problem, |_| ())
    };
    println!("{:>7} {:>6} {:>8} {:>8} {:>15} {:>10}", "initial", "cycles", "rejected", "analyses", "first E [%]", "F");
    let mut errors = vec![];
    for initial in [0.4, 0.3, 0.2, 0.1] {
        let state = run(initial)?;
        let first = &state.history[1];
        errors.push(first.objective_error_pct.max(first.constraint_error_pct));
        let rejected = state.history.iter().filter(|c| !c.accepted).count();
        let (analyses, f) = (state.counters.analyses, state.evaluation.objective);
        let percent = 100.0 * initial;
        println!(
            "{percent:>5} % {:>6} {rejected:>8} {analyses:>8} {:>15.2} {f:>10.6}",
            state.cycles(),
            errors[errors.len() - 1]
        );
        assert!(state.status.is_success() && (f - slider_crank::optimum().objective).abs() < 1e-5);
        assert!(initial > 0.35 || state.cycles() >= 8);
    }
    println!("paper: ten cycles and one rejected trial step from 40 %, eight cycles from 30 %");
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "smaller limits give smaller first errors");
    Ok(())
}
