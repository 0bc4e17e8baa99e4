//! Marks: everything drawn inside a panel, in data coordinates; sizes and widths are in points (1/72 inch) on paper.

use super::colour::{Colour, ColourMap};
use super::grid::Grid;

/// Dash pattern of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dash {
    /// Without gaps.
    Solid,
    /// Long strokes.
    Dashed,
    /// Dots.
    Dotted,
    /// Alternating strokes and dots.
    DashDot,
}

/// Style of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its colour.
    pub colour: Colour,
    /// Its width in points.
    pub width: f64,
    /// Its dash pattern.
    pub dash: Dash,
}

impl Stroke {
    /// A solid line.
    pub const fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dash: Dash::Solid }
    }

    /// Sets the dash pattern.
    pub const fn dash(self, dash: Dash) -> Self {
        Self { dash, ..self }
    }
}

/// Marker of a data point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkerShape {
    /// A circle, white inside.
    Circle,
    /// A filled circle.
    Disc,
    /// A square, white inside.
    Square,
    /// A filled square.
    Block,
    /// A diamond, white inside.
    Diamond,
    /// A triangle pointing down, white inside.
    Down,
    /// A diagonal cross.
    Cross,
    /// An upright cross.
    Plus,
}

/// Symbol of a mechanism, in a fixed size on paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MarkSymbol {
    /// A revolute joint: a ring.
    Joint,
    /// A revolute joint on the ground: a triangle on a hatched line.
    GroundJoint,
    /// A slider block, with the angle of its guide in radians from the x-axis.
    Slider(f64),
}

/// Horizontal alignment of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// It begins at its point.
    Start,
    /// It is centred at its point.
    Middle,
    /// It ends at its point.
    End,
}

#[derive(Clone, Debug)]
pub(crate) enum MarkKind {
    Curves { curves: Vec<Vec<[f64; 2]>>, stroke: Stroke },
    Region { outline: Vec<[f64; 2]>, colour: Colour, opacity: f64 },
    Points { at: Vec<[f64; 2]>, marker: MarkerShape, colour: Colour, size: f64 },
    Hatching { curves: Vec<Vec<[f64; 2]>>, stroke: Stroke, length: f64 },
    Text { at: [f64; 2], text: String, anchor: Anchor, offset: [f64; 2], colour: Colour, size: f64 },
    Note { at: [f64; 2], text: String },
    ContourLabel { curves: Vec<Vec<[f64; 2]>>, text: String, colour: Colour },
    Field { grid: Grid, map: ColourMap, range: [f64; 2] },
    Symbol { at: [f64; 2], symbol: MarkSymbol },
}

/// A mark; later marks cover earlier ones.
#[derive(Clone, Debug)]
pub struct Mark {
    pub(crate) kind: MarkKind,
    pub(crate) name: Option<String>,
    pub(crate) description: Option<String>,
}

impl Mark {
    fn of(kind: MarkKind) -> Self {
        Self { kind, name: None, description: None }
    }

    /// Adds an entry in the legend.
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Sets the name in the numbers of a page, if it is another one than in the legend.
    pub fn described(mut self, description: impl Into<String>) -> Self {
        self.description = Some(description.into());
        self
    }

    /// A polyline.
    pub fn curve(points: impl Into<Vec<[f64; 2]>>, stroke: Stroke) -> Self {
        Self::curves(vec![points.into()], stroke)
    }

    /// Several polylines with one style.
    pub fn curves(curves: Vec<Vec<[f64; 2]>>, stroke: Stroke) -> Self {
        Self::of(MarkKind::Curves { curves, stroke })
    }

    /// A step function: each value holds until the next abscissa.
    pub fn steps(points: &[[f64; 2]], stroke: Stroke) -> Self {
        let mut corners = Vec::with_capacity(2 * points.len());
        for pair in points.windows(2) {
            corners.extend([pair[0], [pair[1][0], pair[0][1]]]);
        }
        corners.extend(points.last());
        Self::curve(corners, stroke)
    }

    /// The outline of the box between two corners.
    pub fn rectangle([low, high]: [[f64; 2]; 2], stroke: Stroke) -> Self {
        Self::curve([low, [high[0], low[1]], high, [low[0], high[1]], low], stroke)
    }

    /// A filled polygon.
    pub fn region(outline: impl Into<Vec<[f64; 2]>>, colour: Colour, opacity: f64) -> Self {
        Self::of(MarkKind::Region { outline: outline.into(), colour, opacity })
    }

    /// Markers of the given width in points.
    pub fn points(at: impl Into<Vec<[f64; 2]>>, marker: MarkerShape, colour: Colour, size: f64) -> Self {
        Self::of(MarkKind::Points { at: at.into(), marker, colour, size })
    }

    /// Short strokes to the left of the direction of the curves, for the infeasible side of a bound; `length` in points.
    pub fn hatching(curves: Vec<Vec<[f64; 2]>>, stroke: Stroke, length: f64) -> Self {
        Self::of(MarkKind::Hatching { curves, stroke, length })
    }

    /// A text at a data point, shifted by `offset` points on paper to the right and up.
    pub fn text(at: [f64; 2], text: impl Into<String>, anchor: Anchor, offset: [f64; 2]) -> Self {
        let (colour, size) = (Colour::BLACK, super::style::TICK_SIZE);
        Self::of(MarkKind::Text { at, text: text.into(), anchor, offset, colour, size })
    }

    /// A text near a point, placed where it covers the fewest marks; omitted if it would cover another note.
    pub fn note(at: [f64; 2], text: impl Into<String>) -> Self {
        Self::of(MarkKind::Note { at, text: text.into() })
    }

    /// A label on one of the curves, far from other marks.
    pub fn contour_label(curves: Vec<Vec<[f64; 2]>>, text: impl Into<String>, colour: Colour) -> Self {
        Self::of(MarkKind::ContourLabel { curves, text: text.into(), colour })
    }

    /// A coloured field; `range` gives the values of the first and the last colour.
    pub fn field(grid: Grid, map: ColourMap, range: [f64; 2]) -> Self {
        Self::of(MarkKind::Field { grid, map, range })
    }

    /// A symbol of a mechanism.
    pub fn symbol(at: [f64; 2], symbol: MarkSymbol) -> Self {
        Self::of(MarkKind::Symbol { at, symbol })
    }

    /// The data points that the axes must show.
    pub(crate) fn extent(&self) -> Vec<[f64; 2]> {
        match &self.kind {
            MarkKind::Curves { curves, .. } | MarkKind::Hatching { curves, .. } => curves.concat(),
            MarkKind::Region { outline, .. } => outline.clone(),
            MarkKind::Points { at, .. } => at.clone(),
            MarkKind::Text { at, .. } | MarkKind::Note { at, .. } | MarkKind::Symbol { at, .. } => vec![*at],
            MarkKind::ContourLabel { .. } => Vec::new(),
            MarkKind::Field { grid, .. } => grid.corners().into(),
        }
    }
}
