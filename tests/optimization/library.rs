//! Numbers of analyses until the optimum is reached to 1e-5, for the library's structural problems from their own starts, by
//! the methods that suit them.

use linkwright::approximation::{
    Approximation, Asymptotes, CurvatureRule, DiagonalQuadratic, FullQuadratic, Hessian, Mma, TwoPointExponential,
};
use linkwright::cases::{Optimum, cantilever, eight_bar_truss, quadratic_forms, segmented_cantilever, ten_bar_truss};
use linkwright::cases::{two_bar_truss, two_spheres};
use linkwright::problem::Problem;
use linkwright::sao::{AcceptAlways, FilteredConservatism, FixedLimits, Globalization, Method, Status, Stop};

/// Relative distance from the optimum, and violation, below which the optimum counts as reached.
const REACHED: f64 = 1e-5;

fn method(approximation: impl Approximation + 'static, conservative: bool) -> Method {
    let globalization: Box<dyn Globalization> =
        if conservative { Box::new(FilteredConservatism::default()) } else { Box::new(AcceptAlways) };
    Method {
        approximation: Box::new(approximation),
        move_limits: Box::new(FixedLimits::default()),
        globalization,
        stop: Stop { accuracy: 1e-8, max_cycles: 100, ..Stop::default() },
        ..Method::as_published()
    }
}

/// Analyses and sensitivity analyses until the optimum is first reached, if it is.
fn work(problem: &Problem, method: &Method, optimum: f64) -> Option<(usize, usize)> {
    let mut state = method.start(problem).unwrap();
    while state.status == Status::Running {
        state = method.step(problem, state).ok()?;
        let last = state.history.last()?;
        // The objective may be below the optimum by a unit of the last digit.
        let near = last.objective - optimum < REACHED * optimum.abs() && last.violation_pct / 100.0 < REACHED;
        if near {
            return Some((state.counters.analyses, state.counters.sensitivity_analyses));
        }
    }
    None
}

#[track_caller]
fn assert_work(
    problem: &Problem,
    optimum: &Optimum,
    approximation: impl Approximation + 'static,
    fc: bool,
    most: (usize, usize),
) {
    let name = format!("{approximation:?}");
    let took = work(problem, &method(approximation, fc), optimum.objective).expect("the optimum is reached");
    assert!(took.0 <= most.0 && took.1 <= most.1, "{}, {name}: {took:?}", problem.name);
}

/// Analyses and sensitivity analyses until the optimum is reached to 1e-5, with first and with exact second derivatives. Other
/// programs: mmapy's MMA needs 6 + 5 for the cantilever, IPOPT 5 + 4 for the two-bar truss.
#[test]
fn few_analyses_where_the_approximation_fits() {
    let powers = || TwoPointExponential { least: -3.0, otherwise: -1.0, ..Default::default() };
    let proportional = || Mma { asymptotes: Asymptotes::Proportional(0.4), ..Mma::SVANBERG_1987 };
    let exact = || FullQuadratic { hessian: Hessian::Exact };
    let (problem, optimum) = (cantilever::problem().unwrap(), cantilever::optimum());
    assert_work(&problem, &optimum, powers(), false, (3, 2));
    assert_work(&problem, &optimum, proportional(), true, (5, 4));
    let (problem, optimum) = (two_bar_truss::problem().unwrap(), two_bar_truss::optimum());
    assert_work(&problem, &optimum, FullQuadratic { hessian: Hessian::Bfgs(10) }, true, (5, 3));
    assert_work(&problem, &optimum, proportional(), true, (5, 4));
    assert_work(&problem, &optimum, exact(), false, (4, 3));
    let (problem, optimum) = (eight_bar_truss::problem().unwrap(), eight_bar_truss::optimum());
    assert_work(&problem, &optimum, powers(), false, (6, 5));
    assert_work(&problem, &optimum, exact(), false, (4, 3));
    let (problem, optimum) = (ten_bar_truss::equal_strengths().unwrap(), ten_bar_truss::equal_strengths_optimum());
    assert_work(&problem, &optimum, powers(), false, (8, 7));
    let (problem, optimum) = (ten_bar_truss::strong_ninth_bar().unwrap(), ten_bar_truss::strong_ninth_bar_optimum());
    assert_work(&problem, &optimum, Mma::SVANBERG_2002, true, (10, 7));
    let (problem, optimum) = (segmented_cantilever::problem(5).unwrap(), segmented_cantilever::five_segments_optimum());
    assert_work(&problem, &optimum, powers(), false, (7, 6));
    let (problem, optimum) = (two_spheres::problem().unwrap(), two_spheres::optimum());
    assert_work(&problem, &optimum, DiagonalQuadratic { curvature: CurvatureRule::Exact }, false, (3, 1));
    let (problem, optimum) = (quadratic_forms::first_problem(20).unwrap(), quadratic_forms::FIRST_20);
    assert_work(&problem, &optimum, exact(), false, (3, 2));
    let (problem, optimum) = (quadratic_forms::second_problem(20).unwrap(), quadratic_forms::SECOND_20);
    assert_work(&problem, &optimum, exact(), false, (3, 2));
}

/// Volumes of Vanderplaats' cantilever for other numbers of segments.
#[test]
fn segmented_cantilevers_have_their_volumes() {
    for (segments, volume) in segmented_cantilever::VOLUMES.into_iter().filter(|(n, _)| *n <= 10) {
        let problem = segmented_cantilever::problem(segments).unwrap();
        let powers = TwoPointExponential { least: -3.0, otherwise: -1.0, ..Default::default() };
        assert!(work(&problem, &method(powers, false), volume).is_some(), "{segments}");
    }
}
