//! Beams in space compared with the reference problems of the field, with measured orders of convergence.

use crate::beams::{Rod, arc, distance, tip};
use crate::{times, watch};
use autodiff::Scalar;
use linkwright_mechanics::elements::Shear;
use linkwright_mechanics::elements::spatial::{BeamSection3, LoadKind3, MassProperties3};
use linkwright_mechanics::mechanism::Pose3;
use linkwright_mechanics::motion::{ConstantSpeed, Motion};
use linkwright_mechanics::{Dynamics, Mechanism, simulate};
use std::f64::consts::PI;

/// Numbers with an exponent.
fn shown(numbers: &[f64]) -> Vec<String> {
    numbers.iter().map(|number| format!("{number:.1e}")).collect()
}

/// Asserts the order `expected` of errors with halved discretizations, within `tolerance`, and prints them.
#[track_caller]
fn has_order(label: &str, errors: &[f64], expected: f64, tolerance: f64) {
    let orders: Vec<f64> = errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect();
    println!("{label}: errors {:?}, orders {orders:.2?}", shown(errors));
    assert!(orders.iter().all(|order| (order - expected).abs() < tolerance), "{label}: orders {orders:.3?}");
}

/// A straight cantilever with equal bending stiffnesses and a moment M at its tip becomes a helix about M: n = 0 and m = M, so
/// t′ = M × t / EI, whatever its torsional stiffness.
///
/// # Sources
/// Antman, *Nonlinear Problems of Elasticity* (2005), Section 8.7; Ibrahimbegović, *CMAME* 149 (1997) 49–71, for the problem.
#[test]
fn a_moment_at_the_tip_winds_a_beam_up_to_a_helix() {
    let length = 10.0;
    for (turns, torsion) in [(0.5, 100.0), (1.5, 60.0)] {
        let bending = 100.0;
        let section =
            BeamSection3 { axial: 1e4, shear: [1e4; 2], torsion, bending: [bending; 2], mass: 1.0, inertia: [0.1; 3] };
        let rate = 2.0 * PI * turns / length;
        let (sin, cos) = 0.4f64.sin_cos();
        // The moment is at 0.4 rad from the beam: the part of e_x along it is kept, the part across it turns.
        let along = [cos, 0.0, sin];
        let across = [sin * sin, 0.0, -sin * cos];
        let side = [0.0, sin, 0.0];
        let (s, c) = ((rate * length).sin() / rate, (1.0 - (rate * length).cos()) / rate);
        let exact = [0, 1, 2].map(|k| along[k] * cos * length + across[k] * s + side[k] * c);
        let moment = along.map(|x| x * rate * bending);
        let error = |elements: usize| {
            let points = arc(length, 0.0, elements);
            distance(tip(&points, &section, Shear::Flexible, LoadKind3::Torque, moment), exact) / length
        };
        let errors = [16, 32, 64].map(error);
        has_order(&format!("helix of {turns} turns, GJ = {torsion}"), &errors, 2.0, 0.1);
        assert!(errors[2] < 1e-3);
    }
}

/// The bend of 45° with 600 lb at its tip, in inches, with the digits that were published.
///
/// # Sources
/// Bathe & Bolourchi, *Int. J. Numer. Methods Eng.* 14 (1979) 961–986: displacements −13.4, −23.5 and 53.4 with 8 elements of
/// their own; their section has the torsional stiffness of a square, and shear.
#[test]
fn the_bend_of_45_degrees_has_the_published_tip() {
    let young = 1e7;
    let mut section = BeamSection3::rectangular([1.0, 1.0], young, 0.0, 1.0);
    (section.torsion, section.shear) = (0.5 * young / 6.0, [0.5 * young * 5.0 / 6.0; 2]);
    let points = arc(100.0 * PI / 4.0, PI / 4.0, 32);
    let found = tip(&points, &section, Shear::Flexible, LoadKind3::Force, [0.0, 0.0, 600.0]);
    let moved = [0, 1, 2].map(|k| found[k] - points[32][k]);
    println!("displacement {moved:.2?}");
    // The first leg is along x here, so that x is the direction of −23.5 in.
    for (moved, published) in moved.into_iter().zip([-23.5, -13.4, 53.4]) {
        assert!((moved - published).abs() < 0.25, "{moved} for {published}");
    }
}

