//! Inertia of one coordinate.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Symbol};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Inertia of one coordinate: m a.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.1.
#[derive(Clone, Copy, Debug)]
pub struct Inertia;

as_object!(Inertia);

element_inputs!(InertiaInputs {
    coordinate: coordinate("coordinate that it acts on"),
    inertia: required("kg or kg·m²", 1.5, "mass or moment of inertia"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "inertia",
    family: Family::Body,
    inputs: INPUTS,
    measures: &[],
    about: "additional inertia of a coordinate",
    law: "the equation of the coordinate has the additional inertia force −inertia·q̈",
    symbol: Symbol::None,
};

impl Element for Inertia {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[0] = InertiaInputs(x.p).inertia() * x.a[0];
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn linear(&self) -> &'static [usize] {
        &[0]
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        Energy { kinetic: InertiaInputs(x.p).inertia() * x.v[0] * x.v[0] * 0.5, potential: T::zero() }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let inertia = InertiaInputs(p).inertia();
        (!(inertia > 0.0)).then(|| format!("its inertia is {inertia}"))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Gives a coordinate inertia (kg or kg·m²).
    pub fn inertia(&mut self, name: &str, coordinate: Coordinate, inertia: S) -> ElementIndex {
        self.add_object(name.into(), Inertia::object(), &[coordinate], &[inertia])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, rows};

    #[test]
    fn three_kilograms_accelerated_at_two() {
        let x = ElementState { t: 0.0, p: &[3.0], q: &[9.0], v: &[4.0], a: &[2.0], l: &[], sides: Default::default() };
        close(&rows(&Inertia, &x).0, &[6.0]);
        close(&energies(&Inertia, &x), &[24.0, 0.0]);
        assert!(Inertia.validate_parameters(&[-1.0]).is_some());
    }
}
