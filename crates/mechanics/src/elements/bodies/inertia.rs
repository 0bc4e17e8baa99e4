//! Inertia of one coordinate.

use crate::elements::element::{Element, ElementState, Energy};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// Inertia of one coordinate: m a. Parameter m (kg or kg·m²).
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.1.
#[derive(Clone, Copy, Debug)]
pub struct Inertia;

impl Element for Inertia {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        dynamics[0] = x.p[0] * x.a[0];
    }

    fn linear(&self) -> &'static [usize] {
        &[0]
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        Energy { kinetic: x.p[0] * x.v[0] * x.v[0] * 0.5, potential: T::zero() }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        (!(p[0] > 0.0)).then(|| format!("its inertia is {}", p[0]))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Gives a coordinate inertia (kg or kg·m²).
    pub fn inertia(&mut self, name: &str, coordinate: Coordinate, inertia: S) -> ElementIndex {
        self.add(name, Inertia, &[coordinate], &[inertia])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, rows};

    #[test]
    fn three_kilograms_accelerated_at_two() {
        let x = ElementState { t: 0.0, p: &[3.0], q: &[9.0], v: &[4.0], a: &[2.0], l: &[] };
        close(&rows(&Inertia, &x).0, &[6.0]);
        close(&energies(&Inertia, &x), &[24.0, 0.0]);
        assert!(Inertia.validate_parameters(&[-1.0]).is_some());
    }
}
