//! Two solvers that run in parallel on the same program.

use crate::Program;
use crate::solution::{Solution, SubproblemSolver};
use error::Result;

/// Runs two solvers in parallel and returns the better solution.
///
/// [`ConcurrentSolver::compare`] returns both solutions and their differences. Use it to check one solver against the
/// other on your own program.
///
/// # Examples
/// ```
/// use linkwright_nlp::separable::DiagonalQuadraticProgram;
/// use linkwright_nlp::{ConcurrentSolver, Falk, InteriorPoint};
/// // min Σ ½ xⱼ² − xⱼ  subject to  x₁ + x₂ ≤ 1
/// let (gradients, curvatures) = (vec![-1.0, 1.0, -1.0, 1.0], vec![1.0, 0.0, 1.0, 0.0]);
/// let bounds = (vec![-5.0; 2], vec![5.0; 2]);
/// let program = DiagonalQuadraticProgram::new(vec![0.0, -1.0], vec![0.0; 2], gradients, curvatures, bounds)?;
/// let solvers = ConcurrentSolver::new(Falk::default(), InteriorPoint::default());
/// let comparison = solvers.compare(&program, &[0.0; 2])?;
/// assert!(comparison.agrees(1e-9) && comparison.variables < 1e-9 && comparison.multipliers < 1e-9);
/// # Ok::<(), linkwright_nlp::Error>(())
/// ```
pub struct ConcurrentSolver {
    first: Box<dyn SubproblemSolver>,
    second: Box<dyn SubproblemSolver>,
}

/// Two solutions of a program and their differences.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverComparison {
    /// Names of the solvers.
    pub names: [&'static str; 2],
    /// Their solutions.
    pub solutions: [Solution; 2],
    /// Largest difference of a variable.
    pub variables: f64,
    /// Difference of the objectives, the second minus the first.
    pub objective: f64,
    /// Largest difference of a row's multiplier.
    pub multipliers: f64,
}

impl SolverComparison {
    /// The solution with the better status, then the smaller KKT residual; the first one of equal solutions.
    pub fn better(&self) -> &Solution {
        let [a, b] = &self.solutions;
        if is_better(b, a) { b } else { a }
    }

    /// True if both solvers return the same status and the same objective within the relative `tolerance`.
    pub fn agrees(&self, tolerance: f64) -> bool {
        let [a, b] = &self.solutions;
        let size = a.objective.abs().max(b.objective.abs()).max(f64::MIN_POSITIVE);
        a.status == b.status && self.objective.abs() <= tolerance * size
    }
}

impl ConcurrentSolver {
    /// Creates a solver that runs `first` and `second`.
    pub fn new(first: impl SubproblemSolver + 'static, second: impl SubproblemSolver + 'static) -> Self {
        Self { first: Box::new(first), second: Box::new(second) }
    }

    fn solve_both(&self, program: &dyn Program, start: &[f64]) -> (Result<Solution>, Result<Solution>) {
        rayon::join(|| self.first.solve(program, start), || self.second.solve(program, start))
    }

    /// Solves with both solvers and returns the solutions and their differences.
    ///
    /// # Errors
    /// The error of either solver; that of the first one if both fail.
    pub fn compare(&self, program: &dyn Program, start: &[f64]) -> Result<SolverComparison> {
        let (a, b) = self.solve_both(program, start);
        let (a, b) = (a?, b?);
        let largest_difference = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        Ok(SolverComparison {
            names: [self.first.name(), self.second.name()],
            variables: largest_difference(&a.x, &b.x),
            objective: b.objective - a.objective,
            multipliers: largest_difference(&a.multipliers, &b.multipliers),
            solutions: [a, b],
        })
    }
}

/// True if `a` has a better status than `b`, or the same and a smaller KKT residual.
fn is_better(a: &Solution, b: &Solution) -> bool {
    let rank = |s: &Solution| (!s.status.is_usable(), s.kkt.largest());
    rank(a) < rank(b)
}

impl SubproblemSolver for ConcurrentSolver {
    fn name(&self) -> &'static str {
        "concurrent"
    }

    /// The better solution, with the evaluations of both. If one solver fails, the other one's solution is returned.
    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        match self.solve_both(program, start) {
            (Ok(a), Ok(b)) => {
                let evaluations = a.evaluations + b.evaluations;
                let best = if is_better(&b, &a) { b } else { a };
                Ok(Solution { evaluations, ..best })
            }
            (Ok(one), Err(_)) | (Err(_), Ok(one)) => Ok(one),
            (Err(e), Err(_)) => Err(e),
        }
    }
}
