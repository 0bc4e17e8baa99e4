//! Derivatives of spatial mechanisms: direct ones against extrapolated differences, adjoint ones against direct ones, second
//! ones against differences of first ones.

use crate::finite_differences::extrapolated_differences;
use crate::watch;
use autodiff::Scalar;
use linkwright_mechanics::derivatives::adjoint::{
    AdjointFunctional, differentiate_backwards, differentiate_equilibria_backwards, differentiate_explicitly_backwards,
    differentiate_kinematics_backwards,
};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::forward::instants::{differentiate_equilibria, differentiate_kinematics};
use linkwright_mechanics::derivatives::history::SensitiveHistory;
use linkwright_mechanics::derivatives::second_order::{
    HessianHistory, HessianPart, differentiate_equilibria_twice, differentiate_kinematics_twice, differentiate_twice,
};
use linkwright_mechanics::derivatives::semi_analytical::{STEP, differentiate_semi_analytically};
use linkwright_mechanics::elements::Shear;
use linkwright_mechanics::elements::spatial::{BeamSection3, LoadKind3, MassProperties3};
use linkwright_mechanics::integrators::explicit::{DOPRI5, Explicit, StepControl};
use linkwright_mechanics::mechanism::{Body3, EulerSequence, Pose, Pose3, Rotation};
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Harmonic};
use linkwright_mechanics::{
    Assembly, Dynamics, InitialConfiguration, Mechanism, Newton, ParametricMechanism, Result, Statics, equilibria,
    kinematics, simulate, simulate_explicitly,
};

fn vector<S: Scalar>(v: [f64; 3]) -> [S; 3] {
    v.map(S::from)
}

/// Every spatial element, with its parameters as design variables. With `driven`, all degrees of freedom that are left are
/// driven or held.
struct Zoo;

impl Zoo {
    const DESIGN: [f64; 30] = [
        1.2, 0.05, 0.06, 0.04, 0.005, 0.1, 0.02, -0.03, // arm: mass, inertias, centre
        0.5, 0.3, 6.0, 0.2, // arm: length, tilt of its hinge, spring and damper of the hinge
        9.81, 0.4, 0.5, // gravity, length of the rod, angle of the cross
        30.0, 0.8, 0.5, // bushing: stiffness, torsional stiffness, damping
        2.0, 0.3, // follower force and torque
        25.0, 0.6, // spring of the ball: stiffness, unloaded length
        0.05, 0.7, 0.4, 0.5, // pitch of the screw, mass of the slider, direction of its guide, length of a rod
        1.5, // initial speed of the arm
        0.2, 1.3, 0.6, // slope of planes, force on the puck, its mass
    ];
}

impl ParametricMechanism for Zoo {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::with_gravity3([zero, zero, -b[12]]);
        let ground = m.ground3();
        let still = m.ground().theta;
        let small = MassProperties3::principal(S::from(0.3), vector([0.01, 0.012, 0.015]));

        // An arm on a hinge with a spring, a rod on its tip by a universal joint, a ball on the rod.
        let (sin, cos) = b[9].sin_cos();
        let axis = [sin, zero, cos];
        let properties = MassProperties3 {
            mass: b[0],
            centre: [b[5], b[6], b[7]],
            moments: [b[1], b[2], b[3]],
            products: [b[4], zero, zero],
        };
        let arm = m.body3("arm", properties, Pose3::at(vector([0.0; 3])));
        m.set_velocity3(arm, vector([0.0; 3]), axis.map(|x| x * b[26]));
        let hinge = [ground.origin().with_z(axis), arm.origin().with_z(axis)];
        let bearing = m.revolute3("hinge", hinge[0], hinge[1]);
        let angle = m.joint_angle("angle", hinge[0], hinge[1]);
        m.coordinate_spring("torsion", still, angle, [b[10], b[11], S::from(0.2), zero]);
        let rod = m.body3("rod", small.with_centre([b[13] * 0.5, zero, zero]), Pose3::at([b[8], zero, zero]));
        let (sin, cos) = b[14].sin_cos();
        let cross = [arm.at([b[8], zero, zero]).with_z([zero, cos, sin]), rod.origin().with_z([zero, -sin, cos])];
        let cross = m.universal("cross", cross[0], cross[1]);
        let tip = rod.at([b[13], zero, zero]);
        m.load3(
            "thrust",
            LoadKind3::FollowerForce,
            tip,
            vector([0.0, 1.0, 0.4]),
            Harmonic,
            &[b[18], one, S::from(5.0), zero],
        );
        let anchor = ground.at([b[8] + b[13], zero, S::from(0.1)]);
        m.bushing3("bushing", anchor, tip, [b[15], b[15] * 0.8, b[15] * 1.2, b[16], b[16], b[16] * 2.0], [b[17]; 6]);
        let ball = m.body3("ball", small.with_centre(vector([0.0, 0.0, -0.1])), Pose3::at([b[8] + b[13], zero, zero]));
        m.spherical("socket", tip, ball.origin());
        m.load3("spin", LoadKind3::FollowerTorque, ball.origin(), vector([0.2, 0.1, 1.0]), Fixed, &[b[19]]);
        m.load3("turn", LoadKind3::Torque, ball.origin(), vector([1.0, 0.3, 0.0]), Fixed, &[b[19] * 0.5]);
        m.spring_damper3(
            "spring",
            ground.at(vector([0.5, 0.6, -0.5])),
            ball.at(vector([0.0, 0.1, -0.1])),
            [b[20], b[17], b[21]],
        );

