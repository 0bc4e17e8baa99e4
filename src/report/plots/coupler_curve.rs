//! Coupler curve of a mechanism and the desired points.

use super::Linkage;
use crate::report::figure::{Colour, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, check};
use crate::{Error, Result};

/// Data of the plot.
#[derive(Clone, Debug)]
pub struct CouplerCurve<'a> {
    /// Quantities along the axes.
    pub axes: [QuantityLabel; 2],
    /// Curves with names, such as those of the first and the last design.
    pub curves: &'a [(&'a str, &'a [[f64; 2]])],
    /// The points through which the curve should pass.
    pub desired: &'a [[f64; 2]],
    /// Points of the last curve at the prescribed times, one for each desired point; may be empty.
    pub reached: &'a [[f64; 2]],
    /// The mechanism in one position.
    pub linkage: Option<&'a Linkage>,
}

/// Draws curves, desired points with their numbers, and a short line from each to the reached point.
///
/// # Errors
/// If there is no curve, data are not finite, or the numbers of reached and desired points differ.
pub fn coupler_curve(data: &CouplerCurve) -> Result<Figure> {
    check_data(data)?;
    let [x, y] = &data.axes;
    let mut panel = Panel::new(PlotAxis::of(x), PlotAxis::of(y)).equal().legend(Legend::Below);
    if let Some(linkage) = data.linkage {
        linkage.draw(&mut panel);
    }
    for (k, (name, curve)) in data.curves.iter().enumerate() {
        let is_last = k + 1 == data.curves.len();
        let stroke = if is_last { Stroke::solid(Colour::BLUE, 1.1) } else { Stroke::solid(Colour::GREY, 0.7) };
        panel.add(Mark::curve(*curve, stroke).named(*name));
    }
    let errors = data.desired.iter().zip(data.reached).map(|(d, r)| vec![*d, *r]).collect();
    panel.add(Mark::curves(errors, Stroke::solid(Colour::VERMILLION, 0.7)));
    if !data.reached.is_empty() {
        panel.add(Mark::points(data.reached, MarkerShape::Disc, Colour::BLUE, 3.0).named("at the prescribed times"));
    }
    if !data.desired.is_empty() {
        panel.add(Mark::points(data.desired, MarkerShape::Cross, Colour::VERMILLION, 4.6).named("desired"));
    }
    panel.extend(data.desired.iter().enumerate().map(|(k, &at)| Mark::note(at, (k + 1).to_string())));
    Ok(Figure::new("Coupler curve against the desired points", 85.0, 80.0).with(panel))
}

fn check_data(data: &CouplerCurve) -> Result<()> {
    check::not_empty("coupler curve", data.curves.len())?;
    for (_, curve) in data.curves {
        check::finite_points("coupler curve", curve)?;
    }
    if !data.reached.is_empty() {
        Error::check_length("points reached at the prescribed times", data.desired.len(), data.reached.len())?;
        check::finite_points("points reached", data.reached)?;
    }
    if !data.desired.is_empty() {
        check::finite_points("desired points", data.desired)?;
    }
    data.linkage.map_or(Ok(()), Linkage::check)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_curve_are_in_the_picture() {
        let circle: Vec<[f64; 2]> =
            (0..=36).map(|k| f64::from(k * 10).to_radians()).map(|a| [a.cos(), a.sin()]).collect();
        let curves = [("coupler curve", circle.as_slice())];
        let data = CouplerCurve {
            axes: [QuantityLabel::new("*x*", "mm"), QuantityLabel::new("*y*", "mm")],
            curves: &curves,
            desired: &[[1.1, 0.0], [0.0, 1.1]],
            reached: &[[1.0, 0.0], [0.0, 1.0]],
            linkage: None,
        };
        let svg = coupler_curve(&data).unwrap().svg().unwrap();
        assert!(svg.contains("coupler curve") && svg.contains(">desired<") && svg.contains(">2</text>"));
        assert!(coupler_curve(&CouplerCurve { curves: &[], ..data.clone() }).is_err());
        assert!(coupler_curve(&CouplerCurve { curves: &[("empty", &[])], ..data.clone() }).is_err());
        assert!(coupler_curve(&CouplerCurve { reached: &[[0.0, 0.0]], ..data.clone() }).is_err());
        assert!(coupler_curve(&CouplerCurve { desired: &[[f64::NAN, 0.0]], reached: &[], ..data }).is_err());
    }
}
