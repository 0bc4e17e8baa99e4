//! Separable programs of quadratic functions.

use super::evaluation::{check_coefficients, impl_separable_program, weighted_sum};
use crate::{Separable, program::Term};
use error::{Error, Result};

/// A separable program of quadratic functions with diagonal Hessians:
///
/// $$ f_i(x) = r_i + \sum_j g_{ij} (x_j - c_j) + \tfrac12 h_{ij} (x_j - c_j)^2 ,\qquad h_{ij} \ge 0 $$
///
/// # Sources
/// Groenwold & Etman, *Int. J. Numer. Meth. Eng.* 82 (2010) 505–524.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagonalQuadraticProgram {
    pub(super) constants: Vec<f64>,
    center: Vec<f64>,
    slope: Vec<f64>,
    curvature: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

impl DiagonalQuadraticProgram {
    /// Creates the program from `constants` rᵢ (length 1 + m), `center` c, `slope` g and `curvature` h (entry (i, j) at
    /// j (1 + m) + i) and finite `bounds`.
    ///
    /// # Errors
    /// * [`Error::Length`] if the lengths differ.
    /// * [`Error::Definition`] for a coefficient that is not finite, a negative h, and unless the bounds are finite with
    ///   lower ≤ upper.
    pub fn new(
        constants: Vec<f64>,
        center: Vec<f64>,
        slope: Vec<f64>,
        curvature: Vec<f64>,
        bounds: (Vec<f64>, Vec<f64>),
    ) -> Result<Self> {
        let (lower, upper) = bounds;
        let n = center.len();
        check_coefficients("centre", n, 1, &center, f64::NEG_INFINITY)?;
        check_coefficients("slopes", n, constants.len(), &slope, f64::NEG_INFINITY)?;
        check_coefficients("curvatures", n, constants.len(), &curvature, 0.0)?;
        Error::check_length("lower bounds", n, lower.len())?;
        Error::check_length("upper bounds", n, upper.len())?;
        for (j, (l, u)) in lower.iter().zip(&upper).enumerate() {
            if !(l.is_finite() && u.is_finite() && l <= u) {
                let why = format!("variable {j} has the bounds {l} and {u}");
                return Err(Error::definition("diagonal quadratic", why, "give finite bounds, the lower one first"));
            }
        }
        Ok(Self { constants, center, slope, curvature, lower, upper })
    }

    fn sums(&self, j: usize, weights: &[f64]) -> (f64, f64) {
        [&self.slope, &self.curvature].map(|table| weighted_sum(table, self.constants.len(), j, weights)).into()
    }
}

impl_separable_program!(DiagonalQuadraticProgram);

fn term(g: f64, h: f64, d: f64) -> Term {
    Term { value: (g + 0.5 * h * d) * d, slope: g + h * d, curvature: h }
}

impl Separable for DiagonalQuadraticProgram {
    fn constant(&self, i: usize) -> f64 {
        self.constants[i]
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        let k = j * self.constants.len() + i;
        term(self.slope[k], self.curvature[k], x - self.center[j])
    }

    fn weighted(&self, j: usize, x: f64, weights: &[f64]) -> Term {
        let (g, h) = self.sums(j, weights);
        term(g, h, x - self.center[j])
    }

    /// c − G/H, moved into the bounds. Without curvature: the bound with the smaller value, or the centre of a constant.
    fn minimizer(&self, j: usize, weights: &[f64]) -> f64 {
        let (g, h) = self.sums(j, weights);
        let step = if h > 0.0 {
            -g / h
        } else if g == 0.0 {
            0.0
        } else {
            -g.signum() * f64::INFINITY
        };
        (self.center[j] + step).clamp(self.lower[j], self.upper[j])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_form_and_bad_input() {
        let form = |h: f64, u: f64| {
            DiagonalQuadraticProgram::new(vec![0.0], vec![1.0], vec![2.0], vec![h], (vec![-3.0], vec![u]))
        };
        assert_eq!(form(4.0, 5.0).unwrap().minimizer(0, &[1.0]), 0.5);
        assert_eq!(form(0.0, 5.0).unwrap().minimizer(0, &[1.0]), -3.0);
        for (h, u) in [(-1.0, 5.0), (f64::NAN, 5.0), (1.0, -4.0), (1.0, f64::INFINITY)] {
            assert!(matches!(form(h, u), Err(Error::Definition { .. })));
        }
    }
}
