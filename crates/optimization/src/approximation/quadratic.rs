//! Full quadratic approximations.

use super::diagonal_quadratic::exact;
use super::{AnyModel, Approximation, Expansion, FittedModel, Sample};
use crate::problem::{Problem, ProblemScalar};
use error::{Error, Result};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use nlp::powell_damping;
use std::sync::Arc;

/// A quadratic with a full Hessian B:
///
/// $$ \tilde r(b) = r(b_0) + s \cdot d + \tfrac12\, d^T B\, d ,\qquad d = b - b_0 . $$
///
/// With the exact Hessian of objective and constraints a cycle is an iteration of sequential quadratically constrained
/// quadratic programming (SQCQP).
/// Intermediate variables of the response are not used.
///
/// # Sources
///
/// Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), procedure 18.2 for the damped BFGS update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FullQuadratic {
    /// Rule for B.
    pub hessian: Hessian,
}

/// Rule for the Hessian of a [`FullQuadratic`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hessian {
    /// Damped BFGS updates of this number of accepted steps, at least 1; positive semidefinite, and zero in the first cycle.
    Bfgs(usize),
    /// The second derivatives from the analysis; an error if it does not compute them.
    Exact,
    /// The [exact](Self::Exact) Hessian with negative eigenvalues (in scaled variables) replaced by zero: a convex
    /// approximation.
    ExactConvex,
}

impl Approximation for FullQuadratic {
    fn check(&self, _: &Problem) -> Result<()> {
        match self.hessian {
            Hessian::Bfgs(steps) => {
                Error::check_option("steps of the BFGS update", "at least 1", steps as f64, steps > 0)
            }
            _ => Ok(()),
        }
    }

    fn memory(&self) -> usize {
        if let Hessian::Bfgs(steps) = self.hessian { steps } else { 0 }
    }

    fn wants_curvature(&self) -> bool {
        !matches!(self.hessian, Hessian::Bfgs(_))
    }

    fn is_odd(&self) -> bool {
        self.hessian == Hessian::Exact
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let here = expansion.here;
        let scale = &expansion.subproblem_box.scale;
        let hessian = match self.hessian {
            Hessian::Bfgs(_) => bfgs(expansion),
            Hessian::Exact => exact(expansion)?.clone(),
            Hessian::ExactConvex => {
                let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| exact_entry(expansion, i, j));
                exact(expansion)?;
                let mut eigen = SymmetricEigen::new(scaled);
                eigen.eigenvalues.iter_mut().for_each(|v| *v = v.max(0.0));
                let convex = eigen.recompose();
                DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
                    0.5 * (convex[(i, j)] + convex[(j, i)]) / (scale[i] * scale[j])
                })
            }
        };
        let (origin, slope) = (here.design.to_vec(), here.gradient.to_vec());
        Ok(Arc::new(Quadratic { value: here.value, origin, slope, hessian }))
    }
}

/// An entry of the exact Hessian in scaled variables; zero if there is no Hessian.
fn exact_entry(expansion: &Expansion, i: usize, j: usize) -> f64 {
    let scale = &expansion.subproblem_box.scale;
    expansion.curvature.map_or(0.0, |h| h[(i, j)] * scale[i] * scale[j])
}

/// B by damped BFGS updates, the oldest step first, in scaled variables.
///
/// The first matrix is the spherical curvature of the newest step along which the function has positive curvature; without one the
/// matrix is zero.
fn bfgs(expansion: &Expansion) -> DMatrix<f64> {
    let scale = &expansion.subproblem_box.scale;
    let n = scale.len();
    let samples: Vec<Sample> = expansion.before.iter().rev().copied().chain([expansion.here]).collect();
    let step = |w: &[Sample]| DVector::from_fn(n, |k, _| (w[1].design[k] - w[0].design[k]) / scale[k]);
    let change = |w: &[Sample]| DVector::from_fn(n, |k, _| (w[1].gradient[k] - w[0].gradient[k]) * scale[k]);
    let pairs: Vec<[DVector<f64>; 2]> = samples.windows(2).map(|w| [step(w), change(w)]).collect();
    let spherical = pairs.iter().rev().map(|[s, y]| s.dot(y) / s.norm_squared()).find(|c| *c > 0.0 && c.is_finite());
    let mut b = DMatrix::identity(n, n) * spherical.unwrap_or(0.0);
    for [s, y] in &pairs {
        let bs = &b * s;
        let sbs = s.dot(&bs);
        let θ = powell_damping(sbs, s.dot(y));
        let damped = y * θ + &bs * (1.0 - θ);
        let along = s.dot(&damped);
        if sbs > 0.0 && along > 0.0 {
            b += &damped * damped.transpose() / along - &bs * bs.transpose() / sbs;
        }
    }
    DMatrix::from_fn(n, n, |i, j| 0.5 * (b[(i, j)] + b[(j, i)]) / (scale[i] * scale[j]))
}

