//! An analysis that is differentiated by one of its methods.

use super::{Analysis, ContinuousTime, GradientMethod, ResponseAt, ResponseSum, Responses};
use error::{Error, Result};
use nalgebra::DMatrix;

/// An analysis with the sensitivities by one of its [`Analysis::gradient_methods`].
pub struct Differentiated<A> {
    analysis: A,
    method: String,
    step: Option<f64>,
}

impl<A: Analysis> Differentiated<A> {
    /// Selects the method of this name, and the relative step of its differences (by default its own).
    ///
    /// # Errors
    ///
    /// [`Error::Unsupported`] unless the analysis offers the method, with the names of those that it offers;
    /// [`Error::Option`] for a step that is not between 0 and 1.
    pub fn by(analysis: A, method: &str, step: Option<f64>) -> Result<Self> {
        if let Some(step) = step {
            Error::check_option("relative step of differences", "between 0 and 1", step, step > 0.0 && step < 1.0)?;
        }
        let found = Self { analysis, method: method.to_owned(), step };
        found.chosen().map(|_| ())?;
        Ok(found)
    }

    fn chosen(&self) -> Result<GradientMethod<'_>> {
        let all = self.analysis.gradient_methods();
        let names: Vec<&str> = all.iter().map(|method| method.name).collect();
        let (why, remedy) = match names.is_empty() {
            true => ("this analysis is differentiated in one way only".to_owned(), "omit the choice".to_owned()),
            false => {
                (format!("this analysis has no `{}` derivatives", self.method), format!("use {}", names.join(" or ")))
            }
        };
        let chosen = all.into_iter().find(|method| method.name == self.method);
        let chosen = chosen.ok_or_else(|| Error::unsupported("derivatives", why, remedy))?;
        Ok(match self.step {
            Some(step) => chosen.with_step(step),
            None => chosen,
        })
    }
}

impl<A: Analysis> Analysis for Differentiated<A> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        self.analysis.analyze(b)
    }

    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.analysis.analyze_many(designs)
    }

    fn analyze_around(&self, b: &[f64], designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.analysis.analyze_around(b, designs)
    }

    fn step_tolerance(&self, b: &[f64]) -> f64 {
        self.analysis.step_tolerance(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.chosen()?.sensitivities(b, responses, wanted)
    }

    fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
        self.chosen()?.sum_sensitivities(b, responses, sums)
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        self.analysis.curvatures(b, responses, wanted)
    }

    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        self.analysis.gradient_methods()
    }

    fn differentiation(&self, _variables: usize, _wanted: &[ResponseAt]) -> Option<&'static str> {
        self.chosen().ok().map(|method| method.name)
    }

    fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
        self.analysis.warnings(b, responses)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}
