//! The legend: a sample and a name for every named mark.

use super::mark::{Anchor, Kind, Stroke};
use super::svg::{Area, Lettering, Svg};
use super::view::View;
use super::{Colour, Mark, Panel, draw, markup, style};

const SIZE: f64 = style::TICK_SIZE;

/// Marks of one name stand in one line: a curve with its points.
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

fn entry_width(panel: &Panel) -> f64 {
    let widest = entries(panel).iter().map(|(name, _)| markup::width(name, SIZE)).fold(0.0, f64::max);
    style::LEGEND_SAMPLE + 4.0 + widest
}

fn columns_below(panel: &Panel, width: f64) -> usize {
    ((width / (entry_width(panel) + 8.0)) as usize).clamp(1, entries(panel).len().max(1))
}

/// The height of the legend under a frame of the given width.
pub(crate) fn height_below(panel: &Panel, width: f64) -> f64 {
    entries(panel).len().div_ceil(columns_below(panel, width)) as f64 * style::LEGEND_LINE
}

pub(crate) fn below(svg: &mut Svg, panel: &Panel, area: Area, outer: Area) {
    let columns = columns_below(panel, area.width);
    let top = outer.bottom() - height_below(panel, area.width) - 2.0;
    let width = (area.width / columns as f64).min(entry_width(panel) + 14.0);
    let left = area.left + (area.width - width * columns as f64) / 2.0;
    for (k, (name, marks)) in entries(panel).into_iter().enumerate() {
        let at = [left + width * (k % columns) as f64, top + style::LEGEND_LINE * (k / columns) as f64];
        entry(svg, at, name, &marks);
    }
}

/// In the corner where it covers the fewest points of the curves.
pub(crate) fn inside(svg: &mut Svg, panel: &Panel, view: &View) {
    let entries = entries(panel);
    let (width, height) = (entry_width(panel) + 7.0, style::LEGEND_LINE * entries.len() as f64 + 4.0);
    let busy = busy_points(panel, view);
    let area = view.area;
    let (near, far) = (5.0, 5.0);
    let corners = [
        [area.right() - width - near, area.top + far],
        [area.left + near, area.top + far],
        [area.right() - width - near, area.bottom() - height - far],
        [area.left + near, area.bottom() - height - far],
    ];
    let boxes = corners.map(|[left, top]| Area { left, top, width, height });
    let covered = |b: &Area| busy.iter().filter(|&&p| b.contains(p)).count();
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
        Kind::Curves { stroke, .. } => svg.polyline(&[[left, y], [right, y]], *stroke),
        Kind::Hatching { stroke, .. } => {
            let feet = (1..6).map(|k| left + 3.0 * f64::from(k));
            let strokes: Vec<_> = feet.map(|x| [[x, y], [x + 2.6, y - 2.6]]).collect();
            svg.polylines(&strokes, *stroke);
        }
        Kind::Points { marker, colour, size, .. } => draw::draw_marker(svg, [middle, y], *marker, *colour, *size),
        Kind::Region { colour, opacity, .. } => {
            let (t, b) = (y - 2.8, y + 2.8);
            svg.polygon(&[[left, t], [right, t], [right, b], [left, b]], *colour, *opacity, None);
        }
        _ => {}
    }
}

/// Points all along what is drawn, about three points apart on paper.
fn busy_points(panel: &Panel, view: &View) -> Vec<[f64; 2]> {
    let mut busy = Vec::new();
    for mark in &panel.marks {
        match &mark.kind {
            Kind::Curves { curves, .. } => {
                for piece in curves.iter().flat_map(|curve| view.place_curve(curve)) {
                    busy.extend(super::place::along(&piece, 3.0).into_iter().map(|(at, _)| at));
                }
            }
            // A marker or a text must not be hidden: it weighs as much as a long line.
            Kind::Points { at, .. } => {
                busy.extend(at.iter().filter_map(|&p| view.place(p)).flat_map(|p| std::iter::repeat_n(p, 12)));
            }
            Kind::Text { at, .. } | Kind::Symbol { at, .. } => {
                busy.extend(view.place(*at).into_iter().flat_map(|p| std::iter::repeat_n(p, 12)));
            }
            _ => {}
        }
    }
    busy
}
