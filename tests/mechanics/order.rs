//! Measured orders of the integrators and of the beam element.

use crate::zoo::absorber_displacement;
use linkwright::cases::{Absorber, Chain};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate, simulate_explicitly};
use linkwright::mechanics::analyses::modal::modes;
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::elements::{BeamSection, Shear};
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::mechanics::integrators::generalized_alpha::{GeneralizedAlpha, Newton};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
use linkwright::mechanics::system::System;
use linkwright::mechanics::system::state::State;

fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

const DESIGN: [f64; 2] = [0.3628, 0.4823];

#[test]
fn implicit_steps_are_of_second_order_in_values_and_derivatives() {
    let times: Vec<f64> = (1..=25).map(|k| 0.48 * f64::from(k)).collect();
    let error = |h: f64| {
        let run = differentiate(&Absorber, &DESIGN, &Dynamics::fixed(h), &times).unwrap();
        let [k, c] = DESIGN;
        let e = 1e-4;
        let worst = |error: &dyn Fn(usize, f64) -> f64| {
            times.iter().enumerate().map(|(i, &t)| error(i, t).abs()).fold(0.0, f64::max)
        };
        let derivative =
            |t: f64| (absorber_displacement(&[k + e, c], t) - absorber_displacement(&[k - e, c], t)) / (2.0 * e);
        [
            worst(&|i, t| run.values[0][i] - absorber_displacement(&DESIGN, t)),
            worst(&|i, t| run.gradients[0][i][0] - derivative(t)),
        ]
    };
    let (coarse, fine) = (error(0.12), error(0.06));
    for k in 0..2 {
        assert!((order(coarse[k], fine[k]) - 2.0).abs() < 0.2, "{coarse:?} {fine:?}");
    }
}

#[test]
fn implicit_steps_of_a_constrained_pendulum_are_of_second_order() {
    let chain = Chain::horizontal(2);
    let mechanism = chain.build(&[0.6, 0.4, 1.0, 2.0]).unwrap();
    let exact = simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-13), &[0.5]).unwrap();
    let schemes = [
        ("HHT 0", GeneralizedAlpha::hht(0.0)),
        ("HHT 0.05", GeneralizedAlpha::hht(0.05)),
        ("HHT 0.3", GeneralizedAlpha::hht(0.3)),
        ("generalized-alpha 1", GeneralizedAlpha::chung_hulbert(1.0)),
        ("generalized-alpha 0.9", GeneralizedAlpha::chung_hulbert(0.9)),
        ("generalized-alpha 0.5", GeneralizedAlpha::chung_hulbert(0.5)),
        ("generalized-alpha 0", GeneralizedAlpha::chung_hulbert(0.0)),
    ];
    for (name, scheme) in schemes {
        let (scheme, newton) = (scheme.unwrap(), Newton { tolerance: 1e-13, iterations: 20 });
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0f64, |worst, (a, b)| worst.max((a - b).abs()));
        let errors = |h: f64| {
            let run = simulate(&mechanism, &Dynamics { scheme, newton, ..Dynamics::fixed(h) }, &[0.5]).unwrap();
            [apart(&run.last.q, &exact.last.q), apart(&run.last.v, &exact.last.v), apart(&run.last.l, &exact.last.l)]
        };
        let (coarse, fine) = (errors(0.0025), errors(0.00125));
        let orders: Vec<f64> = coarse.iter().zip(fine).map(|(c, f)| order(*c, f)).collect();
        println!("{name}: orders of positions, velocities, reactions {orders:.2?}");
        assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.2), "{name}: {orders:.2?}");
    }
}

/// Dense output loses at most one of the orders five and eight.
#[test]
fn explicit_dense_output_is_of_its_order() {
    let oscillator = Absorber.build(&DESIGN).unwrap();
    let times: Vec<f64> = (1..=60).map(|k| 0.2 * f64::from(k) + 0.013).collect();
    for (method, h) in [(Explicit::adaptive(1.0), 0.8), (Explicit::eighth_order(1.0), 2.0)] {
        let error = |h: f64| {
            let run =
                simulate_explicitly(&oscillator, &method.clone().with_step_control(StepControl::Fixed(h)), &times)
                    .unwrap();
            let errors = run.values[0].iter().zip(&times).map(|(y, &t)| (y - absorber_displacement(&DESIGN, t)).abs());
            errors.fold(0.0, f64::max)
        };
        let (measured, least) = (order(error(h), error(0.5 * h)), f64::from(method.method.order) - 1.2);
        assert!(measured > least, "{}: {measured}", method.method.name);
    }
}

/// First bending frequency of a pinned-pinned Euler–Bernoulli beam.
#[test]
fn beam_frequencies_converge_with_the_square_of_the_element_length() {
    let (length, section) = (1.0, BeamSection::<f64>::rectangular(0.01, 0.01, 2e11, 0.3, 7800.0));
    let exact = std::f64::consts::PI.powi(2) * (section.bending / section.mass).sqrt();
    let error = |n: usize| {
        let mut m = Mechanism::<f64>::new();
        let section = BeamSection { inertia: 1e-9, ..section };
        let (nodes, _) = m.beam("beam", [[0.0, 0.0], [length, 0.0]], [None, None], n, &section, Shear::Rigid);
        [nodes[0].x, nodes[0].y, nodes[n].y].into_iter().for_each(|c| m.fix(c));
        let mut system = System::new(&m).unwrap();
        modes(&mut system, &m, &State::built(&m, 0.0)).unwrap().frequencies[0] / exact - 1.0
    };
    assert!((error(6) - 0.0228).abs() < 5e-4, "{}", error(6)); // 1.0228 of the exact one, an independent code's figure
    let measured = order(error(6), error(12));
    assert!((measured - 2.0).abs() < 0.2, "{measured}");
}
