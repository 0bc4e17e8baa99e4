//! Contact of two spheres.

use super::sphere_contact3::{ContactLaw, SphereContact3};
use crate::elements::contacts::hunt_crossley;
use crate::elements::spatial::line3::{MarkerPair, check_ends, ends3, without_direction3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::vector::{add, norm, scaled};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Compliant contact of two spheres with friction.
///
/// The centres are at the markers A and B. With their distance L, the unit vector n from A to B and the sliding velocity v_t of B at the
/// point of contact, which divides the distance of the centres in the ratio of the radii,
///
/// $$ \delta = r_A + r_B - L,\qquad F = k\,\delta^{3/2}\,(1 + \tfrac32 c\,\dot\delta) \ge 0,\qquad
///    F_t = -\mu F\,\frac{v_t}{\sqrt{v_t^2 + v_s^2}} $$
///
/// Friction is smooth: bodies that should stick creep with a part of the transition speed v_s.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct SphereSphere3;

as_object!(SphereSphere3);

element_inputs!(SphereSphere3Inputs {
    a: marker3("centre of the first sphere"),
    b: marker3("centre of the second sphere"),
    radius_a: required("m", 0.5, "radius of the first sphere"),
    radius_b: required("m", 0.4, "radius of the second sphere"),
    stiffness: required("N/m^1.5", 1e2, "stiffness"),
    damping: optional("0", "s/m", 0.1, "damping"),
    friction: optional("0", "", 0.3, "coefficient of friction"),
    speed: optional("1e-3", "m/s", 0.5, "transition speed, over which the friction rises"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "sphere-sphere",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[
        Measure::new("contact_force", "N", "contact force on b along the line from a to b"),
        Measure::new("friction_x", "N", "friction force on b along the axis x of a"),
        Measure::new("friction_y", "N", "friction force on b along the axis y of a"),
        Measure::new("friction_z", "N", "friction force on b along the axis z of a"),
        Measure::new("depth", "m", "depth of penetration, negative if the contact is open"),
    ],
    about: "a compliant contact of two spheres, with friction",
    law: "contact_force = stiffness·δ^1.5·(1 + 1.5·damping·δ̇), at least 0, with the depth δ = radius_a + radius_b − L and the distance L of the \
          centres; 0 where δ < 0. Friction on b is −friction·contact_force·v/√(v² + speed²) with the sliding velocity v of b at the point of \
          contact, which divides the distance of the centres in the ratio of the radii",
    symbol: Symbol::Spheres,
};

impl<T: Scalar> SphereSphere3Inputs<'_, T> {
    fn law(self) -> ContactLaw<T> {
        let [stiffness, damping] = [self.stiffness(), self.damping()];
        ContactLaw { stiffness, damping, friction: self.friction(), speed: self.speed() }
    }
}

impl SphereSphere3 {
    fn contact<T: Scalar>(x: &ElementState<'_, T>) -> SphereContact3<T> {
        let (ends, p) = (MarkerPair::of(x), SphereSphere3Inputs(x.p));
        let (gap, [a, b]) = (ends.gap(), [p.radius_a(), p.radius_b()]);
        let length = norm(gap);
        let point = add(ends.a.point, scaled(gap, a / (a + b)));
        SphereContact3::new(x, ends, scaled(gap, length.recip()), a + b - length, point)
    }
}

impl Element for SphereSphere3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        Self::contact(x).add_force(&SphereSphere3Inputs(x.p).law(), x, dynamics);
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
        Self::contact(x).switching_functions(&SphereSphere3Inputs(x.p).law(), out);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let inputs = SphereSphere3Inputs(p);
        let radii = [("radius_a", inputs.radius_a()), ("radius_b", inputs.radius_b())];
        check_ends(p).or_else(|| inputs.law().validate(&radii))
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction3(x)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let (contact, law) = (Self::contact(x), SphereSphere3Inputs(x.p).law());
        let [friction_x, friction_y, friction_z] = contact.in_axes_of_a(contact.friction_force(&law, x));
        let contact_force = contact.normal_force(&law, x);
        out.copy_from_slice(&[contact_force, friction_x, friction_y, friction_z, contact.depth]);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        hunt_crossley::stored_energy(SphereSphere3Inputs(x.p).stiffness(), Self::contact(x).depth, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a contact of spheres with the `radii` (m) around two points. `law`: stiffness (N/m^1.5), damping (s/m), coefficient of
    /// friction, transition speed (m/s).
    pub fn sphere_sphere3(
        &mut self,
        name: &str,
        a: Marker3<S>,
        b: Marker3<S>,
        radii: [S; 2],
        law: [S; 4],
    ) -> ElementIndex {
        let (coordinates, p) = ends3(a, b);
        self.add_object(name.into(), SphereSphere3::object(), &coordinates, &[&p[..], &radii, &law].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::spatial::line3::{points, upright};

    #[test]
    fn two_spheres_of_three_and_four_metres() {
        // Seven metres apart along (2, 3, 6)/7, 0.04 m deep; B approaches by 0.5 m/s and slides by 3 m/s along (3, −2, 0)/√13.
        let p = [&points([0.0; 3], [0.0; 3])[..], &[3.0, 4.04, 1000.0, 0.2, 0.3, 4.0]].concat();
        let q = upright([0.0; 3], [2.0, 3.0, 6.0]);
        let (n, t) = ([2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0], [3.0, -2.0, 0.0].map(|t| t / 13f64.sqrt()));
        let mut v = [0.0; 14];
        (0..3).for_each(|k| v[7 + k] = 3.0 * t[k] - 0.5 * n[k]);
        let x = moving(&p, &q, &v, &[]);
        let force = [0, 1, 2].map(|k| 9.2 * n[k] - 1.656 * t[k]);
        let rows = rows(&SphereSphere3, &x).0;
        close(&rows[0..3], &force);
        close(&rows[7..10], &force.map(|f| -f));
        close(&measured(&SphereSphere3, &x), &[9.2, -1.656 * t[0], -1.656 * t[1], 0.0, 0.04]);
        close(&energies(&SphereSphere3, &x), &[0.0, 0.4 * 1000.0 * 0.04f64.powf(2.5)]);
        // The torques of both bodies about the origin balance: that on B is (point − B) × F, that on A is −point × F.
        let point = n.map(|n| 7.0 * n * 3.0 / 7.04);
        let lever = [0, 1, 2].map(|k| point[k] - q[7 + k]);
        let on_b = crate::mechanism::vector::cross(lever, force).map(|m| -2.0 * m);
        close(&rows[10..14], &[&[0.0][..], &on_b].concat());
        let coincident = upright([0.0; 3], [0.0; 3]);
        assert!(SphereSphere3.diagnose_state(&moving(&p, &coincident, &v, &[])).is_some());
    }
}
