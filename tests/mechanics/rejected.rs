//! An optimization rejects a trial design that cannot be analysed, for every kind of failure.

use crate::zoo::Brake;
use linkwright::autodiff::Scalar;
use linkwright::function;
use linkwright::mechanics::analyses::dynamics::Dynamics;
use linkwright::mechanics::elements::{BeamSection, Shear};
use linkwright::mechanics::mechanism::{Formula, Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::{ConstantSpeed, Motion};
use linkwright::problem::{DesignVariable, Problem, ProblemBuilder, Quantity, TimeGrid};
use linkwright::responses::mechanism::Transient;
use linkwright::sao::{Method, RunState, Stop};

/// Kinds of failures for design variables above 0.5.
#[derive(Clone, Copy, Debug)]
enum Flaw {
    Assembly,
    Mass,
    Section,
    Drive,
    Step,
    NanDrive,
    NanForce,
    NanExpression,
}

/// The root of 0.5 − b + 0·t.
struct Root;

impl Motion for Root {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        (-p[0] + 0.5).sqrt() + t * 0.0
    }
}

impl Formula for Root {
    fn value<T: Scalar>(&self, _t: T, x: &[T]) -> T {
        x[0] + (-x[0] + 0.5).sqrt() * 0.0
    }
}

/// A marker at b, whose position is maximized, and a mechanism that fails.
struct Flawed(Flaw);

impl Flawed {
    fn build_flaw<S: Scalar>(&self, m: &mut Mechanism<S>, b: S) {
        let (zero, one, ground) = (S::from(0.0), S::from(1.0), m.ground());
        match self.0 {
            Flaw::Assembly | Flaw::Drive => {
                let turn = 0.8f64;
                let pose = Pose { x: S::from(0.5 * turn.cos()), y: S::from(0.5 * turn.sin()), theta: S::from(turn) };
                let rod = m.body("rod", one, one, pose);
                m.revolute("pivot", ground.origin(), rod.at(S::from(-0.5), zero));
                let slider = m.point_mass("slider", one, S::from(turn.cos()), S::from(turn.sin()));
                m.revolute("pin", rod.at(S::from(0.5), zero), slider.origin());
                if matches!(self.0, Flaw::Assembly) {
                    // The distance of the guide is longer than the rod of 1 m.
                    m.point_on_line("guide", ground.at(zero, b * 2.0), zero, slider.origin());
                } else {
                    // The drive reaches this position within one second.
                    m.driver("drive", ground.x, slider.x, ConstantSpeed, &[S::from(turn.cos()), b * 2.0 - turn.cos()]);
                }
            }
            Flaw::Mass => {
                m.body("lump", -b + 0.5, one, Pose { x: zero, y: zero, theta: zero });
            }
            Flaw::Section => {
                let section = BeamSection::circular((-b + 0.5) * 0.1, 2e11, 0.3, 7800.0);
                let (nodes, _) = m.beam("arm", [[zero, zero], [one, zero]], [None, None], 2, &section, Shear::Flexible);
                nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
            }
            Flaw::Step => {
                let cart = m.coordinate("cart", S::from(0.1), zero);
                m.inertia("mass", cart, one);
                let push = if b.re() > 0.5 { S::from(1e6) } else { zero };
                m.feedback_force("brake", cart, &[cart], Brake, &[push]);
            }
            Flaw::NanDrive => {
                let cart = m.coordinate("cart", zero, zero);
                m.inertia("mass", cart, one);
                m.drive(cart, Root, &[b]);
            }
            Flaw::NanForce => {
                let cart = m.coordinate("cart", zero, zero);
                m.inertia("mass", cart, one);
                m.load("push", ground.x, cart, Root, &[b]);
            }
            Flaw::NanExpression => {}
        }
    }
}

impl ParametricMechanism for Flawed {
    fn build<S: Scalar>(&self, b: &[S]) -> linkwright::Result<Mechanism<S>> {
        let mut m = Mechanism::new();
        let marker = m.coordinate("marker", b[0], S::from(0.0));
        m.fix(marker);
        let sensor = m.coordinate_sensor("marker", m.ground().x, marker);
        let term = m.measure(sensor, "position")?;
        match self.0 {
            Flaw::NanExpression => m.output_formula("root", Root, &[term]),
            _ => m.output("position", &[term]),
        }
        self.build_flaw(&mut m, b[0]);
        Ok(m)
    }
}

fn problem(flaw: Flaw) -> Problem {
    let mut builder = ProblemBuilder::new("as far as it goes");
    builder.variable(DesignVariable::new("b", "-", 0.3).within(0.1, 1.0));
    let times = vec![0.5, 1.0];
    let time = builder.grid(TimeGrid::new("time", "s", times.clone()).unwrap());
    let position = builder.transient("position", "m", time);
    let far = function!(|p| p.response[0] * -0.5 + 2.0);
    builder.minimize("lack", "m", Quantity::sum(time, vec![1.0, 1.0], far).of(&[position]));
    builder.build(Transient::new(Flawed(flaw), Dynamics::fixed(0.05), &times).unwrap()).unwrap()
}

#[test]
fn every_failure_is_a_rejected_trial_step_with_its_reason() {
    let cases = [
        (Flaw::Assembly, "(constraint", "cannot be assembled at t = 0 s"),
        (Flaw::Mass, "lump", "mass is -"),
        (Flaw::Section, "arm element 1", "EA is -"),
        (Flaw::Drive, "pivot", "does not converge from t = "),
        (Flaw::Step, "brake", "does not converge from t = "),
        (Flaw::NanDrive, "cart", "its prescribed motion is NaN, NaN, NaN at t = "),
        (Flaw::NanForce, "push", "its forces are not finite at t = "),
        (Flaw::NanExpression, "root", "the output is NaN at t = "),
    ];
    for (flaw, name, reason) in cases {
        let problem = problem(flaw);
        let method = Method { stop: Stop { max_cycles: 12, ..Stop::default() }, ..Method::slp() };
        let state: RunState = method.solve(&problem, |_| ()).unwrap_or_else(|error| panic!("{flaw:?}: {error}"));
        let failed: Vec<_> = state.history.iter().filter(|cycle| cycle.failure.is_some()).collect();
        assert!(
            !failed.is_empty() && failed.iter().all(|cycle| !cycle.accepted && cycle.design[0] > 0.499),
            "{flaw:?}"
        );
        let message = failed[0].failure.as_deref().unwrap();
        assert!(message.contains(name) && message.contains(reason), "{flaw:?}: {message}");
        // The optimization continues from the last valid design with smaller steps.
        let last = state.history.iter().rfind(|cycle| cycle.accepted).unwrap();
        assert!(last.design[0] > 0.4 && last.design[0] <= 0.5, "{flaw:?}: {:?}", last.design);
        assert!(failed.windows(2).all(|pair| pair[1].factors[0] < pair[0].factors[0]), "{flaw:?}");
    }
}
