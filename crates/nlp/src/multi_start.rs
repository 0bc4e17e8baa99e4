//! Several starts for a program that may have several local solutions.

use super::kkt::variable_scale;
use super::solver::feasible_start;
use super::{Evaluations, Solution, SubproblemSolver};
use crate::Program;
use error::{Error, Result};
use rayon::prelude::*;

/// Half width of the region that is searched in a variable without finite range, in scales of the variable.
const REACH: f64 = 1.0;

/// Solves from the given start and from points that fill the box evenly, in parallel, and keeps the best.
///
/// The points are those of a Kronecker sequence with the generalized golden ratio, shifted by the seed: the same for
/// every run and any number of threads. Variables without finite bounds are searched within one scale of the start.
/// The best is the usable solution of smallest relaxation, then of smallest objective, then of the earliest start. The
/// evaluations of all starts are added up.
///
/// **Source.** Roberts, *The unreasonable effectiveness of quasirandom sequences* (2018), for the sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultiStart<S> {
    solver: S,
    starts: usize,
    seed: u64,
}

impl<S: SubproblemSolver> MultiStart<S> {
    /// `solver` from `starts` ≥ 1 points, the given one first; `seed` shifts the others.
    ///
    /// **Errors.** [`Error::Option`] without a start.
    pub fn new(solver: S, starts: usize, seed: u64) -> Result<Self> {
        Error::check_option("starts of the multi-start", "at least 1", starts as f64, starts >= 1)?;
        Ok(Self { solver, starts, seed })
    }

    /// The solutions from all starts, in order; a start where the program cannot be evaluated gives its error.
    pub fn solve_all(&self, program: &dyn Program, start: &[f64]) -> Result<Vec<Result<Solution>>> {
        let start = feasible_start(program, start)?;
        let points = self.points(program, &start);
        Ok(points.par_iter().map(|x| self.solver.solve(program, x)).collect())
    }

    fn points(&self, program: &dyn Program, start: &[f64]) -> Vec<Vec<f64>> {
        let ratios = kronecker(start.len());
        let shift = (self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / (1u64 << 53) as f64;
        let coordinate = |k: usize, j: usize| {
            let (l, u) = (program.lower()[j], program.upper()[j]);
            let share = (0.5 + shift + k as f64 * ratios[j]).fract();
            if (u - l).is_finite() {
                return (l + share * (u - l)).clamp(l, u);
            }
            let reach = REACH * variable_scale(l, u, start[j], start[j]);
            (start[j] + (2.0 * share - 1.0) * reach).clamp(l, u)
        };
        let other = |k: usize| (0..start.len()).map(|j| coordinate(k, j)).collect();
        std::iter::once(start.to_vec()).chain((1..self.starts).map(other)).collect()
    }
}

/// Powers of 1/φ, with φ the real root above one of φⁿ⁺¹ = φ + 1.
fn kronecker(n: usize) -> Vec<f64> {
    let mut root = 2.0f64;
    for _ in 0..64 {
        root = (1.0 + root).powf(1.0 / (n as f64 + 1.0));
    }
    (1..=n).map(|j| root.powi(-(j as i32)).fract()).collect()
}

impl<S: SubproblemSolver> SubproblemSolver for MultiStart<S> {
    fn name(&self) -> &'static str {
        "multi-start"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let mut all = self.solve_all(program, start)?.into_iter();
        // The given start decides whether the program can be evaluated at all.
        let mut best = all.next().expect("there is at least one start")?;
        let mut evaluations: Evaluations = best.evaluations;
        for other in all.flatten() {
            evaluations = evaluations + other.evaluations;
            if better(&other, &best) {
                best = other;
            }
        }
        Ok(Solution { evaluations, ..best })
    }
}

/// True if `a` is to be preferred to `b`.
fn better(a: &Solution, b: &Solution) -> bool {
    if a.status.is_usable() != b.status.is_usable() {
        return a.status.is_usable();
    }
    let (t, u) = (a.relaxation.unwrap_or(0.0), b.relaxation.unwrap_or(0.0));
    // A relaxation that differs by rounding does not decide.
    if (t - u).abs() > 1e-9 * t.max(u) { t < u } else { a.objective < b.objective }
}
