//! Responses of the analysed system, and the analysis that computes and differentiates them.

use super::Intermediates;
use error::Result;
use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Declaration of one response r_h: a number, or a history over a time grid.
#[derive(Clone, Debug)]
pub struct Response {
    /// Name, unique in the problem.
    pub name: String,
    /// Unit, for tables and axes.
    pub unit: String,
    /// Index of its time grid; `None` for a time-independent response.
    pub grid: Option<usize>,
    /// The intermediate design variables in which it is linearized (equation 13).
    pub intermediates: Intermediates,
}

/// One number of an analysis: response `response` at time point `point` (0 for a time-independent response).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ResponseAt {
    /// Index h of the response.
    pub response: usize,
    /// Index p of the time point.
    pub point: usize,
}

/// A weighted sum of responses, such as the integral of a history by quadrature.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResponseSum {
    /// Responses with their weights.
    pub terms: Vec<(ResponseAt, f64)>,
}

impl ResponseSum {
    /// One response with the weight 1.
    pub fn of(at: ResponseAt) -> Self {
        Self { terms: vec![(at, 1.0)] }
    }

    /// The responses in `sums`, sorted, each once.
    pub fn responses_in(sums: &[Self]) -> Vec<ResponseAt> {
        let mut all: Vec<ResponseAt> = sums.iter().flat_map(|sum| sum.terms.iter().map(|(at, _)| *at)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The weighted sums of the `rows`, which are those of the responses `at` (sorted).
    pub(crate) fn add_rows(sums: &[Self], at: &[ResponseAt], rows: &DMatrix<f64>) -> DMatrix<f64> {
        let mut added = DMatrix::zeros(sums.len(), rows.ncols());
        for (i, sum) in sums.iter().enumerate() {
            for (response, weight) in &sum.terms {
                let row = at.binary_search(response).expect("the rows are those of all responses of the sums");
                (0..rows.ncols()).for_each(|k| added[(i, k)] += weight * rows[(row, k)]);
            }
        }
        added
    }
}

/// All responses at one design.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Responses {
    /// `values[h][p]`: response h at time point p, in its unit.
    pub values: Vec<Vec<f64>>,
    /// Reasons to doubt these values although the analysis has succeeded, each with its part, time and remedy: a loss of
    /// energy, too long steps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Choices that the analysis has made because its settings do not determine them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Data that the analysis reuses for sensitivities at the same design.
    ///
    /// It is never stored in a file: after a restart the analysis works without it.
    #[serde(skip)]
    pub trace: Option<Arc<dyn Any + Send + Sync>>,
}

impl Responses {
    /// Responses without warnings and trace.
    pub fn new(values: Vec<Vec<f64>>) -> Self {
        Self { values, ..Self::default() }
    }

    /// The value of one response at one time point.
    pub fn at(&self, at: ResponseAt) -> f64 {
        self.values[at.response][at.point]
    }
}

impl std::fmt::Debug for Responses {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Responses").field("values", &self.values).finish_non_exhaustive()
    }
}

/// Computes responses at a design, and their sensitivities.
///
/// This is the expensive part of an optimization. The methods are pure: the same design gives the same bits.
///
/// # Errors
///
/// An analysis that fails at a design (no assembly, no convergence) returns
/// [`Error::Analysis`](crate::Error::Analysis); during an optimization that rejects the design and does not end the run. A
/// valid request that an analysis does not offer returns [`Error::Unsupported`](crate::Error::Unsupported).
///
/// # Examples
///
/// An analysis with its derivative typed by hand. [`ClosedForm`](super::ClosedForm) differentiates explicit formulas
/// automatically, and [`Differences`](crate::responses::Differences) differentiates any analysis.
///
/// ```
/// use linkwright_optimization::{Result, problem::{Analysis, ResponseAt, Responses}};
/// use nalgebra::DMatrix;
/// struct Square;
/// impl Analysis for Square {
///     fn analyze(&self, b: &[f64]) -> Result<Responses> {
///         Ok(Responses::new(vec![vec![b[0] * b[0]]]))
///     }
///     fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
///         Ok(DMatrix::from_element(wanted.len(), 1, 2.0 * b[0]))
///     }
/// }
/// assert_eq!(Square.analyze(&[3.0])?.at(ResponseAt { response: 0, point: 0 }), 9.0);
/// # Ok::<(), linkwright_optimization::Error>(())
/// ```
pub trait Analysis: Send + Sync {
    /// All responses at design `b` (length n).
    fn analyze(&self, b: &[f64]) -> Result<Responses>;

