//! Transformation from data to paper.

use super::axis::Scale;
use super::mark::MarkKind;
use super::panel::Panel;
use super::svg::Area;
use super::ticks::Ticks;

/// Frame of a panel on paper, with its limits and ticks.
pub(crate) struct View {
    pub area: Area,
    pub x: [f64; 2],
    pub y: [f64; 2],
    pub x_ticks: Ticks,
    pub y_ticks: Ticks,
    pub scales: [Scale; 2],
}

impl View {
    /// The view of a panel whose frame is `area`.
    pub fn new(panel: &Panel, area: Area) -> Self {
        let extent: Vec<[f64; 2]> = panel.marks.iter().flat_map(|mark| mark.extent()).collect();
        let margin =
            if panel.marks.iter().any(|mark| matches!(mark.kind, MarkKind::Symbol { .. })) { 0.1 } else { 0.04 };
        let mut x = panel.x.span(extent.iter().map(|p| p[0]), margin);
        let mut y = panel.y.span(extent.iter().map(|p| p[1]), margin);
        if panel.equal {
            let unit = ((x[1] - x[0]) / area.width).max((y[1] - y[0]) / area.height);
            (x, y) = (widened(x, unit * area.width), widened(y, unit * area.height));
        }
        let x_ticks = panel.x.ticks(x, (area.width / 38.0).max(2.0) as usize);
        let y_ticks = panel.y.ticks(y, (area.height / 20.0).max(2.0) as usize);
        Self { area, x, y, x_ticks, y_ticks, scales: [panel.x.scale, panel.y.scale] }
    }

    /// Position of a data point on paper; `None` if the scale cannot show it.
    pub fn position(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        if !(self.scales[0].shows(x) && self.scales[1].shows(y)) {
            return None;
        }
        let position = [
            self.area.left + self.area.width * self.fraction(0, x),
            self.area.bottom() - self.area.height * self.fraction(1, y),
        ];
        position.iter().all(|v| v.is_finite()).then_some(position)
    }

    /// Pieces of a curve on paper, broken at points that the scale cannot show.
    pub fn curve(&self, points: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
        let positions: Vec<Option<[f64; 2]>> = points.iter().map(|&p| self.position(p)).collect();
        positions
            .split(Option::is_none)
            .filter(|piece| !piece.is_empty())
            .map(|p| p.iter().flatten().copied().collect())
            .collect()
    }

    fn fraction(&self, axis: usize, value: f64) -> f64 {
        let limits = if axis == 0 { self.x } else { self.y };
        let [low, high] = limits.map(|v| self.scales[axis].position(v));
        // Clamped 20 frames outside, which keeps the numbers in the file short.
        ((self.scales[axis].position(value) - low) / (high - low)).clamp(-20.0, 21.0)
    }
}

fn widened([low, high]: [f64; 2], width: f64) -> [f64; 2] {
    let middle = 0.5 * (low + high);
    [middle - 0.5 * width, middle + 0.5 * width]
}
