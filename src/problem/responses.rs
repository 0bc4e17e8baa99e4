//! Responses of the analysed system and where they come from.

use super::{ContinuousTime, GradientMethod, Intermediates};
use error::Result;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::any::Any;
use std::sync::Arc;

/// Declaration of one response r_h: a number, or a history over a time grid.
#[derive(Clone, Debug)]
pub struct Response {
    /// Name, unique in the problem.
    pub name: String,
    /// Unit, for tables and axes.
    pub unit: String,
    /// Index of its time grid; none for a time-independent response.
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

/// What an analysis yields at one design.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Responses {
    /// `values[h][p]`: response h at time point p, in its unit.
    pub values: Vec<Vec<f64>>,
    /// Whatever the analysis wants to find again when sensitivities are asked for at the same design. Never stored in
    /// a file: after a restart the analysis must do without.
    #[serde(skip)]
    pub trace: Option<Arc<dyn Any + Send + Sync>>,
}

impl Responses {
    /// Responses without a trace.
    pub fn new(values: Vec<Vec<f64>>) -> Self {
        Self { values, trace: None }
    }

    /// The value at one instant.
    pub fn at(&self, instant: ResponseAt) -> f64 {
        self.values[instant.response][instant.point]
    }
}

impl std::fmt::Debug for Responses {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Responses").field("values", &self.values).finish_non_exhaustive()
    }
}

/// The expensive part: from a design to responses, and to sensitivities where they are wanted.
///
/// An analysis that cannot be done at a design (no assembly, no convergence) returns
/// [`Error::Analysis`](crate::Error::Analysis); during an optimization that is a rejected cycle, not the end.
/// Both methods are pure: the same design gives the same bits.
pub trait Analysis: Send + Sync {
    /// All responses at design `b` (length n).
    fn analyze(&self, b: &[f64]) -> Result<Responses>;

    /// ∂r/∂b at the wanted instants: one row for each, n columns. `responses` is what [`Analysis::analyze`] gave at `b`.
    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>>;

    /// ∂²r/∂b² at the wanted instants (n × n each), if the analysis can give them.
    fn curvatures(
        &self,
        _b: &[f64],
        _responses: &Responses,
        _wanted: &[ResponseAt],
    ) -> Result<Option<Vec<DMatrix<f64>>>> {
        Ok(None)
    }

    /// All ways in which this analysis can be differentiated, to be compared with each other and with differences: itself
    /// alone, unless it has several.
    fn alternatives(&self) -> Vec<GradientMethod<'_>> {
        Vec::new()
    }

    /// The name of the method that takes derivatives at the `wanted` instants by this many design variables, where there is
    /// a choice.
    fn differentiation(&self, _variables: usize, _wanted: &[ResponseAt]) -> Option<&'static str> {
        None
    }

    /// The responses between the time points, if the analysis can give them.
    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        None
    }
}

impl<A: Analysis + ?Sized> Analysis for &A {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        (**self).analyze(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        (**self).sensitivities(b, responses, wanted)
    }

    fn curvatures(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<Option<Vec<DMatrix<f64>>>> {
        (**self).curvatures(b, responses, wanted)
    }

    fn alternatives(&self) -> Vec<GradientMethod<'_>> {
        (**self).alternatives()
    }

    fn differentiation(&self, variables: usize, wanted: &[ResponseAt]) -> Option<&'static str> {
        (**self).differentiation(variables, wanted)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        (**self).continuous()
    }
}
