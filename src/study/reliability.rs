//! First-order reliability method: the most probable failure.

use crate::{Error, Result};
use nalgebra::DMatrix;
use nlp::{Gradients, Program, Sqp, SubproblemSolver, Values};
use std::sync::{Mutex, PoisonError};

/// The point of a limit state g = 0 nearest to the origin, in standard normal variables.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignPoint {
    /// Reliability index β: distance of the point from the origin, negative if the origin fails.
    pub beta: f64,
    /// The point u*.
    pub u: Vec<f64>,
    /// Evaluations of g and its gradient.
    pub evaluations: usize,
}

/// Largest |u| of a variable: beyond it, its probability is smaller than the smallest number.
const LARGEST: f64 = 38.0;

/// Finds the point of g(u) = 0 that is nearest to the origin of standard normal variables u: min ½|u|² subject to g(u) = 0, by sequential
/// quadratic programming.
///
/// `limit_state` returns g and its gradient; g > 0 is safe. The probability of failure is Φ(−β) to first order, and exactly so if g is linear.
/// The first step is that of Rackwitz and Fiessler; the later ones use the curvature of g, too, so that the iteration does not cycle.
///
/// # Errors
/// Those of `limit_state`; [`Error::Analysis`] if no point of the limit state is found.
///
/// # Sources
/// R. Rackwitz and B. Fiessler, *Comput. Struct.* 9 (1978) 489–494; P.-L. Liu and A. Der Kiureghian, *Struct. Saf.* 9 (1991) 161–177,
/// for its solution by nonlinear programming.
pub fn first_order_reliability(
    n: usize,
    limit_state: impl Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync,
) -> Result<DesignPoint> {
    let origin = vec![0.0; n];
    let (at_origin, slope) = limit_state(&origin)?;
    // The change of g over one standard deviation.
    let scale = slope.iter().map(|d| d * d).sum::<f64>().sqrt();
    let failed = |why: String| Error::analysis("reliability index", why, "start from another mean, or use the sample");
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(failed("the limit state does not depend on the variables at their means".to_owned()));
    }
    let nearest = NearestPoint {
        limit_state,
        scale,
        lower: vec![-LARGEST; n],
        upper: vec![LARGEST; n],
        last: Mutex::new(Evaluated { u: origin.clone(), g: at_origin, gradient: slope, count: 1 }),
    };
    let solution = Sqp::default().solve(&nearest, &origin)?;
    if !solution.status.was_successful() {
        return Err(failed(format!("the search for the most probable failure ended as {}", solution.status)));
    }
    let size = solution.x.iter().map(|v| v * v).sum::<f64>().sqrt();
    let evaluations = nearest.last.lock().unwrap_or_else(PoisonError::into_inner).count;
    Ok(DesignPoint { beta: size.copysign(at_origin), u: solution.x, evaluations })
}

/// A value of g, with the number of evaluations so far.
struct Evaluated {
    u: Vec<f64>,
    g: f64,
    gradient: Vec<f64>,
    count: usize,
}

/// min ½|u|² subject to g(u) = 0.
struct NearestPoint<G> {
    limit_state: G,
    scale: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// The last evaluation: the solver asks for the gradient where it asked for the value.
    last: Mutex<Evaluated>,
}

impl<G: Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync> NearestPoint<G> {
    fn at(&self, u: &[f64]) -> Result<(f64, Vec<f64>)> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.u != u {
            let (g, gradient) = (self.limit_state)(u)?;
            *last = Evaluated { u: u.to_vec(), g, gradient, count: last.count + 1 };
        }
        Ok((last.g / self.scale, last.gradient.iter().map(|d| d / self.scale).collect()))
    }
}

impl<G: Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync> Program for NearestPoint<G> {
    fn variables(&self) -> usize {
        self.lower.len()
    }

    fn rows(&self) -> usize {
        1
    }

    fn lower(&self) -> &[f64] {
        &self.lower
    }

    fn upper(&self) -> &[f64] {
        &self.upper
    }

    fn is_equality(&self, _: usize) -> bool {
        true
    }

    fn values(&self, u: &[f64]) -> Result<Values> {
        let (g, _) = self.at(u)?;
        Ok(Values { objective: 0.5 * u.iter().map(|v| v * v).sum::<f64>(), rows: vec![g] })
    }

    fn gradients(&self, u: &[f64]) -> Result<Gradients> {
        let (_, gradient) = self.at(u)?;
        Ok(Gradients {
            values: self.values(u)?,
            objective: u.to_vec(),
            rows: DMatrix::from_row_slice(1, u.len(), &gradient),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beta(n: usize, g: impl Fn(&[f64]) -> (f64, Vec<f64>) + Sync) -> DesignPoint {
        first_order_reliability(n, |u| Ok(g(u))).unwrap()
    }

    /// g = c − aᵀu: β = c/|a|.
    #[test]
    fn a_linear_limit_state_has_its_exact_index() {
        for c in [6.0, -6.0, 0.0] {
            let found = beta(3, |u| (c - u[0] - 2.0 * u[1] - 2.0 * u[2], vec![-1.0, -2.0, -2.0]));
            assert!((found.beta - c / 3.0).abs() < 1e-10, "{found:?}");
        }
    }

    /// g = r² − |u − a|² with |a| < r: the nearest point lies in the direction of a, at the distance r − |a|.
    #[test]
    fn a_circle_has_its_exact_index() {
        let (a, r) = ([0.6, 0.8], 4.0);
        let found = beta(2, |u| {
            let d = [u[0] - a[0], u[1] - a[1]];
            (r * r - d[0] * d[0] - d[1] * d[1], vec![-2.0 * d[0], -2.0 * d[1]])
        });
        assert!((found.beta - (r - 1.0)).abs() < 1e-7, "{found:?}");
    }

    /// x₁³ + x₂³ = 18 for x ~ N(10, 5) and N(9.9, 5), where β times the curvature exceeds 1 and the iteration of Rackwitz and Fiessler
    /// cycles. The reference is the least distance over points of the curve.
    #[test]
    fn a_strongly_curved_limit_state_does_not_cycle() {
        let found = beta(2, |u| {
            let x = [10.0 + 5.0 * u[0], 9.9 + 5.0 * u[1]];
            (x[0].powi(3) + x[1].powi(3) - 18.0, vec![15.0 * x[0] * x[0], 15.0 * x[1] * x[1]])
        });
        let distance = |k: i32| {
            let x = 1e-5 * f64::from(k);
            f64::hypot((x - 10.0) / 5.0, ((18.0 - x.powi(3)).cbrt() - 9.9) / 5.0)
        };
        let least = (100_000..260_000).map(distance).fold(f64::INFINITY, f64::min);
        assert!((found.beta - least).abs() < 1e-7, "{found:?}, {least}");
    }

    #[test]
    fn a_constant_limit_state_is_an_error() {
        let flat = first_order_reliability(2, |_| Ok((1.0, vec![0.0, 0.0])));
        assert!(flat.unwrap_err().to_string().contains("does not depend"));
    }
}
