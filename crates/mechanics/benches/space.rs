//! Speed of a chain in space, compared with other programs: `cargo bench -p linkwright-mechanics --bench space`.
//!
//! N cylinders of 20 mm radius, together 1 m and 1 kg, joined end to end by hinges, are released from rest in the horizontal
//! (g = 9.81 m/s²). The axes of the hinges are in turn (0, 1, 0) and (0, 0.6, 0.8), so that the chain leaves its plane. With an
//! error of the tip after 1 s of at most 1e-5 m, the simulated seconds per CPU second are measured, for each choice of coordinates
//! that the mechanism permits.
//!
//! `PEERS=python cargo bench -p linkwright-mechanics --bench space` runs `benches/peers/spatial_chain.py` by this interpreter in turns with the analyses of this crate, and prints
//! the ratios of one run: Runge-Kutta steps of order 4 of MuJoCo, Pinocchio and Exudyn with the same error. `-- N…` measures
//! chains of N links instead of 8 and 32.

#[path = "../../../benches/cpu/mod.rs"]
mod cpu;

use cpu::least;
use linkwright_mechanics::Mechanism;
use linkwright_mechanics::analyses::dynamics::{History, simulate_explicitly};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::integrators::explicit::{Coordinates, Explicit};
use linkwright_mechanics::mechanism::Pose3;
use std::process::Command;

const ERROR: f64 = 1e-5;
/// Rounds in which the programs take turns.
const ROUNDS: usize = 3;

fn chain(links: usize) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
    let (length, mass, radius) = (1.0 / links as f64, 1.0 / links as f64, 0.02);
    let across = mass * (3.0 * radius * radius + length * length) / 12.0;
    let properties = MassProperties3::principal(mass, [0.5 * mass * radius * radius, across, across]);
    let mut hook = m.ground3().origin();
    for k in 0..links {
        let axis = if k % 2 == 0 { [0.0, 1.0, 0.0] } else { [0.0, 0.6, 0.8] };
        let link = m.body3(&format!("link {k}"), properties, Pose3::at([(k as f64 + 0.5) * length, 0.0, 0.0]));
        let near = link.at([-0.5 * length, 0.0, 0.0]).with_z(axis);
        m.revolute3(&format!("hinge {k}"), hook.with_z(axis), near);
        hook = link.at([0.5 * length, 0.0, 0.0]);
    }
    let sensor = m.sensor3("tip", hook);
    for name in ["x", "y", "z"] {
        let measure = m.measure(sensor, name).expect("a point has a position");
        m.output(name, &[measure]);
    }
    m
}

fn tip(run: &History) -> [f64; 3] {
    std::array::from_fn(|k| run.values[k][0])
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Least CPU seconds of another program, with its description; `None` if it is not installed.
fn peer(python: &str, name: &str, links: usize, exact: [f64; 3]) -> Option<(f64, String)> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../benches/peers/spatial_chain.py");
    let numbers = exact.map(|x| format!("{x:.17}"));
    let output = Command::new(python).args([script, name, &links.to_string()]).args(numbers).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    // Exudyn prints lines of its own first.
    let (seconds, words) = text.trim().lines().last()?.split_once(' ')?;
    Some((seconds.parse().ok()?, words.to_owned()))
}

fn speed(links: usize) {
    let m = chain(links);
    let exact = tip(&simulate_explicitly(&m, &Explicit::eighth_order(1e-13), &[1.0]).expect("the chain falls"));
    println!("chain of {links:>2} in space: tip after 1 s at {exact:.9?}");
    let mut own = vec![];
    for coordinates in [Coordinates::Absolute, Coordinates::Relative] {
        let settings = |tolerance| Explicit::eighth_order(tolerance).with_coordinates(coordinates);
        let found = (4..24).map(|k| 10f64.powf(-0.5 * f64::from(k))).find_map(|tolerance| {
            let run = simulate_explicitly(&m, &settings(tolerance), &[1.0]).ok()?;
            (distance(tip(&run), exact) <= ERROR).then_some((settings(tolerance), run.work))
        });
        match found {
            Some((settings, work)) => own.push((coordinates.name(), settings, work, f64::INFINITY)),
            None => println!("chain of {links:>2}, {} coordinates: not possible", coordinates.name()),
        }
    }
    let python = std::env::var("PEERS").ok();
    let mut peers: Vec<(&str, f64, String)> = vec![];
    for _ in 0..ROUNDS {
        for (_, settings, _, best) in &mut own {
            *best = best.min(least(1, || simulate_explicitly(&m, settings, &[1.0]).expect("it ran before")));
        }
        for name in ["mujoco", "pinocchio", "exudyn"] {
            let Some((seconds, words)) = python.as_ref().and_then(|python| peer(python, name, links, exact)) else {
                continue;
            };
            match peers.iter_mut().find(|(known, ..)| *known == name) {
                Some((_, best, _)) => *best = best.min(seconds),
                None => peers.push((name, seconds, words)),
            }
        }
    }
    for (name, _, work, best) in &own {
        let ratios: Vec<String> =
            peers.iter().map(|(peer, other, _)| format!("{:.2} × {peer}", other / best)).collect();
        println!(
            "chain of {links:>2}, {name} coordinates: {:.0} simulated seconds per CPU second, {} steps, {} evaluations of {:.2} µs; {}",
            1.0 / best,
            work.steps,
            work.iterations,
            best / work.iterations as f64 * 1e6,
            ratios.join(", ")
        );
    }
    for (name, seconds, words) in peers {
        println!("chain of {links:>2}, {name}: {:.0} simulated seconds per CPU second, {words}", 1.0 / seconds);
    }
}

fn main() {
    let links: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let links = if links.is_empty() { vec![8, 32] } else { links };
    links.into_iter().for_each(speed);
}
