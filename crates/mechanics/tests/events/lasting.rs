//! Contacts that last and dry friction that sticks: exact solutions, all schemes and methods, and clear messages.

use crate::derivative_methods::{all_settings, check_adjoint_by, check_semi_analytical_by};
use crate::explicit::check;
use crate::models::{Linear, outputs};
use autodiff::{Scalar, gradient, hessian};
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly, simulate_with_steps};
use linkwright_mechanics::analyses::indeterminate_outputs::warn_of_indeterminate_outputs;
use linkwright_mechanics::derivatives::adjoint::{
    AdjointFunctional, differentiate_backwards_within, differentiate_explicitly_backwards,
};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::modal::{About, differentiate_modes};
use linkwright_mechanics::derivatives::mode_shapes::mode_shapes;
use linkwright_mechanics::derivatives::second_order::{HessianPart, differentiate_explicitly_twice};
use linkwright_mechanics::derivatives::semi_analytical::{STEP, differentiate_semi_analytically};
use linkwright_mechanics::events::Action;
use linkwright_mechanics::integrators::explicit::{Coordinates, Explicit, StepControl};
use linkwright_mechanics::integrators::settings::InitialConfiguration;
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Harmonic};
use linkwright_mechanics::{Assembly, Dynamics, Mechanism, ParametricMechanism, Pose, Result, Statics};

/// A mass b₃ on a spring of the stiffness b₀ and on a belt of the speed b₄, with the sliding friction b₁ and the static limit b₂ b₁.
struct StickSlip;

const STICK_SLIP: [f64; 5] = [40.0, 3.0, 1.6, 1.3, 0.25];

impl ParametricMechanism for StickSlip {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", b[3], zero, zero);
        m.set_velocity(mass.x, b[4]);
        let belt = m.coordinate("belt", zero, b[4]);
        m.drive(belt, ConstantSpeed, &[zero, b[4]]);
        let ground = m.ground();
        m.coordinate_spring("spring", ground.x, mass.x, [b[0], zero, zero, zero]);
        let friction = m.dry_friction("friction", belt, mass.x, [b[1], b[2], zero]);
        outputs(&mut m, mass.x)?;
        let force = m.measure(friction, "generalized_force")?;
        m.output("friction", &[force]);
        Ok(m)
    }
}

/// Position and velocity in the second phase of sliding.
fn stick_slip<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let [k, friction, ratio, mass, speed] = [b[0], b[1], b[2], b[3], b[4]];
    let (rate, place) = ((k / mass).sqrt(), friction / k);
    let excess = place * (ratio - 1.0);
    let sliding = |since: S| {
        let (sin, cos) = (rate * since).sin_cos();
        [place + excess * cos + speed / rate * sin, speed * cos - excess * rate * sin]
    };
    let first = place * ratio / speed;
    let angle = -(excess * rate / speed).atan2(S::from(1.0)) * 2.0 + std::f64::consts::TAU;
    let stuck = first + angle / rate;
    let again = stuck + (place * ratio - sliding(angle / rate)[0]) / speed;
    sliding(-again + t)
}

/// A ball of 2 kg at rest on a platform that moves by b₀ sin(b₁ t), under the gravity b₂. It lifts off where the platform
/// accelerates downwards by b₂.
struct Platform;

const PLATFORM: [f64; 3] = [0.2, 9.0, 9.81];

impl ParametricMechanism for Platform {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[2]);
        let ball = m.point_mass("ball", S::from(2.0), zero, zero);
        m.set_velocity(ball.y, b[0] * b[1]);
        let platform = m.coordinate("platform", zero, b[0] * b[1]);
        m.drive(platform, Harmonic, &[zero, b[0], b[1], zero]);
        let stop = m.rigid_stop("stop", platform, ball.y, zero, S::from(0.5));
        outputs(&mut m, ball.y)?;
        let force = m.measure(stop, "contact_force")?;
        m.output("force", &[force]);
        Ok(m)
    }
}

/// Position and velocity after the ball has lifted off, before it falls back.
fn lifted<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let sin = b[2] / (b[0] * b[1] * b[1]);
    let cos = (-(sin * sin) + 1.0).sqrt();
    let since = -(sin.atan2(cos) / b[1]) + t;
    let speed = b[0] * b[1] * cos;
    [b[0] * sin + speed * since - b[2] * since * since * 0.5, speed - b[2] * since]
}

/// A ball of 1 kg that falls from b₀, bounces with the restitution b₁ under the gravity b₂ until it rests, and is lifted by the force
/// b₃ t.
struct Landing;

const LANDING: [f64; 4] = [0.3, 0.4, 9.81, 4.0];

impl ParametricMechanism for Landing {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[2]);
        let ball = m.point_mass("ball", S::from(1.0), zero, b[0]);
        let ground = m.ground();
        let floor = m.rigid_wall("floor", ground.origin(), zero, ball.origin(), b[1]);
        m.load("lift", ground.y, ball.y, ConstantSpeed, &[zero, b[3]]);
        outputs(&mut m, ball.y)?;
        let force = m.measure(floor, "contact_force")?;
        m.output("force", &[force]);
        Ok(m)
    }
}

/// Position and velocity after the force has lifted the ball: they depend neither on the height nor on the restitution.
fn landed<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let since = -(b[2] / b[3]) + t;
    [b[3] * since * since * since / 6.0, b[3] * since * since * 0.5]
}

#[test]
fn stick_slip_on_a_belt_is_exact_along_explicit_steps() {
    let end = 1.75;
    check((&StickSlip, end), &STICK_SLIP, &[0, 1], |k| {
        let (value, slopes) = gradient(|b| stick_slip(b, end)[k], &STICK_SLIP);
        (value, slopes, hessian(|b| stick_slip(b, end)[k], &STICK_SLIP).2.iter().copied().collect())
    });
}

#[test]
fn a_ball_lifts_off_a_platform_exactly_along_explicit_steps() {
    let end = 0.35;
    check((&Platform, end), &PLATFORM, &[0, 1], |k| {
        let (value, slopes) = gradient(|b| lifted(b, end)[k], &PLATFORM);
        (value, slopes, hessian(|b| lifted(b, end)[k], &PLATFORM).2.iter().copied().collect())
    });
}

