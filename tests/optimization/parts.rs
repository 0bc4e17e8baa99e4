//! Interchangeable parts on problems with published optima and iterates.

use linkwright::approximation::{
    Approximation, Asymptotes, Conlin, CurvatureRule, DiagonalQuadratic, FullQuadratic, Hessian, Linear, Mma,
    Reciprocal, Tana, TwoPointExponential,
};
use linkwright::autodiff::Scalar;
use linkwright::cases::{self, impact_absorber::ClosedFormMotion};
use linkwright::function;
use linkwright::problem::*;
use linkwright::sao::*;

fn cantilever() -> Problem {
    cases::cantilever::problem().unwrap()
}

/// The two-bar truss whose weight is approximated, too.
fn two_bar() -> Problem {
    let mut problem = cases::two_bar_truss::problem().unwrap();
    problem.objective = problem.objective.directly(Intermediates::Identity);
    problem
}

fn method(approximation: impl Approximation + 'static) -> Method {
    let stop = Stop { accuracy: 1e-9, ..Default::default() };
    Method { approximation: Box::new(approximation), stop, ..Method::slp() }
}

fn all_methods() -> Vec<(&'static str, Method)> {
    let quadratic = |curvature| method(DiagonalQuadratic { curvature });
    vec![
        ("linear", method(Linear)),
        ("reciprocal", method(Reciprocal)),
        ("CONLIN", method(Conlin)),
        ("MMA 1987", method(Mma::SVANBERG_1987)),
        ("MMA 2002", method(Mma::SVANBERG_2002)),
        ("two-point exponential", method(TwoPointExponential { least: -3.0, ..Default::default() })),
        ("TANA-3", method(Tana::default())),
        ("spherical value", quadratic(CurvatureRule::SphericalValue)),
        ("spherical gradient", quadratic(CurvatureRule::SphericalGradient)),
        ("quadratic reciprocal", quadratic(CurvatureRule::Reciprocal)),
        ("quadratic MMA", quadratic(CurvatureRule::Asymptotes(Asymptotes::SVANBERG_2002))),
        ("quadratic exponential", quadratic(CurvatureRule::Exponential)),
        ("quadratic exact", quadratic(CurvatureRule::Exact)),
        ("BFGS", method(FullQuadratic { hessian: Hessian::Bfgs(10) })),
        ("Hessian", method(FullQuadratic { hessian: Hessian::Exact })),
        ("convex Hessian", method(FullQuadratic { hessian: Hessian::ExactConvex })),
    ]
}

/// Checks that the run converges to the published optimum to six digits, with a violation below 1e-6.
fn assert_optimum(name: &str, problem: &Problem, method: &Method, objective: f64) -> RunState {
    let end = method.solve(problem, |_| ()).unwrap();
    let error = (end.evaluation.objective - objective).abs() / objective;
    let violation = end.evaluation.max_violation_pct() / 100.0;
    assert_eq!(end.status, Status::Converged, "{name} on {}: {}", problem.name, end.reason);
    assert!(error < 1e-6 && violation < 1e-6, "{name} on {}: {error:e} {violation:e}", problem.name);
    end
}

const CANTILEVER: f64 = 1.339_956_36;
const TWO_BAR: f64 = 1.508_652_42;

#[test]
fn conservative_methods_reach_published_optima_from_every_feasible_start() {
    for (problem, objective) in [(cantilever(), CANTILEVER), (two_bar(), TWO_BAR)] {
        for (name, method) in all_methods() {
            // A reciprocal objective or stress may be concave; conservatism then takes many cycles.
            if name == "reciprocal"
                || (problem.name == "cantilever" && ["CONLIN", "quadratic reciprocal"].contains(&name))
            {
                continue;
            }
            let globalization = Box::new(Conservatism::default());
            let method = Method { globalization, move_limits: Box::new(FixedLimits::default()), ..method };
            let end = assert_optimum(name, &problem, &method, objective);
            assert!(end.counters.sensitivity_analyses < 25 && end.counters.analyses < 50, "{name}: {:?}", end.counters);
        }
    }
}

