//! Second derivatives compared with differences of exact gradients, with each other, and with a closed form.

use crate::zoo::{Arm, Drives, Forces, Joints, fixed};
use linkwright::autodiff::{Scalar, hessian};
use linkwright::cases::{Absorber, Andrews, Chain, FourBar, RigidFourBar, SliderCrank, SpinningBeam};
use linkwright::mechanics::analyses::dynamics::Dynamics;
use linkwright::mechanics::analyses::statics::Statics;
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::instants::{differentiate_equilibria, differentiate_kinematics};
use linkwright::mechanics::derivatives::history::SensitiveHistory;
use linkwright::mechanics::derivatives::second_order::{
    HessianHistory, HessianPart, differentiate_equilibria_twice, differentiate_kinematics_twice, differentiate_twice,
};
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::mechanics::mechanism::ParametricMechanism;
use linkwright::problem::{Analysis, ResponseAt};
use linkwright::responses::mechanism::Transient;

/// Largest deviation of a Hessian's entry from extrapolated central differences of `gradients`, relative to the largest entry
/// of the same output at any time, all by the size of the variables.
fn deviation(b: &[f64], step: f64, hessians: &HessianHistory, gradients: impl Fn(&[f64]) -> SensitiveHistory) -> f64 {
    let (n, points) = (b.len(), hessians.times.len());
    let scale: Vec<f64> = b.iter().map(|x| x.abs().max(1e-3)).collect();
    let at = |j: usize, by: f64| {
        let mut moved = b.to_vec();
        moved[j] += by * scale[j];
        gradients(&moved).gradients
    };
    let around: Vec<_> = (0..n).map(|j| [1.0, -1.0, 0.5, -0.5].map(|fraction| at(j, fraction * step))).collect();
    let (mut worst, mut absolute) = (0.0f64, vec![(0.0f64, 0.0f64); hessians.names.len()]);
    for (output, (error, largest)) in absolute.iter_mut().enumerate() {
        for p in 0..points {
            let hessian = hessians.hessian(output, p).unwrap();
            for (j, [far_ahead, far_behind, near_ahead, near_behind]) in around.iter().enumerate() {
                for i in 0..n {
                    let of = |gradients: &[Vec<Vec<f64>>]| gradients[output][p][i] * scale[i];
                    let (coarse, fine) =
                        ((of(far_ahead) - of(far_behind)) / (2.0 * step), (of(near_ahead) - of(near_behind)) / step);
                    let exact = hessian[(i, j)] * scale[i] * scale[j];
                    *error = error.max((exact - (4.0 * fine - coarse) / 3.0).abs());
                    *largest = largest.max(exact.abs());
                }
            }
        }
    }
    let of_all = absolute.iter().fold(0.0f64, |a, (_, largest)| a.max(*largest));
    for (error, largest) in absolute {
        worst = worst.max(error / largest.max(1e-5 * of_all));
    }
    worst
}

fn times(end: f64) -> Vec<f64> {
    [0.0, 0.237, 0.7312, 1.0].map(|fraction| fraction * end).to_vec()
}

fn check<M: ParametricMechanism>(name: &str, model: &M, b: &[f64], settings: Dynamics, end: f64) {
    let times = times(end);
    let hessians = differentiate_twice(model, b, &settings, &times, HessianPart::Full).unwrap();
    let worst = deviation(b, 2e-4, &hessians, |b| differentiate(model, b, &settings, &times).unwrap());
    println!("{name}: {worst:.1e}");
    assert!(worst < 1e-6, "{name}: {worst:.2e}");
}

#[test]
fn every_element_force_and_drive() {
    check("forces", &Forces, &Forces::DESIGN, fixed(0.02), 0.2);
    check("joints", &Joints { length_driver: false }, &Joints::DESIGN, fixed(0.04), 0.16);
    check("drives", &Drives, &Drives::DESIGN, fixed(0.02), 0.2);
    check("clamped beam", &Arm { elements: 2 }, &Arm::DESIGN, fixed(0.02), 0.2);
}

#[test]
fn the_reference_mechanisms() {
    check("absorber", &Absorber, &[0.36, 0.48], fixed(0.01), 2.0);
    check("Andrews' mechanism", &Andrews, &Andrews::DESIGN, fixed(1e-4), 0.01);
    let chain = Chain::horizontal(4);
    check("chain", &chain, &chain.equal_links(), fixed(0.01), 0.4);
    check("slider-crank", &SliderCrank::rigid(), &SliderCrank::DESIGN, fixed(0.005), 0.2);
    let beam = SpinningBeam { elements: 4, speed: 6.0, duration: 0.455 };
    check("spinning beam", &beam, &SpinningBeam::DESIGN, fixed(0.02), 0.4);
    let b = [0.0385, 0.0252, 0.02];
    let four_bar = FourBar::as_published();
    check("flexible four-bar", &four_bar, &b, four_bar.dynamics().unwrap(), 0.1);
    check("rigid four-bar", &RigidFourBar(FourBar::physical()), &b, fixed(0.005), 0.2);
}

