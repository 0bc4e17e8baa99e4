//! Friction in a revolute joint, from its own reaction.

use crate::elements::forces::friction::smooth_magnitude;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Mechanism};
use crate::{Result, as_object, element_inputs};
use autodiff::Scalar;

/// Coulomb friction of a pin in its bearing: the reaction of a revolute joint, at the radius of the pin.
///
/// $$ M = \mu\, r\, R \tanh(\omega / \omega_s) ,\qquad R = \frac{|\lambda|^2}{\sqrt{|\lambda|^2 + R_0^2}} ,\qquad
///    \omega = \dot\theta_B - \dot\theta_A $$
///
/// R is the magnitude of the reaction λ, smooth where it vanishes. For μ up to 0.3, μ is the coefficient of friction within 5 %:
/// in a bearing with clearance the lever is r sin φ with tan φ = μ.
///
/// M depends on the reaction, and the reaction on M. Implicit steps solve for both in their Newton iterations, explicit steps
/// and inverse dynamics by a Newton iteration for accelerations and reactions. In equilibrium there is no friction. Impulses
/// of the joint, at impacts, cause none.
///
/// # Sources
/// Haug, Wu & Yang, *Mech. Mach. Theory* 21 (1986) 401–406.
#[derive(Clone, Copy, Debug)]
pub struct RevoluteFriction;

as_object!(RevoluteFriction);

element_inputs!(RevoluteFrictionInputs {
    coefficient: required("", 0.2, "coefficient of friction"),
    radius: required("m", 0.01, "radius of the pin"),
    speed: required("rad/s", 0.1, "transition speed, over which the torque rises"),
    transition_force: optional("1e-3", "N", 0.01, "force below which the magnitude of the reaction is smooth"),
    joint: joint(KINDS, "revolute joint whose reaction presses the pin into its bearing"),
});

/// Kinds of joints with this friction.
const KINDS: &[&str] = &["revolute"];

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "revolute-friction",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("moment", "N·m", "torque, positive if b turns faster than a"),
        Measure::new("normal_force", "N", "force between pin and bearing, R"),
        Measure::new("power", "W", "power that becomes heat"),
    ],
    about: "Coulomb friction in a revolute joint, from its own reaction",
    law: "moment = coefficient·radius·R·tanh(ω/speed) with ω = θ̇_b − θ̇_a and R = |λ|²/√(|λ|² + transition_force²), where λ \
          is the force of the joint and a and b are its bodies; it acts on b against ω, and its opposite on a",
    symbol: Symbol::JointFriction,
};

impl RevoluteFriction {
    /// Torque and normal force.
    fn load<T: Scalar>(x: &ElementState<'_, T>) -> [T; 2] {
        let p = RevoluteFrictionInputs(x.p);
        let normal = smooth_magnitude(x.l[0] * x.l[0] + x.l[1] * x.l[1], p.transition_force());
        [p.coefficient() * p.radius() * normal * (Self::rate(x) / p.speed()).tanh(), normal]
    }

    /// Angular velocity of B relative to A.
    fn rate<T: Scalar>(x: &ElementState<'_, T>) -> T {
        x.v[5] - x.v[2]
    }
}

impl Element for RevoluteFriction {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let [moment, _] = Self::load(x);
        dynamics[2] -= moment;
        dynamics[5] += moment;
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let [moment, normal] = Self::load(x);
        (out[0], out[1], out[2]) = (moment, normal, moment * Self::rate(x));
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = RevoluteFrictionInputs(p);
        let flaws = [
            (p.coefficient() >= 0.0, "coefficient of friction", p.coefficient()),
            (p.radius() >= 0.0, "radius", p.radius()),
            (p.speed() > 0.0, "transition speed", p.speed()),
            (p.transition_force() > 0.0, "transition force", p.transition_force()),
        ];
        flaws.into_iter().find(|(is_right, ..)| !is_right).map(|(_, what, value)| format!("its {what} is {value}"))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds friction to a revolute joint: coefficient, radius of the pin (m), transition speed (rad/s), transition force (N).
    ///
    /// # Errors
    /// [`Error::Definition`](crate::Error::Definition) if `joint` is not a revolute joint.
    pub fn revolute_friction(&mut self, name: &str, joint: ElementIndex, parameters: [S; 4]) -> Result<ElementIndex> {
        self.add_on_joint(name.into(), RevoluteFriction::object(), joint, KINDS, &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, moving, rows};

    #[test]
    fn a_pin_of_20_mm_with_5_newtons_turns_fast() {
        let p = [0.2, 0.01, 0.1, 1e-9, 0.0, 0.0, 0.0, 0.0];
        let x = moving(&p, &[0.0; 6], &[0.0, 0.0, 1.0, 0.0, 0.0, 6.0], &[3.0, 4.0]);
        close(&rows(&RevoluteFriction, &x).0, &[0.0, 0.0, -0.01, 0.0, 0.0, 0.01]);
        close(&measured(&RevoluteFriction, &x), &[0.01, 5.0, 0.05]);
        let unloaded = moving(&p, &[0.0; 6], &[0.0, 0.0, 1.0, 0.0, 0.0, 6.0], &[0.0, 0.0]);
        close(&measured(&RevoluteFriction, &unloaded), &[0.0; 3]);
        assert!(RevoluteFriction.validate_parameters(&[0.2, 0.01, 0.0, 1e-3]).unwrap().contains("transition speed"));
    }
}