        // A nut on a screw, held by a spring.
        let nut = m.body3("nut", small, Pose3::at(vector([0.0, -1.0, 0.0])));
        let [turns, height] = m.screw("screw", ground.at(vector([0.0, -1.0, 0.0])), nut.origin(), b[22]);
        m.coordinate_spring("lift", still, height, [b[20], zero, zero, zero]);

        // A slider on a guide, with a plate fixed to it, a pendulum, and a sleeve on the plate.
        let (sin, cos) = b[24].sin_cos();
        let (along, up) = ([cos, sin, S::from(0.2)], vector([0.0, 0.0, 1.0]));
        let place = vector([0.0, 1.0, 0.0]);
        let slider = m.body3("slider", MassProperties3 { mass: b[23], ..small }, Pose3::at(place));
        let guide = [ground.at(place).with_z_x(along, up), slider.origin().with_z_x(along, up)];
        let guided = m.prismatic3("guide", guide[0], guide[1]);
        let stroke = m.joint_displacement("stroke", guide[0], guide[1]);
        m.coordinate_spring("buffer", still, stroke, [b[20], b[17], zero, zero]);
        let turned = Rotation::about(vector([1.0, 0.5, 0.2]), S::from(0.3));
        let plate = m.body3("plate", small, Pose3::new(place, turned));
        m.fixed_joint3("weld", slider.origin().turned(turned), plate.origin());
        let sleeve = m.body3("sleeve", small.with_centre(vector([0.05, 0.0, 0.0])), Pose3::new(place, turned));
        m.cylindrical("pin", plate.origin(), sleeve.origin());
        m.nonlinear_spring3(
            "return",
            plate.origin(),
            sleeve.at(vector([0.0, 0.0, 0.2])),
            [b[20], b[17], S::from(0.1), b[20]],
        );
        let bob = m.point_mass3("bob", b[23] * 0.5, [zero, one, -b[25]]);
        let thread = m.distance_constraint3("thread", slider.origin(), bob.origin(), b[25]);

        // Masses on a plane and on a line, a puck on a slope.
        let normal = [b[27], zero, one];
        let puck = m.body3("puck", MassProperties3 { mass: b[29], ..small }, {
            Pose3::new(vector([0.0, 2.0, 0.0]), Rotation::z_along(normal))
        });
        m.planar_joint("slope", ground.at(vector([0.0, 2.0, 0.0])).with_z(normal), puck.origin());
        let edge = puck.at(vector([0.0, 0.1, 0.0]));
        m.load3("wind", LoadKind3::Force, edge, vector([0.0, 1.0, 1.0]), Fixed, &[b[28]]);
        let marble = m.point_mass3("marble", b[29], vector([0.0, 3.0, 0.0]));
        m.point_on_plane("floor", ground.at(vector([0.0, 3.0, 0.0])).with_z(normal), marble.origin());
        let bead = m.point_mass3("bead", b[29], vector([0.2, 0.0, 0.0]));
        m.point_on_line3("wire", arm.at(vector([0.2, 0.0, 0.0])).with_z(vector([0.0, 1.0, 0.3])), bead.origin());
        m.spring_damper3("tether", arm.at(vector([0.2, 0.1, 0.4])), bead.origin(), [b[20], b[17], S::from(0.2)]);

