//! Explicit steps and their derivatives, on differential equations and on constrained mechanisms.

use linkwright::autodiff::Scalar;
use linkwright::cases::Chain;
use linkwright::mechanics::analyses::dynamics::{simulate_explicitly, simulate_with_steps};
use linkwright::mechanics::derivatives::forward::explicit::{differentiate_explicitly, differentiate_ode};
use linkwright::mechanics::elements::{Element, ElementState};
use linkwright::mechanics::integrators::explicit::{Explicit, Ode, StepControl, Tolerance, integrate};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use linkwright::{Error, Result};

/// ÿ + 2 d ẏ + k y = 0 with y(0) = k / 2, ẏ(0) = −d: the initial state depends on the design (k, d).
struct Oscillator;

impl Ode for Oscillator {
    fn start<S: Scalar>(&self, b: &[S]) -> Vec<S> {
        vec![b[0] * 0.5, -b[1]]
    }
    fn rates<S: Scalar>(&self, b: &[S], _t: f64, y: &[S], out: &mut [S]) {
        out[0] = y[1];
        out[1] = -(b[0] * y[0] + b[1] * y[1] * 2.0);
    }
}

/// Closed form of the oscillator, generic over the scalar for exact derivatives.
fn oscillation<S: Scalar>(b: &[S], t: f64) -> S {
    let (k, d) = (b[0], b[1]);
    let w = (k - d * d).sqrt();
    let (sin, cos) = (w * t).sin_cos();
    (-d * t).exp() * (k * 0.5 * cos + (k * d * 0.5 - d) / w * sin)
}

const DESIGN: [f64; 2] = [3.0, 0.2];

fn grid(count: usize, end: f64) -> Vec<f64> {
    (1..=count).map(|k| end * k as f64 / count as f64).collect()
}

fn both() -> [fn(f64) -> Explicit; 2] {
    [Explicit::adaptive, Explicit::eighth_order]
}

fn oscillator_errors(settings: &Explicit, times: &[f64]) -> [f64; 2] {
    let run = differentiate_ode(&Oscillator, &DESIGN, settings, times).unwrap();
    let mut worst = [0.0f64; 2];
    for (i, &t) in times.iter().enumerate() {
        let (value, gradient) = linkwright::autodiff::gradient(|b| oscillation(b, t), &DESIGN);
        worst[0] = worst[0].max((run.history.values[0][i] - value).abs());
        for (ours, exact) in run.gradients[0][i].iter().zip(gradient) {
            worst[1] = worst[1].max((ours - exact).abs());
        }
    }
    worst
}

#[test]
fn orders_on_a_differential_equation_in_values_and_derivatives() {
    for (method, h) in both().into_iter().zip([0.05, 0.4]) {
        let error = |h: f64| oscillator_errors(&method(1.0).with_step_control(StepControl::Fixed(h)), &grid(10, 8.0));
        let (coarse, fine, order) = (error(h), error(0.5 * h), f64::from(method(1.0).method.order));
        for k in 0..2 {
            let measured = (coarse[k] / fine[k]).log2();
            println!("{}: order {measured:.2}", method(1.0).method.name);
            assert!((measured - order).abs() < 0.2, "{measured} instead of {order}: {coarse:?} {fine:?}");
        }
    }
}

#[test]
fn orders_on_a_constrained_pendulum() {
    let pendulum = Chain::horizontal(1).build(&[1.0, 1.0]).unwrap();
    let times = grid(5, 1.0);
    let exact = simulate_explicitly(&pendulum, &Explicit::eighth_order(1e-14), &times).unwrap().values;
    for (method, h) in both().into_iter().zip([0.025, 0.1]) {
        let error = |h: f64| {
            let run =
                simulate_explicitly(&pendulum, &method(1.0).with_step_control(StepControl::Fixed(h)), &times).unwrap();
            let apart = |t: usize| (run.values[0][t] - exact[0][t]).hypot(run.values[1][t] - exact[1][t]);
            (0..times.len()).map(apart).fold(0.0, f64::max)
        };
        let (measured, order) = ((error(h) / error(0.5 * h)).log2(), f64::from(method(1.0).method.order));
        println!("{}: order {measured:.2}", method(1.0).method.name);
        assert!((measured - order).abs() < 0.2, "{measured} instead of {order}");
    }
}

