//! Most kinds of plots, from closed forms and printed numbers: `cargo run --example gallery -- [FOLDER]`.
//!
//! The impact absorber is that of Etman, van Campen & Schoofs, *Multibody System Dynamics* 2 (1998), Section 6.1: 1 kg on a
//! spring and a damper with the initial velocity 1 m/s. The designs are the printed ones of Tables I and II. The stress field
//! and the performance profile have invented numbers.

use std::path::Path;

use linkwright::Result;
use linkwright::cases::impact_absorber::motion;
use linkwright::cases::slider_crank::{DESIRED, STAND_IN_START};
use linkwright::papers::etman_1998::slider_crank_at;
use linkwright::report::animation::{Animation, Scene};
use linkwright::report::figure::{Figure, Grid, QuantityLabel};
use linkwright::report::plots::*;

fn times(count: usize) -> Vec<f64> {
    (0..count).map(|p| 12.0 * p as f64 / (count - 1) as f64).collect()
}

fn largest(k: f64, c: f64, which: usize) -> f64 {
    times(401).iter().map(|&t| motion(k, c, t)[which].abs()).fold(0.0, f64::max)
}

fn mean_square(k: f64, c: f64) -> f64 {
    let weight = |p: usize| if p == 0 || p == 100 { 1.0 } else { 2.0 + 2.0 * (p % 2) as f64 };
    times(101).iter().enumerate().map(|(p, &t)| weight(p) * motion(k, c, t)[1].powi(2)).sum::<f64>() / 300.0
}

fn variables() -> [QuantityLabel; 2] {
    [QuantityLabel::new("*b*_1", "N m^{-1}"), QuantityLabel::new("*b*_2", "N s m^{-1}")]
}

fn path(designs: &[[f64; 2]], factors: &[[f64; 2]]) -> Vec<Iterate> {
    let limits = |k: usize| {
        let [b, f] = [designs[k - 1], *factors.get(k - 1)?];
        let corner = |sign: f64| [0, 1].map(|i| (b[i] * (1.0 + sign * f[i])).clamp(0.0, 1.0));
        Some([corner(-1.0), corner(1.0)])
    };
    let iterate = |(k, &design): (usize, &[f64; 2])| Iterate {
        cycle: k,
        design,
        accepted: true,
        move_limits: if k > 0 { limits(k) } else { None },
    };
    designs.iter().enumerate().map(iterate).collect()
}

fn figure_3_and_5() -> Result<[Figure; 2]> {
    let grid = |f: &dyn Fn(f64, f64) -> f64| Grid::sample([0.0, 1.0], [0.0, 1.0], [101, 101], f);
    let excess = grid(&|k, c| largest(k, c, 0) - 1.0)?;
    let (acceleration, comfort) = (grid(&|k, c| largest(k, c, 1))?, grid(&mean_square)?);
    let bounds = [Bound { name: "displacement bound", excess: &excess, is_equality: false }];
    let first = path(
        &[[1.0, 0.3], [0.6, 0.42], [0.3411, 0.4934], [0.3628, 0.4823], [0.3628, 0.4823], [0.3628, 0.4823]],
        &[[0.4, 0.4], [0.533, 0.533]],
    );
    let second = path(
        &[
            [1.0, 0.3],
            [0.8657, 0.42],
            [0.6596, 0.644],
            [0.3958, 0.7933],
            [0.1847, 0.6117],
            [0.1052, 0.775],
            [0.09856, 0.7882],
        ],
        &[[0.4, 0.4], [0.4, 0.533], [0.4, 0.711], [0.533, 0.711]],
    );
    let draw = |name, grid, levels, path, optimum| {
        let objective = ObjectiveContours { name, grid, levels };
        design_space_slice(&DesignSpaceSlice {
            variables: variables(),
            objective,
            bounds: &bounds,
            path,
            optimum: Some(optimum),
        })
    };
    Ok([
        draw("maximum acceleration [m s^{-2}]", &acceleration, &[], &first, [0.3606, 0.4852])?,
        draw(
            "comfort criterion [m^2 s^{-4}]",
            &comfort,
            &[0.02, 0.03, 0.038, 0.05, 0.07, 0.1, 0.15, 0.2],
            &second,
            [0.0985, 0.7883],
        )?,
    ])
}

