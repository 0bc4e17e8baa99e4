//! Ropes and compliant contacts along explicit steps, which end where these become taut or slack, close or open.

use crate::derivative_methods::deviation;
use crate::finite_differences::extrapolated_differences;
use crate::models::{OnRope, ROPE, outputs};
use autodiff::{Scalar, gradient, hessian};
use linkwright_mechanics::analyses::dynamics::{replayed_steps, simulate_explicitly, simulate_with_steps};
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::second_order::{HessianPart, differentiate_explicitly_twice};
use linkwright_mechanics::integrators::explicit::{Explicit, Grading, ReplayedStep, StepControl};
use linkwright_mechanics::{Mechanism, ParametricMechanism, Result};

/// Position and velocity of the mass on a rope at the time `t`, through all phases of the periodic motion.
fn bouncing_on_rope<S: Scalar>(b: &[S], t: f64) -> [S; 2] {
    let [gravity, length, stiffness] = [b[0], b[1], b[2]];
    let start = S::from(1e-2);
    let fall = ((length - start) * 2.0 / gravity).sqrt();
    let (speed, rate, lowest) = (gravity * fall, stiffness.sqrt(), gravity / stiffness);
    let taut = (-(speed * rate / gravity).atan2(S::from(1.0)) + std::f64::consts::PI) * 2.0 / rate;
    let period = fall * 2.0 + taut;
    let phase = -period * (t / period.re()).floor() + t;
    if phase.re() > (fall + taut).re() {
        // It rises without the rope, and falls again.
        let before = -phase + period;
        return [-(start + gravity * before * before * 0.5), gravity * before];
    }
    if phase.re() < fall.re() {
        return [-(start + gravity * phase * phase * 0.5), -gravity * phase];
    }
    let (sin, cos) = (rate * (phase - fall)).sin_cos();
    let depth = length + lowest - lowest * cos + speed / rate * sin;
    [-depth, -(lowest * rate * sin + speed * cos)]
}

/// Output times, at the ends of steps and inside them.
const TIMES: [f64; 6] = [0.3, 0.5, 0.9, 1.3, 2.2, 3.0];

/// The derivatives of the force jump at the events: they must be those of the side on which a step lies.
#[test]
fn derivatives_through_a_rope_that_becomes_taut_and_slack_are_exact() {
    for settings in [Explicit::adaptive(1e-10), Explicit::eighth_order(1e-11)] {
        let direct = differentiate_explicitly(&OnRope, &ROPE, &settings, &TIMES).unwrap();
        let second = differentiate_explicitly_twice(&OnRope, &ROPE, &settings, &TIMES, HessianPart::Full).unwrap();
        for output in [0, 1] {
            for (k, &t) in TIMES.iter().enumerate() {
                let (value, slopes) = gradient(|b| bouncing_on_rope(b, t)[output], &ROPE);
                let curvatures = hessian(|b| bouncing_on_rope(b, t)[output], &ROPE).2;
                let off = |ours: &mut dyn Iterator<Item = f64>, exact: &[f64]| {
                    let size = exact.iter().fold(1.0f64, |all, x| all.max(x.abs()));
                    ours.zip(exact).fold(0.0f64, |all, (a, b)| all.max((a - b).abs())) / size
                };
                let ours = second.hessian(output, k).unwrap();
                let errors = [
                    (direct.values[output][k] - value).abs(),
                    off(&mut direct.gradients[output][k].iter().copied(), &slopes),
                    off(&mut second.gradient(output, k).iter().copied(), &slopes),
                    off(&mut ours.iter().copied(), curvatures.as_slice()),
                ];
                println!("{} {output} at {t}: {errors:?}", settings.method.name);
                let limits = [1e-7, 1e-7, 1e-7, 1e-5];
                assert!(errors.iter().zip(limits).all(|(error, limit)| *error < limit), "{output} at {t}: {errors:?}");
            }
        }
        check_adjoint(&OnRope, &ROPE, &settings);
    }
}

