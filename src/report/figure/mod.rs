//! Figures for print: one value, written as SVG or painted as PNG.
//!
//! A [`Figure`] has a size on paper and panels; a [`Panel`] has two axes and [`Mark`]s in data coordinates. Sizes of
//! letters, lines and markers are in points on paper, so a figure of 85 mm fits one column of a journal as it is.
//!
//! ```
//! use linkwright::report::figure::{Axis, Colour, Figure, Mark, Panel, Stroke};
//!
//! let mut panel = Panel::new(Axis::new("time *t*", "s"), Axis::new("position *y*", "m"));
//! let decay: Vec<[f64; 2]> = (0..100).map(|k| 0.1 * k as f64).map(|t| [t, t * (-t).exp()]).collect();
//! panel.add(Mark::curve(decay, Stroke::solid(Colour::BLUE, 1.0)).named("critically damped"));
//! let figure = Figure::new("Decay", 85.0, 60.0).with(panel);
//! assert!(figure.svg()?.contains("critically damped"));
//! assert_eq!(&figure.png(150.0)?[1..4], b"PNG");
//! # Ok::<(), linkwright::Error>(())
//! ```

mod axis;
mod bar;
pub(crate) mod check;
mod colour;
mod contour;
mod draw;
mod frame;
mod grid;
mod legend;
mod mark;
pub(crate) mod markup;
mod panel;
mod place;
mod raster;
pub(crate) mod style;
mod svg;
mod ticks;
mod view;

pub use axis::{Axis, Quantity, Scale};
pub use colour::{Colour, ColourMap};
pub use contour::{contour, round_levels};
pub use grid::Grid;
pub use mark::{Anchor, Dash, Mark, Marker, Stroke, Symbol};
pub use markup::literal;
pub use panel::{ColourBar, Legend, Panel};

pub(crate) use grid::spaced;
pub(crate) use raster::pixels;
pub(crate) use ticks::short;

use crate::{Error, Result};
use svg::{Area, Svg};
use view::Margins;

/// A picture with a size on paper.
#[derive(Clone, Debug)]
pub struct Figure {
    /// What the picture shows, in words: read out instead of it.
    pub description: String,
    width: f64,
    height: f64,
    columns: usize,
    panels: Vec<Panel>,
}

impl Figure {
    /// An empty figure; width and height in millimetres.
    pub fn new(description: impl Into<String>, width: f64, height: f64) -> Self {
        Self { description: description.into(), width, height, columns: 1, panels: Vec::new() }
    }

    /// The same figure with one more panel, to the right of the last or below it.
    pub fn with(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// The same figure with its panels in the given number of columns.
    pub fn in_columns(self, columns: usize) -> Self {
        Self { columns: columns.max(1), ..self }
    }

    /// The panels, row by row.
    pub fn panels_mut(&mut self) -> &mut [Panel] {
        &mut self.panels
    }

    /// Width and height in millimetres.
    pub fn size(&self) -> [f64; 2] {
        [self.width, self.height]
    }

    /// The SVG file. Text stays text.
    ///
    /// **Errors.** A size outside 10 to 2000 mm, no panels, limits of an axis that are not increasing, finite and (on a
    /// logarithmic scale) positive.
    pub fn svg(&self) -> Result<String> {
        self.check()?;
        let mut svg = Svg::new();
        let outers: Vec<Area> = (0..self.panels.len()).map(|k| self.outer(k)).collect();
        let margins: Vec<Margins> =
            self.panels.iter().zip(&outers).map(|(panel, &outer)| Margins::around(panel, outer)).collect();
        for (k, panel) in self.panels.iter().enumerate() {
            let column = margins.iter().skip(k % self.columns).step_by(self.columns);
            let aligned = column.fold(margins[k], |all, &other| all.union(other));
            draw::panel(&mut svg, panel, aligned.inside(outers[k]), outers[k]);
        }
        Ok(svg.finish(self.width, self.height, &markup::plain(&self.description)))
    }

    /// The PNG file at a resolution in pixels per inch; 300 suits print, 144 a screen.
    ///
    /// **Errors.** As [`Figure::svg`], and a resolution outside 10 to 2400.
    pub fn png(&self, resolution: f64) -> Result<Vec<u8>> {
        raster::png(&self.svg()?, resolution)
    }

    fn outer(&self, k: usize) -> Area {
        let rows = self.panels.len().div_ceil(self.columns);
        let width = self.width * style::POINTS_PER_MM / self.columns as f64;
        let height = self.height * style::POINTS_PER_MM / rows as f64;
        Area { left: width * (k % self.columns) as f64, top: height * (k / self.columns) as f64, width, height }
    }

    fn check(&self) -> Result<()> {
        for (option, size) in [("width of the figure", self.width), ("height of the figure", self.height)] {
            Error::check_option(option, "from 10 to 2000 mm", size, (10.0..=2000.0).contains(&size))?;
        }
        check::not_empty("panels of the figure", self.panels.len())?;
        for axis in self.panels.iter().flat_map(|panel| [&panel.x, &panel.y]) {
            let [low, high] = axis.limits.unwrap_or([1.0, 2.0]);
            let positive = axis.scale == Scale::Linear || low > 0.0;
            if !(low.is_finite() && high.is_finite() && low < high && positive) {
                let what = format!("limits of the axis '{}'", markup::plain(&axis.quantity.name));
                let remedy = "give finite, increasing limits, positive on a logarithmic scale";
                return Err(Error::definition(what, format!("they are {low} and {high}"), remedy));
            }
        }
        Ok(())
    }
}
