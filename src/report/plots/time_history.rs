//! A response over time for several designs, with bounds and with retained and active time points.

use crate::report::figure::{
    Colour, Dash, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, check, range,
};
use crate::{Error, Result};

/// A history of the response.
#[derive(Clone, Debug)]
pub struct ResponseHistory<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// The response at each time.
    pub values: &'a [f64],
}

/// Feasible side of a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeasibleSide {
    /// At or below it.
    Below,
    /// At or above it.
    Above,
}

/// A bound on the response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeBound {
    /// Its value, in the unit of the response.
    pub value: f64,
    /// The feasible side; the other one is hatched.
    pub side: FeasibleSide,
}

/// Data of the plot.
#[derive(Clone, Debug)]
pub struct TimeHistory<'a> {
    /// Quantity along the horizontal axis.
    pub time: QuantityLabel,
    /// Quantity along the vertical axis.
    pub response: QuantityLabel,
    /// The time points, increasing.
    pub times: &'a [f64],
    /// The histories, earlier designs first; points are marked on the last one.
    pub histories: &'a [ResponseHistory<'a>],
    /// The bounds.
    pub bounds: &'a [TimeBound],
    /// Indices of the time points retained in the approximate problem.
    pub kept: &'a [usize],
    /// Indices of the time points whose constraint is active.
    pub active: &'a [usize],
}

/// Draws all histories, bounds and points.
///
/// # Errors
/// If times do not increase, there is no history, lengths differ, a value is not finite, or an index is outside.
pub fn time_history(data: &TimeHistory) -> Result<Figure> {
    check_data(data)?;
    let ends = [data.times[0], data.times[data.times.len() - 1]];
    let response = PlotAxis { limits: Some(limits(data)), ..PlotAxis::of(&data.response) };
    let mut panel = Panel::new(PlotAxis::of(&data.time).limits(ends[0], ends[1]), response).legend(Legend::Below);
    let points = |values: &[f64]| -> Vec<[f64; 2]> { data.times.iter().zip(values).map(|(&t, &v)| [t, v]).collect() };
    let last = data.histories.len() - 1;
    for (k, history) in data.histories.iter().enumerate() {
        panel.add(Mark::curve(points(history.values), stroke(last - k)).named(history.name));
    }
    data.bounds.iter().for_each(|bound| add_bound(&mut panel, *bound, ends));
    let at = |indices: &[usize]| -> Vec<[f64; 2]> {
        indices.iter().map(|&p| [data.times[p], data.histories[last].values[p]]).collect()
    };
    if !data.kept.is_empty() {
        panel.add(Mark::points(at(data.kept), MarkerShape::Circle, Colour::BLUE, 3.4).named("retained points"));
    }
    if !data.active.is_empty() {
        panel.add(Mark::points(at(data.active), MarkerShape::Disc, Colour::VERMILLION, 3.8).named("active points"));
    }
    Ok(Figure::new(format!("{} over time", data.response.name), 85.0, 62.0).with(panel))
}

/// Limits of histories and bounds, with a margin for the hatching.
fn limits(data: &TimeHistory) -> [f64; 2] {
    let values = data.histories.iter().flat_map(|h| h.values).copied().chain(data.bounds.iter().map(|b| b.value));
    let [low, high] = range(values);
    let margin = (0.09 * (high - low)).max(1e-3 * high.abs().max(low.abs())).max(1e-12);
    [low - margin, high + margin]
}

/// Line of a history: the last one is black and solid, earlier ones are fainter.
fn stroke(age: usize) -> Stroke {
    match age {
        0 => Stroke::solid(Colour::BLACK, 1.0),
        1 => Stroke::solid(Colour::GREY, 0.9).dash(Dash::Dashed),
        _ => Stroke::solid(Colour::LIGHT_GREY, 0.8),
    }
}

fn add_bound(panel: &mut Panel, bound: TimeBound, [start, end]: [f64; 2]) {
    // Hatching is on the left of the direction of the line: rightwards for an upper bound, leftwards for a lower one.
    let line = match bound.side {
        FeasibleSide::Below => [[start, bound.value], [end, bound.value]],
        FeasibleSide::Above => [[end, bound.value], [start, bound.value]],
    };
    panel.extend(bound_marks(line).map(|mark| mark.named("bound")));
}

/// The line of a bound, hatched on its left.
pub(crate) fn bound_marks(line: [[f64; 2]; 2]) -> [Mark; 2] {
    let hatching = Mark::hatching(vec![line.into()], Stroke::solid(Colour::BLACK, 0.4), 3.6);
    [hatching, Mark::curve(line, Stroke::solid(Colour::BLACK, 0.8))]
}

fn check_data(data: &TimeHistory) -> Result<()> {
    check::increasing("time points", data.times)?;
    check::not_empty("histories of the response", data.histories.len())?;
    for history in data.histories {
        check::series(history.name, data.times.len(), history.values)?;
    }
    data.bounds.iter().try_for_each(|bound| check::finite("bound", &[bound.value]))?;
    for &index in data.kept.iter().chain(data.active) {
        let inside = index < data.times.len();
        Error::check_option("index of a time point", "less than the number of time points", index as f64, inside)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_bounds_are_named() {
        let histories = [
            ResponseHistory { name: "first design", values: &[0.0, 2.0, 1.0] },
            ResponseHistory { name: "optimum", values: &[0.0, 1.0, 0.5] },
        ];
        let bounds =
            [TimeBound { value: 1.0, side: FeasibleSide::Below }, TimeBound { value: -1.0, side: FeasibleSide::Above }];
        let data = TimeHistory {
            time: QuantityLabel::new("time *t*", "s"),
            response: QuantityLabel::new("displacement *y*", "m"),
            times: &[0.0, 1.0, 2.0],
            histories: &histories,
            bounds: &bounds,
            kept: &[0, 1],
            active: &[1],
        };
        let svg = time_history(&data).unwrap().svg().unwrap();
        for text in ["first design", "optimum", "bound", "retained points", "active points", "[s]"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert!(time_history(&TimeHistory { kept: &[3], ..data.clone() }).is_err());
        assert!(time_history(&TimeHistory { times: &[0.0, 2.0, 1.0], ..data.clone() }).is_err());
        assert!(time_history(&TimeHistory { histories: &[], ..data.clone() }).is_err());
        let short = [ResponseHistory { name: "short", values: &[0.0] }];
        assert!(time_history(&TimeHistory { histories: &short, ..data }).is_err());
    }
}
