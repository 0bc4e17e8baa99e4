//! A flyball governor in the plane that rotates with it.

use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::elements::StateFunction;
use mechanics::mechanism::{Mechanism, ParametricMechanism};

/// Porter's governor: two balls on rods from a pivot on the spindle, and two rods from the balls to a sleeve with mass.
///
/// In the plane that rotates with the spindle, a centrifugal force acts on the balls; it depends on the state.
/// In equilibrium the angle α between rods of length L and the spindle has cos α = (m + M) g / (m L Ω²).
///
/// Design variables: mass of a ball m (kg), mass of the sleeve M (kg), rod length L (m), speed Ω (rad/s), gravity g
/// (m/s²). Outputs: height of the sleeve (negative, m), radius of a ball (m), tension of an upper rod (N).
///
/// # Sources
/// Rattan, *Theory of Machines* (2009), chapter on governors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Governor {
    /// Angle of the rods at the start in rad.
    pub angle: f64,
}

/// Centrifugal force m Ω² x of a ball in N.
struct Centrifugal;

impl StateFunction for Centrifugal {
    fn generalized_force<T: Scalar>(&self, p: &[T], _t: T, q: &[T], _v: &[T]) -> T {
        p[0] * p[1] * p[1] * q[0]
    }
}

impl Governor {
    /// A typical design.
    pub const DESIGN: [f64; 5] = [1.2, 6.0, 0.25, 20.0, 9.81];
}

impl ParametricMechanism for Governor {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Error::check_length("ball, sleeve, rod, speed, gravity", 5, b.len())?;
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[4]);
        let (sin, cos) = self.angle.sin_cos();
        let pivot = m.ground().origin();
        let sleeve = m.point_mass("sleeve", b[1], zero, b[2] * (-2.0 * cos));
        m.point_on_line("spindle", pivot, S::from(std::f64::consts::FRAC_PI_2), sleeve.origin());
        let side = |m: &mut Mechanism<S>, name: &str, side: f64| {
            let ball = m.point_mass(&format!("{name} ball"), b[0], b[2] * (side * sin), b[2] * -cos);
            let upper = m.distance_constraint(&format!("{name} upper rod"), pivot, ball.origin(), b[2]);
            m.distance_constraint(&format!("{name} lower rod"), ball.origin(), sleeve.origin(), b[2]);
            m.feedback_force(&format!("{name} centrifugal force"), ball.x, &[ball.x], Centrifugal, &[b[0], b[3]]);
            (ball, upper)
        };
        side(&mut m, "left", -1.0);
        let (ball, upper) = side(&mut m, "right", 1.0);
        let height = m.coordinate_sensor("height", m.ground().y, sleeve.y);
        let radius = m.coordinate_sensor("radius", m.ground().x, ball.x);
        for (name, part, measure) in
            [("height", height, "position"), ("radius", radius, "position"), ("tension", upper, "tension")]
        {
            let term = m.measure(part, measure)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}
