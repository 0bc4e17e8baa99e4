//! Derivatives forward and backward in time: `cargo bench --bench adjoint`.
//!
//! N slender links, together 1 m and 1 kg, pinned in a row to the ground, fall from the horizontal; implicit steps of 0.25 ms to
//! 0.1 s. Wanted: the tip's x and y at the end, or only x, with their derivatives by the 2N lengths and masses. CPU times of
//! all threads.

mod cpu;

use cpu::in_turns;
use linkwright::analysis::{Dynamics, simulate};
use linkwright::multibody::Model;
use linkwright::multibody::mechanisms::Chain;
use linkwright::sensitivity::{Functional, differentiate, differentiate_backwards};

fn main() {
    println!("| links | design variables | analysis ms | forward | backward, 1 response | backward, 8 responses |");
    println!("|---|---|---|---|---|---|");
    for links in [4, 8, 16, 32, 64, 256] {
        let model = Chain { energies: false, ..Chain::horizontal(links) };
        let (b, settings) = (model.equal_links(), Dynamics::fixed(2.5e-4));
        let mechanism = model.build(&b).unwrap();
        let times = [0.025, 0.05, 0.075, 0.1];
        let all: Vec<_> = (0..8).map(|k| Functional::at(k % 2, k / 2)).collect();
        let mut analysis = || drop(simulate(&mechanism, &settings, &times).unwrap());
        let mut forward = || drop(differentiate(&model, &b, &settings, &times).unwrap());
        let mut one = || drop(differentiate_backwards(&model, &b, &settings, &times, &all[7..]).unwrap());
        let mut eight = || drop(differentiate_backwards(&model, &b, &settings, &times, &all).unwrap());
        let rounds = if links > 100 { 1 } else { 3 };
        let [unit, forward, one, eight] = in_turns(rounds, [&mut analysis, &mut forward, &mut one, &mut eight]);
        // The analysis itself is part of all of them.
        let [forward, one, eight] = [forward, one, eight].map(|spent| spent / unit - 1.0);
        println!("| {links} | {} | {:.2} | {forward:.2} | {one:.2} | {eight:.2} |", b.len(), unit * 1e3);
    }
}
