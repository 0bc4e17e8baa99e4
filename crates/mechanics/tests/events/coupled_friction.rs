//! Dry friction that joints couple to other coordinates: closed loops, chains in space, stops.

use crate::derivative_methods::{all_settings, check_adjoint_by};
use crate::explicit::check;
use crate::models::{Linear, outputs};
use autodiff::{Scalar, gradient, hessian};
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::events::Action;
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::mechanism::Pose3;
use linkwright_mechanics::motion::{Fixed, Harmonic};
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, History, Mechanism, ParametricMechanism, Pose, Result};

/// The implicit schemes with steps of the length `h` (s), and the explicit ones with tight tolerances.
fn by_all_schemes(m: &Mechanism<f64>, h: f64, times: &[f64]) -> [(History, f64); 4] {
    let hht = Dynamics { scheme: GeneralizedAlpha::hht(0.1).unwrap(), ..Dynamics::fixed(h) };
    [
        (simulate_explicitly(m, &Explicit::eighth_order(1e-11), times).unwrap(), 1e-7),
        (simulate_explicitly(m, &Explicit::adaptive(1e-10), times).unwrap(), 1e-6),
        (simulate(m, &Dynamics::fixed(h), times).unwrap(), 200.0 * h * h),
        (simulate(m, &hht, times).unwrap(), 400.0 * h * h),
    ]
}

/// Coordinate of a slider-crank that has friction.
#[derive(Clone, Copy, Debug)]
enum FrictionCoordinate {
    Crank,
    Rod,
    Slider,
}

/// A slider-crank under gravity that begins at rest at the angle b₀ of its crank, with the friction b₁ at one place: crank of 1 kg and
/// 0.01 kg·m², rod of 0.5 kg and 0.004 kg·m², slider of 1 kg; 0.1 m and 0.3 m.
struct SliderCrank(FrictionCoordinate);

impl ParametricMechanism for SliderCrank {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, [r, l]) = (S::from(0.0), [0.1, 0.3].map(S::from));
        let (sin, cos) = b[0].sin_cos();
        let reach = (l * l - r * r * sin * sin).sqrt();
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let (half_r, half_l) = (r * 0.5, l * 0.5);
        let crank =
            m.body("crank", S::from(1.0), S::from(0.01), Pose { x: cos * half_r, y: sin * half_r, theta: b[0] });
        let pose = Pose { x: r * cos + reach * 0.5, y: sin * half_r, theta: (-(r * sin)).atan2(reach) };
        let rod = m.body("rod", S::from(0.5), S::from(0.004), pose);
        let slider = m.body("slider", S::from(1.0), S::from(0.01), Pose { x: r * cos + reach, y: zero, theta: zero });
        let ground = m.ground();
        m.revolute("O", ground.origin(), crank.at(-half_r, zero));
        m.revolute("P", crank.at(half_r, zero), rod.at(-half_l, zero));
        m.revolute("Q", rod.at(half_l, zero), slider.origin());
        m.prismatic("guide", ground.origin(), zero, slider.origin(), zero);
        let at = match self.0 {
            FrictionCoordinate::Crank => crank.theta,
            FrictionCoordinate::Rod => rod.theta,
            FrictionCoordinate::Slider => slider.x,
        };
        m.dry_friction("friction", ground.x, at, [b[1], S::from(1.2), zero]);
        outputs(&mut m, crank.theta)?;
        Ok(m)
    }
}

/// Times in s at which motions of the slider-crank are compared.
const TIMES: [f64; 5] = [0.2, 0.5, 0.9, 1.5, 2.0];