#[test]
fn a_ball_whose_rebounds_die_out_rests_until_it_is_lifted() {
    let end = 3.2;
    let settings = [Explicit::adaptive(1e-11), Explicit::eighth_order(1e-11)];
    let mechanism = Landing.build(&LANDING).unwrap();
    for settings in settings {
        let history = simulate_explicitly(&mechanism, &settings, &[2.0, end]).unwrap();
        let force = history.series("force").unwrap();
        assert!((force[0] - (9.81 - 8.0)).abs() < 1e-9 && force[1] == 0.0, "{force:?}");
        assert!((history.values[0][0]).abs() < 1e-12);
        assert!((history.values[0][1] - landed(&LANDING, end)[0]).abs() < 1e-9, "{:?}", history.values);
    }
    for h in [0.005, 0.0073] {
        let settings = Dynamics::fixed(h);
        let history = differentiate(&Landing, &LANDING, &settings, &[2.0, end]).unwrap();
        let (value, slopes) = gradient(|b| landed(b, end)[0], &LANDING);
        assert!((history.values[0][1] - value).abs() < 1e-4, "{:?} {value}", history.values);
        let ours = &history.gradients[0][1];
        assert!(ours.iter().zip(&slopes).all(|(a, b)| (a - b).abs() < 1e-3), "{ours:?} {slopes:?}");
        assert!(history.gradients[0][0].iter().all(|x| x.abs() < 1e-9), "{:?}", history.gradients[0][0]);
    }
}

/// Errors of values and first derivatives along implicit steps fall with the square of the step.
#[test]
fn implicit_steps_through_sticking_and_lifting_converge() {
    fn errors<M: ParametricMechanism>(
        model: &M,
        b: &[f64],
        end: f64,
        exact: &dyn Fn(usize) -> (f64, Vec<f64>),
    ) -> Vec<f64> {
        let steps = [0.008, 0.004, 0.002];
        let error = |h: f64| {
            let found = differentiate(model, b, &Dynamics::fixed(h), &[end]).unwrap();
            (0..2).fold(0.0f64, |worst, k| {
                let (value, slopes) = exact(k);
                let slopes = slopes.iter().zip(&found.gradients[k][0]).zip(b).map(|((a, o), b)| ((a - o) * b).abs());
                slopes.fold(worst.max((found.values[k][0] - value).abs()), f64::max)
            })
        };
        steps.map(error).to_vec()
    }
    let on_belt = errors(&StickSlip, &STICK_SLIP, 1.75, &|k| gradient(|b| stick_slip(b, 1.75)[k], &STICK_SLIP));
    let on_platform = errors(&Platform, &PLATFORM, 0.35, &|k| gradient(|b| lifted(b, 0.35)[k], &PLATFORM));
    println!("belt {on_belt:?}, platform {on_platform:?}");
    assert!(on_belt[2] < 0.4 * on_belt[1] && on_belt[1] < 0.4 * on_belt[0], "{on_belt:?}");
    assert!(
        on_platform.iter().all(|error| *error < 1e-12),
        "uniform acceleration after it has lifted off: {on_platform:?}"
    );
}

/// Without the settings of the paper, whose prescribed accelerations oscillate: so do contact forces.
#[test]
fn all_methods_agree_through_sticking_and_lifting() {
    let all = all_settings();
    let smooth = [all[0], all[1], all[3]];
    check_adjoint_by(&all, ("stick-slip", 1e-7), &StickSlip, &STICK_SLIP, &[0.2, 0.6, 1.0, 1.75]);
    check_adjoint_by(&smooth, ("platform", 1e-8), &Platform, &PLATFORM, &[0.05, 0.2, 0.35]);
    check_semi_analytical_by(&smooth, ("stick-slip", 1e-3), &StickSlip, &STICK_SLIP, &[0.2, 0.6, 1.0, 1.75]);
    check_semi_analytical_by(&smooth, ("platform", 1e-3), &Platform, &PLATFORM, &[0.05, 0.2, 0.35]);
}

/// A bar with the mass b₀, the moment of inertia b₁ and the length 2 b₂ rests on its left end, at an angle of b₃, and falls onto its
/// right one under the gravity b₅. Both ends have the restitution b₄.
struct RockingBar;

const BAR: [f64; 6] = [1.2, 0.9, 0.5, 0.2, 0.5, 9.81];

impl ParametricMechanism for RockingBar {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[5]);
        let bar = m.body("bar", b[0], b[1], Pose { x: zero, y: b[2] * b[3].sin(), theta: b[3] });
        let ground = m.ground();
        m.rigid_wall("left", ground.origin(), zero, bar.at(-b[2], zero), b[4]);
        m.rigid_wall("right", ground.origin(), zero, bar.at(b[2], zero), b[4]);
        for (name, from, to) in [("height", ground.y, bar.y), ("angle", ground.theta, bar.theta)] {
            let sensor = m.coordinate_sensor(name, from, to);
            for what in ["position", "velocity"] {
                let term = m.measure(sensor, what)?;
                m.output(format!("{name} {what}"), &[term]);
            }
        }
        Ok(m)
    }
}

/// Rates of height and angle after the impact of the right end. Energy gives the angular velocity ω before it, and the left end
/// lifts off: the impulse is P = (1 + e) 2 r ω / (1/m + r²/J).
fn after_impact<S: Scalar>(b: &[S]) -> [S; 2] {
    let [mass, inertia, half, tilt, restitution, gravity] = std::array::from_fn(|k| b[k]);
    let rate = (mass * gravity * half * tilt.sin() * 2.0 / (inertia + mass * half * half)).sqrt();
    let impulse = (restitution + 1.0) * half * rate * 2.0 / (S::from(1.0) / mass + half * half / inertia);
    [impulse / mass - half * rate, impulse * half / inertia - rate]
}