    /// All responses at each of many designs, without traces: in parallel, unless the analysis replaces this method.
    ///
    /// Finite differences and gradient checks call it. Override it for an analysis that must not run concurrently, or that runs on other
    /// machines.
    fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        let one = |b: &Vec<f64>| self.analyze(b).map(|responses| Responses { trace: None, ..responses });
        designs.par_iter().map(one).collect()
    }

    /// All responses at each of many designs near the design `b`, as functions whose derivatives at `b` are
    /// [`Analysis::sensitivities`].
    ///
    /// Gradient checks call it. An analysis that chooses its steps by the design, and whose derivatives are those of the chosen
    /// steps, uses the steps of `b` at all designs. The default is [`Analysis::analyze_many`].
    fn analyze_around(&self, _b: &[f64], designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
        self.analyze_many(designs)
    }

    /// Relative tolerance of steps that [`Analysis::analyze_around`] chooses separately at each design near `b`; zero if all use the same steps.
    ///
    /// Responses contain the error of these steps, which changes from design to design: gradient checks cannot distinguish derivatives
    /// of this size from zero.
    fn step_tolerance(&self, _b: &[f64]) -> f64 {
        0.0
    }

    /// Explains a response at design `b` that is not finite, as in `asin(1.2) is not defined`.
    fn undefined(&self, _b: &[f64], _at: ResponseAt) -> Option<String> {
        None
    }

    /// ∂r/∂b of the wanted responses: one row for each, n columns. `responses` is the result of [`Analysis::analyze`] at `b`.
    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>>;

    /// Gradients of weighted sums of responses: one row for each, n columns.
    ///
    /// The default adds the rows of [`Analysis::sensitivities`]. With the adjoint method of an analysis over time, a sum costs
    /// as much as one response.
    fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
        let at = ResponseSum::responses_in(sums);
        Ok(ResponseSum::add_rows(sums, &at, &self.sensitivities(b, responses, &at)?))
    }

    /// ∂²r/∂b² of the wanted responses (n × n each); `None` if the analysis does not offer them.
    fn curvatures(
        &self,
        _b: &[f64],
        _responses: &Responses,
        _wanted: &[ResponseAt],
    ) -> Result<Option<Vec<DMatrix<f64>>>> {
        Ok(None)
    }

    /// All methods by which this analysis can be differentiated, for gradient checks; empty if there is only one.
    fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
        Vec::new()
    }

    /// Name of the method for derivatives of the wanted responses with respect to this many design variables; `None` if the
    /// analysis has only one method.
    fn differentiation(&self, _variables: usize, _wanted: &[ResponseAt]) -> Option<&'static str> {
        None
    }

    /// Reasons to doubt the `responses` at the design `b` of an analysis that has succeeded: the part, the time and the remedy.
    ///
    /// These are [`Responses::warnings`], and warnings that need further analyses.
    fn warnings(&self, _b: &[f64], responses: &Responses) -> Vec<String> {
        responses.warnings.clone()
    }

    /// The responses between the time points; `None` if the analysis does not offer them.
    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        None
    }
}

/// Responses as smooth functions of time, which an [`Analysis`] may offer in addition to its time points.
///
/// For an analysis that does not implement it, polynomials of fourth degree through five time points are used.
pub trait ContinuousTime: Send + Sync {
    /// r, ṙ and r̈ of response `h` at time `t`.
    fn rates(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[f64; 3]>;
    /// ∂r/∂b and ∂ṙ/∂b of response `h` at time `t` (length n each).
    fn rate_sensitivities(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[Vec<f64>; 2]>;
    /// ∂²r/∂b² of response `h` at time `t` (n × n), if the analysis offers it.
    fn curvature(&self, _b: &[f64], _responses: &Responses, _h: usize, _t: f64) -> Result<Option<DMatrix<f64>>> {
        Ok(None)
    }
}

/// Implements [`Analysis`] for pointers to an analysis.
macro_rules! forward_analysis {
    ($($pointer:ty),*) => {
        $(
            impl<A: Analysis + ?Sized> Analysis for $pointer {
                fn analyze(&self, b: &[f64]) -> Result<Responses> {
                    (**self).analyze(b)
                }

                fn analyze_many(&self, designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
                    (**self).analyze_many(designs)
                }

                fn analyze_around(&self, b: &[f64], designs: &[Vec<f64>]) -> Vec<Result<Responses>> {
                    (**self).analyze_around(b, designs)
                }

                fn step_tolerance(&self, b: &[f64]) -> f64 {
                    (**self).step_tolerance(b)
                }

                fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
                    (**self).sensitivities(b, responses, wanted)
                }

                fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
                    (**self).sum_sensitivities(b, responses, sums)
                }

                fn undefined(&self, b: &[f64], at: ResponseAt) -> Option<String> {
                    (**self).undefined(b, at)
                }

                fn warnings(&self, b: &[f64], responses: &Responses) -> Vec<String> {
                    (**self).warnings(b, responses)
                }

                fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
                    (**self).curvatures(b, responses, wanted)
                }

                fn gradient_methods(&self) -> Vec<GradientMethod<'_>> {
                    (**self).gradient_methods()
                }

                fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
                    (**self).differentiation(variables, wanted)
                }

