//! A program in units in which variables, rows and objective are of order one at the start.

use crate::LowRank;
use crate::kkt::{largest_change, positive_or_one, row_units, variable_scales};
use crate::program::{Gradients, Program, Separable, Structure, Term, Values, bounds_from_fields, separable_part};
use crate::solution::Candidate;
use error::Result;
use nalgebra::DMatrix;
use std::borrow::Cow;

/// A program in z with x = s z, rows divided by rᵢ = maxⱼ sⱼ |∂gᵢ/∂xⱼ| and the objective by φ = maxⱼ sⱼ |∂f/∂xⱼ|, all at the start.
pub(super) struct Normalized<'a> {
    program: &'a dyn Program,
    variable: Vec<f64>,
    row: Vec<f64>,
    objective: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> Normalized<'a> {
    /// Normalizes `program` by the units at `start`; `here` are the gradients there.
    pub fn new(program: &'a dyn Program, start: &[f64], here: &Gradients) -> Self {
        let variable = variable_scales(program, start, start);
        let scaled = |b: &[f64]| b.iter().zip(&variable).map(|(b, s)| b / s).collect();
        Self {
            program,
            row: row_units(&variable, &here.rows),
            objective: positive_or_one(largest_change(&variable, &here.objective)),
            lower: scaled(program.lower()),
            upper: scaled(program.upper()),
            variable,
        }
    }

    /// The point z of a point x.
    pub fn to_normalized(&self, x: &[f64]) -> Vec<f64> {
        x.iter()
            .zip(&self.variable)
            .enumerate()
            .map(|(j, (x, s))| (x / s).clamp(self.lower[j], self.upper[j]))
            .collect()
    }

    /// The point x of a point z; a variable at a bound is exactly on it.
    fn to_units(&self, z: &[f64]) -> Vec<f64> {
        let (l, u) = (self.program.lower(), self.program.upper());
        let restored = |(j, &z): (usize, &f64)| {
            if z <= self.lower[j] {
                l[j]
            } else if z >= self.upper[j] {
                u[j]
            } else {
                (z * self.variable[j]).clamp(l[j], u[j])
            }
        };
        z.iter().enumerate().map(restored).collect()
    }

    /// A candidate in the units of the program.
    pub fn restore(&self, c: Candidate) -> Candidate {
        let multipliers = |μ: &[f64]| μ.iter().zip(&self.variable).map(|(μ, s)| μ * self.objective / s).collect();
        Candidate {
            x: self.to_units(&c.x),
            multipliers: c.multipliers.iter().zip(&self.row).map(|(λ, r)| λ * self.objective / r).collect(),
            lower: multipliers(&c.lower),
            upper: multipliers(&c.upper),
            ..c
        }
    }

    /// Gradients with respect to z, from gradients in the units of the program.
    pub fn normalized_gradients(&self, mut g: Gradients) -> Gradients {
        for (j, s) in self.variable.iter().enumerate() {
            g.objective[j] *= s / self.objective;
            g.rows.column_mut(j).iter_mut().zip(&self.row).for_each(|(v, r)| *v *= s / r);
        }
        Gradients { values: self.scaled(g.values), ..g }
    }

    /// Gradients in the units of the program, from gradients with respect to z.
    pub fn gradients_in_units(&self, mut g: Gradients) -> Gradients {
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
    bounds_from_fields!();
    fn rows(&self) -> usize {
        self.row.len()
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
        Ok(self.scaled(self.program.values(&self.to_units(z))?))
    }
    fn gradients(&self, z: &[f64]) -> Result<Gradients> {
        Ok(self.normalized_gradients(self.program.gradients(&self.to_units(z))?))
    }
    fn lagrangian_hessian(&self, z: &[f64], multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        let λ: Vec<f64> = multipliers.iter().zip(&self.row).map(|(λ, r)| λ * self.objective / r).collect();
        let h = self.program.lagrangian_hessian(&self.to_units(z), &λ)?;
        let s = &self.variable;
        Ok(h.map(|h| DMatrix::from_fn(s.len(), s.len(), |i, j| h[(i, j)] * s[i] * s[j] / self.objective)))
    }
}

/// Terms of the separable part; used only if the program is separable, except for a coupling.
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
        separable_part(self.program).expect("called for separable programs only")
    }
}
