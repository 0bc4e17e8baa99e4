//! Values of every kind of output in every kind of analysis, at any time.

use crate::zoo::absorber_displacement;
use linkwright::autodiff::{DualNum, Scalar};
use linkwright::cases::{Absorber, Governor};
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate, simulate_explicitly};
use linkwright::mechanics::analyses::kinematics::kinematics;
use linkwright::mechanics::analyses::statics::{Statics, equilibria};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::instants::differentiate_equilibria;
use linkwright::mechanics::derivatives::history::SensitiveHistory;
use linkwright::mechanics::initial_conditions::Assembly;
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::mechanics::mechanism::{Formula, Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::{ConstantSpeed, Motion, Ramp, TabulatedMotion};

fn close(computed: f64, expected: f64, tolerance: f64) {
    assert!((computed - expected).abs() <= tolerance * (1.0 + expected.abs()), "{computed} instead of {expected}");
}

/// Power as the product of a torque and a speed.
struct Product;

impl Formula for Product {
    fn value<T: Scalar>(&self, _t: T, x: &[T]) -> T {
        x[0] * x[1]
    }
}

/// A rod turning at constant speed about its end in gravity, with a spring from its tip to a point left of the pivot.
fn spinner() -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity(0.0, -10.0);
    let ground = m.ground();
    let rod = m.body("rod", 2.0, 0.5, Pose { x: 1.0, y: 0.0, theta: 0.0 });
    let pin = m.revolute("pin", ground.origin(), rod.at(-1.0, 0.0));
    m.drive(rod.theta, ConstantSpeed, &[0.0, 3.0]);
    let spring = m.spring_damper("spring", ground.at(-2.0, 0.0), rod.at(1.0, 0.0), [5.0, 1.0, 1.0]);
    let tip = m.sensor("tip", rod.at(1.0, 0.0));
    for name in ["x", "y", "theta", "vx", "vy", "omega", "ax", "ay", "alpha"] {
        let term = m.measure(tip, name).unwrap();
        m.output(name, &[term]);
    }
    for (element, name) in [(pin, "force_x"), (pin, "force_y"), (pin, "force"), (spring, "tension"), (spring, "length")]
    {
        let term = m.measure(element, name).unwrap();
        m.output(name, &[term]);
    }
    m.output("torque", &[m.driving_force(rod.theta)]);
    m.output("kinetic", &[m.kinetic_energy()]);
    m.output("potential", &[m.potential_energy()]);
    let terms = [m.driving_force(rod.theta), m.measure(tip, "omega").unwrap()];
    m.output_formula("power", Product, &terms);
    m
}

/// Closed forms of the outputs at the angle φ = 3t.
fn by_hand(t: f64) -> Vec<f64> {
    let phi = 3.0 * t;
    let (sin, cos) = phi.sin_cos();
    let gap = [2.0 * cos + 2.0, 2.0 * sin];
    let length = gap[0].hypot(gap[1]);
    let rate = (gap[0] * -6.0 * sin + gap[1] * 6.0 * cos) / length;
    let tension = 5.0 * (length - 1.0) + rate;
    let pull = [-tension * gap[0] / length, -tension * gap[1] / length];
    // The pin supplies the rest of mass times acceleration of the centre.
    let pin = [2.0 * -9.0 * cos - pull[0], 2.0 * -9.0 * sin - pull[1] + 20.0];
    // Without angular acceleration the moments of drive, weight and spring about the pivot add up to zero.
    let torque = 20.0 * cos - (2.0 * cos * pull[1] - 2.0 * sin * pull[0]);
    let kinetic = 0.5 * (0.5 + 2.0) * 9.0;
    let potential = 20.0 * sin + 2.5 * (length - 1.0).powi(2);
    let motion = [2.0 * cos, 2.0 * sin, phi, -6.0 * sin, 6.0 * cos, 3.0, -18.0 * cos, -18.0 * sin, 0.0];
    let rest = [pin[0], pin[1], pin[0].hypot(pin[1]), tension, length, torque, kinetic, potential, 3.0 * torque];
    [&motion[..], &rest].concat()
}

