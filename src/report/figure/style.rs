//! Sizes in points, for a printed column.

/// Letters of axis labels.
pub(crate) const LABEL_SIZE: f64 = 8.0;
/// Letters of numbers, notes and legends.
pub(crate) const TICK_SIZE: f64 = 7.0;
/// Letters of contour labels.
pub(crate) const CONTOUR_SIZE: f64 = 6.2;
/// Line width of a frame.
pub(crate) const FRAME_WIDTH: f64 = 0.6;
/// Length of a major tick, inwards.
pub(crate) const TICK_LENGTH: f64 = 3.2;
/// Length of a minor tick, inwards.
pub(crate) const MINOR_LENGTH: f64 = 1.7;
/// Distance between the frame and the numbers.
pub(crate) const GAP: f64 = 3.0;
/// Height of a line of the legend.
pub(crate) const LEGEND_LINE: f64 = 10.5;
/// Length of a sample in the legend.
pub(crate) const LEGEND_SAMPLE: f64 = 17.0;
/// Points per millimetre.
pub(crate) const POINTS_PER_MM: f64 = 72.0 / 25.4;