        let sensor = m.sensor3("tip", tip);
        watch(&mut m, sensor, &["x", "z", "vy", "az"])?;
        let sensor = m.sensor3("spin", ball.at(vector([0.1, 0.0, 0.0])));
        watch(&mut m, sensor, &["y", "own_omega_x", "alpha_z"])?;
        let angles = m.euler_angle_sensor("angles", arm.origin(), ball.origin(), EulerSequence::Zyx);
        watch(&mut m, angles, &["first", "second"])?;
        for (element, measure) in [(bearing, "force"), (cross, "torque_y"), (guided, "torque_x"), (thread, "tension")] {
            watch(&mut m, element, &[measure])?;
        }
        let sensor = m.coordinate_sensor("turns", still, turns);
        watch(&mut m, sensor, &["position"])?;
        let sensor = m.sensor3("puck", edge);
        watch(&mut m, sensor, &["y", "omega_z"])?;
        let sensor = m.sensor3("bead", bead.origin());
        watch(&mut m, sensor, &["y"])?;
        let terms = [m.kinetic_energy(), m.potential_energy()];
        m.output("energy", &terms);
        Ok(m)
    }
}

/// A body on a universal joint and three springs, in equilibrium under its weight.
struct Suspended;

impl Suspended {
    const DESIGN: [f64; 6] = [2.0, 400.0, 0.3, 30.0, 0.1, 50.0];
}

impl ParametricMechanism for Suspended {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity3(vector([0.0, 0.0, -9.81]));
        let ground = m.ground3();
        let properties = MassProperties3::principal(b[0], vector([0.1; 3])).with_centre([b[4], zero, zero]);
        let body = m.body3("body", properties, Pose3::at(vector([0.0; 3])));
        for (k, [x, y]) in [[0.3, 0.0], [-0.2, 0.25], [-0.2, -0.25]].into_iter().enumerate() {
            let (top, bottom) = (ground.at([S::from(1.1 * x), S::from(y), b[2]]), body.at(vector([x, y, 0.0])));
            m.spring_damper3(&format!("spring {k}"), top, bottom, [b[1], zero, b[2] * 0.9]);
        }
        m.bushing3("bushing", ground.origin(), body.origin(), [b[5], b[5], b[5], b[3], b[3] * 1.5, b[3]], [zero; 6]);
        m.load3("turn", LoadKind3::FollowerTorque, body.origin(), vector([0.3, 1.0, 0.5]), Fixed, &[b[3] * 0.1]);
        let sensor = m.sensor3("sensor", body.at(vector([0.2, 0.1, 0.0])));
        watch(&mut m, sensor, &["x", "y", "z"])?;
        Ok(m)
    }
}

/// A driven universal joint with an eccentric output shaft, for inverse dynamics.
struct Cardan;

impl Cardan {
    const DESIGN: [f64; 5] = [0.5, 1.3, 0.04, 0.1, 2.0];
}

impl ParametricMechanism for Cardan {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::with_gravity3(vector([0.0, 0.0, -9.81]));
        let ground = m.ground3();
        let (sin, cos) = b[0].sin_cos();
        let (first, second, normal) = (vector([1.0, 0.0, 0.0]), [cos, sin, zero], vector([0.0, 0.0, 1.0]));
        let properties =
            MassProperties3::principal(b[1], [b[2], b[2] * 1.1, b[2] * 1.2]).with_centre([zero, b[3], zero]);
        let [one_shaft, two] = ["one", "two"].map(|name| m.body3(name, properties, Pose3::at(vector([0.0; 3]))));
        let bearing = [ground.origin().with_z_x(first, normal), one_shaft.origin().with_z_x(first, normal)];
        let other = [ground.origin().with_z_x(second, normal), two.origin().with_z_x(second, normal)];
        m.revolute3("bearing", bearing[0], bearing[1]);
        m.cylindrical("sleeve", other[0], other[1]);
        m.universal("cross", one_shaft.origin().with_z(normal), two.origin().with_z([-sin, cos, zero]));
        let input = m.drive_angle("input", bearing[0], bearing[1], Harmonic, &[zero, one, b[4], zero]);
        let output = m.joint_angle("output", other[0], other[1]);
        let still = m.ground().x;
        let sensor = m.coordinate_sensor("output motion", still, output);
        watch(&mut m, sensor, &["position", "velocity", "acceleration"])?;
        let torque = m.driving_force(input);
        m.output("torque", &[torque]);
        Ok(m)
    }
}