#[test]
fn positions_reactions_driving_forces_energies_and_formulas_by_hand() {
    let (m, times) = (spinner(), [0.0, 0.123, 0.3, 0.77]);
    let driven = kinematics(&m, Assembly::default(), &times).unwrap();
    let explicit = simulate_explicitly(&m, &Explicit::eighth_order(1e-11), &times).unwrap().values;
    let implicit = simulate(&m, &Dynamics::fixed(1e-4), &times).unwrap().values;
    for (k, &t) in times.iter().enumerate() {
        for (output, expected) in by_hand(t).into_iter().enumerate() {
            close(driven[output][k], expected, 1e-11);
            close(explicit[output][k], expected, 1e-8);
            close(implicit[output][k], expected, 1e-4);
        }
    }
}

/// Positions between implicit steps have the order two, as those at the steps.
#[test]
fn dense_output_of_implicit_steps_is_of_second_order() {
    let b = [0.3628, 0.4823];
    let mechanism = Absorber.build(&b).unwrap();
    let times: Vec<f64> = (1..=97).map(|k| 0.1237 * f64::from(k)).collect();
    let error = |h: f64| {
        let run = simulate(&mechanism, &Dynamics::fixed(h), &times).unwrap();
        run.values[0].iter().zip(&times).map(|(y, &t)| (y - absorber_displacement(&b, t)).abs()).fold(0.0, f64::max)
    };
    let order = (error(0.1) / error(0.05)).log2();
    assert!((order - 2.0).abs() < 0.2, "{order}");
}

/// Output times do not influence the motion: values at common times are the same bits.
#[test]
fn requested_times_do_not_change_the_motion() {
    let m = spinner();
    let few = [0.31, 0.62];
    let many: Vec<f64> = (1..=62).map(|k| 0.01 * f64::from(k)).collect();
    let [a, b] = [&few[..], &many].map(|times| simulate(&m, &Dynamics::fixed(7e-3), times).unwrap().values);
    for (few, many) in a.iter().zip(&b) {
        assert_eq!([few[0], few[1]], [many[30], many[61]]);
    }
    let fixed = Explicit::adaptive(1.0).with_step_control(StepControl::Fixed(7e-3));
    let [a, b] = [&few[..], &many].map(|times| simulate_explicitly(&m, &fixed, times).unwrap().values);
    assert_eq!([a[0][0], a[16][1]], [b[0][30], b[16][61]]);
}

/// cos α = (m + M) g / (m L Ω²): height −2 L cos α, radius L sin α, tension (m + M) g / (… ) from the equilibrium of a ball.
#[test]
fn a_governor_stands_at_its_angle_with_its_derivatives() {
    let (model, b) = (Governor { angle: 1.0 }, Governor::DESIGN);
    fn exact<S: Scalar>(b: &[S]) -> [S; 3] {
        let [m, sleeve, l, speed, g] = [b[0], b[1], b[2], b[3], b[4]];
        let cos = (m + sleeve) * g / (m * l * speed * speed);
        let sin = (-cos * cos + 1.0).sqrt();
        // Upper rods carry both balls and the sleeve: 2 T cos α = (2 m + M) g.
        [l * cos * -2.0, l * sin, (m * 2.0 + sleeve) * g / (cos * 2.0)]
    }
    let computed: SensitiveHistory = differentiate_equilibria(&model, &b, &Statics::default(), &[0.0]).unwrap();
    for output in 0..3 {
        let (value, gradient) = linkwright::autodiff::gradient(|b| exact(b)[output], &b);
        close(computed.values[output][0], value, 1e-9);
        for k in 0..b.len() {
            close(computed.gradients[output][0][k] * b[k], gradient[k] * b[k], 1e-8);
        }
    }
}

/// A mass on a spring of zero unloaded length passes through its anchor: y = v/ω sin ωt, ω² = k/m.
struct Bob;

impl ParametricMechanism for Bob {
    fn build<S: Scalar>(&self, b: &[S]) -> linkwright::Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let bob = m.point_mass("bob", b[0], zero, zero);
        m.set_velocity(bob.x, b[2] * 0.6);
        m.set_velocity(bob.y, b[2] * 0.8);
        let spring = m.spring_damper("spring", m.ground().origin(), bob.origin(), [b[1], zero, zero]);
        let sensor = m.sensor("bob", bob.origin());
        for (element, name) in [(sensor, "y"), (spring, "tension"), (spring, "length")] {
            let term = m.measure(element, name)?;
            m.output(name, &[term]);
        }
        m.output("energy", &[m.kinetic_energy(), m.potential_energy()]);
        Ok(m)
    }
}

