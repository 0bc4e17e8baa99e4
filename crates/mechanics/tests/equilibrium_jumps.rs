//! Load paths that jump from one equilibrium to a distant one are told, and others are not.

use linkwright_mechanics::analyses::equilibrium_jumps::warn_of_equilibrium_jumps;
use linkwright_mechanics::analyses::kinematics::kinematics;
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Motion};
use linkwright_mechanics::{Assembly, Mechanism, Pose, Statics, equilibria};

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

/// A four-bar without free degrees of freedom, whose crank of the length `l[1]` turns by `angle` (rad) in 1 s.
fn four_bar(l: [f64; 4], angle: f64) -> Mechanism<f64> {
    let [ground, crank, coupler, rocker] = l;
    // The crank begins at 1 rad; the joint between coupler and rocker is above.
    let elbow = [crank * 1f64.cos(), crank * 1f64.sin()];
    let (dx, dy) = (ground - elbow[0], -elbow[1]);
    let reach = dx.hypot(dy);
    let inner = ((coupler * coupler + reach * reach - rocker * rocker) / (2.0 * coupler * reach)).acos();
    let theta = dy.atan2(dx) + inner;
    let tip = [elbow[0] + coupler * theta.cos(), elbow[1] + coupler * theta.sin()];
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let a = m.body("crank", 1.0, 0.1, Pose { x: 0.0, y: 0.0, theta: 1.0 });
    let b = m.body("coupler", 1.0, 0.1, Pose { x: elbow[0], y: elbow[1], theta });
    let c = m.body("rocker", 1.0, 0.1, Pose { x: ground, y: 0.0, theta: tip[1].atan2(tip[0] - ground) });
    m.revolute("O", m.ground().origin(), a.origin());
    m.revolute("A", a.at(crank, 0.0), b.origin());
    m.revolute("B", b.at(coupler, 0.0), c.at(rocker, 0.0));
    m.revolute("C", m.ground().at(ground, 0.0), c.origin());
    m.drive(a.theta, ConstantSpeed, &[1.0, angle]);
    for (name, body) in [("coupler", b), ("rocker", c)] {
        let sensor = m.coordinate_sensor(name, m.ground().theta, body.theta);
        let angle = m.measure(sensor, "position").unwrap();
        m.output(name, &[angle]);
    }
    m
}

#[test]
fn drives_keep_the_assembly_and_count_turns() {
    let turn = std::f64::consts::TAU;
    // Drag links, which turn with the crank, and crank-rockers.
    for l in [
        [0.3, 1.0, 1.1, 0.9],
        [0.5, 1.2, 0.9, 1.0],
        [0.97, 1.0, 1.02, 1.0],
        [1.0, 0.3, 0.9, 0.8],
        [1.0, 0.28, 0.75, 1.0],
    ] {
        for size in [1.0, 1e-3, 1e3] {
            let m = four_bar(l.map(|x| x * size), 3.0 * turn);
            let fine = kinematics(&m, Assembly::default(), &times(1081)).unwrap();
            for count in [109, 55, 37, 13, 4] {
                let coarse = equilibria(&m, &Statics::default(), &times(count)).unwrap();
                let stride = 1080 / (count - 1);
                for (name, (coarse, fine)) in ["coupler", "rocker"].iter().zip(coarse.iter().zip(&fine)) {
                    for (k, angle) in coarse.iter().enumerate() {
                        let exact = fine[k * stride];
                        assert!(
                            (angle - exact).abs() < 1e-8,
                            "{l:?} of {size}, {count} times: {name} at {k} is {angle} for {exact}"
                        );
                    }
                }
                assert_eq!(
                    warn_of_equilibrium_jumps(&m, &Statics::default(), &times(count)),
                    None,
                    "{l:?}, {count} times"
                );
            }
        }
    }
}