/// Time in s between the impact of the right end and the next one.
const IN_FLIGHT: f64 = 0.4;

#[test]
fn a_closed_contact_does_not_pull_during_an_impact() {
    let m = RockingBar.build(&BAR).unwrap();
    let [climb, turn] = after_impact(&BAR);
    for (history, accuracy) in [
        (simulate_explicitly(&m, &Explicit::eighth_order(1e-11), &[IN_FLIGHT]).unwrap(), 1e-8),
        (simulate(&m, &Dynamics::fixed(1e-4), &[IN_FLIGHT]).unwrap(), 1e-6),
    ] {
        assert!(history.impacts.len() == 1 && history.impacts[0].contact == "right", "{:?}", history.impacts);
        let t = IN_FLIGHT - history.impacts[0].t;
        let exact = [climb * t - 0.5 * BAR[5] * t * t, climb - BAR[5] * t, turn * t, turn];
        let error = history.values.iter().zip(exact).map(|(ours, exact)| (ours[0] - exact).abs()).fold(0.0, f64::max);
        assert!(error < accuracy, "{error:.1e} {:?} {exact:?}", history.values);
    }
}

/// The impacts of the two ends alternate at ever shorter intervals, for slender and thick bars with little and much restitution.
#[test]
fn rocking_bars_come_to_rest() {
    let all = [0.02, 0.1, 0.3, 0.9, 2.0].into_iter().flat_map(|inertia| {
        [0.0, 0.1, 0.5, 0.7]
            .into_iter()
            .flat_map(move |restitution| [0.05, 0.2, 0.31].map(|tilt| [1.2, inertia, 0.5, tilt, restitution, 9.81]))
    });
    for b in all {
        let m = RockingBar.build(&b).unwrap();
        for history in [
            simulate_explicitly(&m, &Explicit::eighth_order(1e-10), &[8.0]),
            simulate_explicitly(&m, &Explicit::adaptive(1e-8), &[8.0]),
            simulate(&m, &Dynamics::fixed(2e-3), &[8.0]),
        ] {
            let values = history.unwrap_or_else(|error| panic!("{b:?}: {error}")).values;
            assert!(values.iter().all(|x| x[0].abs() < 1e-8), "{b:?}: {values:?}");
        }
    }
}

#[test]
fn derivatives_through_an_impact_that_opens_a_contact_are_exact() {
    check((&RockingBar, IN_FLIGHT), &BAR, &[3], |_| {
        let (value, slopes) = gradient(|b| after_impact(b)[1], &BAR);
        (value, slopes, hessian(|b| after_impact(b)[1], &BAR).2.iter().copied().collect())
    });
    let all = all_settings();
    let smooth = [all[0], all[1], all[3]];
    check_adjoint_by(&smooth, ("rocking bar", 1e-8), &RockingBar, &BAR, &[0.2, IN_FLIGHT]);
    check_semi_analytical_by(&smooth, ("rocking bar", 1e-3), &RockingBar, &BAR, &[0.2, IN_FLIGHT]);
}

#[test]
fn a_contact_that_opens_from_the_start_closes_again_within_the_first_step() {
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let ball = m.point_mass("ball", 1.0, 0.0, 0.0);
    m.set_velocity(ball.y, 0.1);
    let ground = m.ground();
    m.rigid_wall("floor", ground.origin(), 0.0, ball.origin(), 0.5);
    outputs(&mut m, ball.y).unwrap();
    let landing = 2.0 * 0.1 / 9.81;
    for history in [
        simulate(&m, &Dynamics::fixed(0.05), &[0.1]).unwrap(),
        simulate_explicitly(&m, &Explicit::adaptive(1e-9), &[0.1]).unwrap(),
    ] {
        assert!((history.impacts[0].t - landing).abs() < 1e-9, "{:?}", history.impacts);
        assert!(history.values[0][0].abs() < 1e-9 && history.values[1][0].abs() < 1e-9, "{:?}", history.values);
    }
}

#[test]
fn friction_that_may_stick_is_refused_where_its_force_is_not_determined() {
    struct Block;
    impl ParametricMechanism for Block {
        fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
            let zero = S::from(0.0);
            let mut m = Mechanism::new();
            let block = m.point_mass("block", S::from(1.0), zero, zero);
            let ground = m.ground();
            m.coordinate_spring("spring", ground.x, block.x, [b[0], zero, zero, zero]);
            m.coordinate_spring("other", ground.y, block.y, [b[0], zero, zero, zero]);
            m.dry_friction("friction", ground.x, block.x, [S::from(6.0), S::from(1.0), zero]);
            outputs(&mut m, block.x)?;
            Ok(m)
        }
    }
    let initial_configuration = InitialConfiguration::Equilibrium(Statics::default());
    let settings = Dynamics { initial_configuration, ..Dynamics::fixed(0.01) };
    let errors = [
        simulate(&Block.build(&[100.0]).unwrap(), &settings, &[0.1]).unwrap_err(),
        differentiate_modes(&Block, &[100.0], About::Assembled, 0.0).unwrap_err(),
        mode_shapes(&Block, &[100.0], About::Assembled, 0.0, &[0]).unwrap_err(),
    ];
    for error in errors {
        assert!(error.to_string().contains("friction: it may stick"), "{error}");
    }
}