#[test]
fn the_optimum_of_the_cantilever_is_its_closed_form() {
    let method = method(TwoPointExponential { least: -3.0, ..Default::default() });
    let end = assert_optimum("exponential", &cantilever(), &method, CANTILEVER);
    let sum: f64 = [61.0, 37.0, 19.0, 7.0, 1.0f64].iter().map(|a| a.powf(0.25)).sum();
    for (x, a) in end.design.iter().zip([61.0, 37.0, 19.0, 7.0, 1.0f64]) {
        assert!((x - sum.cbrt() * a.powf(0.25)).abs() < 1e-6);
    }
    // Six analyses until the first design within 1e-5; the best of the other programs also needs six. The confirmation needs two.
    assert!(end.counters.analyses <= 8);
}

#[test]
fn proportional_asymptotes_give_the_iterates_of_mma_on_the_cantilever() {
    let mma = Mma { asymptotes: Asymptotes::Proportional(0.5), ..Mma::SVANBERG_1987 };
    let globalization: Box<dyn Globalization> = Box::new(AcceptAlways);
    let method = Method { globalization, move_limits: Box::new(FixedLimits::default()), ..method(mma) };
    let end = assert_optimum("MMA with s = 0.5", &cantilever(), &method, CANTILEVER);
    let objectives: Vec<f64> = end.history.iter().map(|c| c.objective).collect();
    // The approximation underestimates a deflection that decreases with x⁻³, less in each cycle.
    assert!(end.counters.analyses <= 7, "{objectives:?}");
}

#[test]
fn filters_accept_what_conservatism_would_repeat() {
    for (name, approximation) in [("exact", CurvatureRule::Exact), ("exponential", CurvatureRule::Exponential)] {
        for (globalization, limits) in [
            (
                Box::new(Filter::default()) as Box<dyn Globalization>,
                Box::new(TrustRegion::default()) as Box<dyn MoveLimits>,
            ),
            (Box::new(FilteredConservatism::default()), Box::new(FixedLimits::default())),
        ] {
            let method =
                Method { globalization, move_limits: limits, ..method(DiagonalQuadratic { curvature: approximation }) };
            let end = assert_optimum(name, &cantilever(), &method, CANTILEVER);
            assert!(end.counters.analyses <= 14, "{name}: {:?}", end.counters);
        }
    }
}

#[test]
fn an_equality_holds_and_its_multiplier_has_a_sign() {
    let mut parts = ProblemBuilder::new("nearest point of a hyperbola");
    parts.variable(DesignVariable::new("x", "", 2.0).within(0.1, 5.0));
    parts.variable(DesignVariable::new("y", "", 3.0).within(0.1, 5.0));
    parts.variable(DesignVariable::new("product", "", 2.0).within(2.0, 2.0));
    let product = parts.constant("product of x and y", "");
    struct Product;
    impl ClosedForm for Product {
        fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
            b[0] * b[1]
        }
    }
    parts.minimize(
        "distance",
        "",
        Quantity::plain(function!(|p| p.design[0] * p.design[0] * 4.0 + p.design[1] * p.design[1])),
    );
    let gap = function!(|p| p.response[0] - p.design[2]);
    parts.subject_to(Constraint::equal("on the hyperbola", 0.0, Quantity::plain(gap).of(&[product])));
    let problem = parts.build_analytic(Product).unwrap();
    let end = method(FullQuadratic { hessian: Hessian::Exact }).solve(&problem, |_| ()).unwrap();
    // 4x² + y² with xy = p: x = √(p/2), y = √(2p), F = 4p, dF/dp = 4.
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    assert!((end.design[0] - 1.0).abs() < 1e-8 && (end.evaluation.objective - 8.0).abs() < 1e-7, "{:?}", end.design);
    let post = PostOptimal::new(&problem, &end).unwrap();
    assert!((post.objective(&problem, Parameter::Variable(2)).unwrap() - 4.0).abs() < 1e-7);
    let change = post.design(&problem, Parameter::Variable(2)).unwrap();
    assert!((change[0] - 0.25).abs() < 1e-6 && (change[1] - 0.5).abs() < 1e-6, "{change:?}");
    assert!(post.objective(&problem, Parameter::Variable(0)).is_err());
}

