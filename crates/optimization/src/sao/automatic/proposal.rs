//! The proposal of a cycle: a design to be analysed, or the end of the run.

use super::acceptance::DesignMerit;
use crate::sao::{ActiveRow, Region, Status};
use nlp::Solution;

/// A proposed design and what is predicted there.
pub(super) struct Proposal {
    pub design: Vec<f64>,
    pub region: Region,
    pub at_limit: Vec<bool>,
    pub solution: Solution,
    /// t*, if the linearized rows are incompatible.
    pub restoration: Option<f64>,
    pub predicted: DesignMerit,
    pub purpose: Purpose,
}

/// The reason why a design is analysed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To improve objective or violation.
    Improvement,
    /// To determine the curvature of the Lagrangian in a direction; accepted if the curvature is negative.
    Curvature,
    /// To move along directions of zero curvature, at whose end a better design may be; accepted if the Lagrangian does not increase.
    Flat,
    /// To move variables to bounds that are near, where rows may have other slopes; accepted if the Lagrangian does not increase.
    Bound,
    /// To leave a stationary point or to move a variable on which no function depends; accepted for any prediction.
    Displacement,
    /// To go back from a stationary violation to the best feasible design of the run; always accepted.
    Return,
}

/// The next action of a run.
pub(super) enum Next {
    Analyse(Box<Proposal>),
    /// The cycle is restarted with a common unit of the rows.
    CommonUnit,
    /// The status, its reason, and the active rows with their multipliers at the design.
    End(Status, String, Vec<ActiveRow>),
}
