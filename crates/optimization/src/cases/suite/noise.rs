//! Noise of analyses.

use crate::cases::random::{mixed, symmetric};
use crate::problem::{Analysis, Problem, ResponseAt, Responses};
use crate::responses::Differences;
use error::Result;
use nalgebra::DMatrix;

/// An analysis whose responses have noise:
///
/// $$ r_h(b) + σ\, u_h(b)\, \max\bigl(|r_h(b)|,\ |r_h(b^0)|\bigr) , \qquad u_h \in [-1, 1] , $$
///
/// with the start design b⁰. u is pseudo-random and depends on all bits of the design, on the response and on the time point: a
/// design always has the same responses, and nearby designs have different ones. u has no derivatives.
pub(super) struct Noisy {
    inner: Box<dyn Analysis>,
    noise: f64,
    /// max |r_h(b⁰)| over the time points; zero if the start cannot be analysed.
    at_start: Vec<f64>,
}

impl Noisy {
    /// Gives the analysis of a problem noise, and derivatives by noise-aware differences. Peaks in continuous time become those of
    /// the time points.
    pub fn replace(problem: &mut Problem, noise: f64) {
        let inner = std::mem::replace(&mut problem.analysis, Box::new(Absent));
        let largest = |values: &Vec<f64>| values.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        let at_start = inner.analyze(&problem.start()).map_or(vec![], |r| r.values.iter().map(largest).collect());
        let start = problem.start();
        problem.analysis =
            Box::new(Differences::noise_aware(Self { inner, noise, at_start }).with_typical_sizes(start));
        problem.constraints.iter_mut().for_each(|c| c.is_continuous = false);
    }
}

impl Analysis for Noisy {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let mut responses = self.inner.analyze(b)?;
        let seed = b.iter().fold(0, |seed, x| mixed(seed ^ x.to_bits()));
        for (h, values) in responses.values.iter_mut().enumerate() {
            let at_start = self.at_start.get(h).copied().unwrap_or(0.0);
            for (p, value) in values.iter_mut().enumerate() {
                let u = symmetric(mixed(mixed(seed ^ h as u64) ^ p as u64));
                *value += self.noise * u * value.abs().max(at_start);
            }
        }
        Ok(responses)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.inner.sensitivities(b, responses, wanted)
    }
}

/// Placeholder for an analysis while it is moved into another one.
pub(super) struct Absent;

impl Analysis for Absent {
    fn analyze(&self, _: &[f64]) -> Result<Responses> {
        Ok(Responses::default())
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        Ok(DMatrix::zeros(wanted.len(), b.len()))
    }
}

#[cfg(test)]
mod tests {
    use crate::cases::suite::{Suite, Transformation};

    #[test]
    fn noise_is_repeatable_bounded_and_differs_between_neighbours() {
        let entry = Suite::HockSchittkowski.problems().into_iter().find(|e| e.name == "hs35").unwrap();
        let exact = Transformation::default().build(entry).unwrap();
        let noisy = Transformation::parse("noise=1e-3").unwrap().build(entry).unwrap();
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in 0..1000 {
            let b = [0.5 + 1e-9 * f64::from(k), 0.5, 0.5];
            let of = |p: &crate::problem::Problem| p.analyze_design(&b).unwrap().evaluation.objective;
            assert_eq!(of(&noisy), of(&noisy));
            let relative = (of(&noisy) - of(&exact)) / of(&exact).abs().max(2.25);
            (least, most) = (least.min(relative), most.max(relative));
        }
        assert!((-1e-3..-0.99e-3).contains(&least) && (0.99e-3..1e-3).contains(&most), "{least} {most}");
    }
}
