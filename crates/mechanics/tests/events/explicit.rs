//! Events along explicit steps: values and derivatives against exact solutions, second derivatives against differences.

use crate::derivative_methods::deviation;
use crate::finite_differences::extrapolated_differences;
use crate::models::{
    BARS, BOUNCING, Bouncing, DoublePendulum, OnRope, PUSHED, Pushed, ROPE, SLING, Sling, bouncing, on_rope, pushed,
    sling,
};
use autodiff::{gradient, hessian};
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::second_order::{HessianPart, differentiate_explicitly_twice};
use linkwright_mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright_mechanics::{Dynamics, ParametricMechanism};

/// Both methods, with fixed and adaptive steps. Some of the fixed steps are so long that a contact closes and opens within one.
fn all_settings() -> [Explicit; 6] {
    let fixed = |h: f64| StepControl::Fixed(h);
    [
        Explicit::adaptive(1e-6).with_step_control(fixed(0.002)),
        Explicit::eighth_order(1e-6).with_step_control(fixed(0.01)),
        Explicit::eighth_order(1e-6).with_step_control(fixed(0.0173)),
        Explicit::adaptive(1e-11),
        Explicit::eighth_order(1e-11),
        Explicit::eighth_order(1e-12),
    ]
}

/// Largest errors of values, first and second derivatives that are allowed. Second derivatives of adaptive steps contain the
/// variation of the discretization error from step to step.
const LIMITS: [f64; 3] = [1e-9, 1e-8, 1e-6];

pub fn check<M: ParametricMechanism>(
    (model, end): (&M, f64),
    b: &[f64],
    outputs: &[usize],
    exact: impl Fn(usize) -> (f64, Vec<f64>, Vec<f64>),
) {
    for settings in all_settings() {
        let first = differentiate_explicitly(model, b, &settings, &[end]).unwrap();
        let simulated = simulate_explicitly(&model.build(b).unwrap(), &settings, &[end]).unwrap();
        let second = differentiate_explicitly_twice(model, b, &settings, &[end], HessianPart::Full).unwrap();
        assert!(!simulated.impacts.is_empty());
        for (k, &output) in outputs.iter().enumerate() {
            let (value, slopes, curvatures) = exact(k);
            let hessian = second.hessian(output, 0).unwrap();
            let largest = |ours: &[f64], exact: &[f64]| {
                let size = exact.iter().fold(1.0f64, |all, x| all.max(x.abs()));
                ours.iter().zip(exact).fold(0.0f64, |all, (a, b)| all.max((a - b).abs())) / size
            };
            let errors = [
                largest(&[simulated.values[output][0]], &[value]),
                largest(&first.gradients[output][0], &slopes),
                largest(hessian.as_slice(), &curvatures),
            ];
            println!("{} {:?}: {errors:?}", settings.method.name, settings.step_control);
            assert!(errors.iter().zip(LIMITS).all(|(error, limit)| *error < limit), "{settings:?}: {errors:?}");
            assert_eq!(simulated.values[output], first.values[output]);
        }
    }
}

/// Time in s at which the motions are compared: after one event.
const END: f64 = 0.9;

#[test]
fn derivatives_through_an_impact_are_exact() {
    check((&Bouncing, END), &BOUNCING, &[0, 1], |k| {
        let (value, slopes) = gradient(|b| bouncing(b, END)[k], &BOUNCING);
        (value, slopes, hessian(|b| bouncing(b, END)[k], &BOUNCING).2.iter().copied().collect())
    });
}

#[test]
fn derivatives_through_a_switched_force_are_exact() {
    check((&Pushed, END), &PUSHED, &[0, 1], |k| {
        let (value, slopes) = gradient(|b| pushed(b, END)[k], &PUSHED);
        (value, slopes, hessian(|b| pushed(b, END)[k], &PUSHED).2.iter().copied().collect())
    });
}

#[test]
fn derivatives_through_a_joint_that_lets_go_are_exact() {
    check((&Sling, 3.0), &SLING, &[0, 2], |k| {
        let (value, slopes) = gradient(|b| sling(b)[k], &SLING);
        (value, slopes, hessian(|b| sling(b)[k], &SLING).2.iter().copied().collect())
    });
}

/// Adaptive steps end where the rope becomes taut. The force is continuous there, and its derivatives are not.
#[test]
fn second_derivatives_through_a_rope_that_becomes_taut_are_exact() {
    let (end, outputs) = (0.5, [0, 1]);
    for settings in [Explicit::adaptive(1e-11), Explicit::eighth_order(1e-11)] {
        let second = differentiate_explicitly_twice(&OnRope, &ROPE, &settings, &[end], HessianPart::Full).unwrap();
        for output in outputs {
            let (_, slopes, expected) = hessian(|b| on_rope(b, end)[output], &ROPE);
            let ours = second.hessian(output, 0).unwrap();
            let size = expected.iter().fold(1.0f64, |all, x| all.max(x.abs()));
            let error = ours.iter().zip(expected.iter()).fold(0.0f64, |all, (a, b)| all.max((a - b).abs())) / size;
            let gradient = second.gradient(output, 0);
            let first = gradient.iter().zip(slopes.iter()).fold(0.0f64, |all, (a, b)| all.max((a - b).abs()));
            println!("{}: {first:.1e} {error:.1e}", settings.method.name);
            assert!(first < 1e-7 && error < 1e-6, "{settings:?}: {first:.1e} {error:.1e}");
        }
    }
}

