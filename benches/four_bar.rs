//! What do sensitivities cost beside an analysis? `cargo bench --bench four_bar`.

use divan::Bencher;
use linkwright::library::four_bar::{Derivatives, StressConstrained, method};
use linkwright::problem::{Instant, Problem};

const DESIGN: [f64; 3] = [0.0385, 0.0252, 0.02];

fn problem(derivatives: Derivatives) -> Problem {
    let setup = StressConstrained { derivatives, ..StressConstrained::as_published() };
    setup.problem().expect("the setup is in range")
}

#[divan::bench]
fn analysis(bencher: Bencher) {
    let problem = problem(Derivatives::Direct);
    bencher.bench(|| problem.analyze(&DESIGN).expect("the design can be analysed"));
}

/// All three derivatives of all moments kept at the optimum, after an analysis.
#[divan::bench(args = ["direct", "forward"])]
fn sensitivities(bencher: Bencher, kind: &str) {
    let problem = problem(if kind == "direct" { Derivatives::Direct } else { Derivatives::Forward(1e-3) });
    let responses = problem.analyze(&DESIGN).expect("the design can be analysed");
    let evaluation = problem.evaluate(&DESIGN, &responses).expect("the moments are finite");
    let kept = method().screening.keep(&problem, &evaluation);
    // 42 constraints come in pairs, one response each.
    let mut wanted: Vec<Instant> =
        kept.iter().map(|r| Instant { response: r.constraint / 2, point: r.point }).collect();
    wanted.sort_unstable();
    wanted.dedup();
    bencher.bench(|| problem.sensitivities(&DESIGN, &responses, &wanted).expect("as above"));
}

fn main() {
    divan::main();
}
