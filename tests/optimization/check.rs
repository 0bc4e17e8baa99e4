//! What the check of derivatives finds: each ill named for what it is.

use linkwright::Result;
use linkwright::problem::check::{GradientCheck, GradientStatus, check};
use linkwright::problem::{Analysis, Differences, GradientMethod, ResponseAt, Responses};
use nalgebra::DMatrix;
use std::sync::atomic::{AtomicU64, Ordering};

/// r₀ = b₀² sin b₁, r₁ = |b₀ − 1| + b₁, r₂ = exp b₀; the slopes are exact but for what `ill` does to them.
#[derive(Default)]
struct Patient {
    ill: Ill,
    calls: AtomicU64,
}

#[derive(Default, PartialEq)]
enum Ill {
    #[default]
    Healthy,
    WrongSign,
    SlightlyOff,
    ForgottenTerm,
    Unrepeatable,
}

impl Analysis for Patient {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let drift = match self.ill {
            Ill::Unrepeatable => 1e-9 * self.calls.fetch_add(1, Ordering::Relaxed) as f64,
            _ => 0.0,
        };
        let r = [b[0].powi(2) * b[1].sin() + drift, (b[0] - 1.0).abs() + b[1], b[0].exp()];
        Ok(Responses::new(r.iter().map(|&r| vec![r]).collect()))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let mut all =
            [[2.0 * b[0] * b[1].sin(), b[0].powi(2) * b[1].cos()], [(b[0] - 1.0).signum(), 1.0], [b[0].exp(), 0.0]];
        match self.ill {
            Ill::WrongSign => all[0][1] *= -1.0,
            Ill::SlightlyOff => all[0][1] *= 1.0 + 1e-5,
            Ill::ForgottenTerm => all[2][0] = 0.0,
            _ => {}
        }
        Ok(DMatrix::from_fn(wanted.len(), 2, |row, i| all[wanted[row].response][i]))
    }
}

fn examine(ill: Ill, b: [f64; 2]) -> GradientCheck {
    let (healthy, patient) = (Patient::default(), Patient { ill, ..Patient::default() });
    let wanted = [0, 1, 2].map(|response| ResponseAt { response, point: 0 });
    let methods = [GradientMethod::of("by hand", &patient), GradientMethod::of("exact", &healthy)];
    check(&patient, &methods, &b, &[1.0, 1.0], &wanted).unwrap()
}

/// The verdict on one derivative in a sentence.
fn words(proof: &GradientCheck, response: usize, variable: usize) -> String {
    let found = proof.derivatives.iter().find(|d| d.instant.response == response && d.variable == variable).unwrap();
    found.explanation(&proof.methods)
}

fn finding(proof: &GradientCheck, response: usize, variable: usize) -> (GradientStatus, Vec<usize>) {
    let found = proof.derivatives.iter().find(|d| d.instant.response == response && d.variable == variable).unwrap();
    (found.finding, found.suspects.clone())
}

#[test]
fn what_is_right_is_called_right_and_a_constant_a_constant() {
    let proof = examine(Ill::Healthy, [1.5, 0.7]);
    assert!(proof.is_right());
    proof.expect_right();
    assert_eq!(finding(&proof, 2, 1), (GradientStatus::Constant, vec![]));
    assert_eq!(words(&proof, 2, 1), "the response does not depend on the variable");
    assert_eq!(words(&proof, 0, 1), "all methods agree with the differences");
    assert_eq!(proof.count(GradientStatus::Right), 5);
}

#[test]
fn a_wrong_derivative_is_found_with_the_method_that_is_to_blame() {
    for ill in [Ill::WrongSign, Ill::SlightlyOff] {
        let proof = examine(ill, [1.5, 0.7]);
        assert_eq!(finding(&proof, 0, 1), (GradientStatus::Wrong, vec![0]));
        assert_eq!(words(&proof, 0, 1), "by hand is wrong: exact agrees with the differences");
        assert_eq!((proof.count(GradientStatus::Wrong), proof.is_right()), (1, false));
    }
    let proof = examine(Ill::ForgottenTerm, [1.5, 0.7]);
    assert_eq!(finding(&proof, 2, 0), (GradientStatus::Wrong, vec![0]));
}

#[test]
fn a_kink_is_called_a_kink() {
    let proof = examine(Ill::Healthy, [1.0, 0.7]);
    assert_eq!(finding(&proof, 1, 0), (GradientStatus::Kink, vec![]));
    assert_eq!(finding(&proof, 1, 1).0, GradientStatus::Right);
    let jump = proof.derivatives.iter().find_map(|d| d.jump).unwrap();
    assert!((jump - 2.0).abs() < 1e-6, "{jump}");
    assert!(words(&proof, 1, 0).starts_with("the slope jumps by 2.000e0 here: there is no derivative"));
}

#[test]
fn an_analysis_that_does_not_repeat_is_called_that() {
    let proof = examine(Ill::Unrepeatable, [1.5, 0.7]);
    assert_eq!(finding(&proof, 0, 0).0, GradientStatus::NotRepeatable);
    assert_eq!(finding(&proof, 0, 1).0, GradientStatus::NotRepeatable);
    assert!(words(&proof, 0, 1).starts_with("two analyses of this design differ by 1.0e-9"), "{}", words(&proof, 0, 1));
    assert_eq!(finding(&proof, 2, 0).0, GradientStatus::Right);
}

