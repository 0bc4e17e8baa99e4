//! Legends: a sample and a name for every named mark.

use super::colour::Colour;
use super::mark::{Anchor, Mark, MarkKind, Stroke};
use super::panel::Panel;
use super::svg::{Area, Lettering, Svg};
use super::view::View;
use super::{label_placement, markup, shapes, style};

const SIZE: f64 = style::TICK_SIZE;

/// Names with their marks; marks of the same name, such as a curve and its points, share an entry.
fn entries(panel: &Panel) -> Vec<(&str, Vec<&Mark>)> {
    let mut entries: Vec<(&str, Vec<&Mark>)> = Vec::new();
    for mark in &panel.marks {
        let Some(name) = mark.name.as_deref() else { continue };
        match entries.iter_mut().find(|entry| entry.0 == name) {
            Some(entry) => entry.1.push(mark),
            None => entries.push((name, vec![mark])),
        }
    }
    entries
}

fn entry_width(name: &str) -> f64 {
    style::LEGEND_SAMPLE + 4.0 + markup::width(name, SIZE)
}

const BETWEEN_COLUMNS: f64 = 9.0;
const EDGE: f64 = 4.0;

/// Widths of the columns, as many as fit; entries are ordered row by row.
fn columns_below(panel: &Panel, width: f64) -> Vec<f64> {
    let widths: Vec<f64> = entries(panel).iter().map(|(name, _)| entry_width(name)).collect();
    let columns = |count: usize| -> Vec<f64> {
        (0..count).map(|c| widths.iter().skip(c).step_by(count).copied().fold(0.0, f64::max)).collect()
    };
    let fits = |columns: &Vec<f64>| {
        columns.iter().map(|w| w + BETWEEN_COLUMNS).sum::<f64>() - BETWEEN_COLUMNS <= width - 2.0 * EDGE
    };
    (1..=widths.len().min(4)).rev().map(columns).find(fits).unwrap_or_else(|| columns(1))
}

/// The height of the legend under a panel of the given outer width.
pub(crate) fn height_below(panel: &Panel, width: f64) -> f64 {
    entries(panel).len().div_ceil(columns_below(panel, width).len()) as f64 * style::LEGEND_LINE
}

/// Draws the legend under the panel.
pub(crate) fn below(svg: &mut Svg, panel: &Panel, area: Area, outer: Area) {
    let columns = columns_below(panel, outer.width);
    let top = outer.bottom() - height_below(panel, outer.width) - 2.0;
    let total = columns.iter().map(|w| w + BETWEEN_COLUMNS).sum::<f64>() - BETWEEN_COLUMNS;
    // Centred under the frame, but not beyond the edge of the paper.
    let middle = area.left + area.width / 2.0;
    let left = (middle - total / 2.0).min(outer.right() - EDGE - total).max(outer.left + EDGE);
    for (k, (name, marks)) in entries(panel).into_iter().enumerate() {
        let (row, column) = (k / columns.len(), k % columns.len());
        let x = left + columns[..column].iter().map(|w| w + BETWEEN_COLUMNS).sum::<f64>();
        entry(svg, [x, top + style::LEGEND_LINE * row as f64], name, &marks);
    }
}

/// Draws the legend in the corner where it covers the fewest marks.
pub(crate) fn inside(svg: &mut Svg, panel: &Panel, view: &View) {
    let entries = entries(panel);
    let widest = entries.iter().map(|(name, _)| entry_width(name)).fold(0.0, f64::max);
    let (width, height) = (widest + 7.0, style::LEGEND_LINE * entries.len() as f64 + 4.0);
    let ink = label_placement::ink(panel, view);
    let area = view.area;
    let (near, far) = (5.0, 5.0);
    let corners = [
        [area.right() - width - near, area.top + far],
        [area.left + near, area.top + far],
        [area.right() - width - near, area.bottom() - height - far],
        [area.left + near, area.bottom() - height - far],
    ];
    let boxes = corners.map(|[left, top]| Area { left, top, width, height });
    let covered = |b: &Area| ink.iter().filter(|&&p| b.contains(p)).count();
    let Some(place) = boxes.iter().min_by_key(|b| covered(b)) else { return };
    let (l, r, t, b) = (place.left, place.right(), place.top, place.bottom());
    let line = Stroke::solid(Colour::GREY, 0.4);
    svg.polygon(&[[l, t], [r, t], [r, b], [l, b]], Colour::WHITE, 0.92, Some(line));
    for (k, (name, marks)) in entries.into_iter().enumerate() {
        entry(svg, [l + 3.5, t + 2.0 + style::LEGEND_LINE * k as f64], name, &marks);
    }
}

fn entry(svg: &mut Svg, [left, top]: [f64; 2], name: &str, marks: &[&Mark]) {
    let middle = top + style::LEGEND_LINE / 2.0;
    marks.iter().for_each(|mark| sample(svg, mark, left, middle));
    let at = [left + style::LEGEND_SAMPLE + 4.0, middle + 0.36 * SIZE];
    svg.text(at, name, Lettering::new(SIZE, Anchor::Start));
}

fn sample(svg: &mut Svg, mark: &Mark, left: f64, y: f64) {
    let right = left + style::LEGEND_SAMPLE;
    let middle = (left + right) / 2.0;
    match &mark.kind {
        MarkKind::Curves { stroke, .. } => svg.polyline(&[[left, y], [right, y]], *stroke),
        MarkKind::Hatching { stroke, .. } => {
            let feet = (1..6).map(|k| left + 3.0 * f64::from(k));
            let strokes: Vec<_> = feet.map(|x| [[x, y], [x + 2.6, y - 2.6]]).collect();
            svg.polylines(&strokes, *stroke);
        }
        MarkKind::Points { marker, colour, size, .. } => shapes::marker(svg, [middle, y], *marker, *colour, *size),
        MarkKind::Region { colour, opacity, .. } => {
            let (t, b) = (y - 2.8, y + 2.8);
            svg.polygon(&[[left, t], [right, t], [right, b], [left, b]], *colour, *opacity, None);
        }
        _ => {}
    }
}
