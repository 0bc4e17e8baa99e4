//! Time of a model file compared with the same problem in Rust: `cargo bench --bench model_file`.
//!
//! Measured are one analysis with the derivatives of all its responses, and the reading of the file.

use divan::Bencher;
use linkwright::cases::{four_bar::StressConstrained, impact_absorber, slider_crank};
use linkwright::model_file::read;
use linkwright::problem::{Problem, ResponseAt};

fn main() {
    divan::main();
}

const PAIRS: [&str; 4] = ["impact-absorber", "slider-crank", "slider-crank-assembled", "four-bar"];

fn text(name: &str) -> String {
    std::fs::read_to_string(format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn file(name: &str) -> Problem {
    read(name, &text(name)).unwrap().problem().unwrap()
}

fn twin(name: &str) -> Problem {
    let start = slider_crank::STAND_IN_START;
    match name {
        "impact-absorber" => impact_absorber::peak_acceleration_simulated(),
        "slider-crank" => slider_crank::path_generation(start),
        "slider-crank-assembled" => slider_crank::path_generation_assembled(start),
        _ => StressConstrained::as_published().problem(),
    }
    .unwrap()
}

fn cycle(problem: &Problem) -> f64 {
    let b = problem.start();
    let responses = problem.analyze(&b).unwrap();
    let of = |(h, values): (usize, &Vec<f64>)| (0..values.len()).map(move |p| ResponseAt { response: h, point: p });
    let wanted: Vec<ResponseAt> = responses.values.iter().enumerate().flat_map(of).collect();
    problem.sensitivities(&b, &responses, &wanted).unwrap()[(0, 0)]
        + problem.evaluate(&b, &responses).unwrap().objective
}

#[divan::bench(args = PAIRS)]
fn from_file(bencher: Bencher, name: &str) {
    let problem = file(name);
    bencher.bench(|| cycle(&problem));
}

#[divan::bench(args = PAIRS)]
fn in_rust(bencher: Bencher, name: &str) {
    let problem = twin(name);
    bencher.bench(|| cycle(&problem));
}

#[divan::bench(args = PAIRS)]
fn reading(bencher: Bencher, name: &str) {
    let text = text(name);
    bencher.bench(|| read(name, &text).unwrap());
}
