//! The frame of a panel with ticks, numbers and labels, and the colour bar.

use super::colour::Colour;
use super::mark::{Anchor, Stroke};
use super::panel::{ColourBar, Panel};
use super::svg::{Area, Lettering, Svg};
use super::ticks::Ticks;
use super::view::View;
use super::{markup, style};

/// Draws frame, ticks, numbers and labels.
pub(crate) fn draw(svg: &mut Svg, panel: &Panel, view: &View, outer: Area) {
    let area = view.area;
    let line = Stroke::solid(Colour::BLACK, style::FRAME_WIDTH);
    let mut lines = vec![vec![
        [area.left, area.top],
        [area.right(), area.top],
        [area.right(), area.bottom()],
        [area.left, area.bottom()],
        [area.left, area.top - style::FRAME_WIDTH / 2.0],
    ]];
    let x_major: Vec<f64> = view.x_ticks.major.iter().map(|tick| tick.0).collect();
    let y_major: Vec<f64> = view.y_ticks.major.iter().map(|tick| tick.0).collect();
    let middle = [view.x[0], view.y[0]];
    for (values, length) in [(&view.x_ticks.minor, style::MINOR_LENGTH), (&x_major, style::TICK_LENGTH)] {
        for [x, _] in values.iter().filter_map(|&v| view.position([v, middle[1]])).filter(|&p| view.area.contains(p)) {
            lines.push(vec![[x, area.bottom()], [x, area.bottom() - length]]);
            lines.push(vec![[x, area.top], [x, area.top + length]]);
        }
    }
    for (values, length) in [(&view.y_ticks.minor, style::MINOR_LENGTH), (&y_major, style::TICK_LENGTH)] {
        for [_, y] in values.iter().filter_map(|&v| view.position([middle[0], v])).filter(|&p| view.area.contains(p)) {
            lines.push(vec![[area.left, y], [area.left + length, y]]);
            lines.push(vec![[area.right(), y], [area.right() - length, y]]);
        }
    }
    svg.polylines(&lines, line);
    if panel.x.labelled {
        numbers_below(svg, panel, view, outer);
    }
    if panel.y.labelled {
        numbers_on_the_left(svg, panel, view, outer);
    }
}

fn numbers_below(svg: &mut Svg, panel: &Panel, view: &View, outer: Area) {
    let area = view.area;
    let baseline = area.bottom() + style::GAP + 0.78 * style::TICK_SIZE;
    for (value, text) in &view.x_ticks.major {
        if let Some([x, _]) = view.position([*value, view.y[0]]) {
            svg.text([x, baseline], text, Lettering::new(style::TICK_SIZE, Anchor::Middle));
        }
    }
    let at = [area.left + area.width / 2.0, baseline + 2.5 + style::LABEL_SIZE];
    let label = panel.x.label(&view.x_ticks);
    let size = fitting_size(&label, 2.0 * (at[0] - outer.left).min(outer.right() - at[0]));
    svg.text(at, &label, Lettering::new(size, Anchor::Middle));
}

/// The size of labels, or that in which a long label is not cut at the ends of its panel.
fn fitting_size(label: &str, length: f64) -> f64 {
    let needed = markup::width(label, style::LABEL_SIZE);
    style::LABEL_SIZE * (length / needed.max(1.0)).clamp(SMALLEST, 1.0)
}

/// The least size of a label relative to the usual one.
const SMALLEST: f64 = 0.4;

fn numbers_on_the_left(svg: &mut Svg, panel: &Panel, view: &View, outer: Area) {
    let area = view.area;
    for (value, text) in &view.y_ticks.major {
        if let Some([_, y]) = view.position([view.x[0], *value]) {
            let at = [area.left - style::GAP, y + 0.36 * style::TICK_SIZE];
            svg.text(at, text, Lettering::new(style::TICK_SIZE, Anchor::End));
        }
    }
    let at = [outer.left + style::LABEL_SIZE + 0.5, area.top + area.height / 2.0];
    let label = panel.y.label(&view.y_ticks);
    let size = fitting_size(&label, 2.0 * (at[1] - outer.top).min(outer.bottom() - at[1]));
    svg.text(at, &label, Lettering { turned: -90.0, ..Lettering::new(size, Anchor::Middle) });
}

/// Width of the colour bar.
const BAR_WIDTH: f64 = 8.0;
/// Distance between the frames and the colour bar.
const BAR_DISTANCE: f64 = 8.0;

/// Width in points of the colour bar with its numbers and its label, on the right of the frames.
pub(crate) fn colour_bar_width(bar: &ColourBar) -> f64 {
    BAR_DISTANCE
        + BAR_WIDTH
        + style::GAP
        + bar_ticks(bar, 120.0).widest_label(style::TICK_SIZE)
        + 1.6 * style::LABEL_SIZE
}

/// Draws the colour bar on the right of `frames`.
pub(crate) fn colour_bar(svg: &mut Svg, bar: &ColourBar, frames: Area) {
    const STEPS: usize = 96;
    let area = Area { left: frames.right() + BAR_DISTANCE, width: BAR_WIDTH, ..frames };
    let step = area.height / STEPS as f64;
    for k in 0..STEPS {
        let cell = Area { top: area.bottom() - step * (k + 1) as f64, height: step, ..area };
        svg.cells(&[cell], bar.map.at((k as f64 + 0.5) / STEPS as f64));
    }
    let line = Stroke::solid(Colour::BLACK, style::FRAME_WIDTH);
    let (l, r, t, b) = (area.left, area.right(), area.top, area.bottom());
    svg.polyline(&[[l, t], [r, t], [r, b], [l, b], [l, t]], line);
    let ticks = bar_ticks(bar, area.height);
    for (value, text) in &ticks.major {
        let y = b - area.height * (value - bar.range[0]) / (bar.range[1] - bar.range[0]);
        svg.polyline(&[[r, y], [r - 2.5, y]], line);
        let at = [r + style::GAP, y + 0.36 * style::TICK_SIZE];
        svg.text(at, text, Lettering::new(style::TICK_SIZE, Anchor::Start));
    }
    let at = [r + style::GAP + ticks.widest_label(style::TICK_SIZE) + 1.4 * style::LABEL_SIZE, t + area.height / 2.0];
    let label = Lettering { turned: -90.0, ..Lettering::new(style::LABEL_SIZE, Anchor::Middle) };
    svg.text(at, &bar.quantity.label(ticks.exponent), label);
}

fn bar_ticks(bar: &ColourBar, height: f64) -> Ticks {
    Ticks::linear(bar.range[0], bar.range[1], (height / 24.0).max(2.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_label_is_smaller_instead_of_cut() {
        let label = "variation of the walking speed [m/s]";
        for length in [80.0, 120.0] {
            assert!(markup::width(label, fitting_size(label, length)) <= length * (1.0 + 1e-12));
        }
        assert_eq!(fitting_size(label, 500.0), style::LABEL_SIZE);
    }
}
