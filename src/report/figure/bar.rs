//! The scale of colours beside the fields.

use super::mark::{Anchor, Stroke};
use super::panel::ColourBar;
use super::svg::{Area, Lettering, Svg};
use super::ticks::Ticks;
use super::{Colour, markup, style};

const WIDTH: f64 = 8.0;
const DISTANCE: f64 = 8.0;

/// The room that the bar, its numbers and its label need to the right of the frames.
pub(crate) fn room(bar: &ColourBar) -> f64 {
    DISTANCE + WIDTH + style::GAP + widest(&ticks(bar, 120.0)) + 1.6 * style::LABEL_SIZE
}

pub(crate) fn draw(svg: &mut Svg, bar: &ColourBar, beside: Area) {
    const STEPS: usize = 96;
    let area = Area { left: beside.right() + DISTANCE, width: WIDTH, ..beside };
    let step = area.height / STEPS as f64;
    for k in 0..STEPS {
        let cell = Area { top: area.bottom() - step * (k + 1) as f64, height: step, ..area };
        svg.cells(&[cell], bar.map.at((k as f64 + 0.5) / STEPS as f64));
    }
    let line = Stroke::solid(Colour::BLACK, style::FRAME_WIDTH);
    let (l, r, t, b) = (area.left, area.right(), area.top, area.bottom());
    svg.polyline(&[[l, t], [r, t], [r, b], [l, b], [l, t]], line);
    let ticks = ticks(bar, area.height);
    for (value, text) in &ticks.major {
        let y = b - area.height * (value - bar.range[0]) / (bar.range[1] - bar.range[0]);
        svg.polyline(&[[r, y], [r - 2.5, y]], line);
        let at = [r + style::GAP, y + 0.36 * style::TICK_SIZE];
        svg.text(at, text, Lettering::new(style::TICK_SIZE, Anchor::Start));
    }
    let at = [r + style::GAP + widest(&ticks) + 1.4 * style::LABEL_SIZE, t + area.height / 2.0];
    let label = Lettering { turned: -90.0, ..Lettering::new(style::LABEL_SIZE, Anchor::Middle) };
    svg.text(at, &bar.quantity.label(ticks.exponent), label);
}

fn ticks(bar: &ColourBar, height: f64) -> Ticks {
    Ticks::linear(bar.range[0], bar.range[1], (height / 24.0).max(2.0) as usize)
}

fn widest(ticks: &Ticks) -> f64 {
    ticks.major.iter().map(|(_, label)| markup::width(label, style::TICK_SIZE)).fold(0.0, f64::max)
}
