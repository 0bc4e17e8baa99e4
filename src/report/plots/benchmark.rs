//! Comparison of methods: distance from a known optimum over the work.

use crate::Result;
use crate::report::figure::{Colour, Dash, Figure, Legend, Mark, Panel, PlotAxis, Stroke, check};

/// Smallest distance from the optimum that is drawn.
const FLOOR: f64 = 1e-10;

/// A method and the distances of its designs from the optimum.
#[derive(Clone, Debug)]
pub struct Approach<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// For each accepted design: work up to it, and its relative distance from the optimum.
    pub designs: &'a [[f64; 2]],
}

/// Draws the distance from the optimum over the work for each method; `work` is the label of the axis.
///
/// Distances are positive and may be infinite. NaN is omitted, and distances below 1e-10 are drawn at 1e-10.
///
/// # Errors
/// [`Error::Definition`](crate::Error::Definition) if there are no methods.
pub fn approach(work: &str, methods: &[Approach]) -> Result<Figure> {
    check::not_empty("methods", methods.len())?;
    let distance = PlotAxis::new("distance from the optimum", "").logarithmic().limits(FLOOR, 10.0);
    let mut panel = Panel::new(PlotAxis::new(work, "").logarithmic(), distance).legend(Legend::Below);
    for (k, method) in methods.iter().enumerate() {
        let points = method.designs.iter().filter(|d| !d[1].is_nan()).map(|d| [d[0], d[1].clamp(FLOOR, 10.0)]);
        panel.add(Mark::curve(points.collect::<Vec<_>>(), line(k, 0.9)).named(method.name));
    }
    Ok(Figure::new("Distance from the optimum over the work", 120.0, 100.0).with(panel))
}

/// Line of the `k`-th method: seven colours, then other dashes.
pub(super) fn line(k: usize, width: f64) -> Stroke {
    let dash = [Dash::Solid, Dash::Dashed, Dash::DashDot, Dash::Dotted][k / 7 % 4];
    Stroke::solid(Colour::of_series(k), width).dash(dash)
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
