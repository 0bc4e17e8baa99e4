//! Separable programs of functions between moving asymptotes (MMA).

use super::blocks::{BLOCK, Blocks, dot, parts};
use super::evaluation::{check_coefficients, impl_separable_program};
use crate::{
    Separable,
    program::{DualSums, Term},
};
use error::{Error, Result};
use std::ops::Range;

/// A separable program of functions between moving asymptotes:
///
/// $$ f_i(x) = r_i + \sum_j \frac{p_{ij}}{u_j - x_j} + \frac{q_{ij}}{x_j - l_j} ,\qquad p_{ij}, q_{ij} \ge 0 $$
///
/// # Sources
/// Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, equations (8) to (11).
#[derive(Clone, Debug, PartialEq)]
pub struct MovingAsymptotesProgram {
    pub(super) constants: Vec<f64>,
    p: Blocks,
    q: Blocks,
    low: Vec<f64>,
    high: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

impl MovingAsymptotesProgram {
    /// Creates the program from
    ///
    /// * `constants` — rᵢ, length 1 + m, the objective first;
    /// * `p`, `q` — entry (i, j) at j (1 + m) + i, not negative;
    /// * `asymptotes` — l and u, length n each;
    /// * `bounds` — lower and upper bounds, strictly between the asymptotes.
    ///
    /// # Errors
    /// * [`Error::Length`] if the lengths differ.
    /// * [`Error::Definition`] for a coefficient that is negative or not finite, and unless the bounds are strictly
    ///   between the asymptotes and lower ≤ upper.
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
        let [p, q] = [p, q].map(|v| Blocks::new(constants.len(), n, &v));
        Ok(Self { constants, p, q, low, high, lower, upper })
    }
}

impl_separable_program!(MovingAsymptotesProgram);

fn term(p: f64, q: f64, below: f64, above: f64) -> Term {
    let (a, b) = (1.0 / above, 1.0 / below);
    Term { value: p * a + q * b, slope: p * a * a - q * b * b, curvature: 2.0 * (p * a * a * a + q * b * b * b) }
}

impl Separable for MovingAsymptotesProgram {
    fn constant(&self, i: usize) -> f64 {
        self.constants[i]
    }

    fn term(&self, i: usize, j: usize, x: f64) -> Term {
        term(self.p.at(i, j), self.q.at(i, j), x - self.low[j], self.high[j] - x)
    }

    fn column(&self, j: usize, x: f64, values: &mut [f64], slopes: &mut [f64]) {
        let (a, b) = (1.0 / (self.high[j] - x), 1.0 / (x - self.low[j]));
        let (a2, b2) = (a * a, b * b);
        let both = self.p.of_variable(j).zip(self.q.of_variable(j));
        for ((value, slope), (p, q)) in values.iter_mut().zip(slopes).zip(both) {
            *value = p * a + q * b;
            *slope = p * a2 - q * b2;
        }
    }

    fn weighted(&self, j: usize, x: f64, weights: &[f64]) -> Term {
        let (p, q) = self.sums(j, weights);
        term(p, q, x - self.low[j], self.high[j] - x)
    }

    /// Computes the sums block by block, with each reciprocal and sum computed once.
    fn dual_sums(&self, range: Range<usize>, weights: &[f64]) -> DualSums {
        let mut sums = DualSums::new(weights.len() - 1);
        let mut pass = Pass::new(weights.len());
        parts(range).for_each(|part| pass.add(self, part, weights, &mut sums));
        sums
    }

    /// (l √P + u √Q) / (√P + √Q), Svanberg (1987) equation (20), moved into the bounds.
    fn minimizer(&self, j: usize, weights: &[f64]) -> f64 {
        let (p, q) = self.sums(j, weights);
        self.minimizer_of_sums(j, p, q)
    }
}

impl MovingAsymptotesProgram {
    /// Minimizer for variable j from P = Σ wᵢ pᵢⱼ and Q = Σ wᵢ qᵢⱼ.
    #[inline]
    fn minimizer_of_sums(&self, j: usize, p: f64, q: f64) -> f64 {
        let (p, q) = (p.max(0.0).sqrt(), q.max(0.0).sqrt());
        let (l, u) = (self.lower[j], self.upper[j]);
        // Every point is a minimizer of a constant: return the middle.
        if p + q == 0.0 { 0.5 * (l + u) } else { ((self.low[j] * p + self.high[j] * q) / (p + q)).clamp(l, u) }
    }

    /// Σ wᵢ pᵢⱼ and Σ wᵢ qᵢⱼ.
    #[inline]
    fn sums(&self, j: usize, weights: &[f64]) -> (f64, f64) {
        let both = self.p.of_variable(j).zip(self.q.of_variable(j)).zip(weights);
        both.fold((0.0, 0.0), |(a, b), ((p, q), w)| (a + p * w, b + q * w))
    }
}

/// Workspace of a pass over the variables, block by block.
struct Pass {
    /// Σ wᵢ pᵢⱼ and Σ wᵢ qᵢⱼ, then 1/(u − x) and 1/(x − l).
    above: [f64; BLOCK],
    below: [f64; BLOCK],
    /// Their squares.
    above2: [f64; BLOCK],
    below2: [f64; BLOCK],
    /// 1/f″ of variables off their bounds, else zero.
    inverse_curvature: [f64; BLOCK],
    scaled: [f64; BLOCK],
    /// f′ᵢⱼ of the rows, row by row.
    slopes: Vec<f64>,
}

