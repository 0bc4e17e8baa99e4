//! Figures 3 to 6 of the paper, and convergence and time histories of the runs.

use super::four_bar_figures::{four_bar_animation, four_bar_figures};
use crate::cases::four_bar::StressConstrained;
use crate::cases::impact_absorber::{self, ACCELERATION, DISPLACEMENT, motion};
use crate::cases::slider_crank::{self, coupler_point};
use crate::papers::paper::{ReproducedRun, ReproducedTable};
use crate::problem::{ClosedForm, TimeGrid};
use crate::report::figure::{Figure, Grid, QuantityLabel};
use crate::report::plots::{
    Bound, ConstraintFamily, Convergence, ConvergenceMeasure, CouplerCurve, DesignSpaceSlice, FeasibleSide, Iterate,
    Linkage, ObjectiveContours, ResponseHistory, TimeBound, TimeHistory, TimePointConstraints, convergence,
    coupler_curve, design_space_slice, time_history, time_point_constraints,
};
use crate::sao::Cycle;
use error::Result;

/// Figures of a regenerated table, by file stem.
pub(super) fn figures(table: &ReproducedTable) -> Result<Vec<(String, Figure)>> {
    let Some(run) = table.runs.first() else { return Ok(vec![]) };
    let mut figures = vec![(format!("{}_convergence", table.name), convergence_of(run)?)];
    match table.name {
        "table1" => {
            figures.push(("figure3_maximum_acceleration".to_owned(), figure3(run)?));
            figures.push(("figure4_time_point_constraints".to_owned(), figure4(run)?));
            figures.push(("table1_displacement".to_owned(), history_of(run, DISPLACEMENT, &[1.0, -1.0])?));
            let peak = run.state.design[2];
            figures.push(("table1_acceleration".to_owned(), history_of(run, ACCELERATION, &[peak, -peak])?));
        }
        "table2" => {
            figures.push(("figure5_comfort_criterion".to_owned(), figure5(run)?));
            figures.push(("table2_displacement".to_owned(), history_of(run, DISPLACEMENT, &[1.0, -1.0])?));
        }
        "table5" => {
            let model = StressConstrained::as_published().mechanism;
            figures.extend(four_bar_figures("figure7_four_bar", &model, run)?);
        }
        "table4" => figures.push(("figure6_coupler_curve".to_owned(), figure6(run)?)),
        _ => (),
    }
    Ok(figures)
}

/// Animations of a regenerated table, by file name.
pub(super) fn animations(table: &ReproducedTable) -> Result<Vec<(String, Vec<u8>)>> {
    match table.runs.first() {
        Some(run) if table.name == "table5" => {
            four_bar_animation("figure7_four_bar", &StressConstrained::as_published().mechanism, run)
        }
        _ => Ok(vec![]),
    }
}

fn variables() -> [QuantityLabel; 2] {
    [QuantityLabel::new("*b*_1", "N m^{-1}"), QuantityLabel::new("*b*_2", "N s m^{-1}")]
}

/// Samples a function of stiffness and damping on 81 × 81 designs of the unit square.
fn sampled(f: impl Fn(f64, f64) -> f64) -> Result<Grid> {
    Grid::sample([0.0, 1.0], [0.0, 1.0], [81, 81], f)
}

/// Largest magnitude of displacement (m) or acceleration (m/s²) over 401 time points from 0 to 12 s.
fn largest(k: f64, c: f64, which: usize) -> f64 {
    (0..401).map(|p| motion(k, c, 0.03 * f64::from(p))[which].abs()).fold(0.0, f64::max)
}

fn path(run: &ReproducedRun) -> Vec<Iterate> {
    let corner = |side: &[f64]| [side[0], side[1]];
    let iterate = |c: &Cycle| Iterate {
        cycle: c.cycle,
        design: corner(&c.design),
        accepted: c.accepted,
        move_limits: c.region.as_ref().map(|r| [corner(&r.lower), corner(&r.upper)]),
    };
    run.state.history.iter().map(iterate).collect()
}

fn in_the_plane(run: &ReproducedRun, name: &str, grid: &Grid, levels: &[f64]) -> Result<Figure> {
    let excess = sampled(|k, c| largest(k, c, DISPLACEMENT) - 1.0)?;
    design_space_slice(&DesignSpaceSlice {
        variables: variables(),
        objective: ObjectiveContours { name, grid, levels },
        bounds: &[Bound { name: "displacement bound", excess: &excess, is_equality: false }],
        path: &path(run),
        optimum: Some([run.state.design[0], run.state.design[1]]),
    })
}

fn figure3(run: &ReproducedRun) -> Result<Figure> {
    let peak = sampled(|k, c| largest(k, c, ACCELERATION))?;
    in_the_plane(run, "maximum acceleration [m s^{-2}]", &peak, &[])
}

fn figure5(run: &ReproducedRun) -> Result<Figure> {
    let weights = TimeGrid::uniform(0.0, impact_absorber::DURATION, 101)?.simpson()?;
    let square = |k, c| {
        let term = |(p, w): (usize, &f64)| w * motion(k, c, 0.12 * p as f64)[ACCELERATION].powi(2);
        weights.iter().enumerate().map(term).sum::<f64>() / impact_absorber::DURATION
    };
    let levels = [0.02, 0.03, 0.038, 0.05, 0.07, 0.1, 0.15, 0.2];
    in_the_plane(run, "comfort criterion [m^2 s^{-4}]", &sampled(square)?, &levels)
}

