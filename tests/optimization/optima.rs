//! Optima of the library's problems compared with published and independently computed ones.

use linkwright::cases::{Conclusion, Optimum, attempt_with, find, impact_absorber, slider_crank};
use linkwright::nlp::{Program, Sqp, SubproblemSolver};
use linkwright::problem::{DirectCoupling, Problem};
use linkwright::sao::{Method, RunState, Status, preset};
use std::f64::consts::TAU;

/// Digits to which the objective agrees: the accuracy of the stop test.
const ACCURACY: f64 = 1e-5;

#[track_caller]
fn assert_optimum(problem: &Problem, state: &RunState, optimum: &Optimum, tolerance: f64) {
    assert_eq!(state.status, Status::Converged, "{}: {}", problem.name, state.reason);
    let error = (state.evaluation.objective / optimum.objective - 1.0).abs();
    assert!(
        error < ACCURACY,
        "{}: F = {} is {error:e} from {}",
        problem.name,
        state.evaluation.objective,
        optimum.source
    );
    assert!(state.evaluation.max_violation_pct() < 100.0 * ACCURACY);
    for ((b, exact), variable) in state.design.iter().zip(optimum.design.unwrap()).zip(&problem.variables) {
        let turns = if variable.unit == "rad" { TAU } else { f64::INFINITY };
        let apart = if turns.is_finite() { (b - exact).rem_euclid(turns) } else { (b - exact).abs() };
        let apart = apart.min(turns - apart);
        assert!(apart <= tolerance * exact.abs(), "{}: {} = {b}, not {exact}", problem.name, variable.name);
    }
}

#[test]
fn the_impact_absorber_with_either_objective() {
    let peak = impact_absorber::peak_acceleration().unwrap();
    let state = Method::slp().solve(&peak, |_| ()).unwrap();
    assert_optimum(&peak, &state, &impact_absorber::peak_acceleration_optimum(), 1e-5);
    assert_eq!([state.cycles(), state.counters.analyses, state.counters.sensitivity_analyses], [5, 6, 6]);
    assert!(state.counters.subproblem_iterations >= 5);

    let comfort = impact_absorber::comfort().unwrap();
    let state = Method::slp().solve(&comfort, |_| ()).unwrap();
    assert_optimum(&comfort, &state, &impact_absorber::comfort_optimum(), 1e-4);
    assert_eq!([state.cycles(), state.counters.analyses, state.counters.sensitivity_analyses], [8, 9, 9]);
}

#[test]
fn the_slider_crank_from_both_stand_in_starts() {
    for start in [slider_crank::STAND_IN_START, slider_crank::SECOND_STAND_IN_START] {
        let problem = slider_crank::path_generation(start).unwrap();
        let state = Method::slp().solve(&problem, |_| ()).unwrap();
        assert_optimum(&problem, &state, &slider_crank::optimum(), 1e-3);
        assert!((state.evaluation.objective - 3.746_106).abs() < 5e-6, "{}", state.evaluation.objective);
    }
}

#[test]
fn the_slider_crank_from_sixteen_random_feasible_starts_with_free_angles() {
    let mut wrong = vec![];
    for start in slider_crank::random_starts(1998, 16) {
        let problem = slider_crank::path_generation(start).unwrap();
        let state = Method::slp().solve(&problem, |_| ()).unwrap();
        if state.status != Status::Converged || (state.evaluation.objective - 3.746_106).abs() > 4e-5 {
            wrong.push(format!(
                "{start:.2?}: {} after {} cycles: {}",
                state.evaluation.objective,
                state.cycles(),
                state.reason
            ));
        }
    }
    assert!(wrong.is_empty(), "{} of 16:\n{}", wrong.len(), wrong.join("\n"));
}

/// SLSQP needs 72 + 47 in the median; a Gauss–Newton SQP needs 18 + 11 and fails from three of the starts.
#[test]
fn a_filter_takes_the_slider_crank_from_all_sixteen_starts_in_few_analyses() {
    let method = || (preset("slp-filter").unwrap().method)();
    let optima = find("slider-crank").unwrap().optima();
    let mut works: Vec<_> = slider_crank::random_starts(1998, 16)
        .into_iter()
        .map(|start| {
            let problem = slider_crank::path_generation(start).unwrap();
            let end = attempt_with(&problem, &method(), optima, ["slider-crank", "slp-filter"]).unwrap();
            assert!(matches!(end.conclusion, Conclusion::Reached(_)), "{start:?}: {end:?}");
            let work = end.to_optimum.unwrap();
            [work.analyses, work.sensitivity_analyses]
        })
        .collect();
    works.sort_unstable();
    assert!(works[8] <= [12, 11], "median {:?} of {works:?}", works[8]);
}

#[test]
fn rows_of_the_direct_coupling_have_the_gradients_of_their_values() {
    for in_continuous_time in [false, true] {
        let problem = impact_absorber::peak_acceleration().unwrap();
        let problem = if in_continuous_time { problem.in_continuous_time() } else { problem };
        let direct = DirectCoupling::new(&problem);
        // Away from the start, at which a local maximum is at a time point.
        let x: Vec<f64> = problem.start().iter().map(|x| 1.03 * x).collect();
        let gradients = direct.gradients(&x).unwrap().rows;
        for k in 0..x.len() {
            let h = 1e-5 * x[k].abs();
            let rows = |h: f64| {
                let mut moved = x.clone();
                moved[k] += h;
                direct.values(&moved).unwrap().rows
            };
            for (i, (up, down)) in rows(h).into_iter().zip(rows(-h)).enumerate() {
                let (slope, found) = ((up - down) / (2.0 * h), gradients[(i, k)]);
                assert!((slope - found).abs() < 1e-6 * (1.0 + slope.abs()), "{:?}: {found}, {slope}", direct.row(i));
            }
        }
    }
}

#[test]
fn the_direct_coupling_ends_at_the_same_optima() {
    let path = slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap();
    let cases = [
        (impact_absorber::peak_acceleration().unwrap(), impact_absorber::peak_acceleration_optimum()),
        (impact_absorber::comfort().unwrap(), impact_absorber::comfort_optimum()),
        (path, slider_crank::optimum()),
    ];
    for (problem, optimum) in cases {
        let direct = DirectCoupling::new(&problem);
        let solution = Sqp::default().solve(&direct, &problem.start()).unwrap();
        let error = (solution.objective / optimum.objective - 1.0).abs();
        assert!(
            solution.status.was_successful() && error < ACCURACY,
            "{}: {:?}, {error:e}",
            problem.name,
            solution.status
        );
        assert!(direct.sensitivity_analyses() <= direct.analyses(), "gradients at a known design are no new analysis");
        assert!(direct.analyses() <= solution.evaluations.values + solution.evaluations.gradients);
    }
}
