//! Profiles of methods over many problems: performance profiles and data profiles.

use super::benchmark::line;
use crate::report::figure::{Figure, Legend, Mark, Panel, PlotAxis, QuantityLabel, check};
use crate::{Error, Result};

/// A method and its costs on all problems.
#[derive(Clone, Debug)]
pub struct Solver<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// Positive costs, one for each problem in the order that all methods share; infinite where the method failed.
    pub costs: &'a [f64],
}

/// Draws for each method the fraction of problems that it solves at no more than `τ` times the least cost:
///
/// $$ \rho_s(\tau) = \frac1{n_p} \left|\left\{ p : c_{ps} \le \tau \min_{s'} c_{ps'} \right\}\right| $$
///
/// ρ_s at the left end (τ = 1) is the fraction of problems on which method s has the least cost; at the right end it is the
/// fraction that the method solves. n_p is the number of problems, c_ps the cost of method s on problem p. `cost` is the label
/// of the axis.
///
/// # Errors
/// [`Error::Definition`] without methods or problems, [`Error::Length`] for costs of different lengths, [`Error::Option`] for a
/// cost that is not positive.
///
/// # Sources
/// E. D. Dolan and J. J. Moré, *Math. Program.* 91 (2002) 201–213.
pub fn performance_profile(cost: &str, solvers: &[Solver]) -> Result<Figure> {
    check_costs(solvers)?;
    let ratios = ratios(solvers);
    let largest = ratios.iter().flatten().copied().filter(|r| r.is_finite()).fold(1.0, f64::max);
    let end = (largest * 1.15).max(2.0);
    let x = PlotAxis::of(&QuantityLabel::new(format!("{cost}, relative to the best *τ*"), ""))
        .logarithmic()
        .limits(1.0, end);
    let mut panel =
        Panel::new(x, PlotAxis::new("fraction of problems *ρ*(*τ*)", "").limits(0.0, 1.04)).legend(Legend::Below);
    for (k, (solver, ratios)) in solvers.iter().zip(&ratios).enumerate() {
        panel.add(Mark::steps(&steps(ratios, [1.0, end]), line(k, 1.1)).named(solver.name));
    }
    Ok(Figure::new("Performance profile", 85.0, 72.0).with(panel))
}

/// Draws for each method the fraction of problems that it solves at a cost of at most κ:
///
/// $$ d_s(\kappa) = \frac1{n_p} \left|\left\{ p : c_{ps} \le \kappa \right\}\right| $$
///
/// Unlike a performance profile, the line of a method does not depend on the other methods. With derivatives an analysis has the same
/// cost for any number of variables, so κ is not divided by n + 1.
///
/// # Errors
/// As [`performance_profile`].
///
/// # Sources
/// J. J. Moré and S. M. Wild, *SIAM J. Optim.* 20 (2009) 172–191.
pub fn data_profile(cost: &str, solvers: &[Solver]) -> Result<Figure> {
    check_costs(solvers)?;
    let finite = || solvers.iter().flat_map(|s| s.costs).copied().filter(|c| c.is_finite());
    let (start, end) = (finite().fold(f64::INFINITY, f64::min).min(1e300), finite().fold(0.0, f64::max));
    let (start, end) = if end > 0.0 { (start, (end * 1.15).max(2.0 * start)) } else { (1.0, 10.0) };
    let x = PlotAxis::of(&QuantityLabel::new(format!("{cost} *κ*"), "")).logarithmic().limits(start, end);
    let y = PlotAxis::new("fraction of problems *d*(*κ*)", "").limits(0.0, 1.04);
    let mut panel = Panel::new(x, y).legend(Legend::Below);
    for (k, solver) in solvers.iter().enumerate() {
        panel.add(Mark::steps(&steps(solver.costs, [start, end]), line(k, 1.1)).named(solver.name));
    }
    Ok(Figure::new("Data profile", 85.0, 72.0).with(panel))
}

fn check_costs(solvers: &[Solver]) -> Result<()> {
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
    Ok(())
}

/// Cost over the least cost of the problem; infinite where the method failed.
fn ratios(solvers: &[Solver]) -> Vec<Vec<f64>> {
    let least = |p: usize| solvers.iter().map(|s| s.costs[p]).fold(f64::INFINITY, f64::min);
    let ratio = |cost: f64, least: f64| if cost.is_finite() { cost / least } else { f64::INFINITY };
    solvers.iter().map(|s| s.costs.iter().enumerate().map(|(p, &cost)| ratio(cost, least(p))).collect()).collect()
}

/// The corners of the fraction of costs up to a limit, from `start` to `end`.
fn steps(costs: &[f64], [start, end]: [f64; 2]) -> Vec<[f64; 2]> {
    let fraction = |limit: f64| costs.iter().filter(|&&c| c <= limit).count() as f64 / costs.len() as f64;
    let mut limits: Vec<f64> = costs.iter().copied().filter(|c| c.is_finite()).chain([start, end]).collect();
    limits.sort_by(f64::total_cmp);
    limits.into_iter().map(|limit| [limit, fraction(limit)]).collect()
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
        let first = steps(&ratios[0], [1.0, 5.0]);
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

    #[test]
    fn the_data_profile_counts_problems_up_to_a_cost() {
        let solvers = [
            Solver { name: "first", costs: &[10.0, 20.0, 20.0, f64::INFINITY] },
            Solver { name: "none", costs: &[f64::INFINITY; 4] },
        ];
        let corners = steps(solvers[0].costs, [10.0, 23.0]);
        assert_eq!((corners[0], corners[3], *corners.last().unwrap()), ([10.0, 0.25], [20.0, 0.75], [23.0, 0.75]));
        let svg = data_profile("analyses", &solvers).unwrap().svg().unwrap();
        assert!(svg.contains("first") && svg.contains("none"));
        assert!(data_profile("analyses", &solvers[1..]).is_ok());
        assert!(data_profile("analyses", &[]).is_err());
    }
}
