//! Mode shapes against closed forms, and their derivatives against differences.

#[path = "support/finite_differences.rs"]
mod finite_differences;

use autodiff::Scalar;
use finite_differences::extrapolated_differences;
use linkwright_mechanics::derivatives::modal::{About, differentiate_modes};
use linkwright_mechanics::derivatives::mode_shapes::{differentiate_mode_shapes, mode_shapes};
use linkwright_mechanics::elements::{BeamSection, Shear};
use linkwright_mechanics::motion::Fixed;
use linkwright_mechanics::{Error, Mechanism, ParametricMechanism, Pose, Result, Statics};
use std::f64::consts::PI;

/// Two masses in a row on two springs: mass, stiffness of the first spring, stiffness of the second one.
struct Chain;

impl ParametricMechanism for Chain {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let [one, two] = ["one", "two"].map(|name| m.coordinate(name, zero, zero));
        let ground = m.ground().x;
        for (k, (a, b_)) in [(ground, one), (one, two)].into_iter().enumerate() {
            m.inertia(&format!("mass {k}"), b_, b[0]);
            let spring = m.coordinate_spring(&format!("spring {k}"), a, b_, [b[1 + k], zero, zero, zero]);
            let term = m.measure(spring, "generalized_force")?;
            m.output(format!("force {k}"), &[term]);
            let sensor = m.coordinate_sensor(&format!("sensor {k}"), ground, b_);
            for name in ["position", "acceleration"] {
                let term = m.measure(sensor, name)?;
                m.output(format!("{name} {k}"), &[term]);
            }
        }
        Ok(m)
    }
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * (1.0 + b.abs()), "{a} instead of {b}");
}

#[test]
fn shapes_of_a_chain_in_closed_form() {
    let (mass, stiffness) = (2.0, 500.0);
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let found =
        differentiate_mode_shapes(&Chain, &[mass, stiffness, stiffness], About::Assembled, 0.0, &[0, 1]).unwrap();
    // ω² m/k = 2 − golden, shape (1, golden); ω² m/k = 1 + golden, shape (golden, −1).
    let unit = 1.0 / (mass * (1.0 + golden * golden)).sqrt();
    for (k, (shape, factor)) in [([1.0, golden], 2.0 - golden), ([golden, -1.0], 1.0 + golden)].into_iter().enumerate()
    {
        let [values, gradients] = [&found.values[k], &found.gradients[k].iter().map(|g| g[0]).collect::<Vec<_>>()];
        let square = factor * stiffness / mass;
        for c in 0..2 {
            close(values[3 * c + 1], shape[c] * unit, 1e-13);
            close(values[3 * c + 2], -square * shape[c] * unit, 1e-12);
            // The shape does not depend on the mass, its unit is m^(-1/2); that of accelerations is m^(-3/2).
            close(gradients[3 * c + 1], -0.5 * shape[c] * unit / mass, 1e-12);
            close(gradients[3 * c + 2], 1.5 * square * shape[c] * unit / mass, 1e-11);
        }
        let force = stiffness * shape[0] * unit;
        close(values[0].abs(), force.abs(), 1e-12);
    }
}

/// A double pendulum with a torsion spring, hanging in equilibrium next to a force: mass, length, stiffness, lever.
struct Hanging;

impl ParametricMechanism for Hanging {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, number) = (S::from(0.0), S::from);
        let mut m = Mechanism::with_gravity(zero, number(-9.81));
        let ground = m.ground();
        let half = b[1] * 0.5;
        let upper = m.body("upper", b[0], number(0.1), Pose { x: half, y: zero, theta: zero });
        let lower = m.body("lower", number(0.7), number(0.05), Pose { x: b[1], y: -b[3], theta: zero });
        let pin = m.revolute("pin", ground.origin(), upper.at(-half, zero));
        m.revolute("knee", upper.at(half, zero), lower.at(zero, b[3]));
        m.coordinate_spring("spring", ground.theta, upper.theta, [b[2], zero, zero, zero]);
        m.coordinate_spring("second spring", upper.theta, lower.theta, [b[2] * 0.2, zero, number(0.3), zero]);
        let sensor = m.sensor("tip", lower.at(number(0.1), -b[3]));
        for name in ["x", "y", "theta", "vx", "ay"] {
            let term = m.measure(sensor, name)?;
            m.output(name, &[term]);
        }
        let reaction = m.measure(pin, "force_y")?;
        m.output("reaction", &[reaction]);
        Ok(m)
    }
}