/// The references integrate the equation of motion of the crank angle, with the kinematics of the slider-crank in closed form, by
/// DOP853 of SciPy 1.15 with the tolerances 1e-10, from one reversal of the friction to the next.
#[test]
fn dry_friction_in_a_closed_loop_slides_and_sticks_as_in_the_equation_of_its_only_coordinate() {
    for (place, start, friction, exact) in [
        (FrictionCoordinate::Slider, 0.5, 3.0, [-0.1206446, -2.2911391, -1.8257694, -1.1072353, -1.1072353]),
        (FrictionCoordinate::Crank, 0.5, 0.1, [-0.194339, -2.5781202, -1.8854441, -1.2611956, -2.0398151]),
        (FrictionCoordinate::Rod, 0.5, 0.1, [-0.2836835, -2.8937711, -2.1676604, -0.8194232, -2.9260363]),
        (FrictionCoordinate::Slider, 2.0, 0.1, [2.3131309, 4.9601698, 7.3120403, 4.1428034, 2.3959556]),
        (FrictionCoordinate::Slider, 0.5, 50.0, [0.5; 5]),
        (FrictionCoordinate::Rod, 1.0, 50.0, [1.0; 5]),
    ] {
        let m = SliderCrank(place).build(&[start, friction]).unwrap();
        for (history, accuracy) in by_all_schemes(&m, 1e-3, &TIMES) {
            let errors = history.values[0].iter().zip(exact).map(|(ours, exact)| (ours - exact).abs());
            let error = errors.fold(0.0, f64::max);
            println!("{place:?} {friction}: {error:.1e}");
            assert!(error < accuracy.max(1e-6), "{place:?} {friction}: {error:.1e} {:?}", history.values[0]);
        }
    }
}

/// So little friction that the motion is that without it, whatever the mechanism is at its start.
#[test]
fn little_dry_friction_in_a_closed_loop_hardly_matters() {
    let free = SliderCrank(FrictionCoordinate::Slider).build(&[0.5, 1e-12]).unwrap();
    let free = simulate_explicitly(&free, &Explicit::eighth_order(1e-11), &TIMES).unwrap();
    let little = SliderCrank(FrictionCoordinate::Slider).build(&[0.5, 1e-6]).unwrap();
    for (history, accuracy) in by_all_schemes(&little, 1e-3, &TIMES) {
        let errors = history.values[0].iter().zip(&free.values[0]).map(|(a, b)| (a - b).abs());
        let error = errors.fold(0.0, f64::max);
        assert!(error < accuracy.max(1e-4), "{error:.1e}");
    }
}

#[test]
fn adjoint_derivatives_of_friction_in_a_closed_loop_are_the_direct_ones() {
    let model = SliderCrank(FrictionCoordinate::Slider);
    check_adjoint_by(&all_settings()[..1], ("slider-crank", 1e-6), &model, &[0.5, 3.0], &[0.2, 0.5, 0.9]);
}

/// Two bars in space, joined by hinges whose axes are not parallel, with the friction `forces` in them; outputs are both angles and the
/// energy.
fn chain_in_space(forces: [f64; 2]) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
    let pose = Pose3::at;
    let upper = m.body3("upper", MassProperties3::principal(1.0, [0.02, 0.02, 0.002]), pose([0.25, 0.0, 0.0]));
    let lower = m.body3("lower", MassProperties3::principal(1.5, [0.03, 0.03, 0.003]), pose([0.5, 0.0, -0.25]));
    let ground = m.ground3();
    let [across, along] = [[0.0, 1.0, 0.0], [1.0, 0.3, 0.0]];
    let first = [ground.origin().with_z(across), upper.at([-0.25, 0.0, 0.0]).with_z(across)];
    let second = [upper.at([0.25, 0.0, 0.0]).with_z(along), lower.at([0.0, 0.0, 0.25]).with_z(along)];
    let angles = [("first", first, forces[0]), ("second", second, forces[1])].map(|(name, [a, b], force)| {
        m.revolute3(name, a, b);
        let angle = m.joint_angle(&format!("{name} angle"), a, b);
        if force > 0.0 {
            m.dry_friction(&format!("{name} friction"), m.ground().x, angle, [force, 1.2, 0.0]);
        }
        angle
    });
    for (k, angle) in angles.into_iter().enumerate() {
        let sensor = m.coordinate_sensor(&format!("sensor {k}"), m.ground().x, angle);
        let position = m.measure(sensor, "position").unwrap();
        m.output(format!("angle {k}"), &[position]);
    }
    let energy = [m.kinetic_energy(), m.potential_energy()];
    m.output("energy", &energy);
    m
}

