//! First-order reliability method: the most probable failure.

use super::distribution::normal_quantile;
use super::sequence::{PointSequence, SequenceKind};
use crate::{Error, Result};
use nalgebra::DMatrix;
use nlp::{Gradients, Program, Sqp, SubproblemSolver, Values};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// The point of a limit state g = 0 nearest to the origin, in standard normal variables.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignPoint {
    /// Reliability index β: distance of the point from the origin, negative if the origin fails. Infinite if g has one sign within 8 standard
    /// deviations of every variable, so that the probability of failure is 0 or 1 up to 1e-15.
    pub beta: f64,
    /// The point u*; empty if β is infinite.
    pub u: Vec<f64>,
    /// Evaluations of g and its gradient.
    pub evaluations: usize,
}

/// Largest |u| of a variable: the probability of a point beyond it is zero up to rounding.
const LARGEST: f64 = 8.0;
/// Relative error of the point. That of β is of second order in it.
const ACCURACY: f64 = 1e-7;
/// Largest number of iterations of a search.
const ITERATIONS: usize = 50;
/// Distances from the origin at which g is explored.
const EXPLORED: [f64; 2] = [3.0, 6.0];
/// Largest number of explored points from which a search for the nearest point starts.
const STARTS: usize = 4;
/// Cosine of the angle between two directions above which they lead to the same point.
const SAME_DIRECTION: f64 = 0.8;
/// Step of the differences of gradients at the origin, in standard deviations.
const STEP: f64 = 0.1;

/// Finds the point of g(u) = 0 that is nearest to the origin of standard normal variables u: min ½|u|² subject to g(u) = 0, by sequential
/// quadratic programming from several starts, of which the nearest end counts.
///
/// `value` returns g, `gradient` g and its gradient; g > 0 is safe. The probability of failure is Φ(−β) to first order, and exactly so if g is
/// linear.
///
/// The first start is the origin. Its first step is that of Rackwitz and Fiessler; the later ones use the curvature of g, too, so that the iteration
/// does not cycle. A limit with curvature may have several points that are nearer than all others around them. The other starts are
/// therefore at most four points, in different directions, with the nearest estimated limits: g is explored at 3 and 6 standard deviations
/// along the axes, along the
/// eigenvectors of the second derivatives at the origin, and in 8 + 4n evenly distributed directions, on both sides. A nearer point
/// between these directions may be missed; a sample is an independent check.
///
/// If no start leads to a point, the least |g| is sought: a sign of g that does not change within 8 standard deviations of every variable gives an infinite index.
///
/// # Errors
/// Those of `gradient` at the origin; those that [end](Error::ends_run) a run; [`Error::Analysis`] if the limit state is reached, but its nearest
/// point is not found.
///
/// # Sources
/// R. Rackwitz and B. Fiessler, *Comput. Struct.* 9 (1978) 489–494; P.-L. Liu and A. Der Kiureghian, *Struct. Saf.* 9 (1991) 161–177,
/// for its solution by nonlinear programming; A. Der Kiureghian and T. Dakessian, *Struct. Saf.* 20 (1998) 37–49, for limits with several points.
pub fn first_order_reliability(
    n: usize,
    value: impl Fn(&[f64]) -> Result<f64> + Sync,
    gradient: impl Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync,
) -> Result<DesignPoint> {
    let count = AtomicUsize::new(0);
    let counted = || count.fetch_add(1, Ordering::Relaxed);
    let value = |u: &[f64]| {
        counted();
        value(u)
    };
    let limit_state = |u: &[f64]| {
        counted();
        gradient(u)
    };
    let origin = Evaluated::at(&limit_state, vec![0.0; n])?;
    let at_origin = origin.g;
    let explored = explored(&value, &limit_state, &origin)?;
    let starts: Vec<Evaluated> =
        std::iter::once(origin).chain(explored).filter(|start| start.steepness() > 0.0).collect();
    let done = |u: Vec<f64>| {
        let beta = norm(&u).copysign(at_origin);
        DesignPoint { beta, u, evaluations: count.load(Ordering::Relaxed) }
    };
    let beyond = || DesignPoint {
        beta: f64::INFINITY.copysign(at_origin),
        u: vec![],
        evaluations: count.load(Ordering::Relaxed),
    };
    let Some(start) = starts.first() else { return Ok(beyond()) };
    let ends = starts.iter().map(|start| nearest(&limit_state, start)).collect::<Result<Vec<_>>>()?;
    let points = ends.iter().filter_map(|end| end.as_ref().ok());
    if let Some(u) = points.min_by(|a, b| norm(a).total_cmp(&norm(b))) {
        return Ok(done(u.clone()));
    }
    // The limit may be out of reach.
    match tolerated(crossing(&limit_state, start, at_origin))?.flatten() {
        Some(None) => return Ok(beyond()),
        Some(Some(there)) => {
            if let Ok(u) = nearest(&limit_state, &there)? {
                return Ok(done(u));
            }
        }
        None => {}
    }
    let end = ends.into_iter().find_map(std::result::Result::err).unwrap_or_default();
    let why = format!("the search for the most probable failure ended: {end}");
    Err(Error::analysis("reliability index", why, "start from another mean, or use the sample"))
}

