//! Events by a condition: closed forms with derivatives of first and second order, and rejected ones.

use crate::zoo::fixed;
use linkwright::Result;
use linkwright::autodiff::{Scalar, gradient, hessian};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::second_order::{HessianPart, differentiate_twice};
use linkwright::mechanics::events::Action;
use linkwright::mechanics::mechanism::{Formula, Mechanism, ParametricMechanism};
use linkwright::mechanics::motion::Fixed;

/// A weighted sum of quantities and of the time: Σ wᵢ xᵢ + w t + c.
struct Linear(Vec<f64>, f64, f64);

impl Formula for Linear {
    fn value<T: Scalar>(&self, t: T, x: &[T]) -> T {
        x.iter().zip(&self.0).fold(t * self.1 + self.2, |sum, (x, w)| sum + *x * *w)
    }
}

/// Time.
fn time() -> Linear {
    Linear(vec![], 1.0, 0.0)
}

/// A bob of 2 kg on a string of the length b₀ that starts at rest at the angle b₁ from the vertical, under the gravity b₂. The
/// string lets go where the bob is b₃ to the right of the pivot. The motion ends b₄ below the pivot.
struct Sling;

const SLING: [f64; 5] = [1.3, -1.2, 9.81, 0.6, 2.1];

impl ParametricMechanism for Sling {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[2]);
        let (sin, cos) = b[1].sin_cos();
        let bob = m.point_mass("bob", S::from(2.0), b[0] * sin, -b[0] * cos);
        let ground = m.ground();
        let string = m.distance_constraint("string", ground.origin(), bob.origin(), b[0]);
        let sensor = m.sensor("motion", bob.origin());
        let [x, y] = ["x", "y"].map(|what| m.measure(sensor, what));
        let (x, y) = (x?, y?);
        let fixed = m.sensor("limits", ground.at(b[3], b[4]));
        let [right, low] = ["x", "y"].map(|what| m.measure(fixed, what));
        let let_go =
            m.when("release", Linear(vec![1.0, -1.0], 0.0, 0.0), &[x, right?], &[Action::Deactivate(string)])?;
        let landing = m.when("landing", Linear(vec![-1.0, -1.0], 0.0, 0.0), &[y, low?], &[Action::Terminate])?;
        m.output("x", &[x]);
        m.output("range", &[x]);
        m.hold_output(landing);
        m.output_formula("duration", time(), &[]);
        m.hold_output(landing);
        m.output("release height", &[y]);
        m.hold_output(let_go);
        let tension = m.measure(string, "tension")?;
        m.output("tension", &[tension]);
        Ok(m)
    }
}

/// Range at the landing and height at the release in closed form.
fn sling<S: Scalar>(b: &[S]) -> [S; 2] {
    let sin = b[3] / b[0];
    let cos = (-(sin * sin) + 1.0).sqrt();
    let speed = (b[2] * b[0] * 2.0 * (cos - b[1].cos())).sqrt();
    let (vx, vy, height) = (speed * cos, speed * sin, -b[0] * cos);
    let drop = height + b[4];
    let flight = (vy + (vy * vy + b[2] * drop * 2.0).sqrt()) / b[2];
    [b[3] + vx * flight, height]
}

#[test]
fn a_sling_that_lets_go_and_lands_in_closed_form() {
    let times = [0.1, 0.3, 2.0, 3.0];
    let settings = fixed(5e-4);
    let first = differentiate(&Sling, &SLING, &settings, &times).unwrap();
    let second = differentiate_twice(&Sling, &SLING, &settings, &times, HessianPart::Full).unwrap();
    let history = simulate(&Sling.build(&SLING).unwrap(), &settings, &times).unwrap();
    assert_eq!(history.values, first.values);
    let names: Vec<&str> = history.impacts.iter().map(|event| &event.contact[..]).collect();
    assert_eq!(names, ["release", "landing"]);
    let last = times.len() - 1;
    assert_eq!(first.values[2][last], history.impacts[1].t);
    assert!(first.values[4][last].abs() < 1e-9, "a string that has let go is without tension");
    // After the landing all outputs keep their values.
    (0..5).for_each(|output| assert_eq!(first.values[output][2], first.values[output][3]));
    assert_eq!(first.values[0][last], first.values[1][last]);
    for (output, exact) in [(1, 0), (3, 1)] {
        let (value, derivatives) = gradient(|b| sling(b)[exact], &SLING);
        let curvature = hessian(|b| sling(b)[exact], &SLING).2;
        let close = |a: f64, b: f64, error: f64| (a - b).abs() < error * b.abs().max(1.0);
        assert!(close(first.values[output][last], value, 1e-5), "{output}: {} {value}", first.values[output][last]);
        for i in 0..SLING.len() {
            let ours = first.gradients[output][last][i];
            assert!(close(ours, derivatives[i], 2e-4), "{output} by {i}: {ours} {}", derivatives[i]);
            let gradient = |change: f64| {
                let mut b = SLING;
                b[i] += change;
                differentiate(&Sling, &b, &settings, &times).unwrap().gradients[output][last].clone()
            };
            let (above, below) = (gradient(1e-5), gradient(-1e-5));
            for j in 0..SLING.len() {
                // Exact for these steps, and of first order in their length.
                let ours = second.hessian(output, last).unwrap()[(i, j)];
                let theirs = (above[j] - below[j]) / 2e-5;
                assert!(close(ours, theirs, 1e-4), "{output} by {i} {j}: {ours} {theirs}");
                assert!(close(ours, curvature[(i, j)], 2e-3), "{output} by {i} {j}: {ours} {}", curvature[(i, j)]);
            }
        }
    }
    // The time of the landing, by central differences of the analysis.
    for i in 0..SLING.len() {
        let at = |change: f64| {
            let mut b = SLING;
            b[i] += change;
            simulate(&Sling.build(&b).unwrap(), &settings, &times).unwrap().values[2][last]
        };
        let (ours, theirs) = (first.gradients[2][last][i], (at(1e-5) - at(-1e-5)) / 2e-5);
        assert!((ours - theirs).abs() < 1e-7, "{i}: {ours} {theirs}");
    }
}

