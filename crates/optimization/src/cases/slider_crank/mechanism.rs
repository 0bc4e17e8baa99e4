//! A slider-crank mechanism, rigid or with a flexible connecting rod.

use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::elements::{BeamSection, Shear};
use mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use mechanics::motion::ConstantSpeed;

/// A slider-crank with a crank at constant speed, a rigid or flexible connecting rod and a slider on the x axis.
///
/// Design variables: crank length (m), rod length (m), slider mass (kg), rod diameter (m). Outputs: slider position,
/// velocity and acceleration, and the torque on the crank (N·m). Crank and rod are solid round bars.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliderCrank {
    /// Crank speed in rad/s.
    pub speed: f64,
    /// Young's modulus of the rod in N/m².
    pub young: f64,
    /// Density of crank and rod in kg/m³.
    pub density: f64,
    /// Crank diameter in m.
    pub crank_diameter: f64,
    /// Number of beam elements of the rod; the rod is rigid if it is zero.
    pub elements: usize,
}

impl SliderCrank {
    /// A steel mechanism at 15 rad/s with a rigid rod.
    pub fn rigid() -> Self {
        Self { speed: 15.0, young: 2.1e11, density: 7800.0, crank_diameter: 0.02, elements: 0 }
    }

    /// A typical design.
    pub const DESIGN: [f64; 4] = [0.15, 0.3, 0.5, 0.01];

    /// Mass (kg) and moment of inertia (kg·m²) of a round bar.
    fn bar<S: Scalar>(&self, diameter: S, length: S) -> (S, S) {
        let mass = diameter * diameter * length * (std::f64::consts::FRAC_PI_4 * self.density);
        (mass, mass * length * length * (1.0 / 12.0) + mass * diameter * diameter * (1.0 / 16.0))
    }
}

impl ParametricMechanism for SliderCrank {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Error::check_length("crank, rod, slider mass, diameter", 4, b.len())?;
        let [crank_length, rod_length, slider_mass, diameter] = [b[0], b[1], b[2], b[3]];
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let ground = m.ground();
        let (mass, inertia) = self.bar(S::from(self.crank_diameter), crank_length);
        let pose = Pose { x: crank_length * 0.5, y: zero, theta: zero };
        let crank = m.body("crank", mass, inertia, pose);
        m.set_velocity(crank.y, crank_length * (0.5 * self.speed));
        m.revolute("O", ground.origin(), crank.at(crank_length * -0.5, zero));
        m.drive(crank.theta, ConstantSpeed, &[zero, S::from(self.speed)]);
        let slider = m.point_mass("slider", slider_mass, crank_length + rod_length, zero);
        m.point_on_line("guide", ground.origin(), zero, slider.origin());
        let tip = crank.at(crank_length * 0.5, zero);
        if self.elements == 0 {
            let (mass, inertia) = self.bar(diameter, rod_length);
            let pose = Pose { x: crank_length + rod_length * 0.5, y: zero, theta: zero };
            let rod = m.body("rod", mass, inertia, pose);
            m.revolute("A", tip, rod.at(rod_length * -0.5, zero));
            m.revolute("B", rod.at(rod_length * 0.5, zero), slider.origin());
        } else {
            let section = BeamSection::circular(diameter, self.young, 0.3, self.density);
            let ends = [[crank_length, zero], [crank_length + rod_length, zero]];
            let (nodes, _) = m.beam("rod", ends, [None, Some(slider)], self.elements, &section, Shear::Flexible);
            let turn = crank_length * -self.speed / rod_length;
            for (k, node) in nodes.iter().enumerate() {
                let share = 1.0 - k as f64 / self.elements as f64;
                m.set_velocity(node.y, crank_length * (self.speed * share));
                m.set_velocity(node.theta, turn);
            }
            m.revolute("A", tip, nodes[0].origin());
        }
        let sensor = m.coordinate_sensor("slider motion", ground.x, slider.x);
        for name in ["position", "velocity", "acceleration"] {
            let term = m.measure(sensor, name)?;
            m.output(format!("slider {name}"), &[term]);
        }
        m.output("crank torque", &[m.driving_force(crank.theta)]);
        Ok(m)
    }
}
