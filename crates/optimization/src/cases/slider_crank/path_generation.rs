//! Path generation with a slider-crank mechanism (Section 6.2 of the paper; Paradis & Willmert 1983).
//!
//! Eight design variables place and size the mechanism so that its coupler point P passes close to eight desired points at
//! prescribed crank rotations. Lengths have the unit of the paper's drawing, angles are in radians.

#[cfg(feature = "mechanics")]
use super::coupler_path::CouplerPath;
use crate::cases::Optimum;
use crate::cases::random::SplitMix64;
use crate::function;
use crate::problem::{
    ClosedForm, Constraint, DesignVariable, Functional, Point, Problem, ProblemBuilder, Quantity, TimeGrid,
};
use autodiff::Scalar;
use error::Result;
use std::f64::consts::TAU;

/// Crank rotations Δγ(k) of Table III, in degrees.
pub const ROTATIONS_DEG: [f64; 8] = [0.0, 22.0, 44.0, 66.0, 88.0, 129.0, 221.0, 314.0];
/// Desired positions (x_G, y_G) of Table III.
pub const DESIRED: [[f64; 2]; 8] =
    [[26.0, 16.0], [23.0, 16.0], [20.0, 16.0], [17.0, 16.0], [14.0, 16.0], [10.0, 13.0], [20.0, 7.0], [30.0, 13.0]];
/// Substitute for the paper's start, which is not printed: F = 3505 (paper 3486), first trial step rejected.
pub const STAND_IN_START: [f64; 8] = [7.6, 24.0, -2.2, 19.0, 6.6, 4.9, 1.9, 2.39];
/// Another substitute: F = 3467, with nearly the paper's numbers of active move limits.
pub const SECOND_STAND_IN_START: [f64; 8] = [6.9, 18.3, -3.5, 11.6, 30.8, 5.3, 1.37, 0.56];

/// Ranges of [`random_starts`].
const START_RANGES: [[f64; 2]; 8] =
    [[3.0, 15.0], [10.0, 30.0], [-10.0, -1.0], [3.0, 25.0], [3.0, 25.0], [3.0, 15.0], [0.0, TAU], [0.0, TAU]];

/// Position and rotation of the coupler, body 2, in closed form (48)–(50).
pub struct Coupler;

impl ClosedForm for Coupler {
    fn response<S: Scalar>(&self, h: usize, b: &[S], rotation: S) -> S {
        let angle = b[7] + rotation;
        match h {
            0 => b[0] * angle.cos() + b[4],
            1 => b[0] * angle.sin() + b[5],
            _ => ((b[2] - b[0] * angle.sin() - b[5]) / b[1]).asin(),
        }
    }
}

/// The coupler point P (46), (47) from the pose (x₂, y₂, θ₂) of the coupler.
pub fn coupler_point<S: Scalar>(pose: &[S], b: &[S]) -> [S; 2] {
    let (sine, cosine) = (b[6] + pose[2]).sin_cos();
    [pose[0] + b[3] * cosine, pose[1] + b[3] * sine]
}

/// Σ |P − G|² over the desired points (43).
struct PathError;

impl Functional for PathError {
    fn over<S: Scalar>(&self, history: &[Point<S>]) -> S {
        let square = |(point, goal): (&Point<S>, &[f64; 2])| {
            let [x, y] = coupler_point(point.response, point.design);
            (x - goal[0]).powi(2) + (y - goal[1]).powi(2)
        };
        history.iter().zip(&DESIRED).map(square).fold(S::from(0.0), |a, b| a + b)
    }

    fn points(&self) -> Option<usize> {
        Some(DESIRED.len())
    }
}

/// The problem (43)–(50) from a start; for the start of the paper's table see [`STAND_IN_START`].
///
/// The pose of the coupler is the response of an analysis; the other functions are explicit. b₃ and b₅ … b₈ are
/// unbounded, as in the paper: bounds on the angles would create false optima.
pub fn path_generation(start: [f64; 8]) -> Result<Problem> {
    parts(start)?.build_analytic(Coupler)
}

/// [`path_generation`] with the pose of the coupler from the assembled mechanism and its derivatives.
#[cfg(feature = "mechanics")]
pub fn path_generation_assembled(start: [f64; 8]) -> Result<Problem> {
    use mechanics::initial_conditions::Assembly;
    let analysis =
        crate::responses::mechanism::KinematicResponses::new(CouplerPath, Assembly::default(), &rotations())?;
    parts(start)?.build(analysis)
}

/// Crank rotations in rad.
fn rotations() -> Vec<f64> {
    ROTATIONS_DEG.iter().map(|d| d.to_radians()).collect()
}

fn parts(start: [f64; 8]) -> Result<ProblemBuilder> {
    let mut parts = ProblemBuilder::new("slider-crank path generation");
    for (i, &value) in start.iter().enumerate() {
        let unit = if i >= 6 { "rad" } else { "length" };
        let variable = DesignVariable::new(format!("b{}", i + 1), unit, value);
        parts.variable(if [0, 1, 3].contains(&i) { variable.within(1.0, 30.0) } else { variable });
    }
    let rotation = parts.grid(TimeGrid::new("crank rotation", "rad", rotations())?);
    let pose = [("x2", "length"), ("y2", "length"), ("theta2", "rad")].map(|(r, u)| parts.transient(r, u, rotation));
    parts.minimize("path error", "length²", Quantity::whole(rotation, PathError).of(&pose));
    for (name, sign) in [("movability 1", 1.0), ("movability 2", -1.0)] {
        let reach = function!([sign: f64 = sign] |p| {
            p.design[1] * -0.85 + p.design[0] + (p.design[2] - p.design[5]) * sign
        });
        parts.subject_to(Constraint::at_most(name, 0.0, Quantity::plain(reach)));
    }
    Ok(parts)
}

/// Feasible random starts, reproducible in every version.
///
/// Lengths b₁ to b₆ lie between 3, 10, −10, 3, 3, 3 and 15, 30, −1, 25, 25, 15, angles between 0 and 2π; the crank can
/// rotate fully.
pub fn random_starts(seed: u64, count: usize) -> Vec<[f64; 8]> {
    let mut random = SplitMix64::new(seed);
    let starts = std::iter::repeat_with(|| START_RANGES.map(|range| random.within(range)));
    starts.filter(|b| b[0] + (b[2] - b[5]).abs() <= 0.85 * b[1]).take(count).collect()
}

/// The optimum, angles modulo 2π.
pub const fn optimum() -> Optimum {
    let source = "Gabriele 1993 and Etman et al. 1998, Table IV, here to seven digits";
    Optimum::published(3.746_106, &[9.3878, 30.0, -6.650, 12.7149, 8.2239, 9.4622, 0.82156, 0.91597], source)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objective_at_the_stand_in_starts_and_at_the_optimum() {
        let f = |b: &[f64]| {
            let problem = path_generation(STAND_IN_START).unwrap();
            problem.evaluate(b, &problem.analyze(b).unwrap()).unwrap()
        };
        assert!((f(&STAND_IN_START).objective - 3505.0).abs() < 1.0, "{}", f(&STAND_IN_START).objective);
        assert!((f(&SECOND_STAND_IN_START).objective - 3467.0).abs() < 1.0);
        let best = f(optimum().design.unwrap());
        assert!((best.objective - 3.746106).abs() < 1e-4);
        // The second movability constraint is active there.
        assert!(best.residuals[1][0] > -1e-2 && best.residuals[0][0] < -1.0);
    }
}