/// A block slides, stops and holds against a load below the static limit.
#[test]
fn a_block_stops_and_stays() {
    let mut m = Mechanism::new();
    let block = m.point_mass("block", 2.0, 0.0, 0.0);
    m.set_velocity(block.x, 3.0);
    let ground = m.ground();
    m.fix(block.y);
    let friction = m.dry_friction("friction", ground.x, block.x, [6.0, 1.0, 0.0]);
    m.load("push", ground.x, block.x, Fixed, &[1.0]);
    outputs(&mut m, block.x).unwrap();
    let force = m.measure(friction, "generalized_force").unwrap();
    m.output("friction", &[force]);
    // It decelerates by (6 − 1)/2 = 2.5 m/s² and stops after 1.2 s and 1.8 m.
    for history in [
        simulate(&m, &Dynamics::fixed(0.01), &[1.0, 1.5, 9.0]).unwrap(),
        simulate(&m, &Dynamics::adaptive(1e-6), &[1.0, 1.5, 9.0]).unwrap(),
        simulate_explicitly(&m, &Explicit::adaptive(1e-9), &[1.0, 1.5, 9.0]).unwrap(),
    ] {
        let [x, v, f] = [0, 1, 2].map(|k| history.values[k].clone());
        assert!((x[1] - 1.8).abs() < 1e-9 && (x[2] - 1.8).abs() < 1e-9, "{x:?}");
        assert!((v[0] - 0.5).abs() < 1e-9 && v[1].abs() < 1e-12 && v[2].abs() < 1e-12, "{v:?}");
        assert!((f[0] - 6.0).abs() < 1e-9 && (f[1] - 1.0).abs() < 1e-9, "{f:?}");
        assert_eq!(history.impacts.len(), 1);
    }
}

/// A bar that a hinge releases: its constraints are linear in coordinates, but not at all times.
struct Dropped;

const DROPPED: [f64; 5] = [1.1, 0.4, 9.81, 0.3, 0.07];

impl ParametricMechanism for Dropped {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[2]);
        let bar = m.body("bar", b[0], b[4], Pose { x: b[1], y: zero, theta: zero });
        let ground = m.ground();
        let hinge = m.revolute("hinge", ground.origin(), bar.at(-b[1], zero));
        let angle = m.coordinate_sensor("angle", ground.theta, bar.theta);
        let turned = m.measure(angle, "position")?;
        let limit = m.sensor("limit", ground.at(b[3], zero));
        let limit = m.measure(limit, "x")?;
        m.when("release", Linear(vec![-1.0, -1.0], 0.0), &[turned, limit], &[Action::Deactivate(hinge)])?;
        outputs(&mut m, bar.x)?;
        Ok(m)
    }
}

#[test]
fn adjoint_derivatives_include_constraints_that_are_linear_until_they_let_go() {
    check_adjoint_by(&all_settings(), ("dropped bar", 1e-8), &Dropped, &DROPPED, &[0.1, 0.25, 0.5]);
}

/// A bar on a hinge and, if it is redundant, on two more at the same place, of which one lets go when the bar has turned by b₃.
struct OnHinges {
    is_redundant: bool,
}

impl ParametricMechanism for OnHinges {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[2]);
        let bar = m.body("bar", b[0], b[4], Pose { x: b[1], y: zero, theta: zero });
        let ground = m.ground();
        m.revolute("hinge", ground.origin(), bar.at(-b[1], zero));
        if self.is_redundant {
            m.revolute("second hinge", ground.origin(), bar.at(-b[1], zero));
            let third = m.revolute("third hinge", ground.origin(), bar.at(-b[1], zero));
            let angle = m.coordinate_sensor("angle", ground.theta, bar.theta);
            let turned = m.measure(angle, "position")?;
            let limit = m.sensor("limit", ground.at(b[3], zero));
            let limit = m.measure(limit, "x")?;
            m.when("release", Linear(vec![-1.0, -1.0], 0.0), &[turned, limit], &[Action::Deactivate(third)])?;
        }
        outputs(&mut m, bar.x)?;
        Ok(m)
    }
}

#[test]
fn a_redundant_joint_that_lets_go_has_no_effect() {
    let at = [0.1, 0.2, 0.3, 0.6, 1.0];
    for (tolerance, settings) in [(1e-7, Explicit::adaptive(1e-7)), (1e-10, Explicit::eighth_order(1e-10))] {
        let settings = settings.with_coordinates(Coordinates::Absolute);
        let run =
            |is_redundant| differentiate_explicitly(&OnHinges { is_redundant }, &DROPPED, &settings, &at).unwrap();
        let (one, two) = (run(false), run(true));
        let mut apart = [0.0f64; 2];
        for output in 0..one.values.len() {
            for p in 0..at.len() {
                apart[0] = apart[0].max((one.values[output][p] - two.values[output][p]).abs());
                let rows = one.gradients[output][p].iter().zip(&two.gradients[output][p]);
                rows.for_each(|(a, b)| apart[1] = apart[1].max((a - b).abs()));
            }
        }
        println!("{}: values differ by {:.1e}, derivatives by {:.1e}", settings.method.name, apart[0], apart[1]);
        // The steps differ, because one motion has an event: by 3 tolerances in values, and by 500 in derivatives of the acceleration.
        assert!(apart[0] < 30.0 * tolerance && apart[1] < 5e3 * tolerance);
    }
}

/// A slider-crank: crank of the length b₀ and the moment of inertia b₁, rod of the length b₂ without mass, slider of the mass b₃ with the
/// friction b₄. The crank is driven with the speed b₅, or by the torque b₅ against friction of 0.01 m · b₄ in its bearing.
struct FrictionCrank {
    is_driven: bool,
}

const FRICTION_CRANK: [f64; 6] = [0.06, 0.02, 0.25, 2.0, 30.0, 6.0];

impl ParametricMechanism for FrictionCrank {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let ground = m.ground();
        let crank = m.body("crank", S::from(1.0), b[1], Pose { x: zero, y: zero, theta: zero });
        let slider = m.point_mass("slider", b[3], b[0] + b[2], zero);
        m.revolute("bearing", ground.origin(), crank.origin());
        m.distance_constraint("rod", crank.at(b[0], zero), slider.origin(), b[2]);
        m.fix(slider.y);
        let rail = m.dry_friction("rail", ground.x, slider.x, [b[4], S::from(1.0), zero]);
        if self.is_driven {
            let motor = m.driver("motor", ground.theta, crank.theta, ConstantSpeed, &[zero, b[5]]);
            let torque = m.measure(motor, "driving_force")?;
            m.output("torque", &[torque]);
        } else {
            m.load("motor", ground.theta, crank.theta, Fixed, &[b[5]]);
            m.dry_friction("bearing friction", ground.theta, crank.theta, [b[4] * 0.01, S::from(1.0), zero]);
            let sensor = m.coordinate_sensor("turn", ground.theta, crank.theta);
            let angle = m.measure(sensor, "position")?;
            m.output("angle", &[angle]);
            let energy = m.kinetic_energy();
            m.output("energy", &[energy]);
        }
        outputs(&mut m, slider.x)?;
        let force = m.measure(rail, "generalized_force")?;
        m.output("friction", &[force]);
        Ok(m)
    }
}

