//! Switches at the same time, or nearly so: closed forms, derivatives, numbers of steps.

use crate::zoo::fixed;
use linkwright::Result;
use linkwright::autodiff::{Scalar, gradient, hessian};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::second_order::{HessianPart, differentiate_twice};
use linkwright::mechanics::elements::{Driver, Element, ElementState};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
use linkwright::mechanics::motion::Fixed;

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

/// A mass b₀ with the velocity b₁, accelerated by the force b₂ after the time or beyond the position b₄, and by the force b₃
/// after that of b₅ or, for five design variables, of b₄ as well.
struct TwoPushes {
    by_time: bool,
}

impl ParametricMechanism for TwoPushes {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", b[0], zero, zero);
        m.set_velocity(mass.x, b[1]);
        let ground = m.ground().x;
        for (k, at) in [b[4], b[b.len() - 1]].into_iter().enumerate() {
            m.add(format!("push{k}"), Push { by_time: self.by_time }, &[mass.x], &[b[2 + k], at]);
            match self.by_time {
                true => m.switch_at(&format!("begin{k}"), at),
                false => m.switch(format!("begin{k}"), Driver(Fixed), &[ground, mass.x], &[at])?,
            }
        }
        let place = m.coordinate_sensor("place", ground, mass.x);
        let position = m.measure(place, "position")?;
        m.output("position", &[position]);
        Ok(m)
    }
}

/// Position of the mass at the time `t` after both forces have begun.
fn place<S: Scalar>(b: &[S], t: f64, by_time: bool) -> S {
    let ([begin, end], [before, after]) = ([b[4], b[b.len() - 1]], [b[2] / b[0], (b[2] + b[3]) / b[0]]);
    if by_time {
        let [first, second] = [-begin + t, -end + t];
        return b[1] * t + (b[2] * first * first + b[3] * second * second) / b[0] * 0.5;
    }
    let (way, speed) = (end - begin, b[1]);
    let faster = (speed * speed + before * way * 2.0).sqrt();
    let since = -(begin / speed + way * 2.0 / (speed + faster)) + t;
    end + faster * since + after * since * since * 0.5
}

#[test]
fn two_switches_in_time_near_each_other_in_closed_form() {
    check_near_each_other([(true, 0.5), (true, 0.503)]);
}

#[test]
fn two_switches_in_position_near_each_other_in_closed_form() {
    check_near_each_other([(false, 1.0), (false, 1.017)]);
}

/// A mass b₀ with the velocity b₁ and, beyond the position b₃, the force b₂.
struct OnePush;

impl ParametricMechanism for OnePush {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", b[0], zero, zero);
        m.set_velocity(mass.x, b[1]);
        let ground = m.ground().x;
        m.add("push", Push { by_time: false }, &[mass.x], &b[2..4]);
        m.switch("begin", Driver(Fixed), &[ground, mass.x], &[b[3]])?;
        let place = m.coordinate_sensor("place", ground, mass.x);
        let position = m.measure(place, "position")?;
        m.output("position", &[position]);
        Ok(m)
    }
}

/// A step that ends shortly before the switch has a solution with the force and one without it if the force pushes across the
/// switch, and none if it pushes back. The event is at the switch: its time is exact, whatever the force.
#[test]
fn a_force_that_pushes_across_or_back_begins_at_its_switch() {
    for force in [-3.0, -0.1, 0.1, 2.0, 30.0, 1000.0] {
        for at in [1.0, 1.0004, 1.017, 1.0199] {
            for settings in [fixed(0.01), fixed(0.013), Dynamics::adaptive(1e-4)] {
                let (b, t) = ([1.3, 2.0, force, at], 0.6);
                let what = format!("{force} N at {at} m, {settings:?}");
                let history = simulate(&OnePush.build(&b).unwrap(), &settings, &[t]).unwrap();
                let [event] = &history.impacts[..] else { panic!("{what}: {:?}", history.impacts) };
                assert!((event.t - at / b[1]).abs() < 1e-12, "{what}: {} {}", event.t, at / b[1]);
                let place = |b: &[f64]| {
                    let since = t - b[3] / b[1];
                    b[1] * t + 0.5 * b[2] / b[0] * since * since
                };
                let size = place(&b).abs().max(1.0);
                let (found, closed) = (history.values[0][0], place(&b));
                assert!((found - closed).abs() < 1e-6 * size, "{what}: {found} {closed}");
            }
        }
    }
}

