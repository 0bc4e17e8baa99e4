//! Margins of a panel: space for numbers, labels, title and legend.

use super::panel::{Legend, Panel};
use super::svg::Area;
use super::view::View;
use super::{legend, style};

/// Margins around a frame, in points.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Margins {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Margins {
    /// Common left and right margins of two panels of a column, so that their frames are aligned.
    pub fn union(self, other: Self) -> Self {
        Self { left: self.left.max(other.left), right: self.right.max(other.right), ..self }
    }

    /// Margins for the numbers, labels, title and legend of a panel of the given outer size.
    pub fn around(panel: &Panel, outer: Area) -> Self {
        let title = if panel.title.is_empty() { 0.0 } else { style::LABEL_SIZE + 4.0 };
        if !panel.framed {
            let legend = legend_height(panel, outer.width);
            return Self { left: 2.0, right: 2.0, top: 2.0 + title, bottom: 2.0 + legend };
        }
        let nominal = Area {
            left: 0.0,
            top: 0.0,
            width: (outer.width - 50.0).max(20.0),
            height: (outer.height - 35.0).max(20.0),
        };
        let view = View::new(panel, nominal);
        let left = match panel.y.labelled {
            true => view.y_ticks.widest_label(style::TICK_SIZE) + style::GAP + style::LABEL_SIZE * 1.5 + 2.0,
            false => 4.0,
        };
        let bottom = match panel.x.labelled {
            true => style::GAP + style::TICK_SIZE + 2.5 + style::LABEL_SIZE * 1.35,
            false => 4.0,
        };
        let right = 4.0 + view.x_ticks.widest_label(style::TICK_SIZE) / 2.0;
        Self { left, right, top: 4.0 + title, bottom: bottom + legend_height(panel, outer.width) }
    }

    /// The outer area without the margins.
    pub fn inside(&self, outer: Area) -> Area {
        Area {
            left: outer.left + self.left,
            top: outer.top + self.top,
            width: (outer.width - self.left - self.right).max(10.0),
            height: (outer.height - self.top - self.bottom).max(10.0),
        }
    }
}

fn legend_height(panel: &Panel, width: f64) -> f64 {
    if panel.legend == Legend::Below && panel.has_legend() { legend::height_below(panel, width) + 3.0 } else { 0.0 }
}
