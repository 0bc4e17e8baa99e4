//! Figures for print, written as SVG or PNG.
//!
//! A [`Figure`] has a size on paper and panels; a [`Panel`] has two axes and [`Mark`]s in data coordinates. Sizes of
//! letters, lines and markers are in points on paper, so a figure of 85 mm fits one column of a journal as it is.
//!
//! ```
//! use linkwright::report::figure::{PlotAxis, Colour, Figure, Mark, Panel, Stroke};
//!
//! let mut panel = Panel::new(PlotAxis::new("time *t*", "s"), PlotAxis::new("position *y*", "m"));
//! let decay: Vec<[f64; 2]> = (0..100).map(|k| 0.1 * k as f64).map(|t| [t, t * (-t).exp()]).collect();
//! panel.add(Mark::curve(decay, Stroke::solid(Colour::BLUE, 1.0)).named("critically damped"));
//! let figure = Figure::new("Decay", 85.0, 60.0).with(panel);
//! assert!(figure.svg()?.contains("critically damped"));
//! assert_eq!(&figure.png(150.0)?[1..4], b"PNG");
//! # Ok::<(), linkwright::Error>(())
//! ```

mod axis;
pub(crate) mod check;
mod colour;
mod contour;
mod draw;
mod frame;
mod grid;
mod label_placement;
mod legend;
mod margins;
mod mark;
pub(crate) mod markup;
mod panel;
mod raster;
mod series;
mod shapes;
mod style;
mod svg;
mod ticks;
mod view;

pub use axis::{PlotAxis, QuantityLabel, Scale};
pub use colour::{Colour, ColourMap};
pub use contour::{contour, round_levels};
pub use grid::Grid;
pub use mark::{Anchor, Dash, Mark, MarkSymbol, MarkerShape, Stroke};
pub use markup::literal;
pub use panel::{ColourBar, Legend, Panel};

pub(crate) use grid::{range, spaced};
pub(crate) use raster::pixels;
pub(crate) use ticks::short;

use crate::{Error, Result};
use margins::Margins;
use series::{LARGEST_SERIES, PanelSeries};
use svg::{Area, Svg};

/// A figure with a size on paper.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Text alternative for screen readers.
    pub description: String,
    width: f64,
    height: f64,
    columns: usize,
    panels: Vec<Panel>,
    colour_bar: Option<ColourBar>,
}

impl Figure {
    /// An empty figure; width and height in millimetres.
    pub fn new(description: impl Into<String>, width: f64, height: f64) -> Self {
        Self { description: description.into(), width, height, columns: 1, panels: Vec::new(), colour_bar: None }
    }

