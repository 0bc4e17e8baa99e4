//! Shows that the optimum does not depend on the cut-off of the screening, but the size of the subproblem does:
//! `cargo run --example cutoffs`.
//!
//! Screening omits constraints below a fraction of their limit, the cut-off. The paper uses 70 %, and 50 % for the four-bar
//! mechanism. A higher cut-off retains fewer constraints. If it is too high, a step may violate an omitted constraint.

use linkwright::Result;
use linkwright::cases::impact_absorber;
use linkwright::problem::{Problem, Selection};
use linkwright::sao::{Method, RunState, Screening};

fn run(problem: &Problem, screening: Screening) -> Result<RunState> {
    Method { screening, ..Method::slp() }.solve(problem, |_| ())
}

fn main() -> Result<()> {
    let problems = [impact_absorber::peak_acceleration()?, impact_absorber::comfort()?];
    let optima = [impact_absorber::peak_acceleration_optimum(), impact_absorber::comfort_optimum()];
    println!("{:<14} {:^30}   {:^30}", "", "peak acceleration", "comfort criterion");
    let head = format!("{:>6} {:>8} {:>14}", "cycles", "analyses", "most points");
    println!("{:<14} {head}   {head}", "cut-off");
    let near = Selection::NearMaxima(2);
    let cut = |c: f64| (format!("{:.0} %", 100.0 * c), Screening { selection: near, ..Screening::above(c) });
    let mut rows: Vec<_> = [0.5, 0.6, 0.7, 0.8, 0.9, 0.95].map(cut).into();
    rows.push(("none".to_owned(), Screening { selection: near, ..Screening::all() }));
    rows.push(("none, all".to_owned(), Screening::all()));
    for (name, screening) in rows {
        print!("{name:<14}");
        for (problem, optimum) in problems.iter().zip(&optima) {
            let state = run(problem, screening)?;
            let most = state.history.iter().map(|c| c.retained.len()).max().unwrap_or(0);
            print!(" {:>6} {:>8} {most:>14}  ", state.cycles(), state.counters.analyses);
            let error = (state.evaluation.objective / optimum.objective - 1.0).abs();
            assert!(state.status.is_success() && error < 2e-5, "{name}: {error:e} from the optimum");
            assert!(most < 40 || screening.cutoff.is_none(), "the cut-off removes most of the 202 or 404 rows");
        }
        println!();
    }
    Ok(())
}
