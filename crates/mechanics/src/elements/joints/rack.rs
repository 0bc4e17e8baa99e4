//! A rack on a pinion.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Body, ElementIndex, Mechanism};
use autodiff::Scalar;

/// A rack on a pinion: (x_R − x_P) cos φ + (y_R − y_P) sin φ − r θ_P = u₀, with φ the direction of the rack.
///
/// Coordinates x, y of the rack and x, y, θ of the pinion; parameters r (m), φ (rad), u₀ (m). λ is the tooth force.
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.4.
#[derive(Clone, Copy, Debug)]
pub struct Rack;

impl Element for Rack {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let (sin, cos) = x.p[1].sin_cos();
        let l = x.l[0];
        constraint[0] = (x.q[0] - x.q[2]) * cos + (x.q[1] - x.q[3]) * sin - x.p[0] * x.q[4] - x.p[2];
        (dynamics[0], dynamics[1]) = (l * cos, l * sin);
        (dynamics[2], dynamics[3], dynamics[4]) = (-l * cos, -l * sin, -l * x.p[0]);
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2, 3, 4]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tooth_force"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets a rack move with the rotation of a pinion: radius (m), direction (rad) and offset (m).
    pub fn rack(&mut self, name: &str, rack: Body, pinion: Body, [radius, direction, offset]: [S; 3]) -> ElementIndex {
        let coordinates = [rack.x, rack.y, pinion.x, pinion.y, pinion.theta];
        self.add(name, Rack, &coordinates, &[radius, direction, offset])
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