/// Torque of the motor at the time `t`: inertia and friction of the slider, x′ (m x″ ω² + F sign(x′)).
fn motor_torque<S: Scalar>(b: &[S], t: f64) -> S {
    let [r, l, mass, friction, speed] = [b[0], b[2], b[3], b[4], b[5]];
    let (sin, cos) = (speed * t).sin_cos();
    let rod = (l * l - r * r * sin * sin).sqrt();
    let slope = -(r * r * sin * cos) / rod;
    let first = slope - r * sin;
    let second = (-(r * r * (cos * cos - sin * sin)) - slope * slope) / rod - r * cos;
    let sign = if (FRICTION_CRANK[5] * t).sin() > 0.0 { -1.0 } else { 1.0 }; // of x′
    first * (mass * second * speed * speed + friction * sign)
}

#[test]
fn friction_of_a_driven_mechanism_changes_its_direction() {
    let model = FrictionCrank { is_driven: true };
    let end = 1.3; // the slider has returned twice
    let mechanism = model.build(&FRICTION_CRANK).unwrap();
    let times = [0.1, 0.5, 0.6, 0.9, 1.2, end];
    for (history, accuracy) in [
        (simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-11), &times).unwrap(), 1e-8),
        (simulate_explicitly(&mechanism, &Explicit::adaptive(1e-10), &times).unwrap(), 1e-7),
        (simulate(&mechanism, &Dynamics::fixed(1e-3), &times).unwrap(), 1e-3),
    ] {
        let torque = history.series("torque").unwrap();
        for (ours, t) in torque.iter().zip(times) {
            let exact = motor_torque(&FRICTION_CRANK, t);
            assert!((ours - exact).abs() < accuracy, "t = {t}: {ours} {exact}");
        }
    }
    check((&model, end), &FRICTION_CRANK, &[0], |_| {
        let (value, slopes) = gradient(|b| motor_torque(b, end), &FRICTION_CRANK);
        (value, slopes, hessian(|b| motor_torque(b, end), &FRICTION_CRANK).2.iter().copied().collect())
    });
    let all = all_settings();
    let smooth = [all[0], all[1], all[3]];
    // Adaptive steps rescale the rounding errors of velocities with the square of their length.
    check_adjoint_by(&smooth, ("driven crank", 1e-6), &model, &FRICTION_CRANK, &times);
    check_semi_analytical_by(&smooth, ("driven crank", 1e-3), &model, &FRICTION_CRANK, &times);
}

/// Two parts of friction hold the crank at rest at a dead centre; it breaks away at the torque of its bearing, and its work becomes
/// kinetic energy and heat.
#[test]
fn friction_in_two_joints_of_a_mechanism_dissipates_its_work() {
    let model = FrictionCrank { is_driven: false };
    let [r, _, l, _, friction, torque] = FRICTION_CRANK;
    let place = |angle: f64| r * angle.cos() + (l * l - (r * angle.sin()).powi(2)).sqrt();
    let mechanism = model.build(&FRICTION_CRANK).unwrap();
    let times = [0.05, 0.1, 0.15, 0.2, 0.3];
    for (history, accuracy) in [
        (simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-11), &times).unwrap(), 1e-7),
        (simulate(&mechanism, &Dynamics::fixed(2e-4), &times).unwrap(), 2e-3),
    ] {
        let (angle, energy) = (history.series("angle").unwrap(), history.series("energy").unwrap());
        for (angle, energy) in angle.iter().zip(energy) {
            let returns = (angle / std::f64::consts::PI).floor();
            let stroke = place(0.0) - place(std::f64::consts::PI);
            let last = (place(*angle) - place(returns * std::f64::consts::PI)).abs();
            let heat = friction * (returns * stroke + last) + 0.01 * friction * angle;
            let exact = torque * angle - heat;
            assert!((energy - exact).abs() < accuracy, "{angle}: {energy} {exact}");
        }
        assert!(angle[4] > 6.0, "{angle:?}");
    }
}

/// A block of 2 kg that the force b₀ cos(b₁ t) pushes with friction against a stop, which then carries the force. Friction holds the block
/// when the stop no longer does, until it slides back.
struct AgainstStop;

impl ParametricMechanism for AgainstStop {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let block = m.point_mass("block", S::from(2.0), zero, zero);
        let ground = m.ground();
        m.load("push", ground.x, block.x, Harmonic, &[zero, b[0], b[1], S::from(std::f64::consts::FRAC_PI_2)]);
        let rail = m.dry_friction("rail", ground.x, block.x, [b[2], S::from(1.2), zero]);
        let stop = m.rigid_stop("stop", block.x, ground.x, -b[3], zero);
        outputs(&mut m, block.x)?;
        for (element, what) in [(rail, "generalized_force"), (stop, "contact_force")] {
            let term = m.measure(element, what)?;
            m.output(what, &[term]);
        }
        Ok(m)
    }
}

