//! Several ways of differentiating one analysis.

use super::{Analysis, ContinuousTime, ResponseAt, Responses};
use error::{Error, Result};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// ∂r/∂b of the wanted instants by a step at a design, as [`Analysis::sensitivities`].
type Differentiate<'a> = Box<dyn Fn(f64, &[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a>;

/// One way of differentiating an analysis.
pub struct GradientMethod<'a> {
    /// Its name, for tables and model files.
    pub name: &'static str,
    /// The relative step of differences that it takes, if it does.
    pub step: Option<f64>,
    differentiate: Differentiate<'a>,
}

impl<'a> GradientMethod<'a> {
    /// A method that is exact but for rounding.
    pub fn exact(
        name: &'static str,
        differentiate: impl Fn(&[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a,
    ) -> Self {
        let differentiate = move |_: f64, b: &[f64], r: &Responses, wanted: &[ResponseAt]| differentiate(b, r, wanted);
        Self { name, step: None, differentiate: Box::new(differentiate) }
    }

    /// A method that takes a relative step of differences, `step` unless told otherwise.
    pub fn approximate(
        name: &'static str,
        step: f64,
        differentiate: impl Fn(f64, &[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a,
    ) -> Self {
        Self { name, step: Some(step), differentiate: Box::new(differentiate) }
    }

    /// The sensitivities that an analysis gives by itself.
    pub fn of(name: &'static str, analysis: &'a dyn Analysis) -> Self {
        Self::exact(name, move |b, responses, wanted| analysis.sensitivities(b, responses, wanted))
    }

    /// With this step, if it takes one.
    pub fn with_step(self, step: f64) -> Self {
        Self { step: self.step.map(|_| step), ..self }
    }

    /// ∂r/∂b of the wanted instants at the design `b`; `responses` is what the analysis gave there.
    pub fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        (self.differentiate)(self.step.unwrap_or_default(), b, responses, wanted)
    }

    /// How far these sensitivities may be off: nothing for an exact method; for one that takes a step what four times that
    /// changes at the worst, over all wanted instants of a response and all design variables by their size. One change alone may
    /// be small by chance.
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
        for (row, instant) in wanted.iter().enumerate() {
            let worst = worst.entry(instant.response).or_insert(0.0f64);
            *worst = worst.max(of_row(row));
        }
        Ok(DMatrix::from_fn(wanted.len(), b.len(), |row, i| worst[&wanted[row].response] / size(i)))
    }
}

/// An analysis with the sensitivities of one of its [`Analysis::alternatives`].
pub struct Differentiated<A> {
    analysis: A,
    method: String,
    step: Option<f64>,
}

impl<A: Analysis> Differentiated<A> {
    /// With the method of this name, and the relative step of its differences if it takes any (its own if none is given).
    ///
    /// **Errors.** [`Error::Definition`] unless the analysis has it, which tells those that it has; [`Error::Option`] for a
    /// step that is not between 0 and 1.
    pub fn by(analysis: A, method: &str, step: Option<f64>) -> Result<Self> {
        if let Some(step) = step {
            Error::check_option("relative step of differences", "between 0 and 1", step, step > 0.0 && step < 1.0)?;
        }
        let found = Self { analysis, method: method.to_owned(), step };
        found.chosen().map(|_| ())?;
        Ok(found)
    }

    fn chosen(&self) -> Result<GradientMethod<'_>> {
        let all = self.analysis.alternatives();
        let names: Vec<&str> = all.iter().map(|alternative| alternative.name).collect();
        let (why, remedy) = match names.is_empty() {
            true => ("this analysis is differentiated in one way only".to_owned(), "leave the choice out".to_owned()),
            false => {
                (format!("this analysis has no `{}` derivatives", self.method), format!("take {}", names.join(" or ")))
            }
        };
        let chosen = all.into_iter().find(|alternative| alternative.name == self.method);
        let chosen = chosen.ok_or_else(|| Error::definition("derivatives", why, remedy))?;
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

    fn alternatives(&self) -> Vec<GradientMethod<'_>> {
        self.analysis.alternatives()
    }

    fn differentiation(&self, _variables: usize, _wanted: &[ResponseAt]) -> Option<&'static str> {
        self.chosen().ok().map(|method| method.name)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}
