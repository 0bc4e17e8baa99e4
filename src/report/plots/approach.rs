//! How methods approach a known optimum.

use crate::report::figure::{Axis, Colour, Dash, Figure, Legend, Mark, Panel, Stroke, check};
use error::Result;

/// Distance below which a design stands at the optimum for this picture.
const FLOOR: f64 = 1e-10;

/// A method and its designs.
#[derive(Clone, Debug)]
pub struct Approach<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// Work done up to each accepted design, and the design's distance from the optimum: both from the first design on.
    pub designs: &'a [[f64; 2]],
}

/// Distance from the optimum over the work, for each method; `work` names what was counted.
///
/// Distances are positive and may be infinite or NaN, which is left out; below 1e-10 they are drawn there.
///
/// **Errors.** No methods.
pub fn approach(work: &str, methods: &[Approach]) -> Result<Figure> {
    check::not_empty("methods", methods.len())?;
    let distance = Axis::new("distance from the optimum", "").logarithmic().limits(FLOOR, 10.0);
    let mut panel = Panel::new(Axis::new(work, "").logarithmic(), distance).legend(Legend::Below);
    for (k, method) in methods.iter().enumerate() {
        let dash = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted][k / 7 % 4];
        let points = method.designs.iter().filter(|d| !d[1].is_nan()).map(|d| [d[0], d[1].clamp(FLOOR, 10.0)]);
        let stroke = Stroke::solid(Colour::of_series(k), 0.9).dash(dash);
        panel.add(Mark::curve(points.collect::<Vec<_>>(), stroke).named(method.name));
    }
    Ok(Figure::new("Distance from the optimum over the work", 120.0, 100.0).with(panel))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_line() {
        let methods = [
            Approach { name: "first", designs: &[[1.0, 0.5], [3.0, 1e-14]] },
            Approach { name: "second", designs: &[[1.0, f64::NAN]] },
        ];
        let svg = approach("analyses", &methods).unwrap().svg().unwrap();
        assert!(svg.contains("first") && svg.contains("second") && !svg.contains("NaN"));
        assert!(approach("analyses", &[]).is_err());
    }
}