fn figure_4() -> Result<Figure> {
    let window = [[0.25, 0.4], [0.5, 0.6]];
    let excesses = |which: usize, bound: f64, sign: f64| -> Result<Vec<Grid>> {
        let sample = |p: usize| {
            Grid::sample([0.25, 0.5], [0.4, 0.6], [61, 61], |k, c| sign * motion(k, c, 0.25 * p as f64)[which] - bound)
        };
        (0..=48).map(sample).collect()
    };
    let (position, acceleration) = (excesses(0, 1.0, 1.0)?, excesses(1, 0.5206, -1.0)?);
    let families = [
        ConstraintFamily { name: "displacement, *y*(*t*_p) = 1 m", excesses: &position },
        ConstraintFamily { name: "acceleration, −*a*(*t*_p) = *b*_3", excesses: &acceleration },
    ];
    let optimum = Some([0.3606, 0.4852]);
    time_point_constraints(&TimePointConstraints {
        variables: variables(),
        families: &families,
        hatched: false,
        optimum,
        window: Some(window),
    })
}

/// The optimum of Table IV.
const OPTIMUM: [f64; 8] = [9.3878, 30.0, -6.65, 12.7149, 8.2239, 9.4622, 0.82156, 0.91597];

fn coupler_path(b: &[f64; 8]) -> Vec<[f64; 2]> {
    (0..=180).map(|k| slider_crank_at(b, f64::from(2 * k).to_radians()).0).collect()
}

fn figure_6() -> Result<Figure> {
    let curve = coupler_path(&OPTIMUM);
    let reached = [0., 22., 44., 66., 88., 129., 221., 314.]
        .map(|degrees: f64| slider_crank_at(&OPTIMUM, degrees.to_radians()).0);
    coupler_curve(&CouplerCurve {
        axes: [QuantityLabel::new("*x*", "mm"), QuantityLabel::new("*y*", "mm")],
        curves: &[("coupler curve at the optimum", &curve)],
        desired: &DESIRED,
        reached: &reached,
        linkage: Some(&slider_crank_at(&OPTIMUM, 0.0).1),
    })
}

/// One revolution of the crank in three seconds, with the first design and the optimum side by side.
fn animation() -> Result<Animation> {
    let times: Vec<f64> = (0..90).map(|k| f64::from(k) / 30.0).collect();
    let scene = |title: &str, b: &[f64; 8]| Scene {
        title: title.to_owned(),
        frames: times.iter().map(|t| slider_crank_at(b, t * std::f64::consts::TAU / 3.0).1).collect(),
        traces: vec![coupler_path(b)],
    };
    let axes = [QuantityLabel::new("*x*", "mm"), QuantityLabel::new("*y*", "mm")];
    let scenes = vec![scene("first design", &STAND_IN_START), scene("optimum", &OPTIMUM)];
    Animation::new("Slider-crank mechanism with its coupler curve", axes, times.clone(), scenes)
}

fn convergence_of_table_4() -> Result<Figure> {
    let measures = [
        ConvergenceMeasure {
            name: "max |Δ*b*_i|",
            values: &[0.0, 40.0, 20.0, 15.0, 20.0, 26.67, 20.0, 26.67, 35.56, 12.88, 1.085, 3.248e-2],
        },
        ConvergenceMeasure {
            name: "error *E*_f",
            values: &[0.0, 85.41, 28.7, 2.506, 0.1691, 6.177, 5.953, 2.263, 0.4954, 9.316e-3, 1.353e-4, 4.511e-7],
        },
    ];
    convergence(&Convergence {
        cycles: &[0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10],
        accepted: &[true, false, true, true, true, true, true, true, true, true, true, true],
        objective: QuantityLabel::new("objective *F*", "mm^2"),
        objective_values: &[3486.0, 130.3, 626.0, 85.0, 32.25, 14.55, 5.658, 3.942, 3.772, 3.746, 3.746, 3.746],
        objective_logarithmic: true,
        measures: &measures,
        measure: QuantityLabel::new("error, step", "%"),
    })
}

