//! The perturbed optimality conditions of the interior point method, with their primal and dual variables.

use crate::LowRank;
use crate::program::{Gradients, Separable, Values};
use error::Result;
use nalgebra::DMatrix;

/// An iterate, or a step between two: x, λ, the slacks s of the inequality rows, and the multipliers ξ and η of lower and
/// upper bounds.
#[derive(Clone, Debug, Default)]
pub(super) struct PrimalDualIterate {
    pub x: Vec<f64>,
    pub λ: Vec<f64>,
    pub s: Vec<f64>,
    pub ξ: Vec<f64>,
    pub η: Vec<f64>,
}

/// Gradients of a program at a point, and gradient and diagonal Hessian of its Lagrangian.
pub(super) struct LocalDerivatives {
    pub gradients: Gradients,
    /// Diagonal of the Hessian of the Lagrangian, without outer products.
    pub curvature: Vec<f64>,
    /// ∇f + Gᵀλ.
    pub lagrangian_gradient: Vec<f64>,
}

impl Default for LocalDerivatives {
    fn default() -> Self {
        let values = Values { objective: 0.0, rows: vec![] };
        let gradients = Gradients { values, objective: vec![], rows: DMatrix::zeros(0, 0) };
        Self { gradients, curvature: vec![], lagrangian_gradient: vec![] }
    }
}

/// The optimality conditions of a program with complementarity λ s = ξ (x − l) = η (u − x) = μ.
pub(super) struct PerturbedConditions<'a> {
    program: &'a dyn Separable,
    /// Quadratic that couples the variables, with zero columns for fixed variables.
    coupling: Option<LowRank>,
    pub equality: Vec<bool>,
    pub fixed: Vec<bool>,
}

/// Largest fraction of the distance to the boundary that a step covers.
const TO_BOUNDARY: f64 = 0.995;

impl<'a> PerturbedConditions<'a> {
    pub fn new(program: &'a dyn Separable) -> Self {
        let equality = (0..program.rows()).map(|i| program.is_equality(i)).collect();
        let fixed: Vec<bool> = program.lower().iter().zip(program.upper()).map(|(l, u)| l == u).collect();
        let mut coupling = program.coupled().map(|(_, low_rank)| low_rank.into_owned());
        for column in coupling.iter_mut().flat_map(|b| &mut b.columns) {
            (0..fixed.len()).filter(|&j| fixed[j]).for_each(|j| column[j] = 0.0);
        }
        Self { program, coupling, equality, fixed }
    }

    /// Distance of x from its lower and upper bound.
    pub fn gaps(&self, x: &[f64], j: usize) -> (f64, f64) {
        (x[j] - self.program.lower()[j], self.program.upper()[j] - x[j])
    }

    /// A point inside the bounds, near `start`, with multipliers of one or more.
    pub fn interior_point(&self, start: &[f64]) -> Result<PrimalDualIterate> {
        let (l, u) = (self.program.lower(), self.program.upper());
        let x: Vec<f64> = (0..start.len())
            .map(|j| {
                let margin = (0.1 * (u[j] - l[j])).min(0.1);
                if self.fixed[j] { l[j] } else { start[j].clamp(l[j] + margin, u[j] - margin) }
            })
            .collect();
        let g = self.program.values(&x)?.rows;
        let multiplier =
            |gap: f64, j: usize| if self.fixed[j] || gap.is_infinite() { 0.0 } else { (1.0 / gap).max(1.0) };
        Ok(PrimalDualIterate {
            s: g.iter().map(|g| (-g).max(1.0)).collect(),
            λ: self.equality.iter().map(|e| if *e { 0.0 } else { 1.0 }).collect(),
            ξ: (0..x.len()).map(|j| multiplier(x[j] - l[j], j)).collect(),
            η: (0..x.len()).map(|j| multiplier(u[j] - x[j], j)).collect(),
            x,
        })
    }

    /// Columns and weights of the outer products in the Hessian.
    pub fn outer_products(&self) -> (&[Vec<f64>], &[f64]) {
        self.coupling.as_ref().map_or((&[], &[]), |b| (&b.columns, &b.weights))
    }

