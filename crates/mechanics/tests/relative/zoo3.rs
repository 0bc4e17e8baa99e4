//! Trees in space with every kind of joint in both orders, prescribed motions, free bodies and forces.

use autodiff::Scalar;
use linkwright_mechanics::Result;
use linkwright_mechanics::elements::spatial::{LoadKind3, MassProperties3};
use linkwright_mechanics::mechanism::{
    Body3, ElementIndex, EulerSequence, Marker3, Mechanism, ParametricMechanism, Pose3, Rotation,
};
use linkwright_mechanics::motion::Harmonic;

/// The trees. Initial velocities violate the joints: they are made consistent.
pub struct Zoo3;

/// The design: lengths, masses, angles, stiffness, motions, initial velocities.
pub const DESIGN3: [f64; 10] = [0.5, 0.3, 1.2, 0.4, 8.0, 0.8, 1.5, 2.0, 0.35, 0.1];

/// A joint between two markers.
#[derive(Clone, Copy)]
enum Kind {
    Revolute,
    Prismatic,
    Cylindrical,
    Planar,
    Universal,
    Spherical,
    Fixed,
}

struct Builder<S> {
    m: Mechanism<S>,
    joints: Vec<ElementIndex>,
}

fn numbers<S: Scalar>(x: [f64; 3]) -> [S; 3] {
    x.map(S::from)
}

fn values<S: Scalar>(x: [S; 3]) -> [f64; 3] {
    x.map(|x| x.re())
}

impl<S: Scalar> Builder<S> {
    /// Adds a body that hangs on `parent` by a joint, with the first marker in the body if it is reversed. `angles` and `shift` are the
    /// position of the second marker relative to the first.
    fn hang(
        &mut self,
        name: &str,
        kind: Kind,
        is_reversed: bool,
        parent: Marker3<S>,
        own: ([S; 3], Rotation<S>),
        (shift, angles): ([f64; 3], Rotation<f64>),
    ) -> (Body3, [Marker3<S>; 2]) {
        let plain = |rotation: Rotation<S>| Rotation::euler_parameters(rotation.parameters().map(|x| x.re()));
        let pose = self.m.pose3(parent.body);
        let base = Pose3::new(values(pose.position), plain(pose.orientation));
        let (at, axes) = (base.point(values(parent.point)), base.orientation.then(plain(parent.orientation)));
        let moved = |from: [f64; 3], by: [f64; 3], sign: f64| [0, 1, 2].map(|k| from[k] + sign * by[k]);
        let (at, axes) = match is_reversed {
            false => (moved(at, axes.rotate(shift), 1.0), axes.then(angles)),
            true => {
                let axes = axes.then(angles.inverse());
                (moved(at, axes.rotate(shift), -1.0), axes)
            }
        };
        let orientation = axes.then(plain(own.1).inverse());
        let position = moved(at, orientation.rotate(values(own.0)), -1.0);
        let number = self.joints.len() as f64;
        let properties = MassProperties3 {
            mass: S::from(0.4 + 0.1 * number),
            centre: numbers([0.03, -0.02 + 0.005 * number, 0.04]),
            moments: numbers([0.02, 0.03, 0.025]),
            products: numbers([0.002, -0.003, 0.001]),
        };
        let rotation = Rotation::euler_parameters(orientation.parameters().map(S::from));
        let body = self.m.body3(name, properties, Pose3::new(numbers(position), rotation));
        self.m.set_velocity3(body, numbers([0.1, 0.2, -0.1]), numbers([0.6, -0.4, 0.3 + 0.1 * number]));
        let child = Marker3 { body, point: own.0, orientation: own.1 };
        let pair = if is_reversed { [child, parent] } else { [parent, child] };
        let [a, b] = pair;
        let m = &mut self.m;
        let joint = format!("{name} joint");
        self.joints.push(match kind {
            Kind::Revolute => m.revolute3(&joint, a, b),
            Kind::Prismatic => m.prismatic3(&joint, a, b),
            Kind::Cylindrical => m.cylindrical(&joint, a, b),
            Kind::Planar => m.planar_joint(&joint, a, b),
            Kind::Universal => m.universal(&joint, a, b),
            Kind::Spherical => m.spherical(&joint, a, b),
            Kind::Fixed => m.fixed_joint3(&joint, a, b),
        });
        (body, pair)
    }
}

impl ParametricMechanism for Zoo3 {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let [l1, l2, mass, angle, k, arm, speed, omega, tilt, offset] = std::array::from_fn(|i| b[i]);
        let n = |x: f64| S::from(x);
        let m = Mechanism::with_gravity3([n(0.3), n(-0.2), n(-9.81)]);
        let mut x = Builder { m, joints: Vec::new() };
        let (ground, still) = (x.m.ground3(), x.m.ground().theta);
        let turned = |x: f64, y: f64, z: f64| Rotation::euler_angles(EulerSequence::Zyx, [n(z), n(y), n(x)]);
        let relative = |shift: [f64; 3], angle: f64| (shift, Rotation::about_z(angle));
        let about = |z: f64, y: f64, x: f64| ([0.0; 3], Rotation::euler_angles(EulerSequence::Zyx, [z, y, x]));

