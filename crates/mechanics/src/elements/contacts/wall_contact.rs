//! Contact of a point with a straight wall.

use crate::elements::contacts::hunt_crossley::{self, contact_force};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// Contact of a point of a body with a straight wall, without friction: k δ^{3/2} (1 + 1.5 c δ̇), never negative.
///
/// # Sources
/// Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct WallContact;

as_object!(WallContact);

element_inputs!(WallContactInputs {
    at: marker("point that it acts on"),
    wall_x: required("m", 0.5, "x of a point of the wall"),
    wall_y: required("m", 0.14, "y of a point of the wall"),
    normal: required("rad", 1.5, "direction of the outward normal"),
    stiffness: required("N/m^1.5", 1e3, "stiffness"),
    damping: optional("0", "s/m", 0.1, "damping"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "wall",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[Measure::new("contact_force", "N", "contact force on the point, along the outward normal")],
    about: "a compliant wall that keeps a point on its outer side",
    law: "contact_force = stiffness·δ^1.5·(1 + 1.5·damping·δ̇), at least 0, with the depth δ = (wall_x − x)·cos(normal) + (wall_y − y)·sin(normal) of the point (x, y) behind the wall; 0 where δ < 0",
    symbol: Symbol::Wall,
};

impl WallContact {
    fn contact_force<T: Scalar>(x: &ElementState<'_, T>) -> (T, [T; 2], [T; 2]) {
        let (p, (depth, rate, lever, normal)) = (WallContactInputs(x.p), Self::depth(x));
        (contact_force(p.stiffness(), p.damping(), depth, rate, x.sides), lever, normal)
    }

    /// Depth of the contact, its rate, the lever of the point, and the outward normal.
    fn depth<T: Scalar>(x: &ElementState<'_, T>) -> (T, T, [T; 2], [T; 2]) {
        let (p, frame) = (WallContactInputs(x.p), Frame::of(x, 0));
        let [at_x, at_y] = p.at();
        let lever = frame.turned(at_x, at_y);
        let (point, velocity) = (frame.point(lever), point_velocity(x, 0, lever));
        let (sin, cos) = p.normal().sin_cos();
        let depth = (p.wall_x() - point[0]) * cos + (p.wall_y() - point[1]) * sin;
        let rate = -(velocity[0] * cos + velocity[1] * sin);
        (depth, rate, lever, [cos, sin])
    }
}

impl Element for WallContact {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let (contact_force, lever, normal) = Self::contact_force(x);
        add_force(dynamics, 0, lever, [-contact_force * normal[0], -contact_force * normal[1]]);
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
        let (depth, rate, ..) = Self::depth(x);
        hunt_crossley::switching_functions(WallContactInputs(x.p).damping(), depth, rate, out);
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = WallContactInputs(p);
        hunt_crossley::validate(p.stiffness(), p.damping())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = Self::contact_force(x).0;
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        hunt_crossley::stored_energy(WallContactInputs(x.p).stiffness(), Self::depth(x).0, x.sides)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps a point on the outer side of the wall through `wall` with the outward normal in the direction `normal` (rad);
    /// `law` is stiffness and damping.
    pub fn wall_contact(&mut self, name: &str, at: Marker<S>, wall: [S; 2], normal: S, law: [S; 2]) -> ElementIndex {
        let parameters = [at.x, at.y, wall[0], wall[1], normal, law[0], law[1]];
        self.add_object(name.into(), WallContact::object(), &at.body.coordinates(), &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, moving, rows};

    #[test]
    fn a_corner_in_the_floor_is_pushed_up_and_turns_its_body() {
        let up = std::f64::consts::FRAC_PI_2;
        // The corner (0.3, −0.2) of a body at height 0.16 m is 0.04 m deep; it sinks at 0.5 m/s.
        let p = [0.3, -0.2, 0.0, 0.0, up, 1000.0, 0.2];
        close(&rows(&WallContact, &moving(&p, &[1.0, 0.16, 0.0], &[3.0, -0.5, 0.0], &[])).0, &[0.0, -9.2, -9.2 * 0.3]);
    }
}
