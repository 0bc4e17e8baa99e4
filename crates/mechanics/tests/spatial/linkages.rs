//! Spatial linkages compared with closed forms and with the planar four-bar linkage.

use crate::{accurate, follows, times, watch};
use autodiff::{DualNum, Jet2, Scalar, gradient};
use linkwright_mechanics::analyses::kinematics::warn_of_motion;
use linkwright_mechanics::constraint_rank::redundant_constraints;
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::forward::instants::differentiate_kinematics;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::initial_conditions::assemble;
use linkwright_mechanics::mechanism::{Body, Body3, Pose3, Rotation};
use linkwright_mechanics::motion::ConstantSpeed;
use linkwright_mechanics::system::System;
use linkwright_mechanics::system::state::State;
use linkwright_mechanics::{
    Assembly, Dynamics, Explicit, Mechanism, ParametricMechanism, Pose, Result, kinematics, simulate,
    simulate_explicitly,
};
use std::f64::consts::{FRAC_PI_2, PI};

/// A four-bar linkage in the plane, or in a tilted plane in space with hinges.
struct FourBar {
    /// Ground, crank, coupler and rocker.
    lengths: [f64; 4],
    angle: f64,
    /// Speed of the crank if it is driven.
    speed: Option<f64>,
}

impl FourBar {
    const GRAVITY: [f64; 2] = [1.0, -9.0];
    const MASSES: [f64; 3] = [1.0, 1.5, 0.8];
    const MOMENTS: [f64; 3] = [0.05, 0.2, 0.1];
    const COUPLER_POINT: [f64; 2] = [0.3, 0.4];

