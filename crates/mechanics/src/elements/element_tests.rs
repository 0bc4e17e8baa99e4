//! Evaluation of an element in a given state, for tests.

use crate::mechanism::element::{ConstraintDerivatives, Element, ElementState, Energy, Variable};
use autodiff::{DualVec, Jet2};

/// Rows of the coordinates and of the multipliers.
pub fn rows(element: &impl Element, x: &ElementState<'_, f64>) -> (Vec<f64>, Vec<f64>) {
    let (mut dynamics, mut constraint) = (vec![0.0; x.q.len()], vec![0.0; x.l.len()]);
    Element::residual(element, x, &mut dynamics, &mut constraint);
    (dynamics, constraint)
}

/// The measured quantities.
pub fn measured(element: &impl Element, x: &ElementState<'_, f64>) -> Vec<f64> {
    let mut out = vec![0.0; Element::measures(element).len()];
    Element::measure(element, x, &mut out);
    out
}

/// Kinetic and potential energy.
pub fn energies(element: &impl Element, x: &ElementState<'_, f64>) -> [f64; 2] {
    let Energy { kinetic, potential } = Element::energy(element, x);
    [kinetic, potential]
}

/// A state at rest at t = 0.
pub fn at<'a>(p: &'a [f64], q: &'a [f64], l: &'a [f64]) -> ElementState<'a, f64> {
    moving(p, q, &REST[..q.len()], l)
}

/// A state without accelerations at t = 0.
pub fn moving<'a>(p: &'a [f64], q: &'a [f64], v: &'a [f64], l: &'a [f64]) -> ElementState<'a, f64> {
    ElementState { t: 0.0, p, q, v, a: &REST[..q.len()], l, sides: Default::default() }
}

const REST: [f64; 16] = [0.0; 16];

/// Asserts that numbers agree to rounding.
#[track_caller]
pub fn close(computed: &[f64], expected: &[f64]) {
    assert_eq!(computed.len(), expected.len(), "{computed:?} {expected:?}");
    for (a, b) in computed.iter().zip(expected) {
        assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{computed:?} instead of {expected:?}");
    }
}

/// Asserts that the closed form of a constraint's derivatives equals the derivatives of its residual by automatic
/// differentiation.
#[track_caller]
pub fn has_its_constraint_derivatives(element: &impl Element, x: &ElementState<'_, f64>) {
    let coordinates = (0..x.q.len()).map(Variable::Coordinate);
    let variables: Vec<_> = coordinates.chain((0..x.p.len()).map(Variable::Parameter)).collect();
    let (n, m) = (x.q.len(), x.l.len());
    let (mut dynamics, mut constraint) = (vec![0.0; variables.len() * n], vec![[0.0; 3]; variables.len() * m]);
    let mut derivatives = ConstraintDerivatives { dynamics: &mut dynamics, constraint: &mut constraint };
    assert!(Element::constraint_derivatives(element, x, &variables, &mut derivatives), "it has a closed form");
    for (k, variable) in variables.iter().enumerate() {
        let [dynamics_rows, constraint_rows] = jets(element, x, *variable);
        close(&dynamics[k * n..(k + 1) * n], &dynamics_rows);
        close(constraint[k * m..(k + 1) * m].as_flattened(), &constraint_rows);
    }
}

/// Derivatives of the coordinates' rows, and of Φ, Φ̇ and Φ̈.
fn jets(element: &impl Element, x: &ElementState<'_, f64>, variable: Variable) -> [Vec<f64>; 2] {
    type TimeJet = Jet2<DualVec<1>>;
    let number = DualVec::<1>::constant;
    let jet = |re: f64, v1: f64, v2: f64| TimeJet::new(number(re), number(v1), number(v2));
    let constants = |values: &[f64]| -> Vec<TimeJet> { values.iter().map(|&value| jet(value, 0.0, 0.0)).collect() };
    let mut q: Vec<_> = (0..x.q.len()).map(|i| jet(x.q[i], x.v[i], x.a[i])).collect();
    let (mut p, l, still) = (constants(x.p), constants(x.l), constants(&vec![0.0; x.q.len()]));
    match variable {
        Variable::Coordinate(i) => q[i].re.eps[0] = 1.0,
        Variable::Parameter(i) => p[i].re.eps[0] = 1.0,
    }
    let (mut dynamics, mut constraint) = (still.clone(), constants(&vec![0.0; x.l.len()]));
    let local =
        ElementState { t: jet(x.t, 1.0, 0.0), p: &p, q: &q, v: &still, a: &still, l: &l, sides: Default::default() };
    Element::residual(element, &local, &mut dynamics, &mut constraint);
    let derivatives = |x: &TimeJet| [x.re.eps[0], x.v1.eps[0], x.v2.eps[0]];
    [dynamics.iter().map(|x| x.re.eps[0]).collect(), constraint.iter().flat_map(derivatives).collect()]
}