/// An arm with a universal joint, a spring and a bushing, for second derivatives.
struct Flail;

impl Flail {
    const DESIGN: [f64; 4] = [0.5, 1.2, 8.0, 0.6];
}

impl ParametricMechanism for Flail {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity3(vector([0.0, 0.0, -9.81]));
        let (ground, still) = (m.ground3(), m.ground().theta);
        let properties =
            MassProperties3::principal(b[1], vector([0.02, 0.03, 0.04])).with_centre([b[0] * 0.5, zero, zero]);
        let axis = [zero, b[3].cos(), b[3].sin()];
        let arm = m.body3("arm", properties, Pose3::at(vector([0.0; 3])));
        let hinge = [ground.origin().with_z(axis), arm.origin().with_z(axis)];
        m.revolute3("hinge", hinge[0], hinge[1]);
        let angle = m.joint_angle("angle", hinge[0], hinge[1]);
        m.coordinate_spring("torsion", still, angle, [b[2], S::from(0.1), zero, zero]);
        let rod = m.body3("rod", properties, Pose3::at([b[0], zero, zero]));
        let cross =
            [arm.at([b[0], zero, zero]).with_z(vector([0.0, 0.0, 1.0])), rod.origin().with_z(vector([0.0, 1.0, 0.0]))];
        m.universal("cross", cross[0], cross[1]);
        m.bushing3(
            "bushing",
            arm.at([b[0], zero, zero]),
            rod.origin(),
            [zero, zero, zero, b[2] * 0.1, b[2] * 0.1, zero],
            [zero; 6],
        );
        let sensor = m.sensor3("sensor", rod.at([b[0], zero, zero]));
        watch(&mut m, sensor, &["x", "y", "vz"])?;
        Ok(m)
    }
}

/// A curved beam on a hinge with a body at its end.
struct FlexibleArm;

impl FlexibleArm {
    const DESIGN: [f64; 8] = [1.0, 0.4, 1.5, 3.0, 2.0, 0.5, 0.3, 0.05];
}

impl ParametricMechanism for FlexibleArm {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity3(vector([0.0, 0.0, -9.81]));
        let ground = m.ground3();
        let section = BeamSection3 {
            axial: b[3] * 500.0,
            shear: [b[3] * 200.0, b[3] * 150.0],
            torsion: b[2],
            bending: [b[3], b[4]],
            mass: b[5],
            inertia: [b[5] * 4e-3, b[5] * 2e-3, b[5] * 2e-3],
        };
        let points: Vec<[S; 3]> = (0..4)
            .map(|k| {
                let angle = b[1] * (f64::from(k) / 3.0);
                [b[0] * angle.sin() / b[1], b[0] * (-angle.cos() + 1.0) / b[1], zero]
            })
            .collect();
        let tip = MassProperties3::principal(b[6], [b[7] * 0.1, b[7] * 0.12, b[7] * 0.15]);
        let body = m.body3("tip", tip.with_centre([b[7], zero, zero]), Pose3::at(points[3]));
        let (nodes, elements) =
            m.beam3("beam", &points, vector([0.0, 0.0, 1.0]), [None, Some(body)], &section, Shear::Flexible);
        let node = m.pose3(nodes[0]).orientation.inverse();
        let axis = vector([0.0, 1.0, 0.3]);
        m.revolute3("hinge", ground.origin().with_z(axis), nodes[0].origin().with_z(node.rotate(axis)));
        let sensor = m.sensor3("sensor", body.origin());
        watch(&mut m, sensor, &["x", "y", "vz"])?;
        watch(&mut m, elements[1], &["normal_force", "moment_z", "torque"])?;
        Ok(m)
    }
}

