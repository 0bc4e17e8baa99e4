//! Mechanisms that cannot be analysed are rejected with a name, a reason and a remedy.

use crate::zoo::Brake;
use linkwright::Result;
use linkwright::autodiff::Scalar;
use linkwright::cases::{Chain, FourBar};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate, simulate_explicitly};
use linkwright::mechanics::analyses::kinematics::kinematics;
use linkwright::mechanics::analyses::statics::{Statics, equilibria};
use linkwright::mechanics::constraint_rank::indeterminate_reactions;
use linkwright::mechanics::elements::{BeamSection, Element, ElementState, Shear, StateFunction};
use linkwright::mechanics::initial_conditions::{Assembly, redundant_constraints};
use linkwright::mechanics::integrators::explicit::Explicit;
use linkwright::mechanics::mechanism::{Coordinate, Formula, Marker, Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::{ConstantSpeed, Motion};
use linkwright::mechanics::system::System;
use linkwright::mechanics::system::state::State;

fn message(mechanism: &Mechanism<f64>) -> String {
    simulate(mechanism, &Dynamics::fixed(1e-2), &[0.1]).expect_err("it must fail").to_string()
}

fn link(m: &mut Mechanism<f64>, name: &str, x: f64) -> linkwright::mechanics::mechanism::Body {
    m.body(name, 1.0, 0.1, Pose { x, y: 0.0, theta: 0.0 })
}

#[test]
fn zero_and_negative_masses_are_named() {
    let error = message(&Chain::horizontal(2).build(&[1.0, 1.0, 1.0, 0.0]).unwrap());
    assert!(error.contains("link 2") && error.contains("mass is 0 kg, before the motion starts at t = 0 s"), "{error}");
}

#[test]
fn a_loop_that_is_too_short_is_named() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let rod = link(&mut m, "rod", 0.5);
    m.revolute("near", ground.origin(), rod.at(-0.5, 0.0));
    m.revolute("far", ground.at(3.0, 0.0), rod.at(0.5, 0.0));
    let error = message(&m);
    assert!(error.contains("far (constraint 1)") && error.contains("t = 0 s"), "{error}");
}

/// Two links too short to close the loop: the joint with the largest gap is named.
#[test]
fn a_chain_that_does_not_reach_its_end_is_named() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let bob = m.point_mass("bob", 1.0, 0.5, 0.4);
    m.distance_constraint("near", ground.origin(), bob.origin(), 0.6);
    m.distance_constraint("far", ground.at(3.0, 0.0), bob.origin(), 0.7);
    let error = message(&m);
    assert!(error.contains("near") || error.contains("far"), "{error}");
    assert!(error.contains("t = 0 s"), "{error}");
}

#[test]
fn contradictory_joints_are_named() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let bob = m.point_mass("bob", 1.0, 1.0, 0.0);
    m.distance_constraint("rod", ground.origin(), bob.origin(), 1.0);
    m.distance_constraint("longer rod", ground.origin(), bob.origin(), 1.1);
    let error = message(&m);
    assert!(error.contains("longer rod") && error.contains("contradictory at t = 0 s"), "{error}");
}

/// A third crank on a parallelogram is redundant: its equations depend on those of the others, at any angle.
#[test]
fn a_third_parallel_crank_moves_at_any_angle() {
    let parallelogram = |cranks: usize, angle: f64| {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground();
        let (sin, cos) = angle.sin_cos();
        let coupler = m.body("coupler", 1.0, 0.1, Pose { x: 0.3 * cos + 0.5, y: 0.3 * sin, theta: 0.0 });
        for (k, x) in [0.0, 1.0, 0.37].into_iter().take(cranks).enumerate() {
            let half = 0.15;
            let pose = Pose { x: x + half * cos, y: half * sin, theta: angle };
            let crank = m.body(&format!("crank {k}"), 1.0, 0.1, pose);
            m.revolute(&format!("foot {k}"), ground.at(x, 0.0), crank.at(-half, 0.0));
            m.revolute(&format!("head {k}"), crank.at(half, 0.0), coupler.at(x - 0.5, 0.0));
        }
        simulate(&m, &Dynamics::fixed(1e-2), &[0.1]).map(|_| ())
    };
    for angle in [0.3, 0.7, 1.1, 2.345] {
        assert_eq!(parallelogram(2, angle), Ok(()));
        assert_eq!(parallelogram(3, angle), Ok(()));
    }
}

