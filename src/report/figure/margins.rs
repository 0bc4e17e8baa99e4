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
        let bottom = match panel.x.labelled {
            true => style::GAP + style::TICK_SIZE + 2.5 + style::LABEL_SIZE * 1.35,
            false => 4.0,
        };
        let heights = Self { top: 4.0 + title, bottom: bottom + legend_height(panel, outer.width), ..Self::default() };
        // The ticks depend on the size of the frame, and the width of their numbers on the ticks.
        let mut margins = Self { left: 34.0, right: 16.0, ..heights };
        for _ in 0..2 {
            let view = View::new(panel, margins.inside(outer));
            let left = match panel.y.labelled {
                true => view.y_ticks.widest_label(style::TICK_SIZE) + style::GAP + style::LABEL_SIZE * 1.5 + 2.0,
                false => 4.0,
            };
            let right = 4.0 + view.x_ticks.widest_label(style::TICK_SIZE) / 2.0;
            margins = Self { left, right, ..heights };
        }
        margins
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::{Colour, Panel};
    use crate::report::figure::{Figure, Legend, Mark, PlotAxis, Stroke};

    /// The numbers have as many digits as the ticks of the drawn frame need, for every height of the panel.
    #[test]
    fn the_label_keeps_clear_of_the_numbers() {
        for (height, [low, high]) in (20..130)
            .flat_map(|height| [[2.93, 3.112], [0.0, 1.0], [-12.3, 40.0], [1.2345, 1.2352]].map(|y| (height, y)))
        {
            let curve = Mark::curve([[0.0, low], [7.0, high]], Stroke::solid(Colour::BLACK, 1.0)).named("design");
            let mut panel = Panel::new(PlotAxis::new("cycle", "").whole(), PlotAxis::new("sling", "m"));
            panel.add(curve);
            let figure = Figure::new("", 85.0, f64::from(height)).with(panel.clone().legend(Legend::Below)).with(panel);
            for (k, area) in figure.frames().into_iter().enumerate() {
                let view = View::new(&figure.panels[k], area);
                let numbers = area.left - style::GAP - view.y_ticks.widest_label(style::TICK_SIZE);
                let label = figure.outer(k).left + 0.5 + 1.25 * style::LABEL_SIZE;
                assert!(numbers >= label, "height {height}, {low} to {high}: {numbers} {label}");
            }
        }
    }
}
