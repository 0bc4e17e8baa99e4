//! Ramps from one value to another.

use crate::motion::Motion;
use autodiff::Scalar;

/// A ramp: constant, then from one value to another, then constant; p = \[from, to, begin (s), duration (s)\].
///
/// Both may be used as a load. As a prescribed position use the smooth ramp: the speed of the linear ramp jumps, which takes
/// impulses. Explicit steps do not have them.
///
/// # Sources
/// Norton, *Cam Design and Manufacturing Handbook* (2009): the 3-4-5 polynomial.
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
        let fraction = match self {
            Self::Linear => x,
            Self::Smooth => x.powi(3) * (x * (x * 6.0 - 15.0) + 10.0),
        };
        p[0] + (p[1] - p[0]) * fraction
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        (!(p[3] > 0.0)).then(|| format!("the duration of its ramp is {} s", p[3]))
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        vec![p[2], p[2] + p[3]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::with_rates;

    #[test]
    fn ramps_begin_and_end_at_the_given_values_and_times() {
        let p = [1.0, 5.0, 2.0, 4.0];
        for ramp in [Ramp::Linear, Ramp::Smooth] {
            assert_eq!(with_rates(&ramp, &p, 1.0), [1.0, 0.0, 0.0]);
            assert_eq!(with_rates(&ramp, &p, 7.0), [5.0, 0.0, 0.0]);
            assert_eq!(with_rates(&ramp, &p, 4.0)[0], 3.0);
        }
        assert_eq!(with_rates(&Ramp::Linear, &p, 3.0), [2.0, 1.0, 0.0]);
        // In the middle the 3-4-5 polynomial is 15/8 times as fast as the straight line.
        assert_eq!(with_rates(&Ramp::Smooth, &p, 4.0)[1], 1.875);
        let [q, v, a] = with_rates(&Ramp::Smooth, &p, 2.0 + 1e-6);
        assert!((q - 1.0).abs() + v.abs() + a.abs() < 1e-5);
    }
}
