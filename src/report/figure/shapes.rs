//! Markers, symbols of a mechanism, and hatching.

use super::colour::Colour;
use super::mark::{MarkSymbol, MarkerShape, Stroke};
use super::svg::Svg;

/// Strokes at 45° on the left of a curve, `spacing` points apart along it.
pub(crate) fn hatches(curve: &[[f64; 2]], length: f64, spacing: f64) -> Vec<[[f64; 2]; 2]> {
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

/// Draws a marker of the given width.
pub(crate) fn marker(svg: &mut Svg, [x, y]: [f64; 2], kind: MarkerShape, colour: Colour, size: f64) {
    let r = size / 2.0;
    let line = Stroke::solid(colour, (0.16 * size).clamp(0.5, 1.0));
    let square = [[x - r, y - r], [x + r, y - r], [x + r, y + r], [x - r, y + r]];
    match kind {
        MarkerShape::Circle => svg.circle([x, y], r, Colour::WHITE, Some(line)),
        MarkerShape::Disc => svg.circle([x, y], r, colour, None),
        MarkerShape::Square => svg.polygon(&square, Colour::WHITE, 1.0, Some(line)),
        MarkerShape::Block => svg.polygon(&square, colour, 1.0, None),
        MarkerShape::Diamond => {
            svg.polygon(&[[x - r, y], [x, y - r], [x + r, y], [x, y + r]], Colour::WHITE, 1.0, Some(line));
        }
        MarkerShape::Down => {
            svg.polygon(&[[x - r, y - 0.6 * r], [x + r, y - 0.6 * r], [x, y + r]], Colour::WHITE, 1.0, Some(line));
        }
        MarkerShape::Cross => svg.polylines(&[[square[0], square[2]], [square[1], square[3]]], line),
        MarkerShape::Plus => svg.polylines(&[[[x - r, y], [x + r, y]], [[x, y - r], [x, y + r]]], line),
    }
}

/// Draws a symbol of a mechanism.
pub(crate) fn symbol(svg: &mut Svg, [x, y]: [f64; 2], kind: MarkSymbol) {
    let line = Stroke::solid(Colour::BLACK, 0.7);
    match kind {
        MarkSymbol::Joint => svg.circle([x, y], 2.2, Colour::WHITE, Some(line)),
        MarkSymbol::GroundJoint => {
            let foot = y + 8.0;
            svg.polygon(&[[x, y], [x - 4.6, foot], [x + 4.6, foot]], Colour::WHITE, 1.0, Some(line));
            svg.polyline(&[[x - 7.5, foot], [x + 7.5, foot]], line);
            let strokes: Vec<_> =
                (0..6).map(|k| x - 5.5 + 2.5 * f64::from(k)).map(|x| [[x, foot], [x - 2.3, foot + 2.6]]).collect();
            svg.polylines(&strokes, Stroke::solid(Colour::BLACK, 0.5));
            svg.circle([x, y], 2.2, Colour::WHITE, Some(line));
        }
        MarkSymbol::Slider(angle) => {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hatches_lean_to_the_left_and_keep_their_distance() {
        let strokes = hatches(&[[0.0, 0.0], [7.0, 0.0], [20.0, 0.0]], 2.0, 4.0);
        assert_eq!(strokes.len(), 5);
        assert!(strokes.windows(2).all(|p| (p[1][0][0] - p[0][0][0] - 4.0).abs() < 1e-12));
        // The left side of a curve to the right is up, which is negative on paper.
        assert!(strokes.iter().all(|s| (s[1][1] + 2f64.sqrt()).abs() < 1e-12));
    }
}
