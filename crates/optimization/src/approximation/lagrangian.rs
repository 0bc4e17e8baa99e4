//! Curvature of the Lagrangian from gradients at accepted designs.

use super::LinearizationPoint;
use crate::problem::{Problem, Quantity, Responses, RowId, Sensitivities, SignedQuantity};
use error::{Error, Result};
use nlp::{LowRank, powell_damping};

/// ½ dᵀ B d added to the approximate objective, where B follows the Hessian of the Lagrangian
///
/// $$ L(b) = F(b) + \sum_i λ_i\, \hat g_i(b) $$
///
/// by limited-memory BFGS. With linear approximations a cycle is an iteration of sequential quadratic programming (SQP): B
/// contains the curvature of objective and active constraints, and the rows stay linear.
///
/// With the multipliers λ of the last accepted cycle, steps s between accepted designs and the changes y of ∇L along them, in
/// variables divided by their scales, the oldest step first,
///
/// $$ B_0 = \frac{y^T y}{s^T y} I ,\qquad B \leftarrow B - \frac{B s s^T B}{s^T B s} + \frac{r r^T}{s^T r} ,\qquad
///    r = θ y + (1 - θ) B s , $$
///
/// where B₀ is that of the newest step along which L has positive curvature, and θ is such that sᵀr ≥ 0.2 sᵀBs. Each cycle
/// evaluates y of all steps again with its multipliers. B is a multiple of the identity and at most two outer products for
/// each step, never a matrix: the cost grows linearly with the number of variables. B is omitted in the first cycle
/// and in a cycle without positive curvature.
///
/// A row contributes to the steps at whose ends it was differentiated. Peaks in continuous time do not contribute, as their
/// times differ between designs.
///
/// # Sources
///
/// Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), procedure 18.2 (Powell's damping) and section 7.2
/// (limited memory).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LagrangianCurvature {
    /// Number of stored accepted steps, at least 1.
    pub steps: usize,
}

impl Default for LagrangianCurvature {
    fn default() -> Self {
        Self { steps: 20 }
    }
}

impl LagrangianCurvature {
    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] for a setting out of range.
    pub fn check(&self) -> Result<()> {
        let steps = self.steps as f64;
        Error::check_option("steps of the curvature of the Lagrangian", "at least 1", steps, self.steps > 0)
    }

    /// ½ dᵀ B d about the design of `here`; `multipliers` are those of the last cycle.
    ///
    /// `None` without a step along which the Lagrangian has positive curvature.
    pub fn fit(&self, problem: &Problem, here: &LinearizationPoint, multipliers: &[(RowId, f64)]) -> Option<LowRank> {
        let scale = problem.scales();
        let mut points = vec![DifferentiatedDesign {
            problem,
            design: here.design,
            responses: here.responses,
            sensitivities: &here.data.sensitivities,
        }];
        points.extend(here.previous.iter().take(self.steps).map(|p| DifferentiatedDesign {
            problem,
            design: &p.design,
            responses: &p.responses,
            sensitivities: &p.sensitivities,
        }));
        let pairs: Vec<CurvaturePair> =
            points.windows(2).rev().filter_map(|ends| pair([&ends[0], &ends[1]], multipliers, &scale)).collect();
        let scaled = limited_memory(&pairs)?;
        let inverse: Vec<f64> = scale.iter().map(|s| 1.0 / s).collect();
        Some(LowRank { origin: here.design.to_vec(), ..scaled.scaled(&inverse, 1.0) })
    }
}

/// A design with responses and sensitivities.
struct DifferentiatedDesign<'a> {
    problem: &'a Problem,
    design: &'a [f64],
    responses: &'a Responses,
    sensitivities: &'a Sensitivities,
}

impl DifferentiatedDesign<'_> {
    fn has_derivatives_of(&self, quantity: &Quantity, p: usize) -> bool {
        self.problem.responses_of(quantity, p).iter().all(|i| self.sensitivities.row_of(*i).is_some())
    }

    /// ∇L, with these rows and multipliers.
    fn slope(&self, rows: &[(RowId, f64)]) -> Vec<f64> {
        let problem = self.problem;
        let total =
            |q: SignedQuantity, p| problem.total_derivative(q, p, self.design, self.responses, self.sensitivities);
        let mut slope = total(problem.objective.signed(), 0);
        for &(row, λ) in rows {
            let constraint = &problem.constraints[row.constraint];
            let share = λ / constraint.scale;
            slope.iter_mut().zip(total(constraint.signed(), row.point)).for_each(|(s, g)| *s += share * g);
        }
        slope
    }
}

/// s and y in scaled variables.
type CurvaturePair = [Vec<f64>; 2];

