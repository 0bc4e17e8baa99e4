//! Flexible beams compared with closed forms.

use linkwright::cases::SpinningBeam;
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate};
use linkwright::mechanics::analyses::statics::{Statics, equilibria};
use linkwright::mechanics::elements::{BeamSection, Shear};
use linkwright::mechanics::integrators::generalized_alpha::GeneralizedAlpha;
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
use linkwright::mechanics::motion::ConstantSpeed;

/// Spin-up by Simo & Vu-Quoc: the tip deflects by more than 0.5 m, and at full speed the beam is straight and elongated by
/// 5.14e-4 m. A theory without centrifugal stiffening diverges.
#[test]
fn a_spinning_beam_lags_and_is_stretched_as_the_literature_says() {
    let times: Vec<f64> = (0..=300).map(|k| 0.1 * f64::from(k)).collect();
    let settings = Dynamics { scheme: GeneralizedAlpha::chung_hulbert(0.5).unwrap(), ..Dynamics::fixed(0.02) };
    let run = |elements: usize| {
        let model = SpinningBeam::published(elements);
        simulate(&model.build(&SpinningBeam::DESIGN).unwrap(), &settings, &times).unwrap()
    };
    let (coarse, fine) = (run(8), run(16));
    let exact = SpinningBeam::published(8).steady_elongation(&SpinningBeam::DESIGN);
    assert!((exact - 5.14e-4).abs() < 1e-6, "{exact:e}");
    let lag =
        |run: &linkwright::mechanics::analyses::dynamics::History| run.values[1].iter().copied().fold(0.0, f64::min);
    let end = fine.values[0].len() - 1;
    println!("lag {:.4} and {:.4} m, stretch {:.4e} of {exact:.4e} m", lag(&coarse), lag(&fine), fine.values[0][end]);
    assert!((lag(&fine) + 0.5765).abs() < 1e-3 && (lag(&coarse) / lag(&fine) - 1.0).abs() < 0.01);
    assert!((fine.values[0][end] / exact - 1.0).abs() < 1e-2, "{:e}", fine.values[0][end]);
    assert!(fine.values[1][end].abs() < 1e-3, "straight again: {:e}", fine.values[1][end]);
}

/// Tip of a cantilever under an end moment, bent to an arc. Rotations are exact for this element, positions of second order.
#[test]
fn a_cantilever_under_an_end_moment_converges_with_the_square_of_the_element_length() {
    let section = BeamSection::rectangular(0.02, 0.01, 2e11, 0.3, 7800.0);
    let angle = 0.5 * std::f64::consts::PI;
    let error = |n: usize| {
        let mut m = Mechanism::<f64>::new();
        let (nodes, _) = m.beam("strip", [[0.0, 0.0], [1.0, 0.0]], [None, None], n, &section, Shear::Flexible);
        nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
        m.load("moment", m.ground().theta, nodes[n].theta, ConstantSpeed, &[0.0, angle * section.bending]);
        let tip = m.sensor("tip", nodes[n].origin());
        for name in ["x", "y", "theta"] {
            let term = m.measure(tip, name).unwrap();
            m.output(name, &[term]);
        }
        let path: Vec<f64> = (0..=4).map(|k| 0.25 * f64::from(k)).collect();
        let computed = equilibria(&m, &Statics::default(), &path).unwrap();
        assert!((computed[2][4] - angle).abs() < 1e-8, "the rotation is exact");
        (computed[0][4] - angle.sin() / angle).hypot(computed[1][4] - (1.0 - angle.cos()) / angle)
    };
    for n in [4, 8] {
        let order = (error(n) / error(2 * n)).log2();
        assert!((order - 2.0).abs() < 0.2, "{order}");
    }
}

/// σ = M e / I + N / A at the root of a cantilever with a tip force: 6 F L / (b h²) on the outer fibres.
#[test]
fn stresses_in_the_outer_fibres_of_a_cantilever() {
    let (width, height, young, force) = (0.02, 0.01, 2e11, 10.0);
    let section = BeamSection::rectangular(width, height, young, 0.3, 7800.0);
    let mut m = Mechanism::<f64>::new();
    let (nodes, elements) = m.beam("beam", [[0.0, 0.0], [1.0, 0.0]], [None, None], 8, &section, Shear::Flexible);
    nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
    m.force("tip force", nodes[8].origin(), -std::f64::consts::FRAC_PI_2, ConstantSpeed, &[0.0, force]);
    m.force("pull", nodes[8].origin(), 0.0, ConstantSpeed, &[0.0, 10.0 * force]);
    for (name, side) in [("upper", 0.5), ("lower", -0.5)] {
        let terms = m.fibre_stress(elements[0], 0, &section, young, side * height).unwrap();
        m.output(name, &terms);
    }
    assert!(m.fibre_stress(elements[0], 2, &section, young, height).is_err());
    for (element, measure) in [(elements[0], "moment_i"), (elements[0], "normal_force"), (elements[0], "shear_force")] {
        let term = m.measure(element, measure).unwrap();
        m.output(measure, &[term]);
    }
    let load = 1e-3; // small, so that the beam stays straight
    let computed = equilibria(&m, &Statics { tolerance: 1e-14, ..Statics::default() }, &[load]).unwrap();
    let bending = 6.0 * force * load / (width * height * height);
    let pull = 10.0 * force * load / (width * height);
    let expected = [pull + bending, pull - bending, -force * load, 10.0 * force * load, -force * load];
    for (series, expected) in computed.iter().zip(expected) {
        assert!((series[0] / expected - 1.0).abs() < 2e-4, "{} instead of {expected}", series[0]);
    }
}