    /// Appends a panel, on the right of the last one or below it.
    pub fn with(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Sets the number of columns in which the panels are arranged, row by row.
    pub fn in_columns(self, columns: usize) -> Self {
        Self { columns: columns.max(1), ..self }
    }

    /// Adds a colour bar on the right.
    pub fn with_colour_bar(self, bar: ColourBar) -> Self {
        Self { colour_bar: Some(bar), ..self }
    }

    /// Sets width and height in millimetres.
    pub fn sized(self, width: f64, height: f64) -> Self {
        Self { width, height, ..self }
    }

    /// The panels, row by row.
    pub fn panels_mut(&mut self) -> &mut [Panel] {
        &mut self.panels
    }

    /// Width and height in millimetres.
    pub fn size(&self) -> [f64; 2] {
        [self.width, self.height]
    }

    /// The SVG file, with text as text elements.
    ///
    /// # Errors
    /// [`Error::Option`] or [`Error::Definition`] for a size outside 10 to 2000 mm, no panels, or limits of an axis that are not
    /// increasing, finite and, on a logarithmic scale, positive.
    pub fn svg(&self) -> Result<String> {
        Ok(self.draw("")?.file(self.size(), &markup::plain(&self.description)))
    }

    /// The SVG element for an HTML page; `id` is unique in the page.
    pub(crate) fn inline_svg(&self, id: &str) -> Result<String> {
        Ok(self.draw(id)?.inline(self.size(), &markup::plain(&self.description)))
    }

    /// The plotted numbers for the script of a page as a list of panels; `None` if nothing is plotted, or too many numbers.
    pub(crate) fn series(&self) -> Option<String> {
        let shown = self.panels.iter().zip(self.frames()).filter(|(panel, _)| panel.framed && !panel.equal);
        let panels: Vec<PanelSeries> = shown.filter_map(|(panel, area)| PanelSeries::new(panel, area)).collect();
        let text = serde_json::to_string(&panels).ok()?;
        (!panels.is_empty() && text.len() < LARGEST_SERIES).then_some(text)
    }

    /// The frames of the panels.
    fn frames(&self) -> Vec<Area> {
        let outers: Vec<Area> = (0..self.panels.len()).map(|k| self.outer(k)).collect();
        let margins: Vec<Margins> =
            self.panels.iter().zip(&outers).map(|(panel, &outer)| Margins::around(panel, outer)).collect();
        let inside = |k: usize| {
            let column = margins.iter().skip(k % self.columns).step_by(self.columns);
            column.fold(margins[k], |all, &other| all.union(other)).inside(outers[k])
        };
        (0..self.panels.len()).map(inside).collect()
    }

    fn draw(&self, prefix: &str) -> Result<Svg> {
        self.check()?;
        let mut svg = Svg::new(prefix);
        let outers: Vec<Area> = (0..self.panels.len()).map(|k| self.outer(k)).collect();
        let insides = self.frames();
        for (k, panel) in self.panels.iter().enumerate() {
            draw::panel(&mut svg, panel, insides[k], outers[k]);
        }
        if let (Some(bar), Some(first), Some(last)) = (&self.colour_bar, insides.first(), insides.last()) {
            let height = last.bottom() - first.top;
            frame::colour_bar(&mut svg, bar, Area { height, left: last.left, width: last.width, ..*first });
        }
        Ok(svg)
    }

    /// The PNG file at a resolution in pixels per inch: 300 for print, 144 for a screen.
    ///
    /// # Errors
    /// Those of [`Figure::svg`], and [`Error::Option`] for a resolution outside 10 to 2400.
    pub fn png(&self, resolution: f64) -> Result<Vec<u8>> {
        raster::png(&self.svg()?, resolution)
    }

    /// Writes `name.svg` and `name.png` (300 pixels per inch) into a folder that exists.
    ///
    /// # Errors
    /// Those of [`Figure::svg`], and [`Error::File`] if a file cannot be written.
    pub fn save(&self, folder: &std::path::Path, name: &str) -> Result<()> {
        let write = |extension: &str, bytes: &[u8]| {
            let file = folder.join(format!("{name}.{extension}"));
            crate::storage::replace_file(&file, bytes, false).map_err(|e| Error::File {
                file: file.display().to_string(),
                why: e.to_string(),
                remedy: "give a folder that exists and can be written".to_owned(),
            })
        };
        let svg = self.svg()?;
        write("svg", svg.as_bytes())?;
        write("png", &raster::png(&svg, 300.0)?)
    }

    fn outer(&self, k: usize) -> Area {
        let bar = self.colour_bar.as_ref().map_or(0.0, frame::colour_bar_width);
        let width = (self.width * style::POINTS_PER_MM - bar) / self.columns as f64;
        let shares: Vec<f64> = self.panels.chunks(self.columns).map(|row| row[0].share).collect();
        let unit = self.height * style::POINTS_PER_MM / shares.iter().sum::<f64>();
        let (row, column) = (k / self.columns, k % self.columns);
        let top = unit * shares[..row].iter().sum::<f64>();
        Area { left: width * column as f64, top, width, height: unit * shares[row] }
    }

    fn check(&self) -> Result<()> {
        for (option, size) in [("width of the figure", self.width), ("height of the figure", self.height)] {
            Error::check_option(option, "from 10 to 2000 mm", size, (10.0..=2000.0).contains(&size))?;
        }
        check::not_empty("panels of the figure", self.panels.len())?;
        for panel in &self.panels {
            let share = panel.share;
            Error::check_option("share of a panel", "positive and finite", share, share > 0.0 && share.is_finite())?;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use resvg::{tiny_skia::Pixmap, usvg};

    fn everything() -> Figure {
        let grid = Grid::sample([0.1, 2.0], [0.1, 2.0], [20, 20], |x, y| x * y).unwrap();
        let line = Stroke::solid(Colour::BLACK, 1.0);
        let mut panel = Panel::new(PlotAxis::new("*b*_1 & <more>", "N/m"), PlotAxis::new("*σ*", "Pa").logarithmic());
        panel.add(Mark::field(grid.clone(), ColourMap::Sequential, [0.0, 4.0]));
        panel.add(Mark::hatching(contour(&grid, 1.0), line, 4.0).named("bound"));
        panel.add(Mark::contour_label(contour(&grid, 2.0), "2", Colour::BLACK));
        panel.add(Mark::rectangle([[0.5, 0.5], [1.0, 1.0]], line.dash(Dash::Dashed)));
        panel.add(Mark::region([[0.5, 0.5], [1.0, 0.5], [1.0, 1.0]], Colour::SKY, 0.5).named("region"));
        panel.add(Mark::curve([[0.2, 0.2], [1.0, -1.0], [f64::NAN, 1.0], [1.5, 0.3]], line).named("broken curve"));
        let markers =
            [MarkerShape::Circle, MarkerShape::Disc, MarkerShape::Square, MarkerShape::Block, MarkerShape::Diamond];
        for (k, marker) in
            markers.into_iter().chain([MarkerShape::Down, MarkerShape::Cross, MarkerShape::Plus]).enumerate()
        {
            panel.add(Mark::points([[0.2 * (k + 1) as f64, 0.4]], marker, Colour::of_series(k), 4.0));
        }
        for symbol in [MarkSymbol::Joint, MarkSymbol::GroundJoint, MarkSymbol::Slider(0.3)] {
            panel.add(Mark::symbol([1.0, 1.0], symbol));
        }
        panel.add(Mark::note([1.0, 1.0], "a note")).add(Mark::text([0.3, 1.0], "a text", Anchor::End, [0.0, 4.0]));
        let bar =
            ColourBar { quantity: QuantityLabel::new("stress", "Pa"), map: ColourMap::Sequential, range: [0.0, 4.0] };
        Figure::new("Everything *at* once", 85.0, 120.0)
            .with(panel.clone())
            .with(panel.legend(Legend::Below))
            .with_colour_bar(bar)
    }

    #[test]
    fn svg_is_well_formed_and_holds_its_texts() {
        let svg = everything().svg().unwrap();
        usvg::roxmltree::Document::parse(&svg).unwrap();
        for text in ["Everything at once", "&amp; &lt;more&gt;", "broken curve", "a note", "a text", "stress"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn png_has_the_size_of_the_paper_and_ink_on_it() {
        let pixmap = Pixmap::decode_png(&everything().png(144.0).unwrap()).unwrap();
        let expected = [85.0, 120.0].map(|mm: f64| mm / 25.4 * 144.0);
        assert!((f64::from(pixmap.width()) - expected[0]).abs() <= 1.0);
        assert!((f64::from(pixmap.height()) - expected[1]).abs() <= 1.0);
        let dark = pixmap.pixels().iter().filter(|p| p.red() < 100 && p.green() < 100).count();
        assert!(dark > 2000, "{dark} dark pixels");
    }

    #[test]
    fn text_is_painted_without_any_font_of_the_machine() {
        let panel = |name: &str| Panel::new(PlotAxis::new(name, ""), PlotAxis::new("", ""));
        let ink = |name: &str| {
            let png = Figure::new("", 85.0, 60.0).with(panel(name)).png(144.0).unwrap();
            Pixmap::decode_png(&png).unwrap().pixels().iter().filter(|p| p.red() < 100).count()
        };
        assert!(ink("*b*_1 Ωσ² [N m^{-1}]") > ink("") + 100);
    }

    #[test]
    fn both_files_are_saved_and_a_missing_folder_is_an_error() {
        let folder = std::env::temp_dir().join(format!("linkwright-figure-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        everything().save(&folder, "all").unwrap();
        assert!(std::fs::read(folder.join("all.png")).unwrap().starts_with(b"\x89PNG"));
        assert!(std::fs::read_to_string(folder.join("all.svg")).unwrap().starts_with("<svg"));
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(matches!(everything().save(&folder, "all"), Err(Error::File { .. })));
    }

    #[test]
    fn extreme_numbers_are_drawn_or_left_out() {
        let line = Stroke::solid(Colour::BLACK, 1.0);
        let ends = [f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, 0.0, 1e16, 1e16 + 2.0, f64::INFINITY, f64::NAN];
        for (a, b) in ends.iter().flat_map(|a| ends.iter().map(move |b| (*a, *b))) {
            for logarithmic in [false, true] {
                let axis = |name: &str| {
                    if logarithmic { PlotAxis::new(name, "").logarithmic() } else { PlotAxis::new(name, "") }
                };
                let mut panel = Panel::new(axis("x"), axis("y"));
                panel.add(Mark::curve([[a, b], [b, a], [a, a]], line).named("extreme")).add(Mark::note([a, b], "here"));
                panel.add(Mark::hatching(vec![vec![[a, b], [b, a]]], line, 4.0));
                let svg = Figure::new("", 85.0, 60.0).with(panel).svg().unwrap();
                usvg::roxmltree::Document::parse(&svg).unwrap();
                assert!(svg.len() < 100_000 && !svg.contains("NaN\"") && !svg.contains("inf\""), "{a} {b}: {svg}");
            }
        }
    }

    #[test]
    fn impossible_figures_are_refused() {
        let panel = || Panel::new(PlotAxis::new("x", ""), PlotAxis::new("y", ""));
        assert!(Figure::new("no panel", 85.0, 60.0).svg().is_err());
        assert!(Figure::new("too small", 1.0, f64::NAN).with(panel()).svg().is_err());
        assert!(Figure::new("too fine", 85.0, 60.0).with(panel()).png(1e9).is_err());
        for limits in [[1.0, 1.0], [f64::NAN, 2.0], [2.0, 1.0], [0.0, f64::INFINITY]] {
            let x = PlotAxis::new("x", "").limits(limits[0], limits[1]);
            assert!(Figure::new("limits", 85.0, 60.0).with(Panel::new(x, PlotAxis::new("y", ""))).svg().is_err());
        }
        let zero = Panel::new(PlotAxis::new("x", "").logarithmic().limits(0.0, 1.0), PlotAxis::new("y", ""));
        assert!(Figure::new("zero on a logarithmic scale", 85.0, 60.0).with(zero).svg().is_err());
        assert!(Figure::new("empty axes are fine", 85.0, 60.0).with(panel()).svg().is_ok());
    }
}
