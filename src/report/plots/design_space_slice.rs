//! A slice of the design space along two design variables: contours of the objective, bounds, and the path to the optimum.

use crate::Result;
use crate::report::figure::{
    Colour, Dash, Figure, Grid, Legend, Mark, MarkerShape, Panel, PlotAxis, QuantityLabel, Stroke, check, contour,
    markup, round_levels, short,
};

/// The objective on a grid of the slice.
#[derive(Clone, Debug)]
pub struct ObjectiveContours<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// Its values.
    pub grid: &'a Grid,
    /// Contour levels; if empty, about twelve round ones.
    pub levels: &'a [f64],
}

/// A constraint on a grid of the slice.
#[derive(Clone, Debug)]
pub struct Bound<'a> {
    /// Its name for the legend.
    pub name: &'a str,
    /// Violation of the constraint, in any unit: the zero contour is drawn and hatched on the infeasible side, where it is
    /// positive.
    pub excess: &'a Grid,
    /// True for an equation, which holds on the contour only.
    pub is_equality: bool,
}

/// A trial step of the optimization.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iterate {
    /// Number of its cycle, shown next to it.
    pub cycle: usize,
    /// The design.
    pub design: [f64; 2],
    /// `true` if it was accepted.
    pub accepted: bool,
    /// Lower and upper corner of the move limits.
    pub move_limits: Option<[[f64; 2]; 2]>,
}

/// Data of the plot.
#[derive(Clone, Debug)]
pub struct DesignSpaceSlice<'a> {
    /// The variables along the axes.
    pub variables: [QuantityLabel; 2],
    /// The objective.
    pub objective: ObjectiveContours<'a>,
    /// The constraints.
    pub bounds: &'a [Bound<'a>],
    /// The trial steps in order.
    pub path: &'a [Iterate],
    /// The optimum, if it is known.
    pub optimum: Option<[f64; 2]>,
}

/// Draws objective, bounds, path and optimum on the grid of the objective.
///
/// # Errors
/// [`Error::NotFinite`](crate::Error::NotFinite) for a path or an optimum that is not finite.
pub fn design_space_slice(data: &DesignSpaceSlice) -> Result<Figure> {
    check_path(data)?;
    let [[x0, y0], [x1, y1]] = data.objective.grid.corners();
    let [x, y] = &data.variables;
    let mut panel =
        Panel::new(PlotAxis::of(x).limits(x0, x1), PlotAxis::of(y).limits(y0, y1)).legend(Legend::Below).plane();
    add_contours(&mut panel, &data.objective);
    for (k, bound) in data.bounds.iter().enumerate() {
        add_bound(&mut panel, bound, k);
    }
    add_path(&mut panel, data.path, [x1 - x0, y1 - y0]);
    if let Some(optimum) = data.optimum {
        panel.add(Mark::points([optimum], MarkerShape::Circle, Colour::BLACK, 6.0).named("optimum"));
        panel.add(Mark::points([optimum], MarkerShape::Disc, Colour::BLACK, 1.2));
    }
    let description =
        format!("Design plane: contours of {}, bounds and the path of the optimization", data.objective.name);
    Ok(Figure::new(description, 85.0, 88.0).with(panel))
}

fn check_path(data: &DesignSpaceSlice) -> Result<()> {
    for iterate in data.path {
        check::finite("design of the path", &iterate.design)?;
        if let Some(limits) = iterate.move_limits {
            check::finite_points("move limits of the path", &limits)?;
        }
    }
    data.optimum.map_or(Ok(()), |optimum| check::finite("optimum", &optimum))
}

fn add_contours(panel: &mut Panel, objective: &ObjectiveContours) {
    const LINE: Colour = Colour(105, 105, 105);
    let chosen;
    let levels = if objective.levels.is_empty() {
        chosen = round_levels(objective.grid, 12);
        &chosen
    } else {
        objective.levels
    };
    let mut labels = Vec::new();
    for &level in levels {
        let curves = contour(objective.grid, level);
        let line = Mark::curves(curves.clone(), Stroke::solid(LINE, 0.7).dash(Dash::Dotted)).named(objective.name);
        panel.add(line.described(format!("{} = {}", markup::plain(objective.name), markup::plain(&short(level)))));
        labels.push(Mark::contour_label(curves, short(level), Colour(60, 60, 60)));
    }
    panel.extend(labels);
}

fn add_bound(panel: &mut Panel, bound: &Bound, index: usize) {
    let colour = [Colour::BLACK, Colour::VERMILLION, Colour::GREEN, Colour::PURPLE][index % 4];
    let curves = contour(bound.excess, 0.0);
    if !bound.is_equality {
        panel.add(Mark::hatching(curves.clone(), Stroke::solid(colour, 0.5), 4.8).named(bound.name));
    }
    panel.add(Mark::curves(curves, Stroke::solid(colour, 1.1)).named(bound.name));
}

