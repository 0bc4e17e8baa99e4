//! Impacts: closed forms, conservation, derivatives, rejected mechanisms.

use crate::zoo::fixed;
use linkwright::Result;
use linkwright::autodiff::{Scalar, gradient, hessian};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate, simulate_explicitly};
use linkwright::mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_backwards};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::second_order::{HessianPart, differentiate_twice};
use linkwright::mechanics::derivatives::semi_analytical::{STEP, differentiate_semi_analytically};
use linkwright::mechanics::elements::{Driver, Element, ElementState, Revolute};
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::{Fixed, Harmonic};

/// A ball dropped from the height b₀ under the gravity b₁, with the coefficient of restitution b₂.
struct Ball;

impl ParametricMechanism for Ball {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let mut m = Mechanism::with_gravity(S::from(0.0), -b[1]);
        let ball = m.point_mass("ball", S::from(0.3), S::from(0.0), b[0]);
        let floor = m.ground().y;
        m.rigid_stop("floor", floor, ball.y, S::from(0.0), b[2]);
        let height = m.coordinate_sensor("height", floor, ball.y);
        for what in ["position", "velocity"] {
            let term = m.measure(height, what)?;
            m.output(what, &[term]);
        }
        Ok(m)
    }
}

/// Height and velocity of the ball at the time `t` after `bounces` impacts.
fn flight<S: Scalar>(b: &[S], t: f64, bounces: i32) -> [S; 2] {
    let (fall, mut speed) = ((b[0] * 2.0 / b[1]).sqrt(), (b[0] * b[1] * 2.0).sqrt());
    if bounces == 0 {
        return [b[0] - b[1] * (0.5 * t * t), -b[1] * t];
    }
    let mut since = -fall + t;
    for k in 1..=bounces {
        speed *= b[2];
        if k < bounces {
            since -= speed * 2.0 / b[1];
        }
    }
    [speed * since - b[1] * since * since * 0.5, speed - b[1] * since]
}

const BALL: [f64; 3] = [1.0, 9.81, 0.7];

#[test]
fn a_bouncing_ball_and_its_derivatives_in_closed_form() {
    // Before the first impact, after one, two and three, never at the time of one.
    let times = [0.3, 0.6, 1.3, 1.7];
    for settings in [fixed(0.01), fixed(0.037), Dynamics::adaptive(1e-4)] {
        let first = differentiate(&Ball, &BALL, &settings, &times).unwrap();
        let second = differentiate_twice(&Ball, &BALL, &settings, &times, HessianPart::Full).unwrap();
        for (p, (&t, bounces)) in times.iter().zip(0..).enumerate() {
            for output in 0..2 {
                let (value, derivatives) = gradient(|b| flight(b, t, bounces)[output], &BALL);
                let curvature = hessian(|b| flight(b, t, bounces)[output], &BALL).2;
                let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * b.abs().max(1.0);
                assert!(close(first.values[output][p], value), "{t}: {} {value}", first.values[output][p]);
                for i in 0..3 {
                    let ours = first.gradients[output][p][i];
                    assert!(close(ours, derivatives[i]), "{t} {output} by {i}: {ours} {}", derivatives[i]);
                    for j in 0..3 {
                        let ours = second.hessian(output, p).unwrap()[(i, j)];
                        assert!(close(ours, curvature[(i, j)]), "{t} {output} {i} {j}: {ours} {}", curvature[(i, j)]);
                    }
                }
            }
        }
    }
}

#[test]
fn a_history_has_the_times_and_contacts_of_impacts() {
    let history = simulate(&Ball.build(&BALL).unwrap(), &fixed(0.01), &[1.4]).unwrap();
    let fall = (2.0f64 / 9.81).sqrt();
    assert_eq!(history.impacts.len(), 2);
    for (impact, t) in history.impacts.iter().zip([fall, fall * (1.0 + 2.0 * 0.7)]) {
        assert!(impact.contact == "floor" && (impact.t - t).abs() < 1e-12, "{impact:?} {t}");
    }
}

