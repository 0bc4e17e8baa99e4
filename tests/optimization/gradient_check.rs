//! Gradient checks of analyses with known faults: each kind of wrong derivative has its status.

use linkwright::gradient_check::{GradientCheck, GradientStatus, check};
use linkwright::problem::{Analysis, GradientMethod, ResponseAt, Responses};
use linkwright::responses::Differences;
use linkwright::{Error, Result};
use nalgebra::DMatrix;
use std::sync::atomic::{AtomicU64, Ordering};

/// r₀ = b₀² sin b₁, r₁ = |b₀ − 1| + b₁, r₂ = exp b₀; the derivatives are exact except for `fault`.
#[derive(Default)]
struct Faulty {
    fault: WrongDerivative,
    calls: AtomicU64,
}

#[derive(Default, PartialEq)]
enum WrongDerivative {
    #[default]
    Absent,
    WrongSign,
    SlightlyOff,
    ForgottenTerm,
    Unrepeatable,
}

impl Analysis for Faulty {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let drift = match self.fault {
            WrongDerivative::Unrepeatable => 1e-9 * self.calls.fetch_add(1, Ordering::Relaxed) as f64,
            _ => 0.0,
        };
        let r = [b[0].powi(2) * b[1].sin() + drift, (b[0] - 1.0).abs() + b[1], b[0].exp()];
        Ok(Responses::new(r.iter().map(|&r| vec![r]).collect()))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let mut all =
            [[2.0 * b[0] * b[1].sin(), b[0].powi(2) * b[1].cos()], [(b[0] - 1.0).signum(), 1.0], [b[0].exp(), 0.0]];
        match self.fault {
            WrongDerivative::WrongSign => all[0][1] *= -1.0,
            WrongDerivative::SlightlyOff => all[0][1] *= 1.0 + 1e-5,
            WrongDerivative::ForgottenTerm => all[2][0] = 0.0,
            _ => {}
        }
        Ok(DMatrix::from_fn(wanted.len(), 2, |row, i| all[wanted[row].response][i]))
    }
}

fn examine(fault: WrongDerivative, b: [f64; 2]) -> GradientCheck {
    let (sound, faulty) = (Faulty::default(), Faulty { fault, ..Faulty::default() });
    let wanted = [0, 1, 2].map(|response| ResponseAt { response, point: 0 });
    let methods = [GradientMethod::of("by hand", &faulty), GradientMethod::of("exact", &sound)];
    check(&faulty, &methods, &b, &[1.0, 1.0], &wanted).unwrap()
}

/// The status of one derivative in a sentence.
fn words(checked: &GradientCheck, response: usize, variable: usize) -> String {
    let found = checked.derivatives.iter().find(|d| d.at.response == response && d.variable == variable).unwrap();
    found.explanation(&checked.methods)
}

fn status(checked: &GradientCheck, response: usize, variable: usize) -> (GradientStatus, Vec<usize>) {
    let found = checked.derivatives.iter().find(|d| d.at.response == response && d.variable == variable).unwrap();
    (found.status, found.disagreeing.clone())
}

#[test]
fn right_and_constant_derivatives_are_distinguished() {
    let checked = examine(WrongDerivative::Absent, [1.5, 0.7]);
    assert!(checked.is_right());
    checked.expect_right();
    assert_eq!(status(&checked, 2, 1), (GradientStatus::Constant, vec![]));
    assert_eq!(words(&checked, 2, 1), "the response does not depend on the variable");
    assert_eq!(words(&checked, 0, 1), "all methods agree with the differences");
    assert_eq!(checked.count(GradientStatus::Right), 5);
}

#[test]
fn a_wrong_derivative_is_found_with_its_method() {
    for fault in [WrongDerivative::WrongSign, WrongDerivative::SlightlyOff] {
        let checked = examine(fault, [1.5, 0.7]);
        assert_eq!(status(&checked, 0, 1), (GradientStatus::Wrong, vec![0]));
        assert_eq!(words(&checked, 0, 1), "by hand is wrong: exact agrees with the differences");
        assert_eq!((checked.count(GradientStatus::Wrong), checked.is_right()), (1, false));
    }
    let checked = examine(WrongDerivative::ForgottenTerm, [1.5, 0.7]);
    assert_eq!(status(&checked, 2, 0), (GradientStatus::Wrong, vec![0]));
}

