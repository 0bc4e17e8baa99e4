//! Measured orders of the integrators and of the beam element.

use linkwright::analysis::explicit::Explicit;
use linkwright::analysis::modes::modes;
use linkwright::analysis::{Dynamics, State, System, simulate};
use linkwright::multibody::elements::{BeamSection, Shear};
use linkwright::multibody::mechanisms::{Absorber, Chain};
use linkwright::multibody::{Mechanism, Model};
use linkwright::sensitivity::differentiate;
use linkwright::sensitivity::explicit::simulate_explicitly;

fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}

/// ÿ + c ẏ + k y = 0 with y(0) = 0, ẏ(0) = 1.
fn absorber(k: f64, c: f64, t: f64) -> f64 {
    let w = (k - 0.25 * c * c).sqrt();
    (-0.5 * c * t).exp() * (w * t).sin() / w
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
        let slope = |t: f64| (absorber(k + e, c, t) - absorber(k - e, c, t)) / (2.0 * e);
        [worst(&|i, t| run.values[0][i] - absorber(k, c, t)), worst(&|i, t| run.slopes[0][i][0] - slope(t))]
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
    let exact = simulate_explicitly(&mechanism, &Explicit::adaptive(1e-12), &[0.5]).unwrap().values[0][0];
    let error = |h: f64| (simulate(&mechanism, &Dynamics::fixed(h), &[0.5]).unwrap().values[0][0] - exact).abs();
    let measured = order(error(0.01), error(0.005));
    assert!((measured - 2.0).abs() < 0.2, "{measured}");
}

#[test]
fn dormand_prince_steps_are_of_fifth_order() {
    let fixed = |h: f64| Explicit { tolerance: f64::INFINITY, first: h, ..Explicit::adaptive(1.0) };
    let oscillator = Absorber.build(&DESIGN).unwrap();
    let times: Vec<f64> = (1..=15).map(|k| 0.8 * f64::from(k)).collect();
    let error = |h: f64| {
        let run = simulate_explicitly(&oscillator, &fixed(h), &times).unwrap();
        let errors = run.values[0].iter().zip(&times).map(|(y, &t)| (y - absorber(DESIGN[0], DESIGN[1], t)).abs());
        errors.fold(0.0, f64::max)
    };
    let measured = order(error(0.4), error(0.2));
    assert!((measured - 5.0).abs() < 0.2, "oscillator {measured}");
    let pendulum = Chain::horizontal(1).build(&[1.0, 1.0]).unwrap();
    let exact = simulate_explicitly(&pendulum, &Explicit::adaptive(1e-13), &[1.0]).unwrap().values[0][0];
    let error = |h: f64| (simulate_explicitly(&pendulum, &fixed(h), &[1.0]).unwrap().values[0][0] - exact).abs();
    let measured = order(error(0.05), error(0.025));
    assert!(measured > 4.5, "pendulum {measured}");
}

#[test]
fn eighth_order_steps_and_their_dense_output() {
    let fixed = |h: f64| Explicit { tolerance: f64::INFINITY, first: h, ..Explicit::eighth_order(1.0) };
    let oscillator = Absorber.build(&DESIGN).unwrap();
    let error = |h: f64, times: &[f64]| {
        let run = simulate_explicitly(&oscillator, &fixed(h), times).unwrap();
        let errors = run.values[0].iter().zip(times).map(|(y, &t)| (y - absorber(DESIGN[0], DESIGN[1], t)).abs());
        errors.fold(0.0, f64::max)
    };
    let ends: Vec<f64> = (1..=7).map(|k| 2.0 * f64::from(k)).collect();
    let measured = order(error(2.0, &ends), error(1.0, &ends));
    assert!((measured - 8.0).abs() < 0.7, "{measured}");
    let between: Vec<f64> = (1..=60).map(|k| 0.2 * f64::from(k) + 0.013).collect();
    let measured = order(error(2.0, &between), error(1.0, &between));
    assert!(measured > 7.0, "dense output {measured}");
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
