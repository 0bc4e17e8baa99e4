//! Two solvers on the same program, compared.

use super::{Evaluations, Solution, SubproblemSolver};
use crate::Program;
use error::Result;

/// Runs two solvers side by side and keeps the better solution.
///
/// [`ConcurrentSolver::compare`] tells how far they are apart: a check of either solver on a program of one's own.
pub struct ConcurrentSolver {
    first: Box<dyn SubproblemSolver>,
    second: Box<dyn SubproblemSolver>,
}

/// Two solutions and their distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Names of the solvers.
    pub names: [&'static str; 2],
    /// Their solutions.
    pub solutions: [Solution; 2],
    /// Largest difference of a variable.
    pub variables: f64,
    /// Difference of the objectives, the second less the first.
    pub objective: f64,
    /// Largest difference of a row's multiplier.
    pub multipliers: f64,
}

impl Comparison {
    /// The solution with the better status, then the smaller KKT residual; the first where they are equal.
    pub fn better(&self) -> &Solution {
        let [a, b] = &self.solutions;
        let rank = |s: &Solution| (!s.status.is_usable(), s.kkt.largest());
        if rank(b) < rank(a) { b } else { a }
    }

    /// True if the solvers come to the same conclusion and to the same objective within `tolerance`, relative.
    pub fn agrees(&self, tolerance: f64) -> bool {
        let [a, b] = &self.solutions;
        let size = a.objective.abs().max(b.objective.abs()).max(f64::MIN_POSITIVE);
        a.status == b.status && self.objective.abs() <= tolerance * size
    }
}

impl ConcurrentSolver {
    /// Of `first` against `second`.
    pub fn new(first: impl SubproblemSolver + 'static, second: impl SubproblemSolver + 'static) -> Self {
        Self { first: Box::new(first), second: Box::new(second) }
    }

    /// Both solutions and how far they are apart.
    ///
    /// **Errors.** The error of either solver, the first one's where both fail.
    pub fn compare(&self, program: &dyn Program, start: &[f64]) -> Result<Comparison> {
        let (a, b) = rayon::join(|| self.first.solve(program, start), || self.second.solve(program, start));
        let (a, b) = (a?, b?);
        let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        Ok(Comparison {
            names: [self.first.name(), self.second.name()],
            variables: apart(&a.x, &b.x),
            objective: b.objective - a.objective,
            multipliers: apart(&a.multipliers, &b.multipliers),
            solutions: [a, b],
        })
    }
}

impl SubproblemSolver for ConcurrentSolver {
    fn name(&self) -> &'static str {
        "race"
    }

    /// The better of both solutions; the evaluations are those of both. A solver that fails loses.
    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let (a, b) = rayon::join(|| self.first.solve(program, start), || self.second.solve(program, start));
        match (a, b) {
            (Ok(a), Ok(b)) => {
                let evaluations: Evaluations = a.evaluations + b.evaluations;
                let rank = |s: &Solution| (!s.status.is_usable(), s.kkt.largest());
                let best = if rank(&b) < rank(&a) { b } else { a };
                Ok(Solution { evaluations, ..best })
            }
            (Ok(one), Err(_)) | (Err(_), Ok(one)) => Ok(one),
            (Err(e), Err(_)) => Err(e),
        }
    }
}
