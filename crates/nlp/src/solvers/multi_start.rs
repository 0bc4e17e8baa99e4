//! Several starting points for programs that may have several local solutions.

use crate::kkt::variable_scale;
use crate::program::{Program, feasible_start};
use crate::solution::{Solution, SubproblemSolver};
use error::{Error, Result};
use rayon::prelude::*;

/// Half width of the search interval of a variable without finite range, in scales of the variable.
const HALF_WIDTH: f64 = 1.0;

/// Solves from the given start and from evenly distributed points between the bounds, and returns the best solution.
///
/// The starts run in parallel. Their points form a Kronecker sequence with the generalized golden ratio, shifted by the
/// seed, and are the same for any number of threads. Variables without finite bounds vary within one scale of the start.
///
/// The best solution is usable, and has the smallest relaxation, then the smallest objective, then the earliest start.
/// Its evaluations are the sum over all starts.
///
/// # Sources
/// Roberts, *The unreasonable effectiveness of quasirandom sequences* (2018), for the sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultiStart<S> {
    solver: S,
    starts: usize,
    seed: u64,
}

impl<S: SubproblemSolver> MultiStart<S> {
    /// Creates a solver that runs `solver` from `starts` ≥ 1 points, the given one first; `seed` shifts the others.
    ///
    /// # Errors
    /// [`Error::Option`] for zero starts.
    pub fn new(solver: S, starts: usize, seed: u64) -> Result<Self> {
        Error::check_option("starts of the multi-start", "at least 1", starts as f64, starts >= 1)?;
        Ok(Self { solver, starts, seed })
    }

    /// The solutions from all starts, in order, each with its own error if the program cannot be evaluated there.
    ///
    /// # Errors
    /// As [`SubproblemSolver::solve`] if the given start has a wrong length or an entry that is not finite.
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
            let fraction = (0.5 + shift + k as f64 * ratios[j]).fract();
            if (u - l).is_finite() {
                return (l + fraction * (u - l)).clamp(l, u);
            }
            let half_width = HALF_WIDTH * variable_scale(l, u, start[j], start[j]);
            (start[j] + (2.0 * fraction - 1.0) * half_width).clamp(l, u)
        };
        let other = |k: usize| (0..start.len()).map(|j| coordinate(k, j)).collect();
        std::iter::once(start.to_vec()).chain((1..self.starts).map(other)).collect()
    }
}

/// Powers of 1/φ, with φ > 1 the real root of φⁿ⁺¹ = φ + 1.
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
        // An error at the given start is returned; errors at the other starts are not.
        let mut best = all.next().expect("there is at least one start")?;
        let mut evaluations = best.evaluations;
        for other in all.flatten() {
            evaluations = evaluations + other.evaluations;
            if is_better(&other, &best) {
                best = other;
            }
        }
        Ok(Solution { evaluations, ..best })
    }
}

/// True if `a` is better than `b`.
fn is_better(a: &Solution, b: &Solution) -> bool {
    if a.status.is_usable() != b.status.is_usable() {
        return a.status.is_usable();
    }
    let (t, u) = (a.relaxation.unwrap_or(0.0), b.relaxation.unwrap_or(0.0));
    // Relaxations that differ by rounding are equal.
    if (t - u).abs() > 1e-9 * t.max(u) { t < u } else { a.objective < b.objective }
}