/// Two hinged bars hanging from a shaken pivot, the lower one near an inclined wall.
///
/// Design: mass, inertia and half length of both bars, position and angle of the wall, restitution, amplitude and frequency of
/// the pivot.
struct DoublePendulum;

const BARS: [f64; 9] = [1.2, 0.05, 0.35, -0.9, 1.45, 0.6, 0.06, 3.0, 9.81];

impl ParametricMechanism for DoublePendulum {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[8]);
        let pivot = m.massless_node("pivot", Pose { x: zero, y: zero, theta: zero });
        m.drive(pivot.x, Harmonic, &[zero, b[6], b[7], zero]);
        m.fix(pivot.y);
        m.fix(pivot.theta);
        let angle = S::from(-0.3);
        let (sin, cos) = angle.sin_cos();
        let upper = m.body("upper", b[0], b[1], Pose { x: b[2] * cos, y: b[2] * sin, theta: angle });
        let lower = m.body("lower", b[0], b[1], Pose { x: b[2] * cos * 3.0, y: b[2] * sin * 3.0, theta: angle });
        m.add("hinge", Revolute, &[pivot.coordinates(), upper.coordinates()].concat(), &[zero, zero, -b[2], zero]);
        m.revolute("knee", upper.at(b[2], zero), lower.at(-b[2], zero));
        let ground = m.ground();
        m.rigid_wall("wall", ground.at(b[3], zero), -b[4], lower.at(b[2], zero), b[5]);
        let sensor = m.coordinate_sensor("angle", ground.theta, lower.theta);
        let position = m.measure(sensor, "position")?;
        m.output("angle", &[position]);
        let (kinetic, potential) = (m.kinetic_energy(), m.potential_energy());
        m.output("energy", &[kinetic, potential]);
        Ok(m)
    }
}

#[test]
fn derivatives_through_impacts_of_a_double_pendulum_are_those_of_differences() {
    let (times, settings) = ([0.4, 0.8, 1.1], fixed(0.005));
    let history = differentiate(&DoublePendulum, &BARS, &settings, &times).unwrap();
    let plain = simulate(&DoublePendulum.build(&BARS).unwrap(), &settings, &times).unwrap();
    assert_eq!(history.values, plain.values);
    assert!(!plain.impacts.is_empty());
    let second = differentiate_twice(&DoublePendulum, &BARS, &settings, &times, HessianPart::Times(&BARS)).unwrap();
    let mut worst = [0.0f64; 2];
    for k in 0..BARS.len() {
        let step = 1e-4 * BARS[k];
        let at = |by: f64| {
            let mut moved = BARS;
            moved[k] += by;
            differentiate(&DoublePendulum, &moved, &settings, &times).unwrap()
        };
        let [ahead, behind, half_ahead, half_behind] = [step, -step, 0.5 * step, -0.5 * step].map(at);
        for output in 0..2 {
            for p in 0..times.len() {
                let of = |x: [f64; 4]| (4.0 * (x[2] - x[3]) / step - (x[0] - x[1]) / (2.0 * step)) / 3.0;
                let values = [&ahead, &behind, &half_ahead, &half_behind].map(|h| h.values[output][p]);
                let size: f64 = history.gradients[output][p].iter().zip(&BARS).map(|(s, b)| (s * b).abs()).sum();
                worst[0] = worst[0].max((of(values) - history.gradients[output][p][k]).abs() * BARS[k].abs() / size);
                let along = [&ahead, &behind, &half_ahead, &half_behind].map(|h| {
                    h.gradients[output][p].iter().zip(&BARS).map(|(derivative, b)| derivative * b).sum::<f64>()
                });
                let products = second.second_derivatives(output, p);
                let size: f64 = products.iter().zip(&BARS).map(|(s, b)| (s * b).abs()).sum();
                worst[1] = worst[1].max((of(along) - products[k]).abs() * BARS[k].abs() / size);
            }
        }
    }
    println!("through impacts: first {:.1e}, second {:.1e}", worst[0], worst[1]);
    assert!(worst[0] < 1e-7 && worst[1] < 1e-6, "{worst:?}");
}

