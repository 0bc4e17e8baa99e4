//! Published solutions and closed forms.

use crate::zoo::absorber_displacement;
use linkwright::cases::{Absorber, Andrews, Chain, SliderCrank};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate, simulate_explicitly};
use linkwright::mechanics::analyses::kinematics::kinematics;
use linkwright::mechanics::analyses::statics::{Statics, equilibria};
use linkwright::mechanics::elements::{BeamSection, Shear};
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::mechanics::integrators::explicit::Explicit;
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
use linkwright::mechanics::motion::ConstantSpeed;
use linkwright::responses::mechanism::Transient;

#[test]
fn squeezer_reaches_its_published_angles() {
    let mechanism = Andrews.build(&Andrews::DESIGN).unwrap();
    let error = |values: Vec<Vec<f64>>| {
        let relative = |(v, r): (&Vec<f64>, f64)| (v[0] / r - 1.0).abs();
        values.iter().zip(Andrews::REFERENCE).map(relative).fold(0.0, f64::max)
    };
    let implicit = error(simulate(&mechanism, &Dynamics::fixed(1e-5), &[0.03]).unwrap().values);
    assert!(implicit < 3e-5, "{implicit:.2e}");
    let explicit = error(simulate_explicitly(&mechanism, &Explicit::adaptive(1e-12), &[0.03]).unwrap().values);
    assert!(explicit < 1e-8, "{explicit:.2e}");
    let eighth = error(simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-11), &[0.03]).unwrap().values);
    assert!(eighth < 1e-8, "{eighth:.2e}");
}

#[test]
fn a_chain_keeps_its_energy_and_its_joints() {
    let chain = Chain::horizontal(4);
    let mechanism = chain.build(&chain.equal_links()).unwrap();
    let times: Vec<f64> = (0..=20).map(|k| 0.1 * f64::from(k)).collect();
    let run = simulate_explicitly(&mechanism, &Explicit::adaptive(1e-10), &times).unwrap();
    for k in 0..times.len() {
        let total = run.values[2][k] + run.values[3][k];
        assert!(total.abs() < 1e-7, "{total:.2e} J at {} s", times[k]); // at the height of the hook, at rest
    }
    let run = simulate(&mechanism, &Dynamics::fixed(2e-3), &times).unwrap();
    let last = run.values[2][20] + run.values[3][20];
    assert!(last.abs() < 2e-2, "{last:.2e} J with implicit steps");
}

/// Small swings of a rod: T = 2π sqrt(2L / 3g).
#[test]
fn a_pendulum_swings_with_its_period() {
    let angle = -std::f64::consts::FRAC_PI_2 + 1e-3;
    let pendulum = Chain { angle, ..Chain::horizontal(1) };
    let mechanism = pendulum.build(&[1.0, 2.0]).unwrap();
    let period = std::f64::consts::TAU * (2.0 / (3.0 * 9.81f64)).sqrt();
    let run = simulate_explicitly(&mechanism, &Explicit::adaptive(1e-11), &[0.25 * period, period]).unwrap();
    assert!(run.values[0][0].abs() < 1e-8 && (run.values[0][1] - angle.cos()).abs() < 1e-8, "{:?}", run.values[0]);
}

/// x = r cos φ + sqrt(l² − r² sin² φ), and power in = power of the slider's and the rods' inertia.
#[test]
fn slider_crank_kinematics_and_torque() {
    let b = SliderCrank::DESIGN;
    let model = SliderCrank::rigid();
    let mechanism = model.build(&b).unwrap();
    let times: Vec<f64> = (0..40).map(|k| 0.0137 * f64::from(k)).collect();
    let series = kinematics(&mechanism, Assembly::default(), &times).unwrap();
    let run = simulate(&mechanism, &Dynamics::fixed(0.0137 / 64.0), &times).unwrap();
    for (k, t) in times.iter().enumerate() {
        let phi = model.speed * t;
        let exact = b[0] * phi.cos() + (b[1] * b[1] - (b[0] * phi.sin()).powi(2)).sqrt();
        assert!((series[0][k] - exact).abs() < 1e-12, "{k}");
        assert!((run.values[0][k] - exact).abs() < 1e-9, "{k}: {}", run.values[0][k] - exact);
        assert!((run.values[3][k] - series[3][k]).abs() < 2e-2, "{k}: {} {}", run.values[3][k], series[3][k]);
    }
}

