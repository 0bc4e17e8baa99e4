//! Exact derivatives compared with Richardson-extrapolated differences of the same discrete solution.

use crate::zoo::Arm;
use linkwright::cases::{Andrews, Chain, FourBar, SliderCrank};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate, simulate_explicitly};
use linkwright::mechanics::analyses::kinematics::kinematics;
use linkwright::mechanics::analyses::statics::{Statics, equilibria};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright::mechanics::derivatives::forward::instants::{differentiate_equilibria, differentiate_kinematics};
use linkwright::mechanics::derivatives::history::SensitiveHistory;
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::mechanics::integrators::generalized_alpha::Newton;
use linkwright::mechanics::mechanism::ParametricMechanism;

/// Largest deviation of a derivative from differences, relative to the largest derivative of the same output.
///
/// The smaller deviation of two steps is used: the large step suffers from curvature, the small one from rounding.
fn deviation(b: &[f64], exact: &SensitiveHistory, run: impl Fn(&[f64]) -> Vec<Vec<f64>>) -> f64 {
    let variable =
        |k: usize| [2e-3, 2e-4].map(|h| deviation_of(b, k, h, exact, &run)).into_iter().fold(f64::MAX, f64::min);
    (0..b.len()).map(variable).fold(0.0, f64::max)
}

fn deviation_of(b: &[f64], k: usize, h: f64, exact: &SensitiveHistory, run: impl Fn(&[f64]) -> Vec<Vec<f64>>) -> f64 {
    let differences = extrapolated_differences(b, k, h * b[k].abs().max(1e-2), run);
    let mut worst = 0.0f64;
    for (series, differences) in exact.gradients.iter().zip(&differences) {
        let scaled = |gradient: &Vec<f64>| gradient.iter().zip(b).fold(0.0f64, |a, (s, b)| a.max((s * b).abs()));
        let largest = series.iter().map(scaled).fold(0.0, f64::max);
        for (gradient, difference) in series.iter().zip(differences) {
            worst = worst.max((gradient[k] - difference).abs() * b[k].abs() / largest);
        }
    }
    worst
}

/// Central differences of `run` with respect to variable `k` with steps `h` and h/2, Richardson-extrapolated.
fn extrapolated_differences(b: &[f64], k: usize, h: f64, run: impl Fn(&[f64]) -> Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let values = |step: f64| {
        let mut moved = b.to_vec();
        moved[k] += step;
        run(&moved).into_iter()
    };
    let difference = |h: f64| {
        let quotients = move |(ahead, behind): (Vec<f64>, Vec<f64>)| -> Vec<f64> {
            ahead.iter().zip(&behind).map(|(ahead, behind)| (ahead - behind) / (2.0 * h)).collect()
        };
        values(h).zip(values(-h)).map(quotients)
    };
    let extrapolated = |(coarse, fine): (Vec<f64>, Vec<f64>)| {
        coarse.iter().zip(&fine).map(|(coarse, fine)| (4.0 * fine - coarse) / 3.0).collect()
    };
    difference(h).zip(difference(0.5 * h)).map(extrapolated).collect()
}

fn implicit(h: f64) -> Dynamics {
    Dynamics { newton: Newton { tolerance: 1e-11, iterations: 20 }, ..Dynamics::fixed(h) }
}

/// Compares the derivatives of an implicit simulation with differences.
fn check_implicit<M: ParametricMechanism>(name: &str, model: &M, b: &[f64], settings: Dynamics, times: &[f64]) {
    let exact = differentiate(model, b, &settings, times).unwrap();
    let worst = deviation(b, &exact, |b| simulate(&model.build(b).unwrap(), &settings, times).unwrap().values);
    println!("| {name} | implicit | {worst:.1e} |");
    assert!(worst < 1e-7, "{name}: {worst:.2e}");
}

#[test]
fn clamped_beam_at_the_start_of_its_rotation() {
    let times: Vec<f64> = (0..=8).map(|k| 0.05 * f64::from(k)).collect();
    check_implicit("flexible arm", &Arm { elements: 4 }, &Arm::DESIGN, implicit(0.005), &times);
}

