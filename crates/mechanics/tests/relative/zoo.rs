//! A tree with every kind of joint in both orders, prescribed motions, free bodies and forces.

use autodiff::Scalar;
use linkwright_mechanics::Result;
use linkwright_mechanics::mechanism::{ElementIndex, Mechanism, ParametricMechanism, Pose};
use linkwright_mechanics::motion::Harmonic;

/// The tree. Initial positions violate the joints: the assembly closes them.
pub struct Zoo;

/// The design: lengths, masses, angles, stiffness, motions, initial velocities.
pub const DESIGN: [f64; 12] = [0.5, 0.7, 0.3, 1.2, 0.4, 25.0, 0.8, 1.5, 0.2, 0.6, 2.0, 0.35];

impl ParametricMechanism for Zoo {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let [l1, l2, l3, m1, angle, k, mass, speed, line, arm, omega, tilt] = std::array::from_fn(|i| b[i]);
        let n = |x: f64| S::from(x);
        let pose = |x: f64, y: f64, theta: f64| Pose { x: n(x), y: n(y), theta: n(theta) };
        let mut m = Mechanism::with_gravity(n(0.3), n(-9.81));
        let (ground, mut joints): (_, Vec<(ElementIndex, &[&str])>) = (m.ground(), Vec::new());
        let (pin, guide): (&[&str], &[&str]) = (&["force_x", "force_y"], &["force", "moment", "position"]);
        let weld: &[&str] = &["force_x", "force_y", "moment"];