#[test]
fn an_elastic_impact_keeps_the_energy() {
    let mut b = BARS;
    (b[5], b[6]) = (1.0, 0.0);
    let times: Vec<f64> = (1..=100).map(|k| 0.01 * f64::from(k)).collect();
    let history = simulate(&DoublePendulum.build(&b).unwrap(), &fixed(0.001), &times).unwrap();
    let energy = history.series("energy").unwrap();
    assert!(!history.impacts.is_empty());
    let drift = energy.iter().fold(0.0f64, |a, e| a.max((e - energy[0]).abs()));
    assert!(drift < 1e-3 * b[0] * b[8] * b[2], "{drift:.1e}");
}

/// Without restitution at the first impact, otherwise after infinitely many ones in a finite time.
#[test]
fn a_ball_comes_to_rest() {
    for restitution in [0.0, 0.5] {
        let ball = Ball.build(&[1.0, 9.81, restitution]).unwrap();
        let explicit = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(0.01));
        for history in [
            simulate(&ball, &fixed(0.01), &[3.0]).unwrap(),
            simulate_explicitly(&ball, &Explicit::adaptive(1e-6), &[3.0]).unwrap(),
            simulate_explicitly(&ball, &explicit, &[3.0]).unwrap(),
        ] {
            assert!(history.values.iter().all(|values| values[0].abs() < 1e-9), "{:?}", history.values);
            assert!(restitution > 0.0 || history.impacts.len() == 1, "{:?}", history.impacts);
        }
    }
}

#[test]
fn impossible_contacts_and_analyses_are_rejected() {
    let message = |b: &[f64], settings: Dynamics, end: f64| {
        Ball.build(b).and_then(|m| simulate(&m, &settings, &[end])).unwrap_err().to_string()
    };
    let closed = message(&[-1.0, 9.81, 0.5], fixed(0.01), 2.0);
    assert!(closed.contains("starts") && closed.contains("open"), "{closed}");
    let lively = message(&[1.0, 9.81, 1.5], fixed(0.01), 2.0);
    assert!(lively.contains("restitution is 1.5"), "{lively}");
    let (model, b) = (Pushed { by_time: true }, [1.3, 2.0, -1.7, 0.5]);
    let mechanism = model.build(&b).unwrap();
    let explicit = simulate_explicitly(&mechanism, &Explicit::adaptive(1e-6), &[1.0]).unwrap_err().to_string();
    assert!(explicit.contains("begin") && explicit.contains("both sides"), "{explicit}");
    let switch = differentiate_semi_analytically(&model, &b, &fixed(0.01), &[0.9], STEP).unwrap_err().to_string();
    assert!(switch.contains("begin") && switch.contains("across the jump"), "{switch}");
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground().coordinates();
    let twice = m.impact("pin", Revolute, &[ground, ground].concat(), &[0.0; 4], 0.5).unwrap_err().to_string();
    assert!(twice.contains("2 constraints"), "{twice}");
}

/// A force p₀ along a coordinate after the time p₁, or beyond the position p₁.
struct Push {
    by_time: bool,
}

impl Element for Push {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _: &mut [T]) {
        if if self.by_time { x.t } else { x.q[0] } > x.p[1] {
            dynamics[0] = -x.p[0];
        }
    }
}

/// A mass b₀ with the velocity b₁, accelerated by the force b₂ after the time or beyond the position b₃.
struct Pushed {
    by_time: bool,
}

impl ParametricMechanism for Pushed {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", b[0], zero, zero);
        m.set_velocity(mass.x, b[1]);
        m.add("push", Push { by_time: self.by_time }, &[mass.x], &[b[2], b[3]]);
        let ground = m.ground().x;
        match self.by_time {
            true => m.switch_at("begin", b[3]),
            false => m.switch("edge", Driver(Fixed), &[ground, mass.x], &[b[3]])?,
        }
        let place = m.coordinate_sensor("place", ground, mass.x);
        let position = m.measure(place, "position")?;
        m.output("position", &[position]);
        Ok(m)
    }
}

