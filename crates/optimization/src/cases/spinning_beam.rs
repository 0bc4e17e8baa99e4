//! The spin-up of a flexible beam.

use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::elements::{BeamSection, Shear};
use mechanics::mechanism::Formula;
use mechanics::mechanism::{Mechanism, ParametricMechanism};
use mechanics::motion::StartUp;

/// A beam whose root is driven from rest to a constant angular speed, in the plane and without gravity.
///
/// While the speed rises, the tip lags behind the root. Afterwards it vibrates about the straight beam, which the centrifugal
/// force elongates. Analyses without the stiffening by this force (geometric stiffening) diverge.
///
/// Design variables: EA (N), GA_s (N), EI (N·m²), mass per length (kg/m), rotary inertia per length (kg·m), length (m).
/// Outputs: displacement of the tip along and across the rotating axis (m), torque on the root (N·m).
///
/// # Sources
/// Simo & Vu-Quoc, *J. Appl. Mech.* 53 (1986) 855–863; Wu & Haug, *Int. J. Numer. Meth. Eng.* 26 (1988)
/// 2211–2226.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinningBeam {
    /// Number of elements.
    pub elements: usize,
    /// Speed after the start-up in rad/s.
    pub speed: f64,
    /// Duration of the start-up in s.
    pub duration: f64,
}

impl SpinningBeam {
    /// The beam of the literature: 6 rad/s within 15 s.
    pub fn published(elements: usize) -> Self {
        Self { elements, speed: 6.0, duration: 15.0 }
    }

    /// The design of the literature.
    pub const DESIGN: [f64; 6] = [2.8e7, 1.0e7, 1.4e4, 1.2, 6.0e-4, 10.0];

    /// The elongation (m) of the straight beam at constant speed: tan(κ L)/κ − L with κ = ω √(ρA/EA).
    ///
    /// The solution of EA u'' + ρA ω² (x + u) = 0 with u(0) = 0 and u'(L) = 0.
    pub fn steady_elongation(&self, b: &[f64]) -> f64 {
        let (decay, length) = (self.speed * (b[3] / b[0]).sqrt(), b[5]);
        (decay * length).tan() / decay - length
    }
}

/// A component of the tip's displacement in axes that rotate with the root; inputs are x, y, root angle and length.
struct InRootAxes {
    across: bool,
}

impl Formula for InRootAxes {
    fn value<T: Scalar>(&self, _t: T, x: &[T]) -> T {
        let (sin, cos) = x[2].sin_cos();
        if self.across { x[1] * cos - x[0] * sin } else { x[0] * cos + x[1] * sin - x[3] }
    }
}

impl ParametricMechanism for SpinningBeam {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Error::check_length("EA, GA, EI, mass, inertia, length", 6, b.len())?;
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let section = BeamSection { axial: b[0], shear: b[1], bending: b[2], mass: b[3], inertia: b[4] };
        let (nodes, _) =
            m.beam("beam", [[zero, zero], [b[5], zero]], [None, None], self.elements, &section, Shear::Flexible);
        let root = nodes[0];
        m.fix(root.x);
        m.fix(root.y);
        m.drive(root.theta, StartUp::Cycloid, &[zero, S::from(self.speed), S::from(self.duration)]);
        let (tip, hub) = (m.sensor("tip", nodes[self.elements].origin()), m.sensor("root", root.origin()));
        let scale = m.sensor("length", m.ground().at(b[5], zero));
        let terms = [m.measure(tip, "x")?, m.measure(tip, "y")?, m.measure(hub, "theta")?, m.measure(scale, "x")?];
        m.output_formula("along", InRootAxes { across: false }, &terms);
        m.output_formula("across", InRootAxes { across: true }, &terms);
        m.output("torque", &[m.driving_force(root.theta)]);
        Ok(m)
    }
}
