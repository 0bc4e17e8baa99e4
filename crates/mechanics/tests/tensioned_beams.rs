//! Beams with normal forces: vibrations of tensioned wires, buckling, and the normal force of bent beams, in the plane and in space.

use linkwright_mechanics::analyses::statics::warn_of_equilibria;
use linkwright_mechanics::elements::spatial::{BeamSection3, LoadKind3};
use linkwright_mechanics::elements::{BeamSection, BeamShape, Shear};
use linkwright_mechanics::initial_conditions::find_equilibrium;
use linkwright_mechanics::motion::Fixed;
use linkwright_mechanics::system::System;
use linkwright_mechanics::system::state::State;
use linkwright_mechanics::{Dynamics, InitialConfiguration, Mechanism, Statics, modes, simulate};
use std::f64::consts::PI;

const SHEARS: [Shear; 2] = [Shear::Cubic, Shear::Plain];

/// Frequencies (rad/s) about the equilibrium that is found from the built positions.
fn frequencies(m: &Mechanism<f64>) -> Vec<f64> {
    let (mut system, mut state) = (System::new(m).unwrap(), State::built(m, 0.0));
    find_equilibrium(&mut system, m, &mut state, &Statics::default()).unwrap();
    modes(&mut system, m, &state).unwrap().frequencies
}

/// Frequencies of a wire of 1 m with pinned ends and the normal force `tension` (N).
fn of_pinned_wire(section: &BeamSection<f64>, tension: f64, elements: usize, shear: Shear) -> Vec<f64> {
    let mut m = Mechanism::<f64>::new();
    let shape = BeamShape { span: [[0.0, 0.0], [1.0, 0.0]], rise: 0.0, tension };
    let (nodes, _) = m.curved_beam("wire", shape, [None, None], elements, section, shear);
    [nodes[0].x, nodes[0].y, nodes[elements].x, nodes[elements].y].into_iter().for_each(|c| m.fix(c));
    frequencies(&m)
}

/// A pinned beam under tension: ω_k² = (EI (kπ/L)⁴ + T (kπ/L)²)/μ.
///
/// # Sources
/// Blevins, *Formulas for Natural Frequency and Mode Shape* (1979), Section 8.3.
#[test]
fn a_tensioned_wire_vibrates_as_a_stiff_string() {
    for (diameter, tensions) in [(1e-3, [0.0, 10.0, 100.0, 1000.0]), (3e-3, [0.0, 10.0, 100.0, 1000.0])] {
        let section = BeamSection::circular(diameter, 210e9, 0.3, 7850.0);
        let exact = |k: f64, tension: f64| {
            let wave = k * PI;
            ((section.bending * wave.powi(4) + tension * wave * wave) / section.mass).sqrt()
        };
        for tension in tensions {
            for shear in SHEARS {
                let ratios = |elements: usize| {
                    let found = of_pinned_wire(&section, tension, elements, shear);
                    [0, 1].map(|k| found[k] / exact(k as f64 + 1.0, tension) - 1.0)
                };
                let [coarse, fine] = [4, 8].map(ratios);
                println!("{diameter} m, {tension} N, {shear:?}: {coarse:.3?} with 4, {fine:.3?} with 8 elements");
                // The mass of linear interpolation has this error without tension; plain elements are too stiff in bending.
                let limit = if shear == Shear::Plain { f64::INFINITY } else { 0.06 };
                assert!(coarse[0].abs() < limit && fine[0].abs() < 0.25 * limit && fine[1].abs() < limit);
            }
        }
    }
}

/// Beyond 12 EI/ℓ² = 4.45 N with six elements, elements with a straight axis and exact bending are unstable.
#[test]
fn a_tension_that_makes_elements_unstable_is_told() {
    let section = BeamSection::circular(1e-3, 210e9, 0.3, 7850.0);
    for (tension, shear, is_told) in [
        (4.0, Shear::Flexible, false),
        (10.0, Shear::Flexible, true),
        (10.0, Shear::Rigid, true),
        (10.0, Shear::Plain, false),
        (10.0, Shear::Cubic, false),
    ] {
        let mut m = Mechanism::<f64>::new();
        let (nodes, _) = m.beam("wire", [[0.0, 0.0], [1.0, 0.0]], [None, None], 6, &section, shear);
        let tip = nodes[6];
        nodes[0].coordinates().into_iter().chain([tip.y, tip.theta]).for_each(|c| m.fix(c));
        m.load("pull", m.ground().x, tip.x, Fixed, &[tension]);
        let warning = warn_of_equilibria(&m, &Statics::default(), &[0.0]).pop();
        assert_eq!(warning.is_some(), is_told, "{tension} N, {shear:?}: {warning:?}");
        let settings = Dynamics {
            initial_configuration: InitialConfiguration::Equilibrium(Statics::default()),
            ..Dynamics::fixed(1e-4)
        };
        let run = simulate(&m, &settings, &[0.0]).unwrap();
        let told = run.warnings.iter().any(|warning| warning.contains("(and 5 more): its normal force of 1.0000e1 N"));
        assert_eq!(told, is_told, "{tension} N, {shear:?}: {:?}", run.warnings);
    }
}

