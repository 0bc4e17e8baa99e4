//! Gradient checks: derivatives by every method of an analysis, compared with finite differences that estimate their own error.
//!
//! | file | contents |
//! |---|---|
//! | `status` | results of a check, and the rules that decide them |
//! | `samples` | analyses at designs around the checked one |
//! | `contradictions` | second examination of derivatives that disagree with the differences |

mod contradictions;
mod samples;
mod status;

pub use autodiff::differences::DifferenceEstimate;
pub use status::{CheckedDerivative, GradientCheck, GradientStatus};

use crate::problem::{Analysis, GradientMethod, Problem, ResponseAt, Responses, responses_without_derivatives};
pub(crate) use autodiff::differences::ridders;
use autodiff::differences::slope_discontinuity;
use error::{Error, Result};
use nalgebra::DMatrix;
pub(crate) use samples::{DifferenceSamples, FirstStep};
use status::decide_all;

impl Problem {
    /// Checks the sensitivities of all responses at the design `b`, by all methods of the analysis, against differences.
    ///
    /// Each response is checked at up to `points` of its time points, spread evenly.
    ///
    /// # Errors
    ///
    /// As [`check`].
    ///
    /// # Examples
    ///
    /// ```
    /// let problem = linkwright_optimization::cases::impact_absorber::peak_acceleration()?;
    /// problem.check_sensitivities(&problem.start(), 5)?.expect_right();
    /// # Ok::<(), linkwright_optimization::Error>(())
    /// ```
    pub fn check_sensitivities(&self, b: &[f64], points: usize) -> Result<GradientCheck> {
        self.check_responses(b, points, &(0..self.responses.len()).collect::<Vec<_>>())
    }

    /// Checks the sensitivities of some responses only, by index.
    ///
    /// # Errors
    ///
    /// As [`check`], and [`Error::Definition`] for a response that does not exist.
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
            // At the ends a response is often prescribed: use the middles of equal parts.
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

/// All methods by which an analysis can be differentiated, at least its own.
pub fn methods(analysis: &dyn Analysis) -> Vec<GradientMethod<'_>> {
    let mut all = analysis.gradient_methods();
    if all.is_empty() {
        all.push(GradientMethod::of("analysis", analysis));
    }
    all
}

/// Error of a motion, in tolerances of one step.
const ACCUMULATED: f64 = 100.0;

