//! Conservative methods from random feasible starts: every accepted design is feasible.

use linkwright::cases::suite::{Suite, Transformation, problems};
use linkwright::problem::Problem;
use linkwright::sao::{Stop, preset};

/// Largest violation in per cent: the accuracy of the stop test, 1e-5. Subproblems and conservatism are exact to less.
const FEASIBLE: f64 = 1e-3;
/// Largest number of random designs for each wanted start; some feasible sets are very thin.
const TRIES: usize = 40;

/// Numbers in [0, 1) by a linear congruential generator (Knuth's constants).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A design between start and optimum, moved by up to the distance of the optimum from zero or from the start.
fn random_design(problem: &Problem, optimum: &[f64], random: &mut Random) -> Vec<f64> {
    let size = 0.01f64.powf(random.next());
    let one = |(j, (start, optimum)): (usize, (f64, &f64))| {
        let width = (start - optimum).abs().max(optimum.abs()).max(0.1);
        let here = optimum + (start - optimum) * random.next() + size * width * (2.0 * random.next() - 1.0);
        here.clamp(problem.variables[j].lower, problem.variables[j].upper)
    };
    problem.start().into_iter().zip(optimum).enumerate().map(one).collect()
}

/// The number of starts for each problem is given by STARTS; 100 of them take about ten minutes.
#[test]
fn accepted_designs_of_gcmma_are_feasible_from_random_feasible_starts() {
    let wanted: usize = std::env::var("STARTS").map_or(2, |text| text.parse().unwrap());
    let method = (preset("gcmma").unwrap().method)().with_stop(Stop { max_cycles: 60, ..Stop::default() });
    let (mut random, mut count, mut tried) = (Random(1), 0, 0);
    let (mut worst, mut wrong) = (f64::MIN, vec![]);
    for entry in problems().filter(|entry| entry.suite != Suite::Catalogue) {
        let problem = Transformation::default().build(entry).unwrap();
        if problem.constraints.is_empty() || problem.constraints.iter().any(|c| c.is_equality()) {
            continue;
        }
        let start = problem.start();
        let optimum = entry.optima().first().and_then(|optimum| optimum.design).unwrap_or(&start);
        let designs = (0..TRIES * wanted).map(|_| random_design(&problem, optimum, &mut random));
        let is_feasible =
            |design: &Vec<f64>| problem.analyze_design(design).is_ok_and(|at| at.evaluation.max_violation_pct() <= 0.0);
        let starts: Vec<Vec<f64>> = designs.filter(is_feasible).take(wanted).collect();
        tried += usize::from(!starts.is_empty());
        for start in starts {
            let begin = method.start_at(&problem, start.clone()).unwrap();
            let end = method.resume(&problem, begin, |_| ()).unwrap();
            let violation = end.history.iter().filter(|c| c.accepted).map(|c| c.violation_pct).fold(f64::MIN, f64::max);
            worst = worst.max(violation);
            count += 1;
            if violation > FEASIBLE {
                wrong.push(format!("{} from {start:?}: {violation:.1e} %", entry.name));
            }
        }
    }
    println!("{count} runs on {tried} problems, largest violation {worst:.1e} %");
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(tried >= 50 && count >= 48 * wanted, "{count} runs on {tried} problems");
}
