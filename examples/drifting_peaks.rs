//! Constraints over time, four ways: one time point for each maximum, the paper's several, peaks between the time points that
//! keep their times, and peaks that drift with the design. V is what the final design violates at all times.

use linkwright::Result;
use linkwright::cases::four_bar::StressConstrained;
use linkwright::cases::{impact_absorber, nonlinear_absorber, vehicle_suspension};
use linkwright::problem::{Problem, Selection};
use linkwright::report::table::Table;
use linkwright::sao::{Method, Screening, State, Stop};

type Make = fn() -> Result<Problem>;

/// A method with so many time points before and after each maximum, or with peaks that drift or keep their times.
fn method(neighbours: usize, drifting: bool) -> Method {
    let screening = Screening { selection: Selection::NearMaxima(neighbours), ..Screening::default() };
    let stop = Stop { accuracy: 1e-6, max_cycles: 60, ..Stop::default() };
    Method { screening, drifting, stop, ..Method::default() }
}

/// How often the objective turned: where that goes on, the run oscillates.
fn turns(state: &State) -> usize {
    let accepted: Vec<f64> = state.history.iter().filter(|c| c.accepted).map(|c| c.objective).collect();
    let moved = |w: &[f64]| (w[1] - w[0]) * (w[2] - w[1]) < -1e-12 * w[0] * w[0];
    accepted.windows(3).filter(|w| moved(w)).count()
}

fn main() -> Result<()> {
    let columns = ["problem", "constraints", "end", "cycles", "analyses", "turns", "most rows", "F", "V at all times"];
    let mut table = Table::new("Linear approximations, stop at 1e-6, at most 60 cycles", columns);
    // The four-bar's analysis knows its time points alone: between them are polynomials through five of them.
    let problems: [(&str, Make); 5] = [
        ("absorber, peak", impact_absorber::peak_acceleration),
        ("absorber, comfort", impact_absorber::comfort),
        ("absorber, nonlinear", nonlinear_absorber::peak_acceleration),
        ("vehicle", vehicle_suspension::peak_acceleration),
        ("flexible four-bar", || StressConstrained::as_published().problem()),
    ];
    let mut drifting = vec![];
    for (name, build) in problems {
        let (on_grid, at_all_times) = (build()?, build()?.in_continuous_time());
        let ways = [
            ("one point each", &on_grid, method(0, true)),
            ("five points each", &on_grid, method(2, true)),
            ("peaks at their times", &at_all_times, method(0, false)),
            ("peaks that drift", &at_all_times, method(0, true)),
        ];
        for (way, problem, method) in ways {
            let end = method.solve(problem, |_| ())?;
            let everywhere = at_all_times.evaluate(&end.design, &at_all_times.analyze(&end.design)?)?;
            table.push([
                name.into(),
                way.into(),
                format!("{:?}", end.status).as_str().into(),
                end.cycles().into(),
                end.counters.analyses.into(),
                turns(&end).into(),
                end.history.iter().map(|c| c.retained.len()).max().unwrap_or(0).into(),
                end.evaluation.objective.into(),
                (everywhere.max_violation_pct() / 100.0).max(0.0).into(),
            ])?;
            drifting.extend((way == "peaks that drift").then_some(end));
        }
    }
    println!("{}", table.text());
    // One row for each peak, no endless oscillation, nothing between time points: on the impact absorber in five cycles.
    assert!(drifting[0].status.is_success() && drifting[0].cycles() <= 5 && turns(&drifting[0]) <= 2);
    assert!(drifting[1].status.is_success());
    Ok(())
}
