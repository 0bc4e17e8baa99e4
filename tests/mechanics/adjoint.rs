//! Adjoint derivatives compared with direct ones, of the same discrete motion.

use crate::zoo::{Arm, Drives, Forces, Joints, fixed};
use linkwright::Result;
use linkwright::cases::{Absorber, Andrews, Chain, FourBar, Governor, RigidFourBar, SliderCrank, SpinningBeam};
use linkwright::mechanics::analyses::dynamics::{Dynamics, InitialAcceleration};
use linkwright::mechanics::analyses::statics::Statics;
use linkwright::mechanics::derivatives::adjoint::{
    AdjointFunctional, differentiate_backwards, differentiate_backwards_within, differentiate_equilibria_backwards,
    differentiate_explicitly_backwards, differentiate_explicitly_backwards_within, differentiate_kinematics_backwards,
};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright::mechanics::derivatives::forward::instants::{differentiate_equilibria, differentiate_kinematics};
use linkwright::mechanics::derivatives::history::SensitiveHistory;
use linkwright::mechanics::derivatives::method::Differentiation;
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::mechanics::integrators::explicit::{Coordinates, DOPRI5, Explicit, StepControl};
use linkwright::mechanics::integrators::generalized_alpha::Prescribed;
use linkwright::mechanics::mechanism::ParametricMechanism;
use linkwright::problem::{Analysis, Differentiated, ResponseAt, ResponseSum};
use linkwright::responses::mechanism::{Integration, Transient};
use nalgebra::DMatrix;

/// Derivatives of responses, a row each.
type Rows = Result<DMatrix<f64>>;

/// Largest deviation of a derivative, all scaled by the size of the variables. It is relative to the largest derivative of
/// the same output with respect to the same variable at any time, or to a hundredth of the largest with respect to any
/// variable. Outputs that are nearly zero (the bending moment at a pin) are compared with `floor` times the largest of all.
fn deviation(
    forward: &SensitiveHistory,
    backward: impl FnOnce(&[AdjointFunctional]) -> Rows,
    b: &[f64],
    floor: f64,
) -> f64 {
    let points = forward.times.len();
    let all = (0..forward.names.len()).flat_map(|output| (0..points).map(move |p| AdjointFunctional::at(output, p)));
    let backward = backward(&all.collect::<Vec<_>>()).unwrap();
    let scale = |k: usize| b[k].abs().max(1e-3);
    let sizes = forward.gradients.iter().flatten().flat_map(|gradient| gradient.iter().enumerate());
    let of_all = sizes.map(|(k, derivative)| (derivative * scale(k)).abs()).fold(0.0, f64::max);
    let mut worst = 0.0f64;
    for (output, series) in forward.gradients.iter().enumerate() {
        let largest = |k: usize| series.iter().fold(0.0f64, |a, gradient| a.max((gradient[k] * scale(k)).abs()));
        let of_any = (0..b.len()).map(largest).fold(0.0, f64::max);
        for (p, gradient) in series.iter().enumerate() {
            for k in 0..b.len() {
                let difference = (gradient[k] - backward[(output * points + p, k)]) * scale(k);
                worst = worst.max(difference.abs() / largest(k).max(1e-2 * of_any).max(floor * of_all));
            }
        }
    }
    worst
}

/// Output times at the start, between steps and at their ends.
fn times(end: f64) -> Vec<f64> {
    [0.0, 0.237, 0.5, 0.7312, 1.0].map(|fraction| fraction * end).to_vec()
}

fn check<M: ParametricMechanism>(name: &str, model: &M, b: &[f64], settings: Dynamics, end: f64) {
    check_down_to(1e-9, name, model, b, settings, end);
}

fn check_down_to<M: ParametricMechanism>(floor: f64, name: &str, model: &M, b: &[f64], settings: Dynamics, end: f64) {
    let times = times(end);
    let forward = differentiate(model, b, &settings, &times).unwrap();
    let worst = deviation(&forward, |all| differentiate_backwards(model, b, &settings, &times, all), b, floor);
    report(name, worst);
}

