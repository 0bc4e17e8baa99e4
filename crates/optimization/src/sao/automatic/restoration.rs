//! Least violation of the linearized rows in a box: incompatible rows, and stationary points of the violation.

use super::lengths::Units;
use super::linearized::Linearized;
use error::Result;
use nalgebra::DMatrix;
use nlp::{Conic, QuadraticProgram, SubproblemSolver};

/// t* = min max violation/σ of the linearized rows over the box lower ≤ b ≤ upper around `design`.
///
/// Zero if the linearized rows have a common point in the box.
///
/// # Errors
///
/// Those of the linear program's solver.
pub(super) fn least_violation(
    here: &Linearized,
    units: &Units,
    design: &[f64],
    [lower, upper]: [&[f64]; 2],
) -> Result<f64> {
    let n = design.len();
    let width = |j: usize| {
        let width = (upper[j] - design[j]).max(design[j] - lower[j]);
        if width > 0.0 { width } else { 1.0 }
    };
    let widths: Vec<f64> = (0..n).map(width).collect();
    let (mut rows, mut offset, mut most): (Vec<f64>, Vec<f64>, f64) = (vec![], vec![], 0.0);
    for (i, row) in here.rows.iter().enumerate() {
        let unit = units.rows[row.constraint];
        let slope: Vec<f64> = (0..n).map(|j| here.jacobian[(i, j)] * widths[j] / unit).collect();
        let reach: f64 = slope.iter().map(|s| s.abs()).sum();
        for sign in if here.equality[i] { &[1.0, -1.0][..] } else { &[1.0][..] } {
            let c = sign * here.c[i] / unit;
            most = most.max(c);
            if c + reach > 0.0 {
                rows.extend(slope.iter().map(|s| sign * s).chain([-1.0]));
                offset.push(c);
            }
        }
    }
    if most <= 0.0 {
        return Ok(0.0);
    }
    let m = offset.len();
    let side =
        |b: &[f64], last: f64| -> Vec<f64> { (0..n).map(|j| (b[j] - design[j]) / widths[j]).chain([last]).collect() };
    let program = QuadraticProgram {
        center: (0..n).map(|_| 0.0).chain([most]).collect(),
        gradient: (0..n).map(|_| 0.0).chain([1.0]).collect(),
        // The rows are given at the centre, where t is `most`.
        offset: offset.iter().map(|c| c - most).collect(),
        rows: DMatrix::from_row_slice(m, n + 1, &rows),
        equality: vec![false; m],
        lower: side(lower, 0.0),
        upper: side(upper, most),
        ..QuadraticProgram::new(vec![0.0; n + 1])
    };
    let center = program.center.clone();
    let solution = Conic::default().solve(&program, &center)?;
    // The point is feasible up to rounding at best: the violation there is an upper bound of the least one.
    let at = |i: usize| offset[i] + (0..n).map(|j| rows[i * (n + 1) + j] * solution.x[j]).sum::<f64>();
    Ok((0..m).map(at).fold(0.0, f64::max).min(most))
}

/// Rows whose linearization cannot be satisfied in the box.
pub(super) fn is_incompatible(least: f64, violation: f64) -> bool {
    least > 1e-9 + 1e-6 * violation.min(1.0)
}

/// The largest first-order change of a violated row over the lengths, in units of the rows.
pub(super) fn largest_first_order_change(here: &Linearized, units: &Units) -> f64 {
    let one = |i: usize| {
        let violation = if here.equality[i] { here.c[i].abs() } else { here.c[i] };
        let unit = units.rows[here.rows[i].constraint];
        let change = || here.jacobian.row(i).iter().zip(&units.lengths).map(|(g, l)| g.abs() * l).sum::<f64>() / unit;
        if violation > 1e-9 * unit { change() } else { 0.0 }
    };
    (0..here.c.len()).map(one).fold(0.0, f64::max)
}

/// True if the violation h is stationary to first order: its possible decrease is a negligible part of itself, and of what the
/// slopes of the violated rows would allow unless these vanish.
pub(super) fn is_stationary(violation: f64, least: f64, reach: f64) -> bool {
    const NEGLIGIBLE: f64 = 1e-4;
    let slopes = if reach < NEGLIGIBLE { f64::INFINITY } else { reach };
    violation - least < NEGLIGIBLE * violation.min(slopes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_violation_that_can_vanish_is_not_stationary() {
        assert!(!is_stationary(1e-4, 0.0, 1.0));
        assert!(is_stationary(0.5, 0.49996, 1.0) && !is_stationary(0.5, 0.4999, 1.0));
        assert!(is_stationary(0.5, 0.49996, 0.0), "flat rows");
    }
}