#[test]
fn forces_switched_by_time_or_position_in_closed_form() {
    // The switch at a time of the grid, and between two of them.
    for (by_time, at) in [(true, 0.5), (true, 0.503), (false, 1.0), (false, 1.017)] {
        let (b, t) = ([1.3, 2.0, -1.7, at], 0.9);
        fn place<S: Scalar>(b: &[S], t: f64, by_time: bool) -> S {
            let since = -if by_time { b[3] } else { b[3] / b[1] } + t;
            b[1] * t + b[2] / b[0] * since * since * 0.5
        }
        let (value, derivatives) = gradient(|b| place(b, t, by_time), &b);
        let curvature = hessian(|b| place(b, t, by_time), &b).2;
        for settings in [fixed(0.01), Dynamics::adaptive(1e-4)] {
            let model = Pushed { by_time };
            let first = differentiate(&model, &b, &settings, &[t]).unwrap();
            let second = differentiate_twice(&model, &b, &settings, &[t], HessianPart::Full).unwrap();
            // Forces after the switch are evaluated a millionth of a step beyond it, an error of that part of a step.
            let close = |a: f64, b: f64| (a - b).abs() < 1e-7;
            let wanted = [AdjointFunctional::at(0, 0)];
            let adjoint = differentiate_backwards(&model, &b, &settings, &[t], &wanted).unwrap();
            assert!(adjoint.iter().zip(&derivatives).all(|(a, b)| close(*a, *b)), "{adjoint} {derivatives:?}");
            assert!(close(first.values[0][0], value), "{by_time} {at}: {} {value}", first.values[0][0]);
            for i in 0..4 {
                let ours = first.gradients[0][0][i];
                assert!(close(ours, derivatives[i]), "{by_time} {at} by {i}: {ours} {}", derivatives[i]);
                for j in 0..4 {
                    let ours = second.hessian(0, 0).unwrap()[(i, j)];
                    assert!(close(ours, curvature[(i, j)]), "{by_time} {at} {i} {j}: {ours} {}", curvature[(i, j)]);
                }
            }
            let history = simulate(&model.build(&b).unwrap(), &settings, &[t]).unwrap();
            assert_eq!(history.impacts.len(), 1, "{:?}", history.impacts);
        }
    }
}

/// Two masses that fall from the heights b₀ and b₁ on a stop each.
struct Two;

impl ParametricMechanism for Two {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::new();
        for (k, &height) in b.iter().enumerate() {
            let mass = m.point_mass(&format!("mass{k}"), one, zero, height);
            let ground = m.ground().y;
            m.set_velocity(mass.y, -one);
            m.rigid_stop(&format!("stop{k}"), ground, mass.y, zero, S::from(0.5));
            let sensor = m.coordinate_sensor(&format!("place{k}"), ground, mass.y);
            let position = m.measure(sensor, "position")?;
            m.output(format!("position{k}"), &[position]);
        }
        Ok(m)
    }
}

/// Impacts on bodies that are not joined, at the same time or nearly so, are those of each body alone.
#[test]
fn impacts_at_the_same_time_have_an_end() {
    for settings in [fixed(0.01), fixed(0.013), Dynamics::adaptive(1e-6)] {
        let at = |b: [f64; 2]| simulate(&Two.build(&b).unwrap(), &settings, &[2.0]);
        for later in [0.0, 1e-12, 1e-9, 1e-7, 1e-4] {
            for b in [[1.0, 1.0 + later], [1.0 + later, 1.0]] {
                let history = at(b).unwrap();
                assert_eq!(history.impacts.len(), 2, "{later}");
                for (k, height) in b.iter().enumerate() {
                    let expected = 0.5 * (2.0 - height);
                    let found = history.values[k][0];
                    assert!((found - expected).abs() < 1e-9, "{later} {k}: {found} {expected}");
                }
            }
        }
    }
}
