//! Conservation of energy and momentum, and drift of the constraints, for every integrator.

use linkwright::autodiff::Scalar;
use linkwright::mechanics::analyses::dynamics::{Dynamics, History, simulate, simulate_explicitly};
use linkwright::mechanics::integrators::explicit::Explicit;
use linkwright::mechanics::integrators::generalized_alpha::{GeneralizedAlpha, Newton};
use linkwright::mechanics::mechanism::{Formula, Mechanism, Pose};

/// J ω + m (x v_y − y v_x) of one body: x, y, v_x, v_y, ω.
struct AngularMomentum {
    mass: f64,
    inertia: f64,
}

impl Formula for AngularMomentum {
    fn value<T: Scalar>(&self, _t: T, x: &[T]) -> T {
        (x[0] * x[3] - x[1] * x[2]) * self.mass + x[4] * self.inertia
    }
}

/// Three free-floating links, pinned to each other, with a preloaded torsion spring.
///
/// Outputs: kinetic and potential energy, momentum along x and y, angular momentum link by link, gap of the second pin.
fn flyer() -> Mechanism<f64> {
    let mut m = Mechanism::new();
    let (mass, inertia) = (1.0, 0.1);
    let mut links = Vec::new();
    for k in 0..3 {
        let link = m.body(&format!("link {k}"), mass, inertia, Pose { x: f64::from(k), y: 0.0, theta: 0.0 });
        m.set_velocity(link.y, 0.4 * f64::from(k) - 0.2);
        m.set_velocity(link.theta, 1.0 - 2.0 * f64::from(k));
        links.push(link);
    }
    for k in 0..2 {
        m.revolute(&format!("pin {k}"), links[k].at(0.5, 0.0), links[k + 1].at(-0.5, 0.0));
        m.coordinate_spring(&format!("spring {k}"), links[k].theta, links[k + 1].theta, [2.0, 0.0, 0.5, 0.0]);
    }
    m.output("kinetic", &[m.kinetic_energy()]);
    m.output("potential", &[m.potential_energy()]);
    let sensors: Vec<_> = links.iter().map(|link| m.sensor("centre", link.origin())).collect();
    for speed in ["vx", "vy"] {
        let terms: Vec<_> = sensors.iter().map(|&s| m.measure(s, speed).unwrap().times(mass)).collect();
        m.output(speed, &terms);
    }
    for &sensor in &sensors {
        let terms = ["x", "y", "vx", "vy", "omega"].map(|name| m.measure(sensor, name).unwrap());
        m.output_formula("angular momentum", AngularMomentum { mass, inertia }, &terms);
    }
    for axis in ["x", "y"] {
        let [one, two] = [links[1].at(0.5, 0.0), links[2].at(-0.5, 0.0)].map(|marker| m.sensor("pin", marker));
        let terms = [m.measure(one, axis).unwrap(), m.measure(two, axis).unwrap().times(-1.0)];
        m.output("gap", &terms);
    }
    m
}

/// Largest change of energy, momentum and angular momentum, and the largest gap, in a simulation.
fn drift(run: &History) -> [f64; 4] {
    let sum = |outputs: std::ops::Range<usize>, t: usize| run.values[outputs].iter().map(|s| s[t]).sum::<f64>();
    let largest = |value: &dyn Fn(usize) -> f64| (0..run.times.len()).map(value).fold(0.0, f64::max);
    let change =
        |outputs: std::ops::Range<usize>| largest(&|t| (sum(outputs.clone(), t) - sum(outputs.clone(), 0)).abs());
    let gap = largest(&|t| run.values[7][t].hypot(run.values[8][t]));
    [change(0..2), change(2..3).max(change(3..4)), change(4..7), gap]
}

fn times() -> Vec<f64> {
    (0..=20).map(|k| 0.1 * f64::from(k)).collect()
}

#[test]
fn explicit_steps_keep_energy_momentum_and_joints() {
    let m = flyer();
    for settings in [Explicit::adaptive(1e-9), Explicit::eighth_order(1e-9)] {
        let computed = drift(&simulate_explicitly(&m, &settings, &times()).unwrap());
        println!("{}: {computed:?}", settings.method.name);
        let bounds = [1e-6, 1e-6, 1e-6, 1e-8]; // between steps a pin is as closed as the tolerance
        assert!(computed.iter().zip(bounds).all(|(f, bound)| *f < bound), "{}: {computed:?}", settings.method.name);
    }
}

/// Momentum and joints are exact to the tolerance of Newton's iteration, energy and angular momentum to second order or better.
#[test]
fn implicit_steps_keep_momentum_and_joints_and_the_rest_to_their_order() {
    let m = flyer();
    let schemes = [
        ("HHT 0", GeneralizedAlpha::hht(0.0).unwrap()),
        ("HHT 0.05", GeneralizedAlpha::hht(0.05).unwrap()),
        ("generalized-alpha 1", GeneralizedAlpha::chung_hulbert(1.0).unwrap()),
        ("generalized-alpha 0.9", GeneralizedAlpha::chung_hulbert(0.9).unwrap()),
        ("generalized-alpha 0.5", GeneralizedAlpha::chung_hulbert(0.5).unwrap()),
    ];
    for (name, scheme) in schemes {
        let newton = Newton { tolerance: 1e-12, iterations: 20 };
        let run = |h: f64| drift(&simulate(&m, &Dynamics { scheme, newton, ..Dynamics::fixed(h) }, &times()).unwrap());
        let (coarse, fine) = (run(0.004), run(0.002));
        println!("{name}: {coarse:?} {fine:?}");
        assert!(fine[1] < 1e-9 && fine[3] < 1e-10, "{name}: {fine:?}");
        for k in [0, 2] {
            assert!(fine[k] < 1e-2 && (coarse[k] / fine[k]).log2() > 1.8, "{name}: {coarse:?} {fine:?}");
        }
    }
}