/// The energy that a chain loses is the friction times the angles that it has slid.
#[test]
fn dry_friction_in_hinges_that_are_not_parallel_dissipates_its_work() {
    for forces in [[0.3, 0.15], [0.0, 0.15]] {
        let m = chain_in_space(forces);
        let times: Vec<f64> = (0..=500).map(|k| 2e-3 * f64::from(k)).collect();
        for (history, _) in by_all_schemes(&m, 2e-3, &times) {
            let [first, second, energy] = [0, 1, 2].map(|k| &history.values[k]);
            let slid = |angle: &[f64]| angle.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>();
            let heat = forces[0] * slid(first) + forces[1] * slid(second);
            let lost = energy[0] - energy.last().unwrap();
            println!("{forces:?}: {lost} {heat}");
            assert!((lost - heat).abs() < 2e-3, "{forces:?}: {lost} {heat}");
        }
    }
    for (history, _) in by_all_schemes(&chain_in_space([50.0, 50.0]), 1e-2, &[1.0, 3.0]) {
        assert!(history.values[..2].iter().flatten().all(|angle| angle.abs() < 1e-9), "{:?}", history.values);
    }
}

/// A bar of 1 kg on a hinge, with friction in it, that falls on a stop at the angle b₀ = −1.2 rad and bounces until it rests.
struct OnStop;

impl ParametricMechanism for OnStop {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let bar = m.body("bar", S::from(1.0), S::from(0.02), Pose { x: S::from(0.25), y: zero, theta: zero });
        let ground = m.ground();
        m.revolute("hinge", ground.origin(), bar.at(S::from(-0.25), zero));
        let stop = m.rigid_stop("stop", ground.x, bar.theta, b[0], b[1]);
        m.dry_friction("friction", ground.x, bar.theta, [b[2], S::from(1.2), zero]);
        outputs(&mut m, bar.theta)?;
        let force = m.measure(stop, "contact_force")?;
        m.output("force", &[force]);
        Ok(m)
    }
}

/// It rests on the stop with the torque of its weight, whatever friction is there.
#[test]
fn a_pendulum_with_dry_friction_comes_to_rest_on_a_stop() {
    let torque = 9.81 * 0.25 * 1.2f64.cos();
    for restitution in [0.0, 0.3, 0.6, 0.8] {
        for friction in [0.1, 0.3, 0.6] {
            let m = OnStop.build(&[-1.2, restitution, friction]).unwrap();
            for h in [5e-3, 7.3e-3] {
                for (history, _) in by_all_schemes(&m, h, &[4.0, 5.0]) {
                    let [angle, _, force] = [0, 1, 2].map(|k| &history.values[k]);
                    let case = format!("{restitution} {friction} {h}: {angle:?} {force:?}");
                    assert!(angle.iter().all(|angle| (angle + 1.2).abs() < 1e-7), "{case}");
                    assert!(force.iter().all(|force| (force - torque).abs() < 1e-6), "{case}");
                }
            }
        }
    }
}

/// Friction stops a block of 1 kg where a stop is, at 1 m: its velocity and the gap become zero at the same time.
#[test]
fn a_block_that_friction_stops_exactly_at_a_stop_stays_there() {
    for restitution in [0.0, 0.5, 1.0] {
        let mut m = Mechanism::new();
        let block = m.point_mass("block", 1.0, 0.0, 0.0);
        m.set_velocity(block.x, 2.0);
        let ground = m.ground();
        m.fix(block.y);
        m.rigid_stop("stop", block.x, ground.x, -1.0, restitution);
        m.dry_friction("friction", ground.x, block.x, [2.0, 1.2, 0.0]);
        outputs(&mut m, block.x).unwrap();
        for h in [4e-3, 7.3e-3] {
            for (history, scheme) in by_all_schemes(&m, h, &[0.5, 2.0, 4.0]) {
                let [x, v] = [0, 1].map(|k| &history.values[k]);
                let case = format!("{scheme}, {restitution} {h}: {x:?} {v:?}");
                assert!((x[0] - 0.75).abs() < 1e-6 && (x[1] - 1.0).abs() < 1e-6 && (x[2] - 1.0).abs() < 1e-6, "{case}");
                assert!(v[1].abs() < 1e-6 && v[2].abs() < 1e-6, "{case}");
            }
        }
    }
}

