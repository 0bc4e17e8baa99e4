//! Prescribed motions: positions given as functions of time.

pub(crate) mod ramp;
pub(crate) mod start_up;
pub(crate) mod table;

pub use ramp::Ramp;
pub use start_up::StartUp;
pub use table::TabulatedMotion;

use autodiff::{Dual4, Dual8, HyperDual4, Jet2, Scalar};
use std::any::TypeId;

/// A position as a function of time, written once over the scalar type.
///
/// Velocities and accelerations follow from an evaluation with a [`Jet2`] in time, design derivatives from parameters that
/// carry them. Branch on real parts only.
pub trait Motion: Send + Sync + 'static {
    /// Returns the position (m or rad) at time `t` (s) for the parameters `p`.
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T;

    /// Describes an inadmissible parameter, such as a negative duration; `None` if all are admissible.
    fn validate_parameters(&self, _p: &[f64]) -> Option<String> {
        None
    }

    /// Times in s at which its form changes: the ends of a ramp, the points of a table. Long steps are inspected there and between.
    fn breaks(&self, _p: &[f64]) -> Vec<f64> {
        Vec::new()
    }
}

/// [`Motion`] evaluated with one number type.
pub trait MotionIn<T: Scalar>: Send + Sync {
    /// See [`Motion::position`].
    fn position(&self, p: &[T], t: T) -> T;
}

impl<M: Motion, T: Scalar> MotionIn<T> for M {
    fn position(&self, p: &[T], t: T) -> T {
        Motion::position(self, p, t)
    }
}

/// [`Motion`] as a trait object. Implemented for every motion.
pub trait AnyMotion:
    MotionIn<f64>
    + MotionIn<Dual4>
    + MotionIn<Dual8>
    + MotionIn<HyperDual4>
    + MotionIn<Jet2<f64>>
    + MotionIn<Jet2<Dual4>>
    + MotionIn<Jet2<Dual8>>
    + MotionIn<Jet2<HyperDual4>>
{
    /// See [`Motion::validate_parameters`].
    fn validate_parameters(&self, p: &[f64]) -> Option<String>;

    /// See [`Motion::breaks`].
    fn breaks(&self, p: &[f64]) -> Vec<f64>;

    /// Returns whether it is [`Fixed`].
    fn is_fixed(&self) -> bool;
}

impl<M: Motion> AnyMotion for M {
    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        Motion::validate_parameters(self, p)
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        Motion::breaks(self, p)
    }

    fn is_fixed(&self) -> bool {
        TypeId::of::<M>() == TypeId::of::<Fixed>()
    }
}

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

/// Harmonic: p = \[mean, amplitude, angular frequency (rad/s), phase (rad)\], mean + amplitude sin(ω t + φ).
#[derive(Clone, Copy, Debug)]
pub struct Harmonic;

impl Motion for Harmonic {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] + p[1] * (p[2] * t + p[3]).sin()
    }
}

/// Position, velocity and acceleration at a time.
#[cfg(test)]
pub(crate) fn with_rates(motion: &impl Motion, p: &[f64], t: f64) -> [f64; 3] {
    let p: Vec<Jet2<f64>> = p.iter().map(|&p| Jet2::new(p, 0.0, 0.0)).collect();
    let position = Motion::position(motion, &p, Jet2::new(t, 1.0, 0.0));
    [position.re, position.v1, position.v2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_speeds_and_accelerations_at_a_time() {
        assert_eq!(with_rates(&Fixed, &[3.0], 2.0), [3.0, 0.0, 0.0]);
        assert_eq!(with_rates(&ConstantSpeed, &[3.0, 0.5], 2.0), [4.0, 0.5, 0.0]);
        let [q, v, a] = with_rates(&Harmonic, &[1.0, 2.0, 3.0, 0.5], 0.7);
        let (sin, cos) = 2.6f64.sin_cos();
        assert!((q - 1.0 - 2.0 * sin).abs() + (v - 6.0 * cos).abs() + (a + 18.0 * sin).abs() < 1e-13);
    }
}