pub fn check_methods<M: ParametricMechanism>(name: &str, model: &M, b: &[f64], times: &[f64]) {
    for settings in all_settings() {
        let direct = differentiate_explicitly(model, b, &settings, times).unwrap();
        let outputs = direct.names.len();
        let all: Vec<AdjointFunctional> = (0..outputs)
            .flat_map(|output| (0..times.len()).map(move |point| AdjointFunctional::at(output, point)))
            .collect();
        let rows = differentiate_explicitly_backwards(model, b, &settings, times, &all).unwrap();
        let adjoint = deviation(&direct.gradients, b, |output, point| {
            rows.row(output * times.len() + point).iter().copied().collect()
        });
        let second = differentiate_explicitly_twice(model, b, &settings, times, HessianPart::Full).unwrap();
        let again = deviation(&direct.gradients, b, |output, point| second.gradient(output, point));
        println!("{name}, {:?}: adjoint {adjoint:.1e}, hyper-dual {again:.1e}", settings.step_control);
        assert!(adjoint < 1e-12 && again < 1e-10, "{name} {settings:?}: {adjoint:.1e} {again:.1e}");
    }
}

#[test]
fn all_methods_agree_through_events_of_explicit_steps() {
    check_methods("bouncing mass", &Bouncing, &BOUNCING, &[0.0, 0.2, 0.411, 0.9, 2.0]);
    check_methods("pushed mass", &Pushed, &PUSHED, &[0.2, 0.411, 0.9, 2.0]);
    check_methods("sling", &Sling, &SLING, &[0.1, 0.3, 0.7, 2.0, 3.0]);
    check_methods("double pendulum", &DoublePendulum, &BARS, &[0.0, 0.4, 0.8, 1.1]);
}

/// Extrapolated differences of the gradients have errors near 1e-8 of the largest entry.
#[test]
fn second_derivatives_through_an_impact_with_joints_are_differences_of_gradients() {
    let settings = Explicit::eighth_order(1e-6).with_step_control(StepControl::Fixed(0.005));
    let times = [0.4, 0.8, 1.1];
    let gradients = |b: &[f64]| -> Vec<Vec<f64>> {
        let found = differentiate_explicitly(&DoublePendulum, b, &settings, &times).unwrap().gradients;
        found.into_iter().map(|series| series.concat()).collect()
    };
    let second = differentiate_explicitly_twice(&DoublePendulum, &BARS, &settings, &times, HessianPart::Full).unwrap();
    for k in 0..BARS.len() {
        let differences = extrapolated_differences(&BARS, k, 2e-4 * BARS[k].abs(), gradients);
        for output in 0..4 {
            for point in 0..times.len() {
                let hessian = second.hessian(output, point).unwrap();
                let size = (0..BARS.len())
                    .flat_map(|i| (0..BARS.len()).map(move |j| (i, j)))
                    .fold(0.0f64, |all, (i, j)| all.max((hessian[(i, j)] * BARS[i] * BARS[j]).abs()));
                for i in 0..BARS.len() {
                    let expected = differences[output][point * BARS.len() + i];
                    let error = (hessian[(i, k)] - expected).abs() * (BARS[i] * BARS[k]).abs();
                    assert!(error < 2e-6 * size, "output {output} at {point}, ({i}, {k}): {error:.1e} of {size:.1e}");
                }
            }
        }
    }
}

#[test]
fn explicit_and_implicit_motions_with_events_agree() {
    let (mechanism, times) = (DoublePendulum.build(&BARS).unwrap(), [0.4, 0.8, 1.1]);
    let explicit = simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-11), &times).unwrap();
    let implicit = simulate(&mechanism, &Dynamics::fixed(2e-4), &times).unwrap();
    assert_eq!(explicit.impacts.len(), implicit.impacts.len());
    for (a, b) in explicit.impacts.iter().zip(&implicit.impacts) {
        assert!((a.t - b.t).abs() < 1e-5, "{a:?} {b:?}");
    }
    for (a, b) in explicit.values.iter().flatten().zip(implicit.values.iter().flatten()) {
        assert!((a - b).abs() < 1e-4 * b.abs().max(1.0), "{a} {b}");
    }
}

/// A bounce between two times of long steps: the contact is open at both ends of the step.
#[test]
fn a_contact_that_closes_within_a_step_is_found() {
    let mechanism = Bouncing.build(&[9.0, 1.0, -0.995, 0.8]).unwrap();
    let settings = Explicit::eighth_order(1e-6).with_step_control(StepControl::Fixed(0.35));
    let history = simulate_explicitly(&mechanism, &settings, &[1.4]).unwrap();
    let expected = (-0.995f64).acos() / 3.0;
    assert_eq!(history.impacts.len(), 1, "{:?}", history.impacts);
    assert!((history.impacts[0].t - expected).abs() < 1e-6, "{:?} {expected}", history.impacts);
}