impl Pass {
    fn new(functions: usize) -> Self {
        let zero = [0.0; BLOCK];
        let slopes = vec![0.0; (functions - 1) * BLOCK];
        Self { above: zero, below: zero, above2: zero, below2: zero, inverse_curvature: zero, scaled: zero, slopes }
    }

    /// Adds the variables of `part`, which lie in one block.
    fn add(&mut self, f: &MovingAsymptotesProgram, part: Range<usize>, weights: &[f64], sums: &mut DualSums) {
        self.minimize(f, &part, weights);
        let width = part.len();
        let (a, b) = (&self.above[..width], &self.below[..width]);
        for (i, sum) in sums.values.iter_mut().enumerate() {
            *sum += dot(f.p.of_function(i, &part), a) + dot(f.q.of_function(i, &part), b);
        }
        if self.inverse_curvature[..width].iter().all(|v| *v == 0.0) {
            return;
        }
        let (a2, b2) = (&self.above2[..width], &self.below2[..width]);
        for (i, row) in self.slopes.chunks_exact_mut(BLOCK).enumerate() {
            let (p, q) = (f.p.of_function(i + 1, &part), f.q.of_function(i + 1, &part));
            for k in 0..width {
                row[k] = p[k] * a2[k] - q[k] * b2[k];
            }
        }
        let rows = || self.slopes.chunks_exact(BLOCK).map(|row| &row[..width]);
        let mut entry = sums.negative_hessian.iter_mut();
        for (i, row) in rows().enumerate() {
            let scaled = &mut self.scaled[..width];
            for k in 0..width {
                scaled[k] = row[k] * self.inverse_curvature[k];
            }
            rows().take(i + 1).zip(&mut entry).for_each(|(other, entry)| *entry += dot(scaled, other));
        }
    }

    /// Computes 1/(u − x) and 1/(x − l) of the minimizers x, and 1/f″ at x.
    fn minimize(&mut self, f: &MovingAsymptotesProgram, part: &Range<usize>, weights: &[f64]) {
        let width = part.len();
        let (above, below) = (&mut self.above[..width], &mut self.below[..width]);
        above.fill(0.0);
        below.fill(0.0);
        for (i, &w) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            let (p, q) = (f.p.of_function(i, part), f.q.of_function(i, part));
            for k in 0..width {
                above[k] += w * p[k];
                below[k] += w * q[k];
            }
        }
        for (k, j) in part.clone().enumerate() {
            let (p, q) = (above[k], below[k]);
            let x = f.minimizer_of_sums(j, p, q);
            let (to_high, to_low) = (f.high[j] - x, x - f.low[j]);
            let both = 1.0 / (to_high * to_low);
            let (a, b) = (to_low * both, to_high * both);
            let curvature = 2.0 * (p * a * a * a + q * b * b * b);
            let free = x > f.lower[j] && x < f.upper[j] && curvature > 0.0;
            self.inverse_curvature[k] = if free { 1.0 / curvature } else { 0.0 };
            (above[k], below[k], self.above2[k], self.below2[k]) = (a, b, a * a, b * b);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::{bracketed_newton, general_dual_sums};

    fn form() -> MovingAsymptotesProgram {
        let (p, q) = (vec![1.0, 0.0, 0.5, 2.0], vec![0.5, 1.0, 0.0, 1.0]);
        MovingAsymptotesProgram::new(
            vec![0.0, -1.0],
            p,
            q,
            (vec![-1.0, 0.0], vec![2.0, 4.0]),
            (vec![-0.9, 0.1], vec![1.9, 3.0]),
        )
        .unwrap()
    }

    #[test]
    fn closed_form_equals_newtons_method() {
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
            let (fused, general) = (f.dual_sums(0..2, &[1.0, λ]), general_dual_sums(&f, 0..2, &[1.0, λ]));
            let all = |s: &DualSums| s.values.iter().chain(&s.negative_hessian).copied().collect::<Vec<_>>();
            for (a, b) in all(&fused).iter().zip(all(&general)) {
                assert!((a - b).abs() < 1e-14 * b.abs().max(1.0));
            }
        }
    }

    #[test]
    fn asymptotes_at_a_bound_are_rejected() {
        let one = || vec![1.0];
        let form = |low: f64, high: f64| {
            MovingAsymptotesProgram::new(one(), one(), one(), (vec![low], vec![high]), (vec![0.0], vec![1.0]))
        };
        assert!(form(-0.5, 1.5).is_ok());
        for (low, high) in [(0.0, 1.5), (-0.5, 1.0), (0.5, 1.5), (f64::NAN, 1.5)] {
            assert!(matches!(form(low, high), Err(Error::Definition { .. })));
        }
        let bad =
            MovingAsymptotesProgram::new(one(), vec![-1.0], one(), (vec![-1.0], vec![2.0]), (vec![0.0], vec![1.0]));
        assert!(matches!(bad, Err(Error::Definition { .. })));
        let bad = MovingAsymptotesProgram::new(one(), vec![], one(), (vec![-1.0], vec![2.0]), (vec![0.0], vec![1.0]));
        assert!(matches!(bad, Err(Error::Length { .. })));
    }
}
