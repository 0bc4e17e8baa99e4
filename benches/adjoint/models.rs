//! Mechanisms with any number of design variables.

use linkwright::Result;
use linkwright::autodiff::Scalar;
use linkwright::mechanics::elements::{BeamSection, Shear};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::ConstantSpeed;

/// A mechanism of which only the first variables are design variables.
pub struct First<M> {
    pub model: M,
    /// All of its variables.
    pub all: Vec<f64>,
}

impl<M: ParametricMechanism> ParametricMechanism for First<M> {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let rest = self.all[b.len()..].iter().map(|&x| S::from(x));
        self.model.build(&b.iter().copied().chain(rest).collect::<Vec<_>>())
    }
}

/// A cantilever that sags under its own weight, one height (m) of section for each element.
pub struct Cantilever;

impl ParametricMechanism for Cantilever {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, length) = (S::from(0.0), 1.0 / b.len() as f64);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let place = |k: usize| Pose { x: S::from(length * k as f64), y: zero, theta: zero };
        let nodes: Vec<_> = (0..=b.len()).map(|k| m.massless_node(&format!("node {k}"), place(k))).collect();
        nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
        for (k, &height) in b.iter().enumerate() {
            let section = BeamSection::rectangular(S::from(0.02), height, 7e10, 0.3, 2700.0);
            m.beam_element(
                &format!("element {k}"),
                [nodes[k], nodes[k + 1]],
                S::from(length),
                &section,
                Shear::Flexible,
            );
        }
        for part in [1, 2, 3, 4] {
            let sensor = m.sensor(&format!("sensor {part}"), nodes[b.len() * part / 4].origin());
            let sag = m.measure(sensor, "y")?;
            m.output(format!("sag {part}"), &[sag]);
        }
        Ok(m)
    }
}

/// A serial manipulator with a constant speed of each link; design variables are lengths (m) and masses (kg).
pub struct Manipulator;

impl ParametricMechanism for Manipulator {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (lengths, masses) = b.split_at(b.len() / 2);
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let (mut hook, mut reach, mut drives) = (m.ground().origin(), zero, Vec::new());
        for (k, (&length, &mass)) in lengths.iter().zip(masses).enumerate() {
            let pose = Pose { x: reach + length * 0.5, y: zero, theta: zero };
            let link = m.body(&format!("link {k}"), mass, mass * length * length * (1.0 / 12.0), pose);
            m.revolute(&format!("pin {k}"), hook, link.at(length * -0.5, zero));
            m.drive(link.theta, ConstantSpeed, &[zero, S::from(0.5 + 0.02 * k as f64)]);
            drives.push(link.theta);
            hook = link.at(length * 0.5, zero);
            reach += length;
        }
        let tip = m.sensor("tip", hook);
        for name in ["x", "y"] {
            let term = m.measure(tip, name)?;
            m.output(name, &[term]);
        }
        for (name, drive) in [("first torque", drives[0]), ("last torque", drives[drives.len() - 1])] {
            m.output(name, &[m.driving_force(drive)]);
        }
        Ok(m)
    }
}
