//! Stress over position along the links and time, as a coloured field.

use crate::report::figure::{
    Colour, ColourBar, ColourMap, Dash, Figure, Grid, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel,
    Stroke, check, contour, range,
};
use crate::{Error, Result};

/// Data of the plot.
#[derive(Clone, Debug)]
pub struct StressField<'a> {
    /// Quantity along the horizontal axis of the grids.
    pub time: QuantityLabel,
    /// Quantity along the vertical axis.
    pub position: QuantityLabel,
    /// Quantity that the colours show.
    pub stress: QuantityLabel,
    /// One field for each link, with its name.
    pub links: &'a [(&'a str, &'a Grid)],
    /// Allowable absolute stress, drawn as contours at plus and minus this value.
    pub allowable: Option<f64>,
    /// Marked points, such as those with the largest stress: index of the link, and \[time, position\].
    pub marked: &'a [(usize, [f64; 2])],
}

/// Draws one field for each link, all with the same colour map.
///
/// Signed stresses are blue where negative, white at zero and red where positive.
///
/// # Errors
/// If there are no links, the allowable stress is not positive, or a mark is not finite or on no link.
pub fn stress_field(data: &StressField) -> Result<Figure> {
    check::not_empty("links", data.links.len())?;
    if let Some(allowable) = data.allowable {
        Error::check_option(
            "allowable stress",
            "positive and finite",
            allowable,
            allowable > 0.0 && allowable.is_finite(),
        )?;
    }
    for (link, at) in data.marked {
        check::finite("marked point", at)?;
        Error::check_option("link of a marked point", "one of the links", *link as f64, *link < data.links.len())?;
    }
    let (map, range) = colours(data);
    // Only the last panel has numbers and a label along time; its share of the height includes them.
    let height = LINK_HEIGHT * data.links.len() as f64 + TIME_LABEL;
    let mut figure = Figure::new(format!("{} over position and time", data.stress.name), 120.0, height);
    for (k, (name, grid)) in data.links.iter().enumerate() {
        figure = figure.with(link_panel(data, k, name, grid, map, range));
    }
    Ok(figure.with_colour_bar(ColourBar { quantity: data.stress.clone(), map, range }))
}

/// Heights in millimetres of a link, and of the numbers and label under the last one.
const LINK_HEIGHT: f64 = 28.0;
const TIME_LABEL: f64 = 6.5;

fn link_panel(data: &StressField, k: usize, name: &str, grid: &Grid, map: ColourMap, range: [f64; 2]) -> Panel {
    let [[t0, x0], [t1, x1]] = grid.corners();
    let last = k + 1 == data.links.len();
    let time = PlotAxis { labelled: last, ..PlotAxis::of(&data.time).limits(t0, t1) };
    let share = if last { LINK_HEIGHT + TIME_LABEL } else { LINK_HEIGHT };
    let mut panel = Panel::new(time, PlotAxis::of(&data.position).limits(x0, x1));
    panel.title = name.to_owned();
    panel.share = share;
    panel.legend = Legend::Absent;
    panel.add(Mark::field(grid.clone(), map, range));
    if map == ColourMap::Diverging {
        panel.add(Mark::curves(contour(grid, 0.0), Stroke::solid(Colour::GREY, 0.4).dash(Dash::Dotted)));
    }
    for level in data.allowable.into_iter().flat_map(|allowable| [-allowable, allowable]) {
        panel.add(Mark::curves(contour(grid, level), Stroke::solid(Colour::BLACK, 0.8)));
    }
    let here: Vec<[f64; 2]> = data.marked.iter().filter(|mark| mark.0 == k).map(|mark| mark.1).collect();
    panel.add(Mark::points(here, MarkerShape::Circle, Colour::BLACK, 3.6));
    panel
}

/// Colour map and its range: symmetric about zero for signed stresses.
fn colours(data: &StressField) -> (ColourMap, [f64; 2]) {
    let [low, high] = range(data.links.iter().flat_map(|link| link.1.range()));
    if low < 0.0 {
        let end = low.abs().max(high.abs());
        return (ColourMap::Diverging, [-end, end]);
    }
    (ColourMap::Sequential, if high > low { [low, high] } else { [low, low + low.abs().max(1.0)] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signed_field_has_a_symmetric_scale_and_bad_marks_are_refused() {
        let wave = Grid::sample([0.0, 1.0], [0.0, 1.0], [31, 11], |t, x| 3e7 * (6.0 * t).sin() * x).unwrap();
        let data = StressField {
            time: QuantityLabel::new("time *t*", "s"),
            position: QuantityLabel::new("position *s*", "m"),
            stress: QuantityLabel::new("bending stress *σ*", "Pa"),
            links: &[("coupler", &wave)],
            allowable: Some(2e7),
            marked: &[(0, [0.26, 1.0])],
        };
        let [low, high] = colours(&data).1;
        assert!(low == -high && (high - 3e7).abs() < 1e5);
        let svg = stress_field(&data).unwrap().svg().unwrap();
        assert!(svg.contains(">coupler<") && svg.contains("position"));
        assert!(stress_field(&StressField { links: &[], marked: &[], ..data.clone() }).is_err());
        assert!(stress_field(&StressField { allowable: Some(f64::NAN), ..data.clone() }).is_err());
        assert!(stress_field(&StressField { marked: &[(1, [0.0, 0.0])], ..data }).is_err());
    }
}