#[test]
fn dense_output_is_as_accurate_as_the_tolerance() {
    let times = grid(997, 10.0);
    for (method, factor) in both().into_iter().zip([200.0, 200.0]) {
        for tolerance in [1e-6, 1e-9] {
            let errors = oscillator_errors(&method(tolerance), &times);
            println!("{} at {tolerance:.0e}: {errors:?}", method(1.0).method.name);
            assert!(errors.iter().all(|error| *error < factor * tolerance), "{errors:?} at {tolerance}");
        }
    }
}

#[test]
fn each_component_can_have_its_own_tolerance() {
    let tolerance = Tolerance { relative: vec![0.0], absolute: vec![1e-10, 1e-3] };
    let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Adaptive { tolerance, longest: 1.0 });
    assert!(oscillator_errors(&settings, &grid(10, 5.0))[0] < 1e-8);
    let tolerance = Tolerance { relative: vec![0.0], absolute: vec![1e-10; 3] };
    let settings = settings.with_step_control(StepControl::Adaptive { tolerance, longest: 1.0 });
    let error = integrate(&Oscillator, &DESIGN, &settings, &[1.0]).unwrap_err();
    assert!(matches!(error, Error::Length { expected: 2, got: 3, .. }), "{error}");
}

#[test]
fn energy_and_joints_of_a_chain_are_kept() {
    let chain = Chain::horizontal(6);
    let mechanism = chain.build(&chain.equal_links()).unwrap();
    let times = grid(40, 2.0);
    for method in both() {
        let run = simulate_explicitly(&mechanism, &method(1e-9), &times).unwrap();
        let energy = (0..times.len()).map(|k| (run.values[2][k] + run.values[3][k]).abs()).fold(0.0, f64::max);
        let [x, y] = run.last.q[run.last.q.len() - 3..run.last.q.len() - 1] else { unreachable!() };
        let turn = run.last.q[run.last.q.len() - 1];
        let tip = [x + turn.cos() / 12.0, y + turn.sin() / 12.0];
        // The tip computed from the angles alone agrees if the joints are closed.
        let angles = run.last.q.iter().skip(5).step_by(3);
        let sum = angles.fold([0.0; 2], |a, t| [a[0] + t.cos() / 6.0, a[1] + t.sin() / 6.0]);
        let drift = (tip[0] - sum[0]).hypot(tip[1] - sum[1]);
        println!("{}: energy {energy:.1e} J, drift {drift:.1e} m", method(1.0).method.name);
        assert!(energy < 1e-7 && drift < 1e-13, "{energy:.2e} J, {drift:.2e} m");
    }
}

/// Two slender rods in minimal coordinates: lengths and masses as design variables.
struct DoublePendulum;

impl Ode for DoublePendulum {
    fn start<S: Scalar>(&self, _b: &[S]) -> Vec<S> {
        vec![S::from(0.0); 4]
    }
    fn rates<S: Scalar>(&self, b: &[S], _t: f64, y: &[S], out: &mut [S]) {
        let [l1, l2, m1, m2] = [b[0], b[1], b[2], b[3]];
        let (sin, cos) = (y[0] - y[1]).sin_cos();
        let coupling = m2 * l1 * l2 * 0.5;
        let (a, c) = ((m1 * (1.0 / 3.0) + m2) * l1 * l1, m2 * l2 * l2 * (1.0 / 3.0));
        let r1 = -coupling * sin * y[3] * y[3] - (m1 * 0.5 + m2) * l1 * y[0].cos() * 9.81;
        let r2 = coupling * sin * y[2] * y[2] - m2 * l2 * y[1].cos() * 4.905;
        let off = coupling * cos;
        let determinant = a * c - off * off;
        (out[0], out[1]) = (y[2], y[3]);
        (out[2], out[3]) = ((c * r1 - off * r2) / determinant, (a * r2 - off * r1) / determinant);
    }
}

