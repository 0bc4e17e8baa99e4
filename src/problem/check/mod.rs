//! Proving sensitivities: every derivative by every method, against differences that know their own error.
//!
//! | file | what |
//! |---|---|
//! | `finding` | what is found out about a derivative |
//! | `ridders` | differences with an error estimate, and kinks |
//! | `surroundings` | the analyses that they are made of |

mod finding;
mod ridders;
mod surroundings;

pub use finding::{Checked, GradientCheck, GradientStatus};
pub use ridders::Slope;

use super::{Analysis, GradientMethod, Problem, ResponseAt};
use error::{Error, Result};
use finding::judge;
use ridders::jump;
pub(super) use ridders::ridders;
pub(super) use surroundings::Surroundings;

impl Problem {
    /// Checks the sensitivities of the problem's analysis by all its methods at the design `b` against differences: of every response at up to
    /// `points` of its time points, spread evenly.
    ///
    /// **Errors.** As [`check`].
    pub fn check_sensitivities(&self, b: &[f64], points: usize) -> Result<GradientCheck> {
        self.check_responses(b, points, &(0..self.responses.len()).collect::<Vec<_>>())
    }

    /// The same for some responses only, by number.
    ///
    /// **Errors.** As [`check`], and [`Error::Definition`] for a response that is not there.
    pub fn check_responses(&self, b: &[f64], points: usize, responses: &[usize]) -> Result<GradientCheck> {
        Error::check_length("design", self.n(), b.len())?;
        Error::check_option("time points to check", "at least 1", points as f64, points > 0)?;
        if let Some(number) = responses.iter().find(|&&number| number >= self.responses.len()) {
            let why = format!("there is no response {number} among {}", self.responses.len());
            return Err(Error::definition("check", why, "use the index that adding the response returned"));
        }
        let wanted = responses.iter().flat_map(|&response| {
            let count = self.responses[response].grid.map_or(1, |grid| self.grids[grid].len());
            let taken = points.min(count);
            // At the ends a response is often given; the middles of equal parts are more telling.
            (0..taken).map(move |k| ResponseAt { response, point: (2 * k + 1) * count / (2 * taken) })
        });
        let analysis = self.analysis.as_ref();
        check(analysis, &methods(analysis), b, &self.sizes(b), &wanted.collect::<Vec<_>>())
    }

    /// Sizes of the design variables at `b`, from which differences start: their values, but no more than the range between
    /// their bounds and no less than a thousandth of it.
    fn sizes(&self, b: &[f64]) -> Vec<f64> {
        let size =
            |(range, value): (f64, &f64)| if *value == 0.0 { range } else { value.abs().clamp(1e-3 * range, range) };
        self.scales().into_iter().zip(b).map(size).collect()
    }
}

/// All ways in which an analysis can be differentiated, at least its own.
pub fn methods(analysis: &dyn Analysis) -> Vec<GradientMethod<'_>> {
    let mut all = analysis.alternatives();
    if all.is_empty() {
        all.push(GradientMethod::of("analysis", analysis));
    }
    all
}

/// Checks the sensitivities that several methods give at the design `b` against differences of `analysis`, and against each
/// other.
///
/// `methods` are those of the analysis ([`methods`]) or any others of the same responses, its own first; `scales` are the sizes of the design
/// variables in their units. For each variable 22 analyses are made, in parallel.
///
/// A method that refuses the mechanism ([`Error::Definition`]) is left out, as the adjoint where there are impacts.
///
/// **Errors.** Those of the analysis at `b`, and of the methods; a design beside `b` that cannot be analysed only
/// costs accuracy.
pub fn check(
    analysis: &dyn Analysis,
    methods: &[GradientMethod<'_>],
    b: &[f64],
    scales: &[f64],
    wanted: &[ResponseAt],
) -> Result<GradientCheck> {
    Error::check_length("sizes of the design variables", b.len(), scales.len())?;
    let (here, again) = (analysis.analyze(b)?, analysis.analyze(b)?);
    let (mut claims, mut names) = (Vec::with_capacity(methods.len()), Vec::with_capacity(methods.len()));
    for method in methods {
        let found = match method.sensitivities(b, &here, wanted) {
            // A method that is not there for what the design makes is no witness.
            Err(Error::Definition { .. } | Error::Unsupported { .. }) if !claims.is_empty() => continue,
            found => found?,
        };
        names.push(method.name.to_owned());
        let uncertainty = method.uncertainty(&found, b, &here, wanted)?;
        claims.push([found, uncertainty]);
    }
    let around = Surroundings::along_all(analysis, b, scales);
    let mut derivatives = Vec::with_capacity(wanted.len() * b.len());
    for (row, &instant) in wanted.iter().enumerate() {
        let (first, value) = (derivatives.len(), here.at(instant));
        let drift = (value - again.at(instant)).abs();
        for (variable, around) in around.iter().enumerate() {
            let steps = around.steps(instant);
            let difference = ridders(value, &steps);
            let read = |which: usize| claims.iter().map(|claim| claim[which][(row, variable)]).collect();
            derivatives.push(Checked {
                instant,
                variable,
                claimed: read(0),
                uncertainty: read(1),
                difference,
                jump: jump(value, &steps, difference.map_or(0.0, |d| d.noise)),
                drift,
                is_constant: !steps.is_empty() && steps.iter().all(|s| s.ahead == s.behind && s.ahead == value),
                finding: GradientStatus::Right,
                suspects: vec![],
            });
        }
        judge(&mut derivatives[first..], scales);
    }
    Ok(GradientCheck { methods: names, derivatives })
}