/// Upper displacement and lower acceleration constraints every 0.25 s, near the optimum, for the optimal b₃.
fn figure4(run: &ReproducedRun) -> Result<Figure> {
    let [low, high] = [[0.25, 0.4], [0.5, 0.6]];
    let excesses = |which: usize, limit: f64, sign: f64| -> Result<Vec<Grid>> {
        let at = |p: i32| {
            let f = |k, c| sign * motion(k, c, 0.25 * f64::from(p))[which] - limit;
            Grid::sample([low[0], high[0]], [low[1], high[1]], [61, 61], f)
        };
        (0..=48).map(at).collect()
    };
    let families = [
        ConstraintFamily { name: "displacement, *y*(*t*_p) = 1 m", excesses: &excesses(DISPLACEMENT, 1.0, 1.0)? },
        ConstraintFamily {
            name: "acceleration, −*a*(*t*_p) = *b*_3",
            excesses: &excesses(ACCELERATION, run.state.design[2], -1.0)?,
        },
    ];
    time_point_constraints(&TimePointConstraints {
        variables: variables(),
        families: &families,
        hatched: false,
        optimum: Some([run.state.design[0], run.state.design[1]]),
        window: Some([low, high]),
    })
}

/// Coupler point and drawing of the slider-crank with the design `b` after the crank has rotated by `rotation` in rad.
pub fn slider_crank_at(b: &[f64], rotation: f64) -> ([f64; 2], Linkage) {
    let pose: Vec<f64> = (0..3).map(|h| slider_crank::Coupler.response(h, b, rotation)).collect();
    let (ground, pin) = ([b[4], b[5]], [pose[0], pose[1]]);
    let slider = [pin[0] + b[1] * pose[2].cos(), b[2]];
    let point = coupler_point(&pose, b);
    let linkage = Linkage {
        bars: vec![vec![ground, pin]],
        plates: vec![vec![pin, slider, point]],
        joints: vec![pin],
        ground_joints: vec![ground],
        sliders: vec![(slider, 0.0)],
        guides: vec![[[slider[0] - 9.0, b[2]], [slider[0] + 9.0, b[2]]]],
        notes: vec![("*P*".to_owned(), point)],
        ..Linkage::default()
    };
    (point, linkage)
}

fn figure6(run: &ReproducedRun) -> Result<Figure> {
    let curve = |b: &[f64]| -> Vec<[f64; 2]> {
        (0..=180).map(|k| slider_crank_at(b, f64::from(2 * k).to_radians()).0).collect()
    };
    let (start, end) = (&run.state.history[0].design, &run.state.design);
    let reached: Vec<[f64; 2]> =
        slider_crank::ROTATIONS_DEG.iter().map(|d| slider_crank_at(end, d.to_radians()).0).collect();
    coupler_curve(&CouplerCurve {
        axes: [QuantityLabel::new("*x*", "length"), QuantityLabel::new("*y*", "length")],
        curves: &[("first design", &curve(start)), ("final design", &curve(end))],
        desired: &slider_crank::DESIRED,
        reached: &reached,
        linkage: Some(&slider_crank_at(end, 0.0).1),
    })
}

/// Objective, errors, violation and steps over the cycles.
fn convergence_of(run: &ReproducedRun) -> Result<Figure> {
    let history = &run.state.history;
    let column = |f: fn(&Cycle) -> f64| -> Vec<f64> { history.iter().map(f).collect() };
    let objective = column(|c| c.objective);
    let spread = objective.iter().copied().fold(0.0, f64::max) / objective.iter().copied().fold(f64::MAX, f64::min);
    convergence(&Convergence {
        cycles: &history.iter().map(|c| c.cycle).collect::<Vec<_>>(),
        accepted: &history.iter().map(|c| c.accepted).collect::<Vec<_>>(),
        objective: QuantityLabel::literal(&run.problem.objective.name, &run.problem.objective.unit),
        objective_values: &objective,
        objective_logarithmic: spread > 20.0,
        measures: &[
            ConvergenceMeasure { name: "*E*_f", values: &column(|c| c.objective_error_pct) },
            ConvergenceMeasure { name: "*E*_g", values: &column(|c| c.constraint_error_pct) },
            ConvergenceMeasure { name: "*V*", values: &column(|c| c.violation_pct) },
            ConvergenceMeasure { name: "max Δ*b*", values: &column(|c| c.max_variable_change_pct) },
        ],
        measure: QuantityLabel::new("errors, violation, step", "%"),
    })
}

/// A response at the first and the final design, with its limits and the time points retained and active in the last cycle.
fn history_of(run: &ReproducedRun, response: usize, limits: &[f64]) -> Result<Figure> {
    let (problem, state) = (&run.problem, &run.state);
    let declared = &problem.responses[response];
    let grid = &problem.grids[declared.grid.unwrap_or(0)];
    let first = problem.analyze(&state.history[0].design)?;
    let [kept, active] = run.marked_points(response);
    let bound =
        |&value: &f64| TimeBound { value, side: if value > 0.0 { FeasibleSide::Below } else { FeasibleSide::Above } };
    time_history(&TimeHistory {
        time: QuantityLabel::literal(&grid.name, &grid.unit),
        response: QuantityLabel::literal(&declared.name, &declared.unit),
        times: &grid.points,
        histories: &[
            ResponseHistory { name: "first design", values: &first.values[response] },
            ResponseHistory { name: "final design", values: &state.responses.values[response] },
        ],
        bounds: &limits.iter().map(bound).collect::<Vec<_>>(),
        kept: &kept,
        active: &active,
    })
}
