//! A bump stop between two coordinates.

use crate::elements::contacts::hunt_crossley::{self, contact_force};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::frame::write_force_pair;
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A bump stop: a contact force k δ^{3/2} (1 + 1.5 c δ̇), never negative, while q_B − q_A is below a limit by δ.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct BumpStop;

as_object!(BumpStop);

element_inputs!(BumpStopInputs {
    a: coordinate_or("ground.x", "coordinate that it acts against"),
    b: coordinate("coordinate that it acts on"),
    stiffness: required("N/m^1.5 or N·m/rad^1.5", 1e3, "stiffness"),
    damping: optional("0", "s/m or s/rad", 0.1, "damping"),
    limit: required("m or rad", 0.02, "limit of b − a"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "bump-stop",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[Measure::new("contact_force", "N or N·m", "contact force or torque, which acts towards larger b − a")],
    about: "a compliant stop that keeps b − a above a limit",
    law: "contact_force = stiffness·δ^1.5·(1 + 1.5·damping·δ̇), at least 0, with the depth δ = limit − (b − a); 0 where δ < 0",
    symbol: Symbol::Stop,
};

impl BumpStop {
    fn contact_force<T: Scalar>(x: &ElementState<'_, T>) -> T {
        let p = BumpStopInputs(x.p);
        let (depth, rate) = Self::depth(x);
        contact_force(p.stiffness(), p.damping(), depth, rate, x.sides)
    }

    /// Depth of the contact and its rate.
    fn depth<T: Scalar>(x: &ElementState<'_, T>) -> (T, T) {
        (BumpStopInputs(x.p).limit() - (x.q[1] - x.q[0]), x.v[0] - x.v[1])
    }
}

impl Element for BumpStop {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        write_force_pair(dynamics, Self::contact_force(x));
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_switching_functions(&self) -> usize {
        hunt_crossley::SWITCHING_FUNCTIONS
    }

    fn num_fractional_powers(&self) -> usize {
        hunt_crossley::FRACTIONAL_POWERS
    }

    fn switching_functions<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut Vec<T>) {
        let (depth, rate) = Self::depth(x);
        hunt_crossley::switching_functions(BumpStopInputs(x.p).damping(), depth, rate, out);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = BumpStopInputs(p);
        hunt_crossley::validate(p.stiffness(), p.damping())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = Self::contact_force(x);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        hunt_crossley::stored_energy(BumpStopInputs(x.p).stiffness(), Self::depth(x).0, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps `b` − `a` above a limit by a smooth contact force: stiffness, damping, limit.
    pub fn bump_stop(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 3]) -> ElementIndex {
        self.add_object(name.into(), BumpStop::object(), &[a, b], &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, moving, rows};

    #[test]
    fn four_centimetres_deep_and_closing() {
        // 1000 · 0.04^1.5 · (1 + 1.5 · 0.2 · 0.5) = 9.2 N.
        let x = moving(&[1000.0, 0.2, 0.1], &[0.0, 0.06], &[0.0, -0.5], &[]);
        close(&rows(&BumpStop, &x).0, &[9.2, -9.2]);
        close(&rows(&BumpStop, &moving(&[1000.0, 0.2, 0.1], &[0.0, 0.11], &[0.0, -0.5], &[])).0, &[0.0, 0.0]);
    }
}
