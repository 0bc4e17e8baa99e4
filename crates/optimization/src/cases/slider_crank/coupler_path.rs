//! The slider-crank of the path generator, at any position in the plane.

use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use mechanics::motion::ConstantSpeed;

/// A slider-crank with a crank speed of 1 rad/s and a slider on a horizontal line.
///
/// Design variables: crank length b₁, coupler length b₂, height b₃ of the slider's line, distance b₄ of the coupler
/// point, crank pivot (b₅, b₆), angle b₇ of the coupler point, crank angle b₈ at t = 0; b₄ and b₇ are not used by the
/// mechanism. Outputs: position of the joint between crank and coupler, and rotation of the coupler. Masses are one.
///
/// # Sources
/// Etman, van Campen & Schoofs (1998), Section 6.2; Paradis & Willmert, *J. Mech. Trans. Autom. Des.* 105
/// (1983) 187–193.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CouplerPath;

impl ParametricMechanism for CouplerPath {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Error::check_length("design of the slider-crank", 8, b.len())?;
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::new();
        let ground = m.ground();
        let (sin, cos) = b[7].sin_cos();
        let [px, py] = [b[4] + b[0] * cos, b[5] + b[0] * sin];
        let middle = Pose { x: b[4] + b[0] * cos * 0.5, y: b[5] + b[0] * sin * 0.5, theta: b[7] };
        let crank = m.body("crank", one, one, middle);
        m.revolute("O", ground.at(b[4], b[5]), crank.at(b[0] * -0.5, zero));
        m.drive(crank.theta, ConstantSpeed, &[b[7], one]);
        // The initial guess is clamped; if the coupler is too short, the assembly reports it.
        let lean = ((b[2] - py) / b[1]).re().clamp(-0.99, 0.99).asin();
        let coupler = m.body("coupler", one, one, Pose { x: px, y: py, theta: S::from(lean) });
        m.revolute("A", crank.at(b[0] * 0.5, zero), coupler.origin());
        let slider = m.point_mass("slider", one, px + b[1] * lean.cos(), b[2]);
        m.revolute("B", coupler.at(b[1], zero), slider.origin());
        m.point_on_line("guide", ground.at(zero, b[2]), zero, slider.origin());
        let sensor = m.sensor("pin", coupler.origin());
        for name in ["x", "y", "theta"] {
            let term = m.measure(sensor, name)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}
