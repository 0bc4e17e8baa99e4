//! The printed iterates of Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, section 6, and of Groenwold & Etman's
//! reciprocal quadratic on the same cantilever.
//!
//! All functions are approximated, the weight too. A variable may halve or double in a cycle; with the reciprocal quadratic it
//! may move by a fifth of its range.

use linkwright::Result;
use linkwright::approximation::{Approximation, Asymptotes, Conlin, CurvatureRule, DiagonalQuadratic, Linear, Mma};
use linkwright::cases::{cantilever, eight_bar_truss, two_bar_truss};
use linkwright::problem::{Intermediates, Problem};
use linkwright::sao::{AcceptAlways, FixedLimits, Method, MoveLimits, Region, Screening, State, Stop, Trial, Verdict};

/// b/2 ≤ b ≤ 2b.
#[derive(Debug)]
struct HalfToDouble;

impl MoveLimits for HalfToDouble {
    fn check(&self) -> Result<()> {
        Ok(())
    }
    fn start(&self, n: usize) -> Vec<f64> {
        vec![2.0; n]
    }
    fn region(&self, problem: &Problem, b: &[f64], factors: &[f64]) -> Region {
        let ends = problem.variables.iter().zip(b).zip(factors);
        let all =
            ends.map(|((v, b), f)| ((b / f).max(v.lower), (b * f).min(v.upper), [b / f > v.lower, b * f < v.upper]));
        let mut region = Region { lower: vec![], upper: vec![], is_limit: vec![] };
        for (lower, upper, is_limit) in all {
            region.lower.push(lower);
            region.upper.push(upper);
            region.is_limit.push(is_limit);
        }
        region
    }
    fn update(&self, _: &mut [f64], _: &Trial, _: Verdict) {}
}

/// The problem whose weight is approximated, too.
fn wholly(problem: Result<Problem>) -> Problem {
    let mut problem = problem.unwrap();
    problem.objective = problem.objective.directly(Intermediates::Identity);
    problem
}

/// The run of so many cycles with nothing but the approximation.
fn run(problem: Problem, approximation: impl Approximation + 'static, cycles: usize) -> State {
    run_within(HalfToDouble, problem, approximation, cycles)
}

fn run_within(
    move_limits: impl MoveLimits + 'static,
    problem: Problem,
    approximation: impl Approximation + 'static,
    cycles: usize,
) -> State {
    let method = Method {
        approximation: Box::new(approximation),
        screening: Screening { cutoff: None, ..Screening::default() },
        move_limits: Box::new(move_limits),
        globalization: Box::new(AcceptAlways),
        stop: Stop { accuracy: 1e-12, max_cycles: cycles, ..Stop::default() },
        ..Method::default()
    };
    method.solve(&problem, |_| ()).unwrap()
}

fn objectives(state: &State) -> Vec<f64> {
    state.history.iter().map(|c| c.objective).collect()
}

#[track_caller]
fn assert_printed(what: &str, ours: &[f64], printed: &[f64], tolerance: f64) {
    let apart = ours.iter().zip(printed).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(ours.len() == printed.len() && apart <= tolerance, "{what}: {apart:.4}\n{ours:.4?}\n{printed:?}");
}

/// Half a unit of the last printed digit, and a little: 1.4349 is printed as 1.44.
const TWO_DIGITS: f64 = 0.0055;

#[test]
fn two_bar_truss_converges_by_moving_asymptotes_in_the_printed_steps() {
    const RULES: Asymptotes = Asymptotes::Each(&[
        Asymptotes::Proportional(0.2),
        Asymptotes::Moving { initial: 1.0, shrink: 0.5, grow: 1.0 / 0.75, least: 1e-3, most: 100.0 },
    ]);
    let state = run(wholly(two_bar_truss::problem()), Mma { asymptotes: RULES, ..Mma::SVANBERG_1987 }, 5);
    assert_printed("f", &objectives(&state), &[1.68, 1.43, 1.37, 1.44, 1.47, 1.51], TWO_DIGITS);
    let variable = |k: usize| state.history.iter().map(|c| c.design[k]).collect::<Vec<_>>();
    assert_printed("x1", &variable(0), &[1.5, 1.39, 1.22, 1.39, 1.37, 1.41], TWO_DIGITS);
    assert_printed("x2", &variable(1), &[0.5, 0.25, 0.50, 0.25, 0.38, 0.38], TWO_DIGITS);
}

