//! Marks onto paper.

use super::mark::{Anchor, Kind, Marker, Stroke, Symbol};
use super::svg::{Area, Lettering, Svg};
use super::view::View;
use super::{Colour, ColourMap, Grid, Legend, Mark, Panel, frame, legend, markup, place, style};

/// A whole panel: what is cut at the frame, the frame, and what may touch it.
pub(crate) fn panel(svg: &mut Svg, panel: &Panel, area: Area, outer: Area) {
    let view = View::new(panel, area);
    svg.clipped(area, |svg| panel.marks.iter().for_each(|m| under_the_frame(svg, m, &view)));
    if panel.framed {
        frame::draw(svg, panel, &view, outer);
    }
    if !panel.title.is_empty() {
        let at = [area.left + area.width / 2.0, area.top - 4.0];
        svg.text(at, &panel.title, Lettering::new(style::LABEL_SIZE, Anchor::Middle));
    }
    let mut taken = place::taken(panel, &view);
    for mark in &panel.marks {
        over_the_frame(svg, mark, &view, &mut taken);
    }
    notes(svg, panel, &view, &taken);
    match panel.legend {
        _ if !panel.has_legend() => {}
        Legend::Absent => {}
        Legend::Inside => legend::inside(svg, panel, &view),
        Legend::Below => legend::below(svg, panel, area, outer),
    }
}

fn under_the_frame(svg: &mut Svg, mark: &Mark, view: &View) {
    match &mark.kind {
        Kind::Curves { curves, stroke } => {
            let pieces: Vec<_> = curves.iter().flat_map(|curve| view.place_curve(curve)).collect();
            svg.polylines(&pieces, *stroke);
        }
        Kind::Region { outline, colour, opacity } => {
            let points: Vec<_> = outline.iter().filter_map(|&p| view.place(p)).collect();
            svg.polygon(&points, *colour, *opacity, None);
        }
        Kind::Hatching { curves, stroke, length } => {
            for piece in curves.iter().flat_map(|curve| view.place_curve(curve)) {
                svg.polylines(&hatches(&piece, *length, 0.9 * length), *stroke);
            }
        }
        Kind::Field { grid, map, range } => field(svg, grid, *map, *range, view),
        _ => {}
    }
}

fn over_the_frame(svg: &mut Svg, mark: &Mark, view: &View, taken: &mut Vec<[f64; 2]>) {
    match &mark.kind {
        Kind::Points { at, marker, colour, size } => {
            for place in at.iter().filter_map(|&p| view.place(p)).filter(|&p| view.area.contains(p)) {
                draw_marker(svg, place, *marker, *colour, *size);
            }
        }
        Kind::Text { at, text, anchor, offset, colour, size } => {
            if let Some([x, y]) = view.place(*at).filter(|&p| view.area.contains(p)) {
                let style = Lettering { colour: *colour, rim: true, ..Lettering::new(*size, *anchor) };
                svg.text([x + offset[0], y - offset[1] + 0.35 * size], text, style);
            }
        }
        Kind::ContourLabel { curves, text, colour } => place::contour_label(svg, curves, text, *colour, view, taken),
        Kind::Symbol { at, symbol } => {
            if let Some(place) = view.place(*at) {
                draw_symbol(svg, place, *symbol);
            }
        }
        _ => {}
    }
}

/// Notes go last: they avoid everything else, and one that would cover another is left out.
fn notes(svg: &mut Svg, panel: &Panel, view: &View, taken: &[[f64; 2]]) {
    let notes = panel.marks.iter().filter_map(|mark| match &mark.kind {
        Kind::Note { at, text } => view.place(*at).filter(|&p| view.area.contains(p)).map(|p| (p, text)),
        _ => None,
    });
    let mut busy: Option<Vec<[f64; 2]>> = None;
    let mut written: Vec<Area> = Vec::new();
    for (at, text) in notes {
        let busy =
            busy.get_or_insert_with(|| place::busy(panel, view).into_iter().chain(taken.iter().copied()).collect());
        let width = markup::width(text, style::TICK_SIZE);
        if let Some(spot) = place::beside(at, width, style::TICK_SIZE, busy, &written, view) {
            let style = Lettering { rim: true, ..Lettering::new(style::TICK_SIZE, Anchor::Start) };
            svg.text([spot.left, spot.bottom()], text, style);
            written.push(spot);
        }
    }
}

/// Strokes at 45° on the left of a curve, `spacing` points apart along it.
fn hatches(curve: &[[f64; 2]], length: f64, spacing: f64) -> Vec<[[f64; 2]; 2]> {
    let mut strokes = Vec::new();
    let mut ahead = 0.5 * spacing;
    for pair in curve.windows(2) {
        let [dx, dy] = [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]];
        let step = dx.hypot(dy);
        while ahead < step {
            let (part, reach) = (ahead / step, length / step * std::f64::consts::FRAC_1_SQRT_2);
            let foot = [pair[0][0] + part * dx, pair[0][1] + part * dy];
            // On paper y points down, so the left of (dx, dy) is (dy, −dx).
            strokes.push([foot, [foot[0] + reach * (dy + dx), foot[1] + reach * (dy - dx)]]);
            ahead += spacing;
        }
        ahead -= step;
    }
    strokes
}

