//! What cannot be analysed is refused by name, with a reason and a remedy.

use linkwright::analysis::kinematics::kinematics;
use linkwright::analysis::start::{Assembly, redundant_closures};
use linkwright::analysis::{Dynamics, State, System, simulate};
use linkwright::multibody::element::{Element, Local};
use linkwright::multibody::mechanisms::{Chain, FourBar};
use linkwright::multibody::motion::{ConstantSpeed, Motion};
use linkwright::multibody::{Mechanism, Model, Pose};
use linkwright::scalar::Scalar;

fn message(mechanism: &Mechanism<f64>) -> String {
    simulate(mechanism, &Dynamics::fixed(1e-2), &[0.1]).expect_err("it must fail").to_string()
}

fn link(m: &mut Mechanism<f64>, name: &str, x: f64) -> linkwright::multibody::Body {
    m.body(name, 1.0, 0.1, Pose { x, y: 0.0, theta: 0.0 })
}

#[test]
fn zero_and_negative_masses_are_named() {
    let error = message(&Chain::horizontal(2).build(&[1.0, 1.0, 1.0, 0.0]).unwrap());
    assert!(error.contains("link 2") && error.contains("mass is 0 kg"), "{error}");
}

#[test]
fn a_loop_that_is_too_short_is_named() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let rod = link(&mut m, "rod", 0.5);
    m.revolute("near", ground.origin(), rod.at(-0.5, 0.0));
    m.revolute("far", ground.at(3.0, 0.0), rod.at(0.5, 0.0));
    let error = message(&m);
    assert!(error.contains("near") || error.contains("far"), "{error}");
}

#[test]
fn redundant_joints_are_named() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground();
    let rod = link(&mut m, "rod", 0.5);
    m.revolute("hinge", ground.origin(), rod.at(-0.5, 0.0));
    m.revolute("same hinge", ground.origin(), rod.at(-0.5, 0.0));
    let error = message(&m);
    assert!(error.contains("same hinge (closure 1)") && error.contains("redundant"), "{error}");
    let system = System::new(&m).unwrap();
    assert_eq!(redundant_closures(&system, &m, &State::built(&m, 0.0)).len(), 2);
}

#[test]
fn a_coordinate_without_mass_is_named() {
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("loose", 0.0, 0.0);
    m.coordinate_spring("spring", m.ground().x, x, [1.0, 0.0, 0.0, 0.0]);
    assert!(message(&m).contains("loose"), "{}", message(&m));
}

/// A drive that asks the slider to go beyond the reach of the rod.
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
    assert!(error.contains("t = 3.0") && error.contains("e-1 s"), "{error}");
}

/// A user element whose function breaks.
struct Broken;

impl Element for Broken {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        balance[0] = (-x.q[0] - 1.0).sqrt();
    }
}

#[test]
fn nan_from_a_user_element_names_the_coordinate() {
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("cart", 0.0, 0.0);
    m.inertia("mass", x, 1.0);
    m.add("broken spring", Broken, &[x], &[]);
    let error = message(&m);
    assert!(error.contains("broken spring") || error.contains("cart"), "{error}");
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
    m.output("force", &[m.effort(x)]);
    let series = kinematics(&m, Assembly::default(), &[0.0, 1.0]).unwrap();
    assert_eq!(series[0], [12.0, 12.0]); // F = m a = 2 kg · 6 m/s²
}
