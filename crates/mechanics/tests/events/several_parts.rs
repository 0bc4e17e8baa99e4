//! Several contacts and friction forces whose states depend on each other: sliders, and boxes that land on two corners.

use crate::derivative_methods::{check_adjoint_by, check_semi_analytical_by, deviation};
use crate::finite_differences::extrapolated_differences;
use crate::models::outputs;
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::integrators::generalized_alpha::Newton;
use linkwright_mechanics::mechanism::{Pose3, Rotation};
use linkwright_mechanics::motion::{Harmonic, Motion};
use linkwright_mechanics::{Coordinate, Dynamics, GeneralizedAlpha, Mechanism, ParametricMechanism, Pose, Result};

/// Values of all outputs at the last of the `times` (s), by all schemes with fixed and adaptive steps, of a motion that begins at the time
/// `start` (s).
fn by_all_schemes(m: &Mechanism<f64>, start: f64, times: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
    let longest = times[1] - times[0];
    let explicit =
        |settings: Explicit| simulate_explicitly(m, &Explicit { start, ..settings }.with_longest_step(longest), times);
    let implicit = |settings: Dynamics| simulate(m, &Dynamics { start, ..settings }, times);
    let run = |scheme: &'static str| {
        let run = match scheme {
            "rk8" => explicit(Explicit::eighth_order(1e-9)),
            "rk5" => explicit(Explicit::adaptive(1e-9)),
            "generalized-alpha" => implicit(Dynamics::fixed(5e-4)),
            "hht" => implicit(Dynamics { scheme: GeneralizedAlpha::hht(0.1).unwrap(), ..Dynamics::fixed(5e-4) }),
            _ => {
                let step = Dynamics::adaptive(1e-8).step.with_longest(longest);
                implicit(Dynamics { step, ..Dynamics::fixed(1.0) })
            }
        };
        let history = run.unwrap_or_else(|error| panic!("{scheme}: {error}"));
        (scheme, history.values.iter().map(|values| *values.last().unwrap()).collect())
    };
    ["rk8", "rk5", "generalized-alpha", "hht", "adaptive"].into_iter().map(run).collect()
}

/// `points` times of equal distance from `start` to `end` (s).
fn times(start: f64, end: f64, points: u32) -> Vec<f64> {
    (0..points).map(|k| start + (end - start) * f64::from(k) / f64::from(points - 1)).collect()
}

/// Sliders on springs with harmonic loads, dry friction and rigid stops. Sliders are numbered as in `masses`; the belt has the next number, and
/// `None` is the ground.
#[derive(Default)]
struct Sliders {
    /// Mass in kg, initial velocity in m/s and stiffness of the spring to the ground in N/m.
    masses: Vec<[f64; 3]>,
    /// Slider, amplitude in N, frequency in rad/s and phase in rad.
    loads: Vec<(usize, [f64; 3])>,
    /// Friction between two sliders: Coulomb force in N and static ratio.
    frictions: Vec<(Option<usize>, usize, [f64; 2])>,
    /// Stops between two sliders: clearance in m and restitution.
    stops: Vec<(Option<usize>, usize, [f64; 2])>,
    /// Springs between two sliders: stiffness in N/m and damping in N·s/m.
    springs: Vec<(usize, usize, [f64; 2])>,
    /// Motion p₀ t + p₁ sin(p₂ t) of the belt.
    belt: [f64; 3],
}

/// p₀ t + p₁ sin(p₂ t).
struct BeltMotion;

impl Motion for BeltMotion {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] * t + p[1] * (p[2] * t).sin()
    }
}

impl Sliders {
    /// The mechanism, whose loads have their phase at the time `start` (s); outputs are positions.
    fn mechanism(&self, start: f64) -> Mechanism<f64> {
        let mut m = Mechanism::new();
        let mut bodies = Vec::new();
        for (k, &[mass, velocity, _]) in self.masses.iter().enumerate() {
            let body = m.coordinate(format!("s{k}"), 0.0, 0.0);
            m.inertia(&format!("m{k}"), body, mass);
            m.set_velocity(body, velocity);
            bodies.push(body);
        }
        self.add_forces(&mut m, bodies, start);
        m
    }

