//! Mechanisms at the edge of what can be solved: slender beams, redundant constraints, contacts, missing and double drives.

#[path = "support/finite_differences.rs"]
mod finite_differences;

use autodiff::Scalar;
use finite_differences::extrapolated_differences;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::analyses::indeterminate_outputs::warn_of_indeterminate_outputs;
use linkwright_mechanics::analyses::statics::equilibria;
use linkwright_mechanics::constraint_rank::indeterminate_reactions;
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::elements::{BeamSection, Shear};
use linkwright_mechanics::initial_conditions::assemble;
use linkwright_mechanics::integrators::explicit::{Explicit, Ode, integrate};
use linkwright_mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Ramp, StartUp};
use linkwright_mechanics::system::System;
use linkwright_mechanics::system::state::State;
use linkwright_mechanics::{Assembly, Dynamics, Result, Statics, kinematics};

/// The elastica of a cantilever: EI θ″ = −P cos θ with θ(0) = 0 and θ′(L) = 0, by shooting. Returns the tip (x, y) over L
/// for the load P L²/EI, downwards.
///
/// # Sources
/// Bisshopp & Drucker, *Q. Appl. Math.* 3 (1945) 272–275.
fn elastica(load: f64) -> [f64; 2] {
    let shoot = |curvature: f64| {
        let rate = |[theta, kappa, ..]: [f64; 4]| [kappa, load * theta.cos(), theta.cos(), theta.sin()];
        let (mut y, n) = ([0.0, curvature, 0.0, 0.0], 4000);
        let h = 1.0 / f64::from(n);
        for _ in 0..n {
            let step = |k: [f64; 4], f: f64| std::array::from_fn(|i| y[i] + f * h * k[i]);
            let k1 = rate(y);
            let k2 = rate(step(k1, 0.5));
            let k3 = rate(step(k2, 0.5));
            let k4 = rate(step(k3, 1.0));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        y
    };
    let (mut low, mut high) = (-load, 0.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if shoot(middle)[1] > 0.0 { high = middle } else { low = middle }
    }
    let end = shoot(0.5 * (low + high));
    [end[2], end[3]]
}

/// A clamped strip of 1 m with a force at its tip, downwards; returns the tip.
fn strip(section: &BeamSection<f64>, elements: usize, force: f64) -> Result<[f64; 2]> {
    strip_of(1.0, section, elements, force)
}

/// A strip of this length (m).
fn strip_of(length: f64, section: &BeamSection<f64>, elements: usize, force: f64) -> Result<[f64; 2]> {
    let mut m = Mechanism::<f64>::new();
    let (nodes, _) = m.beam("strip", [[0.0, 0.0], [length, 0.0]], [None, None], elements, section, Shear::Flexible);
    nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
    m.load("force", m.ground().y, nodes[elements].y, Fixed, &[-force]);
    let sensor = m.sensor("tip", nodes[elements].origin());
    for name in ["x", "y"] {
        let term = m.measure(sensor, name)?;
        m.output(name, &[term]);
    }
    let values = equilibria(&m, &Statics::default(), &[0.0])?;
    Ok([values[0][0], values[1][0]])
}

#[test]
fn the_elastica_is_that_of_bisshopp_and_drucker() {
    // Table of δ/L for P L²/EI = 1 and 10: 0.30172 and 0.81061; (L − Δ)/L: 0.94357 and 0.44500 of Mattiasson (1981).
    for (load, [x, y]) in [(1.0, [1.0 - 0.05643, -0.30172]), (10.0, [1.0 - 0.55500, -0.81061])] {
        let tip = elastica(load);
        assert!((tip[0] - x).abs() < 2e-5 && (tip[1] - y).abs() < 2e-5, "{load}: {tip:?}");
    }
}

/// A steel strip of 1 m × 20 mm × 1 mm with 4 N at its tip.
#[test]
fn a_slender_strip_bends_with_any_number_of_elements() {
    let section = BeamSection::rectangular(0.02, 0.001, 2.1e11, 0.3, 7800.0);
    let exact = elastica(4.0 / section.bending);
    for (elements, tolerance) in [(10, 2e-2), (20, 5e-3), (50, 1e-3), (100, 2e-4), (160, 1e-4)] {
        let tip = strip(&section, elements, 4.0).unwrap_or_else(|error| panic!("{elements}: {error}"));
        let error = (tip[0] - exact[0]).hypot(tip[1] - exact[1]);
        println!("{elements} elements: {tip:?}, error {error:.1e}");
        assert!(error < tolerance, "{elements} elements: {tip:?} instead of {exact:?}");
    }
}

#[test]
fn axial_stiffness_may_be_a_hundred_million_times_the_bending_stiffness() {
    for ratio in [1e6, 1e7, 1e8] {
        let section = BeamSection { axial: ratio, shear: 0.3 * ratio, bending: 1.0, mass: 1.0, inertia: 1e-3 };
        for elements in [8, 16, 33, 64] {
            for load in [2.0, 5.0, 10.0] {
                let exact = elastica(load);
                let tip =
                    strip(&section, elements, load).unwrap_or_else(|e| panic!("{ratio:e} {elements} {load}: {e}"));
                let error = (tip[0] - exact[0]).hypot(tip[1] - exact[1]);
                assert!(error < 1.5 / (elements * elements) as f64, "{ratio:e} {elements} {load}: {tip:?} {exact:?}");
            }
        }
    }
}

/// Sizes of mechanisms, as factors of lengths; forces grow with the square.
const SIZES: [f64; 4] = [1e-3, 1e2, 1e3, 1e6];

#[test]
fn strips_of_any_size_bend_alike() {
    for (elements, load) in [(20, 4.0), (100, 4.0), (33, 30.0)] {
        let of = |size: f64| {
            let section = BeamSection::rectangular(0.02 * size, 0.001 * size, 2.1e11, 0.3, 7800.0);
            let tip = strip_of(size, &section, elements, load * size * size);
            tip.unwrap_or_else(|error| panic!("{elements} elements of {size}: {error}")).map(|x| x / size)
        };
        let one = of(1.0);
        for size in SIZES {
            let tip = of(size);
            let error = (tip[0] - one[0]).hypot(tip[1] - one[1]);
            assert!(error < 1e-8, "{elements} elements of {size}: {tip:?} instead of {one:?}");
        }
    }
}

/// A beam of 16 elements that a moment at its end bends to a circle.
#[test]
fn beams_of_any_size_bend_to_a_circle() {
    for size in [1.0].into_iter().chain(SIZES) {
        let section = BeamSection {
            axial: 1e4 * size.powi(2),
            shear: 3e3 * size.powi(2),
            bending: size.powi(4),
            mass: 1.0,
            inertia: 1e-3,
        };
        let mut m = Mechanism::<f64>::new();
        let (nodes, _) = m.beam("beam", [[0.0, 0.0], [size, 0.0]], [None, None], 16, &section, Shear::Flexible);
        nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
        let moment = std::f64::consts::TAU * size.powi(3);
        m.load("moment", m.ground().theta, nodes[16].theta, Fixed, &[moment]);
        let sensor = m.sensor("end", nodes[16].origin());
        for name in ["x", "y"] {
            let term = m.measure(sensor, name).unwrap();
            m.output(name, &[term]);
        }
        let end = equilibria(&m, &Statics::default(), &[0.0]).unwrap_or_else(|error| panic!("{size}: {error}"));
        assert!(end.iter().all(|x| x[0].abs() < 1e-8 * size), "{size}: {end:?}");
    }
}

/// Springs in series, the last of which carries a weight: equations that are linear, or nearly so, have their equilibrium at any distance.
#[test]
fn soft_springs_give_by_any_length() {
    for stiffness in [1e3f64, 4.9, 5e-2, 5e-3, 5e-5, 5e-8] {
        for cubic in [0.0f64, 1e-3] {
            let mut m = Mechanism::<f64>::new();
            let mut upper = m.ground().x;
            for k in 0..3 {
                let lower = m.coordinate(format!("slider {k}"), 0.0, 0.0);
                // At the elongation of the linear spring, its force is larger by this fraction.
                let third = cubic * stiffness * stiffness * stiffness / (9.81 * 9.81);
                m.coordinate_spring(&format!("spring {k}"), upper, lower, [stiffness, 0.0, 0.0, third]);
                upper = lower;
            }
            m.load("weight", m.ground().x, upper, Fixed, &[9.81]);
            let sensor = m.coordinate_sensor("end", m.ground().x, upper);
            let position = m.measure(sensor, "position").unwrap();
            m.output("position", &[position]);
            let found = equilibria(&m, &Statics::default(), &[0.0]).unwrap()[0][0];
            let linear = 3.0 * 9.81 / stiffness;
            let expected = 1.0 - cubic + 3.0 * cubic * cubic - 12.0 * cubic.powi(3);
            assert!(
                (found / linear - expected).abs() < 1e-9,
                "{stiffness} N/m, {cubic}: {found} for {}",
                linear * expected
            );
        }
    }
}

/// An arch of two rods and springs snaps through: the limit point is passed, or named.
#[test]
fn a_shallow_truss_snaps_through_its_limit_point() {
    let truss = |force: f64| truss_of(1.0, force);
    // The largest force before the limit point is about 0.0384 N.
    assert!(truss(0.03).unwrap() > 0.05);
    assert!(truss(0.06).unwrap() < -0.1);
    for (size, force) in SIZES.into_iter().flat_map(|size| [(size, 0.03), (size, 0.06)]) {
        let [y, one] = [truss_of(size, force).unwrap_or_else(|e| panic!("{size}: {e}")), truss(force).unwrap()];
        assert!((y - one).abs() < 1e-8, "{size}: {y} instead of {one}");
    }
}

/// The height of the loaded arch over its size (m).
fn truss_of(size: f64, force: f64) -> Result<f64> {
    let mut m = Mechanism::<f64>::new();
    let (ground, apex) = (m.ground(), m.point_mass("apex", 1.0, 0.0, 0.1 * size));
    m.fix(apex.x);
    for side in [-1.0, 1.0] {
        let length = size * f64::hypot(1.0, 0.1);
        let spring = [100.0 * size, 0.0, length];
        m.spring_damper(&format!("rod {side}"), ground.at(side * size, 0.0), apex.origin(), spring);
    }
    m.load("force", ground.y, apex.y, Fixed, &[-force * size * size]);
    let sensor = m.sensor("apex position", apex.origin());
    let y = m.measure(sensor, "y")?;
    m.output("y", &[y]);
    equilibria(&m, &Statics::default(), &[0.0]).map(|values| values[0][0] / size)
}

/// A platform on parallel cranks of the same length.
struct Platform {
    cranks: usize,
}

impl ParametricMechanism for Platform {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, c) = (S::from(0.0), S::from);
        let [length, mass, angle] = [b[0], b[1], b[2]];
        let mut m = Mechanism::with_gravity(zero, c(-9.81));
        let ground = m.ground();
        let (sin, cos) = angle.sin_cos();
        let platform = m.body("platform", mass, c(0.1), Pose { x: length * cos + 0.5, y: length * sin, theta: zero });
        for (k, (x, y)) in [(0.0, 0.0), (1.0, 0.0), (0.37, 0.2), (0.6, -0.1)].into_iter().take(self.cranks).enumerate()
        {
            let pose = Pose { x: length * cos * 0.5 + x, y: length * sin * 0.5 + y, theta: angle };
            let crank = m.body(&format!("crank {k}"), c(0.5), c(0.01), pose);
            m.revolute(&format!("foot {k}"), ground.at(c(x), c(y)), crank.at(length * -0.5, zero));
            m.revolute(&format!("head {k}"), crank.at(length * 0.5, zero), platform.at(c(x - 0.5), c(y)));
        }
        let sensor = m.sensor("platform position", platform.origin());
        for name in ["x", "y", "vx", "ay"] {
            let term = m.measure(sensor, name)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}

/// Motion of the platform with the angle of the cranks as the only coordinate.
struct PlatformAngle(f64);

impl Ode for PlatformAngle {
    fn start<S: Scalar>(&self, b: &[S]) -> Vec<S> {
        vec![b[2], S::from(0.0)]
    }
    fn rates<S: Scalar>(&self, b: &[S], _t: f64, y: &[S], out: &mut [S]) {
        let (l, m, cranks) = (b[0], b[1], self.0);
        let inertia = (l * l * 0.125 + 0.01) * cranks + m * l * l;
        out[0] = y[1];
        out[1] = -(l * (0.25 * cranks) + m * l) * y[0].cos() * 9.81 / inertia;
    }
}

const PLATFORM: [f64; 3] = [0.3, 1.0, 0.7];

#[test]
fn a_platform_on_parallel_cranks_moves_as_its_single_coordinate() {
    let times = [0.1, 0.25, 0.4];
    for cranks in [3, 4] {
        let exact =
            integrate(&PlatformAngle(cranks as f64), &PLATFORM, &Explicit::eighth_order(1e-13), &times).unwrap();
        let platform = Platform { cranks }.build(&PLATFORM).unwrap();
        let explicit = simulate_explicitly(&platform, &Explicit::eighth_order(1e-11), &times).unwrap();
        let implicit = simulate(&platform, &Dynamics::fixed(2e-4), &times).unwrap();
        for (k, theta) in exact.values[0].iter().enumerate() {
            let y = PLATFORM[0] * theta.sin();
            assert!((explicit.values[1][k] - y).abs() < 1e-9, "{cranks} cranks: {} {y}", explicit.values[1][k]);
            assert!((implicit.values[1][k] - y).abs() < 1e-6, "{cranks} cranks: {} {y}", implicit.values[1][k]);
        }
    }
}

#[test]
fn redundant_constraints_keep_the_derivatives_of_the_motion_exact() {
    let times = [0.1, 0.25];
    let (b, model) = (PLATFORM, Platform { cranks: 3 });
    let settings = Explicit::eighth_order(1e-11);
    let direct = differentiate_explicitly(&model, &b, &settings, &times).unwrap();
    let all: Vec<_> = (0..2).map(|p| AdjointFunctional::at(1, p)).collect();
    let adjoint = differentiate_explicitly_backwards(&model, &b, &settings, &times, &all).unwrap();
    let exact = |b: &[f64]| {
        let angles = integrate(&PlatformAngle(3.0), b, &Explicit::eighth_order(1e-13), &times).unwrap().values;
        vec![angles[0].iter().map(|angle| b[0] * angle.sin()).collect()]
    };
    for i in 0..3 {
        let differences = extrapolated_differences(&b, i, 1e-4, exact);
        for (k, derivative) in differences[0].iter().enumerate() {
            for computed in [direct.gradients[1][k][i], adjoint[(k, i)]] {
                assert!((computed - derivative).abs() < 1e-7, "{k} {i}: {computed} {derivative}");
            }
        }
    }
}

/// A platform with the reaction of its first crank as an output.
struct LoadedPlatform;

impl ParametricMechanism for LoadedPlatform {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let mut m = Platform { cranks: 3 }.build(b)?;
        let extra = m.body("bob", S::from(0.1), S::from(0.01), Pose { x: b[0], y: b[0], theta: b[0] * 0.0 });
        let ground = m.ground();
        let pin = m.revolute("pin", ground.at(b[0], b[0]), extra.origin());
        let again = m.revolute("same pin", ground.at(b[0], b[0]), extra.origin());
        for (joint, name) in [(pin, "first"), (again, "second")] {
            let force = m.measure(joint, "force_y")?;
            m.output(name, &[force]);
        }
        Ok(m)
    }
}