    /// Gradients and curvatures at a point.
    pub fn derivatives(&self, p: &PrimalDualIterate) -> Result<LocalDerivatives> {
        let gradients = self.program.gradients(&p.x)?;
        let weights: Vec<f64> = [1.0].into_iter().chain(p.λ.iter().copied()).collect();
        let separable = |j: usize| self.program.weighted(j, p.x[j], &weights).curvature.max(0.0);
        let coupled = |j: usize| self.coupling.as_ref().map_or(0.0, |b| b.diagonal[j]);
        let curvature = (0..p.x.len()).map(|j| separable(j) + coupled(j)).collect();
        let row_slope = |j: usize| gradients.rows.column(j).iter().zip(&p.λ).fold(0.0, |a, (g, λ)| a + g * λ);
        let lagrangian_gradient = (0..p.x.len()).map(|j| gradients.objective[j] + row_slope(j)).collect();
        Ok(LocalDerivatives { gradients, curvature, lagrangian_gradient })
    }

    /// Largest entry and sum of squares of the residual of the conditions perturbed by μ.
    pub fn residual(&self, p: &PrimalDualIterate, at: &LocalDerivatives, μ: f64) -> (f64, f64) {
        let (mut largest, mut squares) = (0.0f64, 0.0);
        let mut add = |v: f64| {
            largest = if v.is_nan() { f64::INFINITY } else { largest.max(v.abs()) };
            squares += v * v;
        };
        for j in (0..p.x.len()).filter(|&j| !self.fixed[j]) {
            let (below, above) = self.gaps(&p.x, j);
            add(at.lagrangian_gradient[j] - p.ξ[j] + p.η[j]);
            if below.is_finite() {
                add(p.ξ[j] * below - μ);
            }
            if above.is_finite() {
                add(p.η[j] * above - μ);
            }
        }
        for (i, g) in at.gradients.values.rows.iter().enumerate() {
            if self.equality[i] {
                add(*g);
            } else {
                add(g + p.s[i]);
                add(p.λ[i] * p.s[i] - μ);
            }
        }
        (largest, squares)
    }

    /// Length of the longest step along `d` that keeps slacks, gaps and multipliers positive, at most one.
    pub fn longest_step(&self, p: &PrimalDualIterate, d: &PrimalDualIterate) -> f64 {
        let mut most = 1.0 / TO_BOUNDARY;
        let mut limit = |value: f64, change: f64| {
            if change < 0.0 {
                most = most.min(-value / change);
            }
        };
        for j in (0..p.x.len()).filter(|&j| !self.fixed[j]) {
            let (below, above) = self.gaps(&p.x, j);
            if below.is_finite() {
                limit(below, d.x[j]);
                limit(p.ξ[j], d.ξ[j]);
            }
            if above.is_finite() {
                limit(above, -d.x[j]);
                limit(p.η[j], d.η[j]);
            }
        }
        for i in (0..p.λ.len()).filter(|&i| !self.equality[i]) {
            limit(p.s[i], d.s[i]);
            limit(p.λ[i], d.λ[i]);
        }
        (TO_BOUNDARY * most).min(1.0)
    }

    /// p + length · d; a variable that rounding would put on a bound keeps its value.
    pub fn moved(&self, p: &PrimalDualIterate, d: &PrimalDualIterate, length: f64) -> PrimalDualIterate {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + length * b).collect::<Vec<f64>>();
        let mut x = sum(&p.x, &d.x);
        for (j, v) in x.iter_mut().enumerate().filter(|(j, _)| !self.fixed[*j]) {
            let (l, u) = (self.program.lower()[j], self.program.upper()[j]);
            if *v <= l || *v >= u {
                *v = p.x[j];
            }
        }
        PrimalDualIterate { x, λ: sum(&p.λ, &d.λ), s: sum(&p.s, &d.s), ξ: sum(&p.ξ, &d.ξ), η: sum(&p.η, &d.η) }
    }
}
