//! Shows that one or two neighbouring time points on each side of a maximum suffice, and that without them the run oscillates:
//! `cargo run --example neighbours`.
//!
//! The paper retains two time points before and two after each local maximum. With none, the maximum alternates between
//! neighbouring time points from cycle to cycle. More than two only make the subproblem larger.

use linkwright::Result;
use linkwright::cases::impact_absorber;
use linkwright::problem::Selection;
use linkwright::sao::{Method, RunState, Screening};

fn main() -> Result<()> {
    let problem = impact_absorber::peak_acceleration()?;
    let run = |neighbours| -> Result<RunState> {
        let screening = Screening { selection: Selection::NearMaxima(neighbours), ..Screening::default() };
        Method { screening, ..Method::slp() }.solve(&problem, |_| ())
    };
    let states = (0..=3).map(run).collect::<Result<Vec<RunState>>>()?;
    let most = |s: &RunState| s.history.iter().map(|c| c.retained.len()).max().unwrap_or(0);
    println!(
        "{:>10} {:>6} {:>8} {:>13} {:>12} {:>10}",
        "neighbours", "cycles", "analyses", "sensitivities", "most points", "F"
    );
    for (neighbours, s) in states.iter().enumerate() {
        let (work, f) = (s.counters, s.evaluation.objective);
        let [analyses, sensitivities] = [work.analyses, work.sensitivity_analyses];
        println!("{neighbours:>10} {:>6} {analyses:>8} {sensitivities:>13} {:>12} {f:>10.7}", s.cycles(), most(s));
    }
    let optimum = impact_absorber::peak_acceleration_optimum().objective;
    assert!(states.iter().all(|s| s.status.is_success() && (s.evaluation.objective - optimum).abs() < 1e-5));
    assert_eq!([1, 2, 3].map(|k| states[k].cycles()), [5, 5, 6]);
    assert!(states[0].cycles() > 2 * states[2].cycles(), "with one time point for each maximum the run oscillates");
    assert!(most(&states[2]) <= 14, "the paper includes at most 14 time points");
    Ok(())
}
