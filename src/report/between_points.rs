//! Quantities that are larger between their time points than at them.

use super::number::{readable, with_unit};
use super::outcome::{is_of_peak, limit, name, unit, values};
use crate::problem::{Problem, Side};
use crate::sao::RunState;

/// Excess between the time points over the value at them, relative to the size of the quantity, from which on it is told.
const NOTICEABLE: f64 = 0.01;

/// Digits of estimates.
const DIGITS: usize = 3;

/// Warnings about limits, and a peak as objective, that are met at the time points only: the parabola through a local maximum and the points beside
/// it exceeds them in between by more than 1 % of the largest value. An optimizer finds designs whose peaks are between the points.
pub fn warn_of_peaks_between_points(problem: &Problem, state: &RunState) -> Vec<String> {
    let of_constraint = |j| Excess::of(problem, state, j).map(|excess| excess.in_words(problem, j));
    let (of_peak, stated): (Vec<usize>, Vec<usize>) =
        (0..problem.constraints.len()).partition(|&j| is_of_peak(problem, j));
    let largest = of_peak.iter().filter_map(|&j| Some((j, Excess::of(problem, state, j)?)));
    let objective = largest.reduce(|a, b| if b.1.beyond > a.1.beyond { b } else { a });
    let objective = objective.map(|(j, excess)| excess.of_objective_in_words(problem, j));
    objective.into_iter().chain(stated.into_iter().filter_map(of_constraint)).collect()
}

/// A value between two time points that is beyond the limit.
struct Excess {
    /// The time, as shown.
    time: String,
    value: f64,
    limit: f64,
    /// Excess over the limit, relative to the size of the quantity.
    beyond: f64,
}

impl Excess {
    /// The largest excess of constraint `j`; `None` if it is not noticeable, or if the constraint holds in continuous time.
    fn of(problem: &Problem, state: &RunState, j: usize) -> Option<Self> {
        let constraint = &problem.constraints[j];
        let grid = &problem.grids[constraint.quantity.grid().filter(|_| constraint.quantity.is_transient())?];
        if constraint.is_continuous || constraint.side == Side::Equal {
            return None;
        }
        let values = values(problem, j, &state.design, &state.evaluation);
        let (sign, limit) = (constraint.sign(), limit(problem, j, &state.design));
        let size = values.iter().flatten().fold(limit.abs(), |size, value| size.max(value.abs()));
        let peaks = (1..values.len().saturating_sub(1)).filter_map(|p| {
            let [before, here, after] = [p - 1, p, p + 1].map(|p| values[p].map(|value| sign * value));
            let [before, here, after] = [before?, here?, after?];
            let is_met = here - sign * limit <= NOTICEABLE * size;
            let (time, peak) = vertex([grid.points[p - 1], grid.points[p], grid.points[p + 1]], [before, here, after])?;
            (is_met && here >= before && here >= after).then_some((time, peak))
        });
        let (time, peak) = peaks.reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        let beyond = (peak - sign * limit) / size;
        (beyond > NOTICEABLE).then(|| Self { time: grid.in_words(time), value: sign * peak, limit, beyond })
    }

    fn in_words(&self, problem: &Problem, j: usize) -> String {
        let unit = unit(problem, j);
        let [value, limit] = [self.value, self.limit].map(|value| with_unit(value, unit, DIGITS));
        format!(
            "{}: about {value} between the time points, near {}, where the limit is {limit}: it holds at the time points only; take more of \
             them, or `continuous = true` in this constraint",
            name(problem, j),
            self.time
        )
    }

    fn of_objective_in_words(&self, problem: &Problem, j: usize) -> String {
        format!(
            "{}: about {} between the time points, near {}, {} % more than at them: the optimum is that of the time points; take more of them, or \
             `continuous = true` in the objective",
            problem.objective.name,
            with_unit(self.value.abs(), unit(problem, j), DIGITS),
            self.time,
            readable(100.0 * self.beyond, 2)
        )
    }
}

/// Place and value of the maximum of the parabola through three points; `None` if it has none between the first and the last.
fn vertex(t: [f64; 3], f: [f64; 3]) -> Option<(f64, f64)> {
    let slopes = [(f[1] - f[0]) / (t[1] - t[0]), (f[2] - f[1]) / (t[2] - t[1])];
    let curvature = (slopes[1] - slopes[0]) / (t[2] - t[0]);
    let slope = (slopes[0] * (t[2] - t[1]) + slopes[1] * (t[1] - t[0])) / (t[2] - t[0]);
    let shift = -slope / (2.0 * curvature);
    let is_inside = curvature < 0.0 && t[1] + shift >= t[0] && t[1] + shift <= t[2];
    is_inside.then(|| (t[1] + shift, f[1] + 0.5 * slope * shift))
}

#[cfg(test)]
mod tests {
    use super::vertex;

    #[test]
    fn the_vertex_of_a_parabola_is_exact() {
        let f = |t: f64| 3.0 - 2.0 * (t - 0.4).powi(2);
        let (at, value) = vertex([0.0, 0.3, 1.0], [0.0, 0.3, 1.0].map(f)).unwrap();
        assert!((at - 0.4).abs() < 1e-14 && (value - 3.0).abs() < 1e-14, "{at} {value}");
        assert_eq!(vertex([0.0, 1.0, 2.0], [0.0, 1.0, 4.0]), None);
    }
}
