//! Energy of motions that conserve it, singular positions, and inputs that make results doubtful.

use linkwright_mechanics::elements::{BeamSection, Shear};
use linkwright_mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright_mechanics::mechanism::{Body, Mechanism, Pose};
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Harmonic};
use linkwright_mechanics::{
    Assembly, Dynamics, Error, GeneralizedAlpha, History, Result, kinematics, simulate, simulate_explicitly,
};
use std::f64::consts::FRAC_PI_2;

/// A uniform bar of 1 kg and 1 m from (x, y) at the angle θ.
fn bar(m: &mut Mechanism<f64>, name: &str, [x, y]: [f64; 2], theta: f64) -> Body {
    let (sin, cos) = theta.sin_cos();
    m.body(name, 1.0, 1.0 / 12.0, Pose { x: x + 0.5 * cos, y: y + 0.5 * sin, theta })
}

/// N parallelograms in a row, benchmark A02 of the IFToMM library: uniform bars of 1 m and 1 kg, vertical at the start, where
/// the upper joints move with 1 m/s. All bars are in line twice in each turn: the position is singular.
///
/// # Sources
/// González, Dopico, Naya & Cuadrado, *Multibody Syst. Dyn.* 16 (2006) 211–228.
fn four_bars(n: usize) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let cranks: Vec<Body> = (0..=n)
        .map(|k| {
            let crank = bar(&mut m, &format!("crank {k}"), [k as f64, 0.0], FRAC_PI_2);
            let [x, _, theta] = crank.coordinates();
            m.set_velocity(x, 0.5);
            m.set_velocity(theta, -1.0);
            m.revolute(&format!("foot {k}"), m.ground().at(k as f64, 0.0), crank.at(-0.5, 0.0));
            crank
        })
        .collect();
    for k in 0..n {
        let coupler = bar(&mut m, &format!("coupler {k}"), [k as f64, 1.0], 0.0);
        let [x, ..] = coupler.coordinates();
        m.set_velocity(x, 1.0);
        m.revolute(&format!("left {k}"), cranks[k].at(0.5, 0.0), coupler.at(-0.5, 0.0));
        m.revolute(&format!("right {k}"), cranks[k + 1].at(0.5, 0.0), coupler.at(0.5, 0.0));
    }
    m
}

fn times(end: f64, count: usize) -> Vec<f64> {
    (1..=count).map(|k| end * k as f64 / count as f64).collect()
}

/// A motion through singular positions keeps its energy, or a warning says that it does not, or the analysis stops and names
/// the singular position.
fn is_told(n: usize, label: &str, outcome: Result<History>) {
    match outcome {
        Ok(history) => {
            let drift = history.energy_drift.unwrap();
            println!("{n} {label}: energy changes by {:.2e} J of {:.2e} J", drift.largest, drift.kinetic);
            let is_kept = drift.relative().abs() <= 0.01;
            assert!(
                is_kept || history.warnings.iter().any(|warning| warning.contains("of its largest kinetic energy"))
            );
        }
        Err(error) => {
            println!("{n} {label}: {error}");
            assert!(error.to_string().contains("singular position at t = "), "{n} {label}: {error}");
        }
    }
}

#[test]
fn a_row_of_four_bars_passes_its_singular_position_or_names_it() {
    for n in [1, 2, 4, 10, 40] {
        let (m, times) = (four_bars(n), times(if n < 3 { 10.0 } else { 3.0 }, 1000));
        if n < 10 {
            is_told(n, "order 8", simulate_explicitly(&m, &Explicit::eighth_order(1e-10), &times));
            let fixed = Explicit::adaptive(1.0).with_step_control(StepControl::Fixed(2e-3));
            is_told(n, "order 5, 2 ms", simulate_explicitly(&m, &fixed, &times));
        }
        is_told(n, "generalized-α, 2 ms", simulate(&m, &Dynamics::fixed(2e-3), &times));
    }
}

