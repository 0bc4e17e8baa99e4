//! Contact of a sphere with a plane.

use super::sphere_contact3::{ContactLaw, SphereContact3};
use crate::elements::contacts::hunt_crossley;
use crate::elements::spatial::line3::{MarkerPair, check_ends, ends3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::vector::{dot, scaled, subtract};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Compliant contact of a sphere on a body B with a plane of a body A, with friction.
///
/// The plane goes through the marker A, with its axis z as the outward normal n. With the centre C of the sphere at the marker B,
///
/// $$ \delta = r - n\cdot(C - A),\qquad F = k\,\delta^{3/2}\,(1 + \tfrac32 c\,\dot\delta) \ge 0,\qquad
///    F_t = -\mu F\,\frac{v_t}{\sqrt{v_t^2 + v_s^2}} $$
///
/// v_t is the sliding velocity of B at the lowest point of the sphere, where both forces act: a sphere rolls. Friction is smooth: a body
/// that should stick creeps with a part of the transition speed v_s.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct SpherePlane3;

as_object!(SpherePlane3);

element_inputs!(SpherePlane3Inputs {
    a: marker3("point of the plane, whose axis z is the outward normal"),
    b: marker3("centre of the sphere"),
    radius: required("m", 0.8, "radius of the sphere"),
    stiffness: required("N/m^1.5", 1e2, "stiffness"),
    damping: optional("0", "s/m", 0.1, "damping"),
    friction: optional("0", "", 0.3, "coefficient of friction"),
    speed: optional("1e-3", "m/s", 0.5, "transition speed, over which the friction rises"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "sphere-plane",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[
        Measure::new("contact_force", "N", "contact force on b along the axis z of a"),
        Measure::new("friction_x", "N", "friction force on b along the axis x of a"),
        Measure::new("friction_y", "N", "friction force on b along the axis y of a"),
        Measure::new("depth", "m", "depth of the sphere behind the plane, negative if it is open"),
    ],
    about: "a compliant contact of a sphere with a plane, with friction",
    law: "contact_force = stiffness·δ^1.5·(1 + 1.5·damping·δ̇), at least 0, with the depth δ of the sphere behind the plane; 0 where δ < 0. \
          Friction on b is −friction·contact_force·v/√(v² + speed²) with the sliding velocity v of b at the lowest point of the sphere",
    symbol: Symbol::Spheres,
};

impl<T: Scalar> SpherePlane3Inputs<'_, T> {
    fn law(self) -> ContactLaw<T> {
        let [stiffness, damping] = [self.stiffness(), self.damping()];
        ContactLaw { stiffness, damping, friction: self.friction(), speed: self.speed() }
    }
}

impl SpherePlane3 {
    fn contact<T: Scalar>(x: &ElementState<'_, T>) -> SphereContact3<T> {
        let (ends, radius) = (MarkerPair::of(x), SpherePlane3Inputs(x.p).radius());
        let normal = ends.a.axes[2];
        let depth = radius - dot(normal, ends.gap());
        let lowest = subtract(ends.b.point, scaled(normal, radius));
        SphereContact3::new(x, ends, normal, depth, lowest)
    }
}

impl Element for SpherePlane3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        Self::contact(x).add_force(&SpherePlane3Inputs(x.p).law(), x, dynamics);
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
        Self::contact(x).switching_functions(&SpherePlane3Inputs(x.p).law(), out);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let inputs = SpherePlane3Inputs(p);
        check_ends(p).or_else(|| inputs.law().validate(&[("radius", inputs.radius())]))
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let (contact, law) = (Self::contact(x), SpherePlane3Inputs(x.p).law());
        let [friction_x, friction_y, _] = contact.in_axes_of_a(contact.friction_force(&law, x));
        out.copy_from_slice(&[contact.normal_force(&law, x), friction_x, friction_y, contact.depth]);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        hunt_crossley::stored_energy(SpherePlane3Inputs(x.p).stiffness(), Self::contact(x).depth, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a contact of the plane through `a`, normal to its axis z, with a sphere of a `radius` (m) around `b`. `law`: stiffness
    /// (N/m^1.5), damping (s/m), coefficient of friction, transition speed (m/s).
    pub fn sphere_plane3(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>, radius: S, law: [S; 4]) -> ElementIndex {
        let (coordinates, p) = ends3(a, b);
        self.add_object(name.into(), SpherePlane3::object(), &coordinates, &[&p[..], &[radius], &law].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::spatial::line3::{points, upright};

    /// A ball of 0.5 m, 0.04 m deep in the floor, which sinks at 0.5 m/s, moves at 3 m/s along x and turns about y.
    fn ball(spin: f64) -> ([f64; 19], [f64; 14], [f64; 14]) {
        let p = [&points([0.0; 3], [0.0; 3])[..], &[0.5, 1000.0, 0.2, 0.3, 4.0]].concat();
        let mut v = [0.0; 14];
        (v[7], v[9], v[12]) = (3.0, -0.5, 0.5 * spin);
        (p.try_into().unwrap(), upright([0.0; 3], [1.0, 2.0, 0.46]), v)
    }

    #[test]
    fn a_sliding_ball_in_the_floor() {
        let (p, q, v) = ball(0.0);
        let x = moving(&p, &q, &v, &[]);
        // 1000·0.008·1.15 = 9.2 N; friction 0.3·9.2·3/5 = 1.656 N against x at the lowest point, 0.5 m below the centre.
        let rows = rows(&SpherePlane3, &x).0;
        close(&rows[7..10], &[1.656, 0.0, -9.2]);
        close(&rows[10..14], &[0.0, 0.0, -2.0 * 0.5 * 1.656, 0.0]);
        close(&measured(&SpherePlane3, &x), &[9.2, -1.656, 0.0, 0.04]);
        close(&energies(&SpherePlane3, &x), &[0.0, 0.4 * 1000.0 * 0.04f64.powf(2.5)]);
        // Force and moment on both bodies are in equilibrium.
        close(&rows[0..3], &[-1.656, 0.0, 9.2]);
        let moment = [2.0 * 9.2, -9.2 - 1.656 * -0.04, 1.656 * 2.0];
        close(&rows[3..7], &[&[0.0][..], &moment.map(|m| 2.0 * m)].concat());
    }

    #[test]
    fn a_rolling_ball_has_no_friction_and_an_open_one_no_force() {
        let (p, q, v) = ball(6.0);
        close(&measured(&SpherePlane3, &moving(&p, &q, &v, &[]))[..3], &[9.2, 0.0, 0.0]);
        let mut open = q;
        open[9] = 0.51;
        close(&rows(&SpherePlane3, &moving(&p, &open, &v, &[])).0, &[0.0; 14]);
        let with = |k: usize, value: f64| {
            let mut p = p;
            p[k] = value;
            SpherePlane3.validate_parameters(&p)
        };
        assert!(with(14, 0.0).unwrap().contains("radius"));
        assert!(with(17, -0.1).unwrap().contains("coefficient of friction"));
        assert!(with(18, 0.0).unwrap().contains("transition speed"));
        assert!(with(15, -1.0).unwrap().contains("stiffness"));
    }
}
