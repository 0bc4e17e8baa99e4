//! A spring and damper between two points.

use crate::elements::line::{Line, ends};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A spring and damper between two points: tension k (L − L₀) + k₃ (L − L₀)³ + c L̇.
///
/// **Points that coincide.** On a straight path through L = 0 the direction changes sign, and so does the part of the force
/// that is not zero at L = 0. At L = 0 the force is the mean of both sides, (k + 3 k₃ L₀²) (r_B − r_A) + c (v_B − v_A), with
/// the derivatives of this expression. It is exact for L₀ = 0, where the force is continuous.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct SpringDamper;

as_object!(SpringDamper);

element_inputs!(SpringDamperInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
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

impl SpringDamper {
    fn tension<T: Scalar>(x: &ElementState<'_, T>, line: &Line<T>) -> T {
        let p = SpringDamperInputs(x.p);
        let elongation = line.length - p.length();
        p.stiffness() * elongation + p.cubic() * elongation.powi(3) + p.damping() * line.rate
    }
}

impl Element for SpringDamper {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let line = Line::of(x);
        if line.is_point() {
            let p = SpringDamperInputs(x.p);
            let stiffness = p.stiffness() + p.cubic() * p.length() * p.length() * 3.0;
            let force = [0, 1].map(|k| stiffness * line.gap[k] + p.damping() * line.gap_rate[k]);
            line.apply(force, dynamics);
        } else {
            line.add_axial_force(Self::tension(x, &line), dynamics);
        }
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        (out[0], out[1], out[2]) = (Self::tension(x, &line), line.length, line.rate);
    }

    fn warn_of_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        let p = SpringDamperInputs(x.p);
        warn_of_turning(Line::of(x).length, p.length(), [p.stiffness(), p.cubic()])
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let p = SpringDamperInputs(x.p);
        let elongation = Line::of(x).length - p.length();
        let potential = p.stiffness() * elongation.powi(2) * 0.5 + p.cubic() * elongation.powi(4) * 0.25;
        Energy { kinetic: T::zero(), potential }
    }
}

/// Distance of the points of a spring, as a fraction of its unloaded length, below which the direction of its force is doubtful.
const CLOSE: f64 = 1e-3;

/// The warning about a spring whose points nearly coincide, at the distance `length`, although it is not `unloaded` there (m).
pub(crate) fn warn_of_turning(length: f64, unloaded: f64, stiffnesses: [f64; 2]) -> Option<String> {
    let is_loaded = stiffnesses.iter().any(|stiffness| *stiffness != 0.0);
    (is_loaded && length <= CLOSE * unloaded.abs() && unloaded != 0.0).then(|| {
        format!(
            "its points are {length:.1e} m apart, where its force of an unloaded length of {unloaded} m has no definite direction and turns \
             with the smallest motion; move a point, or give it the length 0"
        )
    })
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a linear spring and damper between two points: stiffness, damping, unloaded length.
    pub fn spring_damper(&mut self, name: &str, a: Marker<S>, b: Marker<S>, [k, c, length]: [S; 3]) -> ElementIndex {
        self.nonlinear_spring(name, a, b, [k, c, length, S::from(0.0)])
    }

    /// Adds a spring and damper with a cubic term between two points: stiffness, damping, unloaded length, cubic stiffness.
    pub fn nonlinear_spring(&mut self, name: &str, a: Marker<S>, b: Marker<S>, parameters: [S; 4]) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add_object(name.into(), SpringDamper::object(), &coordinates, &[&p[..], &parameters[..]].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::line::three_four_five;
    use autodiff::DualVec;

    fn parameters(rest: f64) -> [f64; 8] {
        [0.0, 0.0, 0.0, 0.0, 7.0, 10.0, rest, 2.0]
    }

    #[test]
    fn five_metres_long_at_rest_with_four() {
        // 7·1 + 2·1³ + 10·2.2 = 31 N along (0.6, 0.8); ½·7·1 + ¼·2·1 = 4 J.
        let ((q, v), p) = (three_four_five(), parameters(4.0));
        let x = moving(&p, &q, &v, &[]);
        close(&rows(&SpringDamper, &x).0, &[-18.6, -24.8, 0.0, 18.6, 24.8, 0.0]);
        close(&measured(&SpringDamper, &x), &[31.0, 5.0, 2.2]);
        close(&energies(&SpringDamper, &x), &[0.0, 4.0]);
    }

    #[test]
    fn at_zero_length_the_force_is_the_mean_of_both_sides() {
        let v = [0.0, 0.0, 0.0, 3.0, -4.0, 0.0];
        for rest in [0.0, 0.5] {
            let p = parameters(rest);
            let force = |s: f64| rows(&SpringDamper, &moving(&p, &[0.0, 0.0, 0.0, 3.0 * s, -4.0 * s, 0.0], &v, &[])).0;
            let (before, here, after) = (force(-1e-9), force(0.0), force(1e-9));
            for k in 0..6 {
                assert!((here[k] - 0.5 * (before[k] + after[k])).abs() < 1e-6, "{before:?} {here:?} {after:?}");
            }
        }
    }

    #[test]
    fn at_zero_length_derivatives_are_those_of_a_vector_spring() {
        // Moving B by (1, 2): k (1, 2) for an unloaded length of zero; nothing is NaN, not even in measures and energy.
        let seeded = |value: f64, derivative: f64| DualVec::<1> { re: value, eps: [derivative] };
        let p = parameters(0.0).map(|p| seeded(p, 0.0));
        let q = [0.0, 0.0, 0.0, 1.0, 2.0, 0.0].map(|derivative| seeded(0.0, derivative));
        let still = [seeded(0.0, 0.0); 6];
        let x =
            ElementState { t: seeded(0.0, 0.0), p: &p, q: &q, v: &still, a: &still, l: &[], sides: Default::default() };
        let mut dynamics = still;
        Element::residual(&SpringDamper, &x, &mut dynamics, &mut []);
        close(&dynamics.map(|row| row.eps[0]), &[-7.0, -14.0, 0.0, 7.0, 14.0, 0.0]);
        let mut out = [seeded(0.0, 0.0); 3];
        Element::measure(&SpringDamper, &x, &mut out);
        assert!(out.iter().all(|m| m.re.is_finite() && m.eps[0].is_finite()));
        assert!(Element::energy(&SpringDamper, &x).potential.eps[0].is_finite());
    }
}
