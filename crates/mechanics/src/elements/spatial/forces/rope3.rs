//! A rope in space, which pulls and does not push.

use crate::elements::forces::rope::{RopeLaw, SWITCHING_FUNCTIONS};
use crate::elements::spatial::line3::{Line3, check_ends, ends3, without_direction3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A rope, cable or chain between two points in space, with the tension of [`Rope`](crate::elements::Rope).
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445, with the exponent 1.
#[derive(Clone, Copy, Debug)]
pub struct Rope3;

as_object!(Rope3);

element_inputs!(Rope3Inputs {
    a: marker3("point of the first body"),
    b: marker3("point of the second body"),
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

impl<T: Scalar> Rope3Inputs<'_, T> {
    fn law(self) -> RopeLaw<T> {
        RopeLaw { stiffness: self.stiffness(), damping: self.damping(), length: self.length() }
    }
}

impl Element for Rope3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let line = Line3::of(x);
        if let Some(tension) = Rope3Inputs(x.p).law().tension([line.length, line.rate], x.sides) {
            line.add_axial_force(tension, dynamics);
        }
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn switching_functions<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut Vec<T>) {
        let line = Line3::of(x);
        Rope3Inputs(x.p).law().switching_functions([line.length, line.rate], out);
    }

    fn num_switching_functions(&self) -> usize {
        SWITCHING_FUNCTIONS
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_ends(p).or_else(|| Rope3Inputs(p).law().validate())
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        let is_taut = Rope3Inputs(x.p).length() <= 0.0;
        if is_taut { without_direction3(x) } else { None }
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line3::of(x);
        let tension = Rope3Inputs(x.p).law().tension([line.length, line.rate], x.sides);
        (out[0], out[1], out[2]) = (tension.unwrap_or(T::zero()), line.length, line.rate);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        Rope3Inputs(x.p).law().energy(Line3::of(x).length, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a rope between two points in space: stiffness (N/m), damping (s/m), unloaded length (m).
    pub fn rope3(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>, parameters: [S; 3]) -> ElementIndex {
        let (coordinates, p) = ends3(a, b);
        self.add_object(name.into(), Rope3::object(), &coordinates, &[&p[..], &parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::spatial::line3::{points, upright};

    #[test]
    fn it_pulls_when_taut_and_never_pushes() {
        // One metre longer than six: 7·1·(1 + 0.5·1.4) = 11.9 N along (2, 3, 6)/7.
        let parameters =
            |damping: f64, length: f64| [&points([0.0; 3], [0.0; 3])[..], &[7.0, damping, length]].concat();
        let (q, mut v) = (upright([0.0; 3], [2.0, 3.0, 6.0]), [0.0; 14]);
        (v[7], v[8], v[9]) = (0.4, 0.6, 1.2);
        let p = parameters(0.5, 6.0);
        let x = moving(&p, &q, &v, &[]);
        close(&rows(&Rope3, &x).0[7..10], &[3.4, 5.1, 10.2]);
        close(&measured(&Rope3, &x), &[11.9, 7.0, 1.4]);
        close(&energies(&Rope3, &x), &[0.0, 3.5]);
        for p in [parameters(0.5, 8.0), parameters(-1.0, 6.0)] {
            close(&rows(&Rope3, &moving(&p, &q, &v, &[])).0, &[0.0; 14]);
        }
        let here = upright([0.0; 3], [0.0; 3]);
        close(&rows(&Rope3, &moving(&p, &here, &v, &[])).0, &[0.0; 14]);
        assert!(Rope3.validate_parameters(&parameters(-0.5, 6.0)).unwrap().contains("damping is -0.5"));
    }
}
