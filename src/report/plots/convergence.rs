//! Convergence of a run: the objective, and errors, violation and steps on a logarithmic scale.

use crate::Result;
use crate::report::figure::{Colour, Figure, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, check};

/// A measure of convergence over the trial steps of a run.
#[derive(Clone, Debug)]
pub struct ConvergenceMeasure<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// Its value at each trial step. Values below 10⁻⁶ are drawn below the logarithmic scale.
    pub values: &'a [f64],
}

/// Data of the plot.
#[derive(Clone, Debug)]
pub struct Convergence<'a> {
    /// Number of the cycle of each trial step.
    pub cycles: &'a [usize],
    /// For each trial step: `true` if it was accepted.
    pub accepted: &'a [bool],
    /// The objective, name and unit.
    pub objective: QuantityLabel,
    /// The objective at each trial step.
    pub objective_values: &'a [f64],
    /// `true` if the scale of the objective is logarithmic.
    pub objective_logarithmic: bool,
    /// Errors, violation, steps: measures that should go to zero.
    pub measures: &'a [ConvergenceMeasure<'a>],
    /// Name and unit of the common axis of the measures.
    pub measure: QuantityLabel,
}

/// Smaller measures are drawn below the scale: they are of the size of rounding, and their decades would fill the plot.
const SMALLEST: f64 = 1e-6;

/// Draws the objective above the measures, both over the cycles; crosses mark rejected trial steps.
///
/// # Errors
/// If there are no trial steps, lengths differ, or a value is not finite.
pub fn convergence(data: &Convergence) -> Result<Figure> {
    check_data(data)?;
    let rounded: Vec<Vec<f64>> =
        data.measures.iter().map(|m| m.values.iter().map(|&v| if v < SMALLEST { 0.0 } else { v }).collect()).collect();
    let measures: Vec<ConvergenceMeasure> =
        data.measures.iter().zip(&rounded).map(|(m, values)| ConvergenceMeasure { name: m.name, values }).collect();
    let data = &Convergence { measures: &measures, ..data.clone() };
    let last = data.cycles.iter().copied().max().unwrap_or(0).max(1) as f64;
    let cycle = || PlotAxis::new("cycle", "").limits(-0.3, last + 0.3).whole();
    let shown = if data.measures.is_empty() { cycle() } else { cycle().unlabelled() };
    let scale = |axis: PlotAxis, logarithmic: bool| if logarithmic { axis.logarithmic() } else { axis };
    let logarithmic = data.objective_logarithmic && data.objective_values.iter().all(|&v| v > 0.0);
    let mut top = Panel::new(shown, scale(PlotAxis::of(&data.objective), logarithmic)).legend(Legend::Absent);
    add_series(&mut top, data, data.objective_values, 0, None);
    let figure =
        Figure::new("Convergence of the optimization", 85.0, if data.measures.is_empty() { 60.0 } else { 110.0 });
    if data.measures.is_empty() {
        return Ok(figure.with(top));
    }
    let ([low, high], rows) = limits(data.measures);
    let mut bottom = Panel::new(cycle(), PlotAxis::of(&data.measure).logarithmic().limits(low, high))
        .legend(Legend::Below)
        .share(1.5);
    for (k, measure) in data.measures.iter().enumerate() {
        let floored: Vec<f64> = measure.values.iter().map(|&v| if v > 0.0 { v } else { 0.0 }).collect();
        add_series(&mut bottom, data, &floored, k, Some(measure.name));
    }
    add_floor(&mut bottom, data, &rows);
    Ok(figure.with(top).with(bottom))
}

fn check_data(data: &Convergence) -> Result<()> {
    check::not_empty("trial steps of the run", data.cycles.len())?;
    crate::Error::check_length("accepted trial steps", data.cycles.len(), data.accepted.len())?;
    check::series("objective of the run", data.cycles.len(), data.objective_values)?;
    data.measures.iter().try_for_each(|measure| check::series(measure.name, data.cycles.len(), measure.values))
}

