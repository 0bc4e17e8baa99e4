//! Semi-analytical derivatives compared with direct ones: differenced residuals and dual numbers, of one discrete motion.

use crate::zoo::{Arm, Drives, Forces, Joints, fixed};
use linkwright::autodiff::Scalar;
use linkwright::cases::{Absorber, Andrews, Chain, FourBar, RigidFourBar, SliderCrank, SpinningBeam};
use linkwright::mechanics::analyses::dynamics::{Dynamics, InitialAcceleration};
use linkwright::mechanics::analyses::statics::Statics;
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::instants::{differentiate_equilibria, differentiate_kinematics};
use linkwright::mechanics::derivatives::history::SensitiveHistory;
use linkwright::mechanics::derivatives::method::Differentiation;
use linkwright::mechanics::derivatives::semi_analytical::{
    STEP, difference_equilibria, difference_kinematics, differentiate_semi_analytically,
};
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::mechanics::integrators::explicit::Explicit;
use linkwright::mechanics::integrators::generalized_alpha::Prescribed;
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
use linkwright::responses::mechanism::Transient;

/// Largest deviation of a derivative, all scaled by the size of the variables, relative to the largest derivative of the same
/// output. Outputs that are nearly zero are compared with `floor` times the largest derivative of all.
fn deviation(b: &[f64], floor: f64, exact: &SensitiveHistory, computed: &SensitiveHistory) -> f64 {
    let scaled =
        |gradient: &[f64]| gradient.iter().zip(b).map(|(s, b)| (s * b.abs().max(1e-3)).abs()).fold(0.0, f64::max);
    let of = |series: &Vec<Vec<f64>>| series.iter().map(|gradient| scaled(gradient)).fold(0.0, f64::max);
    let of_all = exact.gradients.iter().map(of).fold(0.0, f64::max);
    let mut worst = 0.0f64;
    for (exact, computed) in exact.gradients.iter().zip(&computed.gradients) {
        let size = of(exact).max(floor * of_all);
        for (exact, computed) in exact.iter().zip(computed) {
            let off: Vec<f64> = exact.iter().zip(computed).map(|(exact, computed)| exact - computed).collect();
            worst = worst.max(scaled(&off) / size);
        }
    }
    worst
}

/// Relative steps; the second is the default.
const STEPS: [f64; 4] = [1e-4, STEP, 1e-6, 1e-7];

fn row(name: &str, worst: [f64; 4], allowed: f64) {
    println!("| {name} | {} |", worst.map(|x| format!("{x:.0e}")).join(" | "));
    assert!(worst[1] < allowed, "{name}: {:.2e}", worst[1]);
}

/// Output times at the start, between steps and at their ends.
fn check<M: ParametricMechanism>(name: &str, model: &M, b: &[f64], settings: Dynamics, end: f64, allowed: f64) {
    check_down_to(1e-4, name, model, b, settings, end, allowed);
}

fn check_down_to<M: ParametricMechanism>(
    floor: f64,
    name: &str,
    model: &M,
    b: &[f64],
    settings: Dynamics,
    end: f64,
    allowed: f64,
) {
    let times = [0.0, 0.237, 0.5, 0.7312, 1.0].map(|fraction| fraction * end);
    let exact = differentiate(model, b, &settings, &times).unwrap();
    let worst = STEPS.map(|step| {
        let computed = differentiate_semi_analytically(model, b, &settings, &times, step).unwrap();
        assert_eq!((&computed.values, computed.work), (&exact.values, exact.work));
        deviation(b, floor, &exact, &computed)
    });
    row(name, worst, allowed);
}

#[test]
fn every_element_force_and_drive() {
    check("all forces", &Forces, &Forces::DESIGN, fixed(0.02), 0.6, 1e-6);
    check("all joints", &Joints { length_driver: false }, &Joints::DESIGN, fixed(0.04), 0.24, 1e-6);
    check("a driven length", &Joints { length_driver: true }, &Joints::DESIGN, fixed(0.04), 0.24, 1e-6);
    check("all drives", &Drives, &Drives::DESIGN, fixed(0.02), 0.6, 1e-6);
    let newmark =
        Dynamics { prescribed: Prescribed::Newmark, initial_acceleration: InitialAcceleration::Zero, ..fixed(0.02) };
    check("all drives, from positions", &Drives, &Drives::DESIGN, newmark, 0.6, 1e-6);
}

