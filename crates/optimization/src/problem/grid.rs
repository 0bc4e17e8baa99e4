//! Time grids and the quadrature over them.

use error::{Error, Readable, Result};
use std::ops::Range;

/// Rounding error of a time point, relative to the largest one.
const ROUNDING: f64 = 1e-12;

/// The time points t₁ < … < t_nt at which transient responses are evaluated (equation 5).
///
/// "Time" may be any parameter of the motion: seconds, a crank angle, the number of a load case.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeGrid {
    /// Name of the parameter, for axes: "time", "crank rotation".
    pub name: String,
    /// Unit in which tables and axes show the points: "s", "mm".
    pub unit: String,
    /// Numbers by which one such unit is multiplied and divided for that of the points: 1 and 1000 if these are in m and
    /// shown in mm.
    pub unit_factors: [f64; 2],
    /// The points, strictly increasing.
    pub points: Vec<f64>,
}

impl TimeGrid {
    /// `count` equally spaced points from `from` to `to`, both included, in seconds.
    ///
    /// ```
    /// let grid = linkwright_optimization::problem::TimeGrid::uniform(0.0, 12.0, 101)?;
    /// assert_eq!(grid.points[1], 0.12);
    /// # Ok::<(), linkwright_optimization::Error>(())
    /// ```
    pub fn uniform(from: f64, to: f64, count: usize) -> Result<Self> {
        let last = count.saturating_sub(1).max(1) as f64;
        // The last point is `to` itself, even where the sum is rounded.
        let point = |p: usize| if p > 0 && p + 1 == count { to } else { from + (to - from) * (p as f64 / last) };
        Self::new("time", "s", (0..count).map(point).collect())
    }

    /// A grid of given points.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] for an empty grid and for points that do not increase.
    pub fn new(name: &str, unit: &str, points: Vec<f64>) -> Result<Self> {
        let grid = Self { name: name.to_owned(), unit: unit.to_owned(), unit_factors: [1.0; 2], points };
        grid.check()?;
        Ok(grid)
    }

    /// Points that are shown in another unit, with the given factors.
    ///
    /// ```
    /// use linkwright_optimization::problem::TimeGrid;
    /// let travel = TimeGrid::new("travel", "m", vec![-0.08, 0.0, 0.08])?.shown_in("mm", [1.0, 1e3]);
    /// assert_eq!(travel.shown_points(), [-80.0, 0.0, 80.0]);
    /// # Ok::<(), linkwright_optimization::Error>(())
    /// ```
    pub fn shown_in(self, unit: &str, unit_factors: [f64; 2]) -> Self {
        Self { unit: unit.to_owned(), unit_factors, ..self }
    }

    /// A value of the parameter as a number of the unit.
    pub fn shown(&self, t: f64) -> f64 {
        t * self.unit_factors[1] / self.unit_factors[0]
    }

    /// The points as numbers of the unit.
    pub fn shown_points(&self) -> Vec<f64> {
        self.points.iter().map(|&t| self.shown(t)).collect()
    }

    /// A point in words, as [`Self::in_words`].
    pub(super) fn point_in_words(&self, p: usize) -> String {
        self.in_words(self.points[p])
    }

    /// A time, in the unit of the points, in words, with as many digits as distinguish neighbouring points: `time 1.08 s`.
    pub fn in_words(&self, time: f64) -> String {
        self.in_words_beside(time, &[])
    }

    /// As [`Self::in_words`], with more digits if they are needed to distinguish the time from the `others`.
    pub fn in_words_beside(&self, time: f64, others: &[f64]) -> String {
        let (shown, time) = (self.shown_points(), self.shown(time));
        let steps = shown.windows(2).map(|pair| pair[1] - pair[0]);
        let distances = others.iter().map(|&other| (self.shown(other) - time).abs()).filter(|distance| *distance > 0.0);
        let step = steps.chain(distances).fold(f64::INFINITY, f64::min);
        // Hundredths of the smallest step; a single point is written in full.
        let decimals = (2.0 - step.log10()).ceil().clamp(0.0, 15.0) as usize;
        let rounded = if step.is_finite() { format!("{time:.decimals$}") } else { time.to_string() };
        let words = format!("{} {} {}", self.name, Readable(rounded.parse().unwrap_or(time)), self.unit);
        words.trim_end().to_owned()
    }

    /// Checks that the grid is not empty and the points increase.
    pub(super) fn check(&self) -> Result<()> {
        let Self { name, unit, unit_factors, points } = self;
        let what = || format!("time grid `{name}`");
        if !unit_factors.iter().all(|factor| *factor > 0.0 && factor.is_finite()) {
            return Err(Error::definition(
                what(),
                format!("its unit has the factors {unit_factors:?}"),
                "give positive ones",
            ));
        }
        if points.is_empty() {
            return Err(Error::definition(what(), "it has no time point", "give at least one point"));
        }
        if let Some(p) = (0..points.len()).find(|&p| !points[p].is_finite() || (p > 0 && points[p] <= points[p - 1])) {
            let why = format!("point {p} is {} {unit}, which does not increase", Readable(points[p]));
            return Err(Error::definition(what(), why, "give finite, strictly increasing points"));
        }
        Ok(())
    }

