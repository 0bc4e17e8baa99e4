//! Loops of bodies, closed by cut joints, in the plane and in space.

use crate::{has_derivatives_alike, has_second_derivatives_alike, moves_alike, settings};
use autodiff::Scalar;
use linkwright_mechanics::Result;
use linkwright_mechanics::analyses::dynamics::simulate_explicitly;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::integrators::explicit::Coordinates;
use linkwright_mechanics::mechanism::{
    Body3, ElementIndex, Marker3, Mechanism, ParametricMechanism, Pose, Pose3, Rotation,
};
use linkwright_mechanics::motion::Harmonic;

/// Planar loops: a four-bar linkage with a slider on its coupler, a driven rod on a distance constraint, and a gear pair.
struct Linkage;

const LINKAGE: [f64; 9] = [0.4, 1.1, 0.9, 1.3, 6.0, 0.8, 1.5, 0.3, 0.25];

impl ParametricMechanism for Linkage {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let [crank, coupler, rocker, mass, k, base, speed, line, arm] = std::array::from_fn(|i| b[i]);
        let n = |x: f64| S::from(x);
        let pose = |x: f64, y: f64, theta: f64| Pose { x: n(x), y: n(y), theta: n(theta) };
        let mut m = Mechanism::with_gravity(n(0.2), n(-9.81));
        let ground = m.ground();
        let a = m.body("crank", n(0.4), n(0.01), pose(0.1, 0.17, 1.0));
        let c = m.body("coupler", mass, n(0.1), pose(0.7, 0.6, 0.45));
        let r = m.body("rocker", n(0.6), n(0.05), pose(1.0, 0.45, 1.3));
        m.set_velocity(a.theta, speed);
        let half = |x: S| x * 0.5;
        let mut joints: Vec<(ElementIndex, &[&str])> = Vec::new();
        let pin: &[&str] = &["force_x", "force_y"];
        joints.push((m.revolute("pin a", ground.origin(), a.at(-half(crank), n(0.0))), pin));
        joints.push((m.revolute("pin b", c.at(-half(coupler), n(0.02)), a.at(half(crank), n(0.0))), pin));
        joints.push((m.revolute("pin c", c.at(half(coupler), n(0.0)), r.at(half(rocker), n(0.01))), pin));
        joints.push((m.revolute("pin d", ground.at(base, n(0.0)), r.at(-half(rocker), n(0.0))), pin));
        let slider = m.body("slider", n(0.3), n(0.02), pose(0.9, 0.8, 0.8));
        joints.push((m.prismatic("guide", c.at(arm, n(0.1)), line, slider.origin(), n(0.1)), &["force", "moment"]));
        m.spring_damper("spring", slider.origin(), ground.at(n(1.0), n(1.5)), [k, n(0.3), n(0.4)]);
        let strut = m.distance_constraint("strut", slider.at(n(0.1), n(0.0)), ground.at(n(1.2), n(1.4)), n(0.6));
        joints.push((strut, &["tension"]));
        // A wheel that the crank drives, and a rod on a driven base.
        let wheel = m.body("wheel", n(0.5), n(0.02), pose(-0.5, 0.0, 0.0));
        joints.push((m.revolute("pin e", ground.at(n(-0.5), n(0.0)), wheel.origin()), pin));
        m.gear_pair("gears", [a.theta, wheel.theta], ground.theta, [n(0.2), arm, n(0.1)]);
        let driven = m.body("driven", n(0.5), n(0.03), pose(-1.0, 0.4, 1.5));
        m.drive(driven.theta, Harmonic, &[n(1.5), arm, n(2.0), n(0.1)]);
        joints.push((m.revolute("pin f", ground.at(n(-1.0), n(0.0)), driven.at(n(-0.4), n(0.0))), pin));
        let rod = m.body("rod", n(0.3), n(0.02), pose(-0.9, 1.1, 1.3));
        joints.push((m.revolute("pin g", driven.at(n(0.4), n(0.0)), rod.at(n(-0.3), n(0.0))), pin));
        m.distance_constraint("link", rod.at(n(0.3), n(0.0)), wheel.at(n(0.2), n(0.1)), n(1.6));
        for (k, (joint, measures)) in joints.into_iter().enumerate() {
            for measure in measures {
                let term = m.measure(joint, measure)?;
                m.output(format!("joint {k}: {measure}"), &[term]);
            }
        }
        for (name, body) in [("coupler", c), ("slider", slider), ("wheel", wheel), ("rod", rod)] {
            let sensor = m.sensor(name, body.at(n(0.1), n(0.2)));
            for measure in ["x", "vy", "ay"] {
                let term = m.measure(sensor, measure)?;
                m.output(format!("{name}: {measure}"), &[term]);
            }
        }
        let drive = m.driving_force(driven.theta);
        m.output("drive", &[drive]);
        let energies = [m.kinetic_energy(), m.potential_energy()];
        m.output("energy", &energies);
        Ok(m)
    }
}