    /// Middle and angle of crank, coupler and rocker.
    fn poses(&self) -> [[f64; 3]; 3] {
        let [ground, crank, coupler, rocker] = self.lengths;
        let (sin, cos) = self.angle.sin_cos();
        let a = [crank * cos, crank * sin];
        let (dx, dy) = (ground - a[0], -a[1]);
        let d = dx.hypot(dy);
        let turn = ((coupler * coupler + d * d - rocker * rocker) / (2.0 * coupler * d)).acos();
        let beta = dy.atan2(dx) + turn;
        let b = [a[0] + coupler * beta.cos(), a[1] + coupler * beta.sin()];
        let psi = b[1].atan2(b[0] - ground);
        [
            [0.5 * a[0], 0.5 * a[1], self.angle],
            [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), beta],
            [0.5 * (ground + b[0]), 0.5 * b[1], psi],
        ]
    }

    fn planar(&self) -> Mechanism<f64> {
        let mut m = Mechanism::with_gravity(Self::GRAVITY[0], Self::GRAVITY[1]);
        let poses = self.poses();
        let bodies: [Body; 3] = [0, 1, 2].map(|k| {
            let [x, y, theta] = poses[k];
            m.body(&format!("bar {k}"), Self::MASSES[k], Self::MOMENTS[k], Pose { x, y, theta })
        });
        let [crank, coupler, rocker] = bodies;
        let [ground, a, b, c] = self.lengths;
        m.revolute("O", m.ground().at(0.0, 0.0), crank.at(-0.5 * a, 0.0));
        m.revolute("A", crank.at(0.5 * a, 0.0), coupler.at(-0.5 * b, 0.0));
        m.revolute("B", coupler.at(0.5 * b, 0.0), rocker.at(0.5 * c, 0.0));
        m.revolute("C", m.ground().at(ground, 0.0), rocker.at(-0.5 * c, 0.0));
        let [x, y] = Self::COUPLER_POINT;
        let sensor = m.sensor("sensor", coupler.at(x, y));
        watch(&mut m, sensor, &["x", "y", "vx", "vy", "ax", "ay"]).unwrap();
        if let Some(speed) = self.speed {
            m.drive(crank.theta, ConstantSpeed, &[self.angle, speed]);
            let torque = m.driving_force(crank.theta);
            m.output("torque", &[torque]);
        }
        m
    }

    /// The plane of the linkage is turned by `tilt`.
    fn spatial(&self, tilt: Rotation<f64>) -> Mechanism<f64> {
        let [gx, gy] = Self::GRAVITY;
        let mut m = Mechanism::with_gravity3(tilt.rotate([gx, gy, 0.0]));
        let (frame, poses) = (m.ground3(), self.poses());
        let bodies: [Body3; 3] = [0, 1, 2].map(|k| {
            let ([x, y, theta], moment) = (poses[k], Self::MOMENTS[k]);
            let pose = Pose3::new(tilt.rotate([x, y, 0.0]), tilt.then(Rotation::about_z(theta)));
            let properties = MassProperties3::principal(Self::MASSES[k], [0.6 * moment, 0.7 * moment, moment]);
            m.body3(&format!("bar {k}"), properties, pose)
        });
        let [crank, coupler, rocker] = bodies;
        let [ground, a, b, c] = self.lengths;
        let fixed = |x: f64| frame.at(tilt.rotate([x, 0.0, 0.0])).turned(tilt);
        let at = |body: Body3, x: f64| body.at([x, 0.0, 0.0]);
        m.revolute3("O", fixed(0.0), at(crank, -0.5 * a));
        m.revolute3("A", at(crank, 0.5 * a), at(coupler, -0.5 * b));
        m.revolute3("B", at(coupler, 0.5 * b), at(rocker, 0.5 * c));
        m.revolute3("C", fixed(ground), at(rocker, -0.5 * c));
        let [x, y] = Self::COUPLER_POINT;
        let sensor = m.sensor3("sensor", coupler.at([x, y, 0.0]));
        watch(&mut m, sensor, &["x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az"]).unwrap();
        if let Some(speed) = self.speed {
            let angle = m.drive_angle("crank", fixed(0.0), at(crank, -0.5 * a), ConstantSpeed, &[self.angle, speed]);
            let torque = m.driving_force(angle);
            m.output("torque", &[torque]);
        }
        m
    }

    /// Largest difference of the motion of the coupler point, out of the plane included.
    fn difference(tilt: Rotation<f64>, planar: &[Vec<f64>], spatial: &[Vec<f64>]) -> f64 {
        let mut worst = 0.0f64;
        for p in 0..planar[0].len() {
            for order in 0..3 {
                let own = tilt.inverse().rotate([0, 1, 2].map(|k| spatial[3 * order + k][p]));
                let expected = [planar[2 * order][p], planar[2 * order + 1][p], 0.0];
                (0..3).for_each(|k| worst = worst.max((own[k] - expected[k]).abs()));
            }
        }
        worst
    }
}

#[test]
fn a_four_bar_with_spatial_hinges_is_the_planar_one() {
    let tilt = Rotation::about([1.0, -2.0, 0.7], 0.9);
    let driven = FourBar { lengths: [2.0, 0.5, 1.8, 1.2], angle: 1.0, speed: Some(3.0) };
    let at = times(3.0, 60);
    let (plane, space) = (driven.planar(), driven.spatial(tilt));
    let planar = kinematics(&plane, Assembly::default(), &at).unwrap();
    let spatial = kinematics(&space, Assembly::default(), &at).unwrap();
    let worst = FourBar::difference(tilt, &planar, &spatial);
    println!("driven: {worst:.1e}");
    assert!(worst < 1e-9);
    for (a, b) in planar[6].iter().zip(&spatial[9]) {
        assert!((a - b).abs() < 1e-8, "torque {a} {b}");
    }
    let free = FourBar { speed: None, ..driven };
    let (plane, space) = (free.planar(), free.spatial(tilt));
    let planar = simulate_explicitly(&plane, &accurate(), &at).unwrap();
    let spatial = simulate_explicitly(&space, &accurate(), &at).unwrap();
    let worst = FourBar::difference(tilt, &planar.values, &spatial.values);
    println!("free: {worst:.1e}");
    assert!(worst < 1e-6);
    let implicit = simulate(&space, &Dynamics::fixed(2e-3), &at).unwrap();
    let worst = FourBar::difference(tilt, &planar.values, &implicit.values);
    println!("free, implicit steps: {worst:.1e}");
    assert!(worst < 5e-2);
}

