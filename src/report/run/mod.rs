//! Report of an optimization as a page.
//!
//! | file | section |
//! |---|---|
//! | `overview` | the page and its head; design variables, objective, constraints |
//! | `convergence` | objective, errors, violation, design variables and move limits over the cycles |
//! | `histories` | responses and constraints over time with their bounds, retained and active points |
//! | `constrained_histories` | constrained quantities in their own units, from normalized constraints |
//! | `chosen_cycle` | numbers and curves of the cycle that a reader chooses |
//! | `prediction_accuracy` | predicted and computed values of each cycle |
//! | `design_space_slice` | a slice of the design space with the path of the designs |
//! | `optimality` | residuals of the optimality conditions, multipliers |

mod chosen_cycle;
mod constrained_histories;
mod convergence;
mod design_space_slice;
mod histories;
mod optimality;
mod overview;
mod prediction_accuracy;

pub use convergence::step_cells;
pub use design_space_slice::Slice;

use super::number::{DIGITS, readable};
use super::outcome;
use super::table::Cell;
use crate::Result;
use crate::problem::{Evaluation, Problem, Responses};
use crate::sao::{Cycle, RunState};
use rayon::prelude::*;

/// Report of an optimization, finished or not.
///
/// ```
/// use linkwright::{cases::impact_absorber, report::run::{OptimizationReport, Slice}, sao::Method};
///
/// let problem = impact_absorber::peak_acceleration()?;
/// let state = Method::slp().solve(&problem, |_| ())?;
/// let run = OptimizationReport::new("Impact absorber", &problem, &state)?;
/// let slice = Slice::sample(&problem, &state, 5)?;
/// let page = run.page(slice.as_ref(), vec![])?;
/// assert!(page.html()?.contains("Predicted and computed responses"));
/// # Ok::<(), linkwright::Error>(())
/// ```
pub struct OptimizationReport<'a> {
    title: &'a str,
    problem: &'a Problem,
    state: &'a RunState,
    /// Responses and evaluation of the first design.
    first: (Responses, Evaluation),
    /// The objective of each trial step.
    objectives: Vec<f64>,
    /// Analysed designs of cycles that the page can show.
    cycles: Vec<ShownCycle<'a>>,
}

/// The analysed design of a cycle.
struct ShownCycle<'a> {
    step: &'a Cycle,
    objective: f64,
    responses: Responses,
    evaluation: Evaluation,
}

impl<'a> OptimizationReport<'a> {
    /// The report of a state. Analyses the first design once more.
    ///
    /// # Errors
    /// Those of [`Problem::analyze`].
    pub fn new(title: &'a str, problem: &'a Problem, state: &'a RunState) -> Result<Self> {
        let design = state.history.first().map_or(&state.design, |cycle| &cycle.design);
        let responses = problem.analyze(design)?;
        let evaluation = problem.evaluate(design, &responses)?;
        let objectives = outcome::objectives(problem, state)?;
        Ok(Self { title, problem, state, first: (responses, evaluation), objectives, cycles: vec![] })
    }

    /// Analyses the designs of at most `most` accepted cycles, equally spaced and with both ends, so that the page can show them: their
    /// histories, numbers and, by [`Animation::with_cycle`](crate::report::animation::Animation::with_cycle), motions. A design whose analysis
    /// fails is left out.
    pub fn with_cycles(mut self, most: usize) -> Self {
        let accepted: Vec<usize> = (0..self.state.history.len()).filter(|&k| self.state.history[k].accepted).collect();
        let count = accepted.len().min(most);
        let chosen = (0..count).map(|k| accepted[if count < 2 { 0 } else { k * (accepted.len() - 1) / (count - 1) }]);
        let analysed = chosen.collect::<Vec<_>>().into_par_iter().filter_map(|k| {
            let step = &self.state.history[k];
            let responses = self.problem.analyze(&step.design).ok()?;
            let evaluation = self.problem.evaluate(&step.design, &responses).ok()?;
            Some(ShownCycle { step, objective: self.objectives[k], responses, evaluation })
        });
        self.cycles = analysed.collect();
        self
    }

