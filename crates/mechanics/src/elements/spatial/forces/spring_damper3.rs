//! A spring and damper between two points in space.

use crate::elements::forces::spring_damper::warn_of_turning;
use crate::elements::spatial::line3::{Line3, check_ends, ends3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A spring and damper between two points in space: tension k (L − L₀) + k₃ (L − L₀)³ + c L̇.
///
/// If the points coincide, the force is that of [`SpringDamper`](crate::elements::SpringDamper) in the plane.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 11.3.
#[derive(Clone, Copy, Debug)]
pub struct SpringDamper3;

as_object!(SpringDamper3);

element_inputs!(SpringDamper3Inputs {
    a: marker3("point of the first body"),
    b: marker3("point of the second body"),
    stiffness: required("N/m", 15.0, "stiffness"),
    damping: optional("0", "N·s/m", 1.0, "damping"),
    length: optional("0", "m", 0.7, "unloaded length"),
    cubic: optional("0", "N/m³", 3.0, "cubic stiffness"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "spring",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("tension", "N", "force of spring and damper, positive if it pulls the points together"),
        Measure::new("length", "m", "distance of the points"),
        Measure::new("rate", "m/s", "rate of the distance"),
    ],
    about: "a spring and damper between two points",
    law: "tension = stiffness·(L − length) + cubic·(L − length)³ + damping·L̇ with the distance L of the points",
    symbol: Symbol::Spring,
};

fn tension<T: Scalar>(x: &ElementState<'_, T>, line: &Line3<T>) -> T {
    let p = SpringDamper3Inputs(x.p);
    let elongation = line.length - p.length();
    p.stiffness() * elongation + p.cubic() * elongation.powi(3) + p.damping() * line.rate
}

impl Element for SpringDamper3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let line = Line3::of(x);
        if line.is_point() {
            let p = SpringDamper3Inputs(x.p);
            let stiffness = p.stiffness() + p.cubic() * p.length() * p.length() * 3.0;
            line.apply([0, 1, 2].map(|k| stiffness * line.gap[k] + p.damping() * line.gap_rate[k]), dynamics);
        } else {
            line.add_axial_force(tension(x, &line), dynamics);
        }
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line3::of(x);
        (out[0], out[1], out[2]) = (tension(x, &line), line.length, line.rate);
    }

    fn warn_of_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        let p = SpringDamper3Inputs(x.p);
        warn_of_turning(Line3::of(x).length, p.length(), [p.stiffness(), p.cubic()])
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let p = SpringDamper3Inputs(x.p);
        let elongation = Line3::of(x).length - p.length();
        let potential = p.stiffness() * elongation.powi(2) * 0.5 + p.cubic() * elongation.powi(4) * 0.25;
        Energy { kinetic: T::zero(), potential }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_ends(p)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a linear spring and damper between two points in space: stiffness, damping, unloaded length.
    pub fn spring_damper3(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>, [k, c, length]: [S; 3]) -> ElementIndex {
        self.nonlinear_spring3(name, a, b, [k, c, length, S::zero()])
    }

    /// Adds a spring and damper with a cubic term between two points in space: stiffness, damping, unloaded length, cubic
    /// stiffness.
    pub fn nonlinear_spring3(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>, parameters: [S; 4]) -> ElementIndex {
        let (coordinates, p) = ends3(a, b);
        self.add_object(name.into(), SpringDamper3::object(), &coordinates, &[&p[..], &parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::spatial::line3::{points, upright};

    #[test]
    fn seven_metres_long_unloaded_at_six() {
        // 7·1 + 2·1³ + 10·1.4 = 23 N along (2, 3, 6)/7; ½·7 + ¼·2 = 4 J.
        let p = [&points([0.0; 3], [0.0; 3])[..], &[7.0, 10.0, 6.0, 2.0]].concat();
        let (q, mut v) = (upright([0.0; 3], [2.0, 3.0, 6.0]), [0.0; 14]);
        (v[7], v[8], v[9]) = (0.4, 0.6, 1.2);
        let x = moving(&p, &q, &v, &[]);
        close(&rows(&SpringDamper3, &x).0[7..10], &[46.0 / 7.0, 69.0 / 7.0, 138.0 / 7.0]);
        close(&measured(&SpringDamper3, &x), &[23.0, 7.0, 1.4]);
        close(&energies(&SpringDamper3, &x), &[0.0, 4.0]);
        let here = upright([0.0; 3], [0.0; 3]);
        close(&rows(&SpringDamper3, &moving(&p, &here, &v, &[])).0[7..10], &[4.0, 6.0, 12.0]);
    }
}
