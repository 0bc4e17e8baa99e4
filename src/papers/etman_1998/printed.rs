//! Numbers as a paper prints them, and ours in the same dress.

/// `value` with the digits and the notation of a printed number: `4.703e-1`, `0.6232`, `546.0`.
pub fn like(value: f64, printed: &str) -> String {
    let (mantissa, exponential) = printed.split_once(['e', 'E']).map_or((printed, false), |(m, _)| (m, true));
    let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len());
    if exponential { format!("{value:.decimals$e}") } else { format!("{value:.decimals$}") }
}

/// True if `value`, written like the printed number, has the same digits. A printed zero is met by anything that
/// rounds to it at the printed number of decimals.
pub fn agrees(value: f64, printed: &str) -> bool {
    let same = |a: &str, b: &str| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    same(&like(value, printed), printed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dresses_numbers_as_printed() {
        assert_eq!(like(0.47034, "4.703e-1"), "4.703e-1");
        assert_eq!(like(0.62318, "0.6232"), "0.6232");
        assert_eq!(like(1e-12, "0.000"), "0.000");
        assert!(agrees(0.47034, "4.703e-1") && agrees(-71.46, "-7.15e1") && agrees(1e-9, "0.000"));
        assert!(!agrees(0.644, "0.6640") && !agrees(1.2e-8, "9.055e-9"));
    }
}
