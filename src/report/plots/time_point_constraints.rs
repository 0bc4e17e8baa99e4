//! Constraints at time points as curves over two design variables.

use crate::Result;
use crate::report::figure::{
    Colour, Dash, Figure, Grid, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, check, contour,
};

/// The constraints of one response at many time points.
#[derive(Clone, Debug)]
pub struct ConstraintFamily<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// Violation over the two variables, positive where infeasible, one grid for each time point; the zero contour is drawn.
    pub excesses: &'a [Grid],
}

/// Data of the plot.
#[derive(Clone, Debug)]
pub struct TimePointConstraints<'a> {
    /// The variables along the axes.
    pub variables: [QuantityLabel; 2],
    /// The families; the first is drawn solid, the second dashed, then dotted and dash-dotted.
    pub families: &'a [ConstraintFamily<'a>],
    /// `true` if the infeasible side of each curve is hatched.
    pub hatched: bool,
    /// The optimum, if it is known.
    pub optimum: Option<[f64; 2]>,
    /// Lower and upper corner of the window; `None` for that of the first grid.
    pub window: Option<[[f64; 2]; 2]>,
}

/// Draws every constraint curve of every family.
///
/// # Errors
/// If there is no curve, or the optimum or the window is not finite.
pub fn time_point_constraints(data: &TimePointConstraints) -> Result<Figure> {
    let first = data.families.iter().find_map(|family| family.excesses.first());
    check::not_empty("time point constraints", usize::from(first.is_some()))?;
    let window = data.window.or(first.map(Grid::corners)).unwrap_or_default();
    check::finite_points("window", &window)?;
    let [low, high] = window;
    let [x, y] = &data.variables;
    let mut panel = Panel::new(PlotAxis::of(x).limits(low[0], high[0]), PlotAxis::of(y).limits(low[1], high[1]))
        .legend(Legend::Below)
        .plane();
    for (k, family) in data.families.iter().enumerate() {
        add_family(&mut panel, family, k, data.hatched);
    }
    if let Some(optimum) = data.optimum {
        check::finite("optimum", &optimum)?;
        panel.add(Mark::points([optimum], MarkerShape::Circle, Colour::BLACK, 6.0).named("optimum"));
    }
    Ok(Figure::new("Time point constraints in the design plane", 85.0, 88.0).with(panel))
}

fn add_family(panel: &mut Panel, family: &ConstraintFamily, index: usize, hatched: bool) {
    let dash = [Dash::Solid, Dash::Dashed, Dash::Dotted, Dash::DashDot][index % 4];
    let colour = [Colour::BLACK, Colour::BLUE, Colour::VERMILLION, Colour::GREEN][index % 4];
    let curves: Vec<_> = family.excesses.iter().flat_map(|excess| contour(excess, 0.0)).collect();
    if hatched {
        panel.add(Mark::hatching(curves.clone(), Stroke::solid(colour, 0.35), 2.4));
    }
    panel.add(Mark::curves(curves, Stroke::solid(colour, 0.7).dash(dash)).named(family.name));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_family_is_named_and_none_is_an_error() {
        let curve = |c: f64| Grid::sample([0.0, 1.0], [0.0, 1.0], [9, 9], move |x, y| x + y - c).unwrap();
        let (first, second) = ([curve(0.5), curve(0.7)], [curve(1.2)]);
        let families = [
            ConstraintFamily { name: "displacement", excesses: &first },
            ConstraintFamily { name: "acceleration", excesses: &second },
        ];
        let variables = [QuantityLabel::new("a", ""), QuantityLabel::new("b", "")];
        let data = TimePointConstraints { variables, families: &families, hatched: true, optimum: None, window: None };
        let svg = time_point_constraints(&data).unwrap().svg().unwrap();
        assert!(svg.contains("displacement") && svg.contains("acceleration") && svg.contains("stroke-dasharray"));
        assert!(time_point_constraints(&TimePointConstraints { families: &[], ..data.clone() }).is_err());
        assert!(time_point_constraints(&TimePointConstraints { optimum: Some([f64::NAN, 0.0]), ..data }).is_err());
    }
}
