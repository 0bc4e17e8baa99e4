//! Tests for all approximations.

use super::{AnyModel, Approximation, DesignHistory, Expansion, Sample, SubproblemBox};
use crate::problem::Intermediates;
use autodiff::{HyperDual, Scalar, gradient, hessian};
use error::Result;
use nalgebra::DMatrix;
use std::sync::Arc;

type Sampled = (Vec<f64>, f64, Vec<f64>);

/// A function with its values and derivatives at designs.
pub(crate) struct Case<F> {
    f: F,
    here: Sampled,
    before: Vec<Sampled>,
    curvature: DMatrix<f64>,
    subproblem_box: SubproblemBox,
}

impl<F: Fn(&[HyperDual]) -> HyperDual + Sync> Case<F> {
    /// The function at design `b` inside bounds, which are the search region too.
    pub fn of(f: F, b: &[f64], lower: &[f64], upper: &[f64]) -> Self {
        let (value, slope, curvature) = hessian(&f, b);
        let scale = lower.iter().zip(upper).map(|(l, u)| u - l).collect();
        let history = DesignHistory::default().after([b]);
        let subproblem_box = SubproblemBox { history, lower: lower.to_vec(), upper: upper.to_vec(), scale };
        Self { f, here: (b.to_vec(), value, slope), before: vec![], curvature, subproblem_box }
    }

    /// Adds a design that was accepted before those added so far.
    pub fn after(mut self, b: &[f64]) -> Self {
        let (value, slope, _) = hessian(&self.f, b);
        self.before.push((b.to_vec(), value, slope));
        let designs = self.before.iter().rev().chain([&self.here]).map(|(design, ..)| design.as_slice());
        self.subproblem_box.history = DesignHistory::default().after(designs);
        self
    }

    pub fn fit(&self, approximation: &dyn Approximation) -> Result<Arc<dyn AnyModel>> {
        let sample = |s| -> Sample {
            let (design, value, gradient): &Sampled = s;
            Sample { design, value: *value, gradient }
        };
        let before: Vec<Sample> = self.before.iter().map(sample).collect();
        approximation.fit(&Expansion {
            name: "r",
            here: sample(&self.here),
            before: &before[..before.len().min(approximation.memory())],
            intermediates: &Intermediates::Identity,
            curvature: approximation.wants_curvature().then_some(&self.curvature),
            subproblem_box: &self.subproblem_box,
        })
    }
}

/// An increasing, decreasing, curved and constant function of its variables, one of which is negative.
fn sample<S: Scalar>(b: &[S]) -> S {
    b[0].powi(3) - b[1] * 2.0 + b[0] / b[1] + (b[2] * 0.3).exp() - b[3] * b[3] + b[1] * b[3] + b[4] * 0.0
}

/// Checks that value and gradient equal those at the design, for regions with and without zero, with and without earlier
/// designs. If the approximation is `convex`, also checks that second derivatives along a line through the region are not
/// negative.
pub(crate) fn check(approximation: &dyn Approximation, convex: bool) {
    let b = [1.0, 2.0, 0.5, -1.5, 1.0];
    let (lower, upper) = ([0.2, 0.5, 0.1, -3.0, 0.5], [3.0, 4.0, 2.0, -0.5, 2.0]);
    let f = |b: &[HyperDual]| sample(b);
    let case = || Case::of(f, &b, &lower, &upper);
    let cases = [
        case(),
        case().after(&[1.2, 1.5, 0.6, -1.0, 1.0]),
        case().after(&[1.2, 1.5, 0.6, -1.0, 1.0]).after(&[2.0, 1.0, 0.4, -2.0, 1.1]),
    ];
    for case in cases {
        let Ok(model) = case.fit(approximation) else {
            // Only asymptotes proportional to a negative variable may fail.
            assert!(format!("{approximation:?}").contains("Proportional"));
            continue;
        };
        let (value, slope) = gradient(|b| model.dual(b), &b);
        assert!((value - case.here.1).abs() < 1e-13, "{approximation:?}: value {value} {}", case.here.1);
        for (k, (a, e)) in slope.iter().zip(&case.here.2).enumerate() {
            assert!((a - e).abs() < 1e-12, "{approximation:?}: slope {k} {a} {e}");
        }
        let domain = model.domain();
        for t in [0.0, 0.2, 0.5, 0.9, 1.0] {
            let inside = |k: usize| {
                let x = lower[k] + t * (upper[k] - lower[k]);
                domain.map_or(x, |[l, u]| x.clamp(l[k], u[k]))
            };
            let point: Vec<f64> = (0..5).map(inside).collect();
            let curvature = hessian(|b| model.hyper_dual(b), &point).2;
            if convex {
                let least = curvature.symmetric_eigenvalues().min();
                assert!(least >= -1e-9, "{approximation:?}: eigenvalue {least} at {point:?}");
            }
            if model.constant().is_some() {
                for k in 0..5 {
                    let term = model.term(k, point[k]);
                    assert!((term.curvature - curvature[(k, k)]).abs() <= 1e-9 * (1.0 + term.curvature.abs()));
                }
            }
        }
    }
}