#[test]
fn kinematics_and_statics() {
    let (model, b, times) = (SliderCrank::rigid(), SliderCrank::DESIGN, times(0.2));
    let assembly = Assembly::default();
    let hessians = differentiate_kinematics_twice(&model, &b, assembly, &times, HessianPart::Full).unwrap();
    let worst = deviation(&b, 2e-4, &hessians, |b| differentiate_kinematics(&model, b, assembly, &times).unwrap());
    println!("slider-crank, driven: {worst:.1e}");
    assert!(worst < 1e-6, "{worst:.2e}");
    let (model, b, settings) = (Arm { elements: 2 }, Arm::DESIGN, Statics::default());
    let hessians = differentiate_equilibria_twice(&model, &b, &settings, &[0.0], HessianPart::Full).unwrap();
    let worst = deviation(&b, 2e-4, &hessians, |b| differentiate_equilibria(&model, b, &settings, &[0.0]).unwrap());
    println!("arm in equilibrium: {worst:.1e}");
    assert!(worst < 1e-6, "{worst:.2e}");
}

/// Without damping x = sin(ω t)/ω with ω = √b₁. The difference is the error of the steps, of order h².
#[test]
fn the_absorber_in_closed_form() {
    fn displacement<S: Scalar>(k: S, t: f64) -> S {
        (k.sqrt() * t).sin() / k.sqrt()
    }
    let (k, t) = (0.36, 1.7);
    let exact = hessian(|b| displacement(b[0], t), &[k]).2[(0, 0)];
    let error = |h: f64| {
        let history = differentiate_twice(&Absorber, &[k, 0.0], &fixed(h), &[t], HessianPart::Diagonal).unwrap();
        let output = history.names.iter().position(|name| name == "position").unwrap();
        (history.second_derivatives(output, 0)[0] / exact - 1.0).abs()
    };
    let [coarse, fine] = [error(0.01), error(0.005)];
    assert!(fine < 1e-4 && (coarse / fine - 4.0).abs() < 0.2, "{coarse:e} {fine:e}");
}

#[test]
fn diagonal_and_product_are_those_of_the_full_hessian() {
    let (model, b, times) = (SliderCrank::rigid(), SliderCrank::DESIGN, times(0.2));
    let of = |what| differentiate_twice(&model, &b, &fixed(0.005), &times, what).unwrap();
    let v: Vec<f64> = (0..b.len()).map(|i| 0.3 + 0.2 * i as f64).collect();
    let (full, diagonal, product) = (of(HessianPart::Full), of(HessianPart::Diagonal), of(HessianPart::Times(&v)));
    let direct = differentiate(&model, &b, &fixed(0.005), &times).unwrap();
    for (output, p) in [(0, 3), (1, 2)] {
        let hessian = full.hessian(output, p).unwrap();
        let size = hessian.amax();
        for i in 0..b.len() {
            assert!((diagonal.second_derivatives(output, p)[i] - hessian[(i, i)]).abs() < 1e-12 * size);
            let row: f64 = (0..b.len()).map(|j| hessian[(i, j)] * v[j]).sum();
            assert!((product.second_derivatives(output, p)[i] - row).abs() < 1e-12 * size);
            let gradient = &direct.gradients[output][p];
            let largest = gradient.iter().fold(0.0f64, |a, x| a.max(x.abs()));
            for history in [&full, &diagonal, &product] {
                assert!((history.gradient(output, p)[i] - gradient[i]).abs() <= 1e-9 * largest, "{output} {p} {i}");
            }
        }
    }
    assert!(diagonal.hessian(0, 0).is_none());
    let short = differentiate_twice(&model, &b, &fixed(0.005), &times, HessianPart::Times(&[1.0])).unwrap_err();
    assert!(short.to_string().contains("vector to multiply the Hessian with"), "{short}");
}

#[test]
fn responses_have_the_hessians_of_the_outputs() {
    let analysis = Transient::new(Absorber, fixed(0.01), &[0.5, 1.0, 2.0]).unwrap();
    let b = [0.36, 0.48];
    let responses = analysis.analyze(&b).unwrap();
    let wanted = [(0, 2), (0, 0)].map(|(response, point)| ResponseAt { response, point });
    let hessians = analysis.curvatures(&b, &responses, &wanted).unwrap().unwrap();
    let history = differentiate_twice(&Absorber, &b, &fixed(0.01), &[0.5, 1.0, 2.0], HessianPart::Full).unwrap();
    for (at, hessian) in wanted.iter().zip(hessians) {
        assert_eq!(hessian, history.hessian(at.response, at.point).unwrap());
    }
}
