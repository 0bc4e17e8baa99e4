//! The plotted numbers of a panel for the script of a page, which reads values at the pointer and saves them.

use super::axis::{PlotAxis, Scale};
use super::mark::{Mark, MarkKind};
use super::markup;
use super::panel::Panel;
use super::svg::Area;
use super::view::View;
use serde::Serialize;

/// Largest size in bytes of the numbers of a figure in a page.
pub(super) const LARGEST_SERIES: usize = 60_000;

/// The numbers of a panel, in five digits.
#[derive(Serialize)]
pub(super) struct PanelSeries {
    /// Left, top, width and height in points.
    frame: [f64; 4],
    /// Limits of the axes.
    x: [f64; 2],
    y: [f64; 2],
    /// Which scales are logarithmic.
    log: [bool; 2],
    /// Labels of the axes.
    label: [String; 2],
    /// True if both axes are independent: the nearest mark is read, not the values at an abscissa.
    plane: bool,
    series: Vec<PlottedSeries>,
}

#[derive(Serialize)]
struct PlottedSeries {
    name: String,
    kind: SeriesKind,
    points: Vec<[f64; 2]>,
}

/// Connection of the points of a series.
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
enum SeriesKind {
    /// A function of the abscissa: a line through points from left to right.
    Function,
    /// Any other line.
    Line,
    /// Single points.
    Points,
}

impl PanelSeries {
    /// The curves and points that have a name or a description; the longest curve if there is none. `None` without any.
    pub fn new(panel: &Panel, area: Area) -> Option<Self> {
        let view = View::new(panel, area);
        // The numbers are in the unit itself, without the power of ten of the ticks.
        let label = [&panel.x, &panel.y].map(|axis: &PlotAxis| markup::plain(&axis.quantity.label(0)));
        let named = |mark: &Mark| mark.description.clone().or_else(|| mark.name.as_deref().map(markup::plain));
        let mut series: Vec<PlottedSeries> =
            panel.marks.iter().filter_map(|mark| Some(PlottedSeries::of(mark, &named(mark)?))).flatten().collect();
        let has_lines = |all: &[PlottedSeries]| all.iter().any(|one| one.kind != SeriesKind::Points);
        if !has_lines(&series) {
            let unnamed = panel.marks.iter().filter(|mark| named(mark).is_none());
            let unnamed: Vec<PlottedSeries> = unnamed.flat_map(|mark| PlottedSeries::of(mark, &label[1])).collect();
            let lines = || unnamed.iter().filter(|one| one.kind == SeriesKind::Function);
            let longest = lines().map(|one| one.points.len()).max().unwrap_or(0);
            // Shorter ones are limits.
            let longest = unnamed.into_iter().filter(|s| s.kind == SeriesKind::Function && s.points.len() == longest);
            series.splice(0..0, longest);
        }
        // The markers of a line repeat its points.
        let lines: Vec<(String, Vec<[f64; 2]>)> = series
            .iter()
            .filter(|one| one.kind != SeriesKind::Points)
            .map(|one| (one.name.clone(), one.points.clone()))
            .collect();
        let repeats =
            |one: &PlottedSeries| lines.iter().any(|(name, points)| *name == one.name && *points == one.points);
        series.retain(|one| one.kind != SeriesKind::Points || !repeats(one));
        (!series.is_empty()).then(|| Self {
            frame: [area.left, area.top, area.width, area.height].map(|v| (100.0 * v).round() / 100.0),
            x: view.x,
            y: view.y,
            log: [&panel.x, &panel.y].map(|axis| axis.scale == Scale::Logarithmic),
            label,
            plane: panel.plane,
            series,
        })
    }
}