/// Compares the derivatives of explicit simulations with differences.
fn check_explicit<M: ParametricMechanism>(name: &str, model: &M, b: &[f64]) {
    let times = [0.0, 0.013, 0.1, 0.2];
    for settings in [Explicit::adaptive(1.0), Explicit::eighth_order(1.0)] {
        let settings = settings.with_step_control(StepControl::Fixed(0.01));
        let exact = differentiate_explicitly(model, b, &settings, &times).unwrap();
        let run = |b: &[f64]| simulate_explicitly(&model.build(b).unwrap(), &settings, &times).unwrap().values;
        let worst = deviation(b, &exact, run);
        println!("| {name} | explicit, {} | {worst:.1e} |", settings.method.name);
        assert!(worst < 1e-7, "{name}: {worst:.2e}");
    }
}

#[test]
fn explicit_steps_of_chains() {
    let chain = Chain::horizontal(5);
    check_explicit("chain", &chain, &chain.equal_links());
    let more_than_a_block = Chain::horizontal(9);
    check_explicit("chain of nine", &more_than_a_block, &more_than_a_block.equal_links());
    let eighth = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(0.03));
    let (b, times) = (chain.equal_links(), [0.01, 0.1, 0.17]);
    let exact = differentiate_explicitly(&chain, &b, &eighth, &times).unwrap();
    let worst =
        deviation(&b, &exact, |b| simulate_explicitly(&chain.build(b).unwrap(), &eighth, &times).unwrap().values);
    println!("| chain | explicit, order 8, between steps | {worst:.1e} |");
    assert!(worst < 1e-7, "chain, order 8: {worst:.2e}");
}

#[test]
fn kinematics_and_inverse_dynamics_of_a_slider_crank() {
    let times: Vec<f64> = (0..20).map(|k| 0.02 * f64::from(k)).collect();
    let (model, b) = (SliderCrank::rigid(), SliderCrank::DESIGN);
    let exact = differentiate_kinematics(&model, &b, Assembly::default(), &times).unwrap();
    let worst = deviation(&b, &exact, |b| kinematics(&model.build(b).unwrap(), Assembly::default(), &times).unwrap());
    println!("| slider-crank | kinematics, inverse dynamics | {worst:.1e} |");
    assert!(worst < 1e-7, "{worst:.2e}");
}

#[test]
fn static_equilibrium_of_a_loaded_arm() {
    let (model, settings) = (Arm { elements: 4 }, Statics { tolerance: 1e-12, ..Statics::default() });
    let times = [0.0, 1.0, 2.0];
    let exact = differentiate_equilibria(&model, &Arm::DESIGN, &settings, &times).unwrap();
    let worst = deviation(&Arm::DESIGN, &exact, |b| equilibria(&model.build(b).unwrap(), &settings, &times).unwrap());
    println!("| flexible arm | statics | {worst:.1e} |");
    assert!(worst < 1e-7, "{worst:.2e}");
}

#[test]
fn squeezer_derivatives_are_those_of_the_literature() {
    let exact = differentiate(&Andrews, &Andrews::DESIGN, &Dynamics::fixed(1e-5), &[0.03]).unwrap();
    for (derivative, expected) in exact.gradients[0][0].iter().zip([247.1335, 1.974258e-3, 396.6113]) {
        assert!((derivative / expected - 1.0).abs() < 1e-4, "{derivative} {expected}");
    }
}

#[test]
fn moments_of_the_four_bar_agree_with_differences() {
    let (model, b) = (FourBar::as_published(), [0.0385, 0.0252, 0.02]);
    let history = differentiate(&model, &b, &model.dynamics().unwrap(), &FourBar::window()).unwrap();
    let run =
        |b: &[f64]| simulate(&model.build(b).unwrap(), &model.dynamics().unwrap(), &FourBar::window()).unwrap().values;
    assert_eq!(history.values, run(&b));
    for k in 0..3 {
        let differences = extrapolated_differences(&b, k, 1e-4 * b[k], run);
        let (mut worst, mut largest) = (0.0f64, 0.0f64);
        for (series, differences) in history.gradients.iter().zip(&differences) {
            for (gradient, difference) in series.iter().zip(differences) {
                worst = worst.max((gradient[k] - difference).abs());
                largest = largest.max(difference.abs());
            }
        }
        assert!(worst < 3e-7 * largest, "variable {k}: {worst:.2e} of {largest:.2e}");
    }
}