#[test]
fn two_bar_truss_oscillates_for_ever_by_convex_and_by_plain_linearization() {
    let conlin = run(wholly(two_bar_truss::problem()), Conlin, 30);
    assert_printed("CONLIN", &objectives(&conlin)[..8], &[1.68, 1.43, 1.49, 1.43, 1.49, 1.43, 1.49, 1.43], TWO_DIGITS);
    let linear = run(wholly(two_bar_truss::problem()), Linear, 30);
    assert_printed("SLP", &objectives(&linear)[..8], &[1.68, 1.42, 1.27, 1.38, 1.28, 1.38, 1.28, 1.38], TWO_DIGITS);
    for state in [conlin, linear] {
        let half_spans: Vec<f64> = state.history[21..].iter().map(|c| c.design[1]).collect();
        assert!(half_spans.windows(2).all(|w| (w[1] - w[0]).abs() > 0.2), "{half_spans:?}");
    }
}

#[test]
fn cantilever_by_proportional_asymptotes_in_the_printed_steps() {
    let printed: [(f64, &[f64]); 7] = [
        (1.0 / 16.0, &[1.560, 1.274, 1.270, 1.304, 1.319, 1.329, 1.333, 1.336]),
        (1.0 / 8.0, &[1.560, 1.285, 1.307, 1.331, 1.337, 1.339, 1.340]),
        (1.0 / 4.0, &[1.560, 1.309, 1.335, 1.340]),
        (1.0 / 3.0, &[1.560, 1.327, 1.338, 1.340]),
        (1.0 / 2.0, &[1.560, 1.387, 1.346, 1.341]),
        (2.0 / 3.0, &[1.560, 1.448, 1.386, 1.358, 1.347, 1.343, 1.341]),
        (3.0 / 4.0, &[1.560, 1.477, 1.418, 1.383, 1.363, 1.352, 1.346, 1.343, 1.342, 1.341]),
    ];
    for (t, printed) in printed {
        let mma = Mma { asymptotes: Asymptotes::Proportional(t), ..Mma::SVANBERG_1987 };
        let state = run(wholly(cantilever::problem()), mma, printed.len() - 1);
        assert_printed(&format!("t = {t}"), &objectives(&state), printed, 1e-3);
    }
}

#[test]
fn cantilever_by_the_reciprocal_quadratic_in_the_printed_steps() {
    let quadratic = DiagonalQuadratic { bend: CurvatureRule::Reciprocal };
    let state = run_within(FixedLimits { width: 0.2 }, wholly(cantilever::problem()), quadratic, 5);
    assert_printed("f", &objectives(&state), &[1.560, 1.336, 1.323, 1.340, 1.340, 1.340], 1e-3);
    let violations: Vec<f64> = state.history.iter().map(|c| c.violation_pct.max(0.0) / 100.0).collect();
    // Printed without rounding.
    assert_printed("violation", &violations, &[0.0, 0.10, 0.03, 0.0, 0.0, 0.0], 0.01);
}

#[test]
fn eight_bar_truss_by_moving_asymptotes_in_the_printed_steps() {
    let printed: [(f64, &[f64]); 3] = [
        (
            3.0 / 4.0,
            &[13.05, 12.10, 11.67, 11.65, 11.64, 11.62, 11.60, 11.56, 11.52, 11.47, 11.41, 11.36, 11.31, 11.24, 11.23],
        ),
        (1.0 / 2.0, &[13.05, 12.10, 11.67, 11.65, 11.63, 11.60, 11.53, 11.44, 11.35, 11.25, 11.23]),
        (1.0 / 4.0, &[13.05, 12.10, 11.67, 11.65, 11.61, 11.52, 11.42, 11.28, 11.23]),
    ];
    for (s, printed) in printed {
        let asymptotes = Asymptotes::Relative { initial: [1.0, 4.0], rate: s, least: [0.6, 1.5], most: [51.0, 49.0] };
        let mma = Mma { asymptotes, ..Mma::SVANBERG_1987 };
        let state = run(wholly(eight_bar_truss::problem()), mma, printed.len() - 1);
        assert_printed(&format!("s = {s}"), &objectives(&state), printed, 0.011);
    }
}