/// A spatial slider-crank mechanism of the kind of Haug's example: a crank about x at (0, 0.1, 0.12) m with an arm of 0.08 m,
/// a rod of 0.3 m and a slider on the x-axis.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 10.2, for the joints.
#[test]
fn a_spatial_slider_crank_moves_as_its_triangle_says() {
    let (speed, arm, length) = (2.0 * PI, 0.08, 0.3);
    let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -9.81]);
    let ground = m.ground3();
    let (axle, pin, end) = ([0.0, 0.1, 0.12], [0.0, 0.1, 0.2], [0.2, 0.0, 0.0]);
    let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * (pin[k] + end[k]));
    let half: [f64; 3] = std::array::from_fn(|k| 0.5 * (end[k] - pin[k]));
    let crank = m.body3("crank", MassProperties3::principal(0.12, [1e-4, 1e-4, 5e-5]), Pose3::at(axle));
    let rod = m.body3("rod", MassProperties3::principal(0.5, [4e-3, 4e-3, 4e-3]), Pose3::at(middle));
    let slider = m.body3("slider", MassProperties3::principal(2.0, [1e-4; 3]), Pose3::at(end));
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let hinge = [ground.at(axle).with_z_x(x, y), crank.origin().with_z_x(x, y)];
    m.revolute3("hinge", hinge[0], hinge[1]);
    m.spherical("ball", crank.at([0.0, 0.0, arm]), rod.at(half.map(|x| -x)));
    // The second axis of the cross is normal to the rod and to the first axis, y.
    let across = [half[2], 0.0, -half[0]];
    m.universal("cross", slider.origin().with_z(y), rod.at(half).with_z(across));
    m.prismatic3("guide", ground.origin().with_z_x(x, z), slider.origin().with_z_x(x, z));
    let input = m.drive_angle("input", hinge[0], hinge[1], ConstantSpeed, &[0.0, speed]);
    let sensor = m.sensor3("sensor", slider.origin());
    watch(&mut m, sensor, &["x", "vx", "ax"]).unwrap();
    let terms = [m.driving_force(input), m.kinetic_energy(), m.potential_energy()];
    m.output("torque", &terms[..1]);
    m.output("energy", &terms[1..]);
    let at = times(2.0, 97);
    let values = kinematics(&m, Assembly::default(), &at).unwrap();
    let position = |t: f64| {
        let (sin, cos) = Jet2::new(speed * t, speed, 0.0).sin_cos();
        let (y, z) = (-sin * arm + 0.1, cos * arm + 0.12);
        (-(y * y) - z * z + length * length).sqrt()
    };
    follows("position", &at, &values[0], |t| position(t).re, 1e-12);
    follows("velocity", &at, &values[1], |t| position(t).v1, 1e-11);
    follows("acceleration", &at, &values[2], |t| position(t).v2, 1e-9);
    // The torque does the work of the energy: T ω = dE/dt, by differences.
    for (t, torque) in at.iter().zip(&values[3]).step_by(7) {
        let h = 1e-4;
        let around = kinematics(&m, Assembly::default(), &[t - 2.0 * h, t - h, t + h, t + 2.0 * h]).unwrap();
        let e = &around[4];
        let power = (8.0 * (e[2] - e[1]) - (e[3] - e[0])) / (12.0 * h);
        assert!((torque * speed - power).abs() < 1e-7, "{t}: {} {power}", torque * speed);
    }
}

/// A function generator RSSR: a crank about z at the origin, a rocker about y, and a coupler with two spherical joints.
///
/// b = (crank, rocker, coupler, position of the rocker's axis).
struct FunctionGenerator;

impl FunctionGenerator {
    const DESIGN: [f64; 6] = [0.3, 0.8, 1.1, 1.0, 0.2, -0.5];
    const SPEED: f64 = 2.0;

