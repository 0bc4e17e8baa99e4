//! The impact absorber: a mass with spring and damper that hits a wall (Section 6.1 of the paper).
//!
//! A mass m = 1 kg with y(0) = 0 m and ẏ(0) = 1 m/s; design variables are the stiffness k and the damping c. With
//! D = k − (c/2)² the motion (34) through all regimes of damping is
//!
//! $$ y = t\,e^{-ct/2}\, S(D t^2), \qquad \dot y = e^{-ct/2}\bigl(C(D t^2) - \tfrac c2 t\, S(D t^2)\bigr), \qquad
//! \ddot y = -k y - c \dot y, $$
//!
//! with the entire functions S(x) = sin √x / √x and C(x) = cos √x, continued to x < 0. In this form value and
//! derivatives are smooth at critical damping.

#[cfg(feature = "mechanics")]
mod mechanism;

use super::Optimum;
use crate::function;
use crate::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity, TimeGrid};
use autodiff::Scalar;
use error::Result;

#[cfg(feature = "mechanics")]
pub use mechanism::Absorber;

/// Index of the displacement y, m, among the responses.
pub const DISPLACEMENT: usize = 0;
/// Index of the acceleration ÿ, m/s², among the responses.
pub const ACCELERATION: usize = 1;
/// Length of the observed interval, s.
pub const DURATION: f64 = 12.0;
/// Lower bound in place of the paper's open bound 0 < b.
const POSITIVE: f64 = 1e-6;

/// Displacement and acceleration in closed form, as the responses of an analysis.
pub struct ClosedFormMotion;

/// The time points of both problems.
fn grid() -> Result<TimeGrid> {
    TimeGrid::uniform(0.0, DURATION, 101)
}

impl ClosedForm for ClosedFormMotion {
    fn response<S: Scalar>(&self, h: usize, b: &[S], t: S) -> S {
        let [displacement, acceleration] = motion(b[0], b[1], t);
        if h == DISPLACEMENT { displacement } else { acceleration }
    }
}

/// y in m and ÿ in m/s² at time `t` in s, for stiffness `k` in N/m and damping `c` in N·s/m.
pub fn motion<S: Scalar>(k: S, c: S, t: S) -> [S; 2] {
    let half = c * 0.5;
    let (sine, cosine) = sine_cosine_of_root((k - half * half) * t * t);
    let decay = (-half * t).exp();
    let y = decay * t * sine;
    let velocity = decay * (cosine - half * t * sine);
    [y, -k * y - c * velocity]
}

/// sin √x / √x and cos √x, entire in x: hyperbolic for x < 0, power series near zero.
fn sine_cosine_of_root<S: Scalar>(x: S) -> (S, S) {
    if x.re() > 0.5 {
        let root = x.sqrt();
        let (sine, cosine) = root.sin_cos();
        (sine / root, cosine)
    } else if x.re() < -0.5 {
        let root = (-x).sqrt();
        (root.sinh() / root, root.cosh())
    } else {
        // Ten terms leave less than 0.5¹⁰ / 20! of the value, and of its derivatives.
        let (mut sine, mut cosine) = (S::from(1.0), S::from(1.0));
        for k in (1..=10).rev() {
            let even = f64::from(2 * k);
            cosine = -cosine * x / (even * (even - 1.0)) + 1.0;
            sine = -sine * x / (even * (even + 1.0)) + 1.0;
        }
        (sine, cosine)
    }
}

/// Minimize the peak of |ÿ| by the bound variable b₃ (37)–(41); Table I.
///
/// The acceleration constraints are normalized by an absolute distance of 1 m/s², which gives the printed violations.
pub fn peak_acceleration() -> Result<Problem> {
    parts_of_peak_acceleration()?.build_analytic(ClosedFormMotion)
}

/// Minimize the mean square of ÿ (42), a quadrature of the approximate acceleration; Table II.
///
/// The quadrature is Simpson's rule on the 101 time points, which gives all printed digits.
pub fn comfort() -> Result<Problem> {
    parts_of_comfort()?.build_analytic(ClosedFormMotion)
}

/// [`peak_acceleration`] with the motion simulated and differentiated as a mechanism of mass, spring and damper.
///
/// Steps of order 8 at a tolerance of 1e-12: responses agree with the closed form to 1e-10.
#[cfg(feature = "mechanics")]
pub fn peak_acceleration_simulated() -> Result<Problem> {
    parts_of_peak_acceleration()?.build(mechanism::simulated(&grid()?)?)
}

/// [`comfort`] with the motion simulated as in [`peak_acceleration_simulated`].
#[cfg(feature = "mechanics")]
pub fn comfort_simulated() -> Result<Problem> {
    parts_of_comfort()?.build(mechanism::simulated(&grid()?)?)
}