/// A bar on a pin with a spring conserves its energy; with a damper, a load, a drive or a contact there is no such statement.
#[test]
fn conservative_mechanisms_are_recognized() {
    let drift = |change: &dyn Fn(&mut Mechanism<f64>, Body)| {
        let mut m = Mechanism::with_gravity(0.0, -9.81);
        let bar = bar(&mut m, "bar", [0.0, 0.0], 0.3);
        m.revolute("pin", m.ground().origin(), bar.at(-0.5, 0.0));
        m.spring_damper("spring", m.ground().at(0.0, 1.0), bar.at(0.5, 0.0), [20.0, 0.0, 0.5]);
        change(&mut m, bar);
        let explicit = simulate_explicitly(&m, &Explicit::eighth_order(1e-11), &times(2.0, 40)).unwrap();
        let implicit = simulate(&m, &Dynamics::fixed(1e-3), &times(2.0, 40)).unwrap();
        assert_eq!(explicit.energy_drift.is_some(), implicit.energy_drift.is_some());
        explicit.energy_drift.map(|drift| drift.relative().abs())
    };
    // At output times between steps the state is interpolated, and less accurate than at the ends of steps.
    let small = |drift: Option<f64>| {
        println!("{drift:?}");
        drift.is_some_and(|drift| drift < 1e-5)
    };
    assert!(small(drift(&|_, _| {})));
    assert!(small(drift(
        &|m, bar| _ = m.coordinate_spring("torsion", m.ground().theta, bar.theta, [3.0, 0.0, 0.1, 0.0])
    )));
    assert_eq!(
        drift(&|m, bar| _ = m.coordinate_spring("damper", m.ground().theta, bar.theta, [3.0, 0.1, 0.1, 0.0])),
        None
    );
    assert_eq!(drift(&|m, bar| _ = m.load("load", m.ground().theta, bar.theta, Fixed, &[0.0])), None);
    assert_eq!(drift(&|m, bar| _ = m.friction("friction", m.ground().theta, bar.theta, [0.1, 0.1, 0.0])), None);
    let driven = |m: &mut Mechanism<f64>, _: Body| {
        let crank = bar(m, "crank", [2.0, 0.0], 0.0);
        let [x, y, theta] = crank.coordinates();
        m.fix(x);
        m.fix(y);
        m.drive(theta, Harmonic, &[0.0, 0.1, 3.0, 0.0]);
    };
    assert_eq!(drift(&driven), None);
}

/// A spinning beam conserves its energy; numerical damping of coarse steps takes some of it, and a warning says how much.
#[test]
fn a_scheme_that_loses_energy_says_so() {
    let run = |h: f64, rho: f64| {
        let mut m = Mechanism::with_gravity(0.0, -9.81);
        let section = BeamSection::rectangular(0.02, 0.01, 2e9, 0.3, 1500.0);
        let (nodes, _) = m.beam("beam", [[0.0, 0.0], [1.0, 0.0]], [None, None], 4, &section, Shear::Flexible);
        let [x, y, _] = nodes[0].coordinates();
        m.fix(x);
        m.fix(y);
        let scheme = GeneralizedAlpha::chung_hulbert(rho).unwrap();
        simulate(&m, &Dynamics { scheme, ..Dynamics::fixed(h) }, &times(1.0, 20)).unwrap()
    };
    let (coarse, fine) = (run(5e-2, 0.0), run(5e-4, 0.9));
    println!("{:?}\n{:?}\n{:?}", coarse.energy_drift, fine.energy_drift, coarse.warnings);
    assert!(coarse.warnings.iter().any(|warning| warning.contains("loses") && warning.contains("shorter steps")));
    assert!(fine.warnings.is_empty(), "{:?}", fine.warnings);
}

#[test]
fn doubtful_inputs_are_warnings() {
    let build = |stiffness: f64, damping: f64| {
        let mut m = Mechanism::with_gravity(0.0, -9.81);
        let bar = bar(&mut m, "bar", [0.0, 0.0], 0.3);
        m.revolute("pin", m.ground().origin(), bar.at(-0.5, 0.0));
        m.spring_damper("spring", m.ground().at(0.0, 1.0), bar.at(0.5, 0.0), [stiffness, damping, 0.5]);
        m
    };
    let warnings = |m: &Mechanism<f64>, h: f64| simulate(m, &Dynamics::fixed(h), &times(0.1, 100)).unwrap().warnings;
    assert_eq!(warnings(&build(20.0, 1.0), 1e-3), Vec::<String>::new());
    let negative = warnings(&build(-20.0, -1.0), 1e-3);
    assert!(negative[0].starts_with("spring: its stiffness of -20 N/m pushes away"), "{negative:?}");
    assert!(negative[1].starts_with("spring: its damping of -1 N·s/m adds energy"), "{negative:?}");
    let long = warnings(&build(20.0, 1.0), 2e-2);
    assert!(long[0].contains("time step of 2.000e-2 s") && long[0].contains("1.0e-3 s or less"), "{long:?}");
}

