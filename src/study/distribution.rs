//! Distributions of uncertain variables, and the standard normal distribution.

/// The distribution of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Normal, with mean and standard deviation.
    Normal {
        /// Mean, in the unit of the variable.
        mean: f64,
        /// Standard deviation, in the unit of the variable.
        deviation: f64,
    },
    /// Uniform between two values.
    Uniform {
        /// Smallest value.
        from: f64,
        /// Largest value.
        to: f64,
    },
}

impl Distribution {
    /// The mean.
    pub fn mean(&self) -> f64 {
        match *self {
            Self::Normal { mean, .. } => mean,
            Self::Uniform { from, to } => 0.5 * (from + to),
        }
    }

    /// The standard deviation.
    pub fn deviation(&self) -> f64 {
        match *self {
            Self::Normal { deviation, .. } => deviation,
            Self::Uniform { from, to } => (to - from) / 12f64.sqrt(),
        }
    }

    /// The excess kurtosis μ₄/σ⁴ − 3.
    pub fn excess_kurtosis(&self) -> f64 {
        match self {
            Self::Normal { .. } => 0.0,
            Self::Uniform { .. } => -1.2,
        }
    }

    /// Half the width of the tolerance interval: 3σ of a normal variable, all values of a uniform one.
    pub fn tolerance(&self) -> f64 {
        match *self {
            Self::Normal { deviation, .. } => 3.0 * deviation,
            Self::Uniform { from, to } => 0.5 * (to - from),
        }
    }

    /// The value that is exceeded with probability 1 − p, for p in [0, 1). p = 0 of a normal variable counts as 2⁻⁵⁴.
    pub fn quantile(&self, p: f64) -> f64 {
        match *self {
            Self::Normal { mean, deviation } => mean + deviation * normal_quantile(p),
            Self::Uniform { from, to } => from + (to - from) * p,
        }
    }

    /// The value at a coordinate of one of `count` points. The first point of a Sobol sequence that is not shifted has coordinates of zero, which
    /// counts for a normal variable as the middle of the first of `count` intervals.
    pub fn of_coordinate(&self, p: f64, count: usize) -> f64 {
        let is_corner = p == 0.0 && matches!(self, Self::Normal { .. });
        self.quantile(if is_corner { 0.5 / count as f64 } else { p })
    }

    /// The value of the variable that belongs to a standard normal variable u: both have the same probability.
    pub fn of_standard_normal(&self, u: f64) -> f64 {
        match *self {
            Self::Normal { mean, deviation } => mean + deviation * u,
            Self::Uniform { from, to } => from + (to - from) * normal_probability(u),
        }
    }

    /// dx/du of [`of_standard_normal`](Self::of_standard_normal).
    pub fn slope(&self, u: f64) -> f64 {
        match *self {
            Self::Normal { deviation, .. } => deviation,
            Self::Uniform { from, to } => (to - from) * (-0.5 * u * u).exp() / std::f64::consts::TAU.sqrt(),
        }
    }
}

/// Φ(u), the probability that a standard normal variable is at most u; accurate to rounding even in the tails.
pub fn normal_probability(u: f64) -> f64 {
    0.5 * libm::erfc(-u * std::f64::consts::FRAC_1_SQRT_2)
}

/// Φ⁻¹(p), for p in (0, 1); p outside of [2⁻⁵⁴, 1 − 2⁻⁵⁴] is moved there.
///
/// A rational approximation with a relative error of 1.2e-9, and one step of Halley's method, which leaves rounding errors.
///
/// # Sources
/// P. J. Acklam, *An algorithm for computing the inverse normal cumulative distribution function* (2003).
pub fn normal_quantile(p: f64) -> f64 {
    const SMALLEST: f64 = f64::EPSILON / 4.0;
    let p = p.clamp(SMALLEST, 1.0 - 2.0 * SMALLEST);
    if p > 0.5 {
        return -lower_quantile(1.0 - p);
    }
    lower_quantile(p)
}

fn lower_quantile(p: f64) -> f64 {
    let polynomial = |coefficients: &[f64], x: f64| coefficients.iter().fold(0.0, |sum, c| sum * x + c);
    let first = if p < 0.02425 {
        let q = (-2.0 * p.ln()).sqrt();
        polynomial(&TAIL_ABOVE, q) / polynomial(&TAIL_BELOW, q)
    } else {
        let q = p - 0.5;
        q * polynomial(&CENTRE_ABOVE, q * q) / polynomial(&CENTRE_BELOW, q * q)
    };
    let error = (normal_probability(first) - p) * std::f64::consts::TAU.sqrt() * (0.5 * first * first).exp();
    first - error / (1.0 + 0.5 * first * error)
}

const CENTRE_ABOVE: [f64; 6] = [
    -3.969683028665376e1,
    2.209460984245205e2,
    -2.759285104469687e2,
    1.38357751867269e2,
    -3.066479806614716e1,
    2.506628277459239,
];
const CENTRE_BELOW: [f64; 6] =
    [-5.447609879822406e1, 1.615858368580409e2, -1.556989798598866e2, 6.680131188771972e1, -1.328068155288572e1, 1.0];
const TAIL_ABOVE: [f64; 6] = [
    -7.784894002430293e-3,
    -3.223964580411365e-1,
    -2.400758277161838,
    -2.549732539343734,
    4.374664141464968,
    2.938163982698783,
];
const TAIL_BELOW: [f64; 5] = [7.784695709041462e-3, 3.224671290700398e-1, 2.445134137142996, 3.754408661907416, 1.0];

#[cfg(test)]
mod tests {
    use super::*;

    /// Φ(−1), Φ(−3) and Φ(−6), and quantiles of 0.975 and 1e-9, of Abramowitz and Stegun and of tables to 15 digits.
    #[test]
    fn the_normal_distribution_is_that_of_tables() {
        for (u, p) in [(-1.0, 0.158655253931457), (-3.0, 1.349898031630095e-3), (-6.0, 9.865876450376946e-10)] {
            assert!((normal_probability(u) / p - 1.0).abs() < 1e-13, "{u}");
            assert!((normal_quantile(p) - u).abs() < 1e-12, "{p}: {}", normal_quantile(p));
        }
        assert!((normal_quantile(0.975) - 1.959963984540054).abs() < 1e-14);
        assert!((normal_quantile(1e-9) + 5.997807015007887).abs() < 1e-12);
        assert!(normal_quantile(0.0).is_finite() && normal_quantile(1.0).is_finite() && normal_quantile(0.5) == 0.0);
    }

    #[test]
    fn a_uniform_variable_has_its_moments_and_its_map_to_a_normal_one() {
        let x = Distribution::Uniform { from: 1.0, to: 3.0 };
        assert_eq!((x.mean(), x.tolerance(), x.quantile(0.25)), (2.0, 1.0, 1.5));
        assert!((x.deviation() - 1.0 / 3f64.sqrt()).abs() < 1e-15);
        assert!((x.of_standard_normal(0.0) - 2.0).abs() < 1e-15);
        let h = 1e-5;
        let slope = (x.of_standard_normal(0.7 + h) - x.of_standard_normal(0.7 - h)) / (2.0 * h);
        assert!((slope - x.slope(0.7)).abs() < 1e-9);
    }
}
