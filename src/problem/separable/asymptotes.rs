//! Separable functions between moving asymptotes.

use super::{DualSums, Separable, Term, check_coefficients, impl_separable_program};
use crate::error::{Error, Result};
use std::ops::Range;

/// Functions between moving asymptotes:
///
/// $$ f_i(x) = r_i + \sum_j \frac{p_{ij}}{u_j - x_j} + \frac{q_{ij}}{x_j - l_j} ,\qquad p_{ij}, q_{ij} \ge 0 $$
///
/// **Source.** Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, equations (8) to (11).
#[derive(Clone, Debug, PartialEq)]
pub struct MovingAsymptotes {
    pub(super) constants: Vec<f64>,
    p: Vec<f64>,
    q: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

impl MovingAsymptotes {
    /// From
    ///
    /// * `constants` — rᵢ, length 1 + m, the objective first;
    /// * `p`, `q` — entry (i, j) at j (1 + m) + i, not negative;
    /// * `asymptotes` — l and u, length n each;
    /// * `bounds` — lower and upper bounds, strictly between the asymptotes.
    ///
    /// **Errors.** [`Error::Length`]; [`Error::Definition`] for a coefficient below zero or not finite, an asymptote at
    /// or inside a bound, crossed bounds.
    pub fn new(
        constants: Vec<f64>,
        p: Vec<f64>,
        q: Vec<f64>,
        asymptotes: (Vec<f64>, Vec<f64>),
        bounds: (Vec<f64>, Vec<f64>),
    ) -> Result<Self> {
        let (low, high) = asymptotes;
        let (lower, upper) = bounds;
        let n = low.len();
        check_coefficients("coefficients p", n, constants.len(), &p, 0.0)?;
        check_coefficients("coefficients q", n, constants.len(), &q, 0.0)?;
        Error::check_length("upper asymptotes", n, high.len())?;
        Error::check_length("lower bounds", n, lower.len())?;
        Error::check_length("upper bounds", n, upper.len())?;
        for j in 0..n {
            if !(low[j] < lower[j] && lower[j] <= upper[j] && upper[j] < high[j]) {
                let why = format!("variable {j} has {} < {} ≤ {} < {} violated", low[j], lower[j], upper[j], high[j]);
                return Err(Error::definition("asymptotes", why, "keep the bounds strictly between the asymptotes"));
            }
        }
        Ok(Self { constants, p, q, low, high, lower, upper })
    }
}

impl_separable_program!(MovingAsymptotes);

fn term(p: f64, q: f64, below: f64, above: f64) -> Term {
    let (a, b) = (1.0 / above, 1.0 / below);
    Term { value: p * a + q * b, slope: p * a * a - q * b * b, curvature: 2.0 * (p * a * a * a + q * b * b * b) }
}

impl Separable for MovingAsymptotes {
    fn constant(&self, i: usize) -> f64 {
        self.constants[i]
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        let k = j * self.constants.len() + i;
        term(self.p[k], self.q[k], x - self.low[j], self.high[j] - x)
    }

    fn terms(&self, j: usize, x: f64, out: &mut [Term]) {
        let k = j * self.constants.len();
        let (a, b) = (1.0 / (self.high[j] - x), 1.0 / (x - self.low[j]));
        let (a2, b2) = (a * a, b * b);
        let (p, q) = (&self.p[k..k + out.len()], &self.q[k..k + out.len()]);
        for ((t, p), q) in out.iter_mut().zip(p).zip(q) {
            t.value = p * a + q * b;
            t.slope = p * a2 - q * b2;
            t.curvature = 2.0 * (p * a2 * a + q * b2 * b);
        }
    }

    fn weighted(&self, j: usize, x: f64, weights: &[f64]) -> Term {
        let (p, q) = self.sums(j, weights);
        term(p, q, x - self.low[j], self.high[j] - x)
    }

