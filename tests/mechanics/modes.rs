//! Natural frequencies, their convergence and their derivatives.

use crate::zoo::Arm;
use linkwright::autodiff::Scalar;
use linkwright::cases::{Absorber, Chain, Governor};
use linkwright::mechanics::analyses::modal::modes;
use linkwright::mechanics::analyses::statics::{Statics, find_equilibrium};
use linkwright::mechanics::derivatives::modal::{About, ModeSensitivities, differentiate_modes};
use linkwright::mechanics::elements::{BeamSection, Shear};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
use linkwright::mechanics::system::System;
use linkwright::mechanics::system::state::State;

fn close(computed: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(computed.len(), expected.len());
    let largest = expected.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    for (a, b) in computed.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance * largest, "{computed:?} instead of {expected:?}");
    }
}

#[test]
fn a_mass_on_a_spring_has_its_closed_form() {
    let computed = differentiate_modes(&Absorber, &[3.0, 0.4], About::Assembled, 0.0).unwrap();
    close(&computed.squares, &[3.0], 1e-14);
    close(&computed.gradients[0], &[1.0, 0.0], 1e-14);
}

/// ω² = 3g / 2L for a hanging rod: constraints, and the geometric stiffness of their reactions.
#[test]
fn a_hanging_rod_has_its_closed_form() {
    let rod = Chain { angle: -std::f64::consts::FRAC_PI_2, ..Chain::horizontal(1) };
    let computed = differentiate_modes(&rod, &[0.8, 2.0], About::Equilibrium(Statics::default()), 0.0).unwrap();
    let square = 1.5 * 9.81 / 0.8;
    close(&computed.squares, &[square], 1e-10);
    close(&computed.gradients[0], &[-square / 0.8, 0.0], 1e-10);
}

/// About cos α = (m + M) g / (m L Ω²), from its energy.
#[test]
fn a_governor_vibrates_about_its_equilibrium() {
    let (model, b) = (Governor { angle: 1.0 }, Governor::DESIGN);
    let computed = differentiate_modes(&model, &b, About::Equilibrium(Statics::default()), 0.0).unwrap();
    // U(α) = −2(m + M) g L cos α − m L² Ω² sin² α, T = ½ α̇² (2 m L² + 4 M L² sin² α).
    let exact = |b: &[f64]| {
        let [m, sleeve, l, speed, g] = [b[0], b[1], b[2], b[3], b[4]];
        let cos = (m + sleeve) * g / (m * l * speed * speed);
        let sin2 = 1.0 - cos * cos;
        let stiffness = 2.0 * (m + sleeve) * g * l * cos - 2.0 * m * (l * speed).powi(2) * (2.0 * cos * cos - 1.0);
        stiffness / (2.0 * m * l * l + 4.0 * sleeve * l * l * sin2)
    };
    close(&computed.squares, &[exact(&b)], 1e-9);
    for k in 0..b.len() {
        let moved = |h: f64| {
            let mut b = b;
            b[k] *= 1.0 + h;
            exact(&b)
        };
        let derivative = (8.0 * (moved(1e-3) - moved(-1e-3)) - (moved(2e-3) - moved(-2e-3))) / (12e-3 * b[k]);
        assert!((computed.gradients[0][k] - derivative).abs() < 1e-7 * (exact(&b) / b[k]).abs(), "{k}: {derivative}");
    }
}

/// A clamped arm deflected by its weight: prestress, clamps, a fixed joint and a tip mass.
#[test]
fn frequencies_of_a_sagging_arm_agree_with_differences() {
    let (model, settings) = (Arm { elements: 3 }, Statics { tolerance: 1e-12, ..Statics::default() });
    let computed: ModeSensitivities =
        differentiate_modes(&model, &Arm::DESIGN, About::Equilibrium(settings), 0.0).unwrap();
    let squares = |b: &[f64]| -> Vec<f64> {
        let mechanism = model.build(b).unwrap();
        let mut system = System::new(&mechanism).unwrap();
        let mut state = State::built(&mechanism, 0.0);
        find_equilibrium(&mut system, &mechanism, &mut state, &settings).unwrap();
        modes(&mut system, &mechanism, &state).unwrap().frequencies.iter().map(|w| w * w).collect()
    };
    let mut worst = 0.0f64;
    for k in 0..Arm::DESIGN.len() {
        let at = |h: f64| {
            let mut b = Arm::DESIGN;
            b[k] *= 1.0 + h;
            squares(&b)
        };
        let h = 2e-2;
        let runs = [h, 0.5 * h, 0.25 * h].map(|h| [at(h), at(-h)]);
        for (mode, gradient) in computed.gradients.iter().enumerate().take(6) {
            let central = |j: usize, h: f64| (runs[j][0][mode] - runs[j][1][mode]) / (2.0 * h);
            let differences = [central(0, h), central(1, 0.5 * h), central(2, 0.25 * h)];
            let [one, two] = [0, 1].map(|j| (4.0 * differences[j + 1] - differences[j]) / 3.0);
            let derivative = (16.0 * two - one) / 15.0;
            worst = worst.max((gradient[k] * Arm::DESIGN[k] - derivative).abs() / computed.squares[mode]);
        }
    }
    println!("| flexible arm | modes about its equilibrium | {worst:.1e} |");
    assert!(worst < 1e-7, "{worst:.2e}");
}

