//! Svanberg's two problems in quadratic forms with full matrices, in any number of variables.
//!
//! With α_ij = (i + j − 2)/(2n − 2) and the matrices, i, j = 1 … n,
//!
//! $$ S_{ij} = \frac{2 + \sin 4\pi\alpha_{ij}}{(1 + |i-j|) \ln n} ,\qquad
//!    P_{ij} = \frac{1 + 2\alpha_{ij}}{(1 + |i-j|) \ln n} ,\qquad
//!    Q_{ij} = \frac{3 - 2\alpha_{ij}}{(1 + |i-j|) \ln n} , $$
//!
//! * problem 1: minimize xᵀSx subject to xᵀPx ≥ n/2, xᵀQx ≥ n/2, |xⱼ| ≤ 1, from xⱼ = 0.5;
//! * problem 2: minimize −xᵀSx subject to xᵀPx ≤ n/2, xᵀQx ≤ n/2, |xⱼ| ≤ 1, from xⱼ = 0.25.
//!
//! Neither is convex. Reversing the order of the variables maps S to P + Q − S. If both constraints of both problems are
//! active, their optima therefore satisfy f₁* = n + f₂*: a check without a reference.
//!
//! No matrix is stored: sin 4πα_ij = sin(θᵢ + θⱼ) and α_ij are sums of products of a function of i and a function of j. A
//! product with S, P or Q therefore is a few products with the Toeplitz matrix 1/((1 + |i − j|) ln n).
//!
//! # Sources
//! Svanberg, *SIAM J. Optim.* 12 (2002) 555–573, section 6.

mod toeplitz;

use super::Optimum;
use crate::function;
use crate::problem::{Analysis, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity, ResponseAt, Responses};
use error::{Error, Result};
use nalgebra::DMatrix;
use std::f64::consts::PI;
use std::sync::Arc;
use toeplitz::Toeplitz;

/// Largest number of variables with second derivatives, three n × n matrices.
const DENSE: usize = 1000;

/// The forms xᵀSx, xᵀPx and xᵀQx as responses 0, 1 and 2.
///
/// Each has the sign with which it is minimized or bounded from above, so convex approximations give convex problems.
struct Forms {
    signs: [f64; 3],
    toeplitz: Toeplitz,
    /// θᵢ/2π = (i − 1)/(n − 1).
    place: Vec<f64>,
    sine: Vec<f64>,
    cosine: Vec<f64>,
    diagonal: f64,
}

/// Sx, Px and Qx at a design.
type ProductTerms = [Vec<f64>; 3];

impl Forms {
    fn new(n: usize, signs: [f64; 3]) -> Self {
        let logarithm = (n as f64).ln();
        let place: Vec<f64> = (0..n).map(|i| i as f64 / (n - 1) as f64).collect();
        Self {
            signs,
            toeplitz: Toeplitz::new(n, |k| 1.0 / ((1.0 + k as f64) * logarithm)),
            sine: place.iter().map(|p| (2.0 * PI * p).sin()).collect(),
            cosine: place.iter().map(|p| (2.0 * PI * p).cos()).collect(),
            place,
            diagonal: 1.0 / logarithm,
        }
    }

    /// Four Toeplitz products: of x, of x times sine, of x times cosine, of x times its place.
    fn products(&self, x: &[f64]) -> ProductTerms {
        let times = |f: &[f64]| x.iter().zip(f).map(|(x, f)| x * f).collect::<Vec<f64>>();
        let [plain, placed] = self.toeplitz.products(x, &times(&self.place));
        let [sined, cosined] = self.toeplitz.products(&times(&self.sine), &times(&self.cosine));
        let s = |i: usize| 2.0 * plain[i] + self.sine[i] * cosined[i] + self.cosine[i] * sined[i];
        let bent = |i: usize| self.place[i] * plain[i] + placed[i];
        let all = 0..x.len();
        [
            all.clone().map(s).collect(),
            all.clone().map(|i| plain[i] + bent(i)).collect(),
            all.map(|i| 3.0 * plain[i] - bent(i)).collect(),
        ]
    }

    /// Entry (i, j) of matrix `h`.
    fn entry(&self, h: usize, i: usize, j: usize) -> f64 {
        let twice = self.place[i] + self.place[j];
        let form = match h {
            0 => 2.0 + self.sine[i] * self.cosine[j] + self.cosine[i] * self.sine[j],
            1 => 1.0 + twice,
            _ => 3.0 - twice,
        };
        form * self.diagonal / (1.0 + i.abs_diff(j) as f64)
    }
}

impl Analysis for Forms {
    fn analyze(&self, x: &[f64]) -> Result<Responses> {
        let products = self.products(x);
        let form = |(p, sign): (&Vec<f64>, f64)| vec![sign * x.iter().zip(p).map(|(x, p)| x * p).sum::<f64>()];
        let values = products.iter().zip(self.signs).map(form).collect();
        Ok(Responses { trace: Some(Arc::new(products)), ..Responses::new(values) })
    }

