//! Drawing of a panel: marks, frame, legend.

use super::colour::ColourMap;
use super::grid::Grid;
use super::mark::{Anchor, Mark, MarkKind};
use super::panel::{Legend, Panel};
use super::svg::{Area, Lettering, Svg};
use super::view::View;
use super::{frame, label_placement, legend, markup, shapes, style};

/// Numbers of markers from which those at nearly the same place are drawn once, and the fineness of these places.
const FEW_MARKERS: usize = 300;
const MARKERS_PER_POINT: f64 = 1.0;

/// Draws a panel: marks that are clipped at the frame, the frame, and marks over the frame.
pub(crate) fn panel(svg: &mut Svg, panel: &Panel, area: Area, outer: Area) {
    let view = View::new(panel, area);
    svg.clipped(area, |svg| panel.marks.iter().for_each(|m| draw_below_frame(svg, m, &view)));
    if panel.framed {
        frame::draw(svg, panel, &view, outer);
    }
    if !panel.title.is_empty() {
        let at = [area.left + area.width / 2.0, area.top - 4.0];
        svg.text(at, &panel.title, Lettering::new(style::LABEL_SIZE, Anchor::Middle));
    }
    let mut obstacles = label_placement::obstacles(panel, &view);
    for mark in &panel.marks {
        draw_above_frame(svg, mark, &view, &mut obstacles);
    }
    notes(svg, panel, &view, &obstacles);
    match panel.legend {
        _ if !panel.has_legend() => {}
        Legend::Absent => {}
        Legend::Inside => legend::inside(svg, panel, &view),
        Legend::Below => legend::below(svg, panel, area, outer),
    }
}

fn draw_below_frame(svg: &mut Svg, mark: &Mark, view: &View) {
    match &mark.kind {
        MarkKind::Curves { curves, stroke } => {
            let pieces: Vec<_> = curves.iter().flat_map(|curve| view.curve(curve)).collect();
            svg.polylines(&pieces, *stroke);
        }
        MarkKind::Region { outline, colour, opacity } => {
            let points: Vec<_> = outline.iter().filter_map(|&p| view.position(p)).collect();
            svg.polygon(&points, *colour, *opacity, None);
        }
        MarkKind::Hatching { curves, stroke, length } => {
            for piece in curves.iter().flat_map(|curve| view.curve(curve)) {
                svg.polylines(&shapes::hatches(&piece, *length, 0.9 * length), *stroke);
            }
        }
        MarkKind::Field { grid, map, range } => field(svg, grid, *map, *range, view),
        _ => {}
    }
}

fn draw_above_frame(svg: &mut Svg, mark: &Mark, view: &View, obstacles: &mut Vec<[f64; 2]>) {
    match &mark.kind {
        MarkKind::Points { at, marker, colour, size } => {
            // Of many markers at one place only one would be visible.
            let mut places = std::collections::HashSet::new();
            let cell = |p: &[f64; 2]| p.map(|v| (MARKERS_PER_POINT * v).round() as i32);
            let inside = at.iter().filter_map(|&p| view.position(p)).filter(|&p| view.area.contains(p));
            for position in inside.filter(|p| at.len() <= FEW_MARKERS || places.insert(cell(p))) {
                shapes::marker(svg, position, *marker, *colour, *size);
            }
        }
        MarkKind::Text { at, text, anchor, offset, colour, size } => {
            if let Some([x, y]) = view.position(*at).filter(|&p| view.area.contains(p)) {
                let style = Lettering { colour: *colour, rim: true, ..Lettering::new(*size, *anchor) };
                svg.text([x + offset[0], y - offset[1] + 0.35 * size], text, style);
            }
        }
        MarkKind::ContourLabel { curves, text, colour } => {
            label_placement::contour_label(svg, curves, text, *colour, view, obstacles)
        }
        MarkKind::Symbol { at, symbol } => {
            if let Some(at) = view.position(*at) {
                shapes::symbol(svg, at, *symbol);
            }
        }
        _ => {}
    }
}

/// Draws the notes last, where they cover the fewest marks; omits a note that would cover another one.
fn notes(svg: &mut Svg, panel: &Panel, view: &View, obstacles: &[[f64; 2]]) {
    let notes = panel.marks.iter().filter_map(|mark| match &mark.kind {
        MarkKind::Note { at, text } => view.position(*at).filter(|&p| view.area.contains(p)).map(|p| (p, text)),
        _ => None,
    });
    let mut ink: Option<Vec<[f64; 2]>> = None;
    let mut written: Vec<Area> = Vec::new();
    for (at, text) in notes {
        let ink = ink.get_or_insert_with(|| {
            label_placement::ink(panel, view).into_iter().chain(obstacles.iter().copied()).collect()
        });
        let width = markup::width(text, style::TICK_SIZE);
        if let Some(area) = label_placement::note_area(at, width, style::TICK_SIZE, ink, &written, view) {
            let style = Lettering { rim: true, ..Lettering::new(style::TICK_SIZE, Anchor::Start) };
            svg.text([area.left, area.bottom()], text, style);
            written.push(area);
        }
    }
}

/// Draws a field as cells of about one point; neighbouring cells of one shade are joined.
fn field(svg: &mut Svg, grid: &Grid, map: ColourMap, range: [f64; 2], view: &View) {
    const SHADES: f64 = 48.0;
    let [[x0, y0], [x1, y1]] = grid.corners();
    let (Some([left, bottom]), Some([right, top])) = (view.position([x0, y0]), view.position([x1, y1])) else { return };
    let columns = ((right - left) / 0.8).ceil().clamp(1.0, 600.0) as usize;
    let rows = ((bottom - top) / 1.4).ceil().clamp(1.0, 400.0) as usize;
    let shade = |i: usize, j: usize| {
        let part = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
        let x = view.scales[0].between([x0, x1], part(i, columns));
        let y = view.scales[1].between([y0, y1], part(j, rows));
        let value = grid.interpolate(x, y);
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
