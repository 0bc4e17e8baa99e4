//! Extrapolated differences that know their error.

/// A derivative by differences, with an estimate of its error.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    pub value: f64,
    pub error: f64,
}

/// Number of steps, each half as long as the one before.
const STEPS: usize = 8;

/// Derivatives at 0 of all components of `f`, from values at ±h, ±h/2, …; `None` if fewer than four steps can be computed.
///
/// Each component takes the entry of the tableau of extrapolations that differs least from its neighbours (Ridders). The
/// error is that difference, the difference from the same column of the next row, and the rounding of the values.
pub fn differences(h: f64, f: impl Fn(f64) -> Option<Vec<f64>>) -> Option<Vec<Difference>> {
    let here = f(0.0)?;
    let pairs: Vec<(f64, Vec<f64>, Vec<f64>)> = (0..STEPS)
        .filter_map(|k| {
            let h = h * 0.5f64.powi(k as i32);
            Some((h, f(h)?, f(-h)?))
        })
        .collect();
    if pairs.len() < 4 {
        return None;
    }
    Some((0..here.len()).map(|i| extrapolate(here[i], &pairs, i)).collect())
}

fn extrapolate(here: f64, pairs: &[(f64, Vec<f64>, Vec<f64>)], i: usize) -> Difference {
    let mut best = Difference { value: f64::NAN, error: f64::INFINITY };
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (k, (h, ahead, behind)) in pairs.iter().enumerate() {
        let mut row = vec![(ahead[i] - behind[i]) / (2.0 * h)];
        let rounding = 50.0 * f64::EPSILON * here.abs().max(ahead[i].abs()).max(1e-6) / h;
        for column in 1..=k {
            let ratio = (pairs[k - column].0 / h).powi(2);
            let value = row[column - 1] + (row[column - 1] - rows[k - 1][column - 1]) / (ratio - 1.0);
            row.push(value);
            let error = (value - row[column - 1]).abs().max((value - rows[k - 1][column - 1]).abs()).max(rounding);
            if k >= 2 && error < best.error {
                best = Difference { value, error };
            }
        }
        rows.push(row);
    }
    if is_smooth(here, pairs, i) { best } else { Difference { error: f64::INFINITY, ..best } }
}

/// Returns whether the second difference falls with the step, as it does not at a jump: where an implicit step has several
/// solutions, Newton's iteration may find another one in a neighbouring design.
fn is_smooth(here: f64, pairs: &[(f64, Vec<f64>, Vec<f64>)], i: usize) -> bool {
    let second = |k: usize| (pairs[k].1[i] - 2.0 * here + pairs[k].2[i]).abs();
    let last = pairs.len() - 1;
    second(last) < 0.5 * second(last - 2) || second(last) < 1e-9 * (1.0 + here.abs())
}