#[test]
fn a_kink_is_found() {
    let checked = examine(WrongDerivative::Absent, [1.0, 0.7]);
    assert_eq!(status(&checked, 1, 0), (GradientStatus::Kink, vec![]));
    assert_eq!(status(&checked, 1, 1).0, GradientStatus::Right);
    let jump = checked.derivatives.iter().find_map(|d| d.slope_discontinuity).unwrap();
    assert!((jump - 2.0).abs() < 1e-6, "{jump}");
    assert!(words(&checked, 1, 0).starts_with("the slope jumps by 2.000e0 at this design or very close to it"));
}

#[test]
fn an_analysis_that_does_not_repeat_is_found() {
    let checked = examine(WrongDerivative::Unrepeatable, [1.5, 0.7]);
    assert_eq!(status(&checked, 0, 0).0, GradientStatus::NotRepeatable);
    assert_eq!(status(&checked, 0, 1).0, GradientStatus::NotRepeatable);
    assert!(
        words(&checked, 0, 1).starts_with("two analyses of this design differ by 1.0e-9"),
        "{}",
        words(&checked, 0, 1)
    );
    assert_eq!(status(&checked, 2, 0).0, GradientStatus::Right);
}

#[test]
fn noisy_differences_are_replaced_by_a_reliable_method() {
    /// sin b with noise that hides the slope; one method has the wrong sign, one uses differences of the values without noise.
    struct Noisy;
    impl Analysis for Noisy {
        fn analyze(&self, b: &[f64]) -> Result<Responses> {
            Ok(Responses::new(vec![vec![1e-2 * b[0].sin() + (1e9 * b[0]).sin()]]))
        }
        fn sensitivities(&self, b: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
            Ok(DMatrix::from_element(1, 1, 1e-2 * b[0].cos()))
        }
    }
    let residuals = |step: f64, b: &[f64], _: &Responses, _: &[ResponseAt]| {
        Ok(DMatrix::from_element(1, 1, 1e-2 * ((b[0] + step).sin() - (b[0] - step).sin()) / (2.0 * step)))
    };
    let wrong = |b: &[f64], _: &Responses, _: &[ResponseAt]| Ok(DMatrix::from_element(1, 1, -1e-2 * b[0].cos()));
    let methods = || {
        [
            GradientMethod::of("direct", &Noisy),
            GradientMethod::exact("adjoint", wrong),
            GradientMethod::approximate("semi-analytical", 1e-5, residuals),
        ]
    };
    let wanted = [ResponseAt { response: 0, point: 0 }];
    let examine = |methods: &[GradientMethod]| check(&Noisy, methods, &[0.7], &[1.0], &wanted).unwrap();
    let checked = examine(&methods());
    assert_eq!(status(&checked, 0, 0), (GradientStatus::Wrong, vec![1]));
    // Without the reliable method either of the two may be wrong, and one alone cannot be checked.
    assert_eq!(status(&examine(&methods()[..2]), 0, 0), (GradientStatus::Wrong, vec![0, 1]));
    assert_eq!(status(&examine(&methods()[..1]), 0, 0).0, GradientStatus::Unclear);
}

#[test]
fn differences_with_too_long_steps_are_wrong() {
    let sound = Faulty::default();
    let examine = |step: f64| {
        let differences = Differences::forward(&sound, step).unwrap();
        let wanted = [0, 2].map(|response| ResponseAt { response, point: 0 });
        let methods = differences.gradient_methods().into_iter().chain([GradientMethod::of("exact", &sound)]);
        check(&sound, &methods.collect::<Vec<_>>(), &[1.5, 0.7], &[1.0, 1.0], &wanted).unwrap()
    };
    assert!(examine(1e-6).is_right());
    let checked = examine(0.02);
    assert_eq!(status(&checked, 0, 0), (GradientStatus::Wrong, vec![0]));
    assert_eq!(words(&checked, 0, 0), "forward is wrong: exact agrees with the differences");
}

