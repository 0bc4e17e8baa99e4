//! Placement of notes and contour labels.

use super::colour::Colour;
use super::mark::{Anchor, MarkKind};
use super::panel::Panel;
use super::svg::{Area, Lettering, Svg};
use super::view::View;
use super::{markup, style};

/// Points on paper that a label should not cover: markers, texts, symbols, hatched bounds.
pub(crate) fn obstacles(panel: &Panel, view: &View) -> Vec<[f64; 2]> {
    let mut obstacles = Vec::new();
    for mark in &panel.marks {
        match &mark.kind {
            MarkKind::Points { at, .. } => obstacles.extend(at.iter().filter_map(|&p| view.position(p))),
            MarkKind::Hatching { curves, .. } => {
                let pieces = curves.iter().flat_map(|curve| view.curve(curve));
                obstacles.extend(pieces.flat_map(|piece| along(&piece, 4.0)).map(|(at, _)| at));
            }
            MarkKind::Text { at, .. } | MarkKind::Symbol { at, .. } => obstacles.extend(view.position(*at)),
            _ => {}
        }
    }
    obstacles
}

/// Sample points on all marks: 1.5 points apart along curves, 20 for each marker and text.
pub(crate) fn ink(panel: &Panel, view: &View) -> Vec<[f64; 2]> {
    const WEIGHT: usize = 20;
    let mut ink = Vec::new();
    for mark in &panel.marks {
        match &mark.kind {
            MarkKind::Curves { curves, .. } | MarkKind::Hatching { curves, .. } => {
                for piece in curves.iter().flat_map(|curve| view.curve(curve)) {
                    ink.extend(along(&piece, 1.5).into_iter().map(|(at, _)| at));
                }
            }
            MarkKind::Points { at, .. } => {
                ink.extend(at.iter().filter_map(|&p| view.position(p)).flat_map(|p| std::iter::repeat_n(p, WEIGHT)));
            }
            MarkKind::Text { at, .. } | MarkKind::Symbol { at, .. } => {
                ink.extend(view.position(*at).into_iter().flat_map(|p| std::iter::repeat_n(p, WEIGHT)));
            }
            _ => {}
        }
    }
    ink
}

/// The area near `at` where a note of the given width covers the fewest marks; `None` if every position covers another note or leaves the
/// frame.
pub(crate) fn note_area(
    at: [f64; 2],
    width: f64,
    size: f64,
    ink: &[[f64; 2]],
    notes: &[Area],
    view: &View,
) -> Option<Area> {
    let height = 0.75 * size;
    let candidate = |k: usize| {
        let distance = if k < 16 { 4.0 } else { 8.0 };
        let (s, c) = (k as f64 * std::f64::consts::TAU / 16.0).sin_cos();
        let middle = [at[0] + c * (distance + width / 2.0), at[1] - s * (distance + height / 2.0)];
        Area { left: middle[0] - width / 2.0, top: middle[1] - height / 2.0, width, height }
    };
    let cost = |k: usize| {
        let rim = candidate(k).grown(2.5);
        let covered = ink.iter().filter(|&&p| rim.contains(p)).count();
        3 * covered + usize::from(k >= 16)
    };
    let is_free = |k: usize| {
        let rim = candidate(k).grown(1.0);
        let is_inside = view.area.contains([rim.left, rim.top]) && view.area.contains([rim.right(), rim.bottom()]);
        is_inside && !notes.iter().any(|note| note.overlaps(rim))
    };
    // The upper right comes first, as on a map.
    let order = (0..32).map(|k| (k & 16) | ((k + 2) & 15));
    order.filter(|&k| is_free(k)).min_by_key(|&k| cost(k)).map(candidate)
}

/// Points on a polyline, `step` points apart on paper, with the directions there.
pub(crate) fn along(curve: &[[f64; 2]], step: f64) -> Vec<([f64; 2], [f64; 2])> {
    let mut points = Vec::new();
    let mut ahead = 0.0;
    for pair in curve.windows(2) {
        let d = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let length = d[0].hypot(d[1]);
        while ahead < length {
            let part = ahead / length;
            points.push(([pair[0][0] + part * d[0], pair[0][1] + part * d[1]], [d[0] / length, d[1] / length]));
            ahead += step;
        }
        ahead -= length;
    }
    points
}

/// Draws a contour label far from all obstacles and from the frame, where the curve is straight.
pub(crate) fn contour_label(
    svg: &mut Svg,
    curves: &[Vec<[f64; 2]>],
    text: &str,
    colour: Colour,
    view: &View,
    obstacles: &mut Vec<[f64; 2]>,
) {
    const STEP: f64 = 2.0;
    let size = style::CONTOUR_SIZE;
    let width = markup::width(text, size);
    let half = (0.5 * width / STEP).ceil() as usize + 1;
    let mut best: Option<(f64, [f64; 2], [f64; 2])> = None;
    for piece in curves.iter().flat_map(|curve| view.curve(curve)) {
        let points = along(&piece, STEP);
        for k in half..points.len().saturating_sub(half) {
            let (from, at, to) = (points[k - half].0, points[k].0, points[k + half].0);
            let chord = distance(from, to) / (2.0 * half as f64 * STEP);
            let edge = [from, to].iter().map(|p| inset(view, *p)).fold(f64::INFINITY, f64::min);
            if edge < 3.0 || chord < 0.93 {
                continue;
            }
            let free = obstacles.iter().map(|&p| distance(p, at)).fold(45.0, f64::min);
            let score = free + 0.3 * edge.min(30.0) + 200.0 * chord;
            if best.is_none_or(|b| score > b.0) {
                best = Some((score, at, [to[0] - from[0], to[1] - from[1]]));
            }
        }
    }
    let Some((_, at, along)) = best else { return };
    obstacles.push(at);
    let angle = along[1].atan2(along[0]).to_degrees();
    let upright = if angle.abs() > 90.0 { angle - 180.0 * angle.signum() } else { angle };
    let (s, c) = upright.to_radians().sin_cos();
    let down = 0.36 * size;
    let style = Lettering { colour, turned: upright, rim: true, ..Lettering::new(size, Anchor::Middle) };
    svg.text([at[0] - down * s, at[1] + down * c], text, style);
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Distance of a point from the frame, positive inside.
fn inset(view: &View, [x, y]: [f64; 2]) -> f64 {
    let a = view.area;
    (x - a.left).min(a.right() - x).min(y - a.top).min(a.bottom() - y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figure::{Panel, PlotAxis};

    #[test]
    fn notes_stay_inside_the_frame_and_off_each_other() {
        let panel = Panel::new(PlotAxis::new("x", "").limits(0.0, 1.0), PlotAxis::new("y", "").limits(0.0, 1.0));
        let frame = Area { left: 10.0, top: 10.0, width: 100.0, height: 100.0 };
        let view = View::new(&panel, frame);
        for corner in [[10.0, 10.0], [110.0, 10.0], [10.0, 110.0], [110.0, 110.0], [60.0, 11.0]] {
            let mut notes: Vec<Area> = vec![];
            while let Some(note) = note_area(corner, 14.0, 7.0, &[], &notes, &view) {
                assert!(frame.contains([note.left, note.top]) && frame.contains([note.right(), note.bottom()]));
                assert!(!notes.iter().any(|other| other.overlaps(note)));
                notes.push(note);
            }
            assert!(!notes.is_empty(), "{corner:?}");
        }
    }
}
