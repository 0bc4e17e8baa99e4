//! Primal and dual variables of the interior point method, and how far they are from the perturbed conditions.

use crate::{Gradients, LowRank, Separable};
use error::Result;

/// x, λ, the slacks s of the inequality rows, and the multipliers ξ and η of lower and upper bounds.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub x: Vec<f64>,
    pub λ: Vec<f64>,
    pub s: Vec<f64>,
    pub ξ: Vec<f64>,
    pub η: Vec<f64>,
}

/// The program at a point: gradients and the curvature of the Lagrangian, variable by variable.
pub(super) struct LocalDerivatives {
    pub gradients: Gradients,
    pub curvature: Vec<f64>,
    /// ∇f + Gᵀλ.
    pub slope: Vec<f64>,
}

/// What does not change during a run.
pub(super) struct Frame<'a> {
    pub program: &'a dyn Separable,
    /// What couples the variables besides; nothing couples those that are fixed.
    pub coupling: Option<LowRank>,
    pub equality: Vec<bool>,
    pub fixed: Vec<bool>,
}

/// Largest share of the way to a boundary.
const SHARE: f64 = 0.995;

impl<'a> Frame<'a> {
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

    /// A point well inside the bounds, near `start`, with multipliers of one.
    pub fn inside(&self, start: &[f64]) -> Result<Point> {
        let (l, u) = (self.program.lower(), self.program.upper());
        let x: Vec<f64> = (0..start.len())
            .map(|j| {
                let room = (0.1 * (u[j] - l[j])).min(0.1);
                if self.fixed[j] { l[j] } else { start[j].clamp(l[j] + room, u[j] - room) }
            })
            .collect();
        let g = self.program.values(&x)?.rows;
        let price = |gap: f64, j: usize| if self.fixed[j] || gap.is_infinite() { 0.0 } else { (1.0 / gap).max(1.0) };
        Ok(Point {
            s: g.iter().map(|g| (-g).max(1.0)).collect(),
            λ: self.equality.iter().map(|e| if *e { 0.0 } else { 1.0 }).collect(),
            ξ: (0..x.len()).map(|j| price(x[j] - l[j], j)).collect(),
            η: (0..x.len()).map(|j| price(u[j] - x[j], j)).collect(),
            x,
        })
    }

    /// Columns and weights of the outer products in the Hessian.
    pub fn outer_products(&self) -> (&[Vec<f64>], &[f64]) {
        self.coupling.as_ref().map_or((&[], &[]), |b| (&b.columns, &b.weights))
    }

    pub fn local(&self, p: &Point) -> Result<LocalDerivatives> {
        let gradients = self.program.gradients(&p.x)?;
        let weights: Vec<f64> = [1.0].into_iter().chain(p.λ.iter().copied()).collect();
        let own = |j: usize| self.program.weighted(j, p.x[j], &weights).curvature.max(0.0);
        let coupled = |j: usize| self.coupling.as_ref().map_or(0.0, |b| b.diagonal[j]);
        let curvature = (0..p.x.len()).map(|j| own(j) + coupled(j)).collect();
        let row_slope = |j: usize| gradients.rows.column(j).iter().zip(&p.λ).fold(0.0, |a, (g, λ)| a + g * λ);
        let slope = (0..p.x.len()).map(|j| gradients.objective[j] + row_slope(j)).collect();
        Ok(LocalDerivatives { gradients, curvature, slope })
    }

    /// Largest entry and sum of squares of the residual of the conditions perturbed by μ.
    pub fn residual(&self, p: &Point, at: &LocalDerivatives, μ: f64) -> (f64, f64) {
        let (mut largest, mut squares) = (0.0f64, 0.0);
        let mut note = |v: f64| {
            largest = if v.is_nan() { f64::INFINITY } else { largest.max(v.abs()) };
            squares += v * v;
        };
        for j in (0..p.x.len()).filter(|&j| !self.fixed[j]) {
            let (below, above) = self.gaps(&p.x, j);
            note(at.slope[j] - p.ξ[j] + p.η[j]);
            if below.is_finite() {
                note(p.ξ[j] * below - μ);
            }
            if above.is_finite() {
                note(p.η[j] * above - μ);
            }
        }
        for (i, g) in at.gradients.values.rows.iter().enumerate() {
            if self.equality[i] {
                note(*g);
            } else {
                note(g + p.s[i]);
                note(p.λ[i] * p.s[i] - μ);
            }
        }
        (largest, squares)
    }

    /// The largest step along `d` that keeps everything positive, at most one.
    pub fn longest(&self, p: &Point, d: &Point) -> f64 {
        let mut most = 1.0 / SHARE;
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
        (SHARE * most).min(1.0)
    }

    /// p + share d, kept off the bounds that rounding might reach.
    pub fn moved(&self, p: &Point, d: &Point, share: f64) -> Point {
        let add = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + share * b).collect::<Vec<f64>>();
        let mut x = add(&p.x, &d.x);
        for (j, v) in x.iter_mut().enumerate().filter(|(j, _)| !self.fixed[*j]) {
            let (l, u) = (self.program.lower()[j], self.program.upper()[j]);
            if *v <= l || *v >= u {
                *v = p.x[j];
            }
        }
        Point { x, λ: add(&p.λ, &d.λ), s: add(&p.s, &d.s), ξ: add(&p.ξ, &d.ξ), η: add(&p.η, &d.η) }
    }
}
