//! Derivatives of mechanisms whose prescribed coordinates accelerate, with constraints that are nonlinear in them.

use linkwright::Result;
use linkwright::autodiff::Scalar;
use linkwright::mechanics::analyses::dynamics::{Dynamics, simulate_explicitly};
use linkwright::mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright::mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::{Harmonic, Motion};

/// q₀ + ½ a t²: p = \[q₀, a\].
struct Accelerated;

impl Motion for Accelerated {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] + p[1] * t * t * 0.5
    }
}

/// A bob on a rod, the other end of which is driven along x by ½ a t²; a spring pulls the bob.
struct DrivenRod;

impl DrivenRod {
    /// Acceleration, length of the rod, stiffness, mass.
    const DESIGN: [f64; 4] = [0.2, 0.5, 20.0, 1.3];
}

impl ParametricMechanism for DrivenRod {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, c) = (S::from(0.0), S::from);
        let mut m = Mechanism::with_gravity(zero, c(-9.81));
        let cart = m.massless_node("cart", Pose { x: zero, y: zero, theta: zero });
        m.drive(cart.x, Accelerated, &[zero, b[0]]);
        m.fix(cart.y);
        m.fix(cart.theta);
        let bob = m.point_mass("bob", b[3], b[1] * 0.8, b[1] * -0.6);
        m.distance_constraint("rod", cart.origin(), bob.origin(), b[1]);
        m.spring_damper("spring", m.ground().at(c(0.6), c(0.2)), bob.origin(), [b[2], c(0.1), c(0.4)]);
        outputs(&mut m, &[bob])
    }
}

/// A five-bar: one crank accelerates, the other one hangs on a spring.
struct FiveBar;

impl FiveBar {
    /// Acceleration and length of the driven crank, length of the coupler, stiffness.
    const DESIGN: [f64; 4] = [2.5, 0.25, 0.6, 8.0];
}

impl ParametricMechanism for FiveBar {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, c) = (S::from(0.0), S::from);
        let mut m = Mechanism::with_gravity(zero, c(-9.81));
        let ground = m.ground();
        let link = |m: &mut Mechanism<S>, name: &str, half: S, x: f64, y: f64, turn: f64| {
            m.body(name, half * 3.0, half * half * half, Pose { x: c(x), y: c(y), theta: c(turn) })
        };
        let crank = link(&mut m, "crank", b[1] * 0.5, 0.1, 0.07, 0.6);
        let left = link(&mut m, "left", b[2] * 0.5, 0.35, 0.4, 0.85);
        let right = link(&mut m, "right", c(0.25), 0.75, 0.5, 2.2);
        let follower = link(&mut m, "follower", c(0.15), 0.95, 0.15, 1.7);
        m.drive(crank.theta, Accelerated, &[c(0.6), b[0]]);
        m.revolute("foot", ground.origin(), crank.at(b[1] * -0.5, zero));
        m.revolute("knee", crank.at(b[1] * 0.5, zero), left.at(b[2] * -0.5, zero));
        m.revolute("top", left.at(b[2] * 0.5, zero), right.at(c(0.25), zero));
        m.revolute("elbow", right.at(c(-0.25), zero), follower.at(c(0.15), zero));
        m.revolute("base", ground.at(c(1.0), zero), follower.at(c(-0.15), zero));
        m.coordinate_spring("spring", ground.theta, follower.theta, [b[3], c(0.2), c(1.7), zero]);
        outputs(&mut m, &[left, follower])
    }
}

/// The car axis of the IVP test set: two wheels on a road, one of which is driven, and a chassis on stiff springs.
///
/// # Sources
/// Mazzia & Magherini, *Test Set for Initial Value Problem Solvers*, release 2.4 (2008), Section II-7.
pub struct CarAxis;

impl CarAxis {
    /// Length of the axle in m, unloaded length of the springs in m, amplitude of the road in m, mass in kg,
    /// gravitational acceleration.
    pub const DESIGN: [f64; 5] = [1.0, 0.5, 0.1, 10.0, 1.0];
}

/// √(L² − y²) for y = r sin ωt: the x of the driven wheel. p = \[L, r, ω\].
struct WheelX;

impl Motion for WheelX {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        let y = p[1] * (p[2] * t).sin();
        (p[0] * p[0] - y * y).sqrt()
    }
}

impl ParametricMechanism for CarAxis {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, c) = (S::from(0.0), S::from);
        let [length, rest, road, mass, gravity] = [b[0], b[1], b[2], b[3], b[4]];
        let mut m = Mechanism::with_gravity(zero, -gravity);
        let wheel = m.massless_node("right wheel", Pose { x: length, y: zero, theta: zero });
        m.drive(wheel.x, WheelX, &[length, road, c(10.0)]);
        m.drive(wheel.y, Harmonic, &[zero, road, c(10.0), zero]);
        m.fix(wheel.theta);
        // ½ M ε² of the test set, with ε = 1e-2 and M = 10: the masses are 5e-4 kg.
        let half = mass * 5e-5;
        let left = m.point_mass("left", half, zero, c(0.5));
        let right = m.point_mass("right", half, c(1.0), c(0.5));
        m.set_velocity(left.x, c(-0.5));
        m.set_velocity(right.x, c(-0.5));
        m.distance_constraint("chassis", left.origin(), right.origin(), length);
        // The left end moves on a line normal to the axle: x_l x_b + y_l y_b = 0 with the wheel (x_b, y_b).
        m.add("guide", Normal, &[left.x, left.y, wheel.x, wheel.y], &[]);
        m.spring_damper("left spring", m.ground().origin(), left.origin(), [c(1.0), zero, rest]);
        m.spring_damper("right spring", wheel.origin(), right.origin(), [c(1.0), zero, rest]);
        outputs(&mut m, &[left, right])
    }
}