pub(crate) fn draw_marker(svg: &mut Svg, [x, y]: [f64; 2], marker: Marker, colour: Colour, size: f64) {
    let r = size / 2.0;
    let line = Stroke::solid(colour, (0.16 * size).clamp(0.5, 1.0));
    let square = [[x - r, y - r], [x + r, y - r], [x + r, y + r], [x - r, y + r]];
    match marker {
        Marker::Circle => svg.circle([x, y], r, Colour::WHITE, Some(line)),
        Marker::Disc => svg.circle([x, y], r, colour, None),
        Marker::Square => svg.polygon(&square, Colour::WHITE, 1.0, Some(line)),
        Marker::Block => svg.polygon(&square, colour, 1.0, None),
        Marker::Diamond => {
            svg.polygon(&[[x - r, y], [x, y - r], [x + r, y], [x, y + r]], Colour::WHITE, 1.0, Some(line));
        }
        Marker::Down => {
            svg.polygon(&[[x - r, y - 0.6 * r], [x + r, y - 0.6 * r], [x, y + r]], Colour::WHITE, 1.0, Some(line));
        }
        Marker::Cross => svg.polylines(&[[square[0], square[2]], [square[1], square[3]]], line),
        Marker::Plus => svg.polylines(&[[[x - r, y], [x + r, y]], [[x, y - r], [x, y + r]]], line),
    }
}

fn draw_symbol(svg: &mut Svg, [x, y]: [f64; 2], symbol: Symbol) {
    let line = Stroke::solid(Colour::BLACK, 0.7);
    match symbol {
        Symbol::Joint => svg.circle([x, y], 2.2, Colour::WHITE, Some(line)),
        Symbol::GroundJoint => {
            let foot = y + 8.0;
            svg.polygon(&[[x, y], [x - 4.6, foot], [x + 4.6, foot]], Colour::WHITE, 1.0, Some(line));
            svg.polyline(&[[x - 7.5, foot], [x + 7.5, foot]], line);
            let strokes: Vec<_> =
                (0..6).map(|k| x - 5.5 + 2.5 * f64::from(k)).map(|x| [[x, foot], [x - 2.3, foot + 2.6]]).collect();
            svg.polylines(&strokes, Stroke::solid(Colour::BLACK, 0.5));
            svg.circle([x, y], 2.2, Colour::WHITE, Some(line));
        }
        Symbol::Slider(angle) => {
            let (s, c) = angle.sin_cos();
            let corner = |u: f64, v: f64| [x + u * c - v * s, y - u * s - v * c];
            svg.polygon(
                &[corner(-6.5, -3.8), corner(6.5, -3.8), corner(6.5, 3.8), corner(-6.5, 3.8)],
                Colour(235, 235, 235),
                1.0,
                Some(line),
            );
            svg.circle([x, y], 2.2, Colour::WHITE, Some(line));
        }
    }
}

/// Cells of about a point, neighbours of one shade joined.
fn field(svg: &mut Svg, grid: &Grid, map: ColourMap, range: [f64; 2], view: &View) {
    const SHADES: f64 = 48.0;
    let ends = |axis: &[f64]| [axis[0], axis[axis.len() - 1]];
    let ([x0, x1], [y0, y1]) = (ends(grid.x()), ends(grid.y()));
    let (Some([left, bottom]), Some([right, top])) = (view.place([x0, y0]), view.place([x1, y1])) else { return };
    let columns = ((right - left) / 0.8).ceil().clamp(1.0, 600.0) as usize;
    let rows = ((bottom - top) / 1.4).ceil().clamp(1.0, 400.0) as usize;
    let shade = |i: usize, j: usize| {
        let part = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
        let value = grid.interpolate(x0 + (x1 - x0) * part(i, columns), y0 + (y1 - y0) * part(j, rows));
        let fraction = (value - range[0]) / (range[1] - range[0]);
        value.is_finite().then(|| (fraction.clamp(0.0, 1.0) * SHADES).round() as u32)
    };
    let (width, height) = ((right - left) / columns as f64, (bottom - top) / rows as f64);
    let mut cells: std::collections::BTreeMap<u32, Vec<Area>> = std::collections::BTreeMap::new();
    for j in 0..rows {
        let row: Vec<_> = (0..columns).map(|i| shade(i, j)).collect();
        let mut start = 0;
        for run in row.chunk_by(|a, b| a == b) {
            if let Some(shade) = run[0] {
                let (left, top) = (left + width * start as f64, bottom - height * (j + 1) as f64);
                cells.entry(shade).or_default().push(Area { left, top, width: width * run.len() as f64, height });
            }
            start += run.len();
        }
    }
    for (shade, cells) in cells {
        svg.cells(&cells, map.at(f64::from(shade) / SHADES));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hatches_lean_to_the_left_and_keep_their_distance() {
        let strokes = hatches(&[[0.0, 0.0], [7.0, 0.0], [20.0, 0.0]], 2.0, 4.0);
        assert_eq!(strokes.len(), 5);
        assert!(strokes.windows(2).all(|p| (p[1][0][0] - p[0][0][0] - 4.0).abs() < 1e-12));
        // Walking to the right, the left is up, and up on paper is negative.
        assert!(strokes.iter().all(|s| (s[1][1] + 2f64.sqrt()).abs() < 1e-12));
    }
}
