//! Data that the automatic method stores from cycle to cycle.

use super::Scores;
use super::candidates::AcceptedPoint;
use serde::{Deserialize, Serialize};

/// Data that the automatic method stores from cycle to cycle.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct AutomaticState {
    /// Start length d of each variable.
    pub start_lengths: Vec<f64>,
    /// True for each start length that is a guess, as the variable starts at zero and has no range.
    #[serde(default)]
    pub guessed: Vec<bool>,
    /// Half widths w of the box of the next cycle.
    pub widths: Vec<f64>,
    /// The last accepted designs with their numbers, the current one last.
    pub points: Vec<AcceptedPoint>,
    /// The filter.
    pub filter: Vec<FilterEntry>,
    /// Scores of the candidates.
    pub scores: Scores,
    /// Rejected steps from the current design.
    pub rejections: usize,
    /// Rejected designs with the numbers there, since the last accepted one.
    pub rejected: Vec<RejectedPoint>,
    /// The largest violation of each constraint at the stationary points from which a displacement was made.
    #[serde(rename = "left", default)]
    pub displaced_from: Vec<Vec<f64>>,
    /// True while all rows have the same unit, so that the largest violation is that of the problem. Restoration continues with it where
    /// the violation in the units of the rows is stationary.
    #[serde(default)]
    pub has_common_unit: bool,
    /// Number of trial steps from designs that seemed to be optima, to determine the curvature in a direction.
    #[serde(rename = "explorations", default)]
    pub curvature_trials: usize,
    /// Negligible change of the objective if the run of another method is continued; zero otherwise.
    #[serde(default)]
    pub tolerance: f64,
}

/// A rejected design with the numbers of the current cycle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RejectedPoint {
    /// Design.
    pub design: Vec<f64>,
    /// Values of the numbers there, in the order of the current design.
    pub values: Vec<f64>,
}

/// A design of the filter. The violations are stored in units of the problem and converted to the units of the current cycle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilterEntry {
    /// F.
    pub objective: f64,
    /// Largest violation of each constraint.
    pub violations: Vec<f64>,
}
