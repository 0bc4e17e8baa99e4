//! Where the asymptotes of a cycle are.

use super::Surroundings;
use crate::error::{Error, Result};

/// A rule for the asymptotes l < b < u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asymptotes {
    /// b ± σ with σ = `initial` × the variable's scale for the first two designs; then σ × `shrink` where the last two steps
    /// of the variable have opposite signs and × `grow` where they have the same, kept between `least` and `most` scales.
    Moving {
        /// First σ, in scales of the variable.
        initial: f64,
        /// Multiplier on oscillation, below 1.
        shrink: f64,
        /// Multiplier on steady progress, at least 1.
        grow: f64,
        /// Least σ, in scales of the variable.
        least: f64,
        /// Largest σ, in scales of the variable.
        most: f64,
    },
    /// l = s b and u = b/s, for positive variables; s between 0 and 1.
    Proportional(f64),
}

impl Asymptotes {
    /// Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, equations (14) to (16), with s = 0.7. The limits are ours.
    pub const SVANBERG_1987: Self =
        Self::Moving { initial: 1.0, shrink: 0.7, grow: 1.0 / 0.7, least: 0.01, most: 10.0 };
    /// Svanberg, *SIAM J. Optim.* 12 (2002) 555–573, section 5.
    pub const SVANBERG_2002: Self = Self::Moving { initial: 0.5, shrink: 0.7, grow: 1.2, least: 0.01, most: 10.0 };

    /// Refuses settings out of range.
    pub(super) fn check(&self) -> Result<()> {
        match *self {
            Self::Moving { initial, shrink, grow, least, most } => {
                let positive = initial > 0.0 && initial.is_finite();
                Error::check_option("first asymptote distance", "positive and finite", initial, positive)?;
                Error::check_option(
                    "asymptote shrinking",
                    "above 0 and at most 1",
                    shrink,
                    shrink > 0.0 && shrink <= 1.0,
                )?;
                Error::check_option("asymptote growing", "at least 1", grow, grow >= 1.0 && grow.is_finite())?;
                Error::check_option("least asymptote distance", "positive", least, least > 0.0)?;
                Error::check_option("largest asymptote distance", "at least the least", most, most >= least)
            }
            Self::Proportional(s) => Error::check_option("asymptote ratio", "between 0 and 1", s, s > 0.0 && s < 1.0),
        }
    }

    /// l and u of variable k.
    ///
    /// Errors with [`Error::Definition`] if proportional asymptotes meet a variable that is not positive.
    pub fn of(&self, k: usize, surroundings: &Surroundings) -> Result<(f64, f64)> {
        let trail = &surroundings.trail;
        let x = trail.last().map_or(0.0, |b| b[k]);
        match *self {
            Self::Moving { initial, shrink, grow, least, most } => {
                let turn = |w: &[Vec<f64>]| (w[2][k] - w[1][k]) * (w[1][k] - w[0][k]);
                let factor = |turn: f64| {
                    if turn < 0.0 {
                        shrink
                    } else if turn > 0.0 {
                        grow
                    } else {
                        1.0
                    }
                };
                let width = trail.windows(3).map(turn).fold(initial, |sigma, t| (sigma * factor(t)).clamp(least, most));
                let sigma = width * surroundings.scale[k];
                Ok((x - sigma, x + sigma))
            }
            Self::Proportional(s) if x > 0.0 => Ok((s * x, x / s)),
            Self::Proportional(_) => {
                let why = format!("variable {k} is {x}, which is not positive");
                Err(Error::definition("proportional asymptotes", why, "use moving asymptotes, or bound it above zero"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rule: Asymptotes, trail: &[f64]) -> (f64, f64) {
        let trail = trail.iter().map(|&x| vec![x]).collect();
        rule.of(0, &Surroundings { trail, lower: vec![0.0], upper: vec![1.0], scale: vec![2.0] }).unwrap()
    }

    #[test]
    fn they_follow_the_signs_of_the_steps() {
        let rule = Asymptotes::SVANBERG_2002;
        let distance = |trail: &[f64]| {
            let (l, u) = of(rule, trail);
            assert!(((u + l) / 2.0 - trail[trail.len() - 1]).abs() < 1e-15);
            (u - l) / 4.0
        };
        assert!((distance(&[1.0, 2.0]) - 0.5).abs() < 1e-15);
        assert!((distance(&[1.0, 2.0, 3.0]) - 0.6).abs() < 1e-15);
        assert!((distance(&[1.0, 2.0, 1.5]) - 0.35).abs() < 1e-15);
        assert!((distance(&[1.0, 2.0, 1.5, 1.5, 1.6]) - 0.35).abs() < 1e-15);
        assert_eq!(of(Asymptotes::Proportional(0.5), &[3.0]), (1.5, 6.0));
    }

    #[test]
    fn refuses_what_cannot_be() {
        assert!(Asymptotes::Proportional(1.0).check().is_err());
        assert!(Asymptotes::Moving { initial: 0.0, shrink: 0.7, grow: 1.2, least: 0.01, most: 1.0 }.check().is_err());
        let at_zero = Surroundings { trail: vec![vec![0.0]], lower: vec![0.0], upper: vec![1.0], scale: vec![1.0] };
        let message = Asymptotes::Proportional(0.5).of(0, &at_zero).unwrap_err().to_string();
        assert!(message.contains("variable 0") && message.contains("positive"), "{message}");
    }
}