        // A double pendulum, the second joint with its points in the other order.
        let rod1 = m.body("rod1", m1, n(0.05), Pose { x: l1, y: n(0.02), theta: n(0.1) });
        joints.push((m.revolute("pin1", ground.at(n(0.0), n(0.1)), rod1.at(-l1, n(0.01))), pin));
        let rod2 = m.body("rod2", mass, n(0.03), pose(1.3, -0.4, -0.5));
        joints.push((m.revolute("pin2", rod2.at(-l2 * 0.5, n(0.0)), rod1.at(l1, n(0.02))), pin));
        m.set_velocity(rod2.theta, speed);
        // A slider on the second rod, and a body fixed to the first one.
        let slider3 = m.body("slider3", n(0.4), n(0.01), pose(1.4, -0.3, -0.1));
        joints.push((m.prismatic("guide3", rod2.at(n(0.1), l3), line, slider3.at(n(0.05), n(-0.04)), angle), guide));
        let block6 = m.body("block6", n(0.3), n(0.02), pose(0.6, 0.3, 0.8));
        joints.push((m.fixed_joint("weld6", block6.at(n(0.1), n(0.0)), rod1.at(n(0.1), l3), -tilt), weld));
        // A slider on the ground, its guide being in the slider; a body fixed to it; a driven crank with a rod and a point mass.
        let slider4 = m.body("slider4", n(1.5), n(0.2), pose(3.0, 0.0, -0.3));
        joints.push((
            m.prismatic("guide4", slider4.at(n(0.1), n(0.2)), line + 0.3, ground.at(n(3.2), n(0.1)), tilt),
            guide,
        ));
        let block5 = m.body("block5", n(0.6), n(0.04), pose(3.3, 0.4, 0.2));
        joints.push((m.fixed_joint("weld5", slider4.at(n(0.0), n(0.3)), block5.at(n(0.0), n(-0.1)), angle), weld));
        let crank7 = m.body("crank7", n(0.5), n(0.03), pose(3.0, 0.9, 1.0));
        m.drive(crank7.theta, Harmonic, &[n(1.0), n(0.7), omega, n(0.3)]);
        joints.push((m.revolute("pin7", block5.at(n(0.1), n(0.2)), crank7.at(-arm * 0.5, n(0.0))), pin));
        let rod8 = m.body("rod8", n(0.2), n(0.01), pose(3.4, 1.4, 0.4));
        joints.push((m.revolute("pin8", rod8.at(n(-0.2), n(0.0)), crank7.at(arm * 0.5, n(0.1))), pin));
        let bob9 = m.point_mass("bob9", n(0.25), n(3.7), n(1.5));
        joints.push((m.revolute("pin9", rod8.at(n(0.2), n(0.03)), bob9.origin()), pin));
        let rod10 = m.body("rod10", n(0.2), n(0.01), pose(3.8, 1.2, -1.2));
        joints.push((m.revolute("pin10", bob9.origin(), rod10.at(n(-0.15), n(0.0))), pin));
        // A cart on wheels with a pendulum.
        let cart = m.body("cart", n(2.0), n(0.3), pose(-2.0, 0.0, 0.0));
        m.fix(cart.y);
        m.fix(cart.theta);
        let rod12 = m.body("rod12", n(0.5), n(0.02), pose(-1.9, -0.3, -1.4));
        joints.push((m.revolute("pin12", cart.at(n(0.1), n(0.05)), rod12.at(-l2 * 0.4, n(0.0))), pin));
        m.set_velocity(cart.x, n(0.4));
        // A free body with a rod, on a spring.
        let float = m.body("float", mass, n(0.1), pose(0.0, 2.0, 0.3));
        let rod14 = m.body("rod14", n(0.3), n(0.01), pose(0.4, 2.1, 0.2));
        joints.push((m.revolute("pin14", float.at(n(0.2), n(0.0)), rod14.at(n(-0.2), n(0.05))), pin));
        m.set_velocity(float.theta, -speed);
        m.spring_damper("spring", float.at(n(-0.1), n(0.1)), rod1.at(n(0.2), n(0.0)), [k, n(0.4), n(1.0)]);
        m.spring_damper("spring4", slider4.origin(), ground.at(n(3.0), n(0.0)), [k * 2.0, n(0.5), n(0.3)]);
        // A moving base with a pendulum.
        let base = m.massless_node("base", pose(-4.0, 0.0, 0.1));
        m.drive(base.x, Harmonic, &[n(-4.0), arm * 0.3, omega * 1.3, n(0.0)]);
        m.drive(base.theta, Harmonic, &[n(0.1), n(0.2), omega, n(0.2)]);
        m.fix(base.y);
        let rod16 = m.body("rod16", n(0.5), n(0.02), pose(-3.8, -0.3, -1.0));
        joints.push((m.revolute("pin16", base.at(n(0.1), n(0.1)), rod16.at(n(-0.3), n(0.0))), pin));
        // A flywheel coupled to the first rod, and more inertia on the second one.
        let wheel = m.coordinate("wheel", n(0.2), n(1.0));
        m.inertia("flywheel", wheel, m1 * 0.1);
        m.coordinate_spring("shaft", rod1.theta, wheel, [n(3.0), n(0.1), n(0.0), n(0.0)]);
        m.inertia("disk", rod2.theta, mass * 0.05);
        m.follower_force("thrust", rod12.at(n(0.2), n(0.0)), n(1.2), Harmonic, &[n(0.0), n(1.5), omega, n(0.0)]);

        for (k, (joint, measures)) in joints.into_iter().enumerate() {
            for measure in measures {
                let term = m.measure(joint, measure)?;
                m.output(format!("joint {k}: {measure}"), &[term]);
            }
        }
        for (name, body) in
            [("slider3", slider3), ("rod10", rod10), ("rod14", rod14), ("rod16", rod16), ("block6", block6)]
        {
            let sensor = m.sensor(name, body.at(n(0.1), n(0.2)));
            for measure in ["x", "y", "vx", "ay"] {
                let term = m.measure(sensor, measure)?;
                m.output(format!("{name}: {measure}"), &[term]);
            }
        }
        let terms = [m.driving_force(crank7.theta), m.driving_force(base.theta), m.driving_force(cart.y)];
        terms.iter().enumerate().for_each(|(k, term)| m.output(format!("drive {k}"), &[term.times(mass)]));
        let energies = [m.kinetic_energy(), m.potential_energy()];
        m.output("energy", &energies);
        Ok(m)
    }
}