    /// Numbers and designs of the cycles that the page can show.
    pub fn shown_cycles(&self) -> impl Iterator<Item = (usize, &[f64])> {
        self.cycles.iter().map(|shown| (shown.step.cycle, &shown.step.design[..]))
    }

    /// The first design.
    fn start(&self) -> &[f64] {
        self.state.history.first().map_or(&self.state.design, |cycle| &cycle.design)
    }

    /// The last accepted cycle after the start.
    fn last(&self) -> Option<&Cycle> {
        self.state.history.iter().rev().find(|c| c.accepted && c.cycle > 0)
    }

    /// The trial steps that the page shows, with their objectives: all of them, or every n-th of many, and the last.
    fn shown_steps(&self) -> impl Iterator<Item = (&Cycle, f64)> {
        let (every, last) = (self.every(), self.state.history.len().saturating_sub(1));
        let all = self.state.history.iter().zip(self.objectives.iter().copied()).enumerate();
        all.filter(move |(k, _)| k % every == 0 || *k == last).map(|(_, step)| step)
    }

    /// The page shows every n-th trial step; this is n, 1 for all. A page of thousands of steps would have many megabytes.
    fn every(&self) -> usize {
        let most = MARKS / (FIGURES + self.problem.n().min(MOST));
        self.state.history.len().div_ceil(most).max(1)
    }

    /// Shown trial steps with a successful analysis and their objectives, the start first.
    fn successful_steps(&self) -> impl Iterator<Item = (&Cycle, f64)> {
        self.shown_steps().filter(|(c, _)| c.failure.is_none())
    }
}

/// Largest number of design variables with a plot.
const MOST: usize = 12;
/// Figures over the cycles besides those of design variables.
const FIGURES: usize = 5;
/// Largest number of trial steps in all figures over the cycles together.
const MARKS: usize = 2000;

/// The outcome of a trial step.
fn verdict(cycle: &Cycle) -> &'static str {
    match (&cycle.failure, cycle.accepted) {
        (Some(_), _) => "analysis failed",
        (None, false) => "rejected",
        (None, true) if cycle.cycle == 0 => "start",
        (None, true) => "accepted",
    }
}

/// A number in at most five significant digits.
fn number(value: f64) -> String {
    readable(value, DIGITS).replace('-', "\u{2212}")
}

/// Size of a first value relative to the last one below which a change in percent says nothing: it may be a rounding error of zero.
const ABOUT_ZERO: f64 = 1e-9;

/// A change in percent; `None` from zero, or from about zero.
fn change(from: f64, to: f64) -> Option<f64> {
    match from == to {
        true => Some(0.0),
        false => (from.abs() > ABOUT_ZERO * to.abs()).then(|| 100.0 * (to - from) / from.abs()),
    }
}

/// A change in percent as a cell of a table.
fn change_cell(from: f64, to: f64) -> Cell {
    change(from, to).map_or_else(|| "– (from zero)".into(), Cell::from)
}

/// The letters and digits of a name, for a file name.
fn stem(name: &str) -> String {
    let safe: String = name.chars().take(40).map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    safe.trim_matches('-').to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_names_safe() {
        let cases =
            [(0.52028604, "0.52029"), (-12.5, "\u{2212}12.5"), (1e-7, "1e\u{2212}7"), (0.0, "0"), (120.0, "120")];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!((stem("../a b<script>"), stem("k")), ("a-b-script".to_owned(), "k".to_owned()));
        assert_eq!((change(2.0, 1.0), change(-2.0, -1.0), change(0.0, 0.0)), (Some(-50.0), Some(50.0), Some(0.0)));
    }

    #[test]
    fn a_change_from_zero_has_no_percentage() {
        for from in [0.0, 1e-17] {
            assert_eq!(change(from, 1.0), None);
            assert!(matches!(change_cell(from, 1.0), Cell::Text(reason) if reason.contains("from zero")));
        }
    }
}
