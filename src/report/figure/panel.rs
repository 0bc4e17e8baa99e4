//! A pair of axes and what is drawn in them.

use super::{Axis, ColourMap, Mark, Quantity};

/// Where the legend stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legend {
    /// In the corner where it covers least.
    Inside,
    /// Under the panel, in as many columns as fit.
    Below,
    /// Nowhere.
    Absent,
}

/// The scale of colours beside a field.
#[derive(Clone, Debug)]
pub struct ColourBar {
    /// What the colours mean.
    pub quantity: Quantity,
    /// The colours.
    pub map: ColourMap,
    /// The values at its ends.
    pub range: [f64; 2],
}

/// A pair of axes and what is drawn in them.
#[derive(Clone, Debug)]
pub struct Panel {
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// A line above the frame; may be empty.
    pub title: String,
    /// Where the legend stands.
    pub legend: Legend,
    /// One unit is as long on both axes.
    pub equal: bool,
    /// Whether the frame with its ticks is drawn.
    pub framed: bool,
    /// Its part of the height of the figure, relative to that of the other rows.
    pub share: f64,
    pub(crate) marks: Vec<Mark>,
}

impl Panel {
    /// An empty panel.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self {
            x,
            y,
            title: String::new(),
            legend: Legend::Inside,
            equal: false,
            framed: true,
            share: 1.0,
            marks: Vec::new(),
        }
    }

    /// Draws one more mark over the others.
    pub fn add(&mut self, mark: Mark) -> &mut Self {
        self.marks.push(mark);
        self
    }

    /// Draws more marks over the others.
    pub fn extend(&mut self, marks: impl IntoIterator<Item = Mark>) -> &mut Self {
        self.marks.extend(marks);
        self
    }

    /// The same panel with a line above the frame.
    pub fn titled(self, title: impl Into<String>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// The same panel with its legend elsewhere.
    pub fn legend(self, legend: Legend) -> Self {
        Self { legend, ..self }
    }

    /// The same panel with one unit as long on both axes.
    pub fn equal(self) -> Self {
        Self { equal: true, ..self }
    }

    /// The same panel with another part of the height.
    pub fn share(self, share: f64) -> Self {
        Self { share, ..self }
    }

    /// The same panel without frame, ticks and labels.
    pub fn unframed(self) -> Self {
        Self { framed: false, ..self }
    }

    pub(crate) fn has_legend(&self) -> bool {
        self.legend != Legend::Absent && self.marks.iter().any(|mark| mark.name.is_some())
    }
}