/// The value of a result; `None` for an error, unless it ends the run: far from the mean a model may have no analysis.
fn tolerated<T>(result: Result<T>) -> Result<Option<T>> {
    match result {
        Err(error) if error.ends_run() => Err(error),
        result => Ok(result.ok()),
    }
}

fn norm(u: &[f64]) -> f64 {
    u.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// A point at some distance from the origin in a direction.
fn along(direction: &[f64], distance: f64) -> Vec<f64> {
    direction.iter().map(|d| distance * d).collect()
}

/// Starts in different directions with the nearest estimated limits: points on the limit where explored points lie beyond it.
fn explored(
    value: &(impl Fn(&[f64]) -> Result<f64> + Sync),
    limit_state: &(impl Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync),
    origin: &Evaluated,
) -> Result<Vec<Evaluated>> {
    let sign = 1f64.copysign(origin.g);
    // Estimated distance of the limit, direction, and the distance at which it was estimated.
    let mut rays: Vec<(f64, Vec<f64>, f64)> = vec![];
    for direction in directions(limit_state, origin)? {
        for radius in EXPLORED {
            let Some(g) = tolerated(value(&along(&direction, radius)))?.filter(|g| g.is_finite()) else { continue };
            let slope: f64 = origin.gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
            if let Some(distance) = first_zero(sign * origin.g, sign * slope, sign * g, radius) {
                rays.push((distance, direction.clone(), radius));
            }
            if sign * g < 0.0 {
                break;
            }
        }
    }
    rays.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<(f64, Vec<f64>, f64)> = vec![];
    for ray in rays {
        let cosine = |other: &[f64]| ray.1.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
        if chosen.len() < STARTS && chosen.iter().all(|other| cosine(&other.1) < SAME_DIRECTION) {
            chosen.push(ray);
        }
    }
    let mut starts = vec![];
    for (distance, direction, radius) in chosen {
        let distance = if distance < radius { first_violation(value, &direction, radius, sign)? } else { radius };
        starts.extend(tolerated(Evaluated::at(limit_state, along(&direction, distance)))?);
    }
    Ok(starts)
}

/// The least positive zero of the parabola with the value and the slope at 0, and the value at r; `None` if it has none, or if they are not finite.
fn first_zero(value: f64, slope: f64, at_r: f64, r: f64) -> Option<f64> {
    let curvature = (at_r - value - slope * r) / (r * r);
    let root = (slope * slope - 4.0 * curvature * value).max(if at_r < 0.0 { 0.0 } else { f64::NEG_INFINITY }).sqrt();
    // 2c/(−b ± √…) of c + bs + as² = 0, which does not cancel.
    let zeros = [2.0 * value / (-slope + root), 2.0 * value / (-slope - root)];
    zeros.into_iter().filter(|s| s.is_finite() && *s > 0.0).min_by(f64::total_cmp)
}

/// A distance in a direction slightly beyond the limit, by bisection between the origin and a point that violates it.
fn first_violation(value: &impl Fn(&[f64]) -> Result<f64>, direction: &[f64], radius: f64, sign: f64) -> Result<f64> {
    let (mut low, mut high) = (0.0, radius);
    for _ in 0..COARSE_BISECTIONS {
        let middle = 0.5 * (low + high);
        match tolerated(value(&along(direction, middle)))? {
            Some(g) if sign * g > 0.0 => low = middle,
            Some(g) if g.is_finite() => high = middle,
            _ => break,
        }
    }
    Ok(high)
}

/// Number of bisections to a start.
const COARSE_BISECTIONS: usize = 6;

/// Unit vectors in which g is explored: the axes, the eigenvectors of the second derivatives at the origin, and evenly distributed ones.
fn directions(limit_state: &impl Fn(&[f64]) -> Result<(f64, Vec<f64>)>, origin: &Evaluated) -> Result<Vec<Vec<f64>>> {
    let n = origin.u.len();
    let axis = |k: usize| (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    let mut all: Vec<Vec<f64>> = (0..n).map(axis).collect();
    let mut hessian = DMatrix::zeros(n, n);
    for k in 0..n {
        let Some((_, shifted_gradient)) = tolerated(limit_state(&along(&axis(k), STEP)))? else { break };
        (0..n).for_each(|i| hessian[(i, k)] = (shifted_gradient[i] - origin.gradient[i]) / STEP);
    }
    if n > 1 && hessian.iter().all(|h: &f64| h.is_finite()) {
        let vectors = ((&hessian + hessian.transpose()) * 0.5).symmetric_eigen().eigenvectors;
        all.extend(vectors.column_iter().map(|v| v.iter().copied().collect()));
        let points = PointSequence::new(SequenceKind::LatinHypercube, n, 4 + 2 * n, 1)?;
        for number in 0..4 + 2 * n {
            let u: Vec<f64> = points.point(number).into_iter().map(normal_quantile).collect();
            all.push(along(&u, 1.0 / norm(&u)));
        }
    }
    let both = |direction: Vec<f64>| [along(&direction, -1.0), direction];
    Ok(all.into_iter().flat_map(both).collect())
}

/// The point of g = 0 nearest to the origin, sought from a point; otherwise how the search ended, in words.
fn nearest(
    limit_state: &(impl Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync),
    start: &Evaluated,
) -> Result<std::result::Result<Vec<f64>, String>> {
    let problem = DesignPointSearch::new(limit_state, start, Aim::Nearest);
    Ok(match solver()?.solve(&problem, &start.u) {
        Ok(solution) if solution.status.was_successful() => Ok(solution.x),
        Ok(solution) => Err(solution.status.to_string()),
        Err(error) if error.ends_run() => return Err(error),
        Err(error) => Err(error.to_string()),
    })
}

fn solver() -> Result<Sqp> {
    Sqp::default().with_tolerance(ACCURACY)?.with_iterations(ITERATIONS)
}

/// A point of g = 0: `Some(None)` if g has the sign of the origin at its least size, `None` if that is not found.
fn crossing(
    limit_state: &(impl Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync),
    start: &Evaluated,
    at_origin: f64,
) -> Result<Option<Option<Evaluated>>> {
    let sign = 1f64.copysign(at_origin);
    let problem = DesignPointSearch::new(limit_state, start, Aim::Least(sign));
    let least = solver()?.solve(&problem, &start.u)?;
    let corner = start.gradient.iter().map(|d| if *d == 0.0 { 0.0 } else { -LARGEST * (sign * d).signum() }).collect();
    let ends = [Evaluated::at(limit_state, least.x)?, Evaluated::at(limit_state, corner)?];
    let Some(beyond) = ends.into_iter().find(|end| sign * end.g <= 0.0) else {
        return Ok(least.status.was_successful().then_some(None));
    };
    // Bisection between the origin and a point beyond the limit.
    let (mut low, mut high, mut found) = (0.0, 1.0, beyond);
    let direction = found.u.clone();
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        let point = Evaluated::at(limit_state, direction.iter().map(|u| middle * u).collect())?;
        if sign * point.g > 0.0 {
            low = middle;
        } else {
            (high, found) = (middle, point);
        }
    }
    Ok((found.steepness() > 0.0).then_some(Some(found)))
}

/// Number of bisections between the origin and a point beyond the limit.
const BISECTIONS: usize = 20;

/// A value of g with its gradient.
#[derive(Clone)]
struct Evaluated {
    u: Vec<f64>,
    g: f64,
    gradient: Vec<f64>,
}

impl Evaluated {
    fn at(limit_state: &impl Fn(&[f64]) -> Result<(f64, Vec<f64>)>, u: Vec<f64>) -> Result<Self> {
        let (g, gradient) = limit_state(&u)?;
        Ok(Self { u, g, gradient })
    }

    /// The change of g over one standard deviation; zero if it is not a number.
    fn steepness(&self) -> f64 {
        let size = norm(&self.gradient);
        if size.is_finite() { size } else { 0.0 }
    }
}

/// Aim of a search.
#[derive(Clone, Copy, PartialEq)]
enum Aim {
    /// min ½|u|² subject to g(u) = 0.
    Nearest,
    /// min ± g(u).
    Least(f64),
}

/// A search over standard normal variables.
struct DesignPointSearch<'g, G> {
    limit_state: &'g G,
    aim: Aim,
    scale: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// The last evaluation: the solver asks for the gradient where it asked for the value.
    last: Mutex<Evaluated>,
}