    fn sensitivities(&self, x: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let stored = responses.trace.as_ref().and_then(|t| t.downcast_ref::<ProductTerms>());
        let fresh = if stored.is_none() { Some(self.products(x)) } else { None };
        let products = stored.or(fresh.as_ref()).expect("one of the two is given");
        Ok(DMatrix::from_fn(wanted.len(), x.len(), |i, k| {
            2.0 * self.signs[wanted[i].response] * products[wanted[i].response][k]
        }))
    }

    fn curvatures(&self, x: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        let n = x.len();
        let whole =
            |i: &ResponseAt| DMatrix::from_fn(n, n, |j, k| 2.0 * self.signs[i.response] * self.entry(i.response, j, k));
        Ok((n <= DENSE).then(|| wanted.iter().map(whole).collect()))
    }
}

/// Problem 1 in `n` variables: minimize xᵀSx.
///
/// # Errors
/// [`Error::Option`] for fewer than two variables.
pub fn first_problem(n: usize) -> Result<Problem> {
    forms("first problem in quadratic forms", n, 1.0, 0.5)
}

/// Problem 2 in `n` variables: minimize −xᵀSx.
///
/// # Errors
/// [`Error::Option`] for fewer than two variables.
pub fn second_problem(n: usize) -> Result<Problem> {
    forms("second problem in quadratic forms", n, -1.0, 0.25)
}

fn forms(name: &str, n: usize, sign: f64, start: f64) -> Result<Problem> {
    Error::check_option("number of variables", "at least 2", n as f64, n >= 2)?;
    let mut parts = ProblemBuilder::new(format!("{name}, {n} variables"));
    for k in 1..=n {
        parts.variable(DesignVariable::new(format!("x{k}"), "", start).within(-1.0, 1.0));
    }
    let [s, p, q] = ["S", "P", "Q"].map(|form| parts.constant(form, ""));
    let same = || Quantity::plain(function!(|p| p.response[0]));
    parts.minimize("form of S", "", same().of(&[s]));
    for (form, word) in [(p, "form of P"), (q, "form of Q")] {
        parts.subject_to(Constraint::at_most(word, -sign * 0.5 * n as f64, same().of(&[form])));
    }
    parts.build(Forms::new(n, [sign, -sign, -sign]))
}

const SOURCE: &str = "two optimizers from the start of the problem, and f1 = n + f2";

/// The optimum of [`first_problem`] that is found from its start, for 20 variables.
pub const FIRST_20: Optimum = Optimum::computed(6.159_485, &[], SOURCE).within(1e-6).of_any_design();
/// The optimum of [`first_problem`] that is found from its start, for 100 variables.
pub const FIRST_100: Optimum = Optimum::computed(24.895_950, &[], SOURCE).within(1e-6).of_any_design();
/// The optimum of [`second_problem`] that is found from its start, for 20 variables.
pub const SECOND_20: Optimum = Optimum::computed(-13.840_515, &[], SOURCE).within(1e-6).of_any_design();
/// The optimum of [`second_problem`] that is found from its start, for 100 variables.
pub const SECOND_100: Optimum = Optimum::computed(-75.104_050, &[], SOURCE).within(1e-6).of_any_design();

#[cfg(test)]
mod tests {
    use super::*;

    /// Sᵢⱼ, Pᵢⱼ, Qᵢⱼ as they are written, i and j from one.
    fn written(n: usize, i: usize, j: usize) -> [f64; 3] {
        let alpha = (i + j - 2) as f64 / (2 * n - 2) as f64;
        let below = (1.0 + i.abs_diff(j) as f64) * (n as f64).ln();
        [2.0 + (4.0 * PI * alpha).sin(), 1.0 + 2.0 * alpha, 3.0 - 2.0 * alpha].map(|v| v / below)
    }

    #[test]
    fn products_without_matrices_are_those_with_them() {
        let n = 37;
        let forms = Forms::new(n, [1.0; 3]);
        let x: Vec<f64> = (0..n).map(|i| (1.7 * i as f64).sin()).collect();
        for (h, product) in forms.products(&x).iter().enumerate() {
            for i in 0..n {
                let exact: f64 = (0..n).map(|j| written(n, i + 1, j + 1)[h] * x[j]).sum();
                assert!((product[i] - exact).abs() < 1e-14 * n as f64);
                assert!((forms.entry(h, i, 3) - written(n, i + 1, 4)[h]).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn reversal_takes_s_to_p_plus_q_minus_s() {
        let forms = Forms::new(11, [1.0; 3]);
        for (i, j) in [(0, 0), (2, 7), (10, 4)] {
            let rest = forms.entry(1, i, j) + forms.entry(2, i, j) - forms.entry(0, i, j);
            assert!((forms.entry(0, 10 - i, 10 - j) - rest).abs() < 1e-15);
        }
    }

    #[test]
    fn both_starts_are_feasible_for_up_to_a_hundred_thousand_variables() {
        for n in [20, 100_000] {
            for problem in [first_problem(n).unwrap(), second_problem(n).unwrap()] {
                let start = problem.start();
                let here = problem.evaluate(&start, &problem.analyze(&start).unwrap()).unwrap();
                assert!(here.max_violation_pct() < 0.0, "{n}: {}", here.max_violation_pct());
            }
        }
        assert!(first_problem(1).is_err());
    }
}