/// Loops in space: a linkage RSSR with a screw on its rocker, and a free body on a rod.
struct Space;

const SPACE: [f64; 6] = [0.3, 0.8, 1.2, 2.0, 0.1, 0.25];

fn triple<S: Scalar>(x: [f64; 3]) -> [S; 3] {
    x.map(S::from)
}

impl ParametricMechanism for Space {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let [crank, rocker, mass, speed, tilt, pitch] = std::array::from_fn(|i| b[i]);
        let n = |x: f64| S::from(x);
        let mut m = Mechanism::with_gravity3(triple([0.1, 0.2, -9.81]));
        let ground = m.ground3();
        let body = |m: &mut Mechanism<S>, name: &str, mass: S, at: [f64; 3]| -> Body3 {
            let properties = MassProperties3 {
                mass,
                centre: triple([0.02, 0.03, -0.01]),
                moments: triple([0.02, 0.03, 0.04]),
                products: triple([0.001, 0.002, -0.001]),
            };
            m.body3(name, properties, Pose3::at(triple(at)))
        };
        // The crank turns about z, the rocker about an axis near y; the coupler has spherical joints and spins about itself.
        let a = body(&mut m, "crank", n(0.5), [0.0; 3]);
        let r = body(&mut m, "rocker", n(0.7), [1.0, 0.3, 0.0]);
        let c = body(&mut m, "coupler", mass, [0.65, 0.15, 0.4]);
        m.set_velocity3(a, triple([0.0; 3]), [n(0.0), n(0.0), speed]);
        m.set_velocity3(c, triple([0.0; 3]), triple([0.3, 0.1, -0.2]));
        let hinge: [Marker3<S>; 2] = [ground.origin(), a.origin()];
        let mut joints = vec![m.revolute3("hinge a", hinge[0], hinge[1])];
        let angle = m.joint_angle("angle", hinge[0], hinge[1]);
        let still = m.ground().theta;
        m.coordinate_spring("spring", still, angle, [n(2.0), n(0.05), n(0.3), n(0.0)]);
        let axis = Rotation::about_x(tilt + std::f64::consts::FRAC_PI_2);
        joints.push(m.revolute3("hinge r", ground.at(triple([1.0, 0.3, 0.0])).turned(axis), r.origin().turned(axis)));
        joints.push(m.spherical("ball a", a.at([crank, n(0.0), n(0.0)]), c.at(triple([-0.35, -0.15, -0.4]))));
        joints.push(m.spherical("ball r", r.at([n(0.0), n(0.0), rocker]), c.at(triple([0.35, 0.15, 0.4]))));
        // A nut on the rocker, and a free body on a rod.
        let nut = body(&mut m, "nut", n(0.2), [1.2, 0.3, 0.3]);
        let screw = [
            r.at(triple([0.2, 0.0, 0.3])).turned(Rotation::about_y(tilt)),
            nut.origin().turned(Rotation::about_y(tilt)),
        ];
        let [turn, way] = m.screw("screw", screw[0], screw[1], pitch);
        m.coordinate_spring("nut spring", still, way, [n(30.0), n(0.2), n(0.05), n(0.0)]);
        let free = body(&mut m, "free", n(0.3), [1.6, 0.5, 0.4]);
        let rod =
            m.distance_constraint3("rod", nut.at(triple([0.1, 0.0, 0.0])), free.at(triple([-0.1, 0.05, 0.0])), n(0.3));
        for (k, &joint) in joints.iter().enumerate() {
            for measure in ["force_x", "force_z", "torque_x", "torque_y"] {
                let term = m.measure(joint, measure)?;
                m.output(format!("joint {k}: {measure}"), &[term]);
            }
        }
        let tension = m.measure(rod, "tension")?;
        m.output("tension", &[tension]);
        for (k, body) in [a, r, c, nut, free].into_iter().enumerate() {
            let sensor = m.sensor3(&format!("sensor {k}"), body.at(triple([0.1, 0.2, -0.1])));
            for measure in ["x", "z", "vy", "ax", "omega_z", "alpha_x"] {
                let term = m.measure(sensor, measure)?;
                m.output(format!("sensor {k}: {measure}"), &[term]);
            }
        }
        let sensor = m.coordinate_sensor("turn sensor", still, turn);
        let term = m.measure(sensor, "position")?;
        m.output("turn", &[term]);
        let energies = [m.kinetic_energy(), m.potential_energy()];
        m.output("energy", &energies);
        Ok(m)
    }
}