#[test]
fn friction_at_rest_leaves_the_load_to_a_stop_and_holds_when_it_opens() {
    let b = [20.0, 3.0, 5.0, 0.3];
    let mechanism = AgainstStop.build(&b).unwrap();
    let times = [0.35, 0.45, 0.55, 0.6, 0.9];
    // The stop opens at 0.524 s, and friction of 6 N breaks away at 0.625 s: F sin(b₁ t) over the time since then gives the velocity.
    let broken = (-6.0f64 / 20.0).acos() / 3.0;
    let slid = |t: f64| {
        let part = |t: f64| -(3.0 * t).cos() / 9.0 * 20.0 + 2.5 * t * t;
        let rate = |t: f64| 20.0 / 3.0 * (3.0 * t).sin() + 5.0 * t;
        0.3 + (part(t) - part(broken) - rate(broken) * (t - broken)) / 2.0
    };
    for (history, accuracy) in [
        (simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-11), &times).unwrap(), 1e-9),
        (simulate(&mechanism, &Dynamics::fixed(1e-3), &times).unwrap(), 1e-4),
    ] {
        let of = |name: &str| history.series(name).unwrap().to_vec();
        let (x, friction, stop) = (of("position"), of("generalized_force"), of("contact_force"));
        for k in 0..4 {
            let push = 20.0 * (3.0 * times[k]).cos();
            assert!((x[k] - 0.3).abs() < 1e-9, "{x:?}");
            assert!((stop[k] - push.max(0.0)).abs() < accuracy, "{stop:?}");
            assert!((friction[k] - push.min(0.0)).abs() < accuracy, "{friction:?}");
        }
        assert!((x[4] - slid(0.9)).abs() < accuracy, "{x:?} {}", slid(0.9));
    }
    check_adjoint_by(&all_settings()[..1], ("against a stop", 1e-7), &AgainstStop, &b, &times);
}

/// Friction of 5 N and 3 N on one coordinate moves it like friction of 8 N.
#[test]
fn two_parts_of_friction_on_one_coordinate_add_up() {
    let history = |parts: &[f64]| {
        let mut m = Mechanism::new();
        let block = m.point_mass("block", 1.5, 0.0, 0.0);
        let ground = m.ground();
        m.load("push", ground.x, block.x, Harmonic, &[0.0, 14.0, 4.0, 0.0]);
        for (k, &force) in parts.iter().enumerate() {
            m.dry_friction(&format!("friction {k}"), ground.x, block.x, [force, 1.0, 0.0]);
        }
        outputs(&mut m, block.x).unwrap();
        let times: Vec<f64> = (1..40).map(|k| 0.1 * f64::from(k)).collect();
        [
            simulate_explicitly(&m, &Explicit::eighth_order(1e-11), &times).unwrap().values,
            simulate(&m, &Dynamics::fixed(1e-3), &times).unwrap().values,
        ]
    };
    let (one, two) = (history(&[8.0]), history(&[5.0, 3.0]));
    for (one, two) in one.iter().flatten().flatten().zip(two.iter().flatten().flatten()) {
        assert!((one - two).abs() < 1e-8, "{one} {two}");
    }
}

/// A box of the mass b₀ that rests on three rigid walls under its corners and its middle, pushed down by the force b₁ at 0.2 m.
struct OnThreeWalls;

impl ParametricMechanism for OnThreeWalls {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let block = m.body("box", b[0], S::from(0.1), Pose { x: zero, y: S::from(0.2), theta: zero });
        let ground = m.ground();
        let walls = [-0.3, 0.1, 0.3].map(|x| {
            let corner = block.at(S::from(x), S::from(-0.2));
            m.rigid_wall(&format!("wall at {x}"), ground.origin(), zero, corner, S::from(0.2))
        });
        m.load("push", ground.y, block.y, Fixed, &[-b[1]]);
        m.load("tilt", ground.theta, block.theta, Fixed, &[b[1] * -0.2]);
        outputs(&mut m, block.y)?;
        let forces: Vec<_> = walls.into_iter().map(|wall| m.measure(wall, "contact_force")).collect::<Result<_>>()?;
        m.output("all walls", &forces);
        m.output("first wall", &forces[..1]);
        Ok(m)
    }
}

/// The motion is determined, and so is the sum of the contact forces; their distribution is not, and a warning says so.
#[test]
fn a_body_rests_on_more_rigid_contacts_than_can_be_told_apart() {
    for push in [0.0, 5.0] {
        let b = [2.0, push];
        let m = OnThreeWalls.build(&b).unwrap();
        for history in [
            simulate(&m, &Dynamics::fixed(0.01), &[0.5, 1.0]).unwrap(),
            simulate_explicitly(&m, &Explicit::eighth_order(1e-9), &[0.5, 1.0]).unwrap(),
            simulate_explicitly(&m, &Explicit::adaptive(1e-9), &[0.5, 1.0]).unwrap(),
        ] {
            let [place, velocity, force, _] = [0, 1, 2, 3].map(|k| &history.values[k]);
            assert!(place.iter().all(|y| (y - 0.2).abs() < 1e-9), "{place:?}");
            assert!(velocity.iter().all(|v| v.abs() < 1e-9), "{velocity:?}");
            assert!(force.iter().all(|force| (force - 2.0 * 9.81 - push).abs() < 1e-9), "{force:?}");
        }
        let warnings = warn_of_indeterminate_outputs(&m, Assembly::default(), 0.0).unwrap();
        assert!(warnings.len() == 1 && warnings[0].starts_with("first wall"), "{warnings:?}");
    }
}

/// Events split given steps: those of a motion with events, whose steps end at them up to rounding, repeat it to its last output.
#[test]
fn given_steps_with_events_reach_the_last_output() {
    let times: Vec<f64> = (1..=40).map(|k| 0.1 * f64::from(k)).collect();
    for settings in [Explicit::adaptive(1e-8), Explicit::eighth_order(1e-9)] {
        let mechanism = StickSlip.build(&STICK_SLIP).unwrap();
        let (whole, steps) = simulate_with_steps(&mechanism, &settings, &times).unwrap();
        let given = settings.clone().with_step_control(StepControl::Given(steps));
        let again = simulate_explicitly(&mechanism, &given, &times).unwrap();
        assert_eq!(again.impacts.len(), whole.impacts.len());
        for (a, b) in again.values[0].iter().zip(&whole.values[0]) {
            assert!((a - b).abs() < 1e-11, "{}: {a} {b}", settings.method.name);
        }
        // Up to an earlier time, derivatives are those of the same steps and events.
        let part = differentiate_explicitly(&StickSlip, &STICK_SLIP, &settings.clone().with_end(4.0), &times[..17]);
        let all = differentiate_explicitly(&StickSlip, &STICK_SLIP, &settings, &times).unwrap();
        assert_eq!(part.unwrap().gradients[0], all.gradients[0][..17]);
    }
}

