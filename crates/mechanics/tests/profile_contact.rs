//! Cams with followers that can leave them, compared with separate integrations for the exact circle.

use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright_mechanics::motion::ConstantSpeed;
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, Mechanism, ParametricMechanism, Pose, Result};

const STIFFNESS: f64 = 2e5;
const DAMPING: f64 = 0.3;
const RADIUS: f64 = 0.05;
const ROLLER: f64 = 0.02;
const MASS: f64 = 0.8;

/// Height of the follower at the start, 1 mm deep in contact.
fn start(has_face: bool) -> f64 {
    RADIUS + if has_face { 0.0 } else { ROLLER } - 1e-3
}

/// An eccentric disk, driven, with a follower above its axis that a spring presses down: eccentricity, speed of the cam, stiffness of the
/// spring. The follower has a flat face or a roller.
struct Cam {
    has_face: bool,
}

impl ParametricMechanism for Cam {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, number) = (S::from(0.0), S::from);
        let mut m = Mechanism::with_gravity(zero, number(-9.81));
        let cam = m.body("cam", number(1.0), number(0.01), Pose { x: zero, y: zero, theta: zero });
        let ground = m.ground();
        m.revolute("axis", ground.origin(), cam.origin());
        m.drive(cam.theta, ConstantSpeed, &[zero, b[1]]);
        let top = number(start(self.has_face));
        let follower = m.body("follower", number(MASS), number(0.01), Pose { x: zero, y: top, theta: zero });
        m.set_velocity(follower.y, b[0] * b[1]);
        for coordinate in [follower.x, follower.theta] {
            m.fix(coordinate);
        }
        m.coordinate_spring("spring", ground.y, follower.y, [b[2], zero, zero, zero]);
        let points: Vec<[S; 2]> = (0..80)
            .map(|k| (f64::from(k) * std::f64::consts::TAU / 80.0).sin_cos())
            .map(|(sin, cos)| [b[0] + RADIUS * cos, number(RADIUS * sin)])
            .collect();
        let contact = match self.has_face {
            true => {
                let down = number(std::f64::consts::PI);
                m.profile_face(
                    "contact",
                    cam.origin(),
                    follower.origin(),
                    [down, number(STIFFNESS), number(DAMPING)],
                    &points,
                )
            }
            false => {
                let law = [ROLLER, STIFFNESS, DAMPING].map(number);
                m.profile_contact("contact", cam.origin(), follower.origin(), law, &points)
            }
        };
        let height = m.coordinate_sensor("height", ground.y, follower.y);
        let torque = m.driving_force(cam.theta);
        let (height, force) = (m.measure(height, "position")?, m.measure(contact, "contact_force")?);
        for (name, term) in [("height", height), ("force", force), ("torque", torque)] {
            m.output(name, &[term]);
        }
        Ok(m)
    }
}

/// Contact force, its component along y, and its moment on the cam, of the exact disk.
fn contact(has_face: bool, [e, speed, _]: [f64; 3], t: f64, [y, v]: [f64; 2]) -> [f64; 3] {
    let (sin, cos) = (speed * t).sin_cos();
    let (centre, rate) = ([e * cos, e * sin], [-e * speed * sin, e * speed * cos]);
    let law = |depth: f64, rate: f64| {
        if depth <= 0.0 { 0.0 } else { (STIFFNESS * depth.powf(1.5) * (1.0 + 1.5 * DAMPING * rate)).max(0.0) }
    };
    if has_face {
        // It pushes the cam down at the point above the centre of the disk.
        let force = law(centre[1] + RADIUS - y, rate[1] - v);
        return [force, force, -force * centre[0]];
    }
    let gap = [-centre[0], y - centre[1]];
    let distance = gap[0].hypot(gap[1]);
    let normal = gap.map(|x| x / distance);
    let closing = rate[0] * normal[0] + (rate[1] - v) * normal[1];
    let force = law(RADIUS + ROLLER - distance, closing);
    [force, force * normal[1], -force * (centre[0] * normal[1] - centre[1] * normal[0])]
}

