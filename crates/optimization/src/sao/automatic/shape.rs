//! Check of the method's data from a file.

use super::numbers::collect_numbers;
use super::{AcceptedPoint, AutomaticState};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, Problem};
use error::{Error, Result};

impl AutomaticState {
    /// Rejects data whose parts do not have the shape of the problem, or that belong to another design than `here`.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] or [`Error::Definition`] with the name of the part.
    pub(in crate::sao) fn check(&self, problem: &Problem, here: &AnalyzedDesign, data: &CycleData) -> Result<()> {
        let (n, m) = (problem.n(), problem.constraints.len());
        length("start lengths", n, self.start_lengths.len())?;
        require(self.guessed.is_empty() || self.guessed.len() == n, "it is not known which lengths are guesses")?;
        length("widths", n, self.widths.len())?;
        let positive = |v: &[f64]| v.iter().all(|v| *v > 0.0 && v.is_finite());
        require(positive(&self.start_lengths) && positive(&self.widths), "a length is not positive")?;
        require(self.tolerance >= 0.0 && self.tolerance.is_finite(), "the tolerance is not a positive number or zero")?;
        self.points.iter().try_for_each(|point| point.check(problem))?;
        let last = self.points.last().filter(|point| point.design == here.design);
        let expected = collect_numbers(problem, &here.design, (&here.responses, &here.evaluation), data);
        let same =
            |numbers: &[super::ApproximatedValue]| numbers.iter().map(|a| a.id).eq(expected.iter().map(|b| b.id));
        require(last.is_some_and(|point| same(&point.numbers)), "the last stored design is not that of the state")?;
        self.filter.iter().try_for_each(|entry| length("violations", m, entry.violations.len()))?;
        self.displaced_from.iter().try_for_each(|violations| length("violations", m, violations.len()))?;
        for point in &self.rejected {
            length("rejected design", n, point.design.len())?;
            length("rejected values", expected.len(), point.values.len())?;
        }
        require(self.scores.groups.is_sorted_by(|a, b| a.0 < b.0), "the scores are not sorted")
    }
}

impl AcceptedPoint {
    /// Rejects a stored design whose parts do not have the shape of the problem.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] or [`Error::Definition`] with the name of the part.
    pub(in crate::sao) fn check(&self, problem: &Problem) -> Result<()> {
        let (n, m) = (problem.n(), problem.constraints.len());
        length("stored design", n, self.design.len())?;
        length("slopes", m, self.slopes.len())?;
        self.slopes.iter().try_for_each(|slope| length("slope", n, slope.len()))?;
        self.numbers.iter().try_for_each(|number| length("gradient", n, number.gradient.len()))?;
        require(self.numbers.is_sorted_by(|a, b| a.id < b.id), "the numbers of a design are not sorted")
    }
}

fn length(what: &str, expected: usize, found: usize) -> Result<()> {
    Error::check_length(&format!("{what} of the state"), expected, found)
}

fn require(holds: bool, why: &str) -> Result<()> {
    let remedy = "give a file that a run wrote";
    if holds { Ok(()) } else { Err(Error::definition("data of the automatic method", why.to_owned(), remedy)) }
}
