//! Several ways of differentiating one analysis.

use super::{Analysis, ContinuousTime, Instant, Responses};
use crate::error::{Error, Result};
use nalgebra::DMatrix;

/// One way of differentiating an analysis.
pub struct Alternative<'a> {
    /// Its name, for tables.
    pub name: &'static str,
    /// The analysis with these sensitivities.
    pub analysis: Box<dyn Analysis + 'a>,
    /// The same with another step, if the sensitivities are approximate: they are off by about as much as both differ.
    pub coarser: Option<Box<dyn Analysis + 'a>>,
}

impl<'a> Alternative<'a> {
    /// A method that is exact but for rounding.
    pub fn exact(name: &'static str, analysis: Box<dyn Analysis + 'a>) -> Self {
        Self { name, analysis, coarser: None }
    }

    /// A method whose error shows in how it differs from `coarser`, the same with a longer step.
    pub fn approximate(name: &'static str, analysis: Box<dyn Analysis + 'a>, coarser: Box<dyn Analysis + 'a>) -> Self {
        Self { name, analysis, coarser: Some(coarser) }
    }
}

/// An analysis with the sensitivities of one of its [`Analysis::alternatives`].
pub struct Differentiated<A> {
    analysis: A,
    method: String,
}

impl<A: Analysis> Differentiated<A> {
    /// With the method of this name.
    ///
    /// **Errors.** [`Error::Definition`] unless the analysis has it; the message has those that it has.
    pub fn by(analysis: A, method: &str) -> Result<Self> {
        let found = Self { analysis, method: method.to_owned() };
        found.chosen().map(|_| ())?;
        Ok(found)
    }

    fn chosen(&self) -> Result<Box<dyn Analysis + '_>> {
        let all = self.analysis.alternatives();
        let names: Vec<&str> = all.iter().map(|alternative| alternative.name).collect();
        let (why, remedy) = match names.is_empty() {
            true => ("this analysis is differentiated in one way only".to_owned(), "leave the choice out".to_owned()),
            false => {
                (format!("this analysis has no `{}` derivatives", self.method), format!("take {}", names.join(" or ")))
            }
        };
        let chosen = all.into_iter().find(|alternative| alternative.name == self.method);
        chosen.map(|alternative| alternative.analysis).ok_or_else(|| Error::definition("derivatives", why, remedy))
    }
}

impl<A: Analysis> Analysis for Differentiated<A> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        self.analysis.analyze(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        self.chosen()?.sensitivities(b, responses, wanted)
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[Instant]) -> Result<Option<Vec<DMatrix<f64>>>> {
        self.analysis.curvatures(b, responses, wanted)
    }

    fn alternatives(&self) -> Vec<Alternative<'_>> {
        self.analysis.alternatives()
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        self.analysis.continuous()
    }
}
