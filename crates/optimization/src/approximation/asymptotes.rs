//! Rules for moving asymptotes.

use error::{Error, Result};

/// A rule for the asymptotes l < b < u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asymptotes {
    /// b ± σ, with σ = `initial` × the variable's scale for the first two designs.
    ///
    /// Then σ is multiplied by `shrink` if the last two steps of the variable have opposite signs, and by `grow` if
    /// they have the same sign. σ is limited to values between `least` and `most` scales.
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
    /// [`Moving`](Self::Moving) asymptotes with distances in units of the positive variable itself.
    ///
    /// b − l and u − b are `initial` × b for the first two designs. Then they are divided by `rate` if the last two
    /// steps have the same sign, and multiplied by it if the signs are opposite. They are limited to values between
    /// `least` × b and `most` × b.
    Relative {
        /// First distances of l and u, in units of b.
        initial: [f64; 2],
        /// s, between 0 and 1.
        rate: f64,
        /// Least distances.
        least: [f64; 2],
        /// Largest distances.
        most: [f64; 2],
    },
    /// One rule per variable; the last rule holds for all further variables.
    Each(&'static [Self]),
}

impl Asymptotes {
    /// Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, equations (14) to (16), with s = 0.7. The limits are ours.
    pub const SVANBERG_1987: Self =
        Self::Moving { initial: 1.0, shrink: 0.7, grow: 1.0 / 0.7, least: 0.01, most: 10.0 };
    /// Svanberg, *SIAM J. Optim.* 12 (2002) 555–573, section 5.
    pub const SVANBERG_2002: Self = Self::Moving { initial: 0.5, shrink: 0.7, grow: 1.2, least: 0.01, most: 10.0 };

    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] for a setting out of range.
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
            Self::Relative { initial, rate, least, most } => {
                Error::check_option("asymptote rate", "above 0 and at most 1", rate, rate > 0.0 && rate <= 1.0)?;
                (0..2).try_for_each(|side| {
                    let positive = initial[side] > 0.0 && initial[side].is_finite();
                    Error::check_option("first asymptote distance", "positive and finite", initial[side], positive)?;
                    Error::check_option("least asymptote distance", "positive", least[side], least[side] > 0.0)?;
                    let is_ordered = most[side] >= least[side];
                    Error::check_option("largest asymptote distance", "at least the least", most[side], is_ordered)
                })
            }
            Self::Each(rules) => {
                let count = rules.len() as f64;
                Error::check_option("number of asymptote rules", "at least 1", count, !rules.is_empty())?;
                rules.iter().try_for_each(Self::check)
            }
        }
    }

    /// The rules for single variables that this one consists of.
    pub(super) fn parts(&self) -> &[Self] {
        match self {
            Self::Each(rules) => rules,
            one => std::slice::from_ref(one),
        }
    }

    /// Distances of variable k after the first design, or after the first two, which have the same ones.
    pub(super) fn first(&self, k: usize, designs: &[Vec<f64>]) -> [f64; 2] {
        match *self {
            Self::Moving { initial, .. } => [initial; 2],
            Self::Relative { initial, least, most, .. } => {
                designs.last().map_or(initial, |b| within(initial.map(|d| d * b[k]), [least, most], b[k]))
            }
            Self::Proportional(_) | Self::Each(_) => [0.0; 2],
        }
    }

    /// Distances of variable k after three designs, from those after the second of them.
    pub(super) fn next(&self, distances: [f64; 2], k: usize, designs: &[Vec<f64>]) -> [f64; 2] {
        let [a, b, c] = [0, 1, 2].map(|i| designs[i][k]);
        let change = (c - b) * (b - a);
        match *self {
            Self::Moving { shrink, grow, least, most, .. } => {
                let factor = if change < 0.0 {
                    shrink
                } else if change > 0.0 {
                    grow
                } else {
                    1.0
                };
                distances.map(|width| (width * factor).clamp(least, most))
            }
            Self::Relative { rate, least, most, .. } => {
                within(distances.map(|d| if change < 0.0 { d * rate } else { d / rate }), [least, most], c)
            }
            Self::Proportional(_) | Self::Each(_) => distances,
        }
    }
}

/// Distances of a variable within limits relative to the size of its value `x`.
fn within(distances: [f64; 2], [least, most]: [[f64; 2]; 2], x: f64) -> [f64; 2] {
    let x = x.abs();
    [0, 1].map(|i| distances[i].clamp(least[i] * x, most[i] * x))
}
