//! Figures of the flexible four-bar: stresses over time and along the links, the mechanism and its motion.

use crate::cases::four_bar::{FourBar, LINKS};
use crate::papers::paper::ReproducedRun;
use crate::report::animation::{Animation, Scene};
use crate::report::figure::{Figure, Grid, QuantityLabel};
use crate::report::plots::{
    FeasibleSide, Linkage, ResponseHistory, StressField, TimeBound, TimeHistory, mechanism, stress_field, time_history,
};
use error::Result;
use mechanics::analyses::sampling::interpolate;
use mechanics::integrators::time_stepper::TimeStepper as Motion;
use mechanics::mechanism::{Mechanism, ParametricMechanism};

/// Magnification of the deflection in animations.
const ENLARGED: f64 = 10.0;
/// Pascals in a megapascal.
const MEGA: f64 = 1e6;

/// Figures of a run of `model`, by file stem.
pub fn four_bar_figures(name: &str, model: &FourBar, run: &ReproducedRun) -> Result<Vec<(String, Figure)>> {
    let first = run.problem.analyze(&run.state.history[0].design)?.values;
    let before = stresses(model, &run.state.history[0].design, &first);
    let after = stresses(model, &run.state.design, &run.state.responses.values);
    let mut figures = vec![];
    for link in 0..3 {
        let figure = stress_history(run, link, model.elements + 1, [&before, &after])?;
        figures.push((format!("{name}_stress_{}", LINKS[link]), figure));
    }
    figures.push((format!("{name}_stress_field"), field(model, run, &after)?));
    figures.push(("figure7_four_bar".to_owned(), figure7(model)?));
    Ok(figures)
}