    /// The sliders as bodies in space, each on a plane, along an oblique direction in it.
    fn in_space(&self) -> Mechanism<f64> {
        let mut m = Mechanism::with_gravity3([0.0; 3]);
        let ground = m.ground3();
        let along = Rotation::z_along([0.4, -0.7, 0.5]);
        let normal = along.then(Rotation::about([0.0, 1.0, 0.0], std::f64::consts::FRAC_PI_2));
        let direction = along.rotate([0.0, 0.0, 1.0]);
        let mut bodies = Vec::new();
        for (k, &[mass, velocity, _]) in self.masses.iter().enumerate() {
            let place = [0.1 * k as f64, 0.2, -0.1];
            let turned = Rotation::about([0.3, 1.0, -0.2], 0.5 + k as f64);
            let properties = MassProperties3::principal(mass, [0.1, 0.12, 0.15]);
            let body = m.body3(&format!("b{k}"), properties, Pose3::new(place, turned));
            m.set_velocity3(body, direction.map(|x| x * velocity), [0.0; 3]);
            let [[a, b], [from, to]] =
                [normal, along].map(|axes| [ground, body].map(|body| m.marker_on(body, Pose3::new(place, axes))));
            m.planar_joint(&format!("plane {k}"), a, b);
            bodies.push(m.joint_displacement(&format!("s{k}"), from, to));
        }
        self.add_forces(&mut m, bodies, 0.0);
        m
    }

    /// Adds the belt, forces, contacts and outputs.
    fn add_forces(&self, m: &mut Mechanism<f64>, mut bodies: Vec<Coordinate>, start: f64) {
        let ground = m.ground().x;
        for (k, (&body, &[_, _, stiffness])) in bodies.iter().zip(&self.masses).enumerate() {
            m.coordinate_spring(&format!("k{k}"), ground, body, [stiffness, 0.0, 0.0, 0.0]);
            let sensor = m.coordinate_sensor(&format!("sensor {k}"), ground, body);
            let position = m.measure(sensor, "position").unwrap();
            m.output(format!("x{k}"), &[position]);
        }
        let belt = m.coordinate("belt", 0.0, 0.0);
        m.inertia("belt", belt, 1.0);
        m.drive(belt, BeltMotion, &self.belt);
        bodies.push(belt);
        for (k, &(a, b, [stiffness, damping])) in self.springs.iter().enumerate() {
            m.coordinate_spring(&format!("spring {k}"), bodies[a], bodies[b], [stiffness, damping, 0.0, 0.0]);
        }
        let of = |k: Option<usize>| k.map_or(ground, |k| bodies[k]);
        for &(k, [amplitude, frequency, phase]) in &self.loads {
            let parameters = [0.0, amplitude, frequency, phase - frequency * start];
            m.load(&format!("l{k}"), ground, bodies[k], Harmonic, &parameters);
        }
        for (k, &(a, b, [force, ratio])) in self.frictions.iter().enumerate() {
            m.dry_friction(&format!("f{k}"), of(a), bodies[b], [force, ratio, 0.0]);
        }
        for (k, &(a, b, [clearance, restitution])) in self.stops.iter().enumerate() {
            m.rigid_stop(&format!("r{k}"), of(a), bodies[b], clearance, restitution);
        }
    }

    /// Compares the positions at 3 s with the `exact` ones by all schemes.
    fn check(&self, exact: &[f64], accuracy: f64) {
        compare(&self.mechanism(0.0), exact, accuracy);
    }
}

