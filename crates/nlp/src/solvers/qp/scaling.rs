//! Units in which the numbers of a linear or quadratic program are of order one.

use crate::QuadraticProgram;
use crate::kkt::{largest_change, positive_or_one, row_units};
use crate::solution::Candidate;
use nalgebra::DMatrix;

/// Choice of the units of the variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VariableUnits {
    /// The range between the bounds if it is finite, since move limits are the natural unit of a step. Otherwise as
    /// `Entries`.
    Bounds,
    /// The inverse geometric mean of the entries of each column, for bounds that are unrelated to the step.
    Entries,
}

impl VariableUnits {
    /// The unit of variable j.
    fn unit(self, program: &QuadraticProgram, j: usize) -> f64 {
        let (l, u) = (program.lower[j], program.upper[j]);
        match self {
            Self::Bounds if (u - l).is_finite() && u > l => u - l,
            _ => 1.0 / typical(program, j),
        }
    }

    /// The larger of both units of variable j.
    pub fn largest_unit(program: &QuadraticProgram, j: usize) -> f64 {
        Self::Bounds.unit(program, j).max(Self::Entries.unit(program, j))
    }
}

/// The substitution x = c + s·z, with rows divided by their largest entry and the objective by its largest entry.
pub(super) struct Scaling {
    size: Vec<f64>,
    row: Vec<f64>,
    objective: f64,
}

impl Scaling {
    pub fn new(program: &QuadraticProgram, units: VariableUnits) -> Self {
        let n = program.gradient.len();
        let size: Vec<f64> = (0..n).map(|j| units.unit(program, j)).collect();
        let mut objective = largest_change(&size, &program.gradient);
        if let Some(h) = &program.hessian {
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                objective = objective.max((h[(i, j)] * size[i] * size[j]).abs());
            }
        }
        Self { row: row_units(&size, &program.rows), objective: positive_or_one(objective), size }
    }

    /// The program in z, about z = 0.
    pub fn apply(&self, program: &QuadraticProgram) -> QuadraticProgram {
        let (n, m) = (self.size.len(), self.row.len());
        let bound = |b: &[f64]| (0..n).map(|j| (b[j] - program.center[j]) / self.size[j]).collect();
        QuadraticProgram {
            center: vec![0.0; n],
            constant: program.constant / self.objective,
            gradient: (0..n).map(|j| program.gradient[j] * self.size[j] / self.objective).collect(),
            hessian: program
                .hessian
                .as_ref()
                .map(|h| DMatrix::from_fn(n, n, |i, j| h[(i, j)] * self.size[i] * self.size[j] / self.objective)),
            offset: (0..m).map(|i| program.offset[i] / self.row[i]).collect(),
            rows: DMatrix::from_fn(m, n, |i, j| program.rows[(i, j)] * self.size[j] / self.row[i]),
            equality: program.equality.clone(),
            lower: bound(&program.lower),
            upper: bound(&program.upper),
        }
    }

    /// The candidate in the units of `program`; a variable at a bound is exactly on it.
    pub fn restore(&self, program: &QuadraticProgram, scaled: &QuadraticProgram, z: Candidate) -> Candidate {
        let restored = |(j, &v): (usize, &f64)| {
            if v <= scaled.lower[j] {
                program.lower[j]
            } else if v >= scaled.upper[j] {
                program.upper[j]
            } else {
                (program.center[j] + self.size[j] * v).clamp(program.lower[j], program.upper[j])
            }
        };
        let multipliers = |μ: &[f64]| μ.iter().zip(&self.size).map(|(μ, s)| μ * self.objective / s).collect();
        Candidate {
            x: z.x.iter().enumerate().map(restored).collect(),
            multipliers: z.multipliers.iter().zip(&self.row).map(|(λ, r)| λ * self.objective / r).collect(),
            lower: multipliers(&z.lower),
            upper: multipliers(&z.upper),
            ..z
        }
    }
}

impl QuadraticProgram {
    /// True if a variable has a positive curvature below the fraction `part` of the largest one.
    pub(super) fn has_curvatures_below(&self, part: f64) -> bool {
        let largest = self.hessian.as_ref().map_or(0.0, |h| h.diagonal().amax());
        self.hessian.iter().any(|h| h.diagonal().iter().any(|v| *v > 0.0 && *v < part * largest))
    }
}

/// Geometric mean of the largest and smallest entry of column j.
fn typical(program: &QuadraticProgram, j: usize) -> f64 {
    let (mut small, mut large) = (f64::INFINITY, 0.0f64);
    for i in 0..program.offset.len() {
        let v = program.rows[(i, j)].abs();
        if v > 0.0 {
            (small, large) = (small.min(v), large.max(v));
        }
    }
    if let Some(h) = &program.hessian {
        let v = h[(j, j)].abs().sqrt();
        if v > 0.0 {
            (small, large) = (small.min(v), large.max(v));
        }
    }
    if large > 0.0 { (small * large).sqrt() } else { positive_or_one(program.gradient[j].abs()) }
}
