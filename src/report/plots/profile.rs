//! Performance profiles: how often a method is how close to the best one.

use crate::report::figure::{Axis, Colour, Dash, Figure, Legend, Mark, Panel, Quantity, Stroke, check};
use crate::{Error, Result};

/// A method and what it cost on each problem.
#[derive(Clone, Debug)]
pub struct Solver<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// Positive costs, the same problems for every method; infinite where the method failed.
    pub costs: &'a [f64],
}

/// Draws for each method the fraction of problems that it solves at no more than `τ` times the least cost:
///
/// $$ \rho_s(\tau) = \frac1{n_p} \left|\left\{ p : c_{ps} \le \tau \min_{s'} c_{ps'} \right\}\right| $$
///
/// The height at the left end is how often it is the best, the height at the right end how often it succeeds.
/// `cost` names what was counted. **Source.** E. D. Dolan and J. J. Moré, *Math. Program.* 91 (2002) 201–213.
///
/// **Errors.** No methods or problems, lengths that differ, a cost that is not positive.
pub fn performance_profile(cost: &str, solvers: &[Solver]) -> Result<Figure> {
    check::not_empty("methods", solvers.len())?;
    let problems = solvers[0].costs.len();
    check::not_empty("problems", problems)?;
    for solver in solvers {
        Error::check_length(solver.name, problems, solver.costs.len())?;
        for &cost in solver.costs {
            Error::check_option(
                &format!("cost of {}", solver.name),
                "positive, or infinite for a failure",
                cost,
                cost > 0.0,
            )?;
        }
    }
    let ratios = ratios(solvers);
    let largest = ratios.iter().flatten().copied().filter(|r| r.is_finite()).fold(1.0, f64::max);
    let end = (largest * 1.15).max(2.0);
    let x = Axis::of(&Quantity::new(format!("{cost}, relative to the best *τ*"), "")).logarithmic().limits(1.0, end);
    let mut panel =
        Panel::new(x, Axis::new("part of the problems *ρ*(*τ*)", "").limits(0.0, 1.04)).legend(Legend::Below);
    for (k, (solver, ratios)) in solvers.iter().zip(&ratios).enumerate() {
        let dash = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted][k / 7 % 4];
        let stroke = Stroke::solid(Colour::of_series(k), 1.1).dash(dash);
        panel.add(Mark::steps(&steps(ratios, end), stroke).named(solver.name));
    }
    Ok(Figure::new("Performance profile", 85.0, 72.0).with(panel))
}

/// Cost over the least cost of the problem; infinite where the method failed.
fn ratios(solvers: &[Solver]) -> Vec<Vec<f64>> {
    let least = |p: usize| solvers.iter().map(|s| s.costs[p]).fold(f64::INFINITY, f64::min);
    let ratio = |cost: f64, least: f64| if cost.is_finite() { cost / least } else { f64::INFINITY };
    solvers.iter().map(|s| s.costs.iter().enumerate().map(|(p, &cost)| ratio(cost, least(p))).collect()).collect()
}

/// The corners of `ρ(τ)` from 1 to `end`.
fn steps(ratios: &[f64], end: f64) -> Vec<[f64; 2]> {
    let part = |tau: f64| ratios.iter().filter(|&&r| r <= tau).count() as f64 / ratios.len() as f64;
    let mut taus: Vec<f64> = ratios.iter().copied().filter(|r| r.is_finite()).chain([1.0, end]).collect();
    taus.sort_by(f64::total_cmp);
    taus.into_iter().map(|tau| [tau, part(tau)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_counts_wins_and_successes() {
        let solvers = [
            Solver { name: "first", costs: &[1.0, 2.0, 8.0, f64::INFINITY] },
            Solver { name: "second", costs: &[2.0, 2.0, 2.0, f64::INFINITY] },
        ];
        let ratios = ratios(&solvers);
        assert_eq!(ratios[0], [1.0, 1.0, 4.0, f64::INFINITY]);
        assert_eq!(ratios[1], [2.0, 1.0, 1.0, f64::INFINITY]);
        let first = steps(&ratios[0], 5.0);
        assert_eq!((first[0], *first.last().unwrap()), ([1.0, 0.5], [5.0, 0.75]));
        assert!(performance_profile("analyses", &solvers).unwrap().svg().unwrap().contains("second"));
    }

    #[test]
    fn bad_costs_are_refused() {
        for costs in [&[0.0][..], &[f64::NAN], &[-1.0], &[]] {
            assert!(performance_profile("analyses", &[Solver { name: "bad", costs }]).is_err());
        }
        assert!(performance_profile("analyses", &[]).is_err());
        let uneven = [Solver { name: "a", costs: &[1.0] }, Solver { name: "b", costs: &[1.0, 2.0] }];
        assert!(performance_profile("analyses", &uneven).is_err());
    }
}