/// Compares the outputs at 3 s with the `exact` ones by all schemes.
fn compare(m: &Mechanism<f64>, exact: &[f64], accuracy: f64) {
    for (scheme, values) in by_all_schemes(m, 0.0, &times(0.0, 3.0, 151)) {
        let error = values.iter().zip(exact).map(|(ours, exact)| (ours - exact).abs()).fold(0.0, f64::max);
        println!("{scheme}: {error:.1e}");
        assert!(error < accuracy, "{scheme}: {values:?} {exact:?}");
    }
}

/// Two sliders that three friction forces hold, of which none is determined alone. References of this and the next tests are by Moreau's time
/// stepping with the midpoint rule in steps of 2.5e-5 s to 1e-4 s, whose impulses are projected on their limits until they agree; their
/// accuracy is that to which two lengths of steps agree.
#[test]
fn three_friction_forces_hold_two_sliders_and_slide_together() {
    let sliders = Sliders {
        masses: vec![[1.568, 0.0, 0.0], [2.146, 0.0, 0.0]],
        loads: vec![(1, [4.81, 5.64, 0.0])],
        frictions: vec![(Some(0), 1, [1.18, 1.0]), (None, 0, [0.3, 1.0]), (None, 1, [1.19, 1.0])],
        ..Sliders::default()
    };
    sliders.check(&[0.1266657, 0.1357698], 2e-5);
}

/// The friction between the sliders is released before the other one in the direction of its force, and has to be reversed.
#[test]
fn friction_that_was_released_turns_round() {
    let sliders = Sliders {
        masses: vec![[2.663, -2.0, 0.0], [0.776, -0.92, 0.0]],
        loads: vec![(0, [6.55, 7.87, 1.1]), (1, [-2.09, 2.7, 0.0])],
        frictions: vec![(None, 1, [2.72, 1.0]), (Some(1), 0, [3.05, 1.3])],
        stops: vec![(None, 0, [-0.156, 0.0])],
        ..Sliders::default()
    };
    sliders.check(&[-0.0328801, -0.1008271], 2e-4);
}

/// Friction holds sliders where they touch a stop: rounding errors of the gap are not impacts.
#[test]
fn friction_holds_sliders_at_a_stop() {
    let sliders = Sliders {
        masses: vec![[1.837, 0.0, 10.2], [0.989, 0.0, 38.4]],
        loads: vec![(0, [-0.56, 3.66, 0.0]), (1, [-9.43, 6.85, 1.1])],
        frictions: vec![(Some(0), 1, [3.66, 1.0])],
        stops: vec![(Some(1), 0, [-0.026, 0.0]), (Some(1), 0, [-0.144, 0.3])],
        ..Sliders::default()
    };
    sliders.check(&[0.261706, -0.1725507], 5e-4);
    let parallel = Sliders {
        masses: vec![[1.3, 0.0, 40.3], [2.203, 0.0, 36.5]],
        loads: vec![(0, [6.23, 4.54, 1.1]), (1, [-0.82, 4.17, 1.1])],
        frictions: vec![(Some(1), 0, [1.32, 1.0]), (Some(0), 1, [2.48, 1.0])],
        stops: vec![(Some(1), 0, [-0.037, 0.0]), (Some(0), 1, [-0.039, 0.0])],
        ..Sliders::default()
    };
    parallel.check(&[0.4336937, 0.394645], 2e-4);
}

/// A slider bounces on a stop while friction stops and breaks away again between the impacts.
#[test]
fn friction_stops_between_rebounds_that_die_out() {
    let sliders = Sliders {
        masses: vec![[1.085, 0.0, 6.6], [2.06, 0.0, 59.6], [2.031, 0.0, 50.5]],
        loads: vec![(0, [0.63, 2.5, 1.1]), (1, [-7.47, 5.79, 0.0]), (2, [6.69, 1.59, 1.1])],
        frictions: vec![(None, 1, [4.01, 1.0]), (None, 1, [2.54, 1.3]), (Some(0), 2, [3.42, 1.0])],
        stops: vec![(Some(2), 1, [-0.041, 0.7]), (Some(0), 2, [-0.144, 0.7])],
        ..Sliders::default()
    };
    sliders.check(&[0.0034134, -0.0028705, -0.0108033], 5e-5);
}