/// The strip of the Princeton experiments: a cantilever of aluminium whose section is four times as high as wide, with a weight
/// at its tip in several directions, so that bending about both axes and torsion are coupled.
///
/// # Sources
/// Bauchau, Betsch, Cardona, Gerstmayr, Jonker, Masarati & Sonneville, *Multibody Syst. Dyn.* 37 (2016) 29–48, for the data.
#[test]
fn the_princeton_beam_converges_to_the_rod() {
    let (length, young, poisson) = (0.508, 71.7e9, 0.31);
    let section = BeamSection3::rectangular([12.377e-3, 3.2024e-3], young, poisson, 2700.0);
    // About y the strip is soft, about z stiff; the weight is turned from the stiff direction y by the angle.
    for weight in [4.448, 8.896, 13.345] {
        for degrees in [0.0f64, 30.0, 60.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let force = [0.0, weight * cos, weight * sin];
            let exact = Rod { section: &section, length, curvature: 0.0 }.tip(force);
            let error = |elements: usize| {
                let points = arc(length, 0.0, elements);
                distance(tip(&points, &section, Shear::Flexible, LoadKind3::Force, force), exact) / length
            };
            let errors = [4, 8, 16].map(error);
            let label = format!("{weight} N at {degrees}°, tip {exact:.4?}");
            has_order(&label, &errors, 2.0, 0.1);
            assert!(errors[2] < 1e-4);
        }
    }
    // Small deflections are those of beam theory: F l³/(3 EI) + F l/(G A_s) in each direction.
    let exact = |force: f64, bending: f64| force * (length.powi(3) / (3.0 * bending) + length / section.shear[0]);
    let found = tip(&arc(length, 0.0, 8), &section, Shear::Flexible, LoadKind3::Force, [0.0, 1e-3, 2e-3]);
    for (found, exact) in [(found[1], exact(1e-3, section.bending[1])), (found[2], exact(2e-3, section.bending[0]))] {
        assert!((found / exact - 1.0).abs() < 1e-5, "{found} for {exact}");
    }
}

/// A shaft without mass, clamped in bearings that turn with it, and a disc in the middle whose centre of mass is off by ε (Jeffcott
/// rotor). It starts straight: z = ε ω²/(ω_c² − ω²) (exp iωt − cos ω_c t − i ω/ω_c sin ω_c t).
///
/// # Sources
/// Childs, *Turbomachinery Rotordynamics* (1993), Section 1.2.
#[test]
fn a_shaft_whirls_below_and_above_its_critical_speed() {
    let (half, mass, offset) = (0.5, 10.0, 1e-4);
    let mut section = BeamSection3::circular(0.02, 2e11, 0.3, 1e-4);
    section.torsion *= 100.0;
    let stiffness = 2.0 / (f64::powi(half, 3) / (12.0 * section.bending[0]) + half / section.shear[0]);
    let critical = f64::sqrt(stiffness / mass);
    for ratio in [0.6, 1.7] {
        let speed = ratio * critical;
        let whirl = |step: f64| {
            let mut m = Mechanism::<f64>::new();
            let ground = m.ground3();
            let properties = MassProperties3::principal(mass, [0.2, 0.15, 0.15]).with_centre([0.0, offset, 0.0]);
            let disc = m.body3("disc", properties, Pose3::at([half, 0.0, 0.0]));
            let points = |from: f64| [[from, 0.0, 0.0], [from + half, 0.0, 0.0]];
            let up = [0.0, 0.0, 1.0];
            let (left, _) = m.beam3("left", &points(0.0), up, [None, Some(disc)], &section, Shear::Flexible);
            let (right, _) = m.beam3("right", &points(half), up, [Some(disc), None], &section, Shear::Flexible);
            let axis = [1.0, 0.0, 0.0];
            let (near, far) = (left[0], right[1]);
            let bearing = [ground.origin().with_z(axis), near.origin().with_z(axis)];
            m.revolute3("driven bearing", bearing[0], bearing[1]);
            m.drive_angle("motor", bearing[0], bearing[1], ConstantSpeed, &[0.0, speed]);
            m.cylindrical("other bearing", ground.at([2.0 * half, 0.0, 0.0]).with_z(axis), far.origin().with_z(axis));
            [near, disc, far].into_iter().for_each(|body| m.set_velocity3(body, [0.0; 3], [speed, 0.0, 0.0]));
            let sensor = m.sensor3("disc", disc.origin());
            watch(&mut m, sensor, &["y", "z"]).unwrap();
            let at = times(6.0 * PI / critical, 30);
            let values = simulate(&m, &Dynamics::fixed(step), &at).unwrap().values;
            let amplitude = offset * speed * speed / (critical * critical - speed * speed);
            let error = at.iter().enumerate().map(|(p, &t)| {
                let (s, c) = (speed * t).sin_cos();
                let (own_s, own_c) = (critical * t).sin_cos();
                let y = amplitude * (c - own_c);
                let z = amplitude * (s - ratio * own_s);
                (values[0][p] - y).hypot(values[1][p] - z) / offset
            });
            error.fold(0.0, f64::max)
        };
        let period = 2.0 * PI / critical.max(speed);
        let errors = [period / 50.0, period / 100.0, period / 200.0].map(whirl);
        has_order(&format!("whirl at {ratio} of {critical:.1} rad/s"), &errors, 2.0, 0.2);
        assert!(errors[2] < 2e-3);
    }
}

