//! Friction from the reaction of a joint against closed forms and an own integration; every derivative against differences.

use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::motion::ConstantSpeed;
use linkwright_mechanics::{
    Assembly, Dynamics, Error, GeneralizedAlpha, Mechanism, ParametricMechanism, Pose, Result, kinematics,
};

const G: f64 = 9.81;

fn settings(h: f64) -> Dynamics {
    Dynamics { scheme: GeneralizedAlpha::chung_hulbert(0.9).unwrap(), ..Dynamics::fixed(h) }
}

/// Largest difference of two series.
fn deviation(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A block of 2 kg on an incline, which starts downwards with 1 m/s: slope, coefficient of friction, length of the block.
/// Its centre is 0.03 m above its contact points.
struct Incline;

impl ParametricMechanism for Incline {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let [slope, coefficient, length] = [b[0], b[1], b[2]];
        let (zero, (sin, cos)) = (S::from(0.0), slope.sin_cos());
        let height = S::from(0.03);
        let mut m = Mechanism::with_gravity(zero, S::from(-G));
        let block =
            m.body("block", S::from(2.0), S::from(0.01), Pose { x: -sin * height, y: cos * height, theta: slope });
        m.set_velocity(block.x, -cos);
        m.set_velocity(block.y, -sin);
        let guide = m.prismatic("guide", m.ground().origin(), slope, block.at(zero, -height), slope);
        let friction = m.guide_friction("friction", guide, [coefficient, S::from(1e-3), length, S::from(1e-6)])?;
        let terms =
            [m.measure(guide, "position")?, m.measure(friction, "normal_force")?, m.measure(friction, "force")?];
        for (name, term) in ["position", "normal", "force"].iter().zip(terms) {
            m.output(*name, &[term]);
        }
        Ok(m)
    }
}

#[test]
fn a_block_slides_down_an_incline_as_coulomb_says() {
    // The friction at the lower face is at the lever of 0.03 m to the centre. It presses on the front, which has no effect on the
    // sum of the normal forces as long as both contact points press downwards: N = m g cos β.
    let (slope, mu) = (0.6f64, 0.3);
    let acceleration = G * (slope.sin() - mu * slope.cos());
    let times: Vec<f64> = (1..=10).map(|k| 0.05 * f64::from(k)).collect();
    let position: Vec<f64> = times.iter().map(|t| -t - 0.5 * acceleration * t * t).collect();
    let normal = vec![2.0 * G * slope.cos(); times.len()];
    for length in [0.0, 0.2] {
        let plain = Incline.build(&[slope, mu, length]).unwrap();
        let explicit = simulate_explicitly(&plain, &Explicit::adaptive(1e-10), &times).unwrap();
        let implicit = simulate(&plain, &settings(1e-3), &times).unwrap();
        for values in [explicit.values, implicit.values] {
            assert!(deviation(&values[0], &position) < 1e-8, "{values:?}\n{position:?}");
            assert!(deviation(&values[1], &normal) < 1e-6, "{values:?}");
            let force: Vec<f64> = normal.iter().map(|normal| -mu * normal).collect();
            assert!(deviation(&values[2], &force) < 1e-6, "{values:?}");
        }
    }
}

#[test]
fn a_short_block_jams_with_the_torque_of_its_own_friction() {
    // Its contact points are 0.01 m apart: the torque 0.03 m · F is carried by ±0.03 F / 0.01 = ±3 F, more than the weight.
    // N₁ + N₂ = 6 F, so that F = μ 6 F has no solution but rest for μ > 1/6, and with μ = 0.1: F = μ · max(N, 6 F).
    let (slope, mu) = (0.6f64, 0.1);
    let plain = Incline.build(&[slope, mu, 0.01]).unwrap();
    let history = simulate_explicitly(&plain, &Explicit::adaptive(1e-10), &[0.1]).unwrap();
    assert!((history.values[1][0] - 2.0 * G * slope.cos()).abs() < 1e-6, "{:?}", history.values);
    let locked = Incline.build(&[slope, 0.3, 0.01]).unwrap();
    let error = simulate_explicitly(&locked, &Explicit::adaptive(1e-10), &[0.1]).unwrap_err().to_string();
    assert!(error.contains("friction") && error.contains("lock"), "{error}");
}