/// A slider between the ground and a belt: where the belt turns back, it is at rest on both, and stays on one of them.
fn between_ground_and_belt() -> Sliders {
    Sliders {
        masses: vec![[0.615, 0.0, 54.292]],
        loads: vec![(0, [-3.78, 3.286, 1.1])],
        frictions: vec![(None, 0, [1.769, 1.0]), (Some(1), 0, [2.23, 1.0])],
        springs: vec![(1, 0, [21.09, 0.0])],
        belt: [0.5, 0.2, 3.305],
        ..Sliders::default()
    }
}

/// Two parts of friction hold a slider on a belt whose speed varies, and one brakes it on the ground.
fn on_a_belt() -> Sliders {
    Sliders {
        masses: vec![[1.228, -0.331, 40.456]],
        loads: vec![(0, [0.344, 5.356, 1.1])],
        frictions: vec![(None, 0, [0.701, 1.0]), (Some(1), 0, [1.47, 1.0]), (Some(1), 0, [1.682, 1.0])],
        belt: [-0.3, 0.05, 2.264],
        ..Sliders::default()
    }
}

#[test]
fn friction_at_rest_on_a_belt_whose_speed_varies_stays_at_rest() {
    on_a_belt().check(&[-0.0796829], 2e-5);
    let load = [-1.263, 3.155, std::f64::consts::FRAC_PI_2];
    let sliders = Sliders {
        masses: vec![[0.816, 0.0, 20.01]],
        loads: vec![(0, load)],
        frictions: vec![(Some(1), 0, [1.016, 1.0]), (Some(1), 0, [3.96, 1.0])],
        stops: vec![(None, 0, [-0.11, 0.0])],
        belt: [0.5, 0.05, 5.739],
        ..Sliders::default()
    };
    sliders.check(&[0.3207272], 2e-5);
}

#[test]
fn a_slider_between_the_ground_and_a_belt_that_turns_back_stays_on_one_of_them() {
    between_ground_and_belt().check(&[0.4075722], 2e-5);
    let two = Sliders {
        masses: vec![[0.9, 0.0, 20.0], [1.3, 0.0, 0.0]],
        loads: vec![(0, [4.0, 5.0, 0.0])],
        frictions: vec![
            (Some(2), 0, [1.5, 1.0]),
            (Some(0), 1, [1.0, 1.0]),
            (None, 1, [0.8, 1.0]),
            (Some(2), 1, [0.7, 1.0]),
        ],
        belt: [0.3, 0.15, 4.0],
        ..Sliders::default()
    };
    two.check(&[0.21915, 0.1489], 2e-4);
}

#[test]
fn bodies_on_planes_in_space_stick_and_slide_as_sliders() {
    compare(&on_a_belt().in_space(), &[-0.0796829], 2e-5);
    compare(&between_ground_and_belt().in_space(), &[0.4075722], 2e-5);
}

/// Sliders that begin at rest under constant loads: friction between the first two slides, that to the ground holds the second one.
#[test]
fn accelerations_from_rest_are_those_of_the_only_consistent_state() {
    let constant = |force: f64| [force, 0.0, std::f64::consts::FRAC_PI_2];
    let (masses, loads) = ([1.08, 1.69, 0.89], [-0.83, -1.14, 8.54]);
    let sliders = Sliders {
        masses: masses.iter().map(|mass| [*mass, 0.0, 0.0]).collect(),
        loads: loads.iter().enumerate().map(|(k, load)| (k, constant(*load))).collect(),
        frictions: vec![
            (None, 1, [0.62, 1.0]),
            (Some(0), 2, [1.73, 1.0]),
            (Some(0), 2, [3.82, 1.0]),
            (Some(1), 0, [0.85, 1.0]),
        ],
        ..Sliders::default()
    };
    let acceleration = (loads[0] + loads[2] - 0.85) / (masses[0] + masses[2]);
    for (scheme, values) in by_all_schemes(&sliders.mechanism(0.0), 0.0, &times(0.0, 0.1, 3)) {
        let moved = 0.5 * acceleration * 0.1f64.powi(2);
        let exact = [moved, 0.0, moved];
        assert!(values.iter().zip(exact).all(|(ours, exact)| (ours - exact).abs() < 1e-9), "{scheme}: {values:?}");
    }
}