/// A link held stretched by a drive: at this time any motion of the drive is impossible.
#[test]
fn a_dead_centre_is_named_with_its_time() {
    let crank = |angle: f64| {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground();
        let (sin, cos) = angle.sin_cos();
        let rod = m.body("rod", 1.0, 0.1, Pose { x: 0.5 * cos, y: 0.5 * sin, theta: angle });
        m.revolute("pivot", ground.origin(), rod.at(-0.5, 0.0));
        let slider = m.point_mass("slider", 1.0, cos, sin);
        m.revolute("pin", rod.at(0.5, 0.0), slider.origin());
        m.driver("drive", ground.x, slider.x, ConstantSpeed, &[cos, 0.1]);
        kinematics(&m, Assembly::default(), &[0.0]).map(|_| ())
    };
    assert_eq!(crank(0.3), Ok(()));
    let error = crank(0.0).unwrap_err().to_string();
    assert!(error.contains("drive") && error.contains("dead centre") && error.contains("t = 0 s"), "{error}");
}

#[test]
fn sections_of_no_or_negative_size_are_named() {
    for size in [0.0, -0.01, f64::NAN] {
        for section in [
            BeamSection::circular(size, 2e11, 0.3, 7800.0),
            BeamSection::rectangular(0.01, size, 2e11, 0.3, 7800.0),
            BeamSection::rectangular(size, size, 2e11, 0.3, 7800.0),
        ] {
            let mut m = Mechanism::<f64>::new();
            m.beam("arm", [[0.0, 0.0], [1.0, 0.0]], [None, None], 2, &section, Shear::Flexible);
            let error = message(&m);
            assert!(error.contains("arm element 1: EA is"), "{error}");
        }
    }
}

#[test]
fn a_step_that_does_not_converge_names_element_and_time() {
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("cart", 0.0, 0.0);
    m.inertia("mass", x, 1.0);
    m.feedback_force("brake", x, &[x], Brake, &[1e6]);
    let error = simulate(&m, &Dynamics::fixed(1e-2), &[0.3]).unwrap_err().to_string();
    assert!(error.contains("cart, mostly by brake") && error.contains("does not converge from t ="), "{error}");
}

/// A motion that is finite until 0.5 s.
struct Breaks;

fn until_half_a_second<T: Scalar>(t: T) -> T {
    if t.re() < 0.5 { t * t } else { T::from(f64::NAN) }
}

impl Motion for Breaks {
    fn position<T: Scalar>(&self, _p: &[T], t: T) -> T {
        until_half_a_second(t)
    }
}

impl Formula for Breaks {
    fn value<T: Scalar>(&self, t: T, x: &[T]) -> T {
        x[0] + until_half_a_second(t)
    }
}

impl StateFunction for Breaks {
    fn generalized_force<T: Scalar>(&self, _p: &[T], t: T, q: &[T], _v: &[T]) -> T {
        q[0] * until_half_a_second(t)
    }
}

/// A cart of 1 kg on a spring, with an element that fails.
fn cart(breaks: impl Fn(&mut Mechanism<f64>, Coordinate)) -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("cart", 0.0, 0.3);
    m.inertia("mass", x, 1.0);
    m.coordinate_spring("spring", m.ground().x, x, [10.0, 0.0, 0.0, 0.0]);
    let sensor = m.coordinate_sensor("sensor", m.ground().x, x);
    let position = m.measure(sensor, "position").unwrap();
    m.output("position", &[position]);
    breaks(&mut m, x);
    m
}

