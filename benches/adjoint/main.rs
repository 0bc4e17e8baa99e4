//! Cost of derivatives by the direct and the adjoint method, in analyses: `cargo bench --bench adjoint`.
//!
//! * `-- gradient`: a chain of N slender links, together 1 m and 1 kg, falls from the horizontal for 0.1 s, with implicit or explicit
//!   steps. Derivatives of tip coordinates with respect to the 2N lengths and masses.
//! * `-- crossover`: for four kinds of analysis, the cost over the number of design variables, as a table and as `crossover.csv`
//!   and `crossover.svg` in the folder `ADJOINT_FIGURE` (default `target/`).
//! * `-- memory`: the cost of checkpoints in a limited memory.
//! * `-- integral`: the gradient of an integral over 2001 time points, as one sum and by the rows of all points.
//!
//! Without an argument all four run. CPU times of all threads.

#[path = "../cpu/mod.rs"]
mod cpu;
mod crossover;
mod models;

use cpu::{in_turns, least};
use linkwright::cases::Chain;
use linkwright::mechanics::analyses::dynamics::simulate_explicitly;
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate};
use linkwright::mechanics::derivatives::adjoint::{
    AdjointFunctional, differentiate_backwards, differentiate_backwards_within, differentiate_explicitly_backwards,
};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright::mechanics::derivatives::method::Differentiation;
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::mechanics::mechanism::ParametricMechanism;
use linkwright::problem::{Analysis, ResponseAt, ResponseSum};
use linkwright::responses::mechanism::Transient;

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let is_asked = |word: &str| asked.is_empty() || asked.iter().any(|asked| asked == word);
    if is_asked("gradient") {
        gradients();
    }
    if is_asked("crossover") {
        crossover::all();
    }
    if is_asked("memory") {
        memory();
    }
    if is_asked("integral") {
        integral();
    }
}

/// The tip at four times.
const TIMES: [f64; 4] = [0.025, 0.05, 0.075, 0.1];

/// Prints the cost of a gradient with respect to all lengths and masses, the analysis included, in analyses.
fn gradients() {
    println!(
        "| steps | links | design variables | analysis ms | direct | adjoint, 1 response | adjoint, 8 responses |"
    );
    println!("|---|---|---|---|---|---|---|");
    for links in [4, 32, 256] {
        let model = Chain { energies: false, ..Chain::horizontal(links) };
        let b = model.equal_links();
        let mechanism = model.build(&b).unwrap();
        let all: Vec<_> = (0..8).map(|k| AdjointFunctional::at(k % 2, k / 2)).collect();
        let rounds = if links > 100 { 2 } else { 4 };

        let settings = Dynamics::fixed(2.5e-4);
        let mut analysis = || drop(simulate(&mechanism, &settings, &TIMES).unwrap());
        let mut direct = || drop(differentiate(&model, &b, &settings, &TIMES).unwrap());
        let mut one = || drop(differentiate_backwards(&model, &b, &settings, &TIMES, &all[7..]).unwrap());
        let mut eight = || drop(differentiate_backwards(&model, &b, &settings, &TIMES, &all).unwrap());
        let spent = in_turns(rounds, [&mut analysis, &mut direct, &mut one, &mut eight]);
        print_gradients("implicit", links, spent);

        let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(1e-3));
        let mut analysis = || drop(simulate_explicitly(&mechanism, &settings, &TIMES).unwrap());
        let mut direct = || drop(differentiate_explicitly(&model, &b, &settings, &TIMES).unwrap());
        let mut one = || drop(differentiate_explicitly_backwards(&model, &b, &settings, &TIMES, &all[7..]).unwrap());
        let mut eight = || drop(differentiate_explicitly_backwards(&model, &b, &settings, &TIMES, &all).unwrap());
        let spent = in_turns(rounds, [&mut analysis, &mut direct, &mut one, &mut eight]);
        print_gradients("explicit", links, spent);
    }
}

fn print_gradients(steps: &str, links: usize, [unit, direct, one, eight]: [f64; 4]) {
    let [direct, one, eight] = [direct, one, eight].map(|spent| spent / unit);
    println!("| {steps} | {links} | {} | {:.2} | {direct:.2} | {one:.2} | {eight:.2} |", 2 * links, unit * 1e3);
}

/// Prints the cost of a limited memory for a chain of eight links over 10 000 implicit steps.
fn memory() {
    let model = Chain { energies: false, ..Chain::horizontal(8) };
    let (b, settings, times) = (model.equal_links(), Dynamics::fixed(1e-4), [1.0]);
    let run = |memory: usize| {
        differentiate_backwards_within(memory, &model, &b, &settings, &times, &[AdjointFunctional::at(0, 0)]).unwrap().1
    };
    let whole = least(2, || run(usize::MAX));
    println!("| memory allowed, KiB | used, KiB | steps | recomputed | time, all steps stored = 1 |");
    println!("|---|---|---|---|---|");
    for memory in [1 << 26, 1 << 22, 1 << 20, 1 << 18, 1 << 16] {
        let (spent, time) = (run(memory), least(2, || run(memory)));
        let (used, allowed) = (spent.memory.div_ceil(1 << 10), memory >> 10);
        println!("| {allowed} | {used} | {} | {} | {:.2} |", spent.steps, spent.repeated, time / whole);
    }
}

/// Prints the cost of the gradient of an integral over 2001 time points for a chain of eight links, in analyses.
fn integral() {
    let model = Chain { energies: false, ..Chain::horizontal(8) };
    let (b, settings) = (model.equal_links(), Dynamics::fixed(1e-3));
    let times: Vec<f64> = (0..=2000).map(|k| 1e-3 * f64::from(k)).collect();
    let at = |point| ResponseAt { response: 0, point };
    let sum = ResponseSum { terms: (0..times.len()).map(|point| (at(point), 1e-3)).collect() };
    let by = |method| Transient::new(model, settings, &times).unwrap().differentiating(method).unwrap();
    let (direct, adjoint) = (by(Differentiation::Direct), by(Differentiation::Adjoint));
    let responses = adjoint.analyze(&b).unwrap();
    let wanted = ResponseSum::responses_in(std::slice::from_ref(&sum));
    let sums = std::slice::from_ref(&sum);
    let mut analysis = || drop(adjoint.analyze(&b).unwrap());
    let mut by_direct = || drop(direct.sum_sensitivities(&b, &responses, sums).unwrap());
    let mut by_sum = || drop(adjoint.sum_sensitivities(&b, &responses, sums).unwrap());
    let mut by_rows = || drop(adjoint.sensitivities(&b, &responses, &wanted).unwrap());
    let [unit, direct, sum, rows] = in_turns(2, [&mut analysis, &mut by_direct, &mut by_sum, &mut by_rows]);
    println!("| time points | design variables | analysis ms | direct | adjoint, one sum | adjoint, row by row |");
    println!("|---|---|---|---|---|---|");
    let [direct, sum, rows] = [direct, sum, rows].map(|spent| spent / unit);
    println!("| {} | {} | {:.1} | {direct:.2} | {sum:.2} | {rows:.1} |", times.len(), b.len(), unit * 1e3);
}
