//! Numbers as people write them.

/// Significant digits by default.
pub const DIGITS: usize = 5;

/// A number in at most `digits` significant digits, without trailing zeros: `46.04`, `-0.0125`, `210000`; with an exponent below 10⁻⁴
/// and where more than six digits would precede the point.
///
/// ```
/// use linkwright::report::number::readable;
/// assert_eq!([46.038457, -0.5, 2.1e11, 3.2e-7, 0.0].map(|v| readable(v, 5)), ["46.038", "-0.5", "2.1e11", "3.2e-7", "0"]);
/// ```
pub fn readable(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { value.to_string() };
    }
    let digits = digits.max(1);
    let (scientific, exponent) = rounded(value, digits);
    if (-4..6.max(digits as i32)).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        return trimmed(&format!("{value:.decimals$}")).to_owned();
    }
    let mantissa = scientific.split('e').next().unwrap_or_default();
    format!("{}e{exponent}", trimmed(mantissa))
}

/// A number as in a column of a table: with trailing zeros, so that all have `digits` significant digits; with an exponent below 10⁻³ and
/// where more than five digits would precede the point.
pub(super) fn in_column(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.abs().to_string().replace("inf", if value < 0.0 { "-inf" } else { "inf" });
    }
    let last = digits as i32 - 1;
    let (scientific, exponent) = rounded(value, digits);
    if (-3..last.max(4) + 1).contains(&exponent) {
        format!("{value:.*}", (last - exponent).max(0) as usize)
    } else {
        scientific
    }
}

/// A finite number in scientific notation, and its exponent after rounding: 9.99999 is 10.
fn rounded(value: f64, digits: usize) -> (String, i32) {
    let scientific = format!("{value:.*e}", digits - 1);
    let exponent = scientific.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0);
    (scientific, exponent)
}

/// Zero in place of a number of the size of rounding errors: one below 10⁻¹³ of the largest number that it is computed with or shown next to.
///
/// ```
/// use linkwright::report::number::without_rounding;
/// assert_eq!([without_rounding(1.2e-17, 3.0), without_rounding(1.2e-17, 1e-16)], [0.0, 1.2e-17]);
/// ```
pub fn without_rounding(value: f64, largest: f64) -> f64 {
    if value.abs() < 1e-13 * largest.abs() { 0.0 } else { value }
}

/// A number with its unit.
pub fn with_unit(value: f64, unit: &str, digits: usize) -> String {
    format!("{} {unit}", readable(value, digits)).trim_end().to_owned()
}

/// A number of things: `1 analysis`, `2 analyses`.
///
/// ```
/// use linkwright::report::number::counted;
/// assert_eq!([counted(1, ["analysis", "analyses"]), counted(2, ["analysis", "analyses"])], ["1 analysis", "2 analyses"]);
/// ```
pub fn counted(count: usize, [one, many]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// The unit of a derivative of a quantity with respect to another one; empty for a plain number.
///
/// ```
/// use linkwright::report::number::unit_of_derivative as unit;
/// assert_eq!([unit("N", "mm"), unit("N", "N/m"), unit("", "s"), unit("mm", ""), unit("m", "m")], ["N/mm", "N/(N/m)", "1/s", "mm", ""]);
/// ```
pub fn unit_of_derivative(unit: &str, by: &str) -> String {
    let above = if unit.is_empty() { "1" } else { unit };
    match by {
        "" => unit.to_owned(),
        _ if by == unit => String::new(),
        _ if by.contains(['/', '·', '*', ' ']) => format!("{above}/({by})"),
        _ => format!("{above}/{by}"),
    }
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_plain_where_people_write_them_so() {
        let cases = [
            (0.52028604, "0.52029"),
            (-12.5, "-12.5"),
            (9.999999, "10"),
            (123456.7, "123457"),
            (1234567.0, "1.2346e6"),
            (1.2e-4, "0.00012"),
            (1.23456e-7, "1.2346e-7"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ];
        for (value, text) in cases {
            assert_eq!(readable(value, 5), text);
        }
        assert_eq!((readable(46.038457, 9), with_unit(46.038457, "N·m", 4)), ("46.038457".into(), "46.04 N·m".into()));
        assert_eq!(with_unit(2.0, "", 4), "2");
    }

    #[test]
    fn numbers_of_a_column_have_trailing_zeros() {
        let cases = [
            (0.36276112, "0.36276"),
            (-12.0, "-12.000"),
            (1.23456e-7, "1.2346e-7"),
            (9.999996, "10.000"),
            (123456.0, "1.2346e5"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
        ];
        for (value, text) in cases {
            assert_eq!(in_column(value, DIGITS), text);
        }
    }
}