    /// Angle of the rocker from z towards x for the angle φ of the crank.
    fn rocker<T: Scalar>(b: &[T], phi: T) -> T {
        let (sin, cos) = phi.sin_cos();
        let d = [b[0] * cos - b[3], b[0] * sin - b[4], -b[5]];
        let square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let c = (square + b[1] * b[1] - b[2] * b[2]) / (b[1] * 2.0);
        d[0].atan2(d[2]) + (c / (d[0] * d[0] + d[2] * d[2]).sqrt()).acos()
    }
}

impl ParametricMechanism for FunctionGenerator {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let number = |x: f64| S::from(x);
        let vector = |v: [f64; 3]| v.map(S::from);
        let mut m = Mechanism::new();
        let ground = m.ground3();
        let properties = MassProperties3::principal(number(1.0), vector([0.1; 3]));
        let (x, y, z) = (vector([1.0, 0.0, 0.0]), vector([0.0, 1.0, 0.0]), vector([0.0, 0.0, 1.0]));
        let zero = number(0.0);
        let crank = m.body3("crank", properties, Pose3::at(vector([0.0; 3])));
        let psi = Self::rocker(b, zero);
        let centre = [b[3], b[4], b[5]];
        let rocker = m.body3("rocker", properties, Pose3::new(centre, Rotation::about_y(psi)));
        let input = [ground.origin().with_z_x(z, x), crank.origin().with_z_x(z, x)];
        let output = [ground.at(centre).with_z_x(y, z), rocker.origin().with_z_x(y, z)];
        m.revolute3("input", input[0], input[1]);
        m.revolute3("output", output[0], output[1]);
        m.distance_constraint3("coupler", crank.at([b[0], zero, zero]), rocker.at([zero, zero, b[1]]), b[2]);
        m.drive_angle("φ", input[0], input[1], ConstantSpeed, &[zero, number(Self::SPEED)]);
        let angle = m.joint_angle("ψ", output[0], output[1]);
        let still = m.ground().x;
        let sensor = m.coordinate_sensor("sensor", still, angle);
        watch(&mut m, sensor, &["position", "velocity"])?;
        Ok(m)
    }
}

#[test]
fn a_function_generator_and_its_exact_derivatives() {
    let b = FunctionGenerator::DESIGN;
    let at = times(2.0 * PI / FunctionGenerator::SPEED, 48);
    let m = FunctionGenerator.build(&b).unwrap();
    let values = kinematics(&m, Assembly::default(), &at).unwrap();
    let exact = |t: f64| {
        let b = b.map(Jet2::from);
        FunctionGenerator::rocker(&b, Jet2::new(FunctionGenerator::SPEED * t, FunctionGenerator::SPEED, 0.0))
    };
    // The closed form has the principal value, the coordinate counts turns.
    let near = |value: f64, t: f64| value - 2.0 * PI * ((value - exact(t).re) / (2.0 * PI)).round();
    let series: Vec<f64> = at.iter().zip(&values[0]).map(|(&t, &value)| near(value, t)).collect();
    follows("ψ", &at, &series, |t| exact(t).re, 1e-11);
    follows("rate", &at, &values[1], |t| exact(t).v1, 1e-10);
    let history = differentiate_kinematics(&FunctionGenerator, &b, Assembly::default(), &at).unwrap();
    let mut worst = 0.0f64;
    for (p, &t) in at.iter().enumerate() {
        let (_, expected) = gradient(|b| FunctionGenerator::rocker(b, b[0] * 0.0 + FunctionGenerator::SPEED * t), &b);
        for k in 0..b.len() {
            worst = worst.max((history.gradients[0][p][k] - expected[k]).abs());
        }
    }
    println!("derivatives of ψ: {worst:.1e}");
    assert!(worst < 1e-9);
}

/// Bricard's linkage with three planes of symmetry: six bars of 1 m whose hinges are at right angles. It moves although the
/// count of its constraints says that it cannot.
struct Bricard;

impl Bricard {
    /// Mass and moment of inertia of each bar, gravity.
    const DESIGN: [f64; 3] = [1.0, 1.0 / 12.0, 9.81];
}