/// Four masses in a row on springs of the stiffness b₁, each with dry friction b₀ times its number, at rest; the first one is pushed.
struct Row;

impl ParametricMechanism for Row {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let ground = m.ground();
        let slide = |m: &mut Mechanism<S>, k: i32| m.coordinate(format!("m{k}"), zero, zero);
        let masses = [1, 2, 3, 4].map(|k| slide(&mut m, k));
        for (k, &mass) in masses.iter().enumerate() {
            m.inertia("mass", mass, S::from(1.3 + 0.3 * k as f64));
            m.dry_friction(&format!("f{k}"), ground.x, mass, [b[0] * (1.2 + 0.2 * k as f64), S::from(1.1), zero]);
        }
        for pair in masses.windows(2) {
            m.coordinate_spring("spring", pair[0], pair[1], [b[1], zero, zero, zero]);
        }
        m.load("push", ground.x, masses[0], Harmonic, &[zero, S::from(12.0), S::from(3.0), zero]);
        outputs(&mut m, masses[0])?;
        Ok(m)
    }
}

/// A ball of 1.3 kg that is dropped from the height b₀ on the ground, with restitution 0.6, and comes to rest.
struct BallAtRest;

impl ParametricMechanism for BallAtRest {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let ball = m.point_mass("ball", S::from(1.3), zero, b[0]);
        let ground = m.ground();
        m.rigid_stop("stop", ground.y, ball.y, zero, S::from(0.6));
        outputs(&mut m, ball.y)?;
        Ok(m)
    }
}

/// Where nothing moves, all derivatives are rounding errors: the differences of the residual need not settle.
#[test]
fn semi_analytical_derivatives_of_masses_at_rest_are_zero_but_for_rounding() {
    let settings = [0.01, 0.06].map(Dynamics::fixed);
    check_semi_analytical_by(&settings[..1], ("row", 1e-4), &Row, &[1.0, 60.0], &[0.02, 0.1, 0.4]);
    for settings in settings {
        let ours = differentiate_semi_analytically(&BallAtRest, &[1.0], &settings, &[1.2, 1.9, 3.0], STEP).unwrap();
        let direct = differentiate(&BallAtRest, &[1.0], &settings, &[1.2, 1.9, 3.0]).unwrap();
        for (a, b) in ours.gradients[0].iter().flatten().zip(direct.gradients[0].iter().flatten()) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        assert!(ours.gradients[0][2][0].abs() < 1e-12, "{:?}", ours.gradients[0]);
    }
}

/// Two masses b₀ and b₁ joined by friction that sticks from the start, with the given velocities b₂ and b₃, and a third one held at rest on the
/// ground with the velocity b₄. The first one is pushed by a spring of the stiffness b₅.
struct StuckTogether;

const STUCK: [f64; 6] = [1.0, 3.0, 1.0, 1.0, 0.0, 2.0];

impl ParametricMechanism for StuckTogether {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let ground = m.ground();
        let masses = [b[0], b[1], b[0]].map(|mass| m.point_mass("mass", mass, zero, zero));
        for (mass, v) in masses.iter().zip(&b[2..5]) {
            m.set_velocity(mass.x, *v);
        }
        let friction = m.dry_friction("together", masses[0].x, masses[1].x, [S::from(50.0), S::from(1.2), zero]);
        m.dry_friction("at rest", ground.x, masses[2].x, [S::from(5.0), S::from(1.5), zero]);
        m.coordinate_spring("spring", ground.x, masses[0].x, [b[5], zero, zero, zero]);
        for mass in masses {
            outputs(&mut m, mass.x)?;
        }
        let force = m.measure(friction, "generalized_force")?;
        m.output("friction", &[force]);
        Ok(m)
    }
}

/// Friction that sticks stops the sliding velocities of neighbouring designs: momentum is kept, and a body on the ground stays.
#[test]
fn velocities_that_friction_stops_at_the_start_have_the_derivatives_of_an_impulse() {
    let (t, b) = (0.8, STUCK);
    let rate = (b[5] / (b[0] + b[1])).sqrt();
    let [position, velocity] = [(rate * t).sin() / rate, (rate * t).cos()];
    let share = |mass: usize| b[mass] / (b[0] + b[1]);
    let is_exact = |gradients: &[Vec<Vec<f64>>], limit: f64| {
        for (output, exact) in [(0, position), (1, velocity), (2, position), (3, velocity), (4, 0.0), (5, 0.0)] {
            for (variable, share) in [(2, share(0)), (3, share(1)), (4, 0.0)] {
                let ours = gradients[output][0][variable];
                assert!((ours - exact * share).abs() < limit, "{output} by {variable}: {ours} for {}", exact * share);
            }
        }
    };
    for settings in [Explicit::eighth_order(1e-10), Explicit::adaptive(1e-9)] {
        is_exact(&differentiate_explicitly(&StuckTogether, &b, &settings, &[t]).unwrap().gradients, 1e-6);
        let error = differentiate_explicitly_twice(&StuckTogether, &b, &settings, &[t], HessianPart::Full).unwrap_err();
        assert!(error.to_string().contains("sticks at the start"), "{error}");
        let functionals: Vec<_> = (0..6).map(|output| AdjointFunctional::at(output, 0)).collect();
        let rows = differentiate_explicitly_backwards(&StuckTogether, &b, &settings, &[t], &functionals).unwrap();
        let rows: Vec<_> = (0..6).map(|output| vec![rows.row(output).iter().copied().collect()]).collect();
        is_exact(&rows, 1e-6);
    }
    let settings = Dynamics::fixed(1e-3);
    is_exact(&differentiate(&StuckTogether, &b, &settings, &[t]).unwrap().gradients, 1e-6);
    is_exact(&differentiate_semi_analytically(&StuckTogether, &b, &settings, &[t], STEP).unwrap().gradients, 1e-5);
    let functionals: Vec<_> = (0..6).map(|output| AdjointFunctional::at(output, 0)).collect();
    let (rows, _) =
        differentiate_backwards_within(usize::MAX, &StuckTogether, &b, &settings, &[t], &functionals).unwrap();
    let rows: Vec<_> = (0..6).map(|output| vec![rows.row(output).iter().copied().collect()]).collect();
    is_exact(&rows, 1e-6);
}