#[test]
fn nan_from_drivers_forces_and_expressions_is_named_with_its_time() {
    type Case = (&'static str, fn(&mut Mechanism<f64>, Coordinate));
    let cases: [Case; 5] = [
        ("cart", |m, x| m.drive(x, Breaks, &[])),
        ("joint drive", |m, x| {
            let free = m.coordinate("other", 0.0, 0.0);
            m.inertia("other mass", free, 1.0);
            m.driver("joint drive", x, free, Breaks, &[]);
        }),
        ("push", |m, x| {
            m.load("push", m.ground().x, x, Breaks, &[]);
        }),
        ("law", |m, x| {
            m.feedback_force("law", x, &[x], Breaks, &[]);
        }),
        ("expression", |m, x| {
            let sensor = m.coordinate_sensor("sensor", m.ground().x, x);
            let term = m.measure(sensor, "position").unwrap();
            m.output_formula("expression", Breaks, &[term]);
        }),
    ];
    let times = [0.2, 0.4, 0.7];
    for (name, breaks) in cases {
        let m = cart(breaks);
        let runs: [(&str, Result<()>); 4] = [
            ("implicit", simulate(&m, &Dynamics::fixed(0.02), &times).map(|_| ())),
            ("adaptive", simulate(&m, &Dynamics::adaptive(1e-5), &times).map(|_| ())),
            ("explicit", simulate_explicitly(&m, &Explicit::adaptive(1e-6), &times).map(|_| ())),
            ("statics", equilibria(&m, &Statics::default(), &times).map(|_| ())),
        ];
        for (analysis, outcome) in runs {
            let error = outcome.expect_err(name).to_string();
            let place = error.contains(&format!("analysis failed in {name}: "));
            assert!(place && error.contains("t = 0."), "{analysis} {name}: {error}");
        }
    }
    // The drive is evaluated at all times and by itself.
    let m = cart(|m, x| m.drive(x, Breaks, &[]));
    let error = kinematics(&m, Assembly::default(), &times).unwrap_err().to_string();
    assert!(error.contains("cart") && error.contains("t = "), "{error}");
}

/// Rods, linear drives and actuators need a direction; springs do not.
#[test]
fn points_that_coincide_are_named_where_a_direction_is_needed() {
    let hang = |hanger: &dyn Fn(&mut Mechanism<f64>, Marker<f64>)| {
        let mut m = Mechanism::<f64>::with_gravity(0.0, -10.0);
        let bob = m.point_mass("bob", 1.0, 0.0, 0.0);
        hanger(&mut m, bob.origin());
        simulate(&m, &Dynamics::fixed(1e-2), &[0.1]).map(|run| run.last.q[4])
    };
    let rod = hang(&|m, bob| {
        m.distance_constraint("hanger", m.ground().origin(), bob, 1.0);
    });
    let actuator = hang(&|m, bob| {
        m.actuator("hanger", m.ground().origin(), bob, ConstantSpeed, &[1.0, 0.0]);
    });
    let drive = hang(&|m, bob| {
        m.drive_length("hanger", m.ground().origin(), bob, ConstantSpeed, &[1.0, 0.0]);
    });
    for outcome in [rod, actuator, drive] {
        let error = outcome.unwrap_err().to_string();
        assert!(error.contains("hanger") && error.contains("coincide") && error.contains("t = 0 s"), "{error}");
    }
    let spring = hang(&|m, bob| {
        m.spring_damper("hanger", m.ground().origin(), bob, [100.0, 1.0, 0.0]);
    });
    assert!((-0.05..0.0).contains(&spring.unwrap()));
}

#[test]
fn redundant_joints_share_their_reaction_and_are_named() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let rod = link(&mut m, "rod", 0.5);
    m.revolute("hinge", ground.origin(), rod.at(-0.5, 0.0));
    m.revolute("same hinge", ground.origin(), rod.at(-0.5, 0.0));
    assert!(simulate(&m, &Dynamics::fixed(1e-2), &[0.1]).is_ok());
    let (system, state) = (System::new(&m).unwrap(), State::built(&m, 0.0));
    let redundant = redundant_constraints(&system, &m, &state);
    assert_eq!(redundant, ["same hinge (constraint 1)", "same hinge (constraint 2)"]);
    assert_eq!(indeterminate_reactions(&system, &m, &state).len(), 4);
}

