//! Driven mechanisms that come close to singular positions: they stay on the branch of their assembly, and where they cannot this is told.

use linkwright_mechanics::analyses::kinematics::warn_of_motion;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::mechanism::Pose3;
use linkwright_mechanics::motion::{ConstantSpeed, Harmonic};
use linkwright_mechanics::{Assembly, Mechanism, Pose, Result, kinematics};

/// Amplitude (m) and frequency (rad/s) of the drive.
const AMPLITUDE: f64 = 0.2;
const FREQUENCY: f64 = 6.0;

/// The distance between the ends of a dyad of two links of 1 m, which comes within `gap` (m) of its largest value.
fn distance(gap: f64, t: f64) -> f64 {
    2.0 - gap - AMPLITUDE + AMPLITUDE * (FREQUENCY * t).sin()
}

/// The dyad between a pivot and a slider that is driven. Output: height of the pin between the links, which are built above the slideway.
fn dyad(gap: f64) -> Mechanism<f64> {
    let mut m = Mechanism::new();
    let ground = m.ground();
    let start = distance(gap, 0.0);
    let angle = (0.5 * start).acos();
    let [x, y] = [0.5 * start, angle.sin()];
    let first = m.body("first", 1.0, 0.1, Pose { x: 0.0, y: 0.0, theta: angle });
    let second = m.body("second", 1.0, 0.1, Pose { x, y, theta: -angle });
    let slider = m.point_mass("slider", 1.0, start, 0.0);
    m.revolute("pivot", ground.origin(), first.origin());
    m.revolute("pin", first.at(1.0, 0.0), second.origin());
    m.revolute("end", second.at(1.0, 0.0), slider.origin());
    m.fix(slider.y);
    m.driver("drive", ground.x, slider.x, Harmonic, &[2.0 - gap - AMPLITUDE, AMPLITUDE, FREQUENCY, 0.0]);
    let sensor = m.sensor("pin", second.origin());
    let height = m.measure(sensor, "y").unwrap();
    m.output("height", &[height]);
    m
}

/// The dyad as bodies in space: a hinge, a ball joint and a universal joint, which keeps the second link from turning about its axis.
fn dyad_in_space(gap: f64) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity3([0.0; 3]);
    let (plane, ground) = (m.ground(), m.ground3());
    let start = distance(gap, 0.0);
    let angle = (0.5 * start).acos();
    let [x, y] = [0.5 * start, angle.sin()];
    let [up, down] =
        [angle, -angle].map(|angle| linkwright_mechanics::mechanism::Rotation::about([0.0, 0.0, 1.0], angle));
    let properties = MassProperties3::principal(1.0, [0.1; 3]);
    let first = m.body3("first", properties, Pose3::new([0.0; 3], up));
    let second = m.body3("second", properties, Pose3::new([x, y, 0.0], down));
    let slider = m.body3("slider", properties, Pose3::at([start, 0.0, 0.0]));
    m.revolute3("pivot", ground.origin(), first.origin());
    m.spherical("pin", first.at([1.0, 0.0, 0.0]), second.origin());
    m.universal("end", second.at([1.0, 0.0, 0.0]), slider.origin().with_z([0.0, 1.0, 0.0]));
    let along = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let guide = [ground.origin().with_z_x(along.0, along.1), slider.origin().with_z_x(along.0, along.1)];
    m.prismatic3("guide", guide[0], guide[1]);
    let stroke = m.joint_displacement("stroke", guide[0], guide[1]);
    m.driver("drive", plane.x, stroke, Harmonic, &[2.0 - gap - AMPLITUDE, AMPLITUDE, FREQUENCY, 0.0]);
    let sensor = m.sensor3("pin", second.origin());
    let height = m.measure(sensor, "y").unwrap();
    m.output("height", &[height]);
    m
}

fn times(end: f64, intervals: u32) -> Vec<f64> {
    (0..=intervals).map(|k| end * f64::from(k) / f64::from(intervals)).collect()
}