/// A crank of 0.3 m drives a rocker of 0.5 m, 1 m apart, over a coupler of 0.6 m: the loop cannot close for every crank angle.
fn locking(coupler: f64) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let body = |m: &mut Mechanism<f64>, name: &str, [a, b]: [[f64; 2]; 2]| {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let pose = Pose { x: 0.5 * (a[0] + b[0]), y: 0.5 * (a[1] + b[1]), theta: dy.atan2(dx) };
        (m.body(name, 1.0, 0.05, pose), 0.5 * dx.hypot(dy))
    };
    let (top, end) = ([0.3, 0.0], [0.85, 0.45]);
    let (crank, c) = body(&mut m, "crank", [[0.0, 0.0], top]);
    let (rod, _) = body(&mut m, "rod", [top, end]);
    let (rocker, r) = body(&mut m, "rocker", [[1.0, 0.0], end]);
    m.revolute("motor pin", m.ground().origin(), crank.at(-c, 0.0));
    m.revolute("crank pin", crank.at(c, 0.0), rod.at(-0.5 * coupler, 0.0));
    m.revolute("rocker pin", rod.at(0.5 * coupler, 0.0), rocker.at(r, 0.0));
    m.revolute("foot", m.ground().at(1.0, 0.0), rocker.at(-r, 0.0));
    let [.., theta] = crank.coordinates();
    m.drive(theta, ConstantSpeed, &[0.0, 2.0]);
    m
}

/// Drives that ask for more than a mechanism can reach, and loops that cannot close: each analysis stops with the part, the
/// time and the remedy.
#[test]
fn mechanisms_that_lock_or_do_not_close_are_named() {
    let locks = locking(0.62);
    let is_named = |error: Error, from: f64, to: f64| {
        let error = error.to_string();
        println!("{error}");
        let time: f64 =
            error.split("t = ").nth(1).unwrap().split([' ', ',', ':', ';']).next().unwrap().parse().unwrap();
        let part = ["pin", "foot", "rod", "rocker"].into_iter().any(|part| error.contains(part));
        assert!(part && (from..=to).contains(&time), "{error}");
    };
    // Coupler and rocker are in line after 0.875 s: their 1.094 m do not reach from the crank's tip to the foot.
    is_named(kinematics(&locks, Assembly::default(), &times(2.0, 200)).unwrap_err(), 0.87, 0.89);
    is_named(simulate(&locks, &Dynamics::fixed(1e-3), &times(2.0, 200)).unwrap_err(), 0.87, 0.89);
    is_named(simulate_explicitly(&locks, &Explicit::adaptive(1e-8), &times(2.0, 200)).unwrap_err(), 0.87, 0.89);
    let never = locking(0.1);
    is_named(kinematics(&never, Assembly::default(), &[0.0, 1.0]).unwrap_err(), 0.0, 0.0);
    is_named(simulate(&never, &Dynamics::fixed(1e-3), &[1.0]).unwrap_err(), 0.0, 0.0);
}

/// A mass falls on a rope that is slack at the start.
#[test]
fn a_damped_rope_does_not_conserve_energy_and_an_elastic_one_does() {
    let drift = |damping: f64| {
        let mut m = Mechanism::with_gravity(0.0, -9.81);
        let mass = m.point_mass("mass", 1.0, 0.0, 0.8);
        m.fix(mass.x);
        let from = m.ground().at(0.0, 1.0);
        m.rope("rope", from, mass.origin(), [1000.0, damping, 0.5]);
        simulate_explicitly(&m, &Explicit::eighth_order(1e-10), &times(2.0, 100)).unwrap().energy_drift
    };
    assert!(drift(0.02).is_none());
    assert!(drift(0.0).is_some_and(|drift| drift.warning().is_none()));
}
