//! Chains of rods: against Lagrange's equations in absolute angles, and their energy.

use crate::{assert_close, has_derivatives_alike, settings};
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::simulate_explicitly;
use linkwright_mechanics::integrators::explicit::Coordinates;
use linkwright_mechanics::mechanism::{Body, Mechanism, ParametricMechanism, Pose};
use linkwright_mechanics::{Explicit, History, Result};

const G: f64 = 9.81;

/// A chain of slender rods, together 1 m and 1 kg, with these angles and angular velocities.
fn chain(angles: &[f64], rates: &[f64]) -> (Mechanism<f64>, Vec<Body>) {
    let n = angles.len();
    let length = 1.0 / n as f64;
    let mut m = Mechanism::with_gravity(0.0, -G);
    let (mut x, mut y, mut last, mut bodies) = (0.0, 0.0, m.ground().origin(), Vec::new());
    for (k, (theta, rate)) in angles.iter().zip(rates).enumerate() {
        let (sin, cos) = theta.sin_cos();
        let pose = Pose { x: x + 0.5 * length * cos, y: y + 0.5 * length * sin, theta: *theta };
        let rod = m.body(&format!("rod {k}"), length, length * length * length / 12.0, pose);
        m.set_velocity(rod.theta, *rate);
        m.revolute(&format!("pin {k}"), last, rod.at(-0.5 * length, 0.0));
        (x, y, last) = (x + length * cos, y + length * sin, rod.at(0.5 * length, 0.0));
        bodies.push(rod);
    }
    (m, bodies)
}

/// Angular accelerations by Lagrange's equations in absolute angles, with a dense mass matrix.
fn lagrange(angles: &[f64], rates: &[f64]) -> Vec<f64> {
    let n = angles.len();
    let l = 1.0 / n as f64;
    let after = |i: usize| (n - 1 - i) as f64 * l;
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|i| {
            let weight = -G * l * (0.5 * l + after(i)) * angles[i].cos();
            let mass =
                |j: usize| if i == j { l * l * (l / 3.0 + after(i)) } else { l * l * (0.5 * l + after(i.max(j))) };
            let spin = (0..n).map(|j| mass(j) * (angles[i] - angles[j]).sin() * rates[j] * rates[j]).sum::<f64>();
            (0..n).map(|j| mass(j) * (angles[i] - angles[j]).cos()).chain([weight - spin]).collect()
        })
        .collect();
    for k in 0..n {
        let pivot = rows[k].clone();
        for row in &mut rows[k + 1..] {
            let factor = row[k] / pivot[k];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
    }
    let mut solution = vec![0.0; n];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| rows[k][j] * solution[j]).sum();
        solution[k] = (rows[k][n] - known) / rows[k][k];
    }
    solution
}

#[test]
fn accelerations_are_those_of_lagranges_equations() {
    for n in [1, 2, 8, 32] {
        let angles: Vec<f64> = (0..n).map(|k| 0.3 * (1.0 + 1.7 * k as f64).sin()).collect();
        let rates: Vec<f64> = (0..n).map(|k| (2.0 + 0.9 * k as f64).cos()).collect();
        let (m, bodies) = chain(&angles, &rates);
        let run = simulate_explicitly(&m, &settings(Coordinates::Relative), &[0.0]).unwrap();
        // The initial velocities are made consistent with the joints: those of the translations are not given.
        let place = |coordinate: String| m.coordinates().position(|(name, _)| name == coordinate).unwrap();
        let thetas: Vec<usize> = (0..n).map(|k| place(format!("rod {k}.theta"))).collect();
        assert_eq!(bodies.len(), n);
        let [computed, rates] = [&run.last.a, &run.last.v].map(|x| thetas.iter().map(|&i| x[i]).collect::<Vec<_>>());
        assert_close(&format!("chain of {n}"), &computed, &lagrange(&angles, &rates), 1e-10);
    }
}

#[test]
fn a_chain_keeps_its_energy() {
    let (mut m, _) = chain(&[0.0; 16], &[0.0; 16]);
    let energies = [m.kinetic_energy(), m.potential_energy()];
    m.output("energy", &energies);
    m.output("kinetic", &energies[..1]);
    let times: Vec<f64> = (0..=40).map(|k| 0.05 * f64::from(k)).collect();
    let run = |coordinates| -> History {
        simulate_explicitly(&m, &Explicit::eighth_order(1e-11).with_coordinates(coordinates), &times).unwrap()
    };
    let history = run(Coordinates::Automatic);
    assert_eq!(history.coordinates, Coordinates::Relative);
    let (energy, kinetic) = (&history.values[0], &history.values[1]);
    let largest = kinetic.iter().fold(0.0f64, |a, x| a.max(*x));
    assert!(largest > 2.0 && energy.iter().all(|e| (e - energy[0]).abs() < 1e-9), "{energy:?}");
}

/// A double pendulum on a cart, without prescribed motions.
struct Undriven;

impl ParametricMechanism for Undriven {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let [length, mass, k, speed] = std::array::from_fn(|i| b[i]);
        let n = |x: f64| S::from(x);
        let mut m = Mechanism::with_gravity(n(0.0), n(-G));
        let cart = m.body("cart", n(1.5), n(0.1), Pose { x: n(0.0), y: n(0.0), theta: n(0.0) });
        let (ground, zero) = (m.ground(), n(0.0));
        m.prismatic("rail", ground.origin(), zero, cart.origin(), zero);
        m.spring_damper("spring", ground.at(n(-1.0), zero), cart.origin(), [k, n(0.1), n(1.0)]);
        let first = m.body("first", mass, n(0.02), Pose { x: length, y: zero, theta: zero });
        let second = m.body("second", n(0.7), n(0.03), Pose { x: length * 2.5, y: zero, theta: zero });
        m.revolute("shoulder", cart.at(zero, n(0.1)), first.at(-length, n(0.1)));
        m.revolute("elbow", first.at(length, zero), second.at(-length * 0.5, zero));
        m.set_velocity(second.theta, speed);
        let sensor = m.sensor("tip", second.at(length, zero));
        for measure in ["x", "y", "vx", "ay"] {
            let term = m.measure(sensor, measure)?;
            m.output(measure, &[term]);
        }
        Ok(m)
    }
}

/// The sweeps with shared stages kept derivatives of angular accelerations from the last outputs where nothing was prescribed.
#[test]
fn outputs_do_not_change_the_derivatives_after_them() {
    has_derivatives_alike(&Undriven, &[0.4, 1.1, 20.0, 1.5]);
}