/// A four-bar linkage with the lengths of ground, crank, coupler and rocker as design variables, in the plane or with hinges
/// in space, of which three constraints are redundant.
struct FourBar {
    in_space: bool,
    is_driven: bool,
}

impl FourBar {
    const DESIGN: [f64; 4] = [2.0, 0.5, 1.8, 1.2];
    const MOMENTS: [f64; 3] = [0.05, 0.2, 0.1];
    const MOTION: [f64; 2] = [1.0, 3.0];

    /// Middle and angle of the three bars.
    fn poses<S: Scalar>(b: &[S]) -> [[S; 3]; 3] {
        let (sin, cos) = Self::MOTION[0].sin_cos();
        let a = [b[1] * cos, b[1] * sin];
        let (dx, dy) = (b[0] - a[0], -a[1]);
        let d = (dx * dx + dy * dy).sqrt();
        let beta = dy.atan2(dx) + ((b[2] * b[2] + d * d - b[3] * b[3]) / (b[2] * d * 2.0)).acos();
        let end = [a[0] + b[2] * beta.cos(), a[1] + b[2] * beta.sin()];
        let psi = end[1].atan2(end[0] - b[0]);
        [
            [a[0] * 0.5, a[1] * 0.5, S::from(Self::MOTION[0])],
            [(a[0] + end[0]) * 0.5, (a[1] + end[1]) * 0.5, beta],
            [(b[0] + end[0]) * 0.5, end[1] * 0.5, psi],
        ]
    }

    fn planar<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let poses = Self::poses(b);
        let [crank, coupler, rocker] = [0, 1, 2].map(|k| {
            let [x, y, theta] = poses[k];
            m.body(&format!("bar {k}"), one, S::from(Self::MOMENTS[k]), Pose { x, y, theta })
        });
        let half = |k: usize| b[k] * 0.5;
        m.revolute("O", m.ground().origin(), crank.at(-half(1), zero));
        m.revolute("A", crank.at(half(1), zero), coupler.at(-half(2), zero));
        m.revolute("B", coupler.at(half(2), zero), rocker.at(half(3), zero));
        m.revolute("C", m.ground().at(b[0], zero), rocker.at(-half(3), zero));
        if self.is_driven {
            m.drive(crank.theta, ConstantSpeed, &Self::MOTION.map(S::from));
            let torque = m.driving_force(crank.theta);
            m.output("torque", &[torque]);
        }
        let sensor = m.sensor("sensor", coupler.at(zero, one));
        watch(&mut m, sensor, &["x", "y", "vx", "ay"])?;
        Ok(m)
    }

    fn spatial<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::with_gravity3(vector([0.0, -9.81, 0.0]));
        let (ground, poses) = (m.ground3(), Self::poses(b));
        let [crank, coupler, rocker] = [0, 1, 2].map(|k| {
            let ([x, y, theta], moment) = (poses[k], Self::MOMENTS[k]);
            let properties = MassProperties3::principal(one, vector([0.6 * moment, 0.7 * moment, moment]));
            m.body3(&format!("bar {k}"), properties, Pose3::new([x, y, zero], Rotation::about_z(theta)))
        });
        let at = |body: Body3, x: S| body.at([x, zero, zero]);
        let half = |k: usize| b[k] * 0.5;
        m.revolute3("O", ground.origin(), at(crank, -half(1)));
        m.revolute3("A", at(crank, half(1)), at(coupler, -half(2)));
        m.revolute3("B", at(coupler, half(2)), at(rocker, half(3)));
        m.revolute3("C", at(ground, b[0]), at(rocker, -half(3)));
        if self.is_driven {
            let motion = Self::MOTION.map(S::from);
            let angle = m.drive_angle("crank", ground.origin(), at(crank, -half(1)), ConstantSpeed, &motion);
            let torque = m.driving_force(angle);
            m.output("torque", &[torque]);
        }
        let sensor = m.sensor3("sensor", coupler.at([zero, one, zero]));
        watch(&mut m, sensor, &["x", "y", "vx", "ay"])?;
        Ok(m)
    }
}

impl ParametricMechanism for FourBar {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        if self.in_space { self.spatial(b) } else { self.planar(b) }
    }
}

/// Size of a design variable.
fn size(b: f64) -> f64 {
    b.abs().max(1e-2)
}