impl PlottedSeries {
    /// The pieces of a curve, or the points of a mark; none of other marks.
    fn of(mark: &Mark, name: &str) -> Vec<Self> {
        let digits = |v: f64| format!("{v:.4e}").parse::<f64>().unwrap_or(v);
        let finite = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
            points.iter().filter(|p| p.iter().all(|v| v.is_finite())).map(|p| p.map(digits)).collect()
        };
        match &mark.kind {
            MarkKind::Curves { curves, .. } => {
                let pieces: Vec<_> = curves.iter().map(|curve| finite(curve)).filter(|p| p.len() > 1).collect();
                let count = pieces.len();
                let piece = |(k, points): (usize, Vec<[f64; 2]>)| Self {
                    name: if count > 1 { format!("{name}, part {}", k + 1) } else { name.to_owned() },
                    kind: if is_function(&points) { SeriesKind::Function } else { SeriesKind::Line },
                    points,
                };
                pieces.into_iter().enumerate().map(piece).collect()
            }
            MarkKind::Points { at, .. } if !at.is_empty() => {
                vec![Self { name: name.to_owned(), kind: SeriesKind::Points, points: finite(at) }]
            }
            _ => vec![],
        }
    }
}

/// True if a line goes from left to right.
fn is_function(points: &[[f64; 2]]) -> bool {
    points.windows(2).all(|pair| pair[0][0] <= pair[1][0]) && points[0][0] < points[points.len() - 1][0]
}

#[cfg(test)]
mod tests {
    use super::super::{Colour, Figure, MarkerShape, Stroke};
    use super::*;
    use serde_json::Value;

    fn series(panel: Panel) -> Value {
        let text = Figure::new("", 85.0, 60.0).with(panel).series().unwrap();
        serde_json::from_str::<Value>(&text).unwrap()[0].clone()
    }

    /// Points, pieces of contours and boxes are told apart; markers of a line are not repeated; what has no name is left out.
    #[test]
    fn every_named_mark_is_in_the_numbers_of_a_page() {
        let line = || Stroke::solid(Colour::BLACK, 1.0);
        let mut panel = Panel::new(PlotAxis::new("x", "m"), PlotAxis::new("y", "m")).plane();
        let contour = |c: f64| vec![vec![[0.0, c], [0.5, 0.0], [0.2, c]], vec![[1.0, c], [1.0, 0.0]]];
        panel.add(Mark::curves(contour(1.0), line()).named("torque").described("torque = 1"));
        panel.add(Mark::curve([[0.0, 0.0], [1.0, 1.0]], line()));
        panel.add(Mark::curve([[0.1, 0.2], [0.4, 0.3]], line()).named("cycles"));
        panel.add(Mark::points([[0.1, 0.2], [0.4, 0.3]], MarkerShape::Disc, Colour::BLUE, 3.0).named("cycles"));
        panel.add(Mark::points([[0.7, 0.2]], MarkerShape::Disc, Colour::BLUE, 3.0).named("last cycle"));
        let found = series(panel);
        assert_eq!(found["plane"], true);
        let all: Vec<String> =
            found["series"].as_array().unwrap().iter().map(|s| format!("{} {}", s["name"], s["kind"])).collect();
        let expected = [
            "\"torque = 1, part 1\" \"line\"",
            "\"torque = 1, part 2\" \"line\"",
            "\"cycles\" \"function\"",
            "\"last cycle\" \"points\"",
        ];
        assert_eq!(all, expected);
    }

    /// A curve without a name has that of the vertical axis; shorter ones are limits.
    #[test]
    fn the_longest_curve_counts_if_none_has_a_name() {
        let mut panel = Panel::new(PlotAxis::new("cycle", ""), PlotAxis::new("link", "m"));
        panel.add(Mark::curve([[0.0, 0.4], [2.0, 0.4]], Stroke::solid(Colour::BLACK, 1.0)));
        panel.add(Mark::curve([[0.0, 0.2], [1.0, 0.3], [2.0, 0.4]], Stroke::solid(Colour::BLUE, 1.0)));
        panel.add(Mark::points([[1.0, 0.5]], MarkerShape::Cross, Colour::BLUE, 3.0).described("rejected step"));
        let found = series(panel);
        let all = found["series"].as_array().unwrap();
        assert_eq!((all.len(), &all[0]["name"], &all[1]["name"]), (2, &"link [m]".into(), &"rejected step".into()));
        assert_eq!(all[0]["points"].as_array().unwrap().len(), 3);
    }
}
