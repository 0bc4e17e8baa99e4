//! Friction in a straight guide or slot, from its own reaction.

use crate::elements::forces::friction::smooth_magnitude;
use crate::elements::joints::point_on_line::Offset;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Mechanism};
use crate::{Result, as_object, element_inputs};
use autodiff::Scalar;

/// Coulomb friction of a slider in its guide, or of a pin in its slot: the reaction of a prismatic or point-on-line joint.
///
/// $$ F = \mu\,(N_1 + N_2) \tanh(v / v_s) ,\qquad N_{1,2} = \Bigl|\frac{\lambda_1}{2} \pm \frac{\lambda_2}{\ell}\Bigr| $$
///
/// A slider touches its guide at two points, at the distance ℓ along the line. They carry the normal force λ₁ and the torque λ₂
/// of the joint: a short slider with a lateral load jams. With ℓ = 0, and for a pin in a slot, there is one point with the
/// force λ₁. v is the velocity of B along the line, in the body of A. Magnitudes are smooth where they vanish:
/// |N| = N²/√(N² + N₀²).
///
/// Analyses treat it as [`RevoluteFriction`](super::RevoluteFriction).
///
/// # Sources
/// Haug, Wu & Yang, *Mech. Mach. Theory* 21 (1986) 401–406.
#[derive(Clone, Copy, Debug)]
pub struct GuideFriction;

as_object!(GuideFriction);

element_inputs!(GuideFrictionInputs {
    coefficient: required("", 0.2, "coefficient of friction"),
    speed: required("m/s", 0.1, "transition speed, over which the force rises"),
    length: optional(
        "0",
        "m",
        0.05,
        "distance of the two contact points of a slider along the line; with 0 it touches in one point and the torque has no effect"
    ),
    transition_force: optional("1e-3", "N", 0.01, "force below which the magnitude of a normal force is smooth"),
    joint: joint(KINDS, "prismatic or point-on-line joint whose reaction presses the surfaces together"),
});

/// Number of parameters before those of the joint.
const OWN: usize = 4;

/// Kinds of joints with this friction.
const KINDS: &[&str] = &["prismatic", "point-on-line"];

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "guide-friction",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("force", "N", "force, positive if b moves along the line of a"),
        Measure::new("normal_force", "N", "sum of the normal forces, N"),
        Measure::new("power", "W", "power that becomes heat"),
    ],
    about: "Coulomb friction in a prismatic or point-on-line joint, from its own reaction",
    law: "force = coefficient·N·tanh(v/speed) with the velocity v of b along the line; it acts on b against v, and its opposite on \
          a. N = |λ₁/2 + λ₂/length| + |λ₁/2 − λ₂/length| with force λ₁ and moment λ₂ of a prismatic joint, or N = |λ₁| if length = 0 \
          and for a pin in a slot; each |N| is smoothed as N²/√(N² + transition_force²)",
    symbol: Symbol::JointFriction,
};

impl GuideFriction {
    /// Force along the line and normal force, with the velocity `rate`.
    fn load<T: Scalar>(x: &ElementState<'_, T>, rate: T) -> [T; 2] {
        let p = GuideFrictionInputs(x.p);
        let magnitude = |force: T| smooth_magnitude(force * force, p.transition_force());
        let normal = match *x.l {
            [force, moment] if p.length().re() > 0.0 => {
                let (half, couple) = (force * 0.5, moment / p.length());
                magnitude(half + couple) + magnitude(half - couple)
            }
            _ => magnitude(x.l[0]),
        };
        [p.coefficient() * normal * (rate / p.speed()).tanh(), normal]
    }

    /// The line of the joint, and the velocity of B along it.
    fn line<T: Scalar>(x: &ElementState<'_, T>) -> (Offset<T>, T) {
        let joint = ElementState { p: &x.p[OWN..], ..*x };
        let offset = Offset::of(&joint);
        let rate = offset.sliding(x);
        (offset, rate)
    }
}

impl Element for GuideFriction {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let (line, rate) = Self::line(x);
        let [force, _] = Self::load(x, rate);
        line.push_along(-force, dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let (_, rate) = Self::line(x);
        let [force, normal] = Self::load(x, rate);
        (out[0], out[1], out[2]) = (force, normal, force * rate);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = GuideFrictionInputs(p);
        let flaws = [
            (p.coefficient() >= 0.0, "coefficient of friction", p.coefficient()),
            (p.speed() > 0.0, "transition speed", p.speed()),
            (p.length() >= 0.0, "length", p.length()),
            (p.transition_force() > 0.0, "transition force", p.transition_force()),
        ];
        flaws.into_iter().find(|(is_right, ..)| !is_right).map(|(_, what, value)| format!("its {what} is {value}"))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds friction to a prismatic or point-on-line joint: coefficient, transition speed (m/s), distance of the contact points
    /// (m; 0 for one point), transition force (N).
    ///
    /// # Errors
    /// [`Error::Definition`](crate::Error::Definition) if `joint` is of another kind.
    pub fn guide_friction(&mut self, name: &str, joint: ElementIndex, parameters: [S; 4]) -> Result<ElementIndex> {
        self.add_on_joint(name.into(), GuideFriction::object(), joint, KINDS, &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, moving, rows};

    /// Coefficient, speed, length and transition force; the line of the joint is along x of A.
    fn parameters(length: f64) -> [f64; 10] {
        [0.5, 0.01, length, 1e-9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    #[test]
    fn a_slider_with_and_without_torque() {
        let (q, v) = ([0.0, 0.0, 0.0, 2.0, 0.0, 0.0], [0.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
        // Two points at ±0.1 m: 10 N and 3 N·m make 20 N and −10 N.
        let p = parameters(0.2);
        close(&measured(&GuideFriction, &moving(&p, &q, &v, &[10.0, 3.0])), &[15.0, 30.0, 45.0]);
        close(&rows(&GuideFriction, &moving(&p, &q, &v, &[10.0, 3.0])).0, &[-15.0, 0.0, 0.0, 15.0, 0.0, 0.0]);
        let p = parameters(0.0);
        close(&measured(&GuideFriction, &moving(&p, &q, &v, &[10.0, 3.0])), &[5.0, 10.0, 15.0]);
        close(&measured(&GuideFriction, &moving(&p[..9], &q, &v, &[-10.0])), &[5.0, 10.0, 15.0]);
    }

    #[test]
    fn the_rows_do_the_work_of_friction_in_any_motion() {
        let (q, v) = ([0.3, -0.2, 0.4, 1.3, 0.5, -0.7], [0.3, 0.1, 2.0, -1.0, 0.5, -3.0]);
        let p = [0.5, 0.4, 0.3, 1e-3, 0.1, 0.2, 0.3, -0.1, 0.2, 0.0];
        let x = moving(&p, &q, &v, &[-7.0, 2.0]);
        let work: f64 = rows(&GuideFriction, &x).0.iter().zip(&v).map(|(row, v)| row * v).sum();
        close(&[work], &measured(&GuideFriction, &x)[2..]);
    }
}
