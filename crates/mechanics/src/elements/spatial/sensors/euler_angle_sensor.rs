//! A sensor for Euler angles.

use crate::element_inputs;
use crate::elements::spatial::line3::{MarkerPair, check_ends, ends3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::rotation::EulerSequence;
use crate::mechanism::vector::dot;
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use autodiff::Scalar;

/// A sensor for the Euler angles of marker B relative to marker A, for a sequence of axes.
///
/// The angles jump by 2π, and are not unique in the singular positions of the sequence, see [`EulerSequence`]. Use
/// [`Mechanism::joint_angle`] for the angle of a joint, which counts turns.
#[derive(Clone, Copy, Debug)]
pub struct EulerAngleSensor(pub EulerSequence);

element_inputs!(EulerAngleInputs { a: marker3("marker that it measures from"), b: marker3("marker that it measures") });

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "euler-angle-sensor",
    family: Family::Sensor,
    inputs: INPUTS,
    measures: &[
        Measure::new("first", "rad", "angle about the first axis of the sequence, from −π to π"),
        Measure::new("second", "rad", "angle about the second axis of the sequence"),
        Measure::new("third", "rad", "angle about the third axis of the sequence, from −π to π"),
    ],
    about: "measures Euler angles of b relative to a",
    law: "",
    symbol: Symbol::None,
};

/// Rotation matrix of marker B relative to marker A.
fn relative<T: Scalar>(x: &ElementState<'_, T>) -> [[T; 3]; 3] {
    let MarkerPair { a, b } = MarkerPair::of(x);
    a.axes.map(|row| b.axes.map(|column| dot(row, column)))
}

impl Element for EulerAngleSensor {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _dynamics: &mut [T], _constraint: &mut [T]) {}

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out.copy_from_slice(&self.0.angles(&relative(x)));
    }

    fn warn_of_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        self.0.is_singular(&relative(x)).then(|| {
            "the first and the last of its angles, such as yaw and roll at a pitch of ±90°, are not unique: the last one is set to zero, \
             and the angles have no derivatives; measure a point or a joint angle"
                .to_owned()
        })
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_ends(p)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Measures the Euler angles of `b` relative to `a` for a sequence of axes.
    pub fn euler_angle_sensor(
        &mut self,
        name: &str,
        a: Marker3<S>,
        b: Marker3<S>,
        sequence: EulerSequence,
    ) -> ElementIndex {
        let (coordinates, p) = ends3(a, b);
        self.add(name, EulerAngleSensor(sequence), &coordinates, &p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured};
    use crate::elements::spatial::line3::{points, upright};
    use crate::mechanism::Rotation;

    #[test]
    fn precession_nutation_and_spin_relative_to_a_turned_body() {
        let mut q = upright([0.0; 3], [0.0; 3]);
        let (first, relative) = (Rotation::about([1.0, 2.0, -1.0], 0.7), [0.3, 1.1, -2.0]);
        q[3..7].copy_from_slice(&first.parameters());
        q[10..].copy_from_slice(&first.then(Rotation::euler_angles(EulerSequence::Zxz, relative)).parameters());
        let p = points([0.0; 3], [0.0; 3]);
        close(&measured(&EulerAngleSensor(EulerSequence::Zxz), &at(&p, &q, &[])), &relative);
    }
}