/// The same in space: a wire that is fixed at one end and guided at the other, pulled by a force.
#[test]
fn a_wire_in_space_vibrates_as_in_the_plane() {
    for tension in [0.01, 4.0, 10.0, 100.0, 1000.0] {
        let shear = Shear::Cubic;
        let elements = 6;
        let planar = {
            let section = BeamSection::circular(1e-3, 210e9, 0.3, 7850.0);
            let mut m = Mechanism::<f64>::new();
            let ends = [[0.0, 0.0], [1.0, 0.0]];
            let (nodes, _) = m.beam("wire", ends, [None, None], elements, &section, shear);
            let tip = nodes[elements];
            nodes[0].coordinates().into_iter().chain([tip.y, tip.theta]).for_each(|c| m.fix(c));
            m.load("pull", m.ground().x, tip.x, Fixed, &[tension]);
            frequencies(&m)[0]
        };
        let section = BeamSection3::circular(1e-3, 210e9, 0.3, 7850.0);
        let mut m = Mechanism::<f64>::new();
        let points: Vec<[f64; 3]> = (0..=elements).map(|k| [k as f64 / elements as f64, 0.0, 0.0]).collect();
        let ground = m.ground3();
        let (nodes, _) = m.beam3("wire", &points, [0.0, 0.0, 1.0], [Some(ground), None], &section, shear);
        let (tip, axis) = (nodes[elements], [1.0, 0.0, 0.0]);
        m.prismatic3("guide", ground.origin().with_z(axis), tip.origin().with_z(axis));
        m.load3("pull", LoadKind3::Force, tip.origin(), axis, Fixed, &[tension]);
        let found = frequencies(&m);
        println!("{tension} N, {shear:?}: {planar:.3} in the plane, {:.3?} in space", &found[..2]);
        let string = PI * (tension / section.mass).sqrt();
        assert!(planar > string && planar < 23.0 * (section.bending[0] / section.mass).sqrt() + 1.2 * string);
        // The rotary inertia is lumped in space.
        assert!(found[..2].iter().all(|f| (f / planar - 1.0).abs() < 1e-4));
    }
}

/// Euler's load π² EI/L² of a pinned column: it is stable just below and unstable just above, and the error decreases with the
/// fourth power of the length of the elements.
#[test]
fn a_column_buckles_at_eulers_load() {
    let section = BeamSection { axial: 1e9, shear: 1e9, bending: 1.0, mass: 1.0, inertia: 1e-6 };
    let is_stable = |load: f64, elements: usize, shear: Shear| {
        of_pinned_wire(&section, -load, elements, shear).iter().all(|f| *f > 0.0)
    };
    let shear = Shear::Cubic;
    let error = |elements: usize| {
        let (mut low, mut high) = (0.5 * PI * PI, 2.0 * PI * PI);
        while high - low > 1e-9 {
            let middle = 0.5 * (low + high);
            if is_stable(middle, elements, shear) { low = middle } else { high = middle }
        }
        low / (PI * PI) - 1.0
    };
    let errors = [1, 2, 4, 8].map(error);
    println!("{shear:?}: {errors:.3?}");
    assert!((errors[0] - (12.0 / (PI * PI) - 1.0)).abs() < 1e-6, "one element buckles at 12 EI/L²");
    assert!(errors[2] < 1e-3 && ((errors[2] / errors[3]).log2() - 4.0).abs() < 0.2);
}

/// A wire that turns about a pin at 100 rad/s stays straight and keeps its energy: ½ μ L³ ω²/3.
#[test]
fn a_spinning_wire_stays_straight() {
    let section = BeamSection::circular(1e-3, 210e9, 0.3, 7850.0);
    let (speed, elements) = (100.0, 6);
    let shear = Shear::Cubic;
    let mut m = Mechanism::<f64>::new();
    let (nodes, _) = m.beam("wire", [[0.0, 0.0], [1.0, 0.0]], [None, None], elements, &section, shear);
    [nodes[0].x, nodes[0].y].into_iter().for_each(|c| m.fix(c));
    for (k, node) in nodes.iter().enumerate() {
        m.set_velocity(node.y, speed * k as f64 / elements as f64);
        m.set_velocity(node.theta, speed);
    }
    let energy = [m.kinetic_energy(), m.potential_energy()];
    m.output("energy", &energy);
    let sensor = m.sensor("tip", nodes[elements].origin());
    for name in ["x", "y"] {
        let term = m.measure(sensor, name).unwrap();
        m.output(name, &[term]);
    }
    let run = simulate(&m, &Dynamics::fixed(1e-4), &[0.0, 0.05, 0.1]).unwrap();
    let drift = run.values[0].iter().map(|e| (e / run.values[0][0] - 1.0).abs()).fold(0.0, f64::max);
    let (x, y) = (run.values[1][2], run.values[2][2]);
    println!("{shear:?}: energy {:.6} J changes by {drift:.1e}, tip at {x:.5}, {y:.5}", run.values[0][0]);
    assert!((run.values[0][0] / (section.mass * speed * speed / 6.0) - 1.0).abs() < 1e-3 && drift < 1e-3);
    assert!((x.hypot(y) - 1.0).abs() < 1e-3 && (y.atan2(x) - (10.0 - 4.0 * PI)).abs() < 1e-2);
}