/// A slider in two guides, with friction in one of them: half of the weight on it is one of many possible shares. In one guide it is determined.
#[test]
fn friction_of_an_indeterminate_reaction_is_told() {
    for guides in [1, 2] {
        let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
        let ground = m.ground();
        let slider = m.body("slider", 2.0, 0.05, Pose { x: 0.0, y: 0.0, theta: 0.0 });
        m.set_velocity(slider.x, 1.0);
        for guide in 0..guides {
            let y = 0.1 * f64::from(guide);
            let joint = m.prismatic(&format!("guide {guide}"), ground.at(0.0, y), 0.0, slider.at(0.0, y), 0.0);
            if guide == 0 {
                m.guide_friction("friction", joint, [0.3, 0.01, 0.0, 1e-3]).unwrap();
            }
        }
        let warnings = warn_of_indeterminate_outputs(&m, Assembly::default(), 0.0).unwrap();
        let told = warnings.iter().any(|warning| warning.starts_with("friction: ") && warning.contains("the motion"));
        assert_eq!(told, guides == 2, "{warnings:?}");
    }
}

#[test]
fn indeterminate_reactions_have_values_of_least_norm_but_no_derivatives() {
    let settings = Explicit::eighth_order(1e-9);
    let plain = LoadedPlatform.build(&PLATFORM).unwrap();
    let values = simulate_explicitly(&plain, &settings, &[0.1]).unwrap().values;
    for output in [4, 5] {
        assert!((values[output][0].abs() - 0.5 * 0.1 * 9.81).abs() < 1e-6, "{values:?}");
    }
    let warnings = warn_of_indeterminate_outputs(&plain, Assembly::default(), 0.0).unwrap();
    let told: Vec<&str> = warnings.iter().filter_map(|warning| warning.split(": ").next()).collect();
    let all = plain.output_names();
    let names = [4, 5].map(|output| all[output].as_str());
    assert!(names.iter().all(|name| told.contains(name)) && told.len() < all.len(), "{warnings:?}");
    let error = differentiate_explicitly(&LoadedPlatform, &PLATFORM, &settings, &[0.1]).unwrap_err();
    assert!(error.to_string().contains("first") && error.to_string().contains("no derivative"), "{error}");
}