/// The step between two designs, the newer first, and the change of ∇L; `None` if the objective was not differentiated.
fn pair(ends: [&DifferentiatedDesign; 2], multipliers: &[(RowId, f64)], scale: &[f64]) -> Option<CurvaturePair> {
    let problem = ends[0].problem;
    let both = |q: &Quantity, p| ends.iter().all(|end| end.has_derivatives_of(q, p));
    let counts = |(row, _): &(RowId, f64)| {
        let constraint = &problem.constraints[row.constraint];
        !constraint.is_continuous && both(&constraint.quantity, row.point)
    };
    let rows: Vec<(RowId, f64)> = multipliers.iter().copied().filter(counts).collect();
    let [newer, older] = both(&problem.objective.quantity, 0).then(|| ends.map(|end| end.slope(&rows)))?;
    let step = (0..scale.len()).map(|k| (ends[0].design[k] - ends[1].design[k]) / scale[k]);
    Some([step.collect(), (0..scale.len()).map(|k| (newer[k] - older[k]) * scale[k]).collect()])
}

/// B by damped BFGS updates with pairs (s, y), the oldest first; `None` unless sᵀy > 0 for one of them.
fn limited_memory(pairs: &[CurvaturePair]) -> Option<LowRank> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let is_convex = |[s, y]: &&CurvaturePair| dot(s, y) > 1e-12 * (dot(s, s) * dot(y, y)).sqrt();
    let [s, y] = pairs.iter().rev().find(is_convex)?;
    let first = Some(dot(y, y) / dot(s, y)).filter(|first| first.is_finite())?;
    let mut b = LowRank::diagonal(vec![0.0; s.len()], vec![first; s.len()]);
    for [s, y] in pairs {
        let bs = b.times(s);
        let (expected, seen) = (dot(s, &bs), dot(s, y));
        if !(is_divisor(expected) && seen.is_finite()) {
            continue;
        }
        let θ = powell_damping(expected, seen);
        let damped: Vec<f64> = y.iter().zip(&bs).map(|(y, b)| θ * y + (1.0 - θ) * b).collect();
        let along = dot(s, &damped);
        if is_divisor(along) {
            b.add(-1.0 / expected, bs);
            b.add(1.0 / along, damped);
        }
    }
    Some(b)
}

/// True for a positive number whose inverse is finite, too: products of tiny steps are zero, or nearly so.
fn is_divisor(x: f64) -> bool {
    x > 0.0 && x.is_finite() && (1.0 / x).is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn pairs_of(h: &DMatrix<f64>, steps: &[Vec<f64>]) -> Vec<CurvaturePair> {
        let change = |s: &Vec<f64>| (h * DVector::from_column_slice(s)).as_slice().to_vec();
        steps.iter().map(|s| [s.clone(), change(s)]).collect()
    }

    #[test]
    fn conjugate_steps_through_a_quadratic_yield_its_hessian() {
        // Steps along the axes of a diagonal Hessian are conjugate: after n of them B is the Hessian. No curvature is
        // so much smaller than the previous one that the step is damped.
        let h = DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, 4.0, 9.0]));
        let steps: Vec<Vec<f64>> = (0..3).map(|k| (0..3).map(|j| if j == k { 0.5 } else { 0.0 }).collect()).collect();
        let b = limited_memory(&pairs_of(&h, &steps)).unwrap();
        assert!((b.dense() - h).amax() < 1e-12);
    }

    #[test]
    fn the_last_secant_condition_holds_and_negative_curvature_is_damped() {
        let h = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, -3.0]);
        let pairs = pairs_of(&h, &[vec![0.1, 1.0], vec![1.0, 0.2]]);
        let b = limited_memory(&pairs).unwrap();
        assert!(b.dense().symmetric_eigenvalues().min() > 0.0);
        assert!(b.times(&pairs[1][0]).iter().zip(&pairs[1][1]).all(|(a, e)| (a - e).abs() < 1e-12));
        assert!(limited_memory(&pairs[..1]).is_none());
    }

    #[test]
    fn steps_whose_products_underflow_are_left_out() {
        let h = DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, 4.0]));
        let tiny = pairs_of(&h, &[vec![3e-162, 1e-163], vec![1e-163, 2e-162]]);
        let with = limited_memory(&[tiny.clone(), pairs_of(&h, &[vec![0.1, 1.0]])].concat()).unwrap();
        assert!(with.dense().iter().all(|v| v.is_finite()), "{}", with.dense());
        assert!(limited_memory(&tiny).is_none_or(|b| b.dense().iter().all(|v| v.is_finite())));
    }
}
