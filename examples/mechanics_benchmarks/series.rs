//! The analyses from which orders of convergence are measured.

use super::table::{Reference, Series};

// Edits that replace adaptive steps of order 8 by steps of the size `{}`.
const GENERALIZED_ALPHA: &str = "scheme = \"rk8\"\ntolerance = 1e-12 => step = {}";
const HHT: &str = "scheme = \"rk8\"\ntolerance = 1e-12 => scheme = \"hht\"\\nstep = {}";
const RK5: &str = "scheme = \"rk8\"\ntolerance = 1e-12 => scheme = \"rk5\"\\nstep = {}";
const RK5_ABSOLUTE: &str =
    "scheme = \"rk8\"\ntolerance = 1e-12 => scheme = \"rk5\"\\ncoordinates = \"absolute\"\\nstep = {}";
const RK8: &str = "tolerance = 1e-12 => step = {}";

/// All series; their exact values are those of `references.csv`.
pub fn all(references: &[Reference]) -> Vec<Series> {
    let series = |(model, output): (&'static str, (&'static str, f64)), scheme, change, sizes, order| {
        let same = |r: &&Reference| (&*r.model, &*r.output, &*r.by, r.time) == (model, output.0, "", output.1);
        let exact = references.iter().rfind(same).expect("references.csv has the number").value;
        Series { scheme, model, output, change, sizes, exact, order }
    };
    let (single, double) = (("benchmarks/a01", ("x", 10.0)), ("benchmarks/double-pendulum", ("x", 3.0)));
    let (axle, train) = (("benchmarks/car-axis", ("x_left", 3.0)), ("benchmarks/a02", ("angle", 10.0)));
    let beam = ("spinning-beam", ("across", 7.5));
    let circle = ("benchmarks/roll-up", ("y", 0.25));
    let dead = ("benchmarks/elastica", ("y", 10.0));
    let follower = ("benchmarks/follower-force", ("theta", 10.0));
    let elements = "elements = 100 => elements = {}";
    let spinning = "elements = 8 => elements = {} | step = 0.01 => step = 0.002";
    vec![
        series(single, "order 5, fixed step", RK5, [0.04, 0.02, 0.01], 5.0),
        series(single, "order 8, fixed step", RK8, [0.1, 0.05, 0.04], 8.0),
        series(double, "generalized-α", GENERALIZED_ALPHA, [4e-3, 2e-3, 1e-3], 2.0),
        series(double, "HHT", HHT, [4e-3, 2e-3, 1e-3], 2.0),
        series(double, "order 5, absolute coordinates", RK5_ABSOLUTE, [0.02, 0.01, 0.005], 5.0),
        series(axle, "generalized-α", GENERALIZED_ALPHA, [4e-3, 2e-3, 1e-3], 2.0),
        series(axle, "HHT", HHT, [4e-3, 2e-3, 1e-3], 2.0),
        series(axle, "order 5, fixed step", RK5, [0.02, 0.01, 0.005], 5.0),
        series(axle, "order 8, fixed step", RK8, [0.05, 0.025, 0.02], 8.0),
        series(train, "generalized-α", "..40\" => ..1\" | = 2e-3 => = {}", [4e-3, 2e-3, 1e-3], 2.0),
        series(beam, "beams", spinning, [8.0, 16.0, 32.0], 2.0),
        series(circle, "beams", "elements = 16 => elements = {}", [8.0, 16.0, 32.0], 2.0),
        series(dead, "beams", elements, [12.0, 25.0, 50.0], 2.0),
        series(follower, "beams", elements, [25.0, 50.0, 100.0], 2.0),
    ]
}