/// Friction holds a block of 1 kg that touches a stop, and is pulled away from it. It breaks away when the block is pushed against the
/// stop, which then carries what the Coulomb force of 2 N leaves of the push.
#[test]
fn friction_that_breaks_away_presses_a_block_on_the_stop_that_it_touches() {
    let push = |t: f64| 4.0 * (t - 0.5).sin();
    let mut m = Mechanism::new();
    let block = m.point_mass("block", 1.0, 0.0, 0.0);
    let ground = m.ground();
    m.fix(block.y);
    let stop = m.rigid_stop("stop", block.x, ground.x, 0.0, 0.3);
    m.dry_friction("friction", ground.x, block.x, [2.0, 1.2, 0.0]);
    m.load("push", ground.x, block.x, Harmonic, &[0.0, 4.0, 1.0, -0.5]);
    outputs(&mut m, block.x).unwrap();
    let force = m.measure(stop, "contact_force").unwrap();
    m.output("force", &[force]);
    let times = [0.5, 1.5, 2.0, 2.5];
    for (history, tolerance) in by_all_schemes(&m, 4e-3, &times) {
        let [x, force] = [0, 2].map(|k| &history.values[k]);
        assert!(x.iter().all(|x| x.abs() < 1e-9), "{x:?}");
        for (force, expected) in force.iter().zip([0.0, push(1.5) - 2.0, push(2.0) - 2.0, push(2.5) - 2.0]) {
            assert!((force - expected).abs() < tolerance.max(1e-6), "{force} {expected}");
        }
    }
}

/// A block of the mass b₀ that begins with the velocity b₁ against the friction b₂, pushed by the force b₃; friction ends at the time b₄.
struct Freed;

impl ParametricMechanism for Freed {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let block = m.point_mass("block", b[0], zero, zero);
        m.set_velocity(block.x, b[1]);
        let ground = m.ground();
        m.fix(block.y);
        let friction = m.dry_friction("friction", ground.x, block.x, [b[2], S::from(1.2), zero]);
        m.load("push", ground.x, block.x, Fixed, &[b[3]]);
        let until = m.sensor("until", ground.at(b[4], zero));
        let until = m.measure(until, "x")?;
        m.when("end of friction", Linear(vec![-1.0], 1.0), &[until], &[Action::Deactivate(friction)])?;
        outputs(&mut m, block.x)?;
        let force = m.measure(friction, "generalized_force")?;
        m.output("friction", &[force]);
        Ok(m)
    }
}

/// Position and velocity after friction has ended while the block slides.
fn freed<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let [mass, speed, friction, push, until] = std::array::from_fn(|k| b[k]);
    let since = -until + t;
    let slower = speed + (push - friction) / mass * until;
    let place = (speed + slower) * 0.5 * until;
    let faster = slower + push / mass * since;
    [place + (slower + faster) * 0.5 * since, faster]
}

#[test]
fn dry_friction_that_an_event_ends_has_no_force_from_then_on() {
    let (b, end) = ([2.0, 3.0, 4.0, 1.5, 0.7], 1.3);
    check((&Freed, end), &b, &[0, 1], |k| {
        let (value, slopes) = gradient(|b| freed(b, end)[k], &b);
        (value, slopes, hessian(|b| freed(b, end)[k], &b).2.iter().copied().collect())
    });
    check_adjoint_by(&all_settings(), ("freed block", 1e-8), &Freed, &b, &[0.3, end]);
    // From rest: friction holds the block until it ends.
    let m = Freed.build(&[2.0, 0.0, 4.0, 1.5, 0.7]).unwrap();
    for (history, _) in by_all_schemes(&m, 5e-3, &[0.6, end]) {
        let [place, _, friction] = [0, 1, 2].map(|k| &history.values[k]);
        assert!(place[0] == 0.0 && (place[1] - 0.5 * 0.75 * 0.6f64.powi(2)).abs() < 1e-9, "{place:?}");
        assert!((friction[0] - 1.5).abs() < 1e-9 && friction[1] == 0.0, "{friction:?}");
    }
}