#[test]
fn a_spring_of_zero_length_is_a_plane_oscillator_with_derivatives() {
    let (b, times) = ([2.0, 18.0, 1.5], [0.0, 0.2, 0.9]);
    let explicit = Explicit::eighth_order(1e-11);
    let run =
        linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly(&Bob, &b, &explicit, &times)
            .unwrap();
    let implicit = differentiate(&Bob, &b, &Dynamics::fixed(2e-4), &times).unwrap();
    for (k, &t) in times.iter().enumerate() {
        let (value, gradient) = linkwright::autodiff::gradient(
            |b| {
                let w = (b[1] / b[0]).sqrt();
                b[2] * 0.8 * (w * t).sin() / w
            },
            &b,
        );
        close(run.values[0][k], value, 1e-9);
        close(implicit.values[0][k], value, 1e-6);
        for i in 0..3 {
            close(run.gradients[0][k][i], gradient[i], 1e-8);
            close(implicit.gradients[0][k][i], gradient[i], 1e-6);
        }
        close(run.values[3][k], 0.5 * 2.0 * 1.5 * 1.5, 1e-9);
        assert!(run.gradients.iter().flatten().flatten().all(|derivative| derivative.is_finite()));
    }
}

/// A function of time from outside the crate: a chirp.
struct Chirp;

impl Motion for Chirp {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        (p[0] * t * t).sin()
    }
}

/// Every kind of drive supplies the force m ẍ to a driven mass.
#[test]
fn drives_of_every_kind_need_the_force_of_their_acceleration() {
    let knots: Vec<f64> = (0..=40).map(|k| 0.05 * f64::from(k)).collect();
    let table = TabulatedMotion::new(&knots, &knots.iter().map(|t| t.sin()).collect::<Vec<_>>()).unwrap();
    let t = 0.8;
    let force = |drive: &dyn Fn(&mut Mechanism<f64>, linkwright::mechanics::mechanism::Coordinate)| {
        let mut m = Mechanism::<f64>::new();
        let x = m.coordinate("cart", 0.0, 0.0);
        m.inertia("mass", x, 2.0);
        drive(&mut m, x);
        m.output("force", &[m.driving_force(x)]);
        kinematics(&m, Assembly::default(), &[t]).unwrap()[0][0]
    };
    close(force(&|m, x| m.drive(x, ConstantSpeed, &[0.0, 3.0])), 0.0, 1e-14);
    let x: f64 = t / 2.0;
    let smooth = 2.0 * 3.0 * (60.0 * x - 180.0 * x * x + 120.0 * x.powi(3)) / 4.0;
    close(force(&|m, x| m.drive(x, Ramp::Smooth, &[0.0, 3.0, 0.0, 2.0])), smooth, 1e-13);
    close(force(&|m, x| m.drive(x, table.clone(), &[1.0])), -2.0 * t.sin(), 1e-3);
    let chirp = 2.0 * (6.0 * (3.0 * t * t).cos() - (6.0 * t).powi(2) * (3.0 * t * t).sin());
    close(force(&|m, x| m.drive(x, Chirp, &[3.0])), chirp, 1e-13);
    // The same chirp as a joint between two coordinates.
    let mut m = Mechanism::<f64>::new();
    let x = m.coordinate("cart", 0.0, 0.0);
    m.inertia("mass", x, 2.0);
    let drive = m.driver("drive", m.ground().x, x, Chirp, &[3.0]);
    let force = m.measure(drive, "driving_force").unwrap();
    m.output("force", &[force]);
    close(kinematics(&m, Assembly::default(), &[t]).unwrap()[0][0], chirp, 1e-12);
}

/// A load ramp on a spring: u = F / k at all times.
#[test]
fn a_ramp_loads_a_spring_step_by_step() {
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground().x;
    let x = m.coordinate("cart", 0.0, 0.0);
    m.inertia("mass", x, 1.0);
    let spring = m.coordinate_spring("spring", ground, x, [50.0, 0.0, 0.0, 0.0]);
    m.load("load", ground, x, Ramp::Linear, &[0.0, 10.0, 1.0, 2.0]);
    let term = m.measure(spring, "elongation").unwrap();
    m.output("elongation", &[term]);
    let computed = equilibria(&m, &Statics::default(), &[0.5, 2.0, 4.0]).unwrap();
    computed[0].iter().zip([0.0, 0.1, 0.2]).for_each(|(u, expected)| close(*u, expected, 1e-13));
}
