//! A rope, which pulls and does not push.

use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::element::{
    Element, ElementDescriptor, ElementState, Energy, Family, Measure, SwitchSides, Symbol,
};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A rope, cable or chain between two points: tension k e (1 + c ė) while it is longer than its unloaded length by e, never
/// negative, and no force while it is slack.
///
/// Damping is proportional to the elongation, so that the tension is continuous where the rope becomes taut. Explicit schemes
/// end a step there.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445, with the exponent 1.
#[derive(Clone, Copy, Debug)]
pub struct Rope;

as_object!(Rope);

element_inputs!(RopeInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    stiffness: required("N/m", 15.0, "stiffness EA/L of the taut rope"),
    damping: optional("0", "s/m", 0.1, "damping"),
    length: required("m", 0.3, "unloaded length"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "rope",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("tension", "N", "tension, zero while the rope is slack"),
        Measure::new("length", "m", "distance of the points"),
        Measure::new("rate", "m/s", "rate of the distance"),
    ],
    about: "a rope or cable, which pulls two points together and does not push",
    law: "tension = stiffness·e·(1 + damping·ė), at least 0, with the elongation e = L − length; 0 where e < 0",
    symbol: Symbol::Rope,
};

/// Switching functions: the elongation e, and the factor 1 + c ė of a tension that would push.
const ELONGATION: usize = 0;
const FACTOR: usize = 1;

/// Number of [`RopeLaw::switching_functions`].
pub(crate) const SWITCHING_FUNCTIONS: usize = 2;

/// The tension of a rope, in the plane and in space.
pub(crate) struct RopeLaw<T> {
    /// k in N/m.
    pub stiffness: T,
    /// c in s/m.
    pub damping: T,
    /// Unloaded length in m.
    pub length: T,
}

impl<T: Scalar> RopeLaw<T> {
    /// The factor 1 + c ė at this rate of the distance in m/s.
    fn factor(&self, rate: T) -> T {
        self.damping * rate + 1.0
    }

    /// The tension at this distance of the ends with its rate, or `None` if the rope does not pull.
    pub fn tension(&self, [distance, rate]: [T; 2], sides: SwitchSides) -> Option<T> {
        let (elongation, factor) = (distance - self.length, self.factor(rate));
        let pulls = sides.is_positive(ELONGATION, elongation.re()) && sides.is_positive(FACTOR, factor.re());
        pulls.then(|| self.stiffness * elongation * factor)
    }

    /// Writes the functions at whose zeros the tension is not smooth.
    pub fn switching_functions(&self, [distance, rate]: [T; 2], out: &mut Vec<T>) {
        let elongation = distance - self.length;
        out.push(elongation);
        out.push(if elongation.re() > 0.0 { self.factor(rate) } else { T::from(1.0) });
    }

    /// The energy stored at this distance of the ends.
    pub fn energy(&self, distance: T, sides: SwitchSides) -> Energy<T> {
        let elongation = distance - self.length;
        let is_taut = sides.is_positive(ELONGATION, elongation.re());
        let potential = if is_taut { self.stiffness * elongation * elongation * 0.5 } else { T::zero() };
        Energy { kinetic: T::zero(), potential }
    }
}

impl RopeLaw<f64> {
    /// Describes a negative parameter.
    pub fn validate(&self) -> Option<String> {
        let values = [
            ("stiffness", self.stiffness, "N/m"),
            ("damping", self.damping, "s/m"),
            ("unloaded length", self.length, "m"),
        ];
        let negative = values.into_iter().find(|(_, value, _)| !(*value >= 0.0))?;
        Some(format!("its {} is {} {}", negative.0, negative.1, negative.2))
    }
}

impl<T: Scalar> RopeInputs<'_, T> {
    fn law(self) -> RopeLaw<T> {
        RopeLaw { stiffness: self.stiffness(), damping: self.damping(), length: self.length() }
    }
}

impl Element for Rope {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let line = Line::of(x);
        if let Some(tension) = RopeInputs(x.p).law().tension([line.length, line.rate], x.sides) {
            line.add_axial_force(tension, dynamics);
        }
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn switching_functions<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut Vec<T>) {
        let line = Line::of(x);
        RopeInputs(x.p).law().switching_functions([line.length, line.rate], out);
    }

    fn num_switching_functions(&self) -> usize {
        SWITCHING_FUNCTIONS
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        RopeInputs(p).law().validate()
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        let is_taut = RopeInputs(x.p).length() <= 0.0;
        if is_taut { without_direction(x) } else { None }
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        let tension = RopeInputs(x.p).law().tension([line.length, line.rate], x.sides);
        (out[0], out[1], out[2]) = (tension.unwrap_or(T::zero()), line.length, line.rate);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        RopeInputs(x.p).law().energy(Line::of(x).length, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a rope between two points: stiffness (N/m), damping (s/m), unloaded length (m).
    pub fn rope(&mut self, name: &str, a: Marker<S>, b: Marker<S>, parameters: [S; 3]) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add_object(name.into(), Rope::object(), &coordinates, &[&p[..], &parameters[..]].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::line::three_four_five;

    fn parameters(damping: f64, length: f64) -> [f64; 7] {
        [0.0, 0.0, 0.0, 0.0, 7.0, damping, length]
    }

    #[test]
    fn it_pulls_when_taut_and_never_pushes() {
        let (q, v) = three_four_five();
        // One metre longer than four: 7 · 1 · (1 + 0.5 · 2.2) = 14.7 N along (0.6, 0.8).
        let p = parameters(0.5, 4.0);
        let x = moving(&p, &q, &v, &[]);
        close(&rows(&Rope, &x).0, &[-8.82, -11.76, 0.0, 8.82, 11.76, 0.0]);
        close(&measured(&Rope, &x), &[14.7, 5.0, 2.2]);
        close(&energies(&Rope, &x), &[0.0, 3.5]);
        for p in [parameters(0.5, 6.0), parameters(-0.5, 4.0)] {
            let slack = moving(&p, &q, &v, &[]);
            close(&rows(&Rope, &slack).0, &[0.0; 6]);
            assert_eq!(measured(&Rope, &slack)[0], 0.0);
        }
    }

    #[test]
    fn a_slack_rope_of_points_that_coincide_has_no_force() {
        let p = parameters(0.5, 4.0);
        close(&rows(&Rope, &moving(&p, &[0.0; 6], &[0.0; 6], &[])).0, &[0.0; 6]);
    }
}