/// The motion is exact however few time points there are: none is at the closest distance.
#[test]
fn a_dyad_that_turns_back_before_its_dead_centre_stays_on_its_side() {
    for build in [dyad, dyad_in_space] {
        for gap in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10] {
            for intervals in [1, 2, 7, 60, 241] {
                let (m, times) = (build(gap), times(2.1, intervals));
                let heights = kinematics(&m, Assembly::default(), &times).unwrap().remove(0);
                for (t, height) in times.iter().zip(heights) {
                    let exact = (1.0 - 0.25 * distance(gap, *t).powi(2)).sqrt();
                    assert!(
                        (height - exact).abs() < 1e-7,
                        "gap {gap}, {intervals} intervals, t = {t}: {height} {exact}"
                    );
                }
                assert!(warn_of_motion(&m, &Assembly::default(), &times).is_empty());
            }
        }
    }
}

/// The reach ends where sin 6 t = 1 − 0.001/0.2, which is between two time points.
#[test]
fn a_drive_beyond_the_dead_centre_is_an_error_at_its_time() {
    let end = (1.0 - 1e-3 / AMPLITUDE).asin() / FREQUENCY;
    for intervals in [7, 60, 241] {
        let error = kinematics(&dyad(-1e-3), Assembly::default(), &times(2.1, intervals)).unwrap_err().to_string();
        let found = error.split("t = ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
        assert!(found.is_some_and(|t| (t - end).abs() < 1e-3), "{end}: {error}");
    }
}

/// A parallelogram with a driven crank, which is flat at π/2 · s and goes on as a parallelogram.
fn parallelogram() -> Result<Mechanism<f64>> {
    let mut m = Mechanism::new();
    let ground = m.ground();
    let start = std::f64::consts::FRAC_PI_2;
    let crank = m.body("crank", 1.0, 0.1, Pose { x: 0.0, y: 0.0, theta: start });
    let rocker = m.body("rocker", 1.0, 0.1, Pose { x: 2.0, y: 0.0, theta: start });
    let coupler = m.body("coupler", 1.0, 0.1, Pose { x: 0.0, y: 1.0, theta: 0.0 });
    m.revolute("left", ground.origin(), crank.origin());
    m.revolute("right", ground.at(2.0, 0.0), rocker.origin());
    m.revolute("left pin", crank.at(1.0, 0.0), coupler.origin());
    m.revolute("right pin", rocker.at(1.0, 0.0), coupler.at(2.0, 0.0));
    m.driver("motor", ground.theta, crank.theta, ConstantSpeed, &[start, 1.0]);
    let sensor = m.coordinate_sensor("rocker", ground.theta, rocker.theta);
    let angle = m.measure(sensor, "position")?;
    m.output("angle", &[angle]);
    Ok(m)
}

#[test]
fn a_parallelogram_that_becomes_flat_goes_on_and_this_is_told() {
    let m = parallelogram().unwrap();
    for intervals in (1..300).step_by(7).chain([11, 60, 241]) {
        let times = times(4.0, intervals);
        let angles = kinematics(&m, Assembly::default(), &times).unwrap().remove(0);
        for (t, angle) in times.iter().zip(angles) {
            assert!((angle - t - std::f64::consts::FRAC_PI_2).abs() < 1e-9, "{intervals} intervals, t = {t}: {angle}");
        }
        let warning = warn_of_motion(&m, &Assembly::default(), &times).remove(0);
        let found = warning.split("t = ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
        assert!(warning.contains("right pin") || warning.contains("left pin"), "{warning}");
        assert!(found.is_some_and(|t| (t - std::f64::consts::FRAC_PI_2).abs() < 1e-4), "{warning}");
        let quarter = &times[..=usize::try_from(intervals / 4).unwrap()];
        assert!(warn_of_motion(&m, &Assembly::default(), quarter).is_empty());
    }
}
