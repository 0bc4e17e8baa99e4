//! From data to paper: where a panel's frame stands and which values lie where.

use super::mark::Kind;
use super::svg::Area;
use super::ticks::Ticks;
use super::{Legend, Panel, legend, style};

/// Room around a frame, in points.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Margins {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

impl Margins {
    /// Room for both: frames above each other stay aligned.
    pub fn union(self, other: Self) -> Self {
        Self { left: self.left.max(other.left), right: self.right.max(other.right), ..self }
    }

    /// What the numbers and labels of a panel of the given outer size need.
    pub fn around(panel: &Panel, outer: Area) -> Self {
        let title = if panel.title.is_empty() { 0.0 } else { style::LABEL_SIZE + 4.0 };
        if !panel.framed {
            let legend = below(panel, outer.width);
            return Self { left: 2.0, right: 2.0, top: 2.0 + title, bottom: 2.0 + legend };
        }
        let nominal = Area {
            left: 0.0,
            top: 0.0,
            width: (outer.width - 50.0).max(20.0),
            height: (outer.height - 35.0).max(20.0),
        };
        let view = View::new(panel, nominal);
        let left = match panel.y.labelled {
            true => panel.y.widest_number(&view.y_ticks, style::TICK_SIZE) + style::GAP + style::LABEL_SIZE * 1.5 + 2.0,
            false => 4.0,
        };
        let bottom = match panel.x.labelled {
            true => style::GAP + style::TICK_SIZE + 2.5 + style::LABEL_SIZE * 1.35,
            false => 4.0,
        };
        let right = 4.0 + panel.x.widest_number(&view.x_ticks, style::TICK_SIZE) / 2.0;
        Self { left, right, top: 4.0 + title, bottom: bottom + below(panel, outer.width) }
    }

    /// What is left of the outer area.
    pub fn inside(&self, outer: Area) -> Area {
        Area {
            left: outer.left + self.left,
            top: outer.top + self.top,
            width: (outer.width - self.left - self.right).max(10.0),
            height: (outer.height - self.top - self.bottom).max(10.0),
        }
    }
}

fn below(panel: &Panel, width: f64) -> f64 {
    if panel.legend == Legend::Below && panel.has_legend() { legend::height_below(panel, width) + 3.0 } else { 0.0 }
}

/// The window of a panel: which values its frame shows.
pub(crate) struct View {
    pub area: Area,
    pub x: [f64; 2],
    pub y: [f64; 2],
    pub x_ticks: Ticks,
    pub y_ticks: Ticks,
    scales: [super::Scale; 2],
}

impl View {
    pub fn new(panel: &Panel, area: Area) -> Self {
        let extent: Vec<[f64; 2]> = panel.marks.iter().flat_map(|mark| mark.extent()).collect();
        let margin = if panel.marks.iter().any(|mark| matches!(mark.kind, Kind::Symbol { .. })) { 0.1 } else { 0.04 };
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

    /// A data point on paper; `None` where the scale has no place for it.
    pub fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        if !(self.scales[0].shows(x) && self.scales[1].shows(y)) {
            return None;
        }
        let place = [
            self.area.left + self.area.width * self.fraction(0, x),
            self.area.bottom() - self.area.height * self.fraction(1, y),
        ];
        place.iter().all(|v| v.is_finite()).then_some(place)
    }

    /// The pieces of a curve on paper, broken where there is no place for a point.
    pub fn place_curve(&self, points: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
        let placed: Vec<Option<[f64; 2]>> = points.iter().map(|&p| self.place(p)).collect();
        placed
            .split(Option::is_none)
            .filter(|piece| !piece.is_empty())
            .map(|p| p.iter().flatten().copied().collect())
            .collect()
    }

    fn fraction(&self, axis: usize, value: f64) -> f64 {
        let limits = if axis == 0 { self.x } else { self.y };
        let [low, high] = limits.map(|v| self.scales[axis].position(v));
        // A page away from the frame is far enough; the limit keeps the numbers in the file short.
        ((self.scales[axis].position(value) - low) / (high - low)).clamp(-20.0, 21.0)
    }
}

fn widened([low, high]: [f64; 2], width: f64) -> [f64; 2] {
    let middle = 0.5 * (low + high);
    [middle - 0.5 * width, middle + 0.5 * width]
}
