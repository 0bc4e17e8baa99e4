//! Writer of SVG elements; coordinates in points, y downwards.

use std::fmt::Write;

use super::colour::Colour;
use super::mark::{Anchor, Dash, Stroke};
use super::markup;

/// Fonts of all text: the font of the PNG files, then fallbacks.
const FONT: &str = "'DejaVu Sans Condensed','DejaVu Sans',Helvetica,Arial,sans-serif";

/// A rectangle in points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Area {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Area {
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// The area enlarged by a margin on all sides.
    pub fn grown(&self, rim: f64) -> Self {
        let (width, height) = (self.width + 2.0 * rim, self.height + 2.0 * rim);
        Self { left: self.left - rim, top: self.top - rim, width, height }
    }

    pub fn overlaps(&self, other: Self) -> bool {
        let along = self.left < other.right() && other.left < self.right();
        along && self.top < other.bottom() && other.top < self.bottom()
    }

    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let near = 1e-6;
        x >= self.left - near && x <= self.right() + near && y >= self.top - near && y <= self.bottom() + near
    }
}

/// Style of a text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lettering {
    pub size: f64,
    pub anchor: Anchor,
    pub colour: Colour,
    /// Degrees, clockwise.
    pub turned: f64,
    /// `true` if a white outline keeps the text legible on lines.
    pub rim: bool,
}

impl Lettering {
    pub fn new(size: f64, anchor: Anchor) -> Self {
        Self { size, anchor, colour: Colour::BLACK, turned: 0.0, rim: false }
    }
}

/// Elements of an SVG.
pub(crate) struct Svg {
    body: String,
    clips: usize,
    /// Prefix of ids, so that several SVGs fit into one page.
    prefix: String,
}

impl Svg {
    pub fn new(prefix: &str) -> Self {
        Self { body: String::new(), clips: 0, prefix: prefix.to_owned() }
    }

    /// The file; the size in millimetres on paper.
    pub fn file(self, [width, height]: [f64; 2], description: &str) -> String {
        let (width_mm, height_mm) = (number(width), number(height));
        let head = format!("xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_mm}mm\" height=\"{height_mm}mm\"");
        self.element(&head, "", [width, height], description)
    }

    /// The element for an HTML page, which sets the size; the id of the title is the prefix.
    pub fn inline(self, size: [f64; 2], description: &str) -> String {
        let prefix = self.prefix.clone();
        self.element(&format!("aria-labelledby=\"{prefix}\""), &format!(" id=\"{prefix}\""), size, description)
    }

    fn element(self, head: &str, id: &str, size: [f64; 2], description: &str) -> String {
        let [width, height] = size.map(|mm| number(mm * super::style::POINTS_PER_MM));
        format!(
            "<svg {head} viewBox=\"0 0 {width} {height}\" role=\"img\" font-family=\"{FONT}\">\n<title{id}>{}</title>\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{}</svg>\n",
            markup::escape(description),
            self.body
        )
    }

    /// Clips the output of `draw` at the edge of the area.
    pub fn clipped(&mut self, area: Area, draw: impl FnOnce(&mut Self)) {
        self.clips += 1;
        let id = format!("{}clip{}", self.prefix, self.clips);
        let Area { left, top, width, height } = area;
        let _ = writeln!(
            self.body,
            "<clipPath id=\"{id}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath>\n\
             <g clip-path=\"url(#{id})\">",
            number(left),
            number(top),
            number(width),
            number(height)
        );
        draw(self);
        self.body.push_str("</g>\n");
    }

    pub fn polyline(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        self.polylines(std::slice::from_ref(&points), stroke);
    }

    /// Polylines in one path.
    pub fn polylines<P: AsRef<[[f64; 2]]>>(&mut self, curves: &[P], stroke: Stroke) {
        let d: String = curves.iter().map(|curve| path_data(curve.as_ref())).collect();
        if !d.is_empty() {
            let _ = writeln!(self.body, "<path d=\"{d}\" fill=\"none\" {}/>", stroke_attributes(stroke));
        }
    }

    pub fn polygon(&mut self, points: &[[f64; 2]], fill: Colour, opacity: f64, stroke: Option<Stroke>) {
        let d = path_data(points);
        let faint = if opacity < 1.0 { format!(" fill-opacity=\"{}\"", number(opacity)) } else { String::new() };
        let outline = stroke.map(|s| format!(" {}", stroke_attributes(s))).unwrap_or_default();
        let _ = writeln!(self.body, "<path d=\"{d}Z\" fill=\"{}\"{faint}{outline}/>", fill.hex());
    }

    pub fn circle(&mut self, [x, y]: [f64; 2], radius: f64, fill: Colour, stroke: Option<Stroke>) {
        let outline = stroke.map(|s| format!(" {}", stroke_attributes(s))).unwrap_or_default();
        let (x, y, r) = (number(x), number(y), number(radius));
        let _ = writeln!(self.body, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\" fill=\"{}\"{outline}/>", fill.hex());
    }

    /// Boxes of one colour; each overlaps its neighbours to the right and below a little, which avoids visible seams.
    pub fn cells(&mut self, cells: &[Area], fill: Colour) {
        const OVERLAP: f64 = 0.25;
        let mut d = String::new();
        for &Area { left, top, width, height } in cells {
            let (w, h) = (number(width + OVERLAP), number(height + OVERLAP));
            let _ = write!(d, "M{} {}h{w}v{h}h-{w}z", number(left), number(top));
        }
        let _ = writeln!(self.body, "<path d=\"{d}\" fill=\"{}\"/>", fill.hex());
    }

    /// A text on its baseline.
    pub fn text(&mut self, [x, y]: [f64; 2], markup: &str, style: Lettering) {
        let (x, y) = (number(x), number(y));
        let anchor = match style.anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let turned = match style.turned {
            0.0 => String::new(),
            angle => format!(" transform=\"rotate({} {x} {y})\"", number(angle)),
        };
        let rim = if style.rim {
            " stroke=\"#ffffff\" stroke-width=\"1.8\" stroke-linejoin=\"round\" paint-order=\"stroke\""
        } else {
            ""
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" fill=\"{}\"{anchor}{turned}{rim}>{}</text>",
            number(style.size),
            style.colour.hex(),
            markup::tspans(markup, style.size)
        );
    }
}

/// Two decimals without trailing zeros: a hundredth of a point is finer than any printer.
pub(crate) fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn path_data(points: &[[f64; 2]]) -> String {
    let mut d = String::with_capacity(12 * points.len());
    for (k, [x, y]) in points.iter().enumerate() {
        let _ = write!(d, "{}{} {}", if k == 0 { 'M' } else { 'L' }, number(*x), number(*y));
    }
    d
}

fn stroke_attributes(stroke: Stroke) -> String {
    let w = stroke.width;
    let dash = match stroke.dash {
        Dash::Solid => String::new(),
        Dash::Dashed => format!(" stroke-dasharray=\"{} {}\"", number(3.0 + w), number(1.6 + w)),
        Dash::Dotted => format!(" stroke-dasharray=\"{} {}\"", number(0.9 * w + 0.2), number(1.2 + w)),
        Dash::DashDot => {
            format!(" stroke-dasharray=\"{} {} {} {}\"", number(4.0 + w), number(1.4 + w), number(w), number(1.4 + w))
        }
    };
    let (colour, width) = (stroke.colour.hex(), number(w));
    format!("stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}")
}