/// Height of the follower, contact force and driving torque at the times, by the classical Runge–Kutta method with steps of 5 µs.
fn integrated(has_face: bool, b: [f64; 3], times: &[f64]) -> [Vec<f64>; 3] {
    let rate = |t: f64, y: [f64; 2]| [y[1], (contact(has_face, b, t, y)[1] - b[2] * y[0]) / MASS - 9.81];
    let (mut y, mut k, h) = ([start(has_face), b[0] * b[1]], 0, 5e-6);
    let mut all = [vec![], vec![], vec![]];
    for &end in times {
        while (f64::from(k) + 0.5) * h < end {
            let t = f64::from(k) * h;
            let along = |k: [f64; 2], h: f64| [y[0] + h * k[0], y[1] + h * k[1]];
            let k1 = rate(t, y);
            let k2 = rate(t + 0.5 * h, along(k1, 0.5 * h));
            let k3 = rate(t + 0.5 * h, along(k2, 0.5 * h));
            let k4 = rate(t + h, along(k3, h));
            y = [0, 1].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            k += 1;
        }
        let [force, _, moment] = contact(has_face, b, end, y);
        // The disk itself turns about its own centre of mass at the axis: the drive balances the contact only.
        [y[0], force, -moment].into_iter().zip(&mut all).for_each(|(value, to)| to.push(value));
    }
    all
}

const DESIGN: [f64; 3] = [0.01, 40.0, 500.0];

#[test]
fn followers_move_as_on_the_exact_disk_and_lose_contact_at_high_speed() {
    let times: Vec<f64> = (1..=20).map(|k| 0.01 * f64::from(k)).collect();
    for has_face in [true, false] {
        let plain = Cam { has_face }.build(&DESIGN).unwrap();
        let expected = integrated(has_face, DESIGN, &times);
        let explicit = simulate_explicitly(&plain, &Explicit::adaptive(1e-10), &times).unwrap().values;
        let settings = Dynamics { scheme: GeneralizedAlpha::chung_hulbert(0.9).unwrap(), ..Dynamics::fixed(2e-5) };
        let implicit = simulate(&plain, &settings, &times).unwrap().values;
        for (values, tolerance) in [(explicit, 5e-5), (implicit, 1e-3)] {
            for (k, (values, expected)) in values.iter().zip(&expected).enumerate() {
                let size = expected.iter().fold(0.0f64, |a, x| a.max(x.abs()));
                for (a, b) in values.iter().zip(expected) {
                    assert!((a - b).abs() < tolerance * size, "{has_face}, output {k}:\n{values:?}\n{expected:?}");
                }
            }
        }
        let fast = simulate_explicitly(
            &Cam { has_face }.build(&[0.01, 80.0, 500.0]).unwrap(),
            &Explicit::adaptive(1e-9),
            &times,
        );
        assert!(fast.unwrap().values[1].contains(&0.0), "the follower flies");
    }
}

#[test]
fn derivatives_are_those_of_the_motion() {
    let times = [0.03, 0.07];
    for has_face in [true, false] {
        let (model, settings) =
            (Cam { has_face }, Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(1e-4)));
        let direct = differentiate_explicitly(&model, &DESIGN, &settings, &times).unwrap();
        let all: Vec<_> = (0..3).flat_map(|o| (0..2).map(move |p| AdjointFunctional::at(o, p))).collect();
        let adjoint = differentiate_explicitly_backwards(&model, &DESIGN, &settings, &times, &all).unwrap();
        for k in 0..3 {
            let h = 1e-5 * DESIGN[k];
            let [above, below] = [h, -h].map(|h| {
                let mut b = DESIGN;
                b[k] += h;
                simulate_explicitly(&model.build(&b).unwrap(), &settings, &times).unwrap().values
            });
            for o in 0..3 {
                for p in 0..2 {
                    let difference = (above[o][p] - below[o][p]) / (2.0 * h);
                    let gradient = direct.gradients[o][p][k];
                    let size = direct.gradients[o].iter().fold(difference.abs(), |a, g| a.max(g[k].abs()));
                    assert!(
                        (gradient - difference).abs() < 1e-4 * size,
                        "{has_face} {o} {p} {k}: {gradient} {difference}"
                    );
                    assert!((adjoint[(2 * o + p, k)] - gradient).abs() < 1e-7 * size, "{has_face} {o} {p} {k}");
                }
            }
        }
    }
}