fn parts_of_peak_acceleration() -> Result<ProblemBuilder> {
    let mut parts = ProblemBuilder::new("impact absorber, peak acceleration");
    let [displacement, acceleration, time] = absorber(&mut parts)?;
    let bound = DesignVariable::new("peak acceleration", "m/s²", 0.85).within(0.0, f64::INFINITY);
    parts.minimize_peak(bound, Quantity::response(time, acceleration), 1.0);
    stay_within_a_metre(&mut parts, displacement, time);
    Ok(parts)
}

fn parts_of_comfort() -> Result<ProblemBuilder> {
    let mut parts = ProblemBuilder::new("impact absorber, comfort criterion");
    let [displacement, acceleration, time] = absorber(&mut parts)?;
    let weights = grid()?.simpson()?.into_iter().map(|w| w / DURATION).collect();
    let square = function!(|p| p.response[0] * p.response[0]);
    parts.minimize("mean square acceleration", "m²/s⁴", Quantity::sum(time, weights, square).of(&[acceleration]));
    stay_within_a_metre(&mut parts, displacement, time);
    Ok(parts)
}

/// Variables, time grid and responses common to both problems: indices of y, ÿ and the grid.
fn absorber(parts: &mut ProblemBuilder) -> Result<[usize; 3]> {
    parts.variable(DesignVariable::new("stiffness k", "N/m", 1.0).within(POSITIVE, 1.0));
    parts.variable(DesignVariable::new("damping c", "N·s/m", 0.3).within(POSITIVE, 1.0));
    let time = parts.grid(grid()?);
    Ok([parts.transient("displacement", "m", time), parts.transient("acceleration", "m/s²", time), time])
}

/// |y| ≤ 1 m at every time point (40), (41).
fn stay_within_a_metre(parts: &mut ProblemBuilder, displacement: usize, time: usize) {
    parts.subject_to_both(Constraint::between("displacement", [-1.0, 1.0], Quantity::response(time, displacement)));
}

/// The optimum of [`peak_acceleration`] on its 101 time points.
pub const fn peak_acceleration_optimum() -> Optimum {
    let source = "Etman et al. 1998, Table I, here to eight digits";
    Optimum::published(0.520_286_04, &[0.362_761_12, 0.482_306_74, 0.520_286_04], source)
}

/// The optimum of [`peak_acceleration`] with its constraints at all times.
pub const fn continuous_peak_acceleration_optimum() -> Optimum {
    let source = "closed form of Peters, SIAM Rev. 39 (1997) 118-122";
    Optimum::published(0.520_598_617_7, &[0.360_570_211_3, 0.485_151_068_4, 0.520_598_617_7], source)
}

/// The optimum of [`comfort`] on its 101 time points.
pub const fn comfort_optimum() -> Optimum {
    let source = "Etman et al. 1998, Table II, here to seven digits";
    Optimum::published(0.038_037_835, &[0.098_501, 0.788_336], source)
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::{gradient, hessian};

    #[test]
    fn under_critical_and_over_damping_agree_with_their_own_formulas() {
        let t: f64 = 1.7;
        let y = |k, c| motion(k, c, t)[0];
        let root = (0.5f64 - 0.01).sqrt();
        assert!((y(0.5, 0.2) - (-0.1 * t).exp() * (root * t).sin() / root).abs() < 1e-15);
        assert!((y(0.25, 1.0) - t * (-0.5 * t).exp()).abs() < 1e-15);
        let root = (0.16f64 - 0.1).sqrt();
        assert!((y(0.1, 0.8) - (-0.4 * t).exp() * (root * t).sinh() / root).abs() < 1e-15);
    }

    #[test]
    fn the_equation_of_motion_holds_by_duals_in_time() {
        for (k, c) in [(1.0, 0.3), (0.25, 1.0), (0.1, 0.9)] {
            let (y, slope, curvature) = hessian(|t| motion(k.into(), c.into(), t[0])[0], &[2.3]);
            assert!((curvature[(0, 0)] + c * slope[0] + k * y).abs() < 1e-13);
            assert!((motion(k, c, 2.3)[1] - curvature[(0, 0)]).abs() < 1e-13);
        }
    }

    #[test]
    fn derivatives_are_smooth_through_critical_damping_and_through_the_series() {
        let slope = |k: f64| gradient(|b| motion(b[0], b[1], 2.0.into())[1], &[k, 1.0]).1;
        for k in [0.25, 0.25 + 0.125, 0.25 - 0.125] {
            let (below, above) = (slope(k - 1e-9), slope(k + 1e-9));
            assert!((below[0] - above[0]).abs() < 1e-8 && (below[1] - above[1]).abs() < 1e-8, "{k}");
        }
    }
}