fn add_path(panel: &mut Panel, path: &[Iterate], span: [f64; 2]) {
    for (cycle, limits) in path.iter().filter_map(|iterate| Some((iterate.cycle, iterate.move_limits?))) {
        let line = Mark::rectangle(limits, Stroke::solid(Colour::SKY, 0.6).dash(Dash::Dashed)).named("move limits");
        panel.add(line.described(format!("move limits of cycle {cycle}")));
    }
    let designs = |accepted: bool| -> Vec<[f64; 2]> {
        path.iter().filter(|i| i.accepted == accepted).map(|i| i.design).collect()
    };
    let (accepted, rejected) = (designs(true), designs(false));
    if !accepted.is_empty() {
        panel.add(Mark::curve(accepted.clone(), Stroke::solid(Colour::BLUE, 0.9)).named("cycles"));
        panel.add(Mark::points(accepted, MarkerShape::Disc, Colour::BLUE, 3.4).named("cycles"));
    }
    if !rejected.is_empty() {
        panel.add(Mark::points(rejected, MarkerShape::Cross, Colour::VERMILLION, 4.6).named("rejected steps"));
    }
    add_numbers(panel, path, span);
}

/// Adds the numbers of the cycles; designs that coincide on paper share a label.
fn add_numbers(panel: &mut Panel, path: &[Iterate], span: [f64; 2]) {
    let near = |a: &Iterate, b: &Iterate| {
        let [u, v] = [0, 1].map(|k| (a.design[k] - b.design[k]) / span[k]);
        a.accepted && b.accepted && u.hypot(v) < 0.03
    };
    for group in path.chunk_by(near) {
        let (first, last) = (group[0].cycle, group[group.len() - 1].cycle);
        let number = if first == last { first.to_string() } else { format!("{first}–{last}") };
        panel.add(Mark::note(group[0].design, number));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bowl() -> Grid {
        Grid::sample([0.0, 2.0], [0.0, 1.0], [21, 21], |x, y| (x - 1.0).powi(2) + (y - 0.5).powi(2)).unwrap()
    }

    fn slice_of<'a>(grid: &'a Grid, bounds: &'a [Bound<'a>], path: &'a [Iterate]) -> DesignSpaceSlice<'a> {
        DesignSpaceSlice {
            variables: [QuantityLabel::new("*b*_1", "N/m"), QuantityLabel::new("*b*_2", "N s/m")],
            objective: ObjectiveContours { name: "objective", grid, levels: &[0.1, 0.2] },
            bounds,
            path,
            optimum: Some([1.0, 0.5]),
        }
    }

    #[test]
    fn names_numbers_and_boxes_are_in_the_picture() {
        let (grid, wall) = (bowl(), Grid::sample([0.0, 2.0], [0.0, 1.0], [5, 5], |x, _| 0.55 - x).unwrap());
        let bounds = [Bound { name: "displacement", excess: &wall, is_equality: false }];
        let at = |cycle, x, accepted| Iterate {
            cycle,
            design: [x, 0.2],
            accepted,
            move_limits: Some([[x - 0.1, 0.1], [x + 0.1, 0.3]]),
        };
        let path = [at(0, 1.8, true), at(1, 1.5, false), at(1, 1.4, true), at(2, 1.0, true), at(3, 1.001, true)];
        let svg = design_space_slice(&slice_of(&grid, &bounds, &path)).unwrap().svg().unwrap();
        for text in ["displacement", "optimum", "move limits", "rejected steps", ">2–3<", "[N s/m]", ">0.2<"] {
            assert!(svg.contains(text), "{text} is missing");
        }
    }

    /// An equation holds on its line only: no side is hatched.
    #[test]
    fn an_equation_is_a_line_without_hatching() {
        let (grid, wall) = (bowl(), Grid::sample([0.0, 2.0], [0.0, 1.0], [5, 5], |x, _| 0.55 - x).unwrap());
        let svg = |is_equality| {
            let bounds = [Bound { name: "length", excess: &wall, is_equality }];
            design_space_slice(&slice_of(&grid, &bounds, &[])).unwrap().svg().unwrap()
        };
        let [equation, limit] = [true, false].map(svg);
        assert!(equation.contains("length") && equation.len() < limit.len());
    }

    #[test]
    fn designs_without_value_are_refused() {
        let grid = bowl();
        let path = [Iterate { cycle: 0, design: [0.0, f64::NAN], accepted: true, move_limits: None }];
        assert!(design_space_slice(&slice_of(&grid, &[], &path)).is_err());
        assert!(design_space_slice(&slice_of(&grid, &[], &[])).is_ok());
    }
}
