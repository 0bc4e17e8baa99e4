//! What the check of derivatives finds: each ill named for what it is.

use linkwright::Result;
use linkwright::problem::check::{Finding, Proof, check};
use linkwright::problem::{Analysis, Instant, Responses};
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

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
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

fn examine(ill: Ill, b: [f64; 2]) -> Proof {
    let (healthy, patient) = (Patient::default(), Patient { ill, ..Patient::default() });
    let wanted = [0, 1, 2].map(|response| Instant { response, point: 0 });
    let methods: [(&str, &dyn Analysis); 2] = [("by hand", &patient), ("exact", &healthy)];
    check(&patient, &methods, &b, &[1.0, 1.0], &wanted).unwrap()
}

fn finding(proof: &Proof, response: usize, variable: usize) -> (Finding, Vec<usize>) {
    let found = proof.derivatives.iter().find(|d| d.instant.response == response && d.variable == variable).unwrap();
    (found.finding, found.suspects.clone())
}

#[test]
fn what_is_right_is_called_right_and_a_constant_a_constant() {
    let proof = examine(Ill::Healthy, [1.5, 0.7]);
    assert!(proof.is_right());
    proof.expect_right();
    assert_eq!(finding(&proof, 2, 1), (Finding::Constant, vec![]));
    assert_eq!(proof.count(Finding::Right), 5);
}

#[test]
fn a_wrong_derivative_is_found_with_the_method_that_is_to_blame() {
    for ill in [Ill::WrongSign, Ill::SlightlyOff] {
        let proof = examine(ill, [1.5, 0.7]);
        assert_eq!(finding(&proof, 0, 1), (Finding::Wrong, vec![0]));
        assert_eq!((proof.count(Finding::Wrong), proof.is_right()), (1, false));
    }
    let proof = examine(Ill::ForgottenTerm, [1.5, 0.7]);
    assert_eq!(finding(&proof, 2, 0), (Finding::Wrong, vec![0]));
}

#[test]
fn a_kink_is_called_a_kink() {
    let proof = examine(Ill::Healthy, [1.0, 0.7]);
    assert_eq!(finding(&proof, 1, 0), (Finding::Kink, vec![]));
    assert_eq!(finding(&proof, 1, 1).0, Finding::Right);
    let jump = proof.derivatives.iter().find_map(|d| d.jump).unwrap();
    assert!((jump - 2.0).abs() < 1e-6, "{jump}");
}

#[test]
fn an_analysis_that_does_not_repeat_is_called_that() {
    let proof = examine(Ill::Unrepeatable, [1.5, 0.7]);
    assert_eq!(finding(&proof, 0, 0).0, Finding::NotRepeatable);
    assert_eq!(finding(&proof, 0, 1).0, Finding::NotRepeatable);
    assert_eq!(finding(&proof, 2, 0).0, Finding::Right);
}

#[cfg(feature = "multibody")]
#[test]
fn mechanisms_are_proved_in_one_line() {
    use linkwright::analysis::Dynamics;
    use linkwright::multibody::mechanisms::{FourBar, SliderCrank};
    use linkwright::sensitivity::check_model;
    let times = [0.05, 0.1];
    check_model(SliderCrank::rigid(), &SliderCrank::DESIGN, Dynamics::fixed(0.005), &times).unwrap().expect_right();
    let four_bar = FourBar::as_published();
    let proof = check_model(four_bar, &[0.0385, 0.0252, 0.02], four_bar.dynamics().unwrap(), &times).unwrap();
    proof.expect_right();
}
