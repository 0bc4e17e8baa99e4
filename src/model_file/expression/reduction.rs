//! Reductions of a history to a number: `peak(x)`, `mean(x)`, `at(x, 0.5)`, …

use super::function::{kinked, power};
use autodiff::Scalar;

/// Reduction of a history to a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Reduction {
    Peak,
    Max,
    Min,
    Range,
    Mean,
    Rms,
    Integral,
    Sum,
    Initial,
    Final,
    At,
    TimeOfMax,
    TimeOfMin,
    TimeOfPeak,
    Crossing,
    Norm,
    Smooth,
}

use Reduction::*;

/// Names, reductions, whether they take a second number, and meanings.
pub const REDUCTIONS: &[(&str, Reduction, bool, &str)] = &[
    ("peak", Peak, false, "largest magnitude"),
    ("max", Max, false, "largest value"),
    ("min", Min, false, "smallest value"),
    ("range", Range, false, "largest minus smallest value"),
    ("mean", Mean, false, "mean over time, by the trapezoidal rule"),
    ("rms", Rms, false, "root of the mean square over time, by the trapezoidal rule"),
    ("integral", Integral, false, "integral over time, by the trapezoidal rule"),
    ("sum", Sum, false, "sum over the time points"),
    ("initial", Initial, false, "first value"),
    ("final", Final, false, "last value"),
    ("at", At, true, "at(x, t): value at the time t, from the cubic through four time points"),
    ("time_of_max", TimeOfMax, false, "time of the largest value, from the parabola through three time points"),
    ("time_of_min", TimeOfMin, false, "time of the smallest value, likewise"),
    ("time_of_peak", TimeOfPeak, false, "time of the largest magnitude, likewise"),
    (
        "crossing",
        Crossing,
        true,
        "crossing(x, level): time of the first crossing of the level, linear between time points",
    ),
    ("norm", Norm, true, "norm(x, p): p-th root of the mean of |x|^p over time, a smooth substitute of the peak"),
    (
        "smooth_max",
        Smooth,
        true,
        "smooth_max(x, r): ln(Σ exp(r x))/r over the time points (Kreisselmeier and Steinhauser), at least the largest value",
    ),
];

impl Reduction {
    /// Returns `true` if the number has the unit of the history.
    pub fn keeps_unit(self) -> bool {
        !matches!(self, Integral | TimeOfMax | TimeOfMin | TimeOfPeak | Crossing)
    }

    /// Returns `true` for the largest magnitude, largest and smallest value.
    pub fn is_extreme(self) -> bool {
        matches!(self, Peak | Max | Min)
    }

    /// Returns `true` for integrals over time, whose derivative depends on the time of a jump of the history.
    pub fn is_integral(self) -> bool {
        matches!(self, Mean | Rms | Integral | Norm)
    }

    /// The reduction of a call with this many arguments: `max(x)` reduces a history, `max(x, y)` compares two numbers.
    pub fn named(name: &str, arguments: usize) -> Option<Self> {
        let (_, reduction, has_number, _) = REDUCTIONS.iter().find(|(known, ..)| *known == name)?;
        let own = 1 + usize::from(*has_number);
        (arguments == own || arguments == own + 2).then_some(*reduction)
    }

    /// Returns `true` if the reduction has a second number.
    pub fn has_number(self) -> bool {
        REDUCTIONS.iter().any(|(_, reduction, has_number, _)| *reduction == self && *has_number)
    }

