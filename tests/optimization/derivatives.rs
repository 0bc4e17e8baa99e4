//! Exact derivatives compared with finite differences, for all problems of the library.

use linkwright::approximation::{
    ApproximateProblem, ApproximationOptions, CycleData, DesignHistory, Linear, LinearizationPoint, SubproblemBox,
};
use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::nlp::Program;
use linkwright::problem::{Problem, ResponseAt, Sensitivities, SignedQuantity};
use linkwright::sao::{MoveLimits, RelativeLimits, Screening};
use nalgebra::DMatrix;

/// Largest difference allowed, relative to the largest entry of its row. Differences themselves are good to about 1e-10.
const TOLERANCE: f64 = 1e-8;

/// ∂f/∂x by central differences, extrapolated to fourth order (Richardson).
fn differences(f: impl Fn(&[f64]) -> Vec<f64>, x: &[f64]) -> DMatrix<f64> {
    let central = |k: usize, h: f64| -> Vec<f64> {
        let at =
            |step: f64| f(&x.iter().enumerate().map(|(i, &v)| if i == k { v + step } else { v }).collect::<Vec<_>>());
        at(h).iter().zip(at(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect()
    };
    let column = |k: usize| -> Vec<f64> {
        let h = 2e-3 * x[k].abs().max(0.1);
        central(k, 0.5 * h).iter().zip(central(k, h)).map(|(fine, coarse)| (4.0 * fine - coarse) / 3.0).collect()
    };
    let columns: Vec<Vec<f64>> = (0..x.len()).map(column).collect();
    DMatrix::from_fn(columns[0].len(), x.len(), |i, k| columns[k][i])
}

#[track_caller]
fn assert_close(what: &str, exact: &DMatrix<f64>, difference: &DMatrix<f64>) {
    assert_eq!(exact.shape(), difference.shape(), "{what}");
    let floor = 1e-3 * exact.amax();
    for i in 0..exact.nrows() {
        let scale = exact.row(i).amax().max(floor).max(1e-3);
        let error = (exact.row(i) - difference.row(i)).amax() / scale;
        assert!(error < TOLERANCE, "{what}, row {i}: {error:e}\n{}{}", exact.row(i), difference.row(i));
    }
}

/// Checks all derivatives at design `b`: of responses, quantities and the approximate problem.
#[track_caller]
fn assert_derivatives(problem: &Problem, b: &[f64]) {
    let known = assert_responses(problem, b);
    assert_quantities(problem, b, &known);
    assert_approximate_problem(problem, b);
}

/// ∂r/∂b of all responses at all time points.
#[track_caller]
fn assert_responses(problem: &Problem, b: &[f64]) -> Sensitivities {
    let responses = problem.analyze(b).unwrap();
    let histories = responses.values.iter().enumerate();
    let points =
        |(response, history): (usize, &Vec<f64>)| (0..history.len()).map(move |point| ResponseAt { response, point });
    let at: Vec<ResponseAt> = histories.flat_map(points).collect();
    let rows = problem.sensitivities(b, &responses, &at).unwrap();
    assert_close("responses", &rows, &differences(|b| problem.analyze(b).unwrap().values.concat(), b));
    Sensitivities { at, rows }
}

/// dF/db and dg/db of the objective and of all constraints at all their time points.
#[track_caller]
fn assert_quantities(problem: &Problem, b: &[f64], known: &Sensitivities) {
    let responses = problem.analyze(b).unwrap();
    let slope = |signed: SignedQuantity, p| problem.total_derivative(signed, p, b, &responses, known);
    let mut rows = slope(problem.objective.signed(), 0);
    for row in problem.all_rows() {
        let constraint = &problem.constraints[row.constraint];
        rows.extend(slope(constraint.signed(), row.point).iter().map(|s| s / constraint.scale));
    }
    let values = |b: &[f64]| {
        let all = problem.evaluate(b, &problem.analyze(b).unwrap()).unwrap();
        [vec![all.objective], all.residuals.concat()].concat()
    };
    let exact = DMatrix::from_row_iterator(rows.len() / b.len(), b.len(), rows);
    assert_close("objective and constraints", &exact, &differences(values, b));
}

/// Gradients and the Hessian of the Lagrangian of the approximate problem around `b`, away from `b`.
#[track_caller]
fn assert_approximate_problem(problem: &Problem, b: &[f64]) {
    let analyzed = problem.analyze_design(b).unwrap();
    let retained = Screening { cutoff: None, ..Screening::default() }.retain(problem, &analyzed.evaluation);
    let data = CycleData::first_order(problem, &analyzed, retained).unwrap();
    let point = LinearizationPoint::first_order(&analyzed, &data);
    let region = RelativeLimits::default().region(problem, b, &vec![0.4; b.len()]);
    let subproblem_box = SubproblemBox::new(problem, DesignHistory::default().after([b]), (region.lower, region.upper));
    let program =
        ApproximateProblem::new(problem, &Linear, point, (subproblem_box, ApproximationOptions::default())).unwrap();

    let x: Vec<f64> = b.iter().enumerate().map(|(k, v)| v * (1.03 + 0.01 * k as f64)).collect();
    let here = program.gradients(&x).unwrap();
    assert_eq!(here.values, program.values(&x).unwrap(), "values with and without derivatives");
    let exact = here.rows.clone().insert_row(0, 0.0);
    let exact = DMatrix::from_fn(exact.nrows(), b.len(), |i, k| if i == 0 { here.objective[k] } else { exact[(i, k)] });
    let values = |x: &[f64]| {
        let all = program.values(x).unwrap();
        [vec![all.objective], all.rows].concat()
    };
    assert_close("approximate problem", &exact, &differences(values, &x));

    let multipliers: Vec<f64> = (0..program.rows()).map(|i| 0.1 * (i % 7) as f64).collect();
    let slope = |x: &[f64]| -> Vec<f64> {
        let g = program.gradients(x).unwrap();
        let term = |k: usize| (0..multipliers.len()).map(|i| multipliers[i] * g.rows[(i, k)]).sum::<f64>();
        (0..x.len()).map(|k| g.objective[k] + term(k)).collect()
    };
    let hessian = program.lagrangian_hessian(&x, &multipliers).unwrap().expect("approximate problems give it exactly");
    assert_close("Hessian of the Lagrangian", &hessian, &differences(slope, &x));
}

#[test]
fn of_the_impact_absorber_in_all_regimes_of_damping() {
    // Under-damped, nearly critical from both sides, critical, over-damped.
    for (k, c) in [(0.9, 0.3), (0.2501, 1.0), (0.2499, 1.0), (0.25, 1.0), (0.1, 0.9)] {
        assert_derivatives(&impact_absorber::peak_acceleration().unwrap(), &[k, c, 0.6]);
        assert_derivatives(&impact_absorber::comfort().unwrap(), &[k, c]);
    }
}

#[test]
fn of_the_slider_crank() {
    let problem = slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap();
    for b in [slider_crank::STAND_IN_START, slider_crank::SECOND_STAND_IN_START] {
        assert_derivatives(&problem, &b);
    }
    let mut inside = slider_crank::optimum().design.unwrap().to_vec();
    inside[1] = 28.0;
    assert_derivatives(&problem, &inside);
}