#[test]
fn indeterminate_reactions_are_named() {
    let platform = Platform { cranks: 3 }.build(&PLATFORM).unwrap();
    let (mut system, mut state) = (System::new(&platform).unwrap(), State::built(&platform, 0.0));
    assemble(&mut system, &platform, &mut state, Assembly::default()).unwrap();
    assert!(system.allows_redundancy());
    let names = indeterminate_reactions(&system, &platform, &state);
    assert!(names.iter().any(|name| name.contains("head 2")), "{names:?}");
    let determinate = Platform { cranks: 2 }.build(&PLATFORM).unwrap();
    let (mut system, mut state) = (System::new(&determinate).unwrap(), State::built(&determinate, 0.0));
    assemble(&mut system, &determinate, &mut state, Assembly::default()).unwrap();
    assert!(!system.allows_redundancy() && indeterminate_reactions(&system, &determinate, &state).is_empty());
}

/// A ball that bounces on a floor with the contact law of Hunt and Crossley.
struct Ball;

impl ParametricMechanism for Ball {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let ball = m.point_mass("ball", S::from(1.0), zero, b[2]);
        m.fix(ball.x);
        let up = S::from(std::f64::consts::FRAC_PI_2);
        m.wall_contact("floor", ball.origin(), [zero, zero], up, [b[0], b[1]]);
        let sensor = m.sensor("ball position", ball.origin());
        for name in ["y", "vy"] {
            let term = m.measure(sensor, name)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}

#[test]
fn derivatives_through_a_compliant_contact_are_those_of_the_motion() {
    let (b, times) = ([1e5, 0.1, 0.3], [0.2, 0.4, 0.8]);
    let settings = Explicit::eighth_order(1e-12);
    let direct = differentiate_explicitly(&Ball, &b, &settings, &times).unwrap();
    for k in 0..3 {
        let values = |h: f64| {
            let mut moved = b;
            moved[k] += h;
            simulate_explicitly(&Ball.build(&moved).unwrap(), &settings, &times).unwrap().values
        };
        let h = 2e-3 * b[k];
        let runs = [h, -h, 0.5 * h, -0.5 * h, 0.25 * h, -0.25 * h].map(values);
        for output in 0..2 {
            for p in 0..3 {
                let central = |j: usize, h: f64| (runs[j][output][p] - runs[j + 1][output][p]) / (2.0 * h);
                let (d1, d2, d3) = (central(0, h), central(2, 0.5 * h), central(4, 0.25 * h));
                let (e1, e2) = ((4.0 * d2 - d1) / 3.0, (4.0 * d3 - d2) / 3.0);
                let difference = (16.0 * e2 - e1) / 15.0;
                let computed = direct.gradients[output][p][k];
                let size = direct.gradients[output].iter().map(|g| g[k].abs()).fold(0.0, f64::max);
                println!("{output} {p} {k}: {computed:.9e} {difference:.9e}");
                assert!((computed - difference).abs() < 5e-5 * size, "{output} {p} {k}: {computed} {difference}");
            }
        }
    }
}

/// A double pendulum of which only the first link is driven.
#[test]
fn kinematics_names_the_degrees_of_freedom_that_are_not_driven() {
    let chain = |driven: usize| {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground();
        let [first, second] =
            [("first", 0.5), ("second", 1.5)].map(|(name, x)| m.body(name, 1.0, 0.1, Pose { x, y: 0.0, theta: 0.0 }));
        m.revolute("hook", ground.origin(), first.at(-0.5, 0.0));
        m.revolute("pin", first.at(0.5, 0.0), second.at(-0.5, 0.0));
        let drives = [(ground.theta, first.theta), (first.theta, second.theta)];
        for (k, (a, b)) in drives.into_iter().take(driven).enumerate() {
            m.driver(&format!("drive {k}"), a, b, ConstantSpeed, &[0.0, 1.0]);
        }
        kinematics(&m, Assembly::default(), &[0.0, 0.1]).map(|_| ())
    };
    assert_eq!(chain(2), Ok(()));
    let error = chain(1).unwrap_err().to_string();
    assert!(error.contains("second.theta") && error.contains("not driven") && !error.contains("first"), "{error}");
    let error = chain(0).unwrap_err().to_string();
    assert!(error.contains("first.theta") && error.contains("second.theta"), "{error}");
}

/// A crank-rocker whose crank makes whole turns between two time points: the rocker is where it was, however many turns there are.
#[test]
fn kinematics_keeps_its_branch_over_many_turns() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let at = [(0.5, 0.0, 0.0), (1.5, 1.5, 0.98), (2.5, 1.5, 1.8)];
    let [crank, rod, rocker] = [("crank", at[0]), ("rod", at[1]), ("rocker", at[2])]
        .map(|(name, (x, y, theta))| m.body(name, 1.0, 0.1, Pose { x, y, theta }));
    m.revolute("a", ground.origin(), crank.at(-0.5, 0.0));
    m.revolute("b", crank.at(0.5, 0.0), rod.at(-1.5, 0.0));
    m.revolute("c", rod.at(1.5, 0.0), rocker.at(1.25, 0.0));
    m.revolute("d", ground.at(3.0, 0.0), rocker.at(-1.25, 0.0));
    m.driver("motor", ground.theta, crank.theta, ConstantSpeed, &[0.0, std::f64::consts::TAU]);
    let sensor = m.sensor("sensor", rocker.at(0.0, 0.0));
    let angle = m.measure(sensor, "theta").unwrap();
    m.output("angle", &[angle]);
    for turns in [1.0, 80.0, 110.0, 128.0, 200.0, 1000.0] {
        let values = kinematics(&m, Assembly::default(), &[0.0, turns]).unwrap();
        let [first, last] = [values[0][0], values[0][1]];
        assert!((last - first).abs() < 1e-9, "after {turns} turns: {last} for {first}");
    }
}