/// A pendulum whose pin of radius `b[1]` has the coefficient of friction `b[0]`; mass `b[2]`, inertia `b[3]`, length `b[4]`.
struct Pendulum;

/// Transition speed in rad/s.
const SPEED: f64 = 0.05;

impl ParametricMechanism for Pendulum {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, start) = (S::from(0.0), S::from(0.9));
        let mut m = Mechanism::with_gravity(zero, S::from(-G));
        let (sin, cos) = start.sin_cos();
        let bob = m.body("bob", b[2], b[3], Pose { x: sin * b[4], y: -cos * b[4], theta: start });
        let pin = m.revolute("pin", m.ground().origin(), bob.at(zero, b[4]));
        let friction = m.revolute_friction("friction", pin, [b[0], b[1], S::from(SPEED), S::from(1e-6)])?;
        let sensor = m.sensor("angle", bob.origin());
        let terms = [m.measure(sensor, "theta")?, m.measure(friction, "moment")?, m.measure(friction, "normal_force")?];
        for (name, term) in ["theta", "moment", "normal"].iter().zip(terms) {
            m.output(*name, &[term]);
        }
        Ok(m)
    }
}

/// Reaction and angular acceleration of the pendulum: the friction torque κ R enters the reaction R, a quadratic equation.
///
/// Along the rod the pin carries T = m (g cos θ + L ω²), across it m L α + m g sin θ = A − B κ R, from I α = −m g L sin θ − κ R.
fn reaction([mu, radius, m, j, l]: [f64; 5], [theta, omega]: [f64; 2]) -> [f64; 2] {
    let (kappa, i) = (mu * radius * (omega / SPEED).tanh(), j + m * l * l);
    let along = m * (G * theta.cos() + l * omega * omega);
    let (across, b) = (m * G * theta.sin() * (1.0 - m * l * l / i), m * l / i);
    let (p, q) = (across * b * kappa, 1.0 - b * b * kappa * kappa);
    let r = (-p + (p * p + q * (along * along + across * across)).sqrt()) / q;
    [r, (-m * G * l * theta.sin() - kappa * r) / i]
}

/// Angle at the times by the classical Runge–Kutta method with steps of 0.1 ms.
fn integrated(p: [f64; 5], times: &[f64]) -> Vec<f64> {
    let rate = |[theta, omega]: [f64; 2]| [omega, reaction(p, [theta, omega])[1]];
    let (mut y, mut t, h) = ([0.9, 0.0], 0.0, 1e-4);
    let mut angles = Vec::new();
    for &end in times {
        while t < end - 0.5 * h {
            let along = |k: [f64; 2], h: f64| [y[0] + h * k[0], y[1] + h * k[1]];
            let k1 = rate(y);
            let k2 = rate(along(k1, 0.5 * h));
            let k3 = rate(along(k2, 0.5 * h));
            let k4 = rate(along(k3, h));
            y = [0, 1].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            t += h;
        }
        angles.push(y[0]);
    }
    angles
}

#[test]
fn a_pendulum_with_friction_in_its_pin_moves_as_the_scalar_equation_says() {
    let b = [0.6, 0.08, 1.5, 0.1, 0.5];
    let times: Vec<f64> = (1..=12).map(|k| 0.25 * f64::from(k)).collect();
    let plain = Pendulum.build(&b).unwrap();
    let expected = integrated(b, &times);
    let explicit = simulate_explicitly(&plain, &Explicit::adaptive(1e-11), &times).unwrap();
    assert!(deviation(&explicit.values[0], &expected) < 1e-8, "{:?}\n{expected:?}", explicit.values[0]);
    let [coarse, fine] = [2e-3, 1e-3].map(|h| {
        let history = simulate(&plain, &settings(h), &times).unwrap();
        deviation(&history.values[0], &expected)
    });
    assert!(fine < 2e-5 && coarse / fine > 3.0, "second order: {coarse:e} {fine:e}");
}

