//! Compares four treatments of constraints over time; moving peaks need one row each and hardly violate limits between time
//! points: `cargo run --release --example drifting_peaks`.
//!
//! The treatments are one time point for each maximum, several time points as in the paper, peaks between the time points at fixed
//! times, and peaks that move with the design. V is the violation of the final design at all times.

use linkwright::Result;
use linkwright::cases::four_bar::StressConstrained;
use linkwright::cases::{impact_absorber, nonlinear_absorber, vehicle_suspension};
use linkwright::problem::{Problem, Selection};
use linkwright::report::table::Table;
use linkwright::sao::{Method, RunState, Screening, Stop};

type Make = fn() -> Result<Problem>;

/// A method with some time points before and after each maximum, or with peaks that move or have fixed times.
fn method(neighbours: usize, moving_peaks: bool) -> Method {
    let screening = Screening { selection: Selection::NearMaxima(neighbours), ..Screening::default() };
    let stop = Stop { accuracy: 1e-6, max_cycles: 60, ..Stop::default() };
    Method { screening, moving_peaks, stop, ..Method::slp() }
}

/// Number of sign changes of the objective's change; many of them mean oscillation.
fn sign_changes(state: &RunState) -> usize {
    let accepted: Vec<f64> = state.history.iter().filter(|c| c.accepted).map(|c| c.objective).collect();
    let moved = |w: &[f64]| (w[1] - w[0]) * (w[2] - w[1]) < -1e-12 * w[0] * w[0];
    accepted.windows(3).filter(|w| moved(w)).count()
}

fn main() -> Result<()> {
    let columns =
        ["problem", "constraints", "end", "cycles", "analyses", "sign changes", "most rows", "F", "V at all times"];
    let mut table = Table::new("Linear approximations, stop at 1e-6, at most 60 cycles", columns);
    // The four-bar's analysis returns values at time points only; polynomials through five points interpolate them.
    let problems: [(&str, Make); 5] = [
        ("absorber, peak", impact_absorber::peak_acceleration),
        ("absorber, comfort", impact_absorber::comfort),
        ("absorber, nonlinear", nonlinear_absorber::peak_acceleration),
        ("vehicle", vehicle_suspension::peak_acceleration),
        ("flexible four-bar", || StressConstrained::as_published().problem()),
    ];
    let mut moving = vec![];
    for (name, build) in problems {
        let (on_grid, at_all_times) = (build()?, build()?.in_continuous_time());
        let ways = [
            ("one point each", &on_grid, method(0, true)),
            ("five points each", &on_grid, method(2, true)),
            ("peaks at fixed times", &at_all_times, method(0, false)),
            ("moving peaks", &at_all_times, method(0, true)),
        ];
        for (way, problem, method) in ways {
            let end = method.solve(problem, |_| ())?;
            let everywhere = at_all_times.evaluate(&end.design, &at_all_times.analyze(&end.design)?)?;
            table.push([
                name.into(),
                way.into(),
                end.status.to_string().as_str().into(),
                end.cycles().into(),
                end.counters.analyses.into(),
                sign_changes(&end).into(),
                end.history.iter().map(|c| c.retained.len()).max().unwrap_or(0).into(),
                end.evaluation.objective.into(),
                (everywhere.max_violation_pct() / 100.0).max(0.0).into(),
            ])?;
            moving.extend((way == "moving peaks").then_some(end));
        }
    }
    println!("{}", table.text());
    // One row for each peak without lasting oscillation: five cycles on the impact absorber.
    assert!(moving[0].status.is_success() && moving[0].cycles() <= 5 && sign_changes(&moving[0]) <= 2);
    assert!(moving[1].status.is_success());
    Ok(())
}