impl<'g, G: Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync> DesignPointSearch<'g, G> {
    fn new(limit_state: &'g G, start: &Evaluated, aim: Aim) -> Self {
        let n = start.u.len();
        Self {
            limit_state,
            aim,
            scale: start.steepness(),
            lower: vec![-LARGEST; n],
            upper: vec![LARGEST; n],
            last: Mutex::new(start.clone()),
        }
    }

    fn at(&self, u: &[f64]) -> Result<(f64, Vec<f64>)> {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.u != u {
            *last = Evaluated::at(self.limit_state, u.to_vec())?;
        }
        Ok((last.g / self.scale, last.gradient.iter().map(|d| d / self.scale).collect()))
    }
}

impl<G: Fn(&[f64]) -> Result<(f64, Vec<f64>)> + Sync> Program for DesignPointSearch<'_, G> {
    fn variables(&self) -> usize {
        self.lower.len()
    }

    fn rows(&self) -> usize {
        usize::from(self.aim == Aim::Nearest)
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
        Ok(match self.aim {
            Aim::Nearest => Values { objective: 0.5 * u.iter().map(|v| v * v).sum::<f64>(), rows: vec![g] },
            Aim::Least(sign) => Values { objective: sign * g, rows: vec![] },
        })
    }

    fn gradients(&self, u: &[f64]) -> Result<Gradients> {
        let (_, gradient) = self.at(u)?;
        let values = self.values(u)?;
        Ok(match self.aim {
            Aim::Nearest => {
                Gradients { values, objective: u.to_vec(), rows: DMatrix::from_row_slice(1, u.len(), &gradient) }
            }
            Aim::Least(sign) => Gradients {
                values,
                objective: gradient.iter().map(|d| sign * d).collect(),
                rows: DMatrix::zeros(0, u.len()),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beta(n: usize, g: impl Fn(&[f64]) -> (f64, Vec<f64>) + Sync) -> DesignPoint {
        first_order_reliability(n, |u| Ok(g(u).0), |u| Ok(g(u))).unwrap()
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

    /// Limits with curvature, of which the first step leads elsewhere: x² + 0.3y ≤ 5 with two nearest points, x³ + y ≤ 10, and a wave. The reference is
    /// the first violation on 3600 rays.
    #[test]
    fn curved_limit_states_have_their_nearest_point() {
        type Limit = fn(f64, f64) -> (f64, [f64; 2]);
        let limits: [Limit; 4] = [
            |x, y| (5.0 - x * x - 0.3 * y, [-2.0 * x, -0.3]),
            |x, y| (10.0 - x.powi(3) - y, [-3.0 * x * x, -1.0]),
            |x, y| (4.0 - x * y - 0.5 * x, [-y - 0.5, -x]),
            |x, y| (2.2 - (2.0 * x).sin() - x / 4.0 - y / 3.0, [-2.0 * (2.0 * x).cos() - 0.25, -1.0 / 3.0]),
        ];
        for (k, limit) in limits.into_iter().enumerate() {
            let found = beta(2, |u| {
                let (g, slope) = limit(u[0], u[1]);
                (g, slope.to_vec())
            });
            let on_ray = |ray: i32| {
                let (sine, cosine) = (f64::from(ray) * std::f64::consts::TAU / 3600.0).sin_cos();
                (1..5000).map(|r| 1e-3 * f64::from(r)).find(|r| limit(r * cosine, r * sine).0 < 0.0)
            };
            let least = (0..3600).filter_map(on_ray).fold(f64::INFINITY, f64::min);
            assert!((found.beta - least).abs() < 1.1e-3, "limit {k}: {found:?}, {least}");
        }
    }

    /// g = c − aᵀu: a probability below the rounding error of one counts as zero, and is not searched for long.
    #[test]
    fn a_limit_far_away_has_an_infinite_index() {
        for (c, expected) in [(7.9, 7.9), (186.0, f64::INFINITY), (-500.0, f64::NEG_INFINITY)] {
            let found = beta(2, |u| (c - 0.6 * u[0] - 0.8 * u[1], vec![-0.6, -0.8]));
            assert!(found.beta == expected || (found.beta - expected).abs() < 1e-10, "{found:?}");
            assert!(found.evaluations < 600, "{found:?}");
        }
    }

    /// The values have the noise of an integration: the search ends at their accuracy.
    #[test]
    fn a_noisy_limit_state_ends_soon() {
        let found = beta(3, |u| {
            let x = u[0] + 0.25 * u[1] * u[1] - u[2];
            let noise = 1e-7 * (1e9 * (u[0] + 2.0 * u[1] + 3.0 * u[2])).sin();
            (2.0 - x + noise, vec![-1.0, -0.5 * u[1], 1.0])
        });
        // The nearest point is (1, 0, −1).
        assert!((found.beta - 2f64.sqrt()).abs() < 1e-5, "{found:?}");
        assert!(found.evaluations < 1200, "{found:?}");
    }

    /// Of uniform variables x = 2 Φ(u) − 1 the sum is at most 2; nothing depends on the variables of a constant.
    #[test]
    fn a_limit_out_of_reach_has_an_infinite_index() {
        use super::super::normal_probability as phi;
        let density = |u: f64| (-0.5 * u * u).exp() / std::f64::consts::TAU.sqrt();
        for (limit, expected) in [(3.0, f64::INFINITY), (-3.0, f64::NEG_INFINITY)] {
            let found = beta(2, |u| {
                let x = [0, 1].map(|k| 2.0 * phi(u[k]) - 1.0);
                (limit - x[0] - x[1], [0, 1].map(|k| -2.0 * density(u[k])).to_vec())
            });
            assert_eq!((found.beta, found.u.len()), (expected, 0), "{found:?}");
            assert_eq!(phi(-found.beta), if limit > 0.0 { 0.0 } else { 1.0 });
        }
        // A curve that comes near to the limit, and leaves it again.
        let found = beta(1, |u| {
            (
                1.0 - (-(u[0] - 3.0) * (u[0] - 3.0)).exp() * 0.9,
                vec![1.8 * (u[0] - 3.0) * (-(u[0] - 3.0) * (u[0] - 3.0)).exp()],
            )
        });
        assert_eq!(found.beta, f64::INFINITY, "{found:?}");
        assert_eq!(beta(2, |_| (1.0, vec![0.0, 0.0])).beta, f64::INFINITY);
        assert_eq!(beta(2, |_| (-1.0, vec![0.0, 0.0])).beta, f64::NEG_INFINITY);
        // g = 4 − u² has no slope at the mean.
        assert!((beta(1, |u| (4.0 - u[0] * u[0], vec![-2.0 * u[0]])).beta - 2.0).abs() < 1e-7);
    }
}