/// The motion does not depend on the time at which it begins, up to the rounding of the times.
#[test]
fn friction_sticks_late_in_time() {
    let sliders = |velocity: f64| Sliders {
        masses: vec![[1.0, velocity, 40.0]],
        loads: vec![(0, [8.0, 3.0, 0.0])],
        frictions: vec![(None, 0, [3.0, 1.2])],
        stops: vec![(None, 0, [-0.02, 0.5])],
        ..Sliders::default()
    };
    for velocity in [1.0, 0.3] {
        let at =
            |start: f64| by_all_schemes(&sliders(velocity).mechanism(start), start, &times(start, start + 2.0, 11));
        let early = at(0.0);
        for (start, accuracy) in [(1e3, 1e-8), (1e5, 1e-6)] {
            for ((scheme, early), (_, late)) in early.iter().zip(at(start)) {
                let error = (early[0] - late[0]).abs();
                assert!(error < accuracy, "{scheme} from {start} s: {error:.1e}");
            }
        }
    }
}

/// A box of 2.043 kg that falls on a slope with the angle −0.2 rad, with the restitution b₁ of its corners; it begins at the angle b₀.
struct RockingBox;

impl ParametricMechanism for RockingBox {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let of = S::from;
        let mut m = Mechanism::with_gravity(of(0.0), of(-9.81));
        let body = m.body("box", of(2.043), of(0.0253), Pose { x: of(0.0), y: of(0.798), theta: b[0] });
        m.set_velocity(body.x, of(-0.16));
        m.set_velocity(body.y, of(-0.77));
        m.set_velocity(body.theta, of(-2.451));
        let ground = m.ground();
        for (k, [x, y]) in [[0.448, 0.15], [-0.448, 0.15], [0.448, -0.15], [-0.448, -0.15]].into_iter().enumerate() {
            m.rigid_wall(&format!("w{k}"), ground.origin(), of(-0.2), body.at(of(x), of(y)), b[1]);
        }
        for coordinate in [body.x, body.y, body.theta] {
            outputs(&mut m, coordinate)?;
        }
        Ok(m)
    }
}

/// The reference computes one impact after the other in closed form: both corners are at rest at 0.30539157 s, and the box slides down.
#[test]
fn a_box_that_rocks_from_corner_to_corner_comes_to_rest_on_both() {
    let m = RockingBox.build(&[-0.205, 0.2]).unwrap();
    for (scheme, values) in by_all_schemes(&m, 0.0, &times(0.0, 1.0, 51)) {
        let [x, y, theta] = [values[0], values[2], values[4]];
        println!("{scheme}: {x} {y} {theta}");
        assert!((x - 0.825712).abs() < 1e-6 && (y + 0.014329).abs() < 1e-6 && (theta + 0.2).abs() < 1e-8, "{scheme}");
    }
    for restitution in [0.1, 0.15, 0.3] {
        let m = RockingBox.build(&[-0.205, restitution]).unwrap();
        for (scheme, values) in by_all_schemes(&m, 0.0, &times(0.0, 1.0, 51)) {
            assert!((values[4] + 0.2).abs() < 1e-8 && values[5].abs() < 1e-8, "{scheme} {restitution}: {values:?}");
        }
    }
}