/// A method that does not offer a derivative is omitted; one that fails is named with its error, and the others are checked.
#[test]
fn unsupported_methods_are_omitted_and_failing_ones_named() {
    let sound = Faulty::default();
    let wanted = [ResponseAt { response: 0, point: 0 }];
    let examine = |error: Error| {
        let fails = move |_: &[f64], _: &Responses, _: &[ResponseAt]| Err(error.clone());
        let methods = [GradientMethod::of("exact", &sound), GradientMethod::exact("failing", fails)];
        check(&sound, &methods, &[1.5, 0.7], &[1.0, 1.0], &wanted)
    };
    let omitted =
        examine(Error::unsupported("contact", "adjoint derivatives do not support impacts", "use others")).unwrap();
    assert!(omitted.is_right());
    assert_eq!(omitted.methods, ["exact"]);
    let errors = [
        Error::definition("model", "makes different elements", "do not"),
        Error::analysis("joint", "no convergence", "move the design"),
        Error::check_length("rows", 1, 2).unwrap_err(),
    ];
    for error in errors {
        let checked = examine(error.clone()).unwrap();
        assert_eq!((checked.methods.as_slice(), checked.count(GradientStatus::Right)), (&["exact".to_owned()][..], 2));
        assert_eq!(checked.failed, [("failing".to_owned(), error.to_string())]);
        assert!(!checked.is_right());
    }
    // The first method is the analysis' own: without it nothing can be checked.
    let fails = |_: &[f64], _: &Responses, _: &[ResponseAt]| Err(Error::unsupported("r", "none", "differences"));
    let alone = check(&sound, &[GradientMethod::exact("failing", fails)], &[1.5, 0.7], &[1.0, 1.0], &wanted);
    assert!(matches!(alone, Err(Error::Unsupported { .. })));
}

#[cfg(feature = "mechanics")]
mod mechanisms {
    use super::status;
    use linkwright::Result;
    use linkwright::autodiff::Scalar;
    use linkwright::cases::{Chain, FourBar, Governor, SliderCrank};
    use linkwright::gradient_check::GradientStatus;
    use linkwright::mechanics::analyses::dynamics::Dynamics;
    use linkwright::mechanics::analyses::statics::Statics;
    use linkwright::mechanics::initial_conditions::Assembly;
    use linkwright::mechanics::integrators::explicit::Explicit;
    use linkwright::mechanics::integrators::generalized_alpha::Newton;
    use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
    use linkwright::responses::mechanism::check_model;

    #[test]
    fn mechanisms_are_checked_in_one_line_by_every_method() {
        let times = [0.05, 0.1];
        let settings = Dynamics { newton: Newton { tolerance: 1e-11, iterations: 20 }, ..Dynamics::fixed(0.005) };
        let checked = check_model(SliderCrank::rigid(), &SliderCrank::DESIGN, settings, &times).unwrap();
        checked.expect_right();
        assert_eq!(checked.methods, ["direct", "adjoint", "semi-analytical"]);
        let four_bar = FourBar::as_published();
        let checked = check_model(four_bar, &[0.0385, 0.0252, 0.02], four_bar.dynamics().unwrap(), &times).unwrap();
        checked.expect_right();
        let chain = Chain::horizontal(3);
        check_model(chain, &chain.equal_links(), Explicit::eighth_order(1e-11), &times).unwrap().expect_right();
    }

    #[test]
    fn kinematics_and_statics_are_checked() {
        let checked =
            check_model(SliderCrank::rigid(), &SliderCrank::DESIGN, Assembly::default(), &[0.0, 0.07]).unwrap();
        checked.expect_right();
        assert!(checked.methods.iter().any(|name| name == "semi-analytical"));
        let settings = Statics { tolerance: 1e-12, ..Statics::default() };
        check_model(Governor { angle: 0.8 }, &Governor::DESIGN, settings, &[0.0]).unwrap().expect_right();
    }

    /// A cart whose mass loses its derivatives by `.re()`, a common mistake in models.
    struct Forgetful;

    impl ParametricMechanism for Forgetful {
        fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
            let mut m = Mechanism::new();
            let cart = m.coordinate("cart", S::from(0.1), S::from(0.0));
            m.inertia("mass", cart, S::from(b[0].re()));
            let spring =
                m.coordinate_spring("spring", m.ground().x, cart, [b[1], S::from(0.0), S::from(0.0), S::from(0.0)]);
            let force = m.measure(spring, "generalized_force")?;
            m.output("spring force", &[force]);
            Ok(m)
        }
    }

    #[test]
    fn a_derivative_that_is_lost_in_dual_numbers_is_found_by_the_method_without_them() {
        let checked = check_model(Forgetful, &[1.3, 40.0], Dynamics::fixed(0.01), &[0.1]).unwrap();
        assert_eq!(status(&checked, 0, 0), (GradientStatus::Wrong, vec![0, 1]));
        let words = checked.derivatives[0].explanation(&checked.methods);
        assert_eq!(words, "direct and adjoint are wrong: semi-analytical agrees with the differences");
        assert_eq!(status(&checked, 0, 1).0, GradientStatus::Right);
    }
}