/// The motion with the designs of cycle 4 and of the end, in the time window of the constraints, as a page and as a GIF, by
/// file name.
///
/// The deflection of the links is magnified ten times, and the 0.2 s are shown in 8 s.
pub fn four_bar_animation(name: &str, model: &FourBar, run: &ReproducedRun) -> Result<Vec<(String, Vec<u8>)>> {
    let times: Vec<f64> = run.problem.grids[0].points.iter().copied().step_by(2).collect();
    let scene = |title: &str, design: &[f64]| -> Result<Scene> {
        let frames = shapes(model, design, &times)?.iter().map(|links| linkage(links, ENLARGED)).collect();
        Ok(Scene { title: title.to_owned(), frames, traces: vec![] })
    };
    let early = run.state.history.iter().find(|c| c.accepted && c.cycle == 4).unwrap_or(&run.state.history[0]);
    let scenes = vec![
        scene(&format!("cycle {}, {:.1} kg", early.cycle, early.objective), &early.design)?,
        scene(&format!("optimum, {:.2} kg", run.state.evaluation.objective), &run.state.design)?,
    ];
    let axes = [QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")];
    let animation =
        Animation::new("Flexible four-bar, deflection magnified ten times", axes, times, scenes)?.lasting(8.0)?;
    let page = (format!("{name}_motion.html"), animation.page().into_bytes());
    Ok(vec![page, (format!("{name}_motion.gif"), animation.gif(72.0)?)])
}

/// Bending stresses in MPa from bending moments, one series for each node.
fn stresses(model: &FourBar, design: &[f64], moments: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let nodes = model.elements + 1;
    let stress = |(k, series): (usize, &Vec<f64>)| {
        let factor = FourBar::stress_per_moment(design[k / nodes]) / MEGA;
        series.iter().map(|m| m * factor).collect()
    };
    moments.iter().enumerate().map(stress).collect()
}

/// Stress over time at the most loaded node of a link, with the time points retained and active in the last cycle.
fn stress_history(
    run: &ReproducedRun,
    link: usize,
    nodes: usize,
    [before, after]: [&Vec<Vec<f64>>; 2],
) -> Result<Figure> {
    let largest = |k: &usize| after[*k].iter().fold(0.0f64, |a, s| a.max(s.abs()));
    let node = (link * nodes..(link + 1) * nodes).max_by(|a, b| largest(a).total_cmp(&largest(b))).unwrap_or(0);
    let [kept, active] = run.marked_points(node);
    let limit = FourBar::ALLOWED_STRESS / MEGA;
    time_history(&TimeHistory {
        time: QuantityLabel::new("time *t*", "s"),
        response: QuantityLabel::new(format!("bending stress, {} node {}", LINKS[link], node % nodes + 1), "MPa"),
        times: &run.problem.grids[0].points,
        histories: &[
            ResponseHistory { name: "first design", values: &before[node] },
            ResponseHistory { name: "final design", values: &after[node] },
        ],
        bounds: &[
            TimeBound { value: limit, side: FeasibleSide::Below },
            TimeBound { value: -limit, side: FeasibleSide::Above },
        ],
        kept: &kept,
        active: &active,
    })
}

/// Stress over time and along the links, active points marked.
fn field(model: &FourBar, run: &ReproducedRun, stresses: &[Vec<f64>]) -> Result<Figure> {
    let (times, nodes) = (&run.problem.grids[0].points, model.elements + 1);
    let place = |node: usize, link: usize| model.lengths[link] * node as f64 / model.elements as f64;
    let grid = |link: usize| {
        let along: Vec<f64> = (0..nodes).map(|k| place(k, link)).collect();
        Grid::new(times, &along, &stresses[link * nodes..(link + 1) * nodes].concat())
    };
    let grids = (0..3).map(grid).collect::<Result<Vec<_>>>()?;
    let links: Vec<(&str, &Grid)> = LINKS.iter().copied().zip(&grids).collect();
    let mark = |row: &crate::sao::ActiveRow| {
        let response = run.problem.constraints[row.row.constraint].quantity.responses()[0];
        let link = response / nodes;
        (link, [times[row.row.point], place(response % nodes, link)])
    };
    let marked: Vec<_> = run.state.history.last().map_or(vec![], |c| c.active.iter().map(mark).collect());
    stress_field(&StressField {
        time: QuantityLabel::new("time *t*", "s"),
        position: QuantityLabel::new("position *s*", "m"),
        stress: QuantityLabel::new("bending stress *σ*", "MPa"),
        links: &links,
        allowable: Some(FourBar::ALLOWED_STRESS / MEGA),
        marked: &marked,
    })
}

/// The mechanism as in the paper's Figure 7: undeformed, at the initial crank angle.
fn figure7(model: &FourBar) -> Result<Figure> {
    let built = model.build(&[0.03; 3])?;
    let places: Vec<f64> = built.coordinates().map(|(_, position)| position).collect();
    let links = nodes_of(model, &built).map(|link| link.iter().map(|&[x, y]| [places[x], places[y]]).collect());
    let mut drawing = linkage(&links, 1.0);
    let middle = |link: &Vec<[f64; 2]>| link[link.len() / 2];
    drawing.notes = LINKS.iter().zip(&links).map(|(name, link)| ((*name).to_owned(), middle(link))).collect();
    drawing.notes.extend([("*O*".to_owned(), links[0][0]), ("*D*".to_owned(), links[2][0])]);
    mechanism(&[QuantityLabel::new("*x*", "m"), QuantityLabel::new("*y*", "m")], &[("", &drawing)])
}

/// Indices of the x and y coordinates of the nodes of each link, from end to end.
fn nodes_of(model: &FourBar, built: &Mechanism<f64>) -> [Vec<[usize; 2]>; 3] {
    let number = |name: String| built.coordinates().position(|(own, _)| own == name).expect("the mechanism has it");
    let node = |name: &str| [number(format!("{name}.x")), number(format!("{name}.y"))];
    let inner = |link: usize, last: usize| (2..=last).map(move |k| format!("link {link}.{k}"));
    let last = model.elements + 1;
    let row = |first: &str, link: usize, until: usize, end: Option<String>| {
        let names = std::iter::once(first.to_owned()).chain(inner(link, until)).chain(end);
        names.map(|name| node(&name)).collect()
    };
    let (b, c) = (format!("link 1.{last}"), format!("link 2.{last}"));
    [row("O", 1, last, None), row(&b, 2, last, None), row("D", 3, last - 1, Some(c))]
}

/// Node positions of the three links at each time.
fn shapes(model: &FourBar, design: &[f64], times: &[f64]) -> Result<Vec<[Vec<[f64; 2]>; 3]>> {
    let built = model.build(design)?;
    let nodes = nodes_of(model, &built);
    let mut motion = Motion::new(&built, &model.dynamics()?, times)?;
    let mut at = motion.integrator.step.new.clone();
    let mut shapes = Vec::with_capacity(times.len());
    for &t in times {
        motion.advance_to(t)?;
        interpolate(&motion.integrator.step.old, &motion.integrator.step.new, t, &mut at);
        shapes.push(nodes.each_ref().map(|link| link.iter().map(|&[x, y]| [at.q[x], at.q[y]]).collect()));
    }
    Ok(shapes)
}

/// The drawing of three links, with their deflection from the chord magnified by the factor `enlarged`.
fn linkage(links: &[Vec<[f64; 2]>; 3], enlarged: f64) -> Linkage {
    let bars = links.iter().map(|link| {
        let (from, to) = (link[0], link[link.len() - 1]);
        let point = |(k, p): (usize, &[f64; 2])| {
            let part = k as f64 / (link.len() - 1) as f64;
            [0, 1].map(|i| {
                let chord = from[i] + (to[i] - from[i]) * part;
                chord + (p[i] - chord) * enlarged
            })
        };
        link.iter().enumerate().map(point).collect()
    });
    let end = |link: &Vec<[f64; 2]>| link[link.len() - 1];
    Linkage {
        bars: bars.collect(),
        joints: vec![end(&links[0]), end(&links[1])],
        ground_joints: vec![links[0][0], links[2][0]],
        ..Linkage::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_keep_the_lengths_of_the_links_and_bend() {
        let model = FourBar::as_published();
        let shapes = shapes(&model, &[0.0385, 0.0252, 0.02], &[0.0, 0.25]).unwrap();
        for (link, length) in shapes[1].iter().zip(model.lengths) {
            let steps = link.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]));
            assert!((steps.sum::<f64>() / length - 1.0).abs() < 1e-4);
        }
        let plain = linkage(&shapes[1], 1.0);
        assert_eq!(plain.bars[2].last(), Some(&plain.joints[1]));
        let crooked = linkage(&shapes[1], 100.0);
        let far = crooked.bars[1].iter().zip(&plain.bars[1]).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        assert!(far.fold(0.0, f64::max) > 1e-2);
    }
}