fn check_adjoint<M: ParametricMechanism>(model: &M, b: &[f64], settings: &Explicit) {
    let direct = differentiate_explicitly(model, b, settings, &TIMES).unwrap();
    let all: Vec<AdjointFunctional> = (0..direct.names.len())
        .flat_map(|output| (0..TIMES.len()).map(move |point| AdjointFunctional::at(output, point)))
        .collect();
    let rows = differentiate_explicitly_backwards(model, b, settings, &TIMES, &all).unwrap();
    let adjoint = deviation(&direct.gradients, b, |output, point| {
        rows.row(output * TIMES.len() + point).iter().copied().collect()
    });
    assert!(adjoint < 1e-11, "{}: {adjoint:.1e}", settings.method.name);
}

/// A mass of 1 kg that falls on a bump stop of the stiffness b₀ and the damping b₁ from the height b₂, and hangs above on a rope with
/// damping. On the way back the force of the stop would pull: it ends before the contact opens.
struct Damped;

impl ParametricMechanism for Damped {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let mass = m.point_mass("mass", S::from(1.0), zero, b[2]);
        let ground = m.ground();
        m.bump_stop("stop", ground.y, mass.y, [b[0], b[1], zero]);
        m.rope("rope", ground.at(zero, S::from(1.0)), mass.origin(), [S::from(400.0), b[1], S::from(0.95)]);
        outputs(&mut m, mass.y)?;
        Ok(m)
    }
}

const DAMPED: [f64; 3] = [2000.0, 0.5, 0.9];

#[test]
fn derivatives_through_contacts_and_ropes_with_damping_are_differences() {
    for settings in [Explicit::adaptive(1e-10), Explicit::eighth_order(1e-11)] {
        check_adjoint(&Damped, &DAMPED, &settings);
        let direct = differentiate_explicitly(&Damped, &DAMPED, &settings, &TIMES).unwrap();
        let values = |b: &[f64]| {
            let exact = Explicit::eighth_order(1e-13);
            simulate_explicitly(&Damped.build(b).unwrap(), &exact, &TIMES).unwrap().values
        };
        for variable in 0..DAMPED.len() {
            let differences = extrapolated_differences(&DAMPED, variable, 2e-5 * DAMPED[variable], values);
            for output in [0, 1] {
                for k in 0..TIMES.len() {
                    let expected = differences[output][k] * DAMPED[variable];
                    let ours = direct.gradients[output][k][variable] * DAMPED[variable];
                    let off = (ours - expected).abs() / expected.abs().max(1.0);
                    println!("{} {output} at {} by {variable}: {ours:.6e}, {off:.1e}", settings.method.name, TIMES[k]);
                    assert!(off < 1e-4, "{output} at {} by {variable}: {ours} {expected}", TIMES[k]);
                }
            }
        }
    }
}

/// A ball of 1 kg that bounces on a compliant floor with the stiffness b₀ and the damping b₁, from the height b₂.
struct Bouncing;

impl ParametricMechanism for Bouncing {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let ball = m.point_mass("ball", S::from(1.0), zero, b[2]);
        let ground = m.ground();
        m.bump_stop("floor", ground.y, ball.y, [b[0], b[1], zero]);
        outputs(&mut m, ball.y)?;
        Ok(m)
    }
}

const BOUNCING: [f64; 3] = [1e5, 0.1, 1.0];

/// The force begins and ends with the power 3/2 of the depth, its derivatives with the power 1/2: steps that are not graded there lost four
/// digits of the derivatives with respect to the stiffness, and did not become better with the tolerance.
#[test]
fn derivatives_through_compliant_contacts_become_better_with_the_tolerance() {
    let values = |b: &[f64]| {
        let exact = Explicit::eighth_order(1e-14);
        simulate_explicitly(&Bouncing.build(b).unwrap(), &exact, &TIMES).unwrap().values
    };
    let differences: Vec<_> = (0..BOUNCING.len())
        .map(|variable| extrapolated_differences(&BOUNCING, variable, 2e-4 * BOUNCING[variable], values))
        .collect();
    let orders = [
        (Explicit::adaptive as fn(f64) -> Explicit, [(1e-8, 1e-3), (1e-10, 1e-4), (1e-11, 3e-5)]),
        (Explicit::eighth_order, [(1e-8, 6e-4), (1e-10, 3e-5), (1e-12, 2e-6)]),
    ];
    for (method, limits) in orders {
        for (tolerance, limit) in limits {
            let settings = method(tolerance);
            let direct = differentiate_explicitly(&Bouncing, &BOUNCING, &settings, &TIMES).unwrap();
            let second =
                differentiate_explicitly_twice(&Bouncing, &BOUNCING, &settings, &TIMES, HessianPart::Full).unwrap();
            let mut largest = 0.0f64;
            for (output, k, variable) in (0..12).flat_map(|i| (0..3).map(move |j| (i % 2, i / 2, j))) {
                let expected = differences[variable][output][k] * BOUNCING[variable];
                for slopes in [&direct.gradients[output][k][..], &second.gradient(output, k)] {
                    let off = (slopes[variable] * BOUNCING[variable] - expected).abs() / expected.abs().max(1e-3);
                    largest = largest.max(off);
                }
            }
            println!("{} {tolerance:e}: {largest:.1e}", settings.method.name);
            assert!(largest < limit, "{} {tolerance:e}: {largest:.1e}", settings.method.name);
            check_adjoint(&Bouncing, &BOUNCING, &settings);
        }
    }
}