    /// Number of points.
    #[expect(clippy::len_without_is_empty, reason = "a grid is never empty")]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Numbers of the points between the times `from` and `to`, both included.
    ///
    /// A point that lies beyond one of them by a rounding error, up to 1e-12 of the largest time, is included: the eighth of nine
    /// points from −0.08 to 0.08 may differ from 0.06 in its last digit.
    ///
    /// ```
    /// use linkwright_optimization::problem::TimeGrid;
    /// assert_eq!(TimeGrid::uniform(0.0, 1.0, 11)?.points_between(0.3, 0.7), 3..8);
    /// # Ok::<(), linkwright_optimization::Error>(())
    /// ```
    pub fn points_between(&self, from: f64, to: f64) -> Range<usize> {
        let rounding = self.rounding();
        self.points.partition_point(|t| *t < from - rounding)..self.points.partition_point(|t| *t <= to + rounding)
    }

    /// The time `t`, moved to the nearest end if it is beyond it by a rounding error; `None` if it is outside.
    pub fn inside(&self, t: f64) -> Option<f64> {
        let ([first, last], rounding) = ([self.points[0], self.points[self.len() - 1]], self.rounding());
        (first - rounding..=last + rounding).contains(&t).then(|| t.clamp(first, last))
    }

    /// Rounding error of the points.
    fn rounding(&self) -> f64 {
        ROUNDING * self.points[0].abs().max(self.points[self.len() - 1].abs())
    }

    /// Length of the interval t_f − t₀.
    pub fn span(&self) -> f64 {
        self.points[self.len() - 1] - self.points[0]
    }

    /// Trapezoidal weights: ∫ f dt ≈ Σ wₚ f(tₚ), second order, any spacing.
    pub fn trapezoid(&self) -> Vec<f64> {
        let mut weights = vec![0.0; self.len()];
        for p in 1..self.len() {
            let half = 0.5 * (self.points[p] - self.points[p - 1]);
            weights[p - 1] += half;
            weights[p] += half;
        }
        weights
    }

    /// Composite Simpson weights: ∫ f dt ≈ Σ wₚ f(tₚ), fourth order for a smooth f.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] unless the points are equally spaced and odd in number.
    pub fn simpson(&self) -> Result<Vec<f64>> {
        let (last, step) = (self.len() - 1, self.span() / (self.len() - 1).max(1) as f64);
        let even = (0..=last).all(|p| (self.points[p] - self.points[0] - p as f64 * step).abs() <= 1e-9 * step);
        if last == 0 || last % 2 == 1 || !even {
            let why = format!("Simpson's rule needs an odd number of equally spaced points, here {}", self.len());
            let remedy = "use an odd number of equal steps, or the trapezoidal rule";
            return Err(Error::definition(format!("time grid `{}`", self.name), why, remedy));
        }
        let factor = |p| {
            if p == 0 || p == last {
                1.0
            } else if p % 2 == 1 {
                4.0
            } else {
                2.0
            }
        };
        Ok((0..=last).map(|p| factor(p) * step / 3.0).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_grid_ends_at_its_end() {
        assert_eq!(TimeGrid::uniform(-0.07, 0.08, 31).unwrap().points[30], 0.08);
        assert_eq!(TimeGrid::uniform(0.5, 2.0, 1).unwrap().points, [0.5]);
    }

    /// The end of the seventh of eight intervals and 6 · 0.01 differ by rounding.
    #[test]
    fn points_at_the_ends_of_an_interval_are_in_it() {
        let travel = TimeGrid::uniform(-0.08, 0.08, 9).unwrap();
        assert!(travel.points[7] > 6.0 * 0.01 && travel.points_between(-4.0 * 0.01, 6.0 * 0.01) == (2..8));
        let time = TimeGrid::uniform(0.0, 1.0, 11).unwrap();
        assert_eq!(time.points_between(0.0, 0.1 + 0.2), 0..4);
        assert_eq!(time.points_between(0.31, 0.39), 4..4);
        assert_eq!([0.1 + 0.2, 1.0 + 1e-15, 1.1].map(|t| time.inside(t)), [Some(0.1 + 0.2), Some(1.0), None]);
    }

    #[test]
    fn simpson_is_exact_for_cubics_and_the_trapezoid_for_lines() {
        let grid = TimeGrid::uniform(1.0, 3.0, 7).unwrap();
        let integrate = |weights: Vec<f64>, f: fn(f64) -> f64| -> f64 {
            weights.iter().zip(&grid.points).map(|(w, &t)| w * f(t)).sum()
        };
        assert!((integrate(grid.simpson().unwrap(), |t| t.powi(3)) - 20.0).abs() < 1e-12);
        assert!((integrate(grid.trapezoid(), |t| 2.0 * t) - 8.0).abs() < 1e-12);
    }

    #[test]
    fn empty_and_decreasing_grids_are_rejected() {
        for (points, word) in [(vec![], "no time point"), (vec![0.0, 0.0], "increase"), (vec![0.0, f64::NAN], "NaN")] {
            let message = TimeGrid::new("time", "s", points).unwrap_err().to_string();
            assert!(message.contains(word), "{message}");
        }
        assert!(TimeGrid::uniform(0.0, 1.0, 4).unwrap().simpson().unwrap_err().to_string().contains("odd"));
        assert!(TimeGrid::uniform(0.0, 1.0, 1).unwrap().simpson().is_err());
    }
}