        // A chain of all joints: hinge, sleeve, spherical joint, universal joint, guide, plane and weld.
        let base = ground.at([n(0.1), n(0.0), offset]).turned(turned(0.3, -0.2, 0.1));
        let own = ([-l1, n(0.02), n(0.01)], Rotation::about_x(tilt).then(turned(0.0, 0.2, 0.4)));
        let (one, pair) = x.hang("one", Kind::Revolute, false, base, own, relative([0.0; 3], 0.7));
        let hinge = x.m.joint_angle("hinge", pair[0], pair[1]);
        x.m.coordinate_spring("hinge spring", still, hinge, [k, n(0.05), n(0.2), n(0.0)]);
        x.m.inertia("rotor", hinge, mass * 0.05);
        let at = one.at([l1, n(0.0), n(0.1)]).turned(turned(0.2, 0.1, -0.5));
        let (two, pair) = x.hang("two", Kind::Cylindrical, true, at, own, relative([0.0, 0.0, 0.2], -0.6));
        let way = x.m.joint_displacement("way", pair[0], pair[1]);
        x.m.coordinate_spring("way spring", still, way, [k * 5.0, n(0.3), n(0.1), n(0.0)]);
        let at = two.at([l2, n(0.1), n(0.0)]).turned(turned(0.1, 0.4, 0.5));
        let (three, _) = x.hang("three", Kind::Spherical, false, at, own, about(0.5, -0.3, 0.4));
        let at = three.at([n(0.2), arm * 0.3, n(0.05)]).turned(Rotation::about_z(angle));
        let cross = |first: f64, second: f64| {
            let quarter = Rotation::about_y(std::f64::consts::FRAC_PI_2);
            ([0.0; 3], Rotation::about_z(first).then(quarter).then(Rotation::about_z(second)))
        };
        let (four, _) = x.hang("four", Kind::Universal, true, at, own, cross(0.4, -2.9));
        let at = four.at([n(0.0), l2, n(0.1)]).turned(turned(-0.3, 0.0, 0.2));
        let (five, pair) = x.hang("five", Kind::Prismatic, true, at, own, relative([0.0, 0.0, 0.15], 0.0));
        let slide = x.m.joint_displacement("slide", pair[0], pair[1]);
        x.m.coordinate_spring("slide spring", still, slide, [k * 10.0, n(0.4), n(0.1), n(0.0)]);
        let at = three.at([n(-0.1), n(0.1), arm * 0.2]).turned(turned(0.1, -0.3, 0.2));
        let (six, _) = x.hang("six", Kind::Fixed, false, at, own, relative([0.0; 3], 0.0));

        // Joints of the other orders, on a driven hinge.
        let base = ground.at([n(2.0), n(0.1), n(0.0)]).turned(Rotation::about_y(tilt));
        let (seven, pair) = x.hang("seven", Kind::Revolute, true, base, own, relative([0.0; 3], 2.9));
        let drive = x.m.drive_angle("drive", pair[0], pair[1], Harmonic, &[n(2.9), n(0.5), omega, n(0.0)]);
        let at = seven.at([arm * 0.4, n(0.0), n(0.1)]).turned(turned(0.1, 0.2, 0.3));
        let (eight, _) = x.hang("eight", Kind::Planar, false, at, own, relative([0.1, -0.05, 0.0], 0.5));
        let (nine, _) =
            x.hang("nine", Kind::Planar, true, eight.at([n(0.1), l2, n(0.0)]), own, relative([-0.1, 0.1, 0.0], 0.3));
        let at = nine.at([n(0.1), n(0.1), n(0.1)]).turned(turned(0.3, 0.1, -0.2));
        let (ten, _) = x.hang("ten", Kind::Universal, false, at, own, cross(-0.5, 1.0));
        let (eleven, _) =
            x.hang("eleven", Kind::Spherical, true, ten.at([n(0.2), n(0.0), n(0.1)]), own, about(0.2, 0.5, -0.6));
        let (twelve, _) =
            x.hang("twelve", Kind::Fixed, true, seven.at([n(0.1), arm, n(0.0)]), own, relative([0.0; 3], 0.0));
        let at = twelve.at([n(0.0), n(0.1), n(0.2)]).turned(turned(-0.1, 0.2, 0.6));
        let (thirteen, pair) = x.hang("thirteen", Kind::Prismatic, false, at, own, relative([0.0, 0.0, -0.1], 0.0));
        x.m.drive_displacement("lift", pair[0], pair[1], Harmonic, &[n(-0.1), arm * 0.1, omega * 1.5, n(0.0)]);
        let at = thirteen.at([n(0.1), n(0.1), l2]).turned(turned(0.2, 0.0, 0.1));
        let (fourteen, _) = x.hang("fourteen", Kind::Cylindrical, false, at, own, relative([0.0, 0.0, 0.3], 1.1));

