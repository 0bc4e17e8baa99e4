use linkwright::library::four_bar::*;
use linkwright::problem::Instant;
use std::time::Instant as Clock;
fn main() {
    let problem = StressConstrained::as_published().problem().unwrap();
    let b = [0.0385, 0.0252, 0.02];
    let r = problem.analyze(&b).unwrap();
    let wanted: Vec<Instant> = (0..100).map(|k| Instant { response: k % 21, point: 2 * k }).collect();
    let (mut best_a, mut best_s) = (f64::INFINITY, f64::INFINITY);
    let which = std::env::args().nth(1).unwrap_or_default();
    for _ in 0..200 {
        if which != "s" {
            let t = Clock::now();
            problem.analyze(&b).unwrap();
            best_a = best_a.min(t.elapsed().as_secs_f64());
        }
        if which != "a" {
            let t = Clock::now();
            problem.sensitivities(&b, &r, &wanted).unwrap();
            best_s = best_s.min(t.elapsed().as_secs_f64());
        }
    }
    println!("analysis {:.2} sensitivities {:.2} ratio {:.2}", best_a * 1e3, best_s * 1e3, best_s / best_a);
}
