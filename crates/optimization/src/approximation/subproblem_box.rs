//! The box of a cycle, the designs before it, and options of the approximate problem.

use super::{Asymptotes, DesignHistory};
use crate::problem::Problem;
use error::{Error, Readable, Result};
use nlp::LowRank;

/// The box in which the approximate problem is solved, and the designs accepted so far.
#[derive(Clone, Debug)]
pub struct SubproblemBox {
    /// Accepted designs; the last is the start design of the cycle.
    pub history: DesignHistory,
    /// Lower sides of the search subregion.
    pub lower: Vec<f64>,
    /// Upper sides of the search subregion.
    pub upper: Vec<f64>,
    /// A scale for each variable: its range; without one, the extent of all designs so far, at least |its start| or, if that is
    /// zero, 1.
    pub scale: Vec<f64>,
}

impl SubproblemBox {
    /// Creates the box of a cycle after the accepted designs `history`.
    pub fn new(problem: &Problem, history: DesignHistory, (lower, upper): (Vec<f64>, Vec<f64>)) -> Self {
        let mut scale = problem.scales();
        for (k, variable) in problem.variables.iter().enumerate() {
            if !(variable.upper - variable.lower).is_finite() {
                let [least, most] = history.extent(k);
                scale[k] = scale[k].max(most - least);
            }
        }
        Self { history, lower, upper, scale }
    }

    /// Asymptotes l and u of variable k by a rule.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if a variable with proportional or relative asymptotes is not positive, or if the history does not track
    /// the rule.
    pub fn asymptotes(&self, rule: &Asymptotes, k: usize) -> Result<(f64, f64)> {
        let x = self.history.last().map_or(0.0, |b| b[k]);
        let distances = || {
            let why = "the designs before this one were not followed";
            let remedy = "return the rule from `Approximation::asymptotes`";
            self.history.distances(rule, k).ok_or_else(|| Error::definition("moving asymptotes", why, remedy))
        };
        match *rule {
            Asymptotes::Moving { .. } => {
                let [below, above] = distances()?.map(|width| width * self.scale[k]);
                Ok((x - below, x + above))
            }
            Asymptotes::Each(rules) => self.asymptotes(&rules[k.min(rules.len() - 1)], k),
            Asymptotes::Proportional(_) | Asymptotes::Relative { .. } if !(x > 0.0) => {
                let why = format!("variable {k} is {}, which is not positive", Readable(x));
                Err(Error::definition("proportional asymptotes", why, "use moving asymptotes, or bound it above zero"))
            }
            Asymptotes::Proportional(s) => Ok((s * x, x / s)),
            Asymptotes::Relative { .. } => {
                let [below, above] = distances()?;
                Ok((x - below, x + above))
            }
        }
    }

    /// True if variable k can neither reach zero nor change its sign in this cycle.
    pub fn keeps_sign(&self, k: usize) -> bool {
        self.lower[k] > 0.0 || self.upper[k] < 0.0
    }
}

/// Options of the approximate problem apart from the approximation.
#[derive(Clone, Debug, Default)]
pub struct ApproximationOptions {
    /// ρ of the objective and of each constraint, in the unit of each: ρ·w(b) with
    /// w = ½ Σ ((bₖ − b₀ₖ)/scaleₖ)² is added. Empty if nothing is added.
    pub conservatism: Vec<f64>,
    /// True if peaks in continuous time move with the design.
    pub moving_peaks: bool,
    /// A convex quadratic about the start design that is added to the objective.
    pub curvature: Option<LowRank>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rule: Asymptotes, history: &[f64]) -> (f64, f64) {
        let history = DesignHistory::new(&[rule]).after(history.chunks(1));
        SubproblemBox { history, lower: vec![0.0], upper: vec![1.0], scale: vec![2.0] }.asymptotes(&rule, 0).unwrap()
    }

    #[test]
    fn asymptotes_follow_the_signs_of_the_steps() {
        let rule = Asymptotes::SVANBERG_2002;
        let distance = |history: &[f64]| {
            let (l, u) = of(rule, history);
            assert!(((u + l) / 2.0 - history[history.len() - 1]).abs() < 1e-15);
            (u - l) / 4.0
        };
        assert!((distance(&[1.0, 2.0]) - 0.5).abs() < 1e-15);
        assert!((distance(&[1.0, 2.0, 3.0]) - 0.6).abs() < 1e-15);
        assert!((distance(&[1.0, 2.0, 1.5]) - 0.35).abs() < 1e-15);
        assert!((distance(&[1.0, 2.0, 1.5, 1.5, 1.6]) - 0.35).abs() < 1e-15);
        assert_eq!(of(Asymptotes::Proportional(0.5), &[3.0]), (1.5, 6.0));
    }

    #[test]
    fn relative_distances_follow_the_steps_within_their_limits() {
        let rule = Asymptotes::Relative { initial: [1.0, 4.0], rate: 0.5, least: [0.75, 1.5], most: [51.0, 49.0] };
        assert_eq!(of(rule, &[2.0]), (0.0, 10.0));
        assert_eq!(of(rule, &[2.0, 3.0]), (0.0, 15.0));
        // One direction: distances 3 and 12 double. A reversal: they halve, but not below 0.75 and 1.5 times the variable.
        assert_eq!(of(rule, &[2.0, 3.0, 4.0]), (-2.0, 28.0));
        assert_eq!(of(rule, &[2.0, 4.0, 3.0]), (0.75, 11.0));
        assert_eq!(of(rule, &[2.0, 10.0, 8.0]), (2.0, 28.0));
        let each = Asymptotes::Each(&[Asymptotes::Proportional(0.5), Asymptotes::Proportional(0.25)]);
        assert_eq!(of(each, &[3.0]), (1.5, 6.0));
        assert!(Asymptotes::Each(&[]).check().is_err());
        assert!(
            Asymptotes::Relative { initial: [1.0; 2], rate: 2.0, least: [0.5; 2], most: [9.0; 2] }.check().is_err()
        );
    }

    #[test]
    fn rejects_invalid_settings() {
        assert!(Asymptotes::Proportional(1.0).check().is_err());
        assert!(Asymptotes::Moving { initial: 0.0, shrink: 0.7, grow: 1.2, least: 0.01, most: 1.0 }.check().is_err());
        let at_zero = SubproblemBox {
            history: DesignHistory::default().after([&[0.0][..]]),
            lower: vec![0.0],
            upper: vec![1.0],
            scale: vec![1.0],
        };
        let message = at_zero.asymptotes(&Asymptotes::Proportional(0.5), 0).unwrap_err().to_string();
        assert!(message.contains("variable 0") && message.contains("positive"), "{message}");
    }
}
