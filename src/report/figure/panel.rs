//! Panels: a pair of axes with marks.

use super::axis::{PlotAxis, QuantityLabel};
use super::colour::ColourMap;
use super::mark::Mark;

/// Position of the legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// Inside the frame, in the corner where it covers the fewest marks.
    Inside,
    /// Under the panel, in as many columns as fit.
    Below,
    /// No legend.
    Absent,
}

/// Colour bar of a field.
#[derive(Clone, Debug)]
pub struct ColourBar {
    /// Quantity that the colours show.
    pub quantity: QuantityLabel,
    /// Colour map.
    pub map: ColourMap,
    /// The values at its ends.
    pub range: [f64; 2],
}

/// A pair of axes with marks.
#[derive(Clone, Debug)]
pub struct Panel {
    /// The horizontal axis.
    pub x: PlotAxis,
    /// The vertical axis.
    pub y: PlotAxis,
    /// Title above the frame; may be empty.
    pub title: String,
    /// Position of the legend.
    pub legend: Legend,
    /// `true` if a unit has the same length on both axes, as for the drawing of a mechanism.
    pub equal: bool,
    /// `true` if the vertical axis is not a function of the horizontal one, such as in a plane of two design variables.
    pub plane: bool,
    /// `true` if the frame with its ticks is drawn.
    pub framed: bool,
    /// Its share of the height of the figure, relative to the other rows.
    pub share: f64,
    pub(crate) marks: Vec<Mark>,
}

impl Panel {
    /// An empty panel.
    pub fn new(x: PlotAxis, y: PlotAxis) -> Self {
        Self {
            x,
            y,
            title: String::new(),
            legend: Legend::Inside,
            equal: false,
            plane: false,
            framed: true,
            share: 1.0,
            marks: Vec::new(),
        }
    }

    /// Appends a mark; later marks cover earlier ones.
    pub fn add(&mut self, mark: Mark) -> &mut Self {
        self.marks.push(mark);
        self
    }

    /// Appends marks.
    pub fn extend(&mut self, marks: impl IntoIterator<Item = Mark>) -> &mut Self {
        self.marks.extend(marks);
        self
    }

    /// Sets the title.
    pub fn titled(self, title: impl Into<String>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// Sets the position of the legend.
    pub fn legend(self, legend: Legend) -> Self {
        Self { legend, ..self }
    }

    /// Sets the same length of a unit on both axes.
    pub fn equal(self) -> Self {
        Self { equal: true, ..self }
    }

    /// Makes both axes independent: in a page, the pointer reads the nearest mark instead of the values at its abscissa.
    pub fn plane(self) -> Self {
        Self { plane: true, ..self }
    }

    /// Sets the share of the height.
    pub fn share(self, share: f64) -> Self {
        Self { share, ..self }
    }

    /// Removes frame, ticks and labels.
    pub fn unframed(self) -> Self {
        Self { framed: false, ..self }
    }

    pub(crate) fn has_legend(&self) -> bool {
        self.legend != Legend::Absent && self.marks.iter().any(|mark| mark.name.is_some())
    }
}
