//! The table of docs/sensitivities.md: every element and every kind of parameter against differences.
//!
//! `UPDATE_DOCS=1 cargo test --test mechanics table` rewrites it.

use crate::zoo::{Arm, Cam, Drives, Forces, JointFriction, Joints, fixed};
use linkwright::cases::SpinningBeam;
use linkwright::mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright::mechanics::derivatives::history::SensitiveHistory;
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::mechanics::mechanism::ParametricMechanism;
use std::fmt::Write;

/// Name of an element, its parameters in words, and which design variables of its mechanism these are.
pub type Label = (&'static str, &'static str, &'static [usize]);

/// Deviations of one row: implicit and explicit steps; none for stiff mechanisms.
struct Row {
    label: Label,
    implicit: f64,
    explicit: Option<f64>,
}

/// Deviation of each design variable from differences by central steps h, h/2 and h/4, twice extrapolated.
///
/// Steps are relative to the variable's size, or to `floor` if that is more.
///
/// Errors are relative to the largest derivative of the same output with respect to the same variable, or to a thousandth
/// of its largest scaled derivative with respect to any if that is more. The smallest deviation of three
/// steps is used: large steps suffer from curvature, small ones from rounding.
fn deviations(b: &[f64], floor: f64, exact: &SensitiveHistory, run: impl Fn(&[f64]) -> Vec<Vec<f64>>) -> Vec<f64> {
    let scale = |k: usize| b[k].abs().max(floor);
    let largest =
        |o: usize, k: usize| exact.gradients[o].iter().fold(0.0f64, |a, gradient| a.max(gradient[k].abs() * scale(k)));
    let of_any: Vec<f64> =
        (0..exact.gradients.len()).map(|o| (0..b.len()).map(|k| largest(o, k)).fold(0.0, f64::max)).collect();
    let deviation = |k: usize, h: f64| {
        let values = |step: f64| {
            let mut moved = b.to_vec();
            moved[k] += step * scale(k);
            run(&moved)
        };
        let runs = [h, 0.5 * h, 0.25 * h].map(|h| (h, values(h), values(-h)));
        let mut worst = 0.0f64;
        for (o, series) in exact.gradients.iter().enumerate() {
            let unit = largest(o, k).max(1e-3 * of_any[o]).max(f64::MIN_POSITIVE);
            for (t, gradient) in series.iter().enumerate() {
                let [d1, d2, d3] = [0, 1, 2].map(|j: usize| (runs[j].1[o][t] - runs[j].2[o][t]) / (2.0 * runs[j].0));
                let (e1, e2) = ((4.0 * d2 - d1) / 3.0, (4.0 * d3 - d2) / 3.0);
                worst = worst.max((gradient[k] * scale(k) - (16.0 * e2 - e1) / 15.0).abs() / unit);
            }
        }
        worst
    };
    (0..b.len()).map(|k| [5e-2, 1e-2, 2e-3].map(|h| deviation(k, h)).into_iter().fold(f64::MAX, f64::min)).collect()
}

/// Rows of one mechanism.
fn rows<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    labels: &[Label],
    (end, floor, step): (f64, f64, f64),
    is_stiff: bool,
) -> Vec<Row> {
    let times: Vec<f64> = (1..=6).map(|k| end * f64::from(k) / 6.0).collect();
    let settings = fixed(step);
    let exact = differentiate(model, b, &settings, &times).unwrap();
    let implicit =
        deviations(b, floor, &exact, |b| simulate(&model.build(b).unwrap(), &settings, &times).unwrap().values);
    let explicit = (!is_stiff).then(|| {
        let settings = Explicit::adaptive(1.0).with_step_control(StepControl::Fixed(0.01));
        let exact = differentiate_explicitly(model, b, &settings, &times).unwrap();
        deviations(b, floor, &exact, |b| {
            simulate_explicitly(&model.build(b).unwrap(), &settings, &times).unwrap().values
        })
    });
    let worst = |of: &[f64], which: &[usize]| which.iter().map(|&k| of[k]).fold(0.0, f64::max);
    let row = |&label: &Label| Row {
        label,
        implicit: worst(&implicit, label.2),
        explicit: explicit.as_ref().map(|e| worst(e, label.2)),
    };
    labels.iter().map(row).collect()
}