#[test]
fn a_double_pendulum_is_that_of_minimal_coordinates_with_its_derivatives() {
    let (b, times) = ([0.6, 0.4, 1.0, 2.0], grid(20, 1.0));
    let ode = differentiate_ode(&DoublePendulum, &b, &Explicit::eighth_order(1e-13), &times).unwrap();
    let mechanism =
        differentiate_explicitly(&Chain::horizontal(2), &b, &Explicit::eighth_order(1e-12), &times).unwrap();
    let angle = |o: usize, t: usize| ode.history.values[o][t];
    for t in 0..times.len() {
        let x = b[0] * angle(0, t).cos() + b[1] * angle(1, t).cos();
        assert!((mechanism.values[0][t] - x).abs() < 1e-10);
        for k in 0..4 {
            let turn = |o: usize| -b[o] * angle(o, t).sin() * ode.gradients[o][t][k];
            let direct = if k < 2 { angle(k, t).cos() } else { 0.0 };
            let derivative = turn(0) + turn(1) + direct;
            assert!(
                (mechanism.gradients[0][t][k] - derivative).abs() < 1e-9,
                "{t} {k}: {} {derivative}",
                mechanism.gradients[0][t][k]
            );
        }
    }
}

/// Two links with initial velocities and positions that violate the joints; both are made consistent.
struct Thrown;

impl ParametricMechanism for Thrown {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let pose = |x: S, y: S, theta: f64| Pose { x, y, theta: S::from(theta) };
        let first = m.body("first", b[2], b[2] * b[0] * b[0] * 0.1, pose(b[0] * 0.45, b[1] * 0.2, 0.3));
        let second = m.body("second", b[3], b[3] * b[1] * b[1] * 0.1, pose(b[0] * 1.1, b[1] * 0.5, -0.2));
        m.revolute("hook", m.ground().origin(), first.at(b[0] * -0.5, zero));
        m.revolute("pin", first.at(b[0] * 0.5, zero), second.at(b[1] * -0.5, zero));
        m.set_velocity(first.theta, b[4]);
        m.set_velocity(second.x, b[4] * b[0]);
        let tip = m.sensor("tip", second.at(b[1] * 0.5, zero));
        for name in ["x", "y", "vx", "ax"] {
            let term = m.measure(tip, name)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}

/// Largest deviation from Richardson differences with the steps of the unperturbed simulation.
fn frozen_deviation<M: ParametricMechanism>(model: &M, b: &[f64], settings: &Explicit, times: &[f64]) -> f64 {
    let exact = differentiate_explicitly(model, b, settings, times).unwrap();
    let (plain, steps) = simulate_with_steps(&model.build(b).unwrap(), settings, times).unwrap();
    assert_eq!(exact.values, plain.values);
    let frozen = settings.clone().with_step_control(StepControl::Given(steps));
    let values = |k: usize, h: f64| {
        let mut moved = b.to_vec();
        moved[k] += h;
        simulate_explicitly(&model.build(&moved).unwrap(), &frozen, times).unwrap().values
    };
    let mut worst = 0.0f64;
    for k in 0..b.len() {
        let h = 2e-3 * b[k].abs();
        let runs = [h, -h, 0.5 * h, -0.5 * h, 0.25 * h, -0.25 * h].map(|h| values(k, h));
        for (o, series) in exact.gradients.iter().enumerate() {
            let largest = series.iter().map(|gradient| gradient[k].abs()).fold(1e-2, f64::max);
            for (t, gradient) in series.iter().enumerate() {
                let central = |j: usize, h: f64| (runs[j][o][t] - runs[j + 1][o][t]) / (2.0 * h);
                let (d1, d2, d3) = (central(0, h), central(2, 0.5 * h), central(4, 0.25 * h));
                let (e1, e2) = ((4.0 * d2 - d1) / 3.0, (4.0 * d3 - d2) / 3.0);
                worst = worst.max((gradient[k] - (16.0 * e2 - e1) / 15.0).abs() / largest);
            }
        }
    }
    worst
}

#[test]
fn derivatives_are_those_of_the_discrete_solution_with_frozen_steps() {
    let times = grid(7, 0.5);
    for method in both() {
        let loose = method(1e-5);
        let thrown = frozen_deviation(&Thrown, &[0.6, 0.5, 1.0, 2.0, 3.0], &loose, &times);
        let chain = Chain::horizontal(5);
        let hanging = frozen_deviation(&chain, &chain.equal_links(), &loose, &times);
        println!("{}: {thrown:.1e} {hanging:.1e}", method(1.0).method.name);
        assert!(thrown < 1e-7 && hanging < 1e-7, "{thrown:.2e} {hanging:.2e}");
    }
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let chain = Chain::horizontal(12);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let derive =
            || differentiate_explicitly(&chain, &chain.equal_links(), &Explicit::eighth_order(1e-7), &[0.1, 0.4]);
        pool.install(derive).unwrap()
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}

/// A force that is NaN once the coordinate exceeds p\[0\].
struct Trap;

impl Element for Trap {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[0] = -(x.p[0] - x.q[0]).sqrt();
    }
}

