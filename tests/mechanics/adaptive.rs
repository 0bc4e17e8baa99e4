//! Adaptive implicit steps: error against tolerance, adaptation, rejected steps.

use crate::zoo::absorber_displacement;
use linkwright::cases::{Absorber, Chain};
use linkwright::mechanics::analyses::dynamics::{Dynamics, StepSize, simulate, simulate_explicitly};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::integrators::explicit::Explicit;
use linkwright::mechanics::integrators::time_stepper::TimeStepper;
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};

/// The local error is of order h³: ten times the tolerance gives 10^{1/3} times the step and 10^{2/3} times the error.
#[test]
fn the_error_follows_the_tolerance() {
    let chain = Chain::horizontal(2);
    let mechanism = chain.build(&chain.equal_links()).unwrap();
    let times = [0.3, 0.6, 0.9];
    let exact = simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-12), &times).unwrap().values;
    let run = |tolerance: f64| {
        let run = simulate(&mechanism, &Dynamics::adaptive(tolerance), &times).unwrap();
        let error = |t: usize| (run.values[0][t] - exact[0][t]).hypot(run.values[1][t] - exact[1][t]);
        ((0..times.len()).map(error).fold(0.0, f64::max), run.work.steps as f64)
    };
    let runs = [1e-5, 1e-6, 1e-7, 1e-8].map(run);
    println!("{runs:?}");
    assert!(runs.windows(2).all(|pair| pair[1].0 < pair[0].0), "{runs:?}");
    let (errors, steps) = ((runs[0].0 / runs[3].0).log10() / 3.0, (runs[3].1 / runs[0].1).log10() / 3.0);
    assert!((errors - 2.0 / 3.0).abs() < 0.1 && (steps - 1.0 / 3.0).abs() < 0.1, "{errors} {steps}: {runs:?}");
}

/// A ball falling on a stiff bump stop.
fn bouncer() -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let ball = m.point_mass("ball", 1.0, 0.0, 0.5);
    m.bump_stop("floor", m.ground().y, ball.y, [1e7, 0.0, 0.0]);
    let sensor = m.coordinate_sensor("height", m.ground().y, ball.y);
    let term = m.measure(sensor, "position").unwrap();
    m.output("height", &[term]);
    m
}

#[test]
fn steps_become_short_in_a_contact_and_long_after_it() {
    let m = bouncer();
    let settings = Dynamics::adaptive(1e-7);
    let mut run = TimeStepper::new(&m, &settings, &[0.9]).unwrap();
    let (mut shortest, mut longest) = (f64::MAX, 0.0f64);
    while run.is_before(0.6) {
        let h = run.advance().unwrap();
        shortest = shortest.min(h);
        longest = longest.max(h);
    }
    let work = run.work();
    println!("steps from {shortest:.1e} to {longest:.1e} s, {work:?}");
    assert!(longest > 50.0 * shortest && work.failed_steps > 0 && work.iterations > work.steps);
    // By energy it rises to 0.5 m again, after twice the time of the fall and the short contact.
    let times: Vec<f64> = (0..=40).map(|k| 0.6 + 0.01 * f64::from(k)).collect();
    let height = simulate(&m, &settings, &times).unwrap().values[0].iter().copied().fold(0.0, f64::max);
    assert!((height - 0.5).abs() < 5e-3, "{height}");
    // No step is longer than the limit.
    let StepSize::Adaptive { tolerance, first, .. } = settings.step else { unreachable!() };
    let short = Dynamics { step: StepSize::Adaptive { tolerance, first, longest: 1e-3 }, ..settings };
    assert!(simulate(&m, &short, &[0.2]).unwrap().work.steps >= 200);
}

#[test]
fn derivatives_go_along_with_adaptive_steps_and_dense_output() {
    let (b, times) = ([0.3628, 0.4823], (1..=23).map(|k| 0.4713 * f64::from(k)).collect::<Vec<_>>());
    let run = differentiate(&Absorber, &b, &Dynamics::adaptive(1e-8), &times).unwrap();
    for (k, &t) in times.iter().enumerate() {
        let (value, gradient) = linkwright::autodiff::gradient(|b| absorber_displacement(b, t), &b);
        assert!((run.values[0][k] - value).abs() < 2e-5, "{t}");
        assert!(run.gradients[0][k].iter().zip(gradient).all(|(a, b)| (a - b).abs() < 1e-4), "{t}");
    }
}