/// Largest derivative of each output at any time with respect to any variable, by the size of the variables.
fn largest(history: &SensitiveHistory, b: &[f64], output: usize) -> f64 {
    let all = history.gradients[output].iter().flat_map(|gradient| gradient.iter().zip(b));
    all.map(|(g, b)| (g * size(*b)).abs()).fold(1e-300, f64::max)
}

/// Largest deviation of derivatives from differences, relative to the largest derivative of the same output. The smaller
/// deviation of two steps counts: the large step suffers from curvature, the small one from rounding.
fn check_differences(
    label: &str,
    b: &[f64],
    history: &SensitiveHistory,
    run: impl Fn(&[f64]) -> Vec<Vec<f64>>,
    limit: f64,
) {
    let mut worst = 0.0f64;
    for k in 0..b.len() {
        let of_step = |h: f64| {
            let differences = extrapolated_differences(b, k, h * size(b[k]), &run);
            let mut worst = 0.0f64;
            for (o, series) in history.gradients.iter().enumerate() {
                for (gradient, difference) in series.iter().zip(&differences[o]) {
                    let error = (gradient[k] - difference).abs() * size(b[k]) / largest(history, b, o);
                    worst = if error.is_nan() { f64::NAN } else { worst.max(error) };
                }
            }
            worst
        };
        worst = worst.max(of_step(4e-3).min(of_step(4e-4)));
    }
    println!("{label}, direct against differences: {worst:.1e}");
    assert!(worst < limit, "{label}: {worst:.2e}");
}

/// Compares adjoint derivatives with direct ones.
fn check_adjoint(
    label: &str,
    b: &[f64],
    history: &SensitiveHistory,
    backward: impl FnOnce(&[AdjointFunctional]) -> Result<nalgebra::DMatrix<f64>>,
) {
    let points = history.times.len();
    let all: Vec<_> =
        (0..history.names.len()).flat_map(|o| (0..points).map(move |p| AdjointFunctional::at(o, p))).collect();
    let rows = backward(&all).unwrap();
    let mut worst = 0.0f64;
    for (o, series) in history.gradients.iter().enumerate() {
        for (p, gradient) in series.iter().enumerate() {
            for k in 0..b.len() {
                let error = (gradient[k] - rows[(o * points + p, k)]).abs() * size(b[k]) / largest(history, b, o);
                worst = worst.max(error);
            }
        }
    }
    println!("{label}, adjoint against direct: {worst:.1e}");
    assert!(worst < 1e-9, "{label}: {worst:.2e}");
}

/// Compares Hessians with extrapolated differences of gradients.
fn check_hessian(label: &str, b: &[f64], hessians: &HessianHistory, gradients: impl Fn(&[f64]) -> SensitiveHistory) {
    let (outputs, points) = (hessians.names.len(), hessians.times.len());
    let mut errors = vec![(0.0f64, 0.0f64); outputs];
    for j in 0..b.len() {
        let of_gradient = |b: &[f64]| {
            let history = gradients(b);
            history.gradients.into_iter().map(|series| series.concat()).collect()
        };
        let differences = extrapolated_differences(b, j, 2e-3 * size(b[j]), of_gradient);
        for o in 0..outputs {
            for p in 0..points {
                let hessian = hessians.hessian(o, p).unwrap();
                for i in 0..b.len() {
                    let scale = size(b[i]) * size(b[j]);
                    let error = (hessian[(i, j)] - differences[o][p * b.len() + i]).abs() * scale;
                    errors[o].0 = errors[o].0.max(error);
                    errors[o].1 = errors[o].1.max(hessian[(i, j)].abs() * scale);
                }
            }
        }
    }
    let worst = errors.into_iter().map(|(error, largest)| error / largest).fold(0.0, f64::max);
    println!("{label}, second against differences of first: {worst:.1e}");
    assert!(worst < 1e-6, "{label}: {worst:.2e}");
}

fn implicit(h: f64) -> Dynamics {
    Dynamics { newton: Newton { tolerance: 1e-11, iterations: 30 }, ..Dynamics::fixed(h) }
}

const TIMES: [f64; 3] = [0.0, 0.053, 0.12];