    /// As the general one, with each reciprocal and sum formed once.
    fn dual_sums(&self, range: Range<usize>, weights: &[f64]) -> DualSums {
        let functions = weights.len();
        let mut sums = DualSums::new(functions - 1);
        for j in range {
            let k = j * functions;
            let (p, q) = (&self.p[k..k + functions], &self.q[k..k + functions]);
            let (pp, qq) = self.sums(j, weights);
            let x = self.at(j, pp, qq);
            let (a, b) = (1.0 / (self.high[j] - x), 1.0 / (x - self.low[j]));
            let (a2, b2) = (a * a, b * b);
            let curvature = 2.0 * (pp * a2 * a + qq * b2 * b);
            let free = x > self.lower[j] && x < self.upper[j] && curvature > 0.0;
            let terms = p.iter().zip(q).map(|(p, q)| (p * a + q * b, p * a2 - q * b2));
            sums.add_variable(terms, free.then(|| 1.0 / curvature));
        }
        sums
    }

    /// (l √P + u √Q) / (√P + √Q), Svanberg (1987) equation (20), within the bounds.
    fn minimizer(&self, j: usize, weights: &[f64]) -> f64 {
        let (p, q) = self.sums(j, weights);
        self.at(j, p, q)
    }
}

impl MovingAsymptotes {
    #[inline]
    fn at(&self, j: usize, p: f64, q: f64) -> f64 {
        let (p, q) = (p.max(0.0).sqrt(), q.max(0.0).sqrt());
        let (l, u) = (self.lower[j], self.upper[j]);
        // Without any slope every point is a minimizer: the middle.
        if p + q == 0.0 { 0.5 * (l + u) } else { ((self.low[j] * p + self.high[j] * q) / (p + q)).clamp(l, u) }
    }

    /// Σ wᵢ pᵢⱼ and Σ wᵢ qᵢⱼ.
    #[inline]
    fn sums(&self, j: usize, weights: &[f64]) -> (f64, f64) {
        let k = j * self.constants.len();
        let (p, q) = (&self.p[k..k + weights.len()], &self.q[k..k + weights.len()]);
        p.iter().zip(q).zip(weights).fold((0.0, 0.0), |(a, b), ((p, q), w)| (a + p * w, b + q * w))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::separable::bracketed_newton;

    fn form() -> MovingAsymptotes {
        let (p, q) = (vec![1.0, 0.0, 0.5, 2.0], vec![0.5, 1.0, 0.0, 1.0]);
        MovingAsymptotes::new(
            vec![0.0, -1.0],
            p,
            q,
            (vec![-1.0, 0.0], vec![2.0, 4.0]),
            (vec![-0.9, 0.1], vec![1.9, 3.0]),
        )
        .unwrap()
    }

    #[test]
    fn closed_form_is_where_newton_ends() {
        let f = form();
        for j in 0..2 {
            for λ in [0.0, 0.3, 5.0] {
                let newton = bracketed_newton(|x| f.weighted(j, x, &[1.0, λ]), f.lower[j], f.upper[j]);
                assert!((f.minimizer(j, &[1.0, λ]) - newton).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn fused_sums_are_the_general_ones() {
        let f = form();
        for λ in [0.0, 0.3, 5.0] {
            let (fused, general) =
                (f.dual_sums(0..2, &[1.0, λ]), super::super::dual_sums::general(&f, 0..2, &[1.0, λ]));
            let all = |s: &DualSums| s.values.iter().chain(&s.bend).copied().collect::<Vec<_>>();
            for (a, b) in all(&fused).iter().zip(all(&general)) {
                assert!((a - b).abs() < 1e-14 * b.abs().max(1.0));
            }
        }
    }

    #[test]
    fn asymptotes_at_a_bound_are_refused() {
        let one = || vec![1.0];
        let asked = |low: f64, high: f64| {
            MovingAsymptotes::new(one(), one(), one(), (vec![low], vec![high]), (vec![0.0], vec![1.0]))
        };
        assert!(asked(-0.5, 1.5).is_ok());
        for (low, high) in [(0.0, 1.5), (-0.5, 1.0), (0.5, 1.5), (f64::NAN, 1.5)] {
            assert!(matches!(asked(low, high), Err(Error::Definition { .. })));
        }
        let bad = MovingAsymptotes::new(one(), vec![-1.0], one(), (vec![-1.0], vec![2.0]), (vec![0.0], vec![1.0]));
        assert!(matches!(bad, Err(Error::Definition { .. })));
        let bad = MovingAsymptotes::new(one(), vec![], one(), (vec![-1.0], vec![2.0]), (vec![0.0], vec![1.0]));
        assert!(matches!(bad, Err(Error::Length { .. })));
    }
}