    /// The name in expressions.
    pub fn name(self) -> &'static str {
        REDUCTIONS.iter().find(|(_, reduction, ..)| *reduction == self).map_or("", |(name, ..)| name)
    }

    /// Reduces the values at the given times; `number` is the second argument. NaN where the value does not exist, such as without a crossing.
    pub fn over<S: Scalar>(self, values: &[S], times: &[f64], number: f64) -> S {
        let last = values.len() - 1;
        match self {
            Peak => chosen(values, extreme(values, |v| v.abs())).abs(),
            Max => chosen(values, extreme(values, |v| v)),
            Min => chosen(values, extreme(values, |v| -v)),
            Range => chosen(values, extreme(values, |v| v)) - chosen(values, extreme(values, |v| -v)),
            Mean => mean(values, times, |v| v),
            Rms => root(mean(values, times, |v| v * v)),
            Integral => integral(values, times, |v| v),
            Sum => values.iter().fold(S::from(0.0), |sum, v| sum + *v),
            Initial => values[0],
            Final => values[last],
            At => interpolated(values, times, number),
            TimeOfMax => time_of(values, times, extreme(values, |v| v)),
            TimeOfMin => time_of(values, times, extreme(values, |v| -v)),
            TimeOfPeak => time_of(values, times, extreme(values, |v| v.abs())),
            Crossing => crossing(values, times, number),
            Norm => {
                let largest = values[extreme(values, |v| v.abs())].re().abs();
                if largest == 0.0 {
                    return values[0].abs();
                }
                mean(values, times, |v| power(v.abs() / largest, number)).powf(1.0 / number) * largest
            }
            Smooth => {
                let largest = values[extreme(values, |v| v)].re();
                let sum = values.iter().fold(S::from(0.0), |sum, v| sum + ((*v - largest) * number).exp());
                sum.ln() / number + largest
            }
        }
    }
}

/// The value at a point that depends on the values, marked as not polynomial for scalars that track the polynomial degree.
fn chosen<S: Scalar>(values: &[S], p: usize) -> S {
    values.iter().fold(values[p], |value, other| kinked(value, *other - values[p]))
}

/// The index of the first largest value.
fn extreme<S: Scalar>(values: &[S], key: fn(f64) -> f64) -> usize {
    (1..values.len()).fold(0, |best, p| if key(values[p].re()) > key(values[best].re()) { p } else { best })
}

/// The mean over time; at a single time, the value there.
fn mean<S: Scalar>(values: &[S], times: &[f64], of: impl Fn(S) -> S) -> S {
    match times {
        [_] => of(values[0]),
        _ => integral(values, times, of) / (times[times.len() - 1] - times[0]),
    }
}

fn integral<S: Scalar>(values: &[S], times: &[f64], of: impl Fn(S) -> S) -> S {
    let strip = |p: usize| (of(values[p - 1]) + of(values[p])) * (0.5 * (times[p] - times[p - 1]));
    (1..values.len()).fold(S::from(0.0), |sum, p| sum + strip(p))
}

/// The square root, with derivative zero at zero: the rms of a history that vanishes is at its minimum.
fn root<S: Scalar>(square: S) -> S {
    if square.re() > 0.0 { square.sqrt() } else { square * 0.0 }
}

/// The value at `t` of the polynomial through up to four time points around it.
fn interpolated<S: Scalar>(values: &[S], times: &[f64], t: f64) -> S {
    let count = times.len().min(4);
    let next = times.partition_point(|&time| time < t);
    let first = next.saturating_sub(count / 2).min(times.len() - count);
    let nodes = first..first + count;
    let weight =
        |i: usize| nodes.clone().filter(|j| *j != i).fold(1.0, |w, j| w * (t - times[j]) / (times[i] - times[j]));
    nodes.clone().fold(S::from(0.0), |sum, i| sum + values[i] * weight(i))
}

/// The time of the extremum of the parabola through point `p` and its neighbours; that of the point at an end.
fn time_of<S: Scalar>(values: &[S], times: &[f64], p: usize) -> S {
    if p == 0 || p + 1 == times.len() {
        return S::from(times[p]);
    }
    let [before, after] = [times[p] - times[p - 1], times[p + 1] - times[p]];
    let left = (values[p] - values[p - 1]) / before;
    let right = (values[p + 1] - values[p]) / after;
    let curvature = (right - left) / (before + after);
    if curvature.re() == 0.0 {
        return S::from(times[p]);
    }
    // Slope at the point: left + curvature · before.
    -(left + curvature * before) / (curvature * 2.0) + times[p]
}

