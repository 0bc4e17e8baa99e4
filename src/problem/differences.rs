//! Sensitivities by finite differences, where an analysis gives no better ones.

use super::{Analysis, Instant, Responses};
use crate::error::{Error, Result};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// An analysis whose sensitivities are replaced by differences of itself:
///
/// $$ \frac{\partial r}{\partial b_i} \approx \frac{r(b + h_i e_i) - r(b)}{h_i}, \qquad h_i = \epsilon |b_i| $$
///
/// (forward), or $(r(b + h_i e_i) - r(b - h_i e_i)) / 2 h_i$ (central). Every sensitivity analysis costs n or 2n
/// analyses, done in parallel. With b_i = 0 the step is ε itself. Steps h_i may also be given.
#[derive(Clone, Debug)]
pub struct Differences<A> {
    analysis: A,
    step: Step,
    central: bool,
}

#[derive(Clone, Debug)]
enum Step {
    Relative(f64),
    Absolute(Vec<f64>),
}

impl Step {
    fn of(&self, b: &[f64], i: usize) -> f64 {
        match self {
            Self::Relative(step) if b[i] == 0.0 => *step,
            Self::Relative(step) => step * b[i].abs(),
            Self::Absolute(steps) => steps[i],
        }
    }
}

impl<A: Analysis> Differences<A> {
    /// Forward differences with the relative step ε.
    ///
    /// **Errors.** [`Error::Option`] unless ε is positive and finite.
    pub fn forward(analysis: A, relative_step: f64) -> Result<Self> {
        let good = relative_step > 0.0 && relative_step.is_finite();
        Error::check_option("relative step of differences", "positive and finite", relative_step, good)?;
        Ok(Self { analysis, step: Step::Relative(relative_step), central: false })
    }

    /// Forward differences with the steps h, one for each design variable and in its unit.
    ///
    /// **Errors.** [`Error::Option`] unless every step is positive and finite.
    pub fn forward_by(analysis: A, steps: Vec<f64>) -> Result<Self> {
        for &step in &steps {
            Error::check_option("step of differences", "positive and finite", step, step > 0.0 && step.is_finite())?;
        }
        Ok(Self { analysis, step: Step::Absolute(steps), central: false })
    }

    /// Central differences with the relative step ε.
    ///
    /// **Errors.** [`Error::Option`] unless ε is positive and finite.
    pub fn central(analysis: A, relative_step: f64) -> Result<Self> {
        Ok(Self { central: true, ..Self::forward(analysis, relative_step)? })
    }

    fn column(&self, b: &[f64], here: &Responses, i: usize, wanted: &[Instant]) -> Result<Vec<f64>> {
        let step = self.step.of(b, i);
        let moved = |by: f64| {
            let mut b = b.to_vec();
            b[i] += by;
            self.analysis.analyze(&b)
        };
        let ahead = moved(step)?;
        let behind = if self.central { Some(moved(-step)?) } else { None };
        let (from, width) = behind.as_ref().map_or((here, step), |behind| (behind, 2.0 * step));
        Ok(wanted.iter().map(|&w| (ahead.at(w) - from.at(w)) / width).collect())
    }
}

impl<A: Analysis> Analysis for Differences<A> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        self.analysis.analyze(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        if let Step::Absolute(steps) = &self.step {
            Error::check_length("steps of differences", b.len(), steps.len())?;
        }
        let columns: Vec<Vec<f64>> =
            (0..b.len()).into_par_iter().map(|i| self.column(b, responses, i, wanted)).collect::<Result<_>>()?;
        Ok(DMatrix::from_fn(wanted.len(), b.len(), |row, i| columns[i][row]))
    }

    fn differentiation(&self, _variables: usize, _wanted: &[Instant]) -> Option<&'static str> {
        Some(if self.central { "central differences" } else { "forward differences" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::{Analytic, ClosedForm, TimeGrid};
    use crate::scalar::Scalar;

    struct Cubic;
    impl ClosedForm for Cubic {
        fn response<S: Scalar>(&self, _: usize, b: &[S], t: S) -> S {
            b[0].powi(3) * t + b[1]
        }
    }

    #[test]
    fn forward_is_of_first_and_central_of_second_order() {
        let grid = TimeGrid::uniform(1.0, 2.0, 2).unwrap();
        let analysis = || Analytic::new(Cubic, &[Some(&grid)]);
        let (b, wanted) = ([2.0, 0.0], [Instant { response: 0, point: 1 }]);
        let slope = |d: &dyn Analysis| {
            let rows = d.sensitivities(&b, &d.analyze(&b).unwrap(), &wanted).unwrap();
            assert!((rows[(0, 1)] - 1.0).abs() < 1e-10);
            rows[(0, 0)]
        };
        // 2 (3b² + 3bh + h²) and 2 (3b² + h²), h = 0.02.
        assert!((slope(&Differences::forward(analysis(), 0.01).unwrap()) - (24.0 + 0.24 + 0.0008)).abs() < 1e-10);
        assert!((slope(&Differences::central(analysis(), 0.01).unwrap()) - (24.0 + 0.0008)).abs() < 1e-10);
        assert!(
            (slope(&Differences::forward_by(analysis(), vec![0.02, 0.3]).unwrap()) - (24.0 + 0.24 + 0.0008)).abs()
                < 1e-10
        );
        assert!(Differences::forward(analysis(), 0.0).is_err());
        assert!(Differences::forward_by(analysis(), vec![0.1, -0.1]).is_err());
        let short = Differences::forward_by(analysis(), vec![0.1]).unwrap();
        assert!(short.sensitivities(&b, &short.analyze(&b).unwrap(), &wanted).is_err());
    }
}
