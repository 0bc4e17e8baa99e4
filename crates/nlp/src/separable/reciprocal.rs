//! Separable programs with terms that are linear in a variable or in its reciprocal.

use super::evaluation::{check_coefficients, impl_separable_program, weighted_sum};
use crate::{Separable, program::Term};
use error::{Error, Result};

/// A separable program of linear and convex reciprocal terms:
///
/// $$ f_i(x) = r_i + \sum_j a_{ij} x_j + \frac{b_{ij}}{x_j} ,\qquad a_{ij} \in ℝ,\ b_{ij} \ge 0,\ x_j > 0 $$
///
/// # Sources
/// Fleury & Braibant, *Int. J. Numer. Meth. Eng.* 23 (1986) 409–428: CONLIN, with aᵢⱼ ≥ 0.
#[derive(Clone, Debug, PartialEq)]
pub struct ReciprocalProgram {
    pub(super) constants: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

impl ReciprocalProgram {
    /// Creates the program from `constants` rᵢ (length 1 + m), `a` and `b` (entry (i, j) at j (1 + m) + i) and
    /// positive `bounds`.
    ///
    /// # Errors
    /// * [`Error::Length`] if the lengths differ.
    /// * [`Error::Definition`] for a coefficient that is not finite, a negative b, and unless 0 < lower ≤ upper < ∞.
    pub fn new(constants: Vec<f64>, a: Vec<f64>, b: Vec<f64>, bounds: (Vec<f64>, Vec<f64>)) -> Result<Self> {
        let (lower, upper) = bounds;
        check_coefficients("coefficients a", lower.len(), constants.len(), &a, f64::NEG_INFINITY)?;
        check_coefficients("coefficients b", lower.len(), constants.len(), &b, 0.0)?;
        Error::check_length("upper bounds", lower.len(), upper.len())?;
        for (j, (l, u)) in lower.iter().zip(&upper).enumerate() {
            if !(*l > 0.0 && l <= u && u.is_finite()) {
                let why = format!("variable {j} has the bounds {l} and {u}");
                return Err(Error::definition("reciprocal terms", why, "give 0 < lower ≤ upper < ∞"));
            }
        }
        Ok(Self { constants, a, b, lower, upper })
    }

    fn sums(&self, j: usize, weights: &[f64]) -> (f64, f64) {
        [&self.a, &self.b].map(|table| weighted_sum(table, self.constants.len(), j, weights)).into()
    }
}

impl_separable_program!(ReciprocalProgram);

fn term(a: f64, b: f64, x: f64) -> Term {
    let y = 1.0 / x;
    Term { value: a * x + b * y, slope: a - b * y * y, curvature: 2.0 * b * y * y * y }
}

impl Separable for ReciprocalProgram {
    fn constant(&self, i: usize) -> f64 {
        self.constants[i]
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        let k = j * self.constants.len() + i;
        term(self.a[k], self.b[k], x)
    }

    fn weighted(&self, j: usize, x: f64, weights: &[f64]) -> Term {
        let (a, b) = self.sums(j, weights);
        term(a, b, x)
    }

    /// √(B/A), moved into the bounds; the upper bound if A ≤ 0.
    fn minimizer(&self, j: usize, weights: &[f64]) -> f64 {
        let (a, b) = self.sums(j, weights);
        if a > 0.0 { (b.max(0.0) / a).sqrt().clamp(self.lower[j], self.upper[j]) } else { self.upper[j] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_form_and_bad_input() {
        let form = ReciprocalProgram::new(vec![0.0], vec![2.0], vec![8.0], (vec![0.5], vec![5.0])).unwrap();
        assert_eq!(form.minimizer(0, &[1.0]), 2.0);
        assert_eq!(form.term(0, 0, 2.0), Term { value: 8.0, slope: 0.0, curvature: 2.0 });
        for (l, u) in [(0.0, 1.0), (-1.0, 1.0), (2.0, 1.0), (1.0, f64::INFINITY), (f64::NAN, 1.0)] {
            let bad = ReciprocalProgram::new(vec![0.0], vec![2.0], vec![8.0], (vec![l], vec![u]));
            assert!(matches!(bad, Err(Error::Definition { .. })), "{l} {u}");
        }
    }
}
