//! A chain of pendulums.

use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};

/// A chain of slender rods with revolute joints, the first one at the ground, released from rest in a straight line.
///
/// Design variables: the lengths (m) of all links, then their masses (kg). Outputs: tip x and y (m) and, optionally,
/// kinetic and potential energy (J). One link is the physical pendulum, two the double pendulum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain {
    /// Number of links.
    pub links: usize,
    /// Initial angle of all links from the x axis in rad.
    pub angle: f64,
    /// Gravitational acceleration along −y in m/s².
    pub gravity: f64,
    /// True if the energies are outputs.
    pub energies: bool,
}

impl Chain {
    /// A chain released from the horizontal.
    pub fn horizontal(links: usize) -> Self {
        Self { links, angle: 0.0, gravity: 9.81, energies: true }
    }

    /// A design of equal links with a total length of 1 m and a total mass of 1 kg.
    pub fn equal_links(&self) -> Vec<f64> {
        vec![1.0 / self.links as f64; 2 * self.links]
    }
}

impl ParametricMechanism for Chain {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Error::check_length("lengths and masses", 2 * self.links, b.len())?;
        let (lengths, masses) = b.split_at(self.links);
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-self.gravity));
        let (sin, cos) = self.angle.sin_cos();
        let mut hook = m.ground().origin();
        let mut reach = zero;
        for (k, (&length, &mass)) in lengths.iter().zip(masses).enumerate() {
            let middle = reach + length * 0.5;
            let pose = Pose { x: middle * cos, y: middle * sin, theta: S::from(self.angle) };
            let link = m.body(&format!("link {}", k + 1), mass, mass * length * length * (1.0 / 12.0), pose);
            m.revolute(&format!("pin {}", k + 1), hook, link.at(length * -0.5, zero));
            hook = link.at(length * 0.5, zero);
            reach += length;
        }
        let tip = m.sensor("tip", hook);
        for name in ["x", "y"] {
            let term = m.measure(tip, name)?;
            m.output(format!("tip {name}"), &[term]);
        }
        if self.energies {
            m.output("kinetic energy", &[m.kinetic_energy()]);
            m.output("potential energy", &[m.potential_energy()]);
        }
        Ok(m)
    }
}
