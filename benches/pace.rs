//! Cost of a cycle early and late in a run of a hundred thousand: `cargo bench --bench pace`; `CYCLES` sets another number.
//!
//! The analysis is a formula, and the steps continue beyond convergence. Screening, approximation, subproblem and history remain. The end is
//! not confirmed: a normal run confirms it again only when it has become twice as long, but steps beyond the end would do so every time.

#[path = "cpu/mod.rs"]
mod cpu;

use cpu::cpu;
use linkwright::cases::impact_absorber;
use linkwright::sao::{Stop, preset};

/// Cycles that are measured, early and late.
const MEASURED: usize = 1_000;
const CYCLES: usize = 100_000;

fn cycles() -> usize {
    std::env::var("CYCLES").ok().and_then(|n| n.parse().ok()).unwrap_or(CYCLES)
}

fn main() {
    println!("{:<12}{:>22}{:>22}{:>10}", "method", "µs per cycle early", "µs per cycle late", "ratio");
    for name in ["slp", "mma", "gcmma"] {
        let problem = impact_absorber::comfort().expect("the problem is valid");
        let method = (preset(name).expect("it is a preset").method)();
        let stop = Stop { confirm: false, ..method.stop };
        let method = method.with_stop(stop);
        let mut state = method.start(&problem).expect("the start can be analysed");
        let mut times = [0.0; 2];
        while state.history.len() < cycles() {
            let begun = cpu();
            for _ in 0..MEASURED {
                state = method.step(&problem, state).expect("a step can be made");
            }
            let spent = 1e6 * (cpu() - begun) / MEASURED as f64;
            // The first cycles come before convergence.
            if state.history.len() <= 3 * MEASURED {
                times[0] = spent;
            }
            times[1] = spent;
        }
        println!("{name:<12}{:>22.0}{:>22.0}{:>10.2}", times[0], times[1], times[1] / times[0]);
    }
}