/// A turning rod falls without gravity onto a wall with its corner, and rests on it for a while: the impacts have no restitution.
#[test]
fn a_corner_without_restitution_lands_and_leaves_within_a_turn() {
    let mut m = Mechanism::<f64>::new();
    let rod = m.body("rod", 0.7, 0.05, Pose { x: 0.2, y: 0.6, theta: 0.0 });
    m.set_velocity(rod.y, -2.0);
    m.set_velocity(rod.theta, 2.0);
    let ground = m.ground();
    m.rigid_wall("wall", ground.origin(), 0.0, rod.at(0.1, -0.15), 0.0);
    outputs(&mut m, rod.y).unwrap();
    let times: Vec<f64> = (0..=100).map(|k| 0.01 * f64::from(k)).collect();
    for settings in [Explicit::eighth_order(1e-8), Explicit::adaptive(1e-8)] {
        let history = simulate_explicitly(&m, &settings, &times).unwrap();
        let end = history.values[0][100];
        assert!((end - 0.010968943).abs() < 1e-6, "{end} {:?}", history.impacts);
    }
}

/// One mass with friction and a stop: where the friction breaks away at the closed stop, the stop opens.
#[test]
fn friction_breaks_away_beside_a_stop() {
    let mut m = Mechanism::<f64>::new();
    let mass = m.point_mass("mass", 0.632, 0.0, 0.0);
    let ground = m.ground();
    m.load("load", ground.x, mass.x, Harmonic, &[0.0, -6.34, 3.07, 1.1]);
    m.dry_friction("friction", ground.x, mass.x, [1.16, 1.0, 0.0]);
    m.rigid_stop("stop", ground.x, mass.x, -0.059, 0.0);
    outputs(&mut m, mass.x).unwrap();
    let times: Vec<f64> = (0..=150).map(|k| 0.02 * f64::from(k)).collect();
    for settings in [Explicit::eighth_order(1e-8), Explicit::adaptive(1e-8)] {
        let history = simulate_explicitly(&m, &settings, &times).unwrap();
        assert!((history.values[0][150] - 2.923151).abs() < 1e-5, "{:?}", history.values[0][150]);
    }
    let history = simulate(&m, &Dynamics::fixed(1e-3), &times).unwrap();
    assert!((history.values[0][150] - 2.923151).abs() < 1e-3, "{:?}", history.values[0][150]);
}

/// A ball that falls from the height b₀ under the gravity b₁ and is pushed sideways by b₂ from its rebound on: the velocity jumps over the
/// limit of the condition.
struct PushedAtRebound {
    ends: bool,
}

impl ParametricMechanism for PushedAtRebound {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[1]);
        let ball = m.point_mass("ball", S::from(1.0), zero, b[0]);
        let ground = m.ground();
        m.rigid_stop("floor", ground.y, ball.y, zero, S::from(0.5));
        let push = m.load("push", ground.x, ball.x, Fixed, &[b[2]]);
        let sensor = m.coordinate_sensor("ball", ground.y, ball.y);
        let rate = m.measure(sensor, "velocity")?;
        let mut actions = vec![Action::Activate(push)];
        actions.extend(self.ends.then_some(Action::Terminate));
        m.when("rebound", Linear(vec![1.0], 0.0), &[rate], &actions)?;
        outputs(&mut m, ball.x)?;
        Ok(m)
    }
}

#[test]
fn events_happen_where_a_jump_makes_their_condition_true() {
    let (b, end) = ([1.2f64, 9.81, 3.0], 0.9f64);
    let impact = (2.0 * b[0] / b[1]).sqrt();
    let (position, by_height) = (0.5 * b[2] * (end - impact).powi(2), -b[2] * (end - impact) * 0.5 * impact / b[0]);
    let is_exact = |values: f64, gradient: &[f64], limit: f64| {
        let expected = [by_height, -by_height * b[0] / b[1], position / b[2]];
        assert!((values - position).abs() < limit, "{values} for {position}");
        gradient
            .iter()
            .zip(expected)
            .for_each(|(a, b)| assert!((a - b).abs() < limit, "{gradient:?} for {expected:?}"));
    };
    let model = PushedAtRebound { ends: false };
    for settings in [Explicit::eighth_order(1e-10), Explicit::adaptive(1e-10)] {
        let found = differentiate_explicitly(&model, &b, &settings, &[end]).unwrap();
        is_exact(found.values[0][0], &found.gradients[0][0], 1e-7);
    }
    let settings = Dynamics::fixed(1e-3);
    let found = differentiate(&model, &b, &settings, &[end]).unwrap();
    is_exact(found.values[0][0], &found.gradients[0][0], 1e-4);
    let differences = differentiate_semi_analytically(&model, &b, &settings, &[end], STEP).unwrap();
    is_exact(differences.values[0][0], &differences.gradients[0][0], 1e-4);
    let at_end = [AdjointFunctional::at(0, 0)];
    let (rows, _) = differentiate_backwards_within(usize::MAX, &model, &b, &settings, &[end], &at_end).unwrap();
    is_exact(found.values[0][0], rows.row(0).transpose().as_slice(), 1e-4);
    // The same event may end the motion.
    let m = PushedAtRebound { ends: true }.build(&b).unwrap();
    let explicit = simulate_explicitly(&m, &Explicit::eighth_order(1e-10), &[end]).unwrap();
    let implicit = simulate(&m, &settings, &[end]).unwrap();
    for history in [explicit, implicit] {
        let last = history.impacts.last().unwrap();
        assert!((last.t - impact).abs() < 1e-5, "{:?}", history.impacts);
        assert_eq!(history.values[0][0], 0.0);
    }
}