/// The impact absorber with its constraints at all times.
fn absorber(continuous: bool, travel: f64) -> Problem {
    let mut parts = ProblemBuilder::new("impact absorber in continuous time");
    parts.variable(DesignVariable::new("stiffness k", "N/m", 1.0).within(1e-6, 1.0));
    parts.variable(DesignVariable::new("damping c", "N·s/m", 0.3).within(1e-6, 1.0));
    let time = parts.grid(TimeGrid::uniform(0.0, 12.0, 101).unwrap());
    let displacement = parts.transient("displacement", "m", time);
    let acceleration = parts.transient("acceleration", "m/s²", time);
    parts.variable(DesignVariable::new("peak acceleration", "m/s²", 0.85).within(0.0, f64::INFINITY));
    parts.minimize("peak acceleration", "m/s²", Quantity::plain(function!(|p| p.design[2])));
    for sign in [1.0, -1.0] {
        let excess = function!([sign: f64 = sign] |p| p.response[0] * sign - p.design[2]);
        let side = function!([sign: f64 = sign] |p| p.response[0] * sign);
        let a = Constraint::at_most(
            format!("acceleration {sign}"),
            0.0,
            Quantity::each_point(time, excess).of(&[acceleration]),
        );
        let y = Constraint::at_most(
            format!("displacement {sign}"),
            travel,
            Quantity::each_point(time, side).of(&[displacement]),
        );
        for c in [a, y] {
            parts.subject_to(if continuous { c.in_continuous_time() } else { c });
        }
    }
    parts.build_analytic(ClosedFormMotion).unwrap()
}

#[test]
fn a_moving_peak_needs_one_row_and_no_oscillation() {
    let problem = absorber(true, 1.0);
    let end = Method::slp().solve(&problem, |_| ()).unwrap();
    assert_eq!(end.status, Status::Converged);
    assert!((end.evaluation.objective - 0.520_599).abs() < 1e-6 && end.evaluation.max_violation_pct() < 1e-3);
    assert!((end.design[0] - 0.360_57).abs() < 1e-5 && (end.design[1] - 0.485_16).abs() < 2e-5, "{:?}", end.design);
    assert_eq!((end.cycles(), end.counters.analyses, end.counters.sensitivity_analyses), (4, 6, 6));
    assert!(end.history.iter().all(|c| c.retained.len() <= 2));
    let fixed = Method { moving_peaks: false, ..Method::slp() }.solve(&problem, |_| ()).unwrap();
    assert!(fixed.cycles() > 3 * end.cycles(), "{}", fixed.cycles());
    let json = RunState::from_json(&end.to_json(), &problem).unwrap();
    assert_eq!(json.evaluation, end.evaluation);
}

#[test]
fn the_optimum_moves_as_predicted() {
    let stop = Stop { accuracy: 1e-10, ..Default::default() };
    let solve = |travel: f64| {
        let method = Method { stop, ..Method::slp() };
        method.solve(&absorber(true, travel), |_| ()).unwrap()
    };
    let (problem, end) = (absorber(true, 1.0), solve(1.0));
    let post = PostOptimal::new(&problem, &end).unwrap();
    assert!(post.residual < 1e-6, "{}", post.residual);
    let limit = problem.constraints.iter().position(|c| c.name == "displacement 1").unwrap();
    let h = 1e-3;
    let (up, down) = (solve(1.0 + h), solve(1.0 - h));
    let slope = (up.evaluation.objective - down.evaluation.objective) / (2.0 * h);
    let predicted = post.objective(&problem, Parameter::Limit(limit)).unwrap();
    assert!((predicted - slope).abs() < 1e-4 * slope.abs(), "{predicted} {slope}");
    for (k, change) in post.design(&problem, Parameter::Limit(limit)).unwrap().into_iter().enumerate() {
        let slope = (up.design[k] - down.design[k]) / (2.0 * h);
        assert!((change - slope).abs() < 1e-3 * slope.abs().max(0.1), "{k}: {change} {slope}");
    }
    let words = post.in_words(&problem, &end);
    assert!(words.iter().any(|w| w.starts_with("displacement 1 at time 2.")), "{words:?}");
}
