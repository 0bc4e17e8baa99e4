//! Compares five formulations of the constraint g(b, t) ≤ c for all t; time points near maxima need few rows and few cycles:
//! `cargo run --example equivalent_constraints`.
//!
//! The formulations are the full grid (5), the integral equivalent (6), an envelope as an instance of (7), critical time points
//! alone (8), and time points near maxima (Section 4 of Etman, van Campen & Schoofs, 1998). They are applied to the displacement
//! limits of the impact absorber with the comfort criterion. The gradient of the integral is zero wherever no limit is
//! exceeded, so its linearization does not constrain the step there.

use linkwright::Result;
use linkwright::cases::impact_absorber::{DISPLACEMENT, comfort, comfort_optimum};
use linkwright::function;
use linkwright::problem::{Constraint, Envelope, Intermediates, MeanExcess, Problem, Quantity, Selection};
use linkwright::sao::{Method, RunState, Screening};

/// |y| ≤ 1 m as one number for the whole history, linearized directly.
fn whole(quantity: impl Fn(f64, Vec<f64>) -> Quantity) -> Result<Problem> {
    let mut problem = comfort()?;
    let weights = problem.grids[0].trapezoid();
    for (sign, constraint) in [1.0, -1.0].into_iter().zip(&mut problem.constraints) {
        let quantity = quantity(sign, weights.clone()).of(&[DISPLACEMENT]).directly(Intermediates::Identity);
        *constraint = Constraint::at_most(constraint.name.clone(), 1.0, quantity);
    }
    Ok(problem)
}

fn envelope(sharpness: f64) -> Result<Problem> {
    whole(move |sign, _| {
        Quantity::whole(0, Envelope { function: function!([sign: f64 = sign] |p| p.response[0] * sign), sharpness })
    })
}

fn main() -> Result<()> {
    let integral = whole(|sign, weights| {
        let function = function!([sign: f64 = sign] |p| p.response[0] * sign);
        Quantity::whole(0, MeanExcess { weights, function, limit: 1.0 })
    })?;
    let cases = [
        ("full grid (5)", comfort()?, Selection::All),
        ("integral (6)", integral, Selection::All),
        ("envelope (7), sharpness 50", envelope(50.0)?, Selection::All),
        ("envelope (7), sharpness 500", envelope(500.0)?, Selection::All),
        ("critical time points (8)", comfort()?, Selection::NearMaxima(0)),
        ("two neighbours of maxima", comfort()?, Selection::NearMaxima(2)),
    ];
    println!(
        "{:<28} {:>6} {:>6} {:>5} {:>10} {:>12}  {:<10}",
        "constraint", "cycles", "trials", "rows", "F", "excess [m]", "status"
    );
    let mut ends = vec![];
    for (name, problem, selection) in cases {
        let screening = Screening { selection, ..Screening::default() };
        let state: RunState = Method { screening, ..Method::slp() }.solve(&problem, |_| ())?;
        let rows = state.history.iter().map(|c| c.retained.len()).max().unwrap_or(0);
        // The excess on the grid, independent of the formulation.
        let excess = comfort()?.evaluate(&state.design, &state.responses)?.max_violation_pct() / 100.0;
        let (trials, f, status) = (state.history.len() - 1, state.evaluation.objective, state.status);
        println!("{name:<28} {:>6} {trials:>6} {rows:>5} {f:>10.7} {excess:>12.2e}  {status:?}", state.cycles());
        ends.push((state.cycles(), rows, f, excess));
    }
    let [grid, integral, soft, sharp, critical, near] = ends[..] else { unreachable!("there are six cases") };
    let best = comfort_optimum().objective;
    let close = |f: f64| (f / best - 1.0).abs() < 1e-5;
    assert!([grid, near].iter().all(|end| end.0 <= 8 && close(end.2)), "no more than the paper's eight cycles");
    assert!(near.1 < grid.1, "time points near maxima need fewer rows");
    assert!(
        soft.2 > sharp.2 && sharp.2 > best && soft.3 < 0.0,
        "an envelope is conservative, more so with lower sharpness"
    );
    assert!(
        integral.0 > 2 * near.0 && integral.3 > 0.0,
        "the linearized integral takes more cycles and ends infeasible"
    );
    assert!(critical.0 > near.0, "with single time points the run oscillates");
    Ok(())
}
