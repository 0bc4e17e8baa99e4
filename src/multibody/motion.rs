//! Prescribed motions: positions given as functions of time.

use super::number::{Jet, Sensitive};
use crate::scalar::Scalar;

/// A position as a function of time, written once over the scalar type.
///
/// Velocities and accelerations are had by evaluating it with a [`Jet`] in time, design derivatives by evaluating it
/// with parameters that carry them. Branch on real parts only.
pub trait Motion: Send + Sync + 'static {
    /// Position (m or rad) at time `t` (s) for the parameters `p`.
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T;
}

/// [`Motion`] evaluated with one number type.
pub trait Position<T: Scalar>: Send + Sync {
    /// See [`Motion::position`].
    fn position(&self, p: &[T], t: T) -> T;
}

impl<M: Motion, T: Scalar> Position<T> for M {
    fn position(&self, p: &[T], t: T) -> T {
        Motion::position(self, p, t)
    }
}

/// [`Motion`] as an object. Implemented for every motion.
pub trait AnyMotion: Position<f64> + Position<Sensitive> + Position<Jet<f64>> + Position<Jet<Sensitive>> {}
impl<M: Motion> AnyMotion for M {}

/// At rest: p = \[position\].
#[derive(Clone, Copy, Debug)]
pub struct Fixed;

impl Motion for Fixed {
    fn position<T: Scalar>(&self, p: &[T], _t: T) -> T {
        p[0]
    }
}

/// Constant speed: p = \[position at t = 0, speed\].
#[derive(Clone, Copy, Debug)]
pub struct ConstantSpeed;

impl Motion for ConstantSpeed {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] + p[1] * t
    }
}

/// A start from rest that reaches constant speed after a while: p = \[position at t = 0, speed, duration\].
///
/// The speed rises from zero by one of several profiles. After the duration T the position is p₀ + ω (t − T/2) for
/// all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartUp {
    /// At full speed from the first instant.
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
    /// Distance gone in units of ω T at the part `x` of the duration.
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
        } else if t.re() < duration.re() {
            start + speed * duration * self.distance(t / duration)
        } else {
            start + speed * (t - duration * 0.5)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::number::Real;

    #[test]
    fn start_ups_begin_at_rest_and_reach_the_speed_without_a_jump() {
        let p = [0.3, 31.4, 0.2];
        let smooth = [StartUp::Cubic, StartUp::HalfCosine, StartUp::Cycloid, StartUp::Polynomial, StartUp::Linear];
        for profile in smooth {
            let [q, v, _] = f64::motion(&profile, &p, 0.0);
            assert!((q - 0.3).abs() < 1e-15 && v.abs() < 1e-14, "{profile:?}");
            let (before, after) = (f64::motion(&profile, &p, 0.2 - 1e-12), f64::motion(&profile, &p, 0.2));
            assert!((before[0] - after[0]).abs() < 1e-9 && (before[1] - 31.4).abs() < 1e-8, "{profile:?} {before:?}");
            assert_eq!(after[1], 31.4);
        }
    }
}