/// Φ = x₁ x₂ + y₁ y₂.
struct Normal;

impl linkwright::mechanics::elements::Element for Normal {
    fn residual<T: Scalar>(
        &self,
        x: &linkwright::mechanics::elements::ElementState<'_, T>,
        dynamics: &mut [T],
        constraint: &mut [T],
    ) {
        constraint[0] = x.q[0] * x.q[2] + x.q[1] * x.q[3];
        for i in 0..4 {
            dynamics[i] = x.l[0] * x.q[(i + 2) % 4];
        }
    }

    fn num_constraints(&self) -> usize {
        1
    }
}

/// Adds x, y and their rates of the origins of `bodies` as outputs.
fn outputs<S: Scalar>(m: &mut Mechanism<S>, bodies: &[linkwright::mechanics::Body]) -> Result<Mechanism<S>> {
    for (k, body) in bodies.iter().enumerate() {
        let sensor = m.sensor(&format!("sensor {k}"), body.origin());
        for name in ["x", "y", "vx", "vy", "ax"] {
            let term = m.measure(sensor, name)?;
            m.output(format!("{name}{k}"), &[term]);
        }
    }
    Ok(std::mem::take(m))
}

/// Deviations of direct and adjoint derivatives from differences with steps h, h/2 and h/4, twice extrapolated.
///
/// They are relative to the largest derivative of the same output with respect to any variable, both scaled by the variable.
fn deviations<M: ParametricMechanism>(model: &M, b: &[f64], settings: &Explicit, times: &[f64]) -> [f64; 2] {
    let direct = differentiate_explicitly(model, b, settings, times).unwrap();
    let points = times.len();
    let all: Vec<_> =
        (0..direct.names.len()).flat_map(|o| (0..points).map(move |p| AdjointFunctional::at(o, p))).collect();
    let adjoint = differentiate_explicitly_backwards(model, b, settings, times, &all).unwrap();
    let values = |k: usize, h: f64| {
        let mut moved = b.to_vec();
        moved[k] += h;
        simulate_explicitly(&model.build(&moved).unwrap(), settings, times).unwrap().values
    };
    let mut worst = [0.0f64; 2];
    for k in 0..b.len() {
        let h = 2e-3 * b[k].abs();
        let runs = [h, -h, 0.5 * h, -0.5 * h, 0.25 * h, -0.25 * h].map(|h| values(k, h));
        for (o, series) in direct.gradients.iter().enumerate() {
            let scaled = series.iter().flatten().enumerate().map(|(i, x)| (x * b[i % b.len()]).abs());
            let largest = scaled.fold(0.0, f64::max);
            for p in 0..points {
                let central = |j: usize, h: f64| (runs[j][o][p] - runs[j + 1][o][p]) / (2.0 * h);
                let (d1, d2, d3) = (central(0, h), central(2, 0.5 * h), central(4, 0.25 * h));
                let (e1, e2) = ((4.0 * d2 - d1) / 3.0, (4.0 * d3 - d2) / 3.0);
                let difference = (16.0 * e2 - e1) / 15.0;
                for (worst, computed) in worst.iter_mut().zip([series[p][k], adjoint[(o * points + p, k)]]) {
                    *worst = worst.max((computed - difference).abs() * b[k].abs() / largest);
                }
            }
        }
    }
    worst
}

fn check<M: ParametricMechanism>(name: &str, model: &M, b: &[f64], h: f64, times: &[f64]) {
    for method in [Explicit::adaptive(1.0), Explicit::eighth_order(1.0)] {
        let settings = method.with_step_control(StepControl::Fixed(h));
        let [direct, adjoint] = deviations(model, b, &settings, times);
        println!("{name}, {}: direct {direct:.1e}, adjoint {adjoint:.1e}", settings.method.name);
        assert!(direct < 1e-7 && adjoint < 1e-7, "{name}: {direct:.2e} {adjoint:.2e}");
    }
}

#[test]
fn a_rod_whose_end_accelerates() {
    check("driven rod", &DrivenRod, &DrivenRod::DESIGN, 0.02, &[0.25, 0.61, 1.0]);
}

#[test]
fn a_five_bar_whose_crank_accelerates() {
    check("five-bar", &FiveBar, &FiveBar::DESIGN, 0.01, &[0.12, 0.31, 0.5]);
}

#[test]
fn the_car_axis_of_the_ivp_test_set() {
    check("car axis", &CarAxis, &CarAxis::DESIGN, 1e-3, &[0.05, 0.1204, 0.2]);
}

/// At tight tolerances the derivatives of explicit and implicit steps are those of the same motion.
#[test]
fn explicit_and_implicit_steps_have_the_same_derivatives() {
    let (b, times) = (DrivenRod::DESIGN, [0.3, 0.6]);
    let explicit = differentiate_explicitly(&DrivenRod, &b, &Explicit::eighth_order(1e-12), &times).unwrap();
    let implicit = differentiate(&DrivenRod, &b, &Dynamics::fixed(2e-4), &times).unwrap();
    for (a, b) in explicit.gradients.iter().flatten().flatten().zip(implicit.gradients.iter().flatten().flatten()) {
        assert!((a - b).abs() < 1e-4 * (1.0 + a.abs()), "{a} {b}");
    }
}
