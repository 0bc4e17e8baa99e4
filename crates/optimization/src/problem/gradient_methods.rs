//! Methods of differentiating an analysis.

use super::{Analysis, ContinuousTime, ResponseAt, Responses};
use error::{Error, Result};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// ∂r/∂b from a step, a design, its responses and the wanted ones, as [`Analysis::sensitivities`].
type Differentiate<'a> = Box<dyn Fn(f64, &[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a>;

/// A method of differentiating an analysis.
pub struct GradientMethod<'a> {
    /// Name, for tables and model files.
    pub name: &'static str,
    /// Relative step of differences; `None` for an exact method.
    pub step: Option<f64>,
    differentiate: Differentiate<'a>,
}

impl<'a> GradientMethod<'a> {
    /// A method that is exact up to rounding.
    pub fn exact(
        name: &'static str,
        differentiate: impl Fn(&[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a,
    ) -> Self {
        let differentiate = move |_: f64, b: &[f64], r: &Responses, wanted: &[ResponseAt]| differentiate(b, r, wanted);
        Self { name, step: None, differentiate: Box::new(differentiate) }
    }

    /// A finite-difference method with a relative step, `step` by default.
    pub fn approximate(
        name: &'static str,
        step: f64,
        differentiate: impl Fn(f64, &[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a,
    ) -> Self {
        Self { name, step: Some(step), differentiate: Box::new(differentiate) }
    }

    /// The sensitivities of an analysis itself.
    pub fn of(name: &'static str, analysis: &'a dyn Analysis) -> Self {
        Self::exact(name, move |b, responses, wanted| analysis.sensitivities(b, responses, wanted))
    }

    /// Replaces the step, if the method has one.
    pub fn with_step(self, step: f64) -> Self {
        Self { step: self.step.map(|_| step), ..self }
    }

    /// ∂r/∂b of the wanted responses at the design `b`, one row for each; `responses` are those of the analysis at `b`.
    pub fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        (self.differentiate)(self.step.unwrap_or_default(), b, responses, wanted)
    }

    /// Estimated errors of these sensitivities: zero for an exact method.
    ///
    /// For a method with a step it is the largest change by a step four times as long, over all wanted time points of a
    /// response and all design variables by their size. One change alone may be small by chance.
    pub fn uncertainty(
        &self,
        found: &DMatrix<f64>,
        b: &[f64],
        responses: &Responses,
        wanted: &[ResponseAt],
    ) -> Result<DMatrix<f64>> {
        let Some(step) = self.step else { return Ok(DMatrix::zeros(found.nrows(), found.ncols())) };
        let change = (self.differentiate)(4.0 * step, b, responses, wanted)? - found;
        let size = |i: usize| if b[i] == 0.0 { 1.0 } else { b[i].abs() };
        let of_row = |row: usize| (0..b.len()).map(|i| change[(row, i)].abs() * size(i)).fold(0.0, f64::max);
        let mut worst = BTreeMap::new();
        for (row, at) in wanted.iter().enumerate() {
            let worst = worst.entry(at.response).or_insert(0.0f64);
            *worst = worst.max(of_row(row));
        }
        Ok(DMatrix::from_fn(wanted.len(), b.len(), |row, i| worst[&wanted[row].response] / size(i)))
    }
}

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

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        self.chosen()?.sensitivities(b, responses, wanted)
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

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}