/// Explicit steps of both orders, fixed and adaptive, with outputs between their ends.
fn check_explicit<M: ParametricMechanism>(name: &str, model: &M, b: &[f64], h: f64, end: f64) {
    let times = times(end);
    let adaptive = Explicit { method: &DOPRI5, ..Explicit::eighth_order(1e-8) };
    let fixed = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(h));
    for settings in [adaptive, fixed.clone(), Explicit { method: &DOPRI5, ..fixed }] {
        let forward = differentiate_explicitly(model, b, &settings, &times).unwrap();
        let backward = |all: &[AdjointFunctional]| differentiate_explicitly_backwards(model, b, &settings, &times, all);
        report(&format!("{name}, {}", settings.method.name), deviation(&forward, backward, b, 1e-9));
    }
}

fn report(name: &str, worst: f64) {
    println!("{name}: {worst:.1e}");
    assert!(worst < 1e-10, "{name}: {worst:.2e}");
}

#[test]
fn every_element_force_and_drive() {
    check("forces", &Forces, &Forces::DESIGN, fixed(0.02), 0.6);
    check("joints", &Joints { length_driver: false }, &Joints::DESIGN, fixed(0.04), 0.24);
    check("a length that is driven", &Joints { length_driver: true }, &Joints::DESIGN, fixed(0.04), 0.24);
    check("drives", &Drives, &Drives::DESIGN, fixed(0.02), 0.6);
    check("clamped beam", &Arm { elements: 4 }, &Arm::DESIGN, fixed(0.02), 0.3);
}

#[test]
fn prescribed_velocities_by_newmark_formulas() {
    let newmark =
        Dynamics { prescribed: Prescribed::Newmark, initial_acceleration: InitialAcceleration::Zero, ..fixed(0.02) };
    check("drives", &Drives, &Drives::DESIGN, newmark, 0.6);
    check("clamped beam", &Arm { elements: 4 }, &Arm::DESIGN, newmark, 0.3);
}

#[test]
fn the_reference_mechanisms() {
    check("absorber", &Absorber, &[0.36, 0.48], fixed(0.01), 2.0);
    check("absorber, adaptive steps", &Absorber, &[0.36, 0.48], Dynamics::adaptive(1e-6), 2.0);
    check("Andrews' mechanism", &Andrews, &Andrews::DESIGN, fixed(1e-4), 0.03);
    let chain = Chain::horizontal(6);
    check("chain", &chain, &chain.equal_links(), fixed(0.01), 0.5);
    let slider_crank = SliderCrank::rigid();
    check("slider-crank", &slider_crank, &SliderCrank::DESIGN, fixed(0.005), 0.2);
    let beam = SpinningBeam { elements: 4, speed: 6.0, duration: 0.455 };
    check("spinning beam", &beam, &SpinningBeam::DESIGN, fixed(0.02), 0.6);
    let b = [0.0385, 0.0252, 0.02];
    for four_bar in [FourBar::as_published(), FourBar::physical()] {
        // All outputs are moments; those at pins are a hundred-thousandth of the others.
        check_down_to(1e-4, "flexible four-bar", &four_bar, &b, four_bar.dynamics().unwrap(), 0.5);
    }
    check("rigid four-bar", &RigidFourBar(FourBar::physical()), &b, fixed(0.005), 0.2);
}

#[test]
fn explicit_steps() {
    let chain = Chain::horizontal(6);
    check_explicit("chain", &chain, &chain.equal_links(), 0.01, 0.3);
    check_explicit("forces", &Forces, &Forces::DESIGN, 0.01, 0.3);
    check_explicit("joints", &Joints { length_driver: false }, &Joints::DESIGN, 0.01, 0.1);
    check_explicit("a length that is driven", &Joints { length_driver: true }, &Joints::DESIGN, 0.01, 0.1);
    check_explicit("drives", &Drives, &Drives::DESIGN, 0.01, 0.3);
    check_explicit("slider-crank", &SliderCrank::rigid(), &SliderCrank::DESIGN, 0.005, 0.1);
    check_explicit("absorber", &Absorber, &[0.36, 0.48], 0.02, 1.0);
    check_explicit("Andrews' mechanism", &Andrews, &Andrews::DESIGN, 1e-4, 0.005);
    check_explicit("rigid four-bar", &RigidFourBar(FourBar::physical()), &[0.0385, 0.0252, 0.02], 0.005, 0.1);
}