impl ParametricMechanism for Bricard {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let vector = |v: [f64; 3]| v.map(S::from);
        let zero = S::from(0.0);
        let points = [[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]].map(|p| p.map(f64::from));
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let axes = [y, z, x, y, z, x];
        let mut m = Mechanism::with_gravity3([zero, -b[2], zero]);
        let ground = m.ground3();
        let mut before = (ground, [0.0; 3]);
        for k in 0..5 {
            let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (points[k][i] + points[k + 1][i]));
            let is_across = |i: usize| points[k + 1][i] == points[k][i];
            let moments = std::array::from_fn(|i| if is_across(i) { b[1] } else { S::from(1e-3) });
            let properties = MassProperties3::principal(b[0] * (1.0 + 0.1 * k as f64), moments);
            let bar = m.body3(&format!("bar {k}"), properties, Pose3::at(vector(middle)));
            let at = |body: Body3, origin: [f64; 3], p: usize| {
                body.at(std::array::from_fn(|i| S::from(points[p][i] - origin[i]))).with_z(vector(axes[p]))
            };
            m.revolute3(&format!("hinge {k}"), at(before.0, before.1, k), at(bar, middle, k));
            for p in [k, k + 1] {
                let sensor = m.sensor3("end", at(bar, middle, p));
                watch(&mut m, sensor, &["x", "y", "z"])?;
            }
            if k == 4 {
                m.revolute3("hinge 5", at(bar, middle, 5), at(ground, [0.0; 3], 5));
            }
            before = (bar, middle);
        }
        let terms = [m.kinetic_energy(), m.potential_energy()];
        m.output("energy", &terms);
        Ok(m)
    }
}

fn bricard() -> Mechanism<f64> {
    Bricard.build(&Bricard::DESIGN).unwrap()
}

/// The stages of long explicit steps are not exactly on the constraints, where their gradients are independent.
#[test]
fn derivatives_of_an_overconstrained_linkage_do_not_depend_on_method_and_tolerance() {
    let (b, at) = (Bricard::DESIGN, times(1.0, 5));
    let exact = differentiate_explicitly(&Bricard, &b, &accurate(), &at).unwrap();
    let outputs = exact.gradients.len();
    let responses: Vec<_> = (0..outputs).map(|output| AdjointFunctional::at(output, 4)).collect();
    let sizes: Vec<f64> =
        exact.gradients.iter().map(|rows| rows[4].iter().fold(1.0f64, |a, x| a.max(x.abs()))).collect();
    for tolerance in [1e-5, 1e-6, 1e-8] {
        for settings in [Explicit::adaptive(tolerance), Explicit::eighth_order(tolerance)] {
            let direct = differentiate_explicitly(&Bricard, &b, &settings, &at).unwrap();
            let adjoint = differentiate_explicitly_backwards(&Bricard, &b, &settings, &at, &responses).unwrap();
            let (mut methods, mut error) = (0.0f64, 0.0f64);
            for (output, size) in sizes.iter().enumerate() {
                for i in 0..b.len() {
                    let derivative = direct.gradients[output][4][i];
                    methods = methods.max((derivative - adjoint[(output, i)]).abs() / size);
                    error = error.max((derivative - exact.gradients[output][4][i]).abs() / size);
                }
            }
            println!("{} at {tolerance:e}: methods differ by {methods:.1e}, error {error:.1e}", settings.method.name);
            // Errors of the steps add up: 1 to 6 tolerances.
            assert!(methods < 1e-12 && error < 30.0 * tolerance);
        }
    }
}

