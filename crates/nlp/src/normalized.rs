//! A program in units in which its variables, rows and objective are near one at the start.

use super::kkt::variable_scale;
use super::solver::{Candidate, separable_part};
use crate::separable::{Separable, Term};
use crate::{Gradients, LowRank, Program, Structure, Values};
use error::Result;
use nalgebra::DMatrix;
use std::borrow::Cow;

/// x = s z, rows divided by rᵢ = maxⱼ sⱼ |∂gᵢ/∂xⱼ| and the objective by φ = maxⱼ sⱼ |∂f/∂xⱼ|, all at the start.
pub(super) struct Normalized<'a> {
    program: &'a dyn Program,
    variable: Vec<f64>,
    row: Vec<f64>,
    objective: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> Normalized<'a> {
    /// With the units from `start`, where the gradients are `here`.
    pub fn new(program: &'a dyn Program, start: &[f64], here: &Gradients) -> Self {
        let (l, u) = (program.lower(), program.upper());
        let variable: Vec<f64> = start.iter().enumerate().map(|(j, &x)| variable_scale(l[j], u[j], x, x)).collect();
        let change = |slope: &dyn Fn(usize) -> f64| {
            let most = variable.iter().enumerate().fold(0.0f64, |a, (j, s)| a.max((s * slope(j)).abs()));
            if most > 0.0 { most } else { 1.0 }
        };
        let row = (0..program.rows()).map(|i| change(&|j| here.rows[(i, j)])).collect();
        let objective = change(&|j| here.objective[j]);
        let scaled = |b: &[f64]| b.iter().zip(&variable).map(|(b, s)| b / s).collect();
        Self { program, row, objective, lower: scaled(l), upper: scaled(u), variable }
    }

    /// A point in z.
    pub fn inward(&self, x: &[f64]) -> Vec<f64> {
        x.iter()
            .zip(&self.variable)
            .enumerate()
            .map(|(j, (x, s))| (x / s).clamp(self.lower[j], self.upper[j]))
            .collect()
    }

    /// A point in x; a variable at a bound lies exactly on it.
    pub fn outward(&self, z: &[f64]) -> Vec<f64> {
        let (l, u) = (self.program.lower(), self.program.upper());
        let back = |(j, &z): (usize, &f64)| {
            if z <= self.lower[j] {
                l[j]
            } else if z >= self.upper[j] {
                u[j]
            } else {
                (z * self.variable[j]).clamp(l[j], u[j])
            }
        };
        z.iter().enumerate().map(back).collect()
    }

    /// A candidate in the units of the program.
    pub fn restore(&self, c: Candidate) -> Candidate {
        let multipliers = |μ: &[f64]| μ.iter().zip(&self.variable).map(|(μ, s)| μ * self.objective / s).collect();
        Candidate {
            x: self.outward(&c.x),
            multipliers: c.multipliers.iter().zip(&self.row).map(|(λ, r)| λ * self.objective / r).collect(),
            lower: multipliers(&c.lower),
            upper: multipliers(&c.upper),
            ..c
        }
    }

    /// Gradients in the units of the program as gradients in z.
    pub fn of(&self, mut g: Gradients) -> Gradients {
        for (j, s) in self.variable.iter().enumerate() {
            g.objective[j] *= s / self.objective;
            g.rows.column_mut(j).iter_mut().zip(&self.row).for_each(|(v, r)| *v *= s / r);
        }
        Gradients { values: self.scaled(g.values), ..g }
    }

    /// Gradients in z as gradients in the units of the program.
    pub fn undo(&self, mut g: Gradients) -> Gradients {
        for (j, s) in self.variable.iter().enumerate() {
            g.objective[j] *= self.objective / s;
            g.rows.column_mut(j).iter_mut().zip(&self.row).for_each(|(v, r)| *v *= r / s);
        }
        g.values.objective *= self.objective;
        g.values.rows.iter_mut().zip(&self.row).for_each(|(g, r)| *g *= r);
        g
    }

    fn scaled(&self, v: Values) -> Values {
        Values {
            objective: v.objective / self.objective,
            rows: v.rows.iter().zip(&self.row).map(|(g, r)| g / r).collect(),
        }
    }
}