#[test]
fn impossible_drives_are_rejected() {
    let cart = |drive: &dyn Fn(&mut Mechanism<f64>, linkwright_mechanics::Coordinate)| {
        let mut m = Mechanism::<f64>::new();
        let (cart, free) = (m.coordinate("cart", 0.0, 0.0), m.coordinate("free", 0.0, 0.0));
        m.inertia("mass", free, 1.0);
        drive(&mut m, cart);
        simulate(&m, &Dynamics::fixed(1e-2), &[0.1]).unwrap_err().to_string()
    };
    let error = cart(&|m, x| {
        m.drive(x, ConstantSpeed, &[0.0, 1.0]);
        m.drive(x, ConstantSpeed, &[0.0, 2.0]);
    });
    assert!(error.contains("cart") && error.contains("prescribed twice"), "{error}");
    let error = cart(&|m, x| m.drive(x, Ramp::Smooth, &[0.0, 1.0, 0.0, -0.5]));
    assert!(error.contains("cart") && error.contains("duration of its ramp is -0.5 s"), "{error}");
    let error = cart(&|m, x| m.drive(x, StartUp::Cycloid, &[0.0, 1.0, -0.5]));
    assert!(error.contains("duration of its start-up is -0.5 s"), "{error}");
    let error = cart(&|m, x| {
        m.fix(x);
        m.load("push", m.ground().x, x, Ramp::Linear, &[0.0, 1.0, 0.0, 0.0]);
    });
    assert!(error.contains("push") && error.contains("duration"), "{error}");
}

