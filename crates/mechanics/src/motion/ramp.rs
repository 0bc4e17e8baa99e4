//! Ramps from one value to another.

use crate::motion::Motion;
use autodiff::Scalar;

/// A ramp: constant, then from one value to another, then constant; p = \[from, to, begin (s), duration (s)\].
///
/// As a load both are sound. As a prescribed position the linear ramp has jumps of the speed, which take impulses that
/// no analysis here makes; take the smooth one.
///
/// **Source.** Norton, *Cam Design and Manufacturing Handbook* (2009): the 3-4-5 polynomial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ramp {
    /// A straight line.
    Linear,
    /// 10x³ − 15x⁴ + 6x⁵: speed and acceleration start and end at zero.
    Smooth,
}

impl Motion for Ramp {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        let x = (t - p[2]) / p[3];
        if x.re() <= 0.0 {
            return p[0];
        }
        if x.re() >= 1.0 {
            return p[1];
        }
        let part = match self {
            Self::Linear => x,
            Self::Smooth => x.powi(3) * (x * (x * 6.0 - 15.0) + 10.0),
        };
        p[0] + (p[1] - p[0]) * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanism::scalars::StateScalar;

    #[test]
    fn ramps_begin_and_end_where_they_should() {
        let p = [1.0, 5.0, 2.0, 4.0];
        for ramp in [Ramp::Linear, Ramp::Smooth] {
            assert_eq!(f64::motion(&ramp, &p, 1.0), [1.0, 0.0, 0.0]);
            assert_eq!(f64::motion(&ramp, &p, 7.0), [5.0, 0.0, 0.0]);
            assert_eq!(f64::motion(&ramp, &p, 4.0)[0], 3.0);
        }
        assert_eq!(f64::motion(&Ramp::Linear, &p, 3.0), [2.0, 1.0, 0.0]);
        // Half-way the 3-4-5 polynomial is 15/8 times as fast as the straight line.
        assert_eq!(f64::motion(&Ramp::Smooth, &p, 4.0)[1], 1.875);
        let [q, v, a] = f64::motion(&Ramp::Smooth, &p, 2.0 + 1e-6);
        assert!((q - 1.0).abs() + v.abs() + a.abs() < 1e-5);
    }
}