#[test]
fn derivatives_of_shapes_with_joints_about_an_equilibrium() {
    let (b, about) = ([1.3, 0.8, 25.0, 0.4], About::Equilibrium(Statics::default()));
    let which = [0, 1];
    let found = differentiate_mode_shapes(&Hanging, &b, about, 0.0, &which).unwrap();
    let plain = mode_shapes(&Hanging, &b, about, 0.0, &which).unwrap();
    let of = |b: &[f64]| mode_shapes(&Hanging, b, about, 0.0, &which).unwrap();
    for variable in 0..b.len() {
        let differences = extrapolated_differences(&b, variable, 2e-4 * b[variable], of);
        for mode in which {
            for output in 0..plain[mode].len() {
                assert_eq!(plain[mode][output].to_bits(), found.values[mode][output].to_bits());
                close(found.gradients[mode][output][variable], differences[mode][output], 1e-7);
            }
        }
    }
    // Velocities are out of phase, and reactions are those of the mode.
    assert!(plain.iter().all(|values| values[3] == 0.0 && values[5].abs() > 1e-3), "{plain:?}");
}

#[test]
fn equal_frequencies_and_missing_modes_are_named() {
    struct Equal;
    impl ParametricMechanism for Equal {
        fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
            let zero = S::from(0.0);
            let mut m = Mechanism::new();
            let ground = m.ground().x;
            for k in 0..2 {
                let own = m.coordinate(format!("q{k}"), zero, zero);
                m.inertia(&format!("mass {k}"), own, b[0]);
                m.coordinate_spring(&format!("spring {k}"), ground, own, [S::from(3.0), zero, zero, zero]);
            }
            Ok(m)
        }
    }
    let error = differentiate_mode_shapes(&Equal, &[2.0], About::Assembled, 0.0, &[1]).unwrap_err();
    assert!(matches!(error, Error::Unsupported { .. }) && error.to_string().contains("frequencies 1 to 2"), "{error}");
    assert!(mode_shapes(&Equal, &[2.0], About::Assembled, 0.0, &[1]).is_ok());
    let error = mode_shapes(&Equal, &[2.0], About::Assembled, 0.0, &[2]).unwrap_err().to_string();
    assert!(error.contains("there are only 2"), "{error}");
}

/// Ziegler's double pendulum: masses 2 m and m, lengths and torsional stiffness one, a follower force at the tip; m and force.
struct Ziegler;

impl ParametricMechanism for Ziegler {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let [zero, one, small] = [0.0, 1.0, 1e-12].map(S::from);
        let mut m = Mechanism::new();
        let ground = m.ground();
        let inner = m.body("inner", b[0] * 2.0, small, Pose { x: one, y: zero, theta: zero });
        let outer = m.body("outer", b[0], small, Pose { x: one * 2.0, y: zero, theta: zero });
        m.revolute("pin", ground.origin(), inner.at(-one, zero));
        m.revolute("knee", inner.origin(), outer.at(-one, zero));
        m.coordinate_spring("spring", ground.theta, inner.theta, [one, zero, zero, zero]);
        m.coordinate_spring("second spring", inner.theta, outer.theta, [one, zero, zero, zero]);
        m.follower_force("force", outer.origin(), S::from(PI), Fixed, &[b[1]]);
        for body in [inner, outer] {
            let sensor = m.coordinate_sensor("angle", ground.theta, body.theta);
            let term = m.measure(sensor, "position")?;
            m.output("angle", &[term]);
        }
        Ok(m)
    }
}