fn all_rows() -> Vec<Row> {
    let beam = SpinningBeam { elements: 4, speed: 6.0, duration: 0.455 };
    let section: [Label; 2] =
        [("beam", "EA, GA, EI, mass and rotary inertia per length", &[0, 1, 2, 3, 4]), ("beam", "length", &[5])];
    let arm: [Label; 3] = [
        ("beam", "width and height of the section, length", &[0, 1, 2]),
        ("gravity", "acceleration", &[7]),
        ("start-up of a drive", "speed, duration", &[5, 6]),
    ];
    let free: [Label; 1] = [("linear drive", "mean, amplitude, frequency", &[18, 28, 29])];
    [
        rows(&Forces, &Forces::DESIGN, &Forces::LABELS, (0.6, 1e-2, 0.02), false),
        rows(&Joints { length_driver: false }, &Joints::DESIGN, &Joints::LABELS, (0.24, 0.1, 0.04), false),
        rows(&Joints { length_driver: true }, &Joints::DESIGN, &free, (0.24, 0.1, 0.04), false),
        rows(&JointFriction, &JointFriction::DESIGN, &JointFriction::LABELS, (0.24, 1e-2, 0.04), false),
        rows(&Cam, &Cam::DESIGN, &Cam::LABELS, (0.6, 1e-2, 0.02), false),
        rows(&Drives, &Drives::DESIGN, &Drives::LABELS, (0.6, 1e-2, 0.02), false),
        rows(&beam, &SpinningBeam::DESIGN, &section, (0.6, 1e-6, 0.02), true),
        rows(&Arm { elements: 4 }, &Arm::DESIGN, &arm, (0.3, 1e-6, 0.02), true),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Largest deviation of a row. The figures themselves are the rounding of differences, which varies between machines.
const LARGEST: f64 = 1e-7;

/// A power of ten above the deviation, with a margin.
fn bound(deviation: f64) -> f64 {
    10f64.powf((2.0 * deviation).max(1e-12).log10().ceil())
}

fn text(rows: &[Row]) -> String {
    let mut text = "| element | parameters | implicit steps | explicit steps |\n|---|---|---|---|\n".to_owned();
    for Row { label: (element, parameters, _), implicit, explicit } in rows {
        let explicit = explicit.map_or("–".to_owned(), |e| format!("{:.0e}", bound(e)));
        writeln!(text, "| {element} | {parameters} | {:.0e} | {explicit} |", bound(*implicit)).unwrap();
    }
    text
}

const BEGIN: &str = "<!-- table of elements: made by tests/mechanics/table.rs -->\n";
const END: &str = "<!-- end of the table of elements -->";

#[test]
fn the_table_of_elements_in_the_docs_holds() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/sensitivities.md");
    let page = std::fs::read_to_string(path).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (table, after) = rest.split_once(END).unwrap();
    let rows = all_rows();
    for Row { label, implicit, explicit } in &rows {
        println!("{} ({}): {implicit:.1e} {explicit:.1e}", label.0, label.1, explicit = explicit.unwrap_or(0.0));
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, format!("{before}{BEGIN}{}{END}{after}", text(&rows))).unwrap();
        return;
    }
    let documented: Vec<Vec<&str>> =
        table.lines().skip(2).map(|line| line.split('|').map(str::trim).collect()).collect();
    assert_eq!(documented.len(), rows.len(), "run this test with UPDATE_DOCS=1 to rewrite the table");
    for (cells, Row { label, implicit, explicit }) in documented.iter().zip(&rows) {
        assert_eq!((cells[1], cells[2]), (label.0, label.1), "run this test with UPDATE_DOCS=1 to rewrite the table");
        for (cell, deviation) in [(cells[3], Some(*implicit)), (cells[4], *explicit)] {
            let Some(deviation) = deviation else { continue };
            let figure: f64 = cell.parse().unwrap();
            assert!(deviation <= LARGEST && figure <= LARGEST, "{} ({}): {deviation:.1e}", label.0, label.1);
        }
    }
}