#[test]
fn every_element_in_implicit_steps() {
    let (b, settings) = (Zoo::DESIGN, implicit(0.01));
    let history = differentiate(&Zoo, &b, &settings, &TIMES).unwrap();
    let run = |b: &[f64]| simulate(&Zoo.build(b).unwrap(), &settings, &TIMES).unwrap().values;
    check_differences("implicit", &b, &history, run, 1e-6);
    check_adjoint("implicit", &b, &history, |all| differentiate_backwards(&Zoo, &b, &settings, &TIMES, all));
    let semi_analytical = differentiate_semi_analytically(&Zoo, &b, &settings, &TIMES, STEP).unwrap();
    let mut worst = 0.0f64;
    for (o, (series, others)) in history.gradients.iter().zip(&semi_analytical.gradients).enumerate() {
        for (gradient, other) in series.iter().zip(others) {
            for k in 0..b.len() {
                worst = worst.max((gradient[k] - other[k]).abs() * size(b[k]) / largest(&history, &b, o));
            }
        }
    }
    println!("implicit, semi-analytical against direct: {worst:.1e}");
    // Differences of the residual lose digits in accelerations and reactions.
    assert!(worst < 1e-4);
}

/// A motion that starts in static equilibrium stays there, and has the derivatives of the equilibrium.
#[test]
fn a_motion_from_equilibrium() {
    let (b, statics) = (Suspended::DESIGN, Statics::default());
    let settings = Dynamics { initial_configuration: InitialConfiguration::Equilibrium(statics), ..implicit(0.01) };
    let exact = differentiate_equilibria(&Suspended, &b, &statics, &[0.0]).unwrap();
    let history = differentiate(&Suspended, &b, &settings, &TIMES).unwrap();
    let mut worst = [0.0f64; 2];
    for o in 0..exact.names.len() {
        for p in 0..TIMES.len() {
            worst[0] = worst[0].max((history.values[o][p] - exact.values[o][0]).abs());
            for k in 0..b.len() {
                let error = (history.gradients[o][p][k] - exact.gradients[o][0][k]).abs() * size(b[k]);
                worst[1] = worst[1].max(error / largest(&exact, &b, o));
            }
        }
    }
    println!("from equilibrium: values {:.1e}, derivatives {:.1e}", worst[0], worst[1]);
    assert!(worst[0] < 1e-9 && worst[1] < 1e-8);
    check_adjoint("from equilibrium", &b, &history, |all| {
        differentiate_backwards(&Suspended, &b, &settings, &TIMES, all)
    });
}

#[test]
fn every_element_in_explicit_steps() {
    let b = Zoo::DESIGN;
    let eighth = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(0.01));
    for settings in [Explicit { method: &DOPRI5, ..eighth.clone() }, eighth] {
        let name = settings.method.name;
        let history = differentiate_explicitly(&Zoo, &b, &settings, &TIMES).unwrap();
        let run = |b: &[f64]| simulate_explicitly(&Zoo.build(b).unwrap(), &settings, &TIMES).unwrap().values;
        check_differences(name, &b, &history, run, 1e-6);
        check_adjoint(name, &b, &history, |all| differentiate_explicitly_backwards(&Zoo, &b, &settings, &TIMES, all));
    }
}

#[test]
fn inverse_dynamics_of_a_universal_joint() {
    let (b, assembly, at) = (Cardan::DESIGN, Assembly::default(), [0.1, 0.4, 0.9]);
    let history = differentiate_kinematics(&Cardan, &b, assembly, &at).unwrap();
    let run = |b: &[f64]| kinematics(&Cardan.build(b).unwrap(), assembly, &at).unwrap();
    check_differences("kinematics", &b, &history, run, 1e-7);
    check_adjoint("kinematics", &b, &history, |all| {
        differentiate_kinematics_backwards(&Cardan, &b, assembly, &at, all)
    });
    let hessians = differentiate_kinematics_twice(&Cardan, &b, assembly, &at, HessianPart::Full).unwrap();
    check_hessian("kinematics", &b, &hessians, |b| differentiate_kinematics(&Cardan, b, assembly, &at).unwrap());
}