/// Limits of the axis of the measures, and the positions of the rows below the positive values where zero and negative ones are
/// marked.
fn limits(measures: &[ConvergenceMeasure]) -> ([f64; 2], Vec<f64>) {
    let positive = measures.iter().flat_map(|m| m.values).filter(|&&v| v > 0.0);
    let [low, high] = positive.fold([f64::INFINITY, 0.0], |[l, h]: [f64; 2], &v| [l.min(v), h.max(v)]);
    let [low, high] = if high == 0.0 { [1.0, 10.0] } else { [low / 1.6, high * 3.0] };
    let row = 0.045 * (high / low).log10();
    let below = |rows: f64| low * 10f64.powf(-row * rows);
    let rows = (0..measures.len()).map(|k| below(k as f64 + 1.0)).collect();
    ([below(measures.len() as f64 + 1.0), high], rows)
}

const MARKERS: [MarkerShape; 5] =
    [MarkerShape::Disc, MarkerShape::Square, MarkerShape::Diamond, MarkerShape::Block, MarkerShape::Circle];

fn add_series(panel: &mut Panel, data: &Convergence, values: &[f64], index: usize, name: Option<&str>) {
    let colour = Colour::of_series(index);
    let steps = |wanted: bool| -> Vec<[f64; 2]> {
        let all = data.cycles.iter().zip(data.accepted).zip(values);
        all.filter(|((_, accepted), _)| **accepted == wanted).map(|((&cycle, _), &v)| [cycle as f64, v]).collect()
    };
    let mut curve = Mark::curve(steps(true), Stroke::solid(colour, 0.8));
    let mut points = Mark::points(steps(true), MARKERS[index % MARKERS.len()], colour, 3.6);
    if let Some(name) = name {
        (curve, points) = (curve.named(name), points.named(name));
    }
    panel.add(curve).add(points);
    let rejected = steps(false);
    if !rejected.is_empty() {
        let crosses = Mark::points(rejected, MarkerShape::Cross, colour, 4.6);
        panel.add(if name.is_some() && index == 0 { crosses.named("rejected step") } else { crosses });
    }
}

/// Adds triangles below the scale, in a row for each measure, for zero and negative values.
fn add_floor(panel: &mut Panel, data: &Convergence, rows: &[f64]) {
    let mut named = false;
    for (k, (measure, &row)) in data.measures.iter().zip(rows).enumerate() {
        let below = data.cycles.iter().zip(measure.values).filter(|(_, v)| **v <= 0.0);
        let at: Vec<[f64; 2]> = below.map(|(&cycle, _)| [cycle as f64, row]).collect();
        if !at.is_empty() {
            let mark = Mark::points(at, MarkerShape::Down, Colour::of_series(k), 3.6);
            panel.add(if named { mark } else { mark.named("below 10^{−6}") });
            named = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejected_steps_and_zeros_are_shown() {
        let measures = [
            ConvergenceMeasure { name: "*E*_g", values: &[0.0, 0.5, 0.1] },
            ConvergenceMeasure { name: "*V*", values: &[-1.0, 0.4, 0.2] },
        ];
        let data = Convergence {
            cycles: &[0, 1, 1],
            accepted: &[true, false, true],
            objective: QuantityLabel::new("*F*", "m/s^2"),
            objective_values: &[0.85, 0.62, 0.51],
            objective_logarithmic: true,
            measures: &measures,
            measure: QuantityLabel::new("error, violation", "%"),
        };
        let svg = convergence(&data).unwrap().svg().unwrap();
        for text in ["rejected step", "below 10", "cycle", "[%]"] {
            assert!(svg.contains(text), "{text} is missing");
        }
        assert!(convergence(&Convergence { cycles: &[], ..data.clone() }).is_err());
        assert!(convergence(&Convergence { accepted: &[true], ..data.clone() }).is_err());
        assert!(convergence(&Convergence { objective_values: &[0.1, f64::NAN, 0.2], ..data.clone() }).is_err());
        assert!(convergence(&Convergence { measures: &[], ..data }).is_ok());
    }
}