#[test]
fn the_reference_mechanisms() {
    check("impact absorber", &Absorber, &[0.36, 0.48], fixed(0.01), 2.0, 1e-8);
    check("impact absorber, adaptive steps", &Absorber, &[0.36, 0.48], Dynamics::adaptive(1e-6), 2.0, 1e-8);
    check("Andrews' mechanism", &Andrews, &Andrews::DESIGN, fixed(1e-4), 0.03, 1e-5);
    let chain = Chain::horizontal(6);
    check("chain of six links", &chain, &chain.equal_links(), fixed(0.01), 0.5, 1e-6);
    check("slider-crank", &SliderCrank::rigid(), &SliderCrank::DESIGN, fixed(0.005), 0.2, 1e-5);
    let b = [0.0385, 0.0252, 0.02];
    for (name, four_bar) in [("as published", FourBar::as_published()), ("physical", FourBar::physical())] {
        let name = format!("flexible four-bar, {name}");
        // All outputs are moments; those at pins are a hundred-thousandth of the others, and below their rounding.
        check_down_to(1e-2, &name, &four_bar, &b, four_bar.dynamics().unwrap(), 0.5, 1e-4);
    }
    check("rigid four-bar", &RigidFourBar(FourBar::physical()), &b, fixed(0.005), 0.2, 1e-6);
}

#[test]
fn beams_that_turn_far_lose_digits() {
    check("clamped beam", &Arm { elements: 4 }, &Arm::DESIGN, fixed(0.02), 0.3, 1e-4);
    for elements in [2, 4, 8, 16] {
        let beam = SpinningBeam { elements, speed: 6.0, duration: 0.455 };
        check(&format!("spinning beam, {elements} elements"), &beam, &SpinningBeam::DESIGN, fixed(0.02), 0.6, 1e-3);
    }
}

#[test]
fn kinematics_and_statics() {
    let times: Vec<f64> = (0..20).map(|k| 0.02 * f64::from(k)).collect();
    let (model, b) = (SliderCrank::rigid(), SliderCrank::DESIGN);
    let exact = differentiate_kinematics(&model, &b, Assembly::default(), &times).unwrap();
    let worst = STEPS.map(|step| {
        let computed = difference_kinematics(&model, &b, Assembly::default(), &times, step).unwrap();
        deviation(&b, 1e-4, &exact, &computed)
    });
    row("slider-crank, kinematics and inverse dynamics", worst, 1e-8);
    let (model, b, settings) = (Arm { elements: 4 }, Arm::DESIGN, Statics { tolerance: 1e-12, ..Statics::default() });
    let exact = differentiate_equilibria(&model, &b, &settings, &times[..3]).unwrap();
    let worst = STEPS.map(|step| {
        let computed = difference_equilibria(&model, &b, &settings, &times[..3], step).unwrap();
        deviation(&b, 1e-4, &exact, &computed)
    });
    row("clamped beam, statics", worst, 1e-6);
}

#[test]
fn invalid_steps_explicit_methods_and_changing_models_are_rejected() {
    let settings = fixed(0.01);
    for step in [0.0, -1e-6, 1.0, f64::NAN] {
        let error = differentiate_semi_analytically(&Absorber, &[0.36, 0.48], &settings, &[0.1], step).unwrap_err();
        assert!(error.to_string().contains("relative step"), "{error}");
        assert!(Transient::new(Absorber, settings, &[0.1]).unwrap().with_perturbation(step).is_err());
    }
    let explicit = Transient::new(Absorber, Explicit::adaptive(1e-9), &[0.1]).unwrap();
    let error = explicit.differentiating(Differentiation::SemiAnalytical).err().unwrap();
    assert!(error.to_string().contains("no semi-analytical derivatives"), "{error}");
    let error = differentiate_semi_analytically(&Growing, &[1.0], &settings, &[0.1], 1e-3).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("different elements"), "{error}");
}

/// A model whose design decides how many elements it has.
struct Growing;

impl ParametricMechanism for Growing {
    fn build<S: Scalar>(&self, b: &[S]) -> linkwright::Result<Mechanism<S>> {
        let mut m = Mechanism::new();
        for k in 0..if b[0].re() > 1.0 { 2 } else { 1 } {
            let cart = m.coordinate("cart", S::from(0.0), S::from(1.0));
            m.inertia(&format!("mass {k}"), cart, b[0]);
        }
        Ok(m)
    }
}