/// A mass b₀ that a thrust b₁ accelerates from the place b₂ on, until the time b₃. The thrust is active between two events.
struct Thrust;

impl ParametricMechanism for Thrust {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", b[0], zero, zero);
        m.set_velocity(mass.x, S::from(2.0));
        let ground = m.ground();
        let thrust = m.load("thrust", ground.x, mass.x, Fixed, &[b[1]]);
        let sensor = m.sensor("motion", mass.origin());
        let x = m.measure(sensor, "x")?;
        let limits = m.sensor("limits", ground.at(b[2], b[3]));
        let (begin, end) = (m.measure(limits, "x")?, m.measure(limits, "y")?);
        m.when("begin", Linear(vec![1.0, -1.0], 0.0, 0.0), &[x, begin], &[Action::Activate(thrust)])?;
        m.when("end", Linear(vec![-1.0], 1.0, 0.0), &[end], &[Action::Deactivate(thrust)])?;
        m.output("x", &[x]);
        let force = m.measure(thrust, "generalized_force")?;
        m.output("force", &[force]);
        Ok(m)
    }
}

#[test]
fn a_force_between_two_events_in_closed_form() {
    fn place<S: Scalar>(b: &[S], t: f64) -> S {
        let (begin, a) = (b[2] * 0.5, b[1] / b[0]);
        let burn = b[3] - begin;
        burn * burn * a * 0.5 + burn * a * (-b[3] + t) + 2.0 * t
    }
    let (b, times) = ([1.3, 2.9, 0.61, 0.805], [0.3, 0.5, 1.1]);
    for settings in [fixed(0.01), fixed(0.013), Dynamics::adaptive(1e-5)] {
        let first = differentiate(&Thrust, &b, &settings, &times).unwrap();
        let (value, derivatives) = gradient(|b| place(b, 1.1), &b);
        assert!((first.values[0][2] - value).abs() < 1e-9, "{} {value}", first.values[0][2]);
        for (ours, exact) in first.gradients[0][2].iter().zip(derivatives) {
            assert!((ours - exact).abs() < 1e-8, "{settings:?}: {ours} {exact}");
        }
        assert_eq!(first.values[1], [0.0, 2.9, 0.0]);
    }
}

#[test]
fn an_event_that_does_not_happen_is_an_error_of_its_outputs_and_else_a_warning() {
    let mut far = SLING;
    far[4] = 100.0;
    let error = simulate(&Sling.build(&far).unwrap(), &fixed(1e-3), &[1.0]).unwrap_err().to_string();
    assert!(error.contains("landing") && error.contains("not happened") && error.contains("t = 1 s"), "{error}");
    let history = simulate(&Thrust.build(&[1.0, 1.0, 50.0, 0.5]).unwrap(), &fixed(1e-2), &[1.0]).unwrap();
    assert!(history.warnings.iter().any(|warning| warning.contains("begin")), "{:?}", history.warnings);
}

/// Two loads that end at the times b₀ and b₁.
struct TwoEnds;

impl ParametricMechanism for TwoEnds {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", one, zero, zero);
        let ground = m.ground();
        for (k, end) in b.iter().enumerate() {
            let load = m.load(&format!("load{k}"), ground.x, mass.x, Fixed, &[one]);
            let limit = m.sensor("limit", ground.at(*end, zero));
            let limit = m.measure(limit, "x")?;
            m.when(format!("end{k}"), Linear(vec![-1.0], 1.0, 0.0), &[limit], &[Action::Deactivate(load)])?;
        }
        let sensor = m.sensor("motion", mass.origin());
        let x = m.measure(sensor, "x")?;
        m.output("x", &[x]);
        Ok(m)
    }
}

#[test]
fn two_events_at_one_time_both_happen_and_have_no_derivative() {
    let b = [0.4, 0.4];
    let history = simulate(&TwoEnds.build(&b).unwrap(), &fixed(0.013), &[1.0]).unwrap();
    assert!((history.values[0][0] - 2.0 * (0.5 * 0.16 + 0.4 * 0.6)).abs() < 1e-9, "{:?}", history.values);
    assert_eq!(history.impacts.len(), 2);
    let error = differentiate(&TwoEnds, &b, &fixed(0.013), &[1.0]).unwrap_err().to_string();
    assert!(error.contains("same time") && error.contains("no derivative"), "{error}");
}

#[test]
fn what_events_cannot_do_is_said() {
    let mut m = Mechanism::<f64>::new();
    let [a, b] = [0.0, 1.0].map(|x| m.point_mass("mass", 1.0, x, 0.0));
    let joint = m.distance_constraint("bar", a.origin(), b.origin(), 1.0);
    let error = m.when("grip", time(), &[], &[Action::Activate(joint)]).unwrap_err().to_string();
    assert!(error.contains("grip") && error.contains("bar") && error.contains("impact"), "{error}");
    let energy = m.kinetic_energy();
    let error = m.when("fast", Linear(vec![1.0], 0.0, -1.0), &[energy], &[]).unwrap_err().to_string();
    assert!(error.contains("fast") && error.contains("energy"), "{error}");
}