        // A free body with a body on a hinge, a point mass on a string of two, on a spring.
        let free = x.m.body3(
            "free",
            MassProperties3::principal(mass, numbers([0.05, 0.06, 0.08])).with_centre([n(0.02), n(0.0), offset]),
            Pose3::new(numbers([0.0, 2.0, 0.5]), turned(0.4, 0.3, -0.6)),
        );
        x.m.set_velocity3(free, [n(0.2), n(0.1), speed], [speed, n(0.4), n(-0.8)]);
        let at = free.at([n(0.2), l2, n(0.0)]).turned(turned(0.5, 0.1, 0.0));
        let (sixteen, _) = x.hang("sixteen", Kind::Revolute, false, at, own, relative([0.0; 3], -0.4));
        let bob = {
            let pose = x.m.pose3(sixteen);
            let at = pose.point(numbers([0.2, 0.1, 0.0]));
            let bob = x.m.point_mass3("bob", n(0.2), at);
            x.joints.push(x.m.spherical("bob pin", sixteen.at(numbers([0.2, 0.1, 0.0])), bob.origin()));
            let (last, _) = x.hang("last", Kind::Spherical, true, bob.origin(), own, about(0.3, 0.2, 0.1));
            (bob, last)
        };
        x.m.spring_damper3(
            "rope",
            free.at(numbers([-0.1, 0.1, 0.0])),
            one.at(numbers([0.2, 0.0, 0.0])),
            [k, n(0.4), n(1.0)],
        );
        x.m.bushing3("bush", ground.at(numbers([2.0, 0.5, 0.5])), eight.origin(), [k; 6], [n(0.1); 6]);
        x.m.load3(
            "thrust",
            LoadKind3::FollowerForce,
            five.origin(),
            numbers([0.3, 0.4, 1.0]),
            Harmonic,
            &[n(0.0), n(1.5), omega, n(0.0)],
        );
        // A cart that moves along x, with a pendulum.
        let cart = x.m.body3(
            "cart",
            MassProperties3::principal(n(2.0), numbers([0.1; 3])),
            Pose3::at(numbers([-2.0, 0.0, 0.0])),
        );
        [cart.y, cart.z, cart.e[0], cart.e[1], cart.e[2], cart.e[3]].into_iter().for_each(|c| x.m.fix(c));
        x.m.set_velocity(cart.x, n(0.4));
        let (rod, _) = x.hang("rod", Kind::Universal, false, cart.at([n(0.1), n(0.0), offset]), own, cross(0.2, 0.4));

        let mut m = x.m;
        for (k, &joint) in x.joints.iter().enumerate() {
            for measure in ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"] {
                let term = m.measure(joint, measure)?;
                m.output(format!("joint {k}: {measure}"), &[term]);
            }
        }
        let bodies = [four, five, six, eight, nine, eleven, twelve, fourteen, free, sixteen, bob.0, bob.1, rod];
        for (k, body) in bodies.into_iter().enumerate() {
            let sensor = m.sensor3(&format!("sensor {k}"), body.at(numbers([0.1, 0.2, -0.1])));
            for measure in ["x", "z", "vy", "ax", "omega_z", "alpha_x"] {
                let term = m.measure(sensor, measure)?;
                m.output(format!("sensor {k}: {measure}"), &[term]);
            }
            let e = m.coordinate_sensor(&format!("e {k}"), still, body.e[2]);
            for measure in ["position", "velocity", "acceleration"] {
                let term = m.measure(e, measure)?;
                m.output(format!("e {k}: {measure}"), &[term]);
            }
        }
        for (name, coordinate) in [("hinge", hinge), ("way", way), ("slide", slide)] {
            let sensor = m.coordinate_sensor(&format!("{name} sensor"), still, coordinate);
            for measure in ["position", "velocity", "acceleration"] {
                let term = m.measure(sensor, measure)?;
                m.output(format!("{name}: {measure}"), &[term]);
            }
        }
        let forces = [m.driving_force(drive), m.driving_force(cart.z)];
        forces.iter().enumerate().for_each(|(k, term)| m.output(format!("drive {k}"), &[term.times(mass)]));
        let energies = [m.kinetic_energy(), m.potential_energy()];
        m.output("energy", &energies);
        Ok(m)
    }
}