#[test]
fn loops_move_as_in_absolute_coordinates() {
    moves_alike(&Linkage, &LINKAGE, Coordinates::Absolute);
    moves_alike(&Space, &SPACE, Coordinates::Absolute);
}

#[test]
fn derivatives_of_loops_are_those_of_absolute_coordinates() {
    has_derivatives_alike(&Linkage, &LINKAGE);
    has_derivatives_alike(&Space, &SPACE);
}

#[test]
fn second_derivatives_of_loops_are_those_of_absolute_coordinates() {
    has_second_derivatives_alike(&Linkage, &LINKAGE);
    has_second_derivatives_alike(&Space, &SPACE);
}

/// Hinges of a planar four-bar linkage in space hold each other: three equations are redundant.
#[test]
fn redundant_equations_of_a_loop_are_left_out() {
    let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -9.81]);
    let ground = m.ground3();
    let mut rod = |name: &str, from: [f64; 3], to: [f64; 3]| {
        let centre = [0, 1, 2].map(|k| 0.5 * (from[k] + to[k]));
        let properties = MassProperties3::principal(1.0, [0.02; 3]);
        let body = m.body3(name, properties, Pose3::at(centre));
        let ends = [from, to].map(|at| body.at([0, 1, 2].map(|k| at[k] - centre[k])).turned(Rotation::about_x(0.5)));
        (body, ends)
    };
    // The hinges are parallel to the x-axis turned by 0.5 about x: their z-axes.
    let axis = |m: Marker3<f64>| m;
    let (sin, cos) = 0.5f64.sin_cos();
    let at = |u: f64, v: f64| [u, v * cos, v * sin];
    let [a, b, c, d] = [at(0.0, 0.0), at(0.1, 0.4), at(0.9, 0.7), at(1.0, 0.0)];
    let (_, crank) = rod("crank", a, b);
    let (coupler, middle) = rod("coupler", b, c);
    let (_, rocker) = rod("rocker", c, d);
    let base = |point: [f64; 3]| ground.at(point).turned(Rotation::about_x(0.5));
    for (name, [first, second]) in [
        ("a", [base(a), crank[0]]),
        ("b", [crank[1], middle[0]]),
        ("c", [middle[1], rocker[0]]),
        ("d", [base(d), rocker[1]]),
    ] {
        m.revolute3(name, axis(first), axis(second));
    }
    let sensor = m.sensor3("sensor", coupler.origin());
    for name in ["x", "y", "z", "vy", "ax"] {
        let term = m.measure(sensor, name).unwrap();
        m.output(name, &[term]);
    }
    let run = |coordinates| simulate_explicitly(&m, &settings(coordinates), &[0.1, 0.3]).unwrap();
    let [absolute, relative] = [Coordinates::Absolute, Coordinates::Relative].map(run);
    for (k, name) in absolute.names.iter().enumerate() {
        crate::assert_close(name, &relative.values[k], &absolute.values[k], 1e-9);
    }
}
