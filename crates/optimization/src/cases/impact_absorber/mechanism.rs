//! The impact absorber as a mechanism: a mass, a spring and a damper against a wall.

use crate::problem::TimeGrid;
use crate::responses::mechanism::Transient;
use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::integrators::explicit::Explicit;
use mechanics::mechanism::{Mechanism, ParametricMechanism};

/// A mass of 1 kg that hits a spring and damper at 1 m/s: ÿ + c ẏ + k y = 0, y(0) = 0, ẏ(0) = 1 m/s.
///
/// Design variables: k (N/m) and c (N·s/m). Outputs: position (m) and acceleration (m/s²).
///
/// # Sources
/// Afimiwala & Mayne, *J. Eng. Ind.* 96 (1974) 124–130; Etman, van Campen & Schoofs (1998), Section 6.1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Absorber;

impl ParametricMechanism for Absorber {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Error::check_length("stiffness and damping", 2, b.len())?;
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::new();
        let wall = m.ground().x;
        let y = m.coordinate("displacement", zero, one);
        m.inertia("mass", y, one);
        m.coordinate_spring("absorber", wall, y, [b[0], b[1], zero, zero]);
        let sensor = m.coordinate_sensor("motion", wall, y);
        for name in ["position", "acceleration"] {
            let term = m.measure(sensor, name)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}

/// The mechanism as a function of the first two design variables; a third one bounds the peak acceleration.
pub(super) struct SpringAndDamper;

impl ParametricMechanism for SpringAndDamper {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Absorber.build(&b[..b.len().min(2)])
    }
}

/// The motion at the points of a time grid, simulated.
pub(super) fn simulated(grid: &TimeGrid) -> Result<Transient<SpringAndDamper>> {
    Transient::new(SpringAndDamper, Explicit::eighth_order(1e-12), &grid.points)
}