impl Program for Normalized<'_> {
    fn variables(&self) -> usize {
        self.variable.len()
    }
    fn rows(&self) -> usize {
        self.row.len()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        self.program.is_equality(i)
    }
    fn structure(&self) -> Structure {
        self.program.structure()
    }
    fn separable(&self) -> Option<&dyn Separable> {
        self.program.separable().is_some().then_some(self as &dyn Separable)
    }
    fn coupled(&self) -> Option<(&dyn Separable, Cow<'_, LowRank>)> {
        let (_, low_rank) = self.program.coupled()?;
        Some((self as &dyn Separable, Cow::Owned(low_rank.scaled(&self.variable, self.objective))))
    }
    fn values(&self, z: &[f64]) -> Result<Values> {
        Ok(self.scaled(self.program.values(&self.outward(z))?))
    }
    fn gradients(&self, z: &[f64]) -> Result<Gradients> {
        Ok(self.of(self.program.gradients(&self.outward(z))?))
    }
    fn lagrangian_hessian(&self, z: &[f64], multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        let λ: Vec<f64> = multipliers.iter().zip(&self.row).map(|(λ, r)| λ * self.objective / r).collect();
        let h = self.program.lagrangian_hessian(&self.outward(z), &λ)?;
        let s = &self.variable;
        Ok(h.map(|h| DMatrix::from_fn(s.len(), s.len(), |i, j| h[(i, j)] * s[i] * s[j] / self.objective)))
    }
}

/// Separable if the program is, but for a coupling.
impl Separable for Normalized<'_> {
    fn constant(&self, i: usize) -> f64 {
        self.separable_program().constant(i) / self.unit(i)
    }

    fn term(&self, i: usize, j: usize, z: f64) -> Term {
        let (s, unit) = (self.variable[j], self.unit(i));
        let t = self.separable_program().term(i, j, (z * s).clamp(self.program.lower()[j], self.program.upper()[j]));
        Term { value: t.value / unit, slope: t.slope * s / unit, curvature: t.curvature * s * s / unit }
    }

    fn weighted(&self, j: usize, z: f64, weights: &[f64]) -> Term {
        let own: Vec<f64> = weights.iter().enumerate().map(|(i, w)| w / self.unit(i)).collect();
        let (s, l, u) = (self.variable[j], self.program.lower()[j], self.program.upper()[j]);
        let t = self.separable_program().weighted(j, (z * s).clamp(l, u), &own);
        Term { value: t.value, slope: t.slope * s, curvature: t.curvature * s * s }
    }
}

impl Normalized<'_> {
    fn unit(&self, i: usize) -> f64 {
        i.checked_sub(1).map_or(self.objective, |k| self.row[k])
    }

    fn separable_program(&self) -> &dyn Separable {
        separable_part(self.program).expect("asked only of programs that have one")
    }
}

/// A program whose gradients at one point are known already: with a real analysis behind it, they are not asked twice.
pub(super) struct LinearizedRows<'a> {
    pub program: &'a dyn Program,
    pub at: &'a [f64],
    pub gradients: Gradients,
}

impl Program for LinearizedRows<'_> {
    fn variables(&self) -> usize {
        self.program.variables()
    }
    fn rows(&self) -> usize {
        self.program.rows()
    }
    fn lower(&self) -> &[f64] {
        self.program.lower()
    }
    fn upper(&self) -> &[f64] {
        self.program.upper()
    }
    fn is_equality(&self, i: usize) -> bool {
        self.program.is_equality(i)
    }
    fn structure(&self) -> Structure {
        self.program.structure()
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        if x == self.at { Ok(self.gradients.values.clone()) } else { self.program.values(x) }
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        if x == self.at { Ok(self.gradients.clone()) } else { self.program.gradients(x) }
    }
    fn lagrangian_hessian(&self, x: &[f64], multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        self.program.lagrangian_hessian(x, multipliers)
    }
}
