//! The frame of a panel with ticks, numbers and labels.

use super::mark::{Anchor, Stroke};
use super::svg::{Area, Lettering, Svg};
use super::view::View;
use super::{Colour, Panel, style};

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
        for [x, _] in values.iter().filter_map(|&v| view.place([v, middle[1]])).filter(|&p| view.area.contains(p)) {
            lines.push(vec![[x, area.bottom()], [x, area.bottom() - length]]);
            lines.push(vec![[x, area.top], [x, area.top + length]]);
        }
    }
    for (values, length) in [(&view.y_ticks.minor, style::MINOR_LENGTH), (&y_major, style::TICK_LENGTH)] {
        for [_, y] in values.iter().filter_map(|&v| view.place([middle[0], v])).filter(|&p| view.area.contains(p)) {
            lines.push(vec![[area.left, y], [area.left + length, y]]);
            lines.push(vec![[area.right(), y], [area.right() - length, y]]);
        }
    }
    svg.polylines(&lines, line);
    if panel.x.labelled {
        numbers_below(svg, panel, view);
    }
    if panel.y.labelled {
        numbers_beside(svg, panel, view, outer);
    }
}

fn numbers_below(svg: &mut Svg, panel: &Panel, view: &View) {
    let area = view.area;
    let baseline = area.bottom() + style::GAP + 0.78 * style::TICK_SIZE;
    for (value, text) in &view.x_ticks.major {
        if let Some([x, _]) = view.place([*value, view.y[0]]) {
            svg.text([x, baseline], text, Lettering::new(style::TICK_SIZE, Anchor::Middle));
        }
    }
    let at = [area.left + area.width / 2.0, baseline + 2.5 + style::LABEL_SIZE];
    svg.text(at, &panel.x.label(&view.x_ticks), Lettering::new(style::LABEL_SIZE, Anchor::Middle));
}

fn numbers_beside(svg: &mut Svg, panel: &Panel, view: &View, outer: Area) {
    let area = view.area;
    for (value, text) in &view.y_ticks.major {
        if let Some([_, y]) = view.place([view.x[0], *value]) {
            let at = [area.left - style::GAP, y + 0.36 * style::TICK_SIZE];
            svg.text(at, text, Lettering::new(style::TICK_SIZE, Anchor::End));
        }
    }
    let at = [outer.left + style::LABEL_SIZE + 0.5, area.top + area.height / 2.0];
    let style = Lettering { turned: -90.0, ..Lettering::new(style::LABEL_SIZE, Anchor::Middle) };
    svg.text(at, &panel.y.label(&view.y_ticks), style);
}