fn crossing<S: Scalar>(values: &[S], times: &[f64], level: f64) -> S {
    let side = |p: usize| values[p].re() - level;
    let Some(p) = (1..values.len()).find(|&p| side(p - 1) * side(p) <= 0.0 && side(p - 1) != side(p)) else {
        return S::from(f64::NAN);
    };
    let part = (-values[p - 1] + level) / (values[p] - values[p - 1]);
    part * (times[p] - times[p - 1]) + times[p - 1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::PolynomialDegree;

    /// sin over one period: each reduction against its exact value.
    #[test]
    fn reductions_of_a_sine_have_their_exact_values() {
        let times: Vec<f64> = (0..=1000).map(|k| k as f64 * std::f64::consts::TAU / 1000.0).collect();
        let values: Vec<f64> = times.iter().map(|t| t.sin()).collect();
        let half = std::f64::consts::FRAC_PI_2;
        for (reduction, number, expected, tolerance) in [
            (Peak, 0.0, 1.0, 1e-12),
            (Max, 0.0, 1.0, 1e-12),
            (Min, 0.0, -1.0, 1e-12),
            (Range, 0.0, 2.0, 1e-12),
            (Mean, 0.0, 0.0, 1e-12),
            (Rms, 0.0, 0.5f64.sqrt(), 1e-9),
            (Integral, 0.0, 0.0, 1e-12),
            (Sum, 0.0, 0.0, 1e-9),
            (Initial, 0.0, 0.0, 0.0),
            (Final, 0.0, 0.0, 1e-12),
            (At, 0.3, 0.3f64.sin(), 1e-9),
            (TimeOfMax, 0.0, half, 1e-9),
            (TimeOfMin, 0.0, 3.0 * half, 1e-9),
            (Crossing, 0.5, std::f64::consts::PI / 6.0, 1e-5),
            (Norm, 2.0, 0.5f64.sqrt(), 1e-9),
            (Norm, 200.0, 1.0, 0.02),
            (Smooth, 1e4, 1.0, 1e-3),
        ] {
            let found = reduction.over(&values, &times, number);
            assert!((found - expected).abs() <= tolerance, "{}: {found}", reduction.name());
        }
        assert!(Crossing.over(&values, &times, 2.0).is_nan());
        // Between time points, too: the maximum of a parabola.
        let parabola: Vec<f64> = [0.0, 1.0, 3.0, 4.0].iter().map(|t| 1.0 - (t - 1.7f64).powi(2)).collect();
        assert!((TimeOfMax.over(&parabola, &[0.0, 1.0, 3.0, 4.0], 0.0) - 1.7).abs() < 1e-12);
    }

    /// The largest of values that are linear in the design is not: the point of the largest value changes.
    #[test]
    fn extremes_are_no_polynomials() {
        let values = [PolynomialDegree::variable(1.0), PolynomialDegree::variable(2.0)];
        for reduction in [Peak, Max, Min, Range] {
            let found = reduction.over(&values, &[0.0, 1.0], 0.0);
            assert_eq!(found.degree, PolynomialDegree::NONLINEAR, "{}", reduction.name());
        }
        assert_eq!(Final.over(&values, &[0.0, 1.0], 0.0).degree, 1);
    }

    #[test]
    fn the_mean_at_a_single_time_is_the_value_there() {
        for reduction in [Mean, Rms, Norm, Peak, Max] {
            assert_eq!(reduction.over(&[3.0], &[0.5], 2.0), 3.0, "{}", reduction.name());
        }
        assert_eq!(Integral.over(&[3.0], &[0.5], 0.0), 0.0);
    }

    #[test]
    fn a_call_is_a_reduction_by_its_number_of_arguments() {
        for (name, count, expected) in [
            ("max", 1, Some(Max)),
            ("max", 2, None),
            ("max", 3, Some(Max)),
            ("at", 1, None),
            ("at", 2, Some(At)),
            ("norm", 4, Some(Norm)),
            ("sin", 1, None),
        ] {
            assert_eq!(Reduction::named(name, count), expected, "{name} {count}");
        }
    }
}
