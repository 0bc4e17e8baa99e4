//! Analyses of many designs: one method of an analysis makes them all, and an analysis may replace it.

use linkwright::cases::impact_absorber;
use linkwright::problem::{Analysis, Differentiated, GradientMethod, ResponseAt, Responses};
use linkwright::responses::Differences;
use linkwright::{Error, Result};
use nalgebra::DMatrix;
use std::thread::{ThreadId, current};

/// r = Σ bᵢ³, in one thread only.
struct InOneThread(ThreadId);

impl Analysis for InOneThread {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        assert_eq!(current().id(), self.0);
        if b[0] > 2.0 {
            return Err(Error::analysis("test", "it is too large", "make it smaller"));
        }
        Ok(Responses::new(vec![vec![b.iter().map(|b| b.powi(3)).sum()]]))
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        designs.iter().map(|b| self.analyze(b)).collect()
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        Ok(DMatrix::from_fn(wanted.len(), b.len(), |_, k| 3.0 * b[k] * b[k]))
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        vec![GradientMethod::of("exact", self)]
    }
}

#[test]
fn differences_and_checks_do_not_leave_the_thread() {
    let (b, wanted) = ([1.0, 0.5, -0.7], [ResponseAt { response: 0, point: 0 }]);
    let analysis = || InOneThread(current().id());
    let differences: [Differences<InOneThread>; 4] = [
        Differences::forward(analysis(), 1e-6).unwrap(),
        Differences::central(analysis(), 1e-6).unwrap(),
        Differences::richardson(analysis(), 1e-3).unwrap(),
        Differences::noise_aware(analysis()),
    ];
    for differences in &differences {
        let here = differences.analyze(&b).unwrap();
        let found = differences.sensitivities(&b, &here, &wanted).unwrap();
        for k in 0..3 {
            assert!((found[(0, k)] - 3.0 * b[k] * b[k]).abs() < 1e-4);
        }
        let [first, failed] = &differences.analyze_many(&[b.to_vec(), vec![3.0; 3]])[..] else { panic!("two designs") };
        assert_eq!(first.as_ref().unwrap().values, here.values);
        assert!(matches!(failed, Err(Error::Analysis { .. })));
    }
    let analysis = Differentiated::by(analysis(), "exact", None).unwrap();
    let methods = linkwright::gradient_check::methods(&analysis);
    linkwright::gradient_check::check(&analysis, &methods, &b, &[1.0; 3], &wanted).unwrap().expect_right();
}

#[test]
fn many_designs_have_the_results_of_each() {
    let problem = impact_absorber::peak_acceleration().unwrap();
    let designs: Vec<Vec<f64>> = (0..20).map(|i| vec![0.1 + 0.04 * f64::from(i), 0.3, 0.8]).collect();
    for (b, many) in designs.iter().zip(problem.analyze_designs(&designs)) {
        let (one, many) = (problem.analyze_design(b).unwrap(), many.unwrap());
        assert_eq!(
            (one.design, one.responses.values, one.evaluation),
            (many.design, many.responses.values, many.evaluation)
        );
    }
    assert!(problem.analyze_designs(&[vec![1.0]]).iter().all(|r| matches!(r, Err(Error::Length { .. }))));
}