/// # Sources
/// Chen, You & Tarnai, *Int. J. Solids Struct.* 42 (2005) 2287–2301: closure of threefold-symmetric Bricard linkages.
#[test]
fn bricards_linkage_moves_with_one_redundant_constraint() {
    let m = bricard();
    let (mut system, mut state) = (System::new(&m).unwrap(), State::built(&m, 0.0));
    assemble(&mut system, &m, &mut state, Assembly::default()).unwrap();
    assert_eq!(redundant_constraints(&system, &m, &state).len(), 1);
    let at = times(2.0, 100);
    for (name, run, closure, energy) in [
        ("explicit", simulate_explicitly(&m, &accurate(), &at), 1e-8, 1e-7),
        ("implicit", simulate(&m, &Dynamics::fixed(1e-3), &at), 1e-6, 1e-2),
    ] {
        let values = run.unwrap().values;
        let mut worst = [0.0f64; 2];
        for p in 0..at.len() {
            let end = |k: usize, i: usize| values[3 * k + i][p];
            let mut along: Vec<[f64; 3]> =
                (0..5).map(|k| std::array::from_fn(|i| end(2 * k + 1, i) - end(2 * k, i))).collect();
            along.push([0.0, 0.0, -1.0]);
            let cosine = |k: usize| (0..3).map(|i| along[(k + 5) % 6][i] * along[k][i]).sum::<f64>();
            for k in 0..6 {
                let (a, b) = (cosine(k), cosine((k + 1) % 6));
                worst[0] = worst[0].max((a + b + a * b).abs());
            }
            worst[1] = worst[1].max((values[30][p] - values[30][0]).abs());
        }
        let moved = (values[3][99] - values[3][0]).abs() + (values[4][99] - values[4][0]).abs();
        println!("{name}: closure {:.1e}, energy {:.1e} J, moved {moved:.2}", worst[0], worst[1]);
        assert!(worst[0] < closure && worst[1] < energy);
    }
}

/// A flyball governor at constant speed: the arms settle at the angle θ with cos θ = g/(ω² l).
#[test]
fn the_arms_of_a_governor_settle_at_their_angle() {
    let (g, l, speed) = (9.81, 0.4, 8.0);
    let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -g]);
    let ground = m.ground3();
    let spindle = m.body3("spindle", MassProperties3::principal(2.0, [0.1; 3]), Pose3::at([0.0; 3]));
    m.revolute3("bearing", ground.origin(), spindle.origin());
    m.drive_angle("motor", ground.origin(), spindle.origin(), ConstantSpeed, &[0.0, speed]);
    m.set_velocity3(spindle, [0.0; 3], [0.0, 0.0, speed]);
    let still = m.ground().theta;
    let down = [0.0, 0.0, -1.0];
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        // The hinge is along y of the spindle; the angle is that of the arm from the downward direction outwards.
        let axis = [0.0, -side, 0.0];
        let ball = MassProperties3::principal(1.2, [1e-3; 3]).with_centre([0.0, 0.0, -l]);
        let arm = m.body3(name, ball, Pose3::new([0.0; 3], Rotation::about(axis, 0.5)));
        m.set_velocity3(arm, [0.0; 3], [0.0, 0.0, speed]);
        let (a, b) = (spindle.origin().with_z_x(axis, down), arm.origin().with_z_x(axis, down));
        m.revolute3(name, a, b);
        let angle = m.joint_angle(&format!("{name} angle"), a, b);
        m.coordinate_spring(name, still, angle, [0.0, 2.0, 0.0, 0.0]);
        let sensor = m.coordinate_sensor("sensor", still, angle);
        watch(&mut m, sensor, &["position"]).unwrap();
    }
    let run = simulate_explicitly(&m, &accurate(), &[0.0, 8.0]).unwrap();
    let expected = (g / (speed * speed * l)).acos();
    for series in &run.values {
        println!("{:.12} for {expected:.12}", series[1]);
        assert!((series[0] - 0.5).abs() < 1e-12 && (series[1] - expected).abs() < 1e-7);
    }
    assert!(expected < FRAC_PI_2);
}

/// Bennett's linkage: four bars of the lengths a, b, a, b whose hinges are twisted by α, β, α, β, with a/sin α = b/sin β. It has
/// three redundant constraints. The angles θ and φ of the hinges satisfy tan θ/2 tan φ/2 = sin ½(β + α)/sin ½(β − α).
struct Bennett {
    bars: [(f64, f64); 2],
}

impl Bennett {
    const START: f64 = PI / 3.0;

    fn new(twists: [f64; 2]) -> Self {
        let [alpha, beta] = twists;
        Self { bars: [(0.2, alpha), (0.2 * beta.sin() / alpha.sin(), beta)] }
    }