#[test]
fn equilibria_and_kinematics() {
    let (settings, times) = (Statics { tolerance: 1e-12, ..Statics::default() }, [0.0, 1.0, 2.0]);
    // Rounding grows with the ratio of shear stiffness to bending stiffness.
    for elements in [2, 4] {
        let (arm, b) = (Arm { elements }, Arm::DESIGN);
        let forward = differentiate_equilibria(&arm, &b, &settings, &times).unwrap();
        let backward = |all: &[AdjointFunctional]| differentiate_equilibria_backwards(&arm, &b, &settings, &times, all);
        let worst = deviation(&forward, backward, &b, 1e-9);
        println!("statics of the clamped beam, {elements} elements: {worst:.1e}");
        assert!(worst < 1e-9, "{elements}: {worst:.2e}");
    }

    let governor = Governor { angle: 1.0 };
    let forward = differentiate_equilibria(&governor, &Governor::DESIGN, &settings, &[0.0]).unwrap();
    let backward = |all: &[AdjointFunctional]| {
        differentiate_equilibria_backwards(&governor, &Governor::DESIGN, &settings, &[0.0], all)
    };
    report("statics of the governor", deviation(&forward, backward, &Governor::DESIGN, 1e-9));

    let (model, b) = (SliderCrank::rigid(), SliderCrank::DESIGN);
    let times: Vec<f64> = (0..20).map(|k| 0.02 * f64::from(k)).collect();
    let forward = differentiate_kinematics(&model, &b, Assembly::default(), &times).unwrap();
    let backward =
        |all: &[AdjointFunctional]| differentiate_kinematics_backwards(&model, &b, Assembly::default(), &times, all);
    report("kinematics of the slider-crank", deviation(&forward, backward, &b, 1e-9));
}

/// With `memory` bytes for steps: the same bits as with all steps stored, within the memory, and not too many repeated steps.
fn check_memory<M: ParametricMechanism>(model: &M, b: &[f64], settings: Dynamics, times: &[f64], memory: usize) {
    let wanted = [AdjointFunctional::at(0, times.len() - 1), AdjointFunctional::integral(0, times)];
    let all_steps = differentiate_backwards(model, b, &settings, times, &wanted).unwrap();
    let (rows, statistics) = differentiate_backwards_within(memory, model, b, &settings, times, &wanted).unwrap();
    assert_eq!(rows, all_steps);
    println!("{memory} bytes: {statistics:?}");
    assert!(
        statistics.memory <= memory && statistics.repeated > 0 && statistics.repeated < 8 * statistics.steps,
        "{statistics:?}"
    );
}

#[test]
fn checkpoints_instead_of_all_steps() {
    let (chain, times) = (Chain::horizontal(4), times(0.4));
    let b = chain.equal_links();
    for memory in [20_000, 40_000, 80_000] {
        check_memory(&chain, &b, Dynamics::fixed(0.001), &times, memory);
        check_memory(&chain, &b, Dynamics::adaptive(1e-7), &times, memory);
    }
    let error = differentiate_backwards_within(1000, &chain, &b, &Dynamics::fixed(0.001), &times, &[]).unwrap_err();
    assert!(error.to_string().contains("1000 bytes"), "{error}");
    let wanted = [AdjointFunctional::at(0, 3), AdjointFunctional::at(1, 4)];
    let explicit = [Explicit::eighth_order(1e-9), Explicit::adaptive(1.0).with_step_control(StepControl::Fixed(0.002))];
    // Steps in relative coordinates have a quarter of the numbers.
    for (coordinates, memory) in [(Coordinates::Absolute, 8_000), (Coordinates::Relative, 3_000)] {
        for settings in explicit.clone().map(|settings| settings.with_coordinates(coordinates)) {
            let all_steps = differentiate_explicitly_backwards(&chain, &b, &settings, &times, &wanted).unwrap();
            let (rows, statistics) =
                differentiate_explicitly_backwards_within(memory, &chain, &b, &settings, &times, &wanted).unwrap();
            println!("{statistics:?}");
            assert_eq!(rows, all_steps);
            assert!(statistics.memory <= memory && statistics.repeated > 0, "{statistics:?}");
        }
    }
}