#[test]
fn a_stiff_rod_moves_like_a_rigid_one() {
    let b = SliderCrank::DESIGN;
    let times: Vec<f64> = (1..=20).map(|k| 0.01 * f64::from(k)).collect();
    let rigid = kinematics(&SliderCrank::rigid().build(&b).unwrap(), Assembly::default(), &times).unwrap();
    let flexible = SliderCrank { elements: 4, young: 2.1e14, ..SliderCrank::rigid() };
    let run = simulate(&flexible.build(&b).unwrap(), &Dynamics::fixed(5e-4), &times).unwrap();
    for (k, x) in rigid[0].iter().enumerate() {
        assert!((run.values[0][k] - x).abs() < 2e-6, "{k}: {:.2e}", run.values[0][k] - x);
    }
}

/// A cantilever under the end moment 2π EI / L becomes a full circle, which this element represents exactly.
#[test]
fn a_cantilever_rolls_up_to_a_circle() {
    let section = BeamSection::rectangular(0.02, 0.01, 2e11, 0.3, 7800.0);
    let mut m = Mechanism::<f64>::new();
    let (nodes, elements) = m.beam("strip", [[0.0, 0.0], [1.0, 0.0]], [None, None], 10, &section, Shear::Flexible);
    nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
    let moment = std::f64::consts::TAU * section.bending;
    m.load("end moment", m.ground().theta, nodes[10].theta, ConstantSpeed, &[0.0, moment]);
    let tip = m.sensor("tip", nodes[10].origin());
    for (element, name) in [(tip, "x"), (tip, "y"), (tip, "theta"), (elements[0], "moment_i")] {
        let term = m.measure(element, name).unwrap();
        m.output(name, &[term]);
    }
    let path: Vec<f64> = (0..=8).map(|k| f64::from(k) / 8.0).collect();
    let series = equilibria(&m, &Statics::default(), &path).unwrap();
    for (k, load) in path.iter().enumerate() {
        assert!((series[2][k] - std::f64::consts::TAU * load).abs() < 1e-8, "rotation {k}");
        assert!((series[3][k] - moment * load).abs() < 1e-5 * moment, "moment {k}");
    }
    assert!(series[0][8].abs() < 1e-8 && series[1][8].abs() < 1e-8, "{} {}", series[0][8], series[1][8]);
    // At half the moment the exact tip is at (0, 2L/π); the polygon of ten chords has an error of order h².
    let chord = 2.0 / std::f64::consts::PI;
    assert!((series[1][4] / chord - 1.0).abs() < 1e-2, "{} {chord}", series[1][4]);
}

/// The impact absorber of Table I as a mechanism: responses and sensitivities of the closed form on its time grid.
#[test]
fn impact_absorber_has_its_closed_form() {
    use linkwright::problem::{Analysis, ResponseAt};
    let times: Vec<f64> = (0..=100).map(|k| 0.12 * f64::from(k)).collect();
    let analysis = Transient::new(Absorber, Explicit::eighth_order(1e-12), &times).unwrap();
    let b = [0.3628, 0.4823];
    let responses = analysis.analyze(&b).unwrap();
    let wanted: Vec<ResponseAt> = (0..=100).map(|point| ResponseAt { response: 0, point }).collect();
    let gradients = analysis.sensitivities(&b, &responses, &wanted).unwrap();
    for (p, &t) in times.iter().enumerate() {
        assert!((responses.values[0][p] - absorber_displacement(&b, t)).abs() < 1e-10, "{p}");
        let e = 1e-3;
        let displacement = |h: f64| absorber_displacement(&[b[0] + h, b[1]], t);
        let difference = |h: f64| (displacement(h) - displacement(-h)) / (2.0 * h);
        let exact = (4.0 * difference(e / 2.0) - difference(e)) / 3.0;
        assert!((gradients[(p, 0)] - exact).abs() < 1e-8, "{p}: {} {exact}", gradients[(p, 0)]);
    }
}
