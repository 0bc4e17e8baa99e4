//! Cost of analyses and their derivatives: `cargo bench --bench multibody`.
//!
//! Every time is the shortest of several runs. Read the ratios: they depend little on the load of the machine.

use linkwright::cases::{Chain, FourBar};
use linkwright::mechanics::analyses::dynamics::simulate_explicitly;
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright::mechanics::integrators::explicit::Explicit;
use linkwright::mechanics::mechanism::ParametricMechanism;
use std::time::{Duration, Instant};

fn best<T>(runs: usize, mut run: impl FnMut() -> T) -> Duration {
    let mut shortest = Duration::MAX;
    for _ in 0..runs {
        let start = Instant::now();
        std::hint::black_box(run());
        shortest = shortest.min(start.elapsed());
    }
    shortest
}

fn report(name: &str, variables: usize, analysis: Duration, both: Duration) {
    let ratio = both.as_secs_f64() / analysis.as_secs_f64();
    println!("{name}: with {variables} derivatives {ratio:.2} analyses; analysis {analysis:.2?}, both {both:.2?}");
}

/// Three flexible links of six elements, 0.5 s at 1 ms.
fn four_bar() {
    let (model, b) = (FourBar::as_published(), [0.0385, 0.0252, 0.02]);
    let (settings, times) = (model.dynamics().unwrap(), FourBar::window());
    let mechanism = model.build(&b).unwrap();
    println!("four-bar: {:?}", simulate(&mechanism, &settings, &times).unwrap().work);
    let analysis = best(20, || simulate(&mechanism, &settings, &times).unwrap());
    let both = best(20, || differentiate(&model, &b, &settings, &times).unwrap());
    report("four-bar", 3, analysis, both);
}

/// The tip of a chain released from the horizontal, at 101 times in one second, to 1e-8.
fn chain(links: usize) {
    let model = Chain::horizontal(links);
    let (b, times) = (model.equal_links(), (0..=100).map(|k| 0.01 * f64::from(k)).collect::<Vec<_>>());
    let mechanism = model.build(&b).unwrap();
    let exact = simulate_explicitly(&mechanism, &Explicit::eighth_order(1e-12), &times).unwrap();
    for settings in [Explicit::adaptive(1e-9), Explicit::eighth_order(1e-9)] {
        let run = simulate_explicitly(&mechanism, &settings, &times).unwrap();
        let errors = (0..2).flat_map(|o| run.values[o].iter().zip(&exact.values[o]).map(|(a, b)| (a - b).abs()));
        let error = errors.fold(0.0, f64::max);
        let analysis = best(3, || simulate_explicitly(&mechanism, &settings, &times).unwrap());
        let both = best(3, || differentiate_explicitly(&model, &b, &settings, &times).unwrap());
        println!("chain of {links}, order {}, error {error:.1e}, {:?}", settings.method.order, run.work);
        report(&format!("chain of {links}"), b.len(), analysis, both);
    }
}

/// Cost per implicit step and link for long chains.
fn scaling() {
    for links in [10, 100, 1000, 10_000] {
        let model = Chain::horizontal(links);
        let mechanism = model.build(&model.equal_links()).unwrap();
        let (few, many) = (5, 15);
        let run = |steps: usize| {
            let times = [1e-3 * steps as f64];
            best(3, || simulate(&mechanism, &Dynamics::fixed(1e-3), &times).unwrap())
        };
        let per_step = (run(many).saturating_sub(run(few))).as_secs_f64() / (many - few) as f64;
        println!("chain of {links}: {:.2} µs per step and link", per_step / links as f64 * 1e6);
    }
}

fn main() {
    four_bar();
    chain(8);
    chain(32);
    scaling();
}
