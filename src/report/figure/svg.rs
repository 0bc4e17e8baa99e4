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
    /// Prefix of ids, so that several SVGs fit into one page; empty for a file.
    prefix: String,
}

/// Deviation in points by which a line in a page may differ from that of a file.
const DEVIATION: f64 = 0.03;

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

    /// The points of a line; in a page, only those that change its course.
    fn path_data(&self, points: &[[f64; 2]]) -> String {
        if self.prefix.is_empty() { path_data(points) } else { path_data(&simplified(points, DEVIATION)) }
    }

    pub fn polyline(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        self.polylines(std::slice::from_ref(&points), stroke);
    }

    /// Polylines in one path.
    pub fn polylines<P: AsRef<[[f64; 2]]>>(&mut self, curves: &[P], stroke: Stroke) {
        let d: String = curves.iter().map(|curve| self.path_data(curve.as_ref())).collect();
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

/// A line through some of the points that is nowhere farther than `deviation` from them: the algorithm of Ramer, Douglas and Peucker.
fn simplified(points: &[[f64; 2]], deviation: f64) -> Vec<[f64; 2]> {
    let mut kept = vec![false; points.len()];
    let mut open = vec![(0, points.len().saturating_sub(1))];
    while let Some((first, last)) = open.pop() {
        let (Some(a), Some(b)) = (points.get(first), points.get(last)) else { break };
        (kept[first], kept[last]) = (true, true);
        let far = |k: usize| distance(points[k], *a, *b);
        let farthest = (first + 1..last).max_by(|i, j| far(*i).total_cmp(&far(*j)));
        if let Some(k) = farthest.filter(|k| far(*k) > deviation) {
            open.extend([(first, k), (k, last)]);
        }
    }
    points.iter().zip(kept).filter(|(_, is_kept)| *is_kept).map(|(point, _)| *point).collect()
}

/// The distance of a point from the line segment between two others.
fn distance([x, y]: [f64; 2], [x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> f64 {
    let [u, v] = [x1 - x0, y1 - y0];
    let part = ((x - x0) * u + (y - y0) * v) / (u * u + v * v).max(f64::MIN_POSITIVE);
    let part = part.clamp(0.0, 1.0);
    (x - x0 - part * u).hypot(y - y0 - part * v)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simplified_line_is_near_all_points() {
        let points: Vec<[f64; 2]> =
            (0..=1000).map(|k| 0.2 * f64::from(k)).map(|x| [x, 50.0 * (0.05 * x).sin()]).collect();
        let few = simplified(&points, DEVIATION);
        assert!(few.len() < 200 && few[0] == points[0] && few.last() == points.last(), "{}", few.len());
        for point in points {
            let near = few.windows(2).map(|pair| distance(point, pair[0], pair[1])).fold(f64::INFINITY, f64::min);
            assert!(near <= DEVIATION, "{near}");
        }
        // A closed line, a line that goes back, and short ones.
        let square = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 0.0]];
        assert_eq!(simplified(&square, DEVIATION), [square[0], square[2], square[3], square[4]]);
        assert_eq!(simplified(&[[0.0, 0.0], [5.0, 0.0], [1.0, 0.0]], DEVIATION).len(), 3);
        assert_eq!((simplified(&[], DEVIATION).len(), simplified(&[[1.0, 1.0]], DEVIATION).len()), (0, 1));
    }
}
