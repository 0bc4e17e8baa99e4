//! A nonlinear impact absorber: linear and cubic stiffness, linear and quadratic damping.
//!
//! The problem of the [impact absorber](super::impact_absorber) with the force of a hardening or softening spring and of an
//! orifice damper,
//!
//! $$ \ddot y = -(k y + k_3 y^3 + c \dot y + c_2 |\dot y| \dot y) ,\qquad y(0) = 0,\ \dot y(0) = 1\ \text{m/s} . $$
//!
//! No absorber stops the mass within one metre with a peak deceleration below ½ m/s². This one reaches that limit:
//! with k = c₂ = ½ and k₃ = c = 0 the equation in the displacement, d(ẏ²)/dy = −y − ẏ², has the solution ẏ² = 1 − y, a
//! constant deceleration of ½ m/s². At the optimum the acceleration is at its bound all the time, which is difficult
//! for methods that rely on few active time points.
//!
//! # Sources
//! The linear problem of Etman et al. (1998) simplifies the nonlinear absorber of Afimiwala & Mayne, *J. Eng. Ind.* 96
//! (1974) 124–130. We did not have their force law and data, so law and optimum are ours.

use super::Optimum;
use super::impact_absorber::DURATION;
use crate::problem::{Constraint, DesignVariable, Problem, ProblemBuilder, Quantity, TimeGrid};
use crate::responses::mechanism::{OdeModel, OdeResponses};
use autodiff::Scalar;
use error::Result;
use mechanics::integrators::explicit::Explicit;

/// The optimum at all times, in closed form.
pub const fn continuous_optimum() -> Optimum {
    Optimum::computed(0.5, &[0.5, 0.0, 0.0, 0.5, 0.5], "constant deceleration, closed form")
}

/// The optimum on the 101 time points; the stop at 2 s is 0.04 s away from the nearest one.
pub const fn optimum() -> Optimum {
    let source = "two methods agree to eight digits";
    Optimum::computed(0.499_807_79, &[0.499_62, 0.0, 0.0, 0.499_81, 0.499_807_79], source)
}

/// The absorber: state y, ẏ; design k, k₃, c, c₂.
pub struct NonlinearAbsorber;

fn acceleration<S: Scalar>(b: &[S], y: &[S]) -> S {
    let orifice = if y[1].re() < 0.0 { -y[1] * y[1] } else { y[1] * y[1] };
    -(b[0] * y[0] + b[1] * y[0].powi(3) + b[2] * y[1] + b[3] * orifice)
}

impl OdeModel for NonlinearAbsorber {
    fn start<S: Scalar>(&self, _: &[S]) -> Vec<S> {
        vec![S::from(0.0), S::from(1.0)]
    }

    fn rates<S: Scalar>(&self, b: &[S], _: S, y: &[S], out: &mut [S]) {
        (out[0], out[1]) = (y[1], acceleration(b, y));
    }

    fn output<S: Scalar>(&self, h: usize, b: &[S], _: S, y: &[S]) -> S {
        if h == 0 { y[0] } else { acceleration(b, y) }
    }

    fn outputs(&self) -> usize {
        2
    }
}

/// Minimize the peak of |ÿ| while |y| ≤ 1 m at 101 time points.
pub fn peak_acceleration() -> Result<Problem> {
    let mut parts = ProblemBuilder::new("nonlinear impact absorber");
    let design = [
        ("stiffness k", "N/m", 0.5, [0.0, 2.0]),
        ("cubic stiffness k3", "N/m³", 0.1, [0.0, 2.0]),
        ("damping c", "N·s/m", 0.3, [0.0, 1.0]),
        ("orifice damping c2", "N·s²/m²", 0.1, [0.0, 1.0]),
    ];
    for (name, unit, start, [lower, upper]) in design {
        parts.variable(DesignVariable::new(name, unit, start).within(lower, upper));
    }
    let grid = TimeGrid::uniform(0.0, DURATION, 101)?;
    let times = grid.points.clone();
    let time = parts.grid(grid);
    let displacement = parts.transient("displacement", "m", time);
    let acceleration = parts.transient("acceleration", "m/s²", time);
    let bound = DesignVariable::new("peak acceleration", "m/s²", 0.6).within(0.0, 10.0);
    parts.minimize_peak(bound, Quantity::response(time, acceleration), 1.0);
    parts.subject_to_both(Constraint::between("displacement", [-1.0, 1.0], Quantity::response(time, displacement)));
    parts.build(OdeResponses::new(NonlinearAbsorber, Explicit::eighth_order(1e-11), &times)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_stops_at_constant_deceleration() {
        let problem = peak_acceleration().unwrap();
        let values = problem.analyze(continuous_optimum().design.unwrap()).unwrap().values;
        // Until 1.92 s the mass moves outwards.
        for (k, acceleration) in values[1].iter().enumerate().take(17) {
            let t = 0.12 * k as f64;
            assert!((acceleration + 0.5).abs() < 1e-9, "{t}: {acceleration}");
            assert!((values[0][k] - (t - 0.25 * t * t)).abs() < 1e-9);
        }
        assert!(values[1].iter().all(|a| a.abs() < 0.5 + 1e-9) && values[0].iter().all(|y| *y < 1.0 + 1e-9));
    }
}