#[test]
fn where_differences_cannot_tell_a_sure_witness_can() {
    /// sin b with noise that hides the slope; one method has the wrong sign, one differences what has no noise.
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
    let proof = examine(&methods());
    assert_eq!(finding(&proof, 0, 0), (GradientStatus::Wrong, vec![1]));
    // Without the witness it is not known which of the two is wrong, and of one alone nothing.
    assert_eq!(finding(&examine(&methods()[..2]), 0, 0), (GradientStatus::Wrong, vec![0, 1]));
    assert_eq!(finding(&examine(&methods()[..1]), 0, 0).0, GradientStatus::Unclear);
}

#[test]
fn differences_with_steps_too_long_are_named() {
    let healthy = Patient::default();
    let examine = |step: f64| {
        let differences = Differences::forward(&healthy, step).unwrap();
        let wanted = [0, 2].map(|response| ResponseAt { response, point: 0 });
        let methods = differences.alternatives().into_iter().chain([GradientMethod::of("exact", &healthy)]);
        check(&healthy, &methods.collect::<Vec<_>>(), &[1.5, 0.7], &[1.0, 1.0], &wanted).unwrap()
    };
    assert!(examine(1e-6).is_right());
    let proof = examine(0.02);
    assert_eq!(finding(&proof, 0, 0), (GradientStatus::Wrong, vec![0]));
    assert_eq!(words(&proof, 0, 0), "forward is wrong: exact agrees with the differences");
}

#[cfg(feature = "mechanics")]
mod mechanisms {
    use super::finding;
    use linkwright::Result;
    use linkwright::autodiff::Scalar;
    use linkwright::cases::{Chain, FourBar, Governor, SliderCrank};
    use linkwright::mechanics::analyses::dynamics::Dynamics;
    use linkwright::mechanics::analyses::statics::Statics;
    use linkwright::mechanics::initial_conditions::Assembly;
    use linkwright::mechanics::integrators::explicit::Explicit;
    use linkwright::mechanics::integrators::generalized_alpha::Newton;
    use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism};
    use linkwright::problem::check::GradientStatus;
    use linkwright::responses::mechanism::check_model;

    #[test]
    fn mechanisms_are_proved_in_one_line_by_every_method() {
        let times = [0.05, 0.1];
        let settings = Dynamics { newton: Newton { tolerance: 1e-11, iterations: 20 }, ..Dynamics::fixed(0.005) };
        let proof = check_model(SliderCrank::rigid(), &SliderCrank::DESIGN, settings, &times).unwrap();
        proof.expect_right();
        assert_eq!(proof.methods, ["direct", "adjoint", "semi-analytical"]);
        let four_bar = FourBar::as_published();
        let proof = check_model(four_bar, &[0.0385, 0.0252, 0.02], four_bar.dynamics().unwrap(), &times).unwrap();
        proof.expect_right();
        let chain = Chain::horizontal(3);
        check_model(chain, &chain.equal_links(), Explicit::eighth_order(1e-11), &times).unwrap().expect_right();
    }

    #[test]
    fn kinematics_and_statics_too() {
        let proof = check_model(SliderCrank::rigid(), &SliderCrank::DESIGN, Assembly::default(), &[0.0, 0.07]).unwrap();
        proof.expect_right();
        assert!(proof.methods.iter().any(|name| name == "semi-analytical"));
        let settings = Statics { tolerance: 1e-12, ..Statics::default() };
        check_model(Governor { angle: 0.8 }, &Governor::DESIGN, settings, &[0.0]).unwrap().expect_right();
    }

    /// A pendulum whose mass loses its derivative on the way: what `.re()` in a model does.
    struct Forgetful;

    impl ParametricMechanism for Forgetful {
        fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
            let mut m = Mechanism::new();
            let cart = m.coordinate("cart", S::from(0.1), S::from(0.0));
            m.inertia("mass", cart, S::from(b[0].re()));
            let spring =
                m.coordinate_spring("spring", m.ground().x, cart, [b[1], S::from(0.0), S::from(0.0), S::from(0.0)]);
            let effort = m.measure(spring, "generalized_force")?;
            m.output("effort", &[effort]);
            Ok(m)
        }
    }

    #[test]
    fn a_derivative_that_is_lost_in_dual_numbers_is_found_by_the_method_without_them() {
        let proof = check_model(Forgetful, &[1.3, 40.0], Dynamics::fixed(0.01), &[0.1]).unwrap();
        assert_eq!(finding(&proof, 0, 0), (GradientStatus::Wrong, vec![0, 1]));
        let words = proof.derivatives[0].explanation(&proof.methods);
        assert_eq!(words, "direct and adjoint are wrong: semi-analytical agrees with the differences");
        assert_eq!(finding(&proof, 0, 1).0, GradientStatus::Right);
    }
}
