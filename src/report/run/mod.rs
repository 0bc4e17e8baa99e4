//! An optimization as a page: what was sought, what was found, how, and how far to trust it.
//!
//! | file | section |
//! |---|---|
//! | `overview` | the head of the page; design variables, objective, constraints |
//! | `convergence` | objective, errors, violation, design variables and move limits over the cycles |
//! | `histories` | responses and constraints over time with their bounds, kept and active points |
//! | `watched` | what is constrained, in its own unit, from normalised constraints |
//! | `truth` | what approximate problems promised beside what analyses found |
//! | `plane`, `line` | a slice of the design space with the path of the designs |
//! | `optimality` | residuals of the optimality conditions, multipliers |

mod convergence;
mod histories;
mod line;
mod optimality;
mod overview;
mod plane;
mod truth;
mod watched;

pub use plane::Slice;

use super::page::{Page, Section};
use crate::Result;
use crate::problem::{Evaluation, Problem, Responses};
use crate::sao::{Cycle, State};

/// A run at any stage, for reading.
///
/// ```
/// use linkwright::{cases::impact_absorber, report::run::{OptimizationReport, Slice}, sao::Method};
///
/// let problem = impact_absorber::peak_acceleration()?;
/// let state = Method::default().solve(&problem, |_| ())?;
/// let run = OptimizationReport::new("Impact absorber", &problem, &state)?;
/// let slice = Slice::sample(&problem, &state, 5)?;
/// let page = run.page(slice.as_ref(), vec![])?;
/// assert!(page.html()?.contains("Approximation against truth"));
/// # Ok::<(), linkwright::Error>(())
/// ```
pub struct OptimizationReport<'a> {
    title: &'a str,
    problem: &'a Problem,
    state: &'a State,
    /// Responses and evaluation of the first design.
    first: (Responses, Evaluation),
}

impl<'a> OptimizationReport<'a> {
    /// A run; its first design is analysed once more.
    ///
    /// **Errors.** As [`Problem::analyze`].
    pub fn new(title: &'a str, problem: &'a Problem, state: &'a State) -> Result<Self> {
        let design = state.history.first().map_or(&state.design, |cycle| &cycle.design);
        let responses = problem.analyze(design)?;
        let evaluation = problem.evaluate(design, &responses)?;
        Ok(Self { title, problem, state, first: (responses, evaluation) })
    }

    /// The page; `more` is put behind the tables of the design, such as an animation of the mechanism.
    ///
    /// **Errors.** As the figures, where a number is not finite.
    pub fn page(&self, slice: Option<&Slice>, more: Vec<Section>) -> Result<Page> {
        let mut sections = vec![self.design()?];
        sections.extend(more);
        sections.extend([self.constraints()?, self.convergence()?, self.histories()?, self.truth()?]);
        sections.push(self.plane(slice)?);
        sections.push(self.optimality()?);
        let page = self.head();
        Ok(sections.into_iter().filter(|section| !section.is_empty()).fold(page, Page::with))
    }

    /// The first design.
    fn start(&self) -> &[f64] {
        self.state.history.first().map_or(&self.state.design, |cycle| &cycle.design)
    }

    /// The last accepted cycle after the start.
    fn last(&self) -> Option<&Cycle> {
        self.state.history.iter().rev().find(|c| c.accepted && c.cycle > 0)
    }

    /// Tries whose analysis succeeded, the start first.
    fn tries(&self) -> impl Iterator<Item = &Cycle> {
        self.state.history.iter().filter(|c| c.failure.is_none())
    }
}

/// What became of a try.
fn verdict(cycle: &Cycle) -> &'static str {
    match (&cycle.failure, cycle.accepted) {
        (Some(_), _) => "analysis failed",
        (None, false) => "rejected",
        (None, true) if cycle.cycle == 0 => "start",
        (None, true) => "accepted",
    }
}

/// A number for sentences: at most five significant digits.
fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.abs().to_string();
    }
    if (1e-3..1e5).contains(&value.abs()) {
        let decimals = (4 - value.abs().log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.decimals$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        return text.replace('-', "\u{2212}");
    }
    format!("{value:.3e}").replace('-', "\u{2212}")
}

/// A change in percent; none from zero.
fn change(from: f64, to: f64) -> Option<f64> {
    (from != 0.0).then(|| 100.0 * (to - from) / from.abs())
}

/// A part of a file name: letters and digits of a name.
fn stem(name: &str) -> String {
    let kept: String = name.chars().take(40).map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    kept.trim_matches('-').to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_names_safe() {
        let cases =
            [(0.52028604, "0.52029"), (-12.5, "\u{2212}12.5"), (1e-7, "1.000e\u{2212}7"), (0.0, "0"), (120.0, "120")];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!((stem("../a b<script>"), stem("k")), ("a-b-script".to_owned(), "k".to_owned()));
        assert_eq!((change(2.0, 1.0), change(-2.0, -1.0), change(0.0, 1.0)), (Some(-50.0), Some(50.0), None));
    }
}