/// Compares the sensitivities by several methods at the design `b` with differences of `analysis`, and with each other.
///
/// `methods` are those of the analysis ([`methods`]) or any others of the same responses, its own first. `scales` are the
/// sizes of the design variables in their units. For each variable 22 analyses are made, in parallel; a design near `b` that
/// cannot be analysed only costs accuracy. Where derivatives contradict the differences, further designs decide whether the response is
/// smooth only between closer designs, and whether the derivatives are rounding errors. Where designs take different steps,
/// derivatives within the error of the steps count as zero ([`Analysis::step_tolerance`]).
///
/// A method that returns [`Error::Unsupported`] is omitted, such as the semi-analytical method where there are switches. One that fails
/// otherwise is listed in [`GradientCheck::failed`]. If no method differentiates all responses, those that have no derivatives are listed in
/// [`GradientCheck::without_derivatives`], and the others are checked.
///
/// # Errors
///
/// Those of the analysis at `b`; that of the first method if none succeeds; [`Error::Length`] unless there is a size for each variable.
pub fn check(
    analysis: &dyn Analysis,
    methods: &[GradientMethod<'_>],
    b: &[f64],
    scales: &[f64],
    wanted: &[ResponseAt],
) -> Result<GradientCheck> {
    Error::check_length("sizes of the design variables", b.len(), scales.len())?;
    let (here, again) = (analysis.analyze(b)?, analysis.analyze(b)?);
    let (mut failed, mut without_derivatives, mut wanted) = (Vec::new(), Vec::new(), wanted.to_vec());
    let all = match by_methods(methods, b, &here, &wanted, &mut failed) {
        Err(error @ Error::Unsupported { .. }) => {
            let without = responses_without_derivatives(&wanted, |points| methods[0].sensitivities(b, &here, points));
            without_derivatives = without.into_iter().map(|(response, why)| (response, why.to_string())).collect();
            wanted.retain(|at| without_derivatives.iter().all(|(response, _)| *response != at.response));
            if without_derivatives.is_empty() || wanted.is_empty() {
                return Err(error);
            }
            failed.clear();
            by_methods(methods, b, &here, &wanted, &mut failed)
        }
        all => all,
    };
    let (names, derivatives): (Vec<_>, Vec<_>) = all?.into_iter().unzip();
    let first: Vec<FirstStep> = scales.iter().map(|size| FirstStep::of_size(*size)).collect();
    let samples = DifferenceSamples::along_all(|designs| analysis.analyze_around(b, designs), b, &first);
    // Given steps have other rounding errors than chosen ones.
    let centre = analysis.analyze_around(b, &[b.to_vec()]).pop().and_then(Result::ok);
    let centre = centre.as_ref().unwrap_or(&here);
    // Largest contribution of the error of adaptive steps to the change of a response over the size of a variable.
    let by_steps: Vec<f64> = {
        let tolerance = ACCUMULATED * analysis.step_tolerance(b);
        let largest = |series: &Vec<f64>| series.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        here.values.iter().map(|series| tolerance * largest(series)).collect()
    };
    let mut checked = Vec::with_capacity(wanted.len() * b.len());
    for (row, &at) in wanted.iter().enumerate() {
        let value = centre.at(at);
        let drift = (here.at(at) - again.at(at)).abs();
        for (variable, samples) in samples.iter().enumerate() {
            let steps = samples.steps(at, value);
            let difference = ridders(value, &steps);
            let read = |which: usize| derivatives.iter().map(|found| found[which][(row, variable)]).collect();
            checked.push(CheckedDerivative {
                at,
                variable,
                computed: read(0),
                uncertainty: read(1),
                difference,
                slope_discontinuity: slope_discontinuity(value, &steps),
                drift,
                rounding: samples.smallest().map_or(0.0, |h| f64::EPSILON * value.abs() / h)
                    + by_steps[at.response] / scales[variable],
                is_scattered: false,
                is_constant: !steps.is_empty() && steps.iter().all(|s| s.ahead == s.behind && s.ahead == value),
                status: GradientStatus::Right,
                disagreeing: vec![],
                inaccurate: vec![],
            });
        }
    }
    decide_all(&mut checked, scales);
    contradictions::examine(analysis, (methods, &names), (b, centre), (scales, &samples), &mut checked);
    Ok(GradientCheck { methods: names, derivatives: checked, without_derivatives, failed })
}

/// Names of the methods, and derivatives with their estimated errors; methods that do not offer these are omitted, and those that
/// fail are added to `failed`.
fn by_methods(
    methods: &[GradientMethod<'_>],
    b: &[f64],
    here: &Responses,
    wanted: &[ResponseAt],
    failed: &mut Vec<(String, String)>,
) -> Result<Vec<(String, [DMatrix<f64>; 2])>> {
    let (mut all, mut first_error) = (Vec::with_capacity(methods.len()), None);
    for method in methods {
        let derivatives = || {
            let found = method.sensitivities(b, here, wanted)?;
            let uncertainty = method.uncertainty(&found, b, here, wanted)?;
            Ok([found, uncertainty])
        };
        match derivatives() {
            Ok(found) => all.push((method.name.to_owned(), found)),
            Err(error) => {
                if !matches!(error, Error::Unsupported { .. }) {
                    failed.push((method.name.to_owned(), error.to_string()));
                }
                first_error.get_or_insert(error);
            }
        }
    }
    match first_error {
        Some(error) if all.is_empty() => Err(error),
        _ => Ok(all),
    }
}
