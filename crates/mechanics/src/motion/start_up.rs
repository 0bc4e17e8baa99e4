//! Start from rest to a constant speed.

use crate::motion::Motion;
use autodiff::Scalar;

/// A start from rest to a constant speed: p = \[position at t = 0, speed, duration\].
///
/// The speed rises from zero by one of several profiles, from t = 0 on; before, all but the sudden one are at rest. After the
/// duration T all of these have the position p₀ + ω (t − T/2).
///
/// # Sources
/// Norton, *Cam Design and Manufacturing Handbook* (2009), for the profiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartUp {
    /// At full speed at all times: p₀ + ω t.
    Sudden,
    /// Speed ω x: the acceleration jumps at both ends.
    Linear,
    /// Speed ω (3x² − 2x³).
    Cubic,
    /// Speed ω (1 − cos πx)/2.
    HalfCosine,
    /// Speed ω (x − sin 2πx / 2π): the acceleration starts and ends at zero.
    Cycloid,
    /// Position ω T (7x⁵ − 14x⁶ + 10x⁷ − 2.5x⁸): the jerk starts and ends at zero as well.
    Polynomial,
}

impl StartUp {
    /// Distance travelled in units of ω T at the fraction `x` of the duration.
    fn distance<T: Scalar>(self, x: T) -> T {
        use std::f64::consts::{PI, TAU};
        match self {
            Self::Sudden => x,
            Self::Linear => x * x * 0.5,
            Self::Cubic => x.powi(3) - x.powi(4) * 0.5,
            Self::HalfCosine => x * 0.5 - (x * PI).sin() / TAU,
            Self::Cycloid => x * x * 0.5 + ((x * TAU).cos() - 1.0) / (TAU * TAU),
            Self::Polynomial => x.powi(5) * (x * (x * (x * -2.5 + 10.0) - 14.0) + 7.0),
        }
    }
}

impl Motion for StartUp {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        let (start, speed, duration) = (p[0], p[1], p[2]);
        if *self == Self::Sudden {
            start + speed * t
        } else if t.re() <= 0.0 {
            start
        } else if t.re() < duration.re() {
            start + speed * duration * self.distance(t / duration)
        } else {
            start + speed * (t - duration * 0.5)
        }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        (!(p[2] >= 0.0)).then(|| format!("the duration of its start-up is {} s", p[2]))
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        vec![0.0, p[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::with_rates;

    #[test]
    fn start_ups_begin_at_rest_and_reach_the_speed_without_a_jump() {
        let p = [0.3, 31.4, 0.2];
        let smooth = [StartUp::Cubic, StartUp::HalfCosine, StartUp::Cycloid, StartUp::Polynomial, StartUp::Linear];
        for profile in smooth {
            let [q, v, _] = with_rates(&profile, &p, 0.0);
            assert!((q - 0.3).abs() < 1e-15 && v.abs() < 1e-14, "{profile:?}");
            let (before, after) = (with_rates(&profile, &p, 0.2 - 1e-12), with_rates(&profile, &p, 0.2));
            assert!((before[0] - after[0]).abs() < 1e-9 && (before[1] - 31.4).abs() < 1e-8, "{profile:?} {before:?}");
            assert_eq!(after[1], 31.4);
            assert_eq!(with_rates(&profile, &p, -0.7), [0.3, 0.0, 0.0], "{profile:?} before the start");
        }
    }
}
