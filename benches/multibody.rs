//! How long analyses and their derivatives take: `cargo bench --bench multibody`.

use linkwright::analysis::simulate;
use linkwright::multibody::Model;
use linkwright::multibody::mechanisms::FourBar;
use linkwright::sensitivity::differentiate;
use std::time::{Duration, Instant};

/// Shortest of several runs.
fn best(runs: usize, mut run: impl FnMut()) -> Duration {
    let time = |()| {
        let start = Instant::now();
        run();
        start.elapsed()
    };
    (0..runs).map(|_| ()).map(time).min().expect("at least one run")
}

fn four_bar() {
    let (model, b) = (FourBar::as_published(), [0.0385, 0.0252, 0.02]);
    let (settings, times) = (model.dynamics().unwrap(), FourBar::window());
    let mechanism = model.build(&b).unwrap();
    let work = simulate(&mechanism, &settings, &times).unwrap().work;
    let analysis = best(20, || drop(simulate(&mechanism, &settings, &times).unwrap()));
    let both = best(20, || drop(differentiate(&model, &b, &settings, &times).unwrap()));
    println!("four-bar: {work:?}");
    println!(
        "four-bar analysis {analysis:?}, with 3 derivatives {both:?}, ratio {:.2}",
        both.as_secs_f64() / analysis.as_secs_f64()
    );
}

fn main() {
    four_bar();
}