#[test]
fn the_amplitude_of_small_swings_decreases_linearly() {
    // The reaction is the weight: 2 μ r m g / (m g L) for each half swing, as of any oscillator with Coulomb friction.
    let (mu, radius, l) = (0.2, 0.01, 0.5);
    let p = [mu, radius, 1.5, 1e-9, l];
    let start = 0.04;
    let model = |b: &[f64]| -> Mechanism<f64> {
        let mut m = Mechanism::with_gravity(0.0, -G);
        let bob = m.body("bob", b[2], b[3], Pose { x: f64::sin(start) * l, y: -f64::cos(start) * l, theta: start });
        let pin = m.revolute("pin", m.ground().origin(), bob.at(0.0, l));
        m.revolute_friction("friction", pin, [b[0], b[1], 1e-5, 1e-6]).unwrap();
        let sensor = m.sensor("angle", bob.origin());
        let term = m.measure(sensor, "theta").unwrap();
        m.output("theta", &[term]);
        m
    };
    let period = 2.0 * std::f64::consts::PI * (l / G).sqrt();
    let history = simulate_explicitly(&model(&p), &Explicit::adaptive(1e-9), &[0.5 * period]).unwrap();
    let lost = start - history.values[0][0].abs();
    assert!((lost / (2.0 * mu * radius / l) - 1.0).abs() < 2e-3, "{lost:e}");
}

/// A crank of 0.1 m that turns with `b[0]` rad/s and moves a slider of `b[1]` kg by a rod of `b[2]` m without mass; the guide has
/// the coefficient of friction `b[3]`.
struct SliderCrank;

impl ParametricMechanism for SliderCrank {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, light, r) = (S::from(0.0), S::from(1e-12), S::from(0.1));
        let mut m = Mechanism::new();
        let crank = m.body("crank", light, light, Pose { x: zero, y: zero, theta: zero });
        let rod = m.body("rod", light, light, Pose { x: r, y: zero, theta: zero });
        let slider = m.body("slider", b[1], light, Pose { x: r + b[2], y: zero, theta: zero });
        let ground = m.ground();
        m.revolute("main bearing", ground.origin(), crank.origin());
        m.revolute("crank pin", crank.at(r, zero), rod.origin());
        m.revolute("wrist pin", rod.at(b[2], zero), slider.origin());
        let guide = m.prismatic("guide", ground.origin(), zero, slider.origin(), zero);
        m.guide_friction("friction", guide, [b[3], S::from(1e-6), zero, S::from(1e-9)])?;
        m.drive(crank.theta, ConstantSpeed, &[zero, b[0]]);
        let torque = m.driving_force(crank.theta);
        m.output("torque", &[torque]);
        Ok(m)
    }
}

#[test]
fn the_driving_torque_of_a_slider_crank_with_friction_in_closed_form() {
    // The rod carries F along itself: F cos φ = m a + μ |F sin φ| sgn v, and the torque is F times its distance from the crank.
    let (omega, mass, l, mu, r) = (7.0, 1.3, 0.35, 0.3, 0.1);
    let times: Vec<f64> = (1..40).map(|k| 0.0223 * f64::from(k)).collect();
    let plain = SliderCrank.build(&[omega, mass, l, mu]).unwrap();
    let torque = &kinematics(&plain, Assembly::default(), &times).unwrap()[0];
    for (t, torque) in times.iter().zip(torque) {
        let (sin, cos) = (omega * t).sin_cos();
        let root = (l * l - r * r * sin * sin).sqrt();
        // x = r cos θ + √(l² − r² sin² θ)
        let dx = -r * sin - r * r * sin * cos / root;
        let ddx = -r * cos - r * r * (cos * cos - sin * sin) / root - (r * r * sin * cos).powi(2) / root.powi(3);
        let (v, a) = (omega * dx, omega * omega * ddx);
        let (sin_phi, cos_phi) = (r * sin / l, root / l);
        // The force of the rod on the slider along x has the sign of its right-hand side; two signs of |F sin φ| are possible.
        let force = [1.0, -1.0]
            .map(|sign: f64| (sign, mass * a / (cos_phi - mu * v.signum() * sign * sin_phi.abs())))
            .into_iter()
            .find(|(sign, force)| sign * force >= 0.0)
            .unwrap()
            .1;
        // The rod pulls the crank pin with −F along the rod (cos φ, −sin φ): the drive balances the moment about the bearing.
        let expected = -force * (r * cos * sin_phi + r * sin * cos_phi);
        assert!((torque - expected).abs() < 1e-7 * (1.0 + expected.abs()), "t = {t}: {torque} and {expected}");
    }
}

