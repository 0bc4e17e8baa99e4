//! For tests: what an element does in a given state.

use crate::multibody::element::{Element, Energy, Local};

/// Rows of the coordinates and of the multipliers.
pub fn rows(element: &impl Element, x: &Local<'_, f64>) -> (Vec<f64>, Vec<f64>) {
    let (mut balance, mut closure) = (vec![0.0; x.q.len()], vec![0.0; x.l.len()]);
    Element::residual(element, x, &mut balance, &mut closure);
    (balance, closure)
}

/// The outputs.
pub fn measured(element: &impl Element, x: &Local<'_, f64>) -> Vec<f64> {
    let mut out = vec![0.0; Element::measures(element).len()];
    Element::measure(element, x, &mut out);
    out
}

/// Kinetic and potential energy.
pub fn energies(element: &impl Element, x: &Local<'_, f64>) -> [f64; 2] {
    let Energy { kinetic, potential } = Element::energy(element, x);
    [kinetic, potential]
}

/// A state at rest at t = 0.
pub fn at<'a>(p: &'a [f64], q: &'a [f64], l: &'a [f64]) -> Local<'a, f64> {
    moving(p, q, &REST[..q.len()], l)
}

/// A state without accelerations at t = 0.
pub fn moving<'a>(p: &'a [f64], q: &'a [f64], v: &'a [f64], l: &'a [f64]) -> Local<'a, f64> {
    Local { t: 0.0, p, q, v, a: &REST[..q.len()], l }
}

const REST: [f64; 8] = [0.0; 8];

/// Asserts that numbers agree to rounding.
#[track_caller]
pub fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{found:?} instead of {expected:?}");
    }
}
