//! Cost of kinematics: rows of driven four-bars, of which each point is solved separately and the branch of the assembly is watched.
//!
//! `cargo bench -p linkwright-mechanics --bench kinematics`

#[path = "../../../benches/cpu/mod.rs"]
mod cpu;

use linkwright_mechanics::motion::ConstantSpeed;
use linkwright_mechanics::{Assembly, Mechanism, Pose, kinematics};

/// A row of so many four-bars, each with a crank that turns at constant speed.
fn four_bars(number: usize) -> Mechanism<f64> {
    let mut m = Mechanism::new();
    let ground = m.ground();
    for k in 0..number {
        let x = 5.0 * k as f64;
        let [pin, end, pivot] = [[x + 0.5f64.cos(), 0.5f64.sin()], [x + 2.7, 2.8], [x + 4.0, 0.0]];
        let link = |[x, y]: [f64; 2]| Pose { x, y, theta: (end[1] - y).atan2(end[0] - x) };
        let crank = m.body(&format!("crank {k}"), 1.0, 0.1, Pose { x, y: 0.0, theta: 0.5 });
        let coupler = m.body(&format!("coupler {k}"), 1.0, 0.1, link(pin));
        let rocker = m.body(&format!("rocker {k}"), 1.0, 0.1, link(pivot));
        m.revolute(&format!("bearing {k}"), ground.at(x, 0.0), crank.origin());
        m.revolute(&format!("pin {k}"), crank.at(1.0, 0.0), coupler.origin());
        m.revolute(&format!("end {k}"), coupler.at(3.0, 0.0), rocker.at(3.0, 0.0));
        m.revolute(&format!("pivot {k}"), ground.at(x + 4.0, 0.0), rocker.origin());
        m.driver(&format!("motor {k}"), ground.theta, crank.theta, ConstantSpeed, &[0.5, 6.0]);
    }
    m
}

fn main() {
    let times: Vec<f64> = (0..=50).map(|k| 0.01 * f64::from(k)).collect();
    for number in [1, 10, 100, 300] {
        let mechanism = four_bars(number);
        let seconds = cpu::least(3, || kinematics(&mechanism, Assembly::default(), &times).unwrap());
        let each = 1e6 * seconds / (times.len() * number) as f64;
        println!("{number} driven four-bars: {each:.2} µs per time point and four-bar");
    }
}