                fn continuous(&self) -> Option<&dyn ContinuousTime> {
                    (**self).continuous()
                }
            }
        )*
    };
}

forward_analysis!(&A, Arc<A>);

/// ∂r/∂b from a step, a design, its responses and the wanted ones, as [`Analysis::sensitivities`].
type Differentiate<'a> = Box<dyn Fn(f64, &[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a>;

/// Gradients of weighted sums from a design and its responses, as [`Analysis::sum_sensitivities`].
type DifferentiateSums<'a> = Box<dyn Fn(&[f64], &Responses, &[ResponseSum]) -> Result<DMatrix<f64>> + Send + Sync + 'a>;

/// A method of differentiating an analysis.
pub struct GradientMethod<'a> {
    /// Name, for tables and model files.
    pub name: &'static str,
    /// Relative step of differences; `None` for an exact method.
    pub step: Option<f64>,
    differentiate: Differentiate<'a>,
    /// None if the rows of the responses are added.
    differentiate_sums: Option<DifferentiateSums<'a>>,
}

impl<'a> GradientMethod<'a> {
    /// A method that is exact up to rounding.
    pub fn exact(
        name: &'static str,
        differentiate: impl Fn(&[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a,
    ) -> Self {
        let differentiate = move |_: f64, b: &[f64], r: &Responses, wanted: &[ResponseAt]| differentiate(b, r, wanted);
        Self { name, step: None, differentiate: Box::new(differentiate), differentiate_sums: None }
    }

    /// A finite-difference method with a relative step, `step` by default.
    pub fn approximate(
        name: &'static str,
        step: f64,
        differentiate: impl Fn(f64, &[f64], &Responses, &[ResponseAt]) -> Result<DMatrix<f64>> + Send + Sync + 'a,
    ) -> Self {
        Self { name, step: Some(step), differentiate: Box::new(differentiate), differentiate_sums: None }
    }

    /// The sensitivities of an analysis itself.
    pub fn of(name: &'static str, analysis: &'a dyn Analysis) -> Self {
        Self::exact(name, move |b, responses, wanted| analysis.sensitivities(b, responses, wanted))
    }

    /// Differentiates weighted sums by this function instead of adding the rows of their responses.
    pub fn with_sums(
        self,
        differentiate: impl Fn(&[f64], &Responses, &[ResponseSum]) -> Result<DMatrix<f64>> + Send + Sync + 'a,
    ) -> Self {
        Self { differentiate_sums: Some(Box::new(differentiate)), ..self }
    }

    /// Replaces the step, if the method has one.
    pub fn with_step(self, step: f64) -> Self {
        Self { step: self.step.map(|_| step), ..self }
    }

    /// ∂r/∂b of the wanted responses at the design `b`, one row for each; `responses` are those of the analysis at `b`.
    pub fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        (self.differentiate)(self.step.unwrap_or_default(), b, responses, wanted)
    }

    /// Gradients of weighted sums of responses, as [`Analysis::sum_sensitivities`].
    pub fn sum_sensitivities(&self, b: &[f64], responses: &Responses, sums: &[ResponseSum]) -> Result<DMatrix<f64>> {
        self.sums_by(self.step.unwrap_or_default(), b, responses, sums)
    }

    /// [`GradientMethod::sum_sensitivities`] with another step.
    pub(super) fn sums_by(
        &self,
        step: f64,
        b: &[f64],
        responses: &Responses,
        sums: &[ResponseSum],
    ) -> Result<DMatrix<f64>> {
        if let Some(differentiate) = &self.differentiate_sums {
            return differentiate(b, responses, sums);
        }
        let at = ResponseSum::responses_in(sums);
        Ok(ResponseSum::add_rows(sums, &at, &(self.differentiate)(step, b, responses, &at)?))
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