fn check_near_each_other(switches: [(bool, f64); 2]) {
    let t = 0.9;
    for (by_time, at) in switches {
        for later in [None, Some(1e-9), Some(1e-4)] {
            let mut b = vec![1.3, 2.0, -1.7, 2.9, at];
            b.extend(later.map(|later| at + later));
            let (value, derivatives) = gradient(|b| place(b, t, by_time), &b);
            let curvature = hessian(|b| place(b, t, by_time), &b).2;
            for settings in [fixed(0.01), fixed(0.013), Dynamics::adaptive(1e-4)] {
                let (model, what) = (TwoPushes { by_time }, format!("{by_time} {at} {later:?}"));
                let history = simulate(&model.build(&b).unwrap(), &settings, &[t]);
                let history = history.unwrap_or_else(|e| panic!("{what}, {settings:?}: {e}"));
                let mut names: Vec<&str> = history.impacts.iter().map(|event| &event.contact[..]).collect();
                if later.is_none() {
                    names.sort_unstable();
                }
                assert_eq!(names, ["begin0", "begin1"], "{what}");
                assert!(history.work.steps < 150, "{what}: {} steps", history.work.steps);
                // Forces after the switch are evaluated a millionth of a step beyond it.
                let close = |a: f64, b: f64| (a - b).abs() < 1e-6 * b.abs().max(1.0);
                assert!(close(history.values[0][0], value), "{what}: {} {value}", history.values[0][0]);
                let first = differentiate(&model, &b, &settings, &[t]).unwrap();
                let second = differentiate_twice(&model, &b, &settings, &[t], HessianPart::Full).unwrap();
                for i in 0..b.len() {
                    let ours = first.gradients[0][0][i];
                    assert!(close(ours, derivatives[i]), "{what} by {i}: {ours} {}", derivatives[i]);
                    for j in 0..b.len() {
                        let (ours, theirs) = (second.hessian(0, 0).unwrap()[(i, j)], curvature[(i, j)]);
                        assert!(close(ours, theirs), "{what} {i} {j}: {ours} {theirs}");
                    }
                }
            }
        }
    }
}

#[test]
fn switches_at_the_same_time_that_the_design_separates_have_no_derivative() {
    for by_time in [true, false] {
        let (model, b) = (TwoPushes { by_time }, [1.3, 2.0, -1.7, 2.9, 0.5, 0.5]);
        let history = simulate(&model.build(&b).unwrap(), &fixed(0.01), &[0.9]).unwrap();
        let expected = place(&b, 0.9, by_time);
        assert!((history.values[0][0] - expected).abs() < 1e-6, "{} {expected}", history.values[0][0]);
        assert!(history.work.steps < 100, "{} steps", history.work.steps);
        let error = differentiate(&model, &b, &fixed(0.01), &[0.9]).unwrap_err().to_string();
        assert!(error.contains("begin") && error.contains("same time") && error.contains("no derivative"), "{error}");
    }
}

/// A ball that falls on a rigid floor from the height b₀ with gravity b₁ and restitution b₂, pushed up by the force b₃ while it
/// rises, and counted by a switch at the floor: impact and switch are at the same time.
struct SwitchAtFloor;

impl ParametricMechanism for SwitchAtFloor {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        let mut m = Mechanism::with_gravity(zero, -b[1]);
        let ball = m.point_mass("ball", one, zero, b[0]);
        let floor = m.ground().y;
        m.rigid_stop("floor", floor, ball.y, zero, b[2]);
        m.switch("count", Driver(Fixed), &[floor, ball.y], &[zero])?;
        let sensor = m.coordinate_sensor("height", floor, ball.y);
        let position = m.measure(sensor, "position")?;
        m.output("position", &[position]);
        Ok(m)
    }
}

#[test]
fn a_switch_at_a_rigid_contact_in_closed_form() {
    fn height<S: Scalar>(b: &[S], t: f64) -> S {
        let since = -(b[0] * 2.0 / b[1]).sqrt() + t;
        (b[0] * b[1] * 2.0).sqrt() * b[2] * since - b[1] * since * since * 0.5
    }
    let (b, t) = ([1.0, 9.81, 0.7], 0.8);
    let (value, derivatives) = gradient(|b| height(b, t), &b);
    for settings in [fixed(0.01), fixed(0.013), Dynamics::adaptive(1e-5)] {
        let first = differentiate(&SwitchAtFloor, &b, &settings, &[t]).unwrap();
        let work = simulate(&SwitchAtFloor.build(&b).unwrap(), &settings, &[t]).unwrap().work;
        assert!(work.steps < 300, "{} steps", work.steps);
        assert!((first.values[0][0] - value).abs() < 1e-7, "{} {value}", first.values[0][0]);
        for i in 0..b.len() {
            assert!(
                (first.gradients[0][0][i] - derivatives[i]).abs() < 1e-6,
                "{i}: {:?} {derivatives:?}",
                first.gradients
            );
        }
    }
}