#[test]
fn contacts_of_negative_stiffness_are_rejected() {
    let error = simulate(&Ball.build(&[-1e3, 0.1, 0.3]).unwrap(), &Dynamics::fixed(1e-3), &[0.1]).unwrap_err();
    assert!(error.to_string().contains("floor") && error.to_string().contains("stiffness is -1000"), "{error}");
}

#[test]
fn positions_without_stiffness_are_named() {
    // A mass that hangs on a slack rope, and a rod on a pin whose weight has its longest lever arm.
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let mass = m.point_mass("mass", 1.0, 0.5, 0.0);
    let ground = m.ground();
    m.rope("line", ground.origin(), mass.origin(), [1e3, 0.0, 0.8]);
    let error = equilibria(&m, &Statics::default(), &[0.0]).unwrap_err().to_string();
    assert!(error.contains("stiffness is zero") && error.contains("slack or open there: line"), "{error}");
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let rod = m.body("rod", 1.0, 0.1, Pose { x: 0.5, y: 0.0, theta: 0.0 });
    let ground = m.ground();
    m.revolute("pin", ground.origin(), rod.at(-0.5, 0.0));
    let error = equilibria(&m, &Statics::default(), &[0.0]).unwrap_err().to_string();
    assert!(error.contains("stiffness is zero") && error.contains("start from another position"), "{error}");
}
