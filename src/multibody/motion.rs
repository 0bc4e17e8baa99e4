//! Prescribed motions: positions given as functions of time.

use super::number::{Jet, Sensitive};
use crate::scalar::{Scalar, Tangent};

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
pub trait AnyMotion:
    Position<f64> + Position<Sensitive> + Position<Jet<f64>> + Position<Jet<Sensitive>> + Position<Jet<Tangent<4>>>
{
}
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

/// Harmonic: p = \[mean, amplitude, angular frequency (rad/s), phase (rad)\], mean + amplitude sin(ω t + φ).
#[derive(Clone, Copy, Debug)]
pub struct Harmonic;

impl Motion for Harmonic {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] + p[1] * (p[2] * t + p[3]).sin()
    }
}

/// A table, interpolated by the natural cubic spline and continued linearly; p = \[scale\].
#[derive(Clone, Debug)]
pub struct Table {
    times: Vec<f64>,
    values: Vec<f64>,
    curvatures: Vec<f64>,
}

impl Table {
    /// Through `values` at the increasing `times` (s).
    ///
    /// **Errors.** [`crate::Error::Definition`] unless there are two points or more and times increase.
    ///
    /// **Source.** de Boor, *A Practical Guide to Splines* (1978), Chapter IV.
    pub fn new(times: &[f64], values: &[f64]) -> crate::Result<Self> {
        crate::Error::check_length("table values", times.len(), values.len())?;
        if times.len() < 2 || times.windows(2).any(|w| !(w[0] < w[1])) || values.iter().any(|v| !v.is_finite()) {
            let why = "needs two or more points at increasing times with finite values";
            return Err(crate::Error::definition("motion table", why, "sort the points and remove duplicates"));
        }
        let curvatures = natural_curvatures(times, values);
        Ok(Self { times: times.to_vec(), values: values.to_vec(), curvatures })
    }
}

/// Second derivatives at the knots, zero at both ends: a tridiagonal system.
fn natural_curvatures(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let (mut ratio, mut m) = (vec![0.0; n], vec![0.0; n]);
    for i in 1..n - 1 {
        let (left, right) = (x[i] - x[i - 1], x[i + 1] - x[i]);
        let pivot = 2.0 * (left + right) - left * ratio[i - 1];
        let bend = 6.0 * ((y[i + 1] - y[i]) / right - (y[i] - y[i - 1]) / left);
        ratio[i] = right / pivot;
        m[i] = (bend - left * m[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        m[i] -= ratio[i] * m[i + 1];
    }
    m
}

impl Motion for Table {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        let (x, y, m) = (&self.times, &self.values, &self.curvatures);
        let last = x.len() - 1;
        let i = x.partition_point(|&knot| knot <= t.re()).clamp(1, last) - 1;
        let h = x[i + 1] - x[i];
        let slope = (y[i + 1] - y[i]) / h - h * (2.0 * m[i] + m[i + 1]) / 6.0;
        let s = t - x[i];
        if t.re() < x[0] {
            return p[0] * (s * slope + y[0]);
        }
        if t.re() > x[last] {
            let end = (y[last] - y[i]) / h + h * (m[i] + 2.0 * m[last]) / 6.0;
            return p[0] * ((t - x[last]) * end + y[last]);
        }
        p[0] * (s * (s * (s * ((m[i + 1] - m[i]) / (6.0 * h)) + 0.5 * m[i]) + slope) + y[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::number::Real;

    #[test]
    fn a_table_goes_through_its_points_smoothly() {
        // A sine from 0 to π has no curvature at its ends, as a natural spline.
        let times: Vec<f64> = (0..9).map(|k| std::f64::consts::PI / 8.0 * f64::from(k)).collect();
        let values: Vec<f64> = times.iter().map(|t| t.sin()).collect();
        let table = Table::new(&times, &values).unwrap();
        for k in 1..8 {
            let (before, after) = (times[k] - 1e-9, times[k] + 1e-9);
            let (a, b) = (f64::motion(&table, &[1.0], before), f64::motion(&table, &[1.0], after));
            assert!((a[0] - values[k]).abs() < 1e-8 && (a[1] - b[1]).abs() < 1e-7 && (a[2] - b[2]).abs() < 1e-6);
        }
        let outside = f64::motion(&table, &[2.0], 4.0);
        assert!(outside[2] == 0.0 && (outside[1] + 2.0).abs() < 0.01, "{outside:?}");
        assert!(Table::new(&[0.0, 0.0], &[1.0, 2.0]).is_err());
    }

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