/// A solution with a singularity at t = 1.
struct Explosion;

impl Ode for Explosion {
    fn start<S: Scalar>(&self, _b: &[S]) -> Vec<S> {
        vec![S::from(1.0)]
    }
    fn rates<S: Scalar>(&self, _b: &[S], _t: f64, y: &[S], out: &mut [S]) {
        out[0] = y[0] * y[0];
    }
    fn name(&self, _component: usize) -> String {
        "temperature".to_owned()
    }
}

#[test]
fn failed_integrations_name_the_component_and_the_time() {
    let zero_mass = Chain::horizontal(2).build(&[1.0, 1.0, 0.0, 1.0]).unwrap();
    let error = simulate_explicitly(&zero_mass, &Explicit::eighth_order(1e-8), &[1.0]).unwrap_err().to_string();
    assert!(error.contains("link 1") && error.contains("mass is 0 kg"), "{error}");

    let mut m = Mechanism::<f64>::with_gravity(9.81, 0.0);
    let ball = m.point_mass("ball", 1.0, 0.0, 0.0);
    m.add("trap", Trap, &[ball.x], &[0.5]);
    for step_control in [StepControl::Fixed(1e-2), Explicit::eighth_order(1e-8).step_control] {
        let settings = Explicit::eighth_order(1.0).with_step_control(step_control);
        let error = simulate_explicitly(&m, &settings, &[2.0]).unwrap_err().to_string();
        assert!(error.contains("trap") && error.contains("t = "), "{error}");
    }

    let error = integrate(&Explosion, &[], &Explicit::eighth_order(1e-8), &[2.0]).unwrap_err().to_string();
    assert!(error.contains("temperature") && error.contains("t = 1 s") && error.contains("too small"), "{error}");
    for times in [&[1.0, 0.5][..], &[-1.0], &[f64::NAN]] {
        assert!(integrate(&Oscillator, &DESIGN, &Explicit::eighth_order(1e-8), times).is_err());
    }
    let short = Explicit::eighth_order(1.0).with_step_control(StepControl::Given(vec![0.1, 0.1]));
    let error = integrate(&Oscillator, &DESIGN, &short, &[1.0]).unwrap_err().to_string();
    assert!(error.contains("given steps"), "{error}");
}
