//! Comparison of methods: distance from a known optimum over the work, and performance profiles.

use crate::report::figure::{Axis, Colour, Dash, Figure, Legend, Mark, Panel, QuantityLabel, Stroke, check};
use crate::{Error, Result};

/// Smallest distance from the optimum that is drawn.
const FLOOR: f64 = 1e-10;

/// A method and the distances of its designs from the optimum.
#[derive(Clone, Debug)]
pub struct Approach<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// For each accepted design: work up to it, and its relative distance from the optimum.
    pub designs: &'a [[f64; 2]],
}

/// Draws the distance from the optimum over the work for each method; `work` is the label of the axis.
///
/// Distances are positive and may be infinite. NaN is omitted, and distances below 1e-10 are drawn at 1e-10.
///
/// # Errors
/// [`Error::Definition`] if there are no methods.
pub fn approach(work: &str, methods: &[Approach]) -> Result<Figure> {
    check::not_empty("methods", methods.len())?;
    let distance = Axis::new("distance from the optimum", "").logarithmic().limits(FLOOR, 10.0);
    let mut panel = Panel::new(Axis::new(work, "").logarithmic(), distance).legend(Legend::Below);
    for (k, method) in methods.iter().enumerate() {
        let points = method.designs.iter().filter(|d| !d[1].is_nan()).map(|d| [d[0], d[1].clamp(FLOOR, 10.0)]);
        panel.add(Mark::curve(points.collect::<Vec<_>>(), line(k, 0.9)).named(method.name));
    }
    Ok(Figure::new("Distance from the optimum over the work", 120.0, 100.0).with(panel))
}

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
    let x =
        Axis::of(&QuantityLabel::new(format!("{cost}, relative to the best *τ*"), "")).logarithmic().limits(1.0, end);
    let mut panel =
        Panel::new(x, Axis::new("fraction of problems *ρ*(*τ*)", "").limits(0.0, 1.04)).legend(Legend::Below);
    for (k, (solver, ratios)) in solvers.iter().zip(&ratios).enumerate() {
        panel.add(Mark::steps(&steps(ratios, end), line(k, 1.1)).named(solver.name));
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
    let fraction = |tau: f64| ratios.iter().filter(|&&r| r <= tau).count() as f64 / ratios.len() as f64;
    let mut taus: Vec<f64> = ratios.iter().copied().filter(|r| r.is_finite()).chain([1.0, end]).collect();
    taus.sort_by(f64::total_cmp);
    taus.into_iter().map(|tau| [tau, fraction(tau)]).collect()
}

/// Line of the `k`-th method: seven colours, then other dashes.
fn line(k: usize, width: f64) -> Stroke {
    let dash = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted][k / 7 % 4];
    Stroke::solid(Colour::of_series(k), width).dash(dash)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_line() {
        let methods = [
            Approach { name: "first", designs: &[[1.0, 0.5], [3.0, 1e-14]] },
            Approach { name: "second", designs: &[[1.0, f64::NAN]] },
        ];
        let svg = approach("analyses", &methods).unwrap().svg().unwrap();
        assert!(svg.contains("first") && svg.contains("second") && !svg.contains("NaN"));
        assert!(approach("analyses", &[]).is_err());
    }

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