struct Quadratic {
    value: f64,
    origin: Vec<f64>,
    slope: Vec<f64>,
    hessian: DMatrix<f64>,
}

impl FittedModel for Quadratic {
    fn at<S: ProblemScalar>(&self, b: &[S]) -> S {
        let step: Vec<S> = b.iter().zip(&self.origin).map(|(&b, &o)| b - o).collect();
        let linear = step.iter().zip(&self.slope).fold(S::from(self.value), |sum, (&d, &s)| sum + d * s);
        let row = |i: usize| {
            let entries = (0..step.len()).filter(|&j| self.hessian[(i, j)] != 0.0);
            entries.fold(S::from(0.0), |sum, j| sum + step[j] * self.hessian[(i, j)])
        };
        let rows = (0..step.len()).filter(|&i| (0..step.len()).any(|j| self.hessian[(i, j)] != 0.0));
        rows.fold(linear, |sum, i| sum + step[i] * row(i) * 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::{Case, check};
    use autodiff::{HyperDual, gradient, hessian};

    fn bowl(b: &[HyperDual]) -> HyperDual {
        b[0] * b[0] * 3.0 + b[0] * b[1] * 2.0 + b[1] * b[1] - b[0]
    }

    #[test]
    fn exact_hessians_make_quadratics_exact() {
        for kind in [Hessian::Exact, Hessian::ExactConvex] {
            let approximation = FullQuadratic { hessian: kind };
            check(&approximation, kind == Hessian::ExactConvex);
            let case = Case::of(bowl, &[1.0, 2.0], &[0.0, 0.0], &[4.0, 4.0]);
            let model = case.fit(&approximation).unwrap();
            assert!((model.real(&[3.0, 1.0]) - (27.0 + 6.0 + 1.0 - 3.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_convex_part_has_no_negative_eigenvalue() {
        let saddle = |b: &[HyperDual]| b[0] * b[1] * 4.0;
        let case = Case::of(saddle, &[1.0, 2.0], &[0.0, 0.0], &[4.0, 4.0]);
        let model = case.fit(&FullQuadratic { hessian: Hessian::ExactConvex }).unwrap();
        let h = hessian(|b| model.hyper_dual(b), &[1.0, 2.0]).2;
        // Eigenvalues ±4 become 4 and 0: all entries 2.
        assert!(h.iter().all(|v| (v - 2.0).abs() < 1e-12), "{h}");
    }

    #[test]
    fn bfgs_is_convex_although_its_oldest_step_has_negative_curvature() {
        let approximation = FullQuadratic { hessian: Hessian::Bfgs(3) };
        let wave = |b: &[HyperDual]| b[0] * b[0] * b[0] * b[0] - b[0] * b[0] * 2.0 + b[1] * b[1];
        // From a maximum in x to a minimum of the wave.
        let case = Case::of(wave, &[1.1, 0.5], &[-2.0, -2.0], &[2.0, 2.0]).after(&[0.7, 0.8]).after(&[0.1, 1.0]);
        let model = case.fit(&approximation).unwrap();
        let h = hessian(|b| model.hyper_dual(b), &[1.1, 0.5]).2;
        assert!(h.clone().symmetric_eigenvalues().min() > 0.1, "{h}");
    }

    #[test]
    fn bfgs_fits_the_gradient_at_the_previous_design() {
        let approximation = FullQuadratic { hessian: Hessian::Bfgs(3) };
        check(&approximation, true);
        let case = Case::of(bowl, &[1.0, 2.0], &[0.0, 0.0], &[4.0, 2.0]).after(&[2.0, 0.5]);
        let model = case.fit(&approximation).unwrap();
        let along = |g: &[f64]| g[0] - 1.5 * g[1];
        let there = gradient(|b| model.dual(b), &[2.0, 0.5]).1;
        // ∂f at the design before: (6·2 + 2·0.5 − 1, 2·2 + 2·0.5).
        assert!((along(&there) - along(&[12.0, 5.0])).abs() < 1e-10);
        assert!((there[0] - 12.0).abs() < 1e-10 && (there[1] - 5.0).abs() < 1e-10);
    }
}
