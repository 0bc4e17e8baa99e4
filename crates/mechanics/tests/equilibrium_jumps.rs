//! Load paths that jump from one equilibrium to a distant one are told, and others are not.

use linkwright_mechanics::analyses::equilibrium_jumps::warn_of_equilibrium_jumps;
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Motion};
use linkwright_mechanics::{Mechanism, Pose, Statics, equilibria};

const STIFFNESS: f64 = 1e4;
const SPAN: f64 = 1.0;
const HEIGHT: f64 = 0.3;

/// A load that jumps at 0.5 s: p = \[load\].
struct Step;

impl Motion for Step {
    fn position<T: autodiff::Scalar>(&self, p: &[T], t: T) -> T {
        if t.re() < 0.5 { T::from(0.0) } else { p[0] }
    }
}

/// Two bars, which are springs, from the ground at (± span, 0) to a node at (0, height), with the given vertical load on it.
fn shallow_truss(load: impl Motion, parameters: &[f64], is_pulled: bool) -> Mechanism<f64> {
    let mut m = Mechanism::new();
    let node = m.body("node", 1.0, 1.0, Pose { x: 0.0, y: HEIGHT, theta: 0.0 });
    m.fix(node.x);
    m.fix(node.theta);
    let length = SPAN.hypot(HEIGHT);
    for side in [-1.0, 1.0] {
        m.spring_damper("bar", m.ground().at(side * SPAN, 0.0), node.at(0.0, 0.0), [STIFFNESS, 0.0, length]);
    }
    let ends = if is_pulled { [m.ground().y, node.y] } else { [node.y, m.ground().y] };
    m.load("load", ends[0], ends[1], load, parameters);
    let sensor = m.coordinate_sensor("height", m.ground().y, node.y);
    let height = m.measure(sensor, "position").unwrap();
    m.output("height", &[height]);
    m
}

/// The largest load of the truss (N): of P(y) = 2 k y (L₀/L − 1), L² = y² + b², where L³ = L₀ b².
fn limit_load() -> f64 {
    let unloaded = SPAN.hypot(HEIGHT);
    let length = (unloaded * SPAN * SPAN).cbrt();
    let height = (length * length - SPAN * SPAN).sqrt();
    2.0 * STIFFNESS * height * (unloaded / length - 1.0)
}

fn times(count: usize) -> Vec<f64> {
    (0..count).map(|k| k as f64 / (count - 1) as f64).collect()
}

#[test]
fn a_truss_that_snaps_through_is_told_with_the_time() {
    let full = 2.2 * limit_load();
    for count in [2, 3, 11, 51] {
        let m = shallow_truss(ConstantSpeed, &[0.0, full], false);
        let warning = warn_of_equilibrium_jumps(&m, &Statics::default(), &times(count)).unwrap();
        println!("{count} points: {warning}");
        let times: Vec<f64> = warning.split(['=', ' ']).filter_map(|word| word.parse().ok()).collect();
        assert!(warning.starts_with("node.y: the equilibrium jumps between t = "), "{warning}");
        assert!(times[0] < 1.0 / 2.2 && times[1] > 1.0 / 2.2 && times[1] - times[0] < 0.1, "{warning}");
    }
}

/// The equilibrium beyond the limit load does not depend on the number of steps.
#[test]
fn small_steps_of_the_load_snap_through_as_large_ones() {
    let full = 2.2 * limit_load();
    let m = shallow_truss(ConstantSpeed, &[0.0, full], false);
    for count in [2, 11, 51, 401, 5001] {
        let found = equilibria(&m, &Statics::default(), &times(count)).unwrap();
        let height = *found[0].last().unwrap();
        let length = SPAN.hypot(height);
        let force = 2.0 * STIFFNESS * height * (SPAN.hypot(HEIGHT) / length - 1.0);
        assert!(height < -HEIGHT && (force / full - 1.0).abs() < 1e-8, "{count} points: {height}, {force}");
    }
}

#[test]
fn smooth_paths_and_loads_that_jump_are_not_told() {
    let statics = Statics::default();
    let full = limit_load();
    for count in [2, 3, 11, 51] {
        // Up to the limit load, and by tension.
        for (load, is_pulled) in [(0.999 * full, false), (10.0 * full, true)] {
            let m = shallow_truss(ConstantSpeed, &[0.0, load], is_pulled);
            assert_eq!(warn_of_equilibrium_jumps(&m, &statics, &times(count)), None, "{load} N, {count} points");
        }
        let m = shallow_truss(Step, &[10.0 * full], true);
        assert_eq!(warn_of_equilibrium_jumps(&m, &statics, &times(count)), None, "step, {count} points");
        let m = shallow_truss(Fixed, &[0.5 * full], false);
        assert_eq!(warn_of_equilibrium_jumps(&m, &statics, &times(count)), None, "constant, {count} points");
    }
}