/// Derivatives pass the infinitely many impacts, which end as one impact with both corners closed.
#[test]
fn derivatives_pass_the_impacts_of_a_box_on_two_corners() {
    let (b, settings, ends) = ([-0.205, 0.2], Dynamics::fixed(1e-3), times(0.0, 1.0, 51));
    let direct = differentiate(&RockingBox, &b, &settings, &ends).unwrap();
    let at = |b: &[f64]| simulate(&RockingBox.build(b).unwrap(), &settings, &ends).unwrap().values[0][50];
    for k in 0..2 {
        let step = 1e-5;
        let shifted = |by: f64| std::array::from_fn::<f64, 2, _>(|j| b[j] + if j == k { by } else { 0.0 });
        let differences = (at(&shifted(step)) - at(&shifted(-step))) / (2.0 * step);
        let slope = direct.gradients[0][50][k];
        println!("{slope} {differences}");
        assert!((slope - differences).abs() < 1e-5 * slope.abs().max(1.0), "{k}: {slope} {differences}");
    }
}

/// The slider between the ground and a belt that turns back, with the stiffness b₀, the friction b₁ on the ground and b₂ on the belt, and the
/// amplitude b₃ of the belt's motion.
struct BetweenGroundAndBelt;

impl ParametricMechanism for BetweenGroundAndBelt {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (of, zero) = (S::from, S::from(0.0));
        let mut m = Mechanism::new();
        let ground = m.ground();
        let slider = m.coordinate("slider", zero, zero);
        m.inertia("mass", slider, of(0.615));
        let belt = m.coordinate("belt", zero, zero);
        m.inertia("belt", belt, of(1.0));
        m.drive(belt, BeltMotion, &[of(0.5), b[3], of(3.305)]);
        m.coordinate_spring("spring", ground.x, slider, [b[0], zero, zero, zero]);
        m.coordinate_spring("other spring", belt, slider, [of(21.09), zero, zero, zero]);
        m.load("load", ground.x, slider, Harmonic, &[zero, of(-3.78), of(3.286), of(1.1)]);
        m.dry_friction("ground friction", ground.x, slider, [b[1], of(1.0), zero]);
        m.dry_friction("belt friction", belt, slider, [b[2], of(1.0), zero]);
        outputs(&mut m, slider)?;
        Ok(m)
    }
}

/// Direct derivatives are differences of the motion by tight explicit steps; adjoint and semi-analytical ones are the direct ones.
#[test]
fn derivatives_between_the_ground_and_a_belt_are_differences() {
    let (b, ends) = ([54.292, 1.769, 2.23, 0.2], [1.0, 2.0, 3.0]);
    let settings = Explicit::eighth_order(1e-11).with_longest_step(0.05);
    let direct = differentiate_explicitly(&BetweenGroundAndBelt, &b, &settings, &ends).unwrap();
    let implicit = differentiate(&BetweenGroundAndBelt, &b, &Dynamics::fixed(5e-4), &ends).unwrap();
    let adaptive = differentiate(&BetweenGroundAndBelt, &b, &Dynamics::adaptive(1e-8), &ends).unwrap();
    let at = |b: &[f64]| simulate_explicitly(&BetweenGroundAndBelt.build(b).unwrap(), &settings, &ends).unwrap().values;
    for k in 0..b.len() {
        let exact = extrapolated_differences(&b, k, 2e-4 * b[k], at).swap_remove(0);
        let largest = exact.iter().fold(0.0f64, |largest, slope| largest.max(slope.abs()));
        for (point, exact) in exact.into_iter().enumerate() {
            let slope = direct.gradients[0][point][k];
            println!("{k} at {} s: {slope:.9} {exact:.9}", ends[point]);
            assert!((slope - exact).abs() < 1e-6 * largest, "{k}: {slope} {exact}");
            for other in [&implicit, &adaptive].map(|steps| steps.gradients[0][point][k]) {
                assert!((other - exact).abs() < 3e-3 * largest, "{k}: {other} {exact}");
            }
        }
    }
    let newton = Newton { tolerance: 1e-12, iterations: 30 };
    let steps = [Dynamics::fixed(2e-3), Dynamics::adaptive(1e-6)].map(|steps| Dynamics { newton, ..steps });
    check_adjoint_by(&steps, ("belt", 1e-9), &BetweenGroundAndBelt, &b, &ends);
    check_semi_analytical_by(&steps, ("belt", 1e-5), &BetweenGroundAndBelt, &b, &ends);
}