#[test]
fn integrals_are_sums_over_time() {
    let (model, b, times) = (Forces, Forces::DESIGN, [0.0, 0.1, 0.15, 0.3]);
    let forward = differentiate(&model, &b, &fixed(0.02), &times).unwrap();
    let response = [AdjointFunctional::integral(0, &times)];
    let backward = differentiate_backwards(&model, &b, &fixed(0.02), &times, &response).unwrap();
    let weights = [0.05, 0.075, 0.1, 0.075];
    for k in 0..b.len() {
        let sum: f64 = weights.iter().zip(&forward.gradients[0]).map(|(weight, gradient)| weight * gradient[k]).sum();
        assert!((sum - backward[(0, k)]).abs() <= 1e-11 * sum.abs().max(1e-6), "{k}: {sum} {}", backward[(0, k)]);
    }
}

#[test]
fn a_response_of_a_missing_output_is_rejected() {
    let wrong = [AdjointFunctional::at(0, 0), AdjointFunctional::at(99, 0)];
    let error = differentiate_backwards(&Absorber, &[0.36, 0.48], &fixed(0.01), &[1.0], &wrong).unwrap_err();
    assert!(error.to_string().contains("response 1"), "{error}");
}

/// Integrals of outputs over time: one reverse pass for each sum, by implicit and explicit steps.
#[test]
fn gradients_of_weighted_sums_are_the_sums_of_gradients() {
    let model = Chain { energies: false, ..Chain::horizontal(3) };
    let b = model.equal_links();
    let times: Vec<f64> = (0..=200).map(|k| 2e-3 * f64::from(k)).collect();
    let sum = |output: usize| ResponseSum {
        terms: (0..times.len())
            .map(|point| (ResponseAt { response: output, point }, (0.02 * point as f64).cos()))
            .collect(),
    };
    let sums = [sum(0), sum(1), ResponseSum::of(ResponseAt { response: 1, point: 77 })];
    for settings in [Integration::from(fixed(4e-3)), Explicit::eighth_order(1e-9).into()] {
        let by = |method| {
            let analysis = Transient::new(model, settings.clone(), &times).unwrap().differentiating(method).unwrap();
            let responses = analysis.analyze(&b).unwrap();
            analysis.sum_sensitivities(&b, &responses, &sums).unwrap()
        };
        let (direct, adjoint) = (by(Differentiation::Direct), by(Differentiation::Adjoint));
        for i in 0..sums.len() {
            let difference = (direct.row(i) - adjoint.row(i)).amax() / direct.row(i).amax();
            assert!(difference < 1e-9, "{settings:?}, sum {i}: {difference:.1e}");
        }
        // By its name, as in model files; and the default method of an analysis without an adjoint one.
        let analysis = Transient::new(model, settings.clone(), &times).unwrap();
        let named = Differentiated::by(analysis, "adjoint", None).unwrap();
        let responses = named.analyze(&b).unwrap();
        assert_eq!(named.sum_sensitivities(&b, &responses, &sums).unwrap(), adjoint);
        let direct_rows = Differentiated::by(&named, "direct", None).unwrap();
        let rows = direct_rows.sum_sensitivities(&b, &responses, &sums).unwrap();
        assert!((rows - direct).amax() < 1e-12 * adjoint.amax());
    }
}
