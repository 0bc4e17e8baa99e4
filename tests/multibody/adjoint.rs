//! Backward against forward differentiation: the same derivatives of the same discrete motion.

use crate::zoo::{Arm, Drives, Forces, Joints};
use linkwright::analysis::dynamics::InitialAcceleration;
use linkwright::analysis::generalized_alpha::Prescribed;
use linkwright::analysis::{Dynamics, Newton};
use linkwright::multibody::Model;
use linkwright::multibody::mechanisms::{Absorber, Andrews, Chain, FourBar, RigidFourBar, SliderCrank, SpinningBeam};
use linkwright::sensitivity::{Functional, differentiate, differentiate_backwards};

/// Largest deviation of a derivative, relative to the largest of the same output with respect to the same variable at any
/// time, or to a hundredth of the largest with respect to any; all by the size of the variables. Outputs that are zero but for
/// rounding or nearly so (the bending moment at a pin) are measured by `floor` of the largest of all.
fn deviation<M: Model>(model: &M, b: &[f64], settings: &Dynamics, times: &[f64], floor: f64) -> f64 {
    let forward = differentiate(model, b, settings, times).unwrap();
    let all = (0..forward.names.len()).flat_map(|output| (0..times.len()).map(move |p| Functional::at(output, p)));
    let backward = differentiate_backwards(model, b, settings, times, &all.collect::<Vec<_>>()).unwrap();
    let scale = |k: usize| b[k].abs().max(1e-3);
    let sizes = forward.slopes.iter().flatten().flat_map(|slopes| slopes.iter().enumerate());
    let of_all = sizes.map(|(k, slope)| (slope * scale(k)).abs()).fold(0.0, f64::max);
    let mut worst = 0.0f64;
    for (output, series) in forward.slopes.iter().enumerate() {
        let largest = |k: usize| series.iter().fold(0.0f64, |a, slopes| a.max((slopes[k] * scale(k)).abs()));
        let of_any = (0..b.len()).map(largest).fold(0.0, f64::max);
        for (p, slopes) in series.iter().enumerate() {
            for k in 0..b.len() {
                let difference = (slopes[k] - backward[(output * times.len() + p, k)]) * scale(k);
                worst = worst.max(difference.abs() / largest(k).max(1e-2 * of_any).max(floor * of_all));
            }
        }
    }
    worst
}

/// Output times at the start, between steps and at their ends.
fn times(end: f64) -> Vec<f64> {
    [0.0, 0.237, 0.5, 0.7312, 1.0].map(|part| part * end).to_vec()
}

fn check<M: Model>(name: &str, model: &M, b: &[f64], settings: Dynamics, end: f64) {
    check_down_to(1e-9, name, model, b, settings, end);
}

fn check_down_to<M: Model>(floor: f64, name: &str, model: &M, b: &[f64], settings: Dynamics, end: f64) {
    let worst = deviation(model, b, &settings, &times(end), floor);
    println!("{name}: {worst:.1e}");
    assert!(worst < 1e-10, "{name}: {worst:.2e}");
}

fn fixed(h: f64) -> Dynamics {
    Dynamics { newton: Newton { tolerance: 1e-12, iterations: 30 }, ..Dynamics::fixed(h) }
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
fn motions_from_their_positions_alone() {
    let newmark = Dynamics { prescribed: Prescribed::Newmark, initial: InitialAcceleration::Zero, ..fixed(0.02) };
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
fn integrals_are_sums_over_time() {
    let (model, b, times) = (Forces, Forces::DESIGN, [0.0, 0.1, 0.15, 0.3]);
    let forward = differentiate(&model, &b, &fixed(0.02), &times).unwrap();
    let response = [Functional::integral(0, &times)];
    let backward = differentiate_backwards(&model, &b, &fixed(0.02), &times, &response).unwrap();
    let weights = [0.05, 0.075, 0.1, 0.075];
    for k in 0..b.len() {
        let sum: f64 = weights.iter().zip(&forward.slopes[0]).map(|(weight, slopes)| weight * slopes[k]).sum();
        assert!((sum - backward[(0, k)]).abs() <= 1e-11 * sum.abs().max(1e-6), "{k}: {sum} {}", backward[(0, k)]);
    }
}

#[test]
fn a_response_of_nothing_is_refused() {
    let wrong = [Functional::at(0, 0), Functional::at(99, 0)];
    let error = differentiate_backwards(&Absorber, &[0.36, 0.48], &fixed(0.01), &[1.0], &wrong).unwrap_err();
    assert!(error.to_string().contains("response 1"), "{error}");
}