#[test]
fn equilibria_of_a_suspended_body() {
    let (b, statics, at) = (Suspended::DESIGN, Statics::default(), [0.0]);
    let history = differentiate_equilibria(&Suspended, &b, &statics, &at).unwrap();
    let run = |b: &[f64]| equilibria(&Suspended.build(b).unwrap(), &statics, &at).unwrap();
    check_differences("statics", &b, &history, run, 1e-7);
    check_adjoint("statics", &b, &history, |all| {
        differentiate_equilibria_backwards(&Suspended, &b, &statics, &at, all)
    });
    let hessians = differentiate_equilibria_twice(&Suspended, &b, &statics, &at, HessianPart::Full).unwrap();
    check_hessian("statics", &b, &hessians, |b| differentiate_equilibria(&Suspended, b, &statics, &at).unwrap());
}

#[test]
fn second_derivatives_of_a_motion() {
    let (b, settings) = (Flail::DESIGN, implicit(0.01));
    let hessians = differentiate_twice(&Flail, &b, &settings, &TIMES, HessianPart::Full).unwrap();
    check_hessian("motion", &b, &hessians, |b| differentiate(&Flail, b, &settings, &TIMES).unwrap());
}

#[test]
fn a_flexible_arm() {
    let (b, settings) = (FlexibleArm::DESIGN, implicit(0.005));
    let history = differentiate(&FlexibleArm, &b, &settings, &TIMES).unwrap();
    let run = |b: &[f64]| simulate(&FlexibleArm.build(b).unwrap(), &settings, &TIMES).unwrap().values;
    check_differences("flexible arm", &b, &history, run, 1e-6);
    check_adjoint("flexible arm", &b, &history, |all| {
        differentiate_backwards(&FlexibleArm, &b, &settings, &TIMES, all)
    });
    let hessians = differentiate_twice(&FlexibleArm, &b, &settings, &TIMES[..2], HessianPart::Full).unwrap();
    check_hessian("flexible arm", &b, &hessians, |b| differentiate(&FlexibleArm, b, &settings, &TIMES[..2]).unwrap());
}

/// Largest difference of values and of gradients.
fn difference(a: &SensitiveHistory, b: &SensitiveHistory) -> [f64; 2] {
    let largest = |a: &[Vec<f64>], b: &[Vec<f64>]| {
        let pairs = a.concat().into_iter().zip(b.concat());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
    };
    [largest(&a.values, &b.values), largest(&a.gradients.concat(), &b.gradients.concat())]
}

/// Redundant constraints of hinges change neither the motion nor its derivatives.
#[test]
fn a_four_bar_with_redundant_hinges_has_the_derivatives_of_the_planar_one() {
    let (b, assembly, at) = (FourBar::DESIGN, Assembly::default(), [0.1, 0.5, 0.9]);
    let [plane, space] = [false, true].map(|in_space| FourBar { in_space, is_driven: true });
    let exact = differentiate_kinematics(&plane, &b, assembly, &at).unwrap();
    let history = differentiate_kinematics(&space, &b, assembly, &at).unwrap();
    let [values, gradients] = difference(&exact, &history);
    println!("kinematics: values {values:.1e}, derivatives {gradients:.1e}");
    assert!(values < 1e-8 && gradients < 1e-7);
    check_adjoint("four-bar", &b, &history, |all| differentiate_kinematics_backwards(&space, &b, assembly, &at, all));
    let [plane, space] = [false, true].map(|in_space| FourBar { in_space, is_driven: false });
    let explicit = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(2e-3));
    let exact = differentiate_explicitly(&plane, &b, &explicit, &at).unwrap();
    let history = differentiate_explicitly(&space, &b, &explicit, &at).unwrap();
    let [values, gradients] = difference(&exact, &history);
    println!("explicit steps: values {values:.1e}, derivatives {gradients:.1e}");
    assert!(values < 1e-6 && gradients < 1e-5);
    check_adjoint("four-bar", &b, &history, |all| differentiate_explicitly_backwards(&space, &b, &explicit, &at, all));
    let settings = implicit(0.01);
    let history = differentiate(&space, &b, &settings, &at).unwrap();
    let run = |b: &[f64]| simulate(&space.build(b).unwrap(), &settings, &at).unwrap().values;
    check_differences("four-bar, implicit", &b, &history, run, 1e-6);
    check_adjoint("four-bar, implicit", &b, &history, |all| differentiate_backwards(&space, &b, &settings, &at, all));
}
