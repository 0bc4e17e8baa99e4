//! The constraint that Euler parameters have the length one.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Symbol};
use crate::mechanism::frame3::euler_parameters;
use crate::mechanism::rotation::square;
use crate::mechanism::{Body3, ElementInstance, Mechanism, Pose3};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Unit length of the Euler parameters of a body: Φ = ½ (eᵀe − 1).
///
/// Its multiplier is zero, as no other element does work on changes of |e|. Bodies and frames have this constraint from the
/// start.
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 6.3.
#[derive(Clone, Copy, Debug)]
pub struct Normalization;

as_object!(Normalization);

element_inputs!(NormalizationInputs { body: body3("its coordinates x, y, z and Euler parameters") });

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "normalization",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[],
    about: "the length one of the Euler parameters of a body",
    law: "",
    symbol: Symbol::None,
};

impl Element for Normalization {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let e = euler_parameters(x.q, 0);
        constraint[0] = (square(&e) - 1.0) * 0.5;
        dynamics[3..].iter_mut().zip(e).for_each(|(row, e)| *row = e * x.l[0]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2]
    }
}

/// Body or frame in space to which an element belongs that is a normalization: its name without the end `.e`.
pub(crate) fn normalized_frame<S>(instance: &ElementInstance<S>) -> Option<&str> {
    let is_normalization = instance.element.descriptor().is_some_and(|own| std::ptr::eq(own, &DESCRIPTOR));
    is_normalization.then(|| instance.name.strip_suffix(".e").unwrap_or(&instance.name))
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a frame without mass in space, to which elements may add inertia.
    pub fn massless_frame3(&mut self, name: &str, pose: Pose3<S>) -> Body3 {
        let frame = self.coordinates3(name, pose);
        self.add_object(format!("{name}.e"), Normalization::object(), &frame.coordinates(), &[]);
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};

    #[test]
    fn half_of_the_excess_of_the_squared_length() {
        let (dynamics, constraint) = rows(&Normalization, &at(&[], &[9.0, 9.0, 9.0, 1.0, 0.5, -0.5, 0.5], &[2.0]));
        close(&constraint, &[0.375]);
        close(&dynamics, &[0.0, 0.0, 0.0, 2.0, 1.0, -1.0, 1.0]);
    }
}