/// Rises over 1 s, falls over the next one, and is zero from then on: p = \[peak\].
struct Triangle;

impl Motion for Triangle {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        match t.re() {
            s if s < 1.0 => p[0] * t,
            s if s < 2.0 => p[0] * (-t + 2.0),
            _ => p[0] * 0.0,
        }
    }
}

/// Series of the right-angle frame: displacements of elbow and tip out of the plane, and the energy.
fn frame(elements: usize, step: f64, at: &[f64]) -> [Vec<f64>; 3] {
    let section = BeamSection3 {
        axial: 1e6,
        shear: [1e6; 2],
        torsion: 1e3,
        bending: [1e3; 2],
        mass: 1.0,
        inertia: [20.0, 10.0, 10.0],
    };
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground3();
    let at_part = |k: usize| 10.0 * k as f64 / elements as f64;
    let first: Vec<[f64; 3]> = (0..=elements).map(|k| [at_part(k), 0.0, 0.0]).collect();
    let second: Vec<[f64; 3]> = (0..=elements).map(|k| [10.0, at_part(k), 0.0]).collect();
    let up = [0.0, 0.0, 1.0];
    let (nodes, _) = m.beam3("first", &first, up, [Some(ground), None], &section, Shear::Flexible);
    let elbow = nodes[elements];
    let (nodes, _) = m.beam3("second", &second, up, [Some(elbow), None], &section, Shear::Flexible);
    m.load3("load", LoadKind3::Force, elbow.origin(), up, Triangle, &[50.0]);
    for node in [elbow, nodes[elements]] {
        let sensor = m.sensor3("sensor", node.origin());
        watch(&mut m, sensor, &["z"]).unwrap();
    }
    let terms = [m.kinetic_energy(), m.potential_energy()];
    m.output("energy", &terms);
    let mut values = simulate(&m, &Dynamics::fixed(step), at).unwrap().values.into_iter();
    std::array::from_fn(|_| values.next().unwrap())
}

/// The right-angle frame: a force out of its plane at the elbow, up to 50 over 1 s and back over another one. Bending and torsion
/// are large, and rotary inertia matters.
///
/// # Sources
/// Simo & Vu-Quoc, *CMAME* 66 (1988) 125–161, Section 6.
#[test]
fn the_right_angle_frame_converges_in_space_and_time() {
    let at = times(4.0, 16);
    let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let runs = [0.02, 0.01, 0.005, 0.0025].map(|step| frame(2, step, &at));
    for (k, name) in ["elbow", "tip"].into_iter().enumerate() {
        let changes: Vec<f64> = runs.windows(2).map(|pair| largest(&pair[0][k], &pair[1][k])).collect();
        has_order(&format!("{name}, steps"), &changes, 2.0, 0.15);
    }
    // After the load, energy is constant.
    let drift = |run: &[Vec<f64>; 3]| run[2][8..].iter().map(|e| (e / run[2][8] - 1.0).abs()).fold(0.0, f64::max);
    println!("energy {:.3} J, drift {:?}", runs[3][2][8], shown(&runs.each_ref().map(drift)));
    assert!(drift(&runs[3]) < 1e-6);
    let meshes = [2, 4, 8, 16].map(|elements| frame(elements, 0.01, &at));
    for (k, name) in ["elbow", "tip"].into_iter().enumerate() {
        let changes: Vec<f64> = meshes.windows(2).map(|pair| largest(&pair[0][k], &pair[1][k])).collect();
        has_order(&format!("{name}, elements"), &changes, 2.0, 0.25);
        println!("{name}: {:.4?}", meshes[3][k]);
    }
}
