//! A swinging bar and its design derivative, compared with closed forms.
//!
//! A uniform bar of length L, released at rest with the angle a₀ from the vertical, passes the vertical after a quarter of its
//! period, T = 2π √(2L/(3g)) / agm(1, cos(a₀/2)), with the angular velocity ω = √(3g(1 − cos a₀)/L). The angle is a function of
//! t/√L alone. Its derivative with respect to L is therefore −ω t/(2L) at that time.
//!
//! Run it with `cargo run -p linkwright-mechanics --example pendulum`.

use linkwright_mechanics::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

const GRAVITY: f64 = 9.81;

/// A uniform bar; the design variables are its length in m and its initial angle from the vertical in rad.
struct Pendulum;

impl ParametricMechanism for Pendulum {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let (zero, length, angle) = (S::from(0.0), b[0], b[1] - FRAC_PI_2);
        let mut m = Mechanism::with_gravity(zero, S::from(-GRAVITY));
        let (sin, cos) = angle.sin_cos();
        let pose = Pose { x: length * cos * 0.5, y: length * sin * 0.5, theta: angle };
        let bar = m.body("bar", S::from(1.0), length * length * (1.0 / 12.0), pose);
        m.revolute("pin", m.ground().origin(), bar.at(length * -0.5, zero));
        let sensor = m.coordinate_sensor("angle", m.ground().theta, bar.theta);
        for (name, measure) in [("angle", "position"), ("angular velocity", "velocity")] {
            let term = m.measure(sensor, measure)?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}

/// Arithmetic-geometric mean.
fn agm(mut a: f64, mut b: f64) -> f64 {
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

fn main() -> Result<()> {
    let [length, start] = [0.8, 2.0];
    let period = 2.0 * PI * (2.0 * length / (3.0 * GRAVITY)).sqrt() / agm(1.0, (0.5 * start).cos());
    let speed = -(3.0 * GRAVITY * (1.0 - start.cos()) / length).sqrt();
    let quarter = 0.25 * period;

    let history = differentiate(&Pendulum, &[length, start], &Dynamics::fixed(quarter / 2000.0), &[quarter])?;
    let [angle, velocity] = [history.values[0][0] + FRAC_PI_2, history.values[1][0]];
    let derivative = history.gradients[0][0][0];
    let exact = -speed * quarter / (2.0 * length);
    println!("after a quarter period of {quarter:.6} s          computed   closed form");
    println!("angle from the vertical in rad        {angle:12.7}  {:12.7}", 0.0);
    println!("angular velocity in rad/s             {velocity:12.7}  {speed:12.7}");
    println!("derivative of the angle in rad/m      {derivative:12.7}  {exact:12.7}");
    assert!(angle.abs() < 1e-5 && (velocity - speed).abs() < 1e-4 && (derivative - exact).abs() < 1e-4);
    Ok(())
}
