//! Static equilibria that are unstable are told, with the first time and a coordinate, and stable and neutral ones are not.

use linkwright_mechanics::analyses::statics::warn_of_equilibria;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::elements::{BeamSection, Shear};
use linkwright_mechanics::mechanism::{Pose3, Rotation};
use linkwright_mechanics::motion::{ConstantSpeed, Fixed};
use linkwright_mechanics::{Dynamics, InitialConfiguration, Mechanism, Pose, Statics, equilibria, simulate};
use std::f64::consts::{FRAC_PI_2, PI};

fn warnings(m: &Mechanism<f64>, times: &[f64]) -> Vec<String> {
    equilibria(m, &Statics::default(), times).unwrap();
    warn_of_equilibria(m, &Statics::default(), times)
}

/// A pendulum whose mass is 0.5 m from its hinge, at this angle (rad) from the horizontal.
fn pendulum(angle: f64) -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
    let (y, x) = angle.sin_cos();
    let arm = m.body("arm", 2.0, 0.1, Pose { x: 0.5 * x, y: 0.5 * y, theta: angle });
    m.revolute("hinge", m.ground().at(0.0, 0.0), arm.at(-0.5, 0.0));
    m
}

#[test]
fn a_pendulum_is_unstable_at_the_top_only() {
    for angle in [FRAC_PI_2, 1.5] {
        let found = warnings(&pendulum(angle), &[0.0]);
        assert!(found.len() == 1 && found[0].starts_with("arm."), "{angle}: {found:?}");
        assert!(found[0].contains("at t = 0 s is unstable") && found[0].contains("small load"), "{found:?}");
    }
    for angle in [-FRAC_PI_2, -1.2] {
        assert_eq!(warnings(&pendulum(angle), &[0.0]), [""; 0], "{angle}");
    }
}

#[test]
fn a_motion_that_starts_in_an_unstable_equilibrium_is_told() {
    let initial_configuration = InitialConfiguration::Equilibrium(Statics::default());
    for (angle, count) in [(FRAC_PI_2, 1), (-FRAC_PI_2, 0)] {
        let settings = Dynamics { initial_configuration, ..Dynamics::fixed(1e-3) };
        let found = simulate(&pendulum(angle), &settings, &[0.0, 0.01]).unwrap().warnings;
        assert_eq!(found.iter().filter(|warning| warning.contains("is unstable")).count(), count, "{found:?}");
        let found = simulate(&pendulum(angle), &Dynamics::fixed(1e-3), &[0.0, 0.01]).unwrap().warnings;
        assert!(!found.iter().any(|warning| warning.contains("is unstable")), "{found:?}");
    }
}

/// A rigid bar of 1 m on a hinge with a torsion spring of 100 N·m/rad buckles under 100 N on its top: P ℓ = k.
#[test]
fn a_strut_is_unstable_from_its_critical_load_on() {
    let mut m = Mechanism::<f64>::new();
    let bar = m.body("bar", 1.0, 0.1, Pose { x: 0.0, y: 0.0, theta: 0.0 });
    m.revolute("foot", m.ground().at(0.0, 0.0), bar.at(0.0, 0.0));
    m.coordinate_spring("spring", m.ground().theta, bar.theta, [100.0, 0.0, 0.0, 0.0]);
    let top = m.body("top", 1.0, 0.1, Pose { x: 0.0, y: 1.0, theta: 0.0 });
    m.revolute("cap", bar.at(0.0, 1.0), top.at(0.0, 0.0));
    m.coordinate_spring("upright", m.ground().theta, top.theta, [1.0, 0.0, 0.0, 0.0]);
    m.load("weight", top.y, m.ground().y, ConstantSpeed, &[0.0, 100.0]);
    assert_eq!(warnings(&m, &[0.0, 0.5, 0.999]), [""; 0]);
    let found = warnings(&m, &[0.5, 0.999, 1.001, 2.0, 3.0]);
    assert!(found.len() == 1 && found[0].contains("at t = 1.001 s (and 2 more) is unstable"), "{found:?}");
}

