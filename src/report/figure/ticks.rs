//! Round numbers along an axis.

use super::markup;

/// Ticks of an axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ticks {
    /// Values and labels of the major ticks.
    pub major: Vec<(f64, String)>,
    /// Values of the minor ticks.
    pub minor: Vec<f64>,
    /// Exponent of the power of ten that the labels omit; it is part of the axis label.
    pub exponent: i32,
}

impl Ticks {
    /// About `count` ticks at most, at multiples of 1, 2 or 5 times a power of ten between `low` and `high`.
    pub fn linear(low: f64, high: f64, count: usize) -> Self {
        let step = round_step((high - low) / count.max(1) as f64);
        let exponent = common_exponent(low.abs().max(high.abs()));
        let scale = 10f64.powi(exponent);
        let decimals = (-(step / scale).log10().floor()).clamp(0.0, 12.0) as usize;
        let major = multiples(step, low, high).into_iter().map(|v| (v, decimal(v / scale, decimals))).collect();
        let parts = if leading_digit(step) == 2 { 4.0 } else { 5.0 };
        Self { major, minor: multiples(step / parts, low, high), exponent }
    }

    /// Powers of ten between `low` and `high` (both positive); if there are fewer than two, also 2 and 5 times powers of ten.
    pub fn logarithmic(low: f64, high: f64, count: usize) -> Self {
        let slack = 1e-9;
        let power = |log: f64| log.clamp(-307.0, 308.0) as i32;
        let first = power((low.log10() - slack).ceil());
        let last = power((high.log10() + slack).floor());
        let inside = |v: &f64| *v >= low * (1.0 - slack) && *v <= high * (1.0 + slack);
        let parts = |steps: &[i32]| -> Vec<f64> {
            let powers = (first - 1)..=last;
            powers.flat_map(|n| steps.iter().map(move |&k| f64::from(k) * 10f64.powi(n))).filter(inside).collect()
        };
        if last - first < 1 {
            let major = parts(&[1, 2, 5]).into_iter().map(|v| (v, short(v))).collect();
            return Self { major, minor: parts(&[2, 3, 4, 5, 6, 7, 8, 9]), exponent: 0 };
        }
        let stride = [1, 2, 3, 4, 5, 10, 20, 50]
            .into_iter()
            .find(|stride| ((last - first) / stride) < count.max(2) as i32)
            .unwrap_or(100);
        let major = (first..=last)
            .filter(|n| n.rem_euclid(stride) == 0)
            .map(|n| (10f64.powi(n), format!("10^{{{n}}}")))
            .collect();
        let minor = match stride {
            1 => parts(&[2, 3, 4, 5, 6, 7, 8, 9]),
            _ => parts(&[1]),
        };
        Self { major, minor, exponent: 0 }
    }

    /// Width of the widest label in points, set in `size` points.
    pub fn widest_label(&self, size: f64) -> f64 {
        self.major.iter().map(|(_, label)| markup::width(label, size)).fold(0.0, f64::max)
    }
}

/// `value` with `decimals` digits after the point and a true minus sign.
pub(crate) fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    match text.strip_prefix('-') {
        Some(digits) if !zero => format!("−{digits}"),
        Some(digits) => digits.to_owned(),
        None => text,
    }
}

/// `value` in three significant digits at most, for labels of contours and notes.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    if !(-3..5).contains(&exponent) {
        let mantissa = trimmed(decimal(value / 10f64.powi(exponent), 2));
        return if mantissa == "1" { format!("10^{{{exponent}}}") } else { format!("{mantissa}·10^{{{exponent}}}") };
    }
    trimmed(decimal(value, (3 - exponent).clamp(0, 6) as usize))
}

/// Without trailing zeros after the point.
fn trimmed(text: String) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `raw`.
pub(crate) fn round_step(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * power >= raw * (1.0 - 1e-9)).unwrap_or(10.0);
    factor * power
}

fn leading_digit(step: f64) -> i32 {
    (step / 10f64.powf((step.log10() + 1e-9).floor())).round() as i32
}

/// A multiple of three that keeps labels short; zero if they are short anyway.
fn common_exponent(largest: f64) -> i32 {
    if largest == 0.0 || (1e-2..1e5).contains(&largest) {
        return 0;
    }
    ((largest.log10() / 3.0).floor() * 3.0) as i32
}

/// Multiples of `step` from `low` to `high`; none if there are too many or rounding makes them equal.
pub(crate) fn multiples(step: f64, low: f64, high: f64) -> Vec<f64> {
    const MOST: f64 = 1000.0;
    if !(step > 0.0 && (high - low) / step < MOST && low.abs() / step < 1e15) {
        return Vec::new();
    }
    let first = (low / step - 1e-6).ceil() as i64;
    let last = (high / step + 1e-6).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &Ticks) -> Vec<&str> {
        ticks.major.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(labels(&Ticks::linear(0.0, 1.0, 5)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&Ticks::linear(-3.0, 12.0, 4)), ["0", "5", "10"]);
        assert_eq!(labels(&Ticks::linear(-0.1, 0.1, 4)), ["−0.10", "−0.05", "0.00", "0.05", "0.10"]);
        let stress = Ticks::linear(-2.5e7, 2.5e7, 5);
        assert_eq!((labels(&stress), stress.exponent), (vec!["−20", "−10", "0", "10", "20"], 6));
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        assert_eq!(labels(&Ticks::logarithmic(1e-9, 1e1, 6)), ["10^{-8}", "10^{-6}", "10^{-4}", "10^{-2}", "10^{0}"]);
        assert_eq!(labels(&Ticks::logarithmic(1.0, 8.0, 6)), ["1", "2", "5"]);
    }

    #[test]
    fn short_numbers() {
        let cases = [(0.52, "0.52"), (-1.5e-7, "−1.5·10^{-7}"), (1e6, "10^{6}"), (0.0, "0"), (12.5, "12.5")];
        for (value, text) in cases {
            assert_eq!(short(value), text);
        }
    }
}