/// A body at a stop and one on which friction rests begin to move together: the contact opens and friction breaks away at the same time. The step
/// between these two events is so short that its velocities would be rounding errors of the positions. b: amplitudes of the two loads, friction on
/// the ground, initial velocity and mass of the second body.
struct LettingGoTogether;

const LETTING_GO: [f64; 5] = [-5.639, -3.914, 2.022, -0.956, 0.901];

impl ParametricMechanism for LettingGoTogether {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (of, zero) = (S::from, S::from(0.0));
        let mut m = Mechanism::new();
        let ground = m.ground();
        let [one, two] = ["one", "two"].map(|name| m.coordinate(name, zero, zero));
        m.inertia("mass of one", one, of(1.529));
        m.inertia("mass of two", two, b[4]);
        m.set_velocity(two, b[3]);
        let belt = m.coordinate("belt", zero, zero);
        m.drive(belt, BeltMotion, &[of(0.5), of(0.05), of(1.72)]);
        let phase = of(std::f64::consts::FRAC_PI_2);
        m.load("load of one", ground.x, one, Harmonic, &[zero, b[0], of(3.034), phase]);
        m.load("load of two", ground.x, two, Harmonic, &[zero, b[1], of(5.026), phase]);
        m.dry_friction("on the ground", ground.x, two, [b[2], of(1.0), of(0.2)]);
        m.dry_friction("on the belt", belt, two, [of(0.211), of(1.0), zero]);
        m.dry_friction("between", two, one, [of(1.367), of(1.5), of(0.2)]);
        m.rigid_stop("stop", ground.x, one, of(-0.054), zero);
        for coordinate in [one, two] {
            outputs(&mut m, coordinate)?;
        }
        Ok(m)
    }
}

#[test]
fn a_contact_and_friction_let_go_at_the_same_time() {
    let m = LettingGoTogether.build(&LETTING_GO).unwrap();
    // The error of fixed steps of 5 ms is 2e-5 m; the rounding errors displaced the body by 0.07 m.
    let times = [0.0, 0.6];
    let exact = simulate_explicitly(&m, &Explicit::eighth_order(1e-9), &times).unwrap();
    let found = simulate(&m, &Dynamics::fixed(5e-3), &times).unwrap();
    for (found, exact) in found.values.iter().zip(&exact.values) {
        assert!((found[1] - exact[1]).abs() < 1e-4, "{found:?} {exact:?}");
    }
}

#[test]
fn derivatives_pass_a_contact_and_friction_that_let_go_at_the_same_time() {
    let (b, times) = (LETTING_GO, [0.0, 0.3, 0.6]);
    let exact = differentiate_explicitly(&LettingGoTogether, &b, &Explicit::eighth_order(1e-11), &times).unwrap();
    for settings in [Dynamics::fixed(1e-3), Dynamics::adaptive(1e-7)] {
        let direct = differentiate(&LettingGoTogether, &b, &settings, &times).unwrap();
        let worst = deviation(&exact.gradients, &b, |output, point| direct.gradients[output][point].clone());
        println!("{:?}: {worst:.1e}", settings.step);
        assert!(worst < 1e-3, "{settings:?}: {worst:.1e}");
    }
    let newton = Newton { tolerance: 1e-12, iterations: 30 };
    let steps = [Dynamics::fixed(5e-3), Dynamics::adaptive(1e-6)].map(|steps| Dynamics { newton, ..steps });
    check_adjoint_by(&steps, ("letting go", 1e-9), &LettingGoTogether, &b, &times);
    check_semi_analytical_by(&steps, ("letting go", 1e-5), &LettingGoTogether, &b, &times);
}