#[test]
fn a_coordinate_without_mass_is_named() {
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("loose", 0.0, 0.0);
    m.coordinate_spring("spring", m.ground().x, x, [1.0, 0.0, 0.0, 0.0]);
    assert!(message(&m).contains("loose"), "{}", message(&m));
}

/// A drive that moves the slider farther than the rod allows.
#[test]
fn an_impossible_driver_names_joint_and_time() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let rod = m.body("rod", 1.0, 0.1, Pose { x: 0.4, y: 0.3, theta: 0.6435 });
    m.revolute("pivot", ground.origin(), rod.at(-0.5, 0.0));
    let slider = m.point_mass("slider", 1.0, 0.8, 0.6);
    m.revolute("pin", rod.at(0.5, 0.0), slider.origin());
    m.driver("drive", ground.x, slider.x, ConstantSpeed, &[0.8, 1.0]);
    let error = kinematics(&m, Assembly::default(), &[0.0, 0.1, 0.19, 0.3]).expect_err("1.1 m > 1 m").to_string();
    // The rod is fully extended at 0.2 s, before 0.3 s.
    assert!(error.contains("t = 0.2"), "{error}");
}

/// A user's element whose function fails.
struct Broken;

impl Element for Broken {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[0] = (-x.q[0] - 1.0).sqrt();
    }
}

#[test]
fn nan_from_a_user_element_names_it() {
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("cart", 0.0, 0.0);
    m.inertia("mass", x, 1.0);
    m.add("broken spring", Broken, &[x], &[]);
    let error = message(&m);
    assert!(error.contains("broken spring: its forces are not finite at t = 0 s"), "{error}");
}

#[test]
fn settings_out_of_range_are_refused() {
    let m = Chain::horizontal(1).build(&[1.0, 1.0]).unwrap();
    for h in [0.0, -1.0, f64::NAN] {
        assert!(simulate(&m, &Dynamics::fixed(h), &[0.1]).unwrap_err().to_string().contains("time step"));
    }
    assert!(simulate(&m, &Dynamics::fixed(0.1), &[0.2, 0.1]).is_err());
    let four_bar = FourBar::physical();
    let mechanism = four_bar.build(&[0.03; 3]).unwrap();
    let error = simulate(&mechanism, &four_bar.dynamics().unwrap(), &[-0.1]).unwrap_err().to_string();
    assert!(error.contains("not before the start"), "{error}");
}

#[test]
fn very_thin_links_fail_with_a_reason_or_finish() {
    let model = FourBar::physical();
    let mechanism = model.build(&[0.008, 0.005, 0.005]).unwrap();
    match simulate(&mechanism, &model.dynamics().unwrap(), &FourBar::window()) {
        Ok(history) => assert!(history.values.iter().flatten().all(|m| m.is_finite())),
        Err(error) => assert!(error.to_string().contains("t = "), "{error}"),
    }
}

/// A motion from outside the crate.
struct Quadratic;

impl Motion for Quadratic {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] * t * t
    }
}

#[test]
fn elements_and_motions_come_from_outside_the_crate() {
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("cart", 0.0, 0.0);
    m.inertia("mass", x, 2.0);
    m.drive(x, Quadratic, &[3.0]);
    m.output("force", &[m.driving_force(x)]);
    let series = kinematics(&m, Assembly::default(), &[0.0, 1.0]).unwrap();
    assert_eq!(series[0], [12.0, 12.0]); // F = m a = 2 kg · 6 m/s²
}