#[test]
fn bad_input_is_rejected_with_its_name() {
    let mut m = Mechanism::<f64>::new();
    let body = m.body("body", 1.0, 1.0, Pose { x: 0.0, y: 0.0, theta: 0.0 });
    let pin = m.revolute("pin", m.ground().origin(), body.origin());
    let error = m.guide_friction("rub", pin, [0.1, 0.1, 0.0, 1e-3]).unwrap_err();
    assert!(matches!(error, Error::Definition { .. }), "{error}");
    assert!(error.to_string().contains("prismatic or point-on-line"), "{error}");
    m.revolute_friction("rub", pin, [-0.1, 0.1, 0.1, 1e-3]).unwrap();
    let error = simulate(&m, &settings(0.01), &[0.1]).unwrap_err().to_string();
    assert!(error.contains("rub") && error.contains("coefficient of friction is -0.1"), "{error}");
}

/// Reactions of a falling linkage and accelerations of a balanced lever are zero but for rounding errors of its weight, which is not
/// friction that locks.
#[test]
fn friction_without_reactions_and_at_rest_has_a_solution() {
    let friction = [0.3, 0.02, 0.1, 1e-3];
    let mut falling = Mechanism::with_gravity(1.3, -G);
    let upper = falling.body("upper", 1.1, 0.02, Pose { x: 0.11, y: 0.07, theta: 0.3 });
    let place = |length: f64, angle: f64| [length * angle.cos(), length * angle.sin()];
    let ([x, y], [dx, dy]) = (place(0.2, 0.3), place(0.15, 1.1));
    let lower = falling.body("lower", 1.7, 0.03, Pose { x: 0.11 + x + dx, y: 0.07 + y + dy, theta: 1.1 });
    let pin = falling.revolute("pin", upper.at(0.2, 0.0), lower.at(-0.15, 0.0));
    falling.revolute_friction("friction", pin, friction).unwrap();
    let mut lever = Mechanism::with_gravity(0.0, -G);
    let [bar, left, right] = [("bar", 1.1, 0.0), ("left", 0.7, 0.3), ("right", 2.1, -0.1)].map(|(name, mass, arm)| {
        let [x, y] = place(arm, 0.3);
        lever.body(name, mass, 0.01, Pose { x, y, theta: 0.3 })
    });
    let bearing = lever.revolute("bearing", lever.ground().origin(), bar.origin());
    lever.fixed_joint("left weld", bar.at(0.3, 0.0), left.origin(), 0.0);
    lever.fixed_joint("right weld", bar.at(-0.1, 0.0), right.origin(), 0.0);
    lever.revolute_friction("friction", bearing, friction).unwrap();
    for (m, coordinate, exact) in [(&mut falling, upper.y, 0.07 - 0.5 * G), (&mut lever, bar.theta, 0.3)] {
        let ground = m.ground().x;
        let sensor = m.coordinate_sensor("motion", ground, coordinate);
        let position = m.measure(sensor, "position").unwrap();
        m.output("position", &[position]);
        for history in [
            simulate(m, &settings(1e-2), &[1.0]).unwrap(),
            simulate_explicitly(m, &Explicit::adaptive(1e-10), &[1.0]).unwrap(),
            simulate_explicitly(m, &Explicit::eighth_order(1e-10), &[1.0]).unwrap(),
        ] {
            assert!((history.values[0][0] - exact).abs() < 1e-9, "{:?} {exact}", history.values);
        }
    }
}
