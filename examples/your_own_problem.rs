//! A new problem from scratch: `cargo run --example your_own_problem`.
//!
//! A ball is thrown over a house of height h and width w with the least speed. The design variables are the distance from the
//! wall, the speed v and the angle θ. The ball flies y(x) = x tan θ − g x² / (2 v² cos² θ) and must be above the roof at 41
//! positions, so the "time" of this problem is a position. At the height of the roof the ball needs at least v² = g w, at 45°,
//! to cross the width, hence v² = g (w + 2 h) at the ground. Here w = 2 h = 10 m: v² = 20 m · g, the angle is 60°, the distance
//! h (√3 − 1).
//!
//! The height is far from linear in distance, speed and angle, but exactly linear in the coefficients of the parabola. With these
//! as intermediate variables the approximation is exact.

use linkwright::Result;
use linkwright::prelude::*;
use linkwright::problem::{IntermediateMap, Intermediates};

/// Height of the roof and width of the house, m; gravity, m/s².
const HEIGHT: f64 = 5.0;
const WIDTH: f64 = 10.0;
const GRAVITY: f64 = 9.81;

/// Coefficients of y = c₀ + c₁ s + c₂ s² in m, at the distance s in m behind the front wall.
struct Parabola;

impl IntermediateMap for Parabola {
    fn component<S: Scalar>(&self, k: usize, b: &[S]) -> S {
        let (distance, speed, angle) = (b[0], b[1], b[2]);
        let curvature = (speed * angle.cos()).powi(-2) * (0.5 * GRAVITY);
        match k {
            0 => distance * angle.tan() - curvature * distance.powi(2),
            1 => angle.tan() - curvature * distance * 2.0,
            _ => -curvature,
        }
    }
}

/// The flight: one response, the height of the ball at position `s`.
struct Flight;

impl ClosedForm for Flight {
    fn response<S: Scalar>(&self, _: usize, b: &[S], s: S) -> S {
        let [c0, c1, c2] = [0, 1, 2].map(|k| Parabola.component(k, b));
        c0 + c1 * s + c2 * s * s
    }
}

fn ball_problem(intermediates: Intermediates) -> Result<Problem> {
    let mut parts = ProblemBuilder::new("ball over a house");
    parts.variable(DesignVariable::new("distance", "m", 6.0).within(0.1, 30.0));
    parts.variable(DesignVariable::new("speed", "m/s", 18.0).within(1.0, 50.0));
    parts.variable(DesignVariable::new("angle", "rad", 0.9).within(0.1, 1.5));
    let positions = (0..=40).map(|p| WIDTH * f64::from(p) / 40.0).collect();
    let roof = parts.grid(TimeGrid::new("position", "m", positions)?);
    let height = parts.transient("height", "m", roof);
    parts.linearize_in(height, intermediates);
    parts.minimize("energy", "m²/s²", Quantity::plain(function!(|p| p.design[1] * p.design[1] * 0.5)));
    parts.subject_to(Constraint::at_least("clears the roof", HEIGHT, Quantity::response(roof, height)));
    parts.build_analytic(Flight)
}

fn main() -> Result<()> {
    println!("cycle   distance      speed   angle [°]    energy      V [%]    E_g [%]");
    let show = |state: &RunState| {
        let Some(c) = state.history.last() else { return };
        let [distance, speed, angle] = [c.design[0], c.design[1], c.design[2].to_degrees()];
        let [f, v, e] = [c.objective, c.violation_pct, c.constraint_error_pct];
        println!("{:>5} {distance:>10.5} {speed:>10.5} {angle:>11.5} {f:>9.4} {v:>10.5} {e:>10.1e}", c.cycle);
    };
    let state = Method::slp().solve(&ball_problem(Intermediates::map(Parabola))?, show)?;
    println!("{:?}: {}", state.status, state.reason);
    let plain = Method::slp().solve(&ball_problem(Intermediates::Identity)?, |_| ())?;
    println!("cycles: {}; linearized in distance, speed and angle: {}", state.cycles(), plain.cycles());

    let exact = [HEIGHT * (3f64.sqrt() - 1.0), (20.0 * GRAVITY).sqrt(), 60f64.to_radians()];
    assert!(state.status.is_success() && state.cycles() < plain.cycles());
    assert!(state.history.iter().all(|c| c.constraint_error_pct < 1e-9), "the approximation is exact");
    assert!(state.design.iter().zip(exact).all(|(b, e)| (b / e - 1.0).abs() < 1e-5), "{:?} {exact:?}", state.design);
    assert!((plain.evaluation.objective / (10.0 * GRAVITY) - 1.0).abs() < 1e-4);
    Ok(())
}