/// ω⁴ m²·2 − ω² m (7 − 2 P) + 1 = 0, with the unsymmetric stiffness [2 − P, P − 1; −1, 1]: the least load of flutter is 7/2 − √2.
///
/// # Sources
/// Ziegler, *Ing.-Arch.* 20 (1952) 49–56; Bolotin, *Nonconservative Problems of the Theory of Elastic Stability* (1963), Section 2.
#[test]
fn follower_forces_have_the_frequencies_of_their_unsymmetric_stiffness_and_flutter() {
    let about = About::Equilibrium(Statics::default());
    for p in [0.0, 0.5, 1.0, 2.0, 2.08] {
        let (mass, coefficient) = (1.3, 7.0 - 2.0 * p);
        let found = differentiate_modes(&Ziegler, &[mass, p], about, 0.0).unwrap();
        let root = (coefficient * coefficient - 8.0f64).sqrt();
        for (k, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let square = (coefficient + sign * root) / (4.0 * mass);
            close(found.squares[k], square, 1e-9);
            close(found.gradients[k][0], -square / mass, 1e-8);
            close(found.gradients[k][1], (-2.0 - sign * 2.0 * coefficient / root) / (4.0 * mass), 1e-7);
        }
        // Shapes from the second equation: (1 − ω² m) θ₂ = (1 + ω² m) θ₁.
        let shapes = differentiate_mode_shapes(&Ziegler, &[mass, p], about, 0.0, &[0, 1]).unwrap();
        for (k, values) in shapes.values.iter().enumerate() {
            let square = found.squares[k] * mass;
            close((1.0 - square) * values[1], (1.0 + square) * values[0], 1e-9);
            let rate = found.gradients[k][1] * mass;
            let gradient = |output: usize| shapes.gradients[k][output][1];
            let left = (1.0 - square) * gradient(1) - rate * values[1];
            close(left, (1.0 + square) * gradient(0) + rate * values[0], 1e-7);
        }
    }
    for p in [2.09, 3.0, 4.0] {
        let error = differentiate_modes(&Ziegler, &[1.0, p], about, 0.0).unwrap_err().to_string();
        assert!(error.contains("flutter"), "{p}: {error}");
    }
}

/// A cantilever of 1 m × 20 mm × b₀ in steel, of slender beam elements: stretching is stiffer than bending by many orders of magnitude.
struct Strip {
    elements: usize,
}

impl ParametricMechanism for Strip {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let number = S::from;
        let mut m = Mechanism::new();
        let section = BeamSection::rectangular(number(0.02), b[0], 2.1e11, 0.3, 7850.0);
        let ends = [[number(0.0); 2], [number(1.0), number(0.0)]];
        let (nodes, _) = m.beam("strip", ends, [None, None], self.elements, &section, Shear::Rigid);
        let root = nodes[0];
        [root.x, root.y, root.theta].into_iter().for_each(|coordinate| m.fix(coordinate));
        Ok(m)
    }
}

/// Frequencies vary smoothly with the design: their rounding error is that of the stiffness, not that of the highest frequency.
#[test]
fn frequencies_of_a_slender_beam_have_no_noise() {
    let exact = 1.875104068711961f64.powi(2) * (2.1e11f64 / 7850.0 / 12.0).sqrt() * 1e-3;
    // The stiffness of an element is that of the beam times the cube of their number, and so is its rounding error.
    for (elements, limit) in [(8, 1e-11), (40, 1e-9)] {
        let lowest = |thickness: f64| {
            let found = differentiate_modes(&Strip { elements }, &[thickness], About::Assembled, 0.0).unwrap();
            found.squares[..3].iter().map(|square| square.sqrt()).collect::<Vec<_>>()
        };
        let all: Vec<Vec<f64>> = (0..40).map(|k| lowest(1e-3 + 1e-10 * f64::from(k))).collect();
        for mode in 0..3 {
            let noise = all.windows(3).map(|w| (w[0][mode] - 2.0 * w[1][mode] + w[2][mode]).abs());
            let noise = noise.fold(0.0, f64::max) / all[0][mode];
            println!("{elements} elements, mode {mode}: {} rad/s, noise {noise:.1e}", all[0][mode]);
            assert!(noise < limit, "{elements} elements, mode {mode}: {noise:.1e}");
        }
        // Bernoulli's cantilever, ω = 1.8751² √(E I / (ρ A L⁴)); the error of the elements falls with the square of their size.
        let size = 1.0 / elements as f64;
        assert!((all[0][0] / exact - 1.0).abs() < 0.1 * size * size, "{} {exact}", all[0][0]);
    }
}
