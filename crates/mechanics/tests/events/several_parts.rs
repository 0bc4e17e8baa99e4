//! Several contacts and friction forces whose states depend on each other: sliders, and boxes that land on two corners.

use crate::models::outputs;
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::motion::Harmonic;
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, Mechanism, ParametricMechanism, Pose, Result};

/// Values of all outputs at the last of the `times` (s), by all schemes with fixed and adaptive steps, of a motion that begins at the time
/// `start` (s).
fn by_all_schemes(m: &Mechanism<f64>, start: f64, times: &[f64]) -> Vec<(&'static str, Vec<f64>)> {
    let longest = times[1] - times[0];
    let hht = Dynamics { scheme: GeneralizedAlpha::hht(0.1).unwrap(), ..Dynamics::fixed(5e-4) };
    let adaptive = Dynamics { step: Dynamics::adaptive(1e-8).step.with_longest(longest), ..Dynamics::fixed(1.0) };
    let explicit =
        [("rk8", Explicit::eighth_order(1e-9)), ("rk5", Explicit::adaptive(1e-9))].map(|(name, settings)| {
            let settings = Explicit { start, ..settings }.with_longest_step(longest);
            (name, simulate_explicitly(m, &settings, times))
        });
    let implicit = [("generalized-alpha", Dynamics::fixed(5e-4)), ("hht", hht), ("adaptive", adaptive)];
    let implicit = implicit.map(|(name, settings)| (name, simulate(m, &Dynamics { start, ..settings }, times)));
    let last = |(name, run): (&'static str, Result<linkwright_mechanics::History>)| {
        let history = run.unwrap_or_else(|error| panic!("{name}: {error}"));
        (name, history.values.iter().map(|values| *values.last().unwrap()).collect())
    };
    explicit.into_iter().chain(implicit).map(last).collect()
}

/// `points` times of equal distance from `start` to `end` (s).
fn times(start: f64, end: f64, points: u32) -> Vec<f64> {
    (0..points).map(|k| start + (end - start) * f64::from(k) / f64::from(points - 1)).collect()
}

/// Sliders on springs with harmonic loads, dry friction and rigid stops. Sliders are numbered as in `masses`; `None` is the ground.
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
}

impl Sliders {
    /// The mechanism, whose loads have their phase at the time `start` (s); outputs are positions.
    fn mechanism(&self, start: f64) -> Mechanism<f64> {
        let mut m = Mechanism::new();
        let ground = m.ground().x;
        let mut bodies = Vec::new();
        for (k, &[mass, velocity, stiffness]) in self.masses.iter().enumerate() {
            let body = m.coordinate(format!("s{k}"), 0.0, 0.0);
            m.inertia(&format!("m{k}"), body, mass);
            m.set_velocity(body, velocity);
            m.coordinate_spring(&format!("k{k}"), ground, body, [stiffness, 0.0, 0.0, 0.0]);
            let sensor = m.coordinate_sensor(&format!("sensor {k}"), ground, body);
            let position = m.measure(sensor, "position").unwrap();
            m.output(format!("x{k}"), &[position]);
            bodies.push(body);
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
        m
    }

    /// Compares the positions at 3 s with the `exact` ones by all schemes.
    fn check(&self, exact: &[f64], accuracy: f64) {
        for (scheme, values) in by_all_schemes(&self.mechanism(0.0), 0.0, &times(0.0, 3.0, 151)) {
            let error = values.iter().zip(exact).map(|(ours, exact)| (ours - exact).abs()).fold(0.0, f64::max);
            println!("{scheme}: {error:.1e}");
            assert!(error < accuracy, "{scheme}: {values:?} {exact:?}");
        }
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
    };
    sliders.check(&[0.261706, -0.1725507], 5e-4);
    let parallel = Sliders {
        masses: vec![[1.3, 0.0, 40.3], [2.203, 0.0, 36.5]],
        loads: vec![(0, [6.23, 4.54, 1.1]), (1, [-0.82, 4.17, 1.1])],
        frictions: vec![(Some(1), 0, [1.32, 1.0]), (Some(0), 1, [2.48, 1.0])],
        stops: vec![(Some(1), 0, [-0.037, 0.0]), (Some(0), 1, [-0.039, 0.0])],
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
    };
    sliders.check(&[0.0034134, -0.0028705, -0.0108033], 5e-5);
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