fn history() -> Result<Figure> {
    let times = times(101);
    let course = |k, c| -> Vec<f64> { times.iter().map(|&t| motion(k, c, t)[1]).collect() };
    let (before, after) = (course(1.0, 0.3), course(0.36276112, 0.48230674));
    let lowest = (0..101).min_by(|&p, &q| after[p].total_cmp(&after[q])).unwrap_or(0);
    let kept: Vec<usize> = [0, 1, 2].into_iter().chain(lowest - 2..=lowest + 2).collect();
    time_history(&TimeHistory {
        time: QuantityLabel::new("time *t*", "s"),
        response: QuantityLabel::new("acceleration", "m s^{-2}"),
        times: &times,
        histories: &[
            ResponseHistory { name: "first design", values: &before },
            ResponseHistory { name: "optimum", values: &after },
        ],
        bounds: &[
            TimeBound { value: -0.52028604, side: FeasibleSide::Above },
            TimeBound { value: 0.52028604, side: FeasibleSide::Below },
        ],
        kept: &kept,
        active: &[lowest],
    })
}

/// An invented bending stress: a vibration at two frequencies.
fn field() -> Result<Figure> {
    let wave = |scale: f64, length: f64| {
        Grid::sample([0.2, 0.4], [0.0, length], [201, 21], move |t, s| {
            let shape = (std::f64::consts::PI * s / length).sin();
            scale * shape * ((31.4 * t).sin() + 0.35 * (260.0 * t + 3.0 * s).sin())
        })
    };
    let (crank, coupler, rocker) = (wave(1.1e7, 0.3048)?, wave(2.6e7, 0.9144)?, wave(1.9e7, 0.762)?);
    stress_field(&StressField {
        time: QuantityLabel::new("time *t*", "s"),
        position: QuantityLabel::new("position", "m"),
        stress: QuantityLabel::new("bending stress *σ*", "Pa"),
        links: &[("crank", &crank), ("coupler", &coupler), ("rocker", &rocker)],
        allowable: Some(2.758e7),
        marked: &[(1, [0.2451, 0.46])],
    })
}

fn profile() -> Result<Figure> {
    let fail = f64::INFINITY;
    performance_profile(
        "analyses",
        &[
            Solver { name: "slp", costs: &[6.0, 9.0, 12.0, 19.0, 14.0, 30.0] },
            Solver { name: "moving peaks", costs: &[6.0, 8.0, 12.0, 15.0, 12.0, 22.0] },
            Solver { name: "conservative (GCMMA)", costs: &[9.0, 12.0, 31.0, fail, 12.0, 18.0] },
            Solver { name: "direct SQP", costs: &[9.0, 23.0, 44.0, fail, 20.0, 41.0] },
        ],
    )
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "gallery".to_owned());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let [acceleration, comfort] = figure_3_and_5()?;
    let axes = [QuantityLabel::new("*x*", "mm"), QuantityLabel::new("*y*", "mm")];
    let (here, there) = (slider_crank_at(&OPTIMUM, 0.0).1, slider_crank_at(&OPTIMUM, 2.2).1);
    let figures = [
        ("design_plane_acceleration", acceleration),
        ("design_plane_comfort", comfort),
        ("time_point_constraints", figure_4()?),
        ("coupler_curve", figure_6()?),
        ("mechanism", mechanism(&axes, &[("start of the cycle", &here), ("126° later", &there)])?),
        ("convergence", convergence_of_table_4()?),
        ("time_history", history()?),
        ("stress_field", field()?),
        ("performance_profile", profile()?),
    ];
    for (name, figure) in figures {
        figure.save(folder, name)?;
    }
    std::fs::write(folder.join("motion.html"), animation()?.page())?;
    std::fs::write(folder.join("motion.gif"), animation()?.gif(96.0)?)?;
    Ok(())
}
