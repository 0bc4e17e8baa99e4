//! A rack and pinion.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{Body, ElementIndex, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A rack and pinion: Φ = (x_R − x_P) cos φ + (y_R − y_P) sin φ − r θ_P − u₀, with the direction φ of the rack.
///
/// λ is the tooth force in N.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.4.
#[derive(Clone, Copy, Debug)]
pub struct Rack;

as_object!(Rack);

element_inputs!(RackInputs {
    a: translations("the rack: a point of its body"),
    b: body("the pinion: a point of its body"),
    radius: required("m", 0.5, "pitch radius of the pinion"),
    direction: optional("0", "rad", 0.1, "direction of the rack, fixed in the plane"),
    offset: optional("0", "m", -0.9, "displacement of the rack along its direction when the pinion is not turned"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "rack",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[Measure::new("tooth_force", "N", "force of the pinion on the rack against its direction")],
    about: "a rack, the body of a, and its pinion, the body of b",
    law: "(r_rack − r_pinion)·(cos(direction), sin(direction)) − radius·θ_pinion = offset; the torque on the pinion is radius·tooth_force",
    symbol: Symbol::Rack,
};

impl Element for Rack {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let p = RackInputs(x.p);
        let (sin, cos) = p.direction().sin_cos();
        let l = x.l[0];
        constraint[0] = (x.q[0] - x.q[2]) * cos + (x.q[1] - x.q[3]) * sin - p.radius() * x.q[4] - p.offset();
        (dynamics[0], dynamics[1]) = (l * cos, l * sin);
        (dynamics[2], dynamics[3], dynamics[4]) = (-l * cos, -l * sin, -l * p.radius());
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2, 3, 4]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Moves a rack with the rotation of a pinion: radius (m), direction (rad) and offset (m).
    pub fn rack(&mut self, name: &str, rack: Body, pinion: Body, parameters: [S; 3]) -> ElementIndex {
        self.add_object(name.into(), Rack::object(), &[rack.x, rack.y, pinion.x, pinion.y, pinion.theta], &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};

    #[test]
    fn half_a_radian_moves_an_upright_rack_by_half_the_radius() {
        let p = [0.3, std::f64::consts::FRAC_PI_2, 0.0];
        let (dynamics, constraint) = rows(&Rack, &at(&p, &[0.3, 0.15, 0.0, 0.0, 0.5], &[20.0]));
        close(&constraint, &[0.0]);
        close(&dynamics, &[0.0, 20.0, 0.0, -20.0, -6.0]);
    }
}