/// First derivatives are those of the frozen steps, also where these are coarse: motions by steps of their own have others, by 1e-1. A stage
/// is where the contact begins: differences have an error with the square root of their step.
#[test]
fn derivatives_through_contacts_are_those_of_the_taken_steps() {
    for settings in [Explicit::adaptive(1e-5), Explicit::eighth_order(1e-6)] {
        check_taken_steps(&OnRope, &ROPE, &settings, 1e-5);
        check_taken_steps(&Damped, &DAMPED, &settings, 1e-3);
        check_taken_steps(&Bouncing, &BOUNCING, &settings, 1e-3);
    }
}

fn check_taken_steps<M: ParametricMechanism>(model: &M, b: &[f64], settings: &Explicit, limit: f64) {
    let mechanism = model.build(b).unwrap();
    let taken = replayed_steps(&mechanism, settings, &TIMES).unwrap();
    let frozen = settings.clone().with_step_control(StepControl::Taken(taken));
    let values = |b: &[f64]| simulate_explicitly(&model.build(b).unwrap(), &frozen, &TIMES).unwrap().values;
    assert_eq!(values(b), simulate_explicitly(&mechanism, settings, &TIMES).unwrap().values);
    let direct = differentiate_explicitly(model, b, settings, &TIMES).unwrap();
    for variable in 0..b.len() {
        let [above, below] = [2e-9, -2e-9].map(|by| {
            let mut b = b.to_vec();
            b[variable] *= 1.0 + by;
            values(&b)
        });
        for (output, k) in (0..2 * TIMES.len()).map(|i| (i % 2, i / 2)) {
            let expected = (above[output][k] - below[output][k]) / 4e-9;
            let slope = direct.gradients[output][k][variable] * b[variable];
            let off = (slope - expected).abs() / expected.abs().max(1.0);
            println!("{} {output} at {} by {variable}: {slope:.6e}, {off:.1e}", settings.method.name, TIMES[k]);
            assert!(off < limit, "{output} at {} by {variable}: {slope} {expected}", TIMES[k]);
        }
    }
}

/// A step has one side for each switching function.
#[test]
fn taken_steps_of_another_model_are_rejected() {
    let step = ReplayedStep { length: 3.0, sides: vec![true], grading: Grading::Even };
    let settings = Explicit::adaptive(1e-6).with_step_control(StepControl::Taken(vec![step]));
    let error = simulate_explicitly(&Damped.build(&DAMPED).unwrap(), &settings, &TIMES).unwrap_err();
    let message = "a step has the sides of 1 switching functions, the mechanism 4";
    assert!(error.to_string().contains(message), "{error}");
}

/// Steps of the whole motion up to an earlier time have the same bits, also where contacts and ropes end them.
#[test]
fn steps_up_to_an_earlier_time_are_those_of_the_whole_motion() {
    for settings in [Explicit::adaptive(1e-7), Explicit::eighth_order(1e-9)] {
        let mechanism = Damped.build(&DAMPED).unwrap();
        let (whole, steps) = simulate_with_steps(&mechanism, &settings, &TIMES).unwrap();
        let (part, first) = simulate_with_steps(&mechanism, &settings.clone().with_end(TIMES[5]), &TIMES[..3]).unwrap();
        assert_eq!(first, steps[..first.len()]);
        (0..whole.values.len()).for_each(|k| assert_eq!(part.values[k], whole.values[k][..3]));
    }
}