/// Two equal oscillators, coupled by a third spring of zero stiffness.
struct Twins;

impl ParametricMechanism for Twins {
    fn build<S: Scalar>(&self, b: &[S]) -> linkwright::Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let ground = m.ground().x;
        let [one, two] = [m.coordinate("one", zero, zero), m.coordinate("two", zero, zero)];
        for (name, x, k) in [("one", one, b[0]), ("two", two, b[1])] {
            m.inertia(name, x, S::from(1.0));
            m.coordinate_spring(name, ground, x, [k, zero, zero, zero]);
        }
        m.coordinate_spring("between", one, two, [b[2], zero, zero, zero]);
        Ok(m)
    }
}

/// A larger k₁ or k₂ raises one of the two frequencies; the coupling raises one of them twice as fast.
#[test]
fn a_repeated_frequency_splits_into_its_one_sided_derivatives() {
    let computed = differentiate_modes(&Twins, &[4.0, 4.0, 0.0], About::Assembled, 0.0).unwrap();
    close(&computed.squares, &[4.0, 4.0], 1e-14);
    close(&computed.gradients[0], &[0.0, 0.0, 0.0], 1.0e-13);
    close(&computed.gradients[1], &[1.0, 1.0, 2.0], 1e-13);
    // Frequencies that differ by more than rounding have their own gradients.
    let apart = differentiate_modes(&Twins, &[4.0, 5.0, 0.0], About::Assembled, 0.0).unwrap();
    close(&apart.gradients[0], &[1.0, 0.0, 1.0], 1e-13);
}

/// Two oscillators without coupling: each gradient is that of one of them, so that a change of both stiffnesses is predicted, too.
#[test]
fn frequencies_of_modes_that_do_not_interact_have_the_gradients_of_their_branches() {
    struct Apart;
    impl ParametricMechanism for Apart {
        fn build<S: Scalar>(&self, b: &[S]) -> linkwright::Result<Mechanism<S>> {
            Twins.build(&[b[0], b[1], S::from(0.0)])
        }
    }
    let computed = differentiate_modes(&Apart, &[4.0, 4.0], About::Assembled, 0.0).unwrap();
    let mut gradients = computed.gradients;
    gradients.sort_by(|a, b| b[0].total_cmp(&a[0]));
    close(&gradients[0], &[1.0, 0.0], 1e-13);
    close(&gradients[1], &[0.0, 1.0], 1e-13);
}

/// βL of a clamped-free beam: 1.8751, 4.6941, 7.8548 (Blevins, *Formulas for Natural Frequency and Mode Shape*, Table 8-1).
#[test]
fn cantilever_frequencies_converge_with_the_square_of_the_element_length() {
    let section = BeamSection { inertia: 1e-9, ..BeamSection::<f64>::rectangular(0.01, 0.01, 2e11, 0.3, 7800.0) };
    let errors = |n: usize| -> Vec<f64> {
        let mut m = Mechanism::<f64>::new();
        let (nodes, _) = m.beam("beam", [[0.0, 0.0], [1.0, 0.0]], [None, None], n, &section, Shear::Rigid);
        nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
        let mut system = System::new(&m).unwrap();
        let computed = modes(&mut system, &m, &State::built(&m, 0.0)).unwrap().frequencies;
        let unit = (section.bending / section.mass).sqrt();
        let exact = [1.875_104_07, 4.694_091_13, 7.854_757_44].map(|beta: f64| beta * beta * unit);
        exact.iter().zip(computed).map(|(exact, computed)| computed / exact - 1.0).collect()
    };
    for (coarse, fine) in errors(12).iter().zip(errors(24)) {
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() < 0.2, "{order}: {coarse:.2e} {fine:.2e}");
    }
}