    /// Positions and axes of the hinges at the angle θ, in axes fixed to the bar that is the ground.
    fn hinges(&self, theta: f64) -> [[[f64; 3]; 2]; 4] {
        let [(a, alpha), (b, beta)] = self.bars;
        let ratio = (0.5 * (beta + alpha)).sin() / (0.5 * (beta - alpha)).sin();
        let phi = 2.0 * (ratio * (0.5 * theta).cos()).atan2((0.5 * theta).sin());
        let (mut turned, mut origin) = (Rotation::identity(), [0.0; 3]);
        let mut hinges = [[origin, [0.0, 0.0, 1.0]]; 4];
        for (k, (angle, length, twist)) in
            [(theta, a, alpha), (phi, b, beta), (-theta, a, alpha)].into_iter().enumerate()
        {
            turned = turned.then(Rotation::about_z(angle));
            let bar = turned.rotate([length, 0.0, 0.0]);
            origin = std::array::from_fn(|i| origin[i] + bar[i]);
            turned = turned.then(Rotation::about_x(twist));
            hinges[k + 1] = [origin, turned.rotate([0.0, 0.0, 1.0])];
        }
        hinges
    }

    /// The linkage with θ = π/3 + t, and the place of the third hinge as its output.
    fn driven(&self) -> Mechanism<f64> {
        let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
        let ground = m.ground3();
        let hinges = self.hinges(Self::START);
        let mut before = (ground, [0.0; 3]);
        for k in 0..3 {
            let [middle, axis] = hinges[k];
            let bar = m.body3(&format!("bar {k}"), MassProperties3::principal(1.0, [0.01; 3]), Pose3::at(middle));
            let at = |(body, origin): (Body3, [f64; 3]), [point, axis]: [[f64; 3]; 2]| {
                body.at(std::array::from_fn(|i| point[i] - origin[i])).with_z(axis)
            };
            m.revolute3(&format!("hinge {k}"), at(before, hinges[k]), at((bar, middle), [middle, axis]));
            match k {
                0 => {
                    let ends = [at((ground, [0.0; 3]), hinges[0]), at((bar, middle), hinges[0])];
                    m.drive_angle("motor", ends[0], ends[1], ConstantSpeed, &[0.0, 1.0]);
                }
                1 => {
                    let sensor = m.sensor3("third hinge", at((bar, middle), hinges[2]));
                    watch(&mut m, sensor, &["x", "y", "z"]).unwrap();
                }
                _ => {
                    m.revolute3("hinge 3", at((bar, middle), hinges[3]), at((ground, [0.0; 3]), hinges[3]));
                }
            }
            before = (bar, middle);
        }
        m
    }
}

/// The constraints that are independent at the start depend on each other at other angles, which are no singular positions.
///
/// # Sources
/// Bennett, *Engineering* 76 (1903) 777–778: the linkage, its ratio of lengths and the relation of its angles.
#[test]
fn bennetts_linkage_turns_without_singular_positions() {
    for twists in [[40.0, 70.0], [25.0, 120.0], [60.0, 100.0], [75.0, 30.0]] {
        let linkage = Bennett::new(twists.map(f64::to_radians));
        let m = linkage.driven();
        for intervals in [12, 37, 60] {
            let at: Vec<f64> = (0..=intervals).map(|k| 2.0 * PI * f64::from(k) / f64::from(intervals)).collect();
            let found = kinematics(&m, Assembly::default(), &at).unwrap();
            for (p, t) in at.iter().enumerate() {
                let expected = linkage.hinges(Bennett::START + t)[2][0];
                let error = (0..3).map(|i| (found[i][p] - expected[i]).abs()).fold(0.0, f64::max);
                assert!(error < 1e-10, "{twists:?}, {intervals} intervals, t = {t}: {error:e}");
            }
            assert_eq!(
                warn_of_motion(&m, &Assembly::default(), &at),
                Vec::<String>::new(),
                "{twists:?}, {intervals} intervals"
            );
        }
    }
}