/// A pinned beam buckles at π² EI/L².
#[test]
fn a_beam_is_unstable_beyond_the_load_of_euler() {
    let section = BeamSection::circular(0.01, 210e9, 0.3, 7850.0);
    let critical = section.bending * PI * PI;
    for (elements, part, is_told) in [(8, 0.98, false), (8, 1.02, true), (40, 0.998, false), (40, 1.002, true)] {
        let mut m = Mechanism::<f64>::new();
        let (nodes, _) = m.beam("strut", [[0.0, 0.0], [1.0, 0.0]], [None, None], elements, &section, Shear::Cubic);
        [nodes[0].x, nodes[0].y, nodes[elements].y].into_iter().for_each(|c| m.fix(c));
        m.load("push", nodes[elements].x, m.ground().x, Fixed, &[part * critical]);
        let found = warnings(&m, &[0.0]);
        assert_eq!(found.len(), usize::from(is_told), "{elements} elements, {part}: {found:?}");
    }
}

/// A balanced arm: a spring of the unloaded length 0 from a point above the hinge, with k a b = m g ℓ, holds it at every angle.
#[test]
fn neutral_equilibria_are_not_called_unstable() {
    for k in 0..40 {
        let angle = 0.1 + 0.04 * f64::from(k);
        let (mass, gravity, stiffness, a) = (1.7, 9.81, 83.0, 0.21);
        let b = mass * gravity * 0.5 / (stiffness * a);
        let (y, x) = angle.sin_cos();
        let mut m = Mechanism::<f64>::with_gravity(0.0, -gravity);
        let arm = m.body("arm", mass, 0.1, Pose { x: 0.5 * x, y: 0.5 * y, theta: angle });
        m.revolute("hinge", m.ground().at(0.0, 0.0), arm.at(-0.5, 0.0));
        m.spring_damper("balance", m.ground().at(0.0, a), arm.at(b - 0.5, 0.0), [stiffness, 0.0, 0.0]);
        let found = warn_of_equilibria(&m, &Statics::default(), &[0.0]);
        assert_eq!(found, [""; 0], "{angle}");
    }
}

/// A pendulum in space, on a hinge about y and with Euler parameters: at the top and at the bottom, with a redundant second hinge.
#[test]
fn in_space_and_with_redundant_constraints_it_is_as_in_the_plane() {
    for hinges in [1, 2] {
        for (side, count) in [(1.0, 1), (-1.0, 0)] {
            let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -9.81]);
            let (ground, axis) = (m.ground3(), [0.0, 1.0, 0.0]);
            let pose = Pose3::new([0.0, 0.0, 0.5 * side], Rotation::about_z(0.3));
            let arm = m.body3("arm", MassProperties3::principal(2.0, [0.1, 0.2, 0.3]), pose);
            let own = Rotation::about_z(-0.3).rotate(axis);
            for hinge in 0..hinges {
                let y = 0.1 * f64::from(hinge);
                let along = own.map(|x| y * x);
                let at = arm.at([along[0], along[1], -0.5 * side]);
                m.revolute3(&format!("hinge {hinge}"), ground.at([0.0, y, 0.0]).with_z(axis), at.with_z(own));
            }
            let found = warnings(&m, &[0.0]);
            assert_eq!(found.len(), count, "{hinges} hinges, {side}: {found:?}");
        }
    }
}

/// A force that turns with its body has no potential: such equilibria are not examined, also beyond the load of divergence or flutter.
#[test]
fn equilibria_with_follower_forces_are_not_examined() {
    let section = BeamSection::circular(0.01, 210e9, 0.3, 7850.0);
    let mut m = Mechanism::<f64>::new();
    let (nodes, _) = m.beam("strut", [[0.0, 0.0], [1.0, 0.0]], [None, None], 6, &section, Shear::Cubic);
    nodes[0].coordinates().into_iter().for_each(|c| m.fix(c));
    m.follower_force("thrust", nodes[6].at(0.0, 0.0), PI, Fixed, &[10.0 * section.bending]);
    assert_eq!(warnings(&m, &[0.0]), [""; 0]);
}
