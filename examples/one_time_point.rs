//! Shows that one time point for each maximum is not enough: the design oscillates. `cargo run --example one_time_point`.
//!
//! Etman, van Campen & Schoofs (1998), Section 6.1, repeat Table I with a single time point constraint for each local maximum.
//! The run takes 18 cycles instead of five, a move limit is always active, and the design oscillates. The reason is that the
//! maxima of the acceleration shift in time with the design. At the optimum two neighbouring time points have the same value,
//! but only one of them is retained, so the other one increases in each cycle. Only smaller move limits end the oscillation.

use linkwright::Result;
use linkwright::cases::impact_absorber;
use linkwright::problem::Selection;
use linkwright::sao::{Cycle, Method, RunState, Screening};

fn run(neighbours: usize) -> Result<RunState> {
    let screening = Screening { selection: Selection::NearMaxima(neighbours), ..Screening::as_published() };
    // The paper's stop test. With the optimality conditions as a further condition the run takes 37 cycles.
    Method { screening, ..Method::as_published() }.solve(&impact_absorber::peak_acceleration()?, |_| ())
}

/// The steps of one variable over the accepted cycles.
fn steps(state: &RunState, variable: usize) -> Vec<f64> {
    let accepted: Vec<&Cycle> = state.history.iter().filter(|c| c.accepted).collect();
    accepted.windows(2).map(|pair| pair[1].design[variable] - pair[0].design[variable]).collect()
}

/// Number of sign changes between consecutive steps.
fn sign_changes(state: &RunState, variable: usize) -> usize {
    steps(state, variable).windows(2).filter(|pair| pair[0] * pair[1] < 0.0).count()
}

fn main() -> Result<()> {
    let (alone, neighbours) = (run(0)?, run(2)?);
    println!("{:>5} {:>9} {:>9} {:>8} {:>6} {:>13}", "cycle", "step k", "step c", "V [%]", "limits", "time points");
    let accepted = alone.history.iter().filter(|c| c.accepted).skip(1);
    for ((cycle, k), c) in accepted.zip(steps(&alone, 0)).zip(steps(&alone, 1)) {
        let Cycle { violation_pct, active_limits, retained, .. } = cycle;
        println!("{:>5} {k:>9.5} {c:>9.5} {violation_pct:>8.4} {active_limits:>6} {:>13}", cycle.cycle, retained.len());
    }
    println!("\n{:<26} {:>6} {:>12} {:>12}", "", "cycles", "sign changes", "F [m/s²]");
    for (name, state) in [("one time point (paper: 18)", &alone), ("two neighbours (paper: 5)", &neighbours)] {
        println!(
            "{name:<26} {:>6} {:>12} {:>12.6}",
            state.cycles(),
            sign_changes(state, 0),
            state.evaluation.objective
        );
    }
    assert_eq!(neighbours.cycles(), 5);
    assert!((14..=22).contains(&alone.cycles()), "{} cycles", alone.cycles());
    assert!(sign_changes(&alone, 0) >= 5, "the design oscillates");
    assert!(alone.history[1..].iter().filter(|c| c.active_limits == 0).count() <= 1, "a move limit is always active");
    assert!((alone.evaluation.objective - neighbours.evaluation.objective).abs() < 1e-5);
    Ok(())
}
