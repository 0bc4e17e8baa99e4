//! Joints in space that let go: derivatives against differences of the values, against each other, and against those of other schemes.

use crate::derivative_methods::{all_settings, check_adjoint_by, check_semi_analytical_by, deviation};
use crate::explicit::check_methods;
use crate::finite_differences::extrapolated_differences;
use crate::models::Linear;
use autodiff::Scalar;
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::events::Action;
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::mechanism::Pose3;
use linkwright_mechanics::{Dynamics, Mechanism, ParametricMechanism, Result, simulate};

/// Joints that let go.
#[derive(Clone, Copy, Debug)]
enum Joint {
    Ball,
    Hinge,
    Weld,
    Universal,
    Sleeve,
}

/// An arm on a hinge, and a body on its end that a joint releases: at the height b₇, or when the arm has turned by b₇.
struct Sling3 {
    joint: Joint,
    at_height: bool,
}

const SLING3: [f64; 8] = [1.3, 0.03, 0.05, 0.04, 0.4, 6.0, 1.5, 0.1];

const TIMES: [f64; 5] = [0.01, 0.03, 0.1, 0.2, 0.4];

impl ParametricMechanism for Sling3 {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::with_gravity3([zero, zero, S::from(-9.81)]);
        let ground = m.ground3();
        let properties = MassProperties3::principal(b[0], [b[1], b[2], b[3]]);
        let axis = [S::from(0.3), -one, zero];
        let arm = m.body3("arm", properties, Pose3::at([zero; 3]));
        let hinge = [ground.origin().with_z(axis), arm.origin().with_z(axis)];
        m.revolute3("hinge", hinge[0], hinge[1]);
        let angle = m.joint_angle("angle", hinge[0], hinge[1]);
        m.set_velocity3(arm, [zero; 3], axis.map(|x| x * b[5]));
        let body = m.body3("body", MassProperties3 { mass: b[6], ..properties }, Pose3::at([b[4], zero, zero]));
        m.set_velocity3(body, [zero, zero, b[4] * b[5]], axis.map(|x| x * b[5]));
        let (tip, end) = (arm.at([b[4], zero, zero]), body.origin());
        let oblique = [S::from(0.2), S::from(0.4), one];
        let joint = match self.joint {
            Joint::Ball => m.spherical("joint", tip, end),
            Joint::Hinge => m.revolute3("joint", tip.with_z(oblique), end.with_z(oblique)),
            Joint::Weld => m.fixed_joint3("joint", tip, end),
            Joint::Universal => m.universal("joint", tip.with_z([zero, one, zero]), end.with_z([zero, zero, one])),
            Joint::Sleeve => m.cylindrical("joint", tip.with_z(oblique), end.with_z(oblique)),
        };
        let sensor = m.sensor3("body sensor", body.at([zero, S::from(0.1), zero]));
        let turned = m.coordinate_sensor("turned", m.ground().x, angle);
        let limit = m.sensor3("limit", ground.at([zero, zero, b[7]]));
        let reached = if self.at_height { m.measure(sensor, "z")? } else { m.measure(turned, "position")? };
        let limit = m.measure(limit, "z")?;
        m.when("release", Linear(vec![1.0, -1.0], 0.0), &[reached, limit], &[Action::Deactivate(joint)])?;
        for what in ["x", "y", "z", "vx", "vy", "vz"] {
            let term = m.measure(sensor, what)?;
            m.output(what, &[term]);
        }
        Ok(m)
    }
}

fn slings() -> impl Iterator<Item = Sling3> {
    let joints = [Joint::Ball, Joint::Hinge, Joint::Weld, Joint::Universal, Joint::Sleeve];
    joints.into_iter().flat_map(|joint| [true, false].map(|at_height| Sling3 { joint, at_height }))
}

#[test]
fn derivatives_through_a_release_in_space_are_those_of_the_values() {
    for model in slings() {
        for settings in &all_settings()[..3] {
            assert_eq!(simulate(&model.build(&SLING3).unwrap(), settings, &TIMES).unwrap().impacts.len(), 1);
            let run = |b: &[f64]| simulate(&model.build(b).unwrap(), settings, &TIMES).unwrap().values;
            let exact: Vec<_> =
                (0..SLING3.len()).map(|k| extrapolated_differences(&SLING3, k, 1e-4 * SLING3[k], run)).collect();
            let direct = differentiate(&model, &SLING3, settings, &TIMES).unwrap();
            let worst = deviation(&direct.gradients, &SLING3, |output, p| exact.iter().map(|e| e[output][p]).collect());
            println!("{:?}, at a height {}, {:?}: {worst:.1e}", model.joint, model.at_height, settings.step);
            assert!(worst < 1e-7, "{worst:.1e}");
        }
    }
}

/// The derivatives of implicit steps converge to those of explicit ones with the second order.
#[test]
fn derivatives_through_a_release_in_space_converge() {
    for model in slings() {
        let exact = differentiate_explicitly(&model, &SLING3, &Explicit::eighth_order(1e-11), &TIMES).unwrap();
        let [coarse, fine] = [2e-3, 1e-3].map(|h| {
            let run = differentiate(&model, &SLING3, &Dynamics::fixed(h), &TIMES).unwrap();
            deviation(&exact.gradients, &SLING3, |output, p| run.gradients[output][p].clone())
        });
        println!("{:?}, at a height {}: {coarse:.1e} {fine:.1e}", model.joint, model.at_height);
        assert!(fine < 1e-3 && coarse > 3.0 * fine, "{coarse:.1e} {fine:.1e}");
    }
}

#[test]
fn methods_agree_through_a_release_in_space() {
    let times = [0.02, 0.2];
    for model in slings().step_by(3) {
        check_methods("sling in space", &model, &SLING3, &times);
        check_adjoint_by(&all_settings()[..2], ("sling in space", 1e-8), &model, &SLING3, &times);
        check_semi_analytical_by(&all_settings()[..2], ("sling in space", 1e-4), &model, &SLING3, &times);
    }
}
