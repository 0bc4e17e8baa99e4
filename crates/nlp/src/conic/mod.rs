//! Linear and quadratic programs through Clarabel, polished to rounding.
//!
//! | file | what it does |
//! |---|---|
//! | `scaling` | units in which the numbers are near one |
//! | `working_rows` | drops rows that cannot matter, takes in many rows a few at a time |
//! | `interior_point` | Clarabel's homogeneous embedding |
//! | `polish` | the exact solution of the active set that the interior point found |

mod interior_point;
mod polish;
mod scaling;
mod working_rows;

use super::elastic;
use super::kkt::supported;
use super::solver::{Candidate, SubproblemSolver};
use super::{Evaluations, QuadraticProgram, Solution, Status};
use crate::Program;
use clarabel::solver::SolverStatus;
use error::{Error, Result};
use scaling::{Measure, Scaling};
use working_rows::Outcome;

/// Residual in scaled units above which a point is not taken for a solution.
const ACCEPTED: f64 = 1e-8;
/// Residual in scaled units below which nothing else is tried.
const CLEAN: f64 = 1e-11;
/// KKT residual up to which a solution is called one.
const SUPPORTED: f64 = 1e-6;

/// Distances, in units of the numbers of a program, at which a solution counts as infinitely far away.
const FENCES: [f64; 3] = [1e4, 1e6, 1e2];

/// The solver of linear and convex quadratic programs.
///
/// Variables, rows and objective are scaled, Clarabel's interior point method finds the neighbourhood of the solution,
/// and the optimality system of the active set gives the solution itself, accurate to rounding. A program without a
/// feasible point is relaxed and reported.
///
/// **Source.** Goulart & Chen, *Clarabel: an interior-point solver for conic programs with quadratic objectives*,
/// arXiv 2405.12762 (2024).
///
/// ```
/// use linkwright_nlp::{Conic, QuadraticProgram, Status, SubproblemSolver};
/// // min −x − 2y  subject to  x + y ≤ 4,  0 ≤ x ≤ 3,  0 ≤ y ≤ 2
/// let program = QuadraticProgram::new(vec![-1.0, -2.0])
///     .at_most(&[1.0, 1.0], 4.0)
///     .bounds(vec![0.0, 0.0], vec![3.0, 2.0]);
/// let solution = Conic::default().solve(&program, &[0.0, 0.0])?;
/// assert_eq!(solution.status, Status::Solved);
/// assert!(solution.x.iter().all(|x| (x - 2.0).abs() < 1e-12));
/// assert!((solution.multipliers[0] - 1.0).abs() < 1e-12 && (solution.upper_multipliers[1] - 1.0).abs() < 1e-12);
/// # Ok::<(), linkwright::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conic {
    tolerance: f64,
    iterations: u32,
}

impl Default for Conic {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations: 200 }
    }
}

impl Conic {
    /// With settings:
    ///
    /// * `tolerance` — relative gap and residual of the interior point method, in 1e-14 … 1e-4 (1e-10). The polished
    ///   solution is usually accurate to rounding whatever this is.
    /// * `iterations` — limit for one run of the interior point method, at least 1 (200).
    ///
    /// **Errors.** [`Error::Option`] outside these ranges.
    pub fn new(tolerance: f64, iterations: u32) -> Result<Self> {
        let good = (1e-14..=1e-4).contains(&tolerance);
        Error::check_option("tolerance of the conic solver", "between 1e-14 and 1e-4", tolerance, good)?;
        let got = f64::from(iterations);
        Error::check_option("iterations of the conic solver", "at least 1", got, iterations >= 1)?;
        Ok(Self { tolerance, iterations })
    }

    /// The solution, or `None` for a quadratic objective that is not convex.
    pub(super) fn solve_convex(&self, program: &dyn Program, start: &[f64]) -> Result<Option<Solution>> {
        let matrices = QuadraticProgram::of(program, start)?;
        if !is_convex(&matrices) {
            return Ok(None);
        }
        let mut candidate = self.candidate(&matrices)?;
        if candidate.status != Status::Solved {
            let plain = |p: &dyn Program, x: &[f64]| self.candidate(&QuadraticProgram::of(p, x)?);
            candidate = elastic::settle(&matrices, &matrices.center, candidate, &plain)?;
        }
        let evaluations = Evaluations { values: 0, gradients: 2, hessians: usize::from(matrices.hessian.is_some()) };
        let gradients = program.gradients(&candidate.x)?;
        let first = Some(matrices.gradient.as_slice());
        let mut solution = candidate.certified(program, &matrices.center, evaluations, &gradients, first);
        solution.status = supported(solution.status, &solution.kkt, SUPPORTED);
        Ok(Some(solution))
    }

    /// A point of `program` with its verdict, in its own units. Never relaxed: contradictory rows end as `Stalled`.
    pub(crate) fn candidate(&self, program: &QuadraticProgram) -> Result<Candidate> {
        let found = self.in_some_measure(program)?;
        if found.status != Status::Unbounded {
            return Ok(found);
        }
        // A bounded program may look unbounded: ask again inside a box that is much larger than its numbers.
        let mut iterations = found.iterations;
        for far in FENCES {
            let mut inner = self.in_some_measure(&fenced(program, far))?;
            iterations += inner.iterations;
            if inner.status == Status::Solved {
                let leans = |μ: &[f64], own: &[f64]| μ.iter().zip(own).any(|(μ, b)| *μ > 0.0 && b.is_infinite());
                if leans(&inner.lower, &program.lower) || leans(&inner.upper, &program.upper) {
                    inner.status = Status::Unbounded;
                }
                return Ok(Candidate { iterations, ..inner });
            }
        }
        Ok(Candidate { iterations, status: Status::Stalled, ..found })
    }

    /// The better of two ways to measure the variables; the second only if the first does not solve cleanly.
    fn in_some_measure(&self, program: &QuadraticProgram) -> Result<Candidate> {
        let first = self.in_measure(program, Measure::Bounds)?;
        if first.1 <= CLEAN {
            return Ok(first.0);
        }
        let second = self.in_measure(program, Measure::Entries)?;
        // A solution first, then the claim that there is none, then whatever is closest.
        let rank = |(c, residual): &(Candidate, f64)| match c.status {
            Status::Solved => (0, *residual),
            Status::Unbounded => (1, *residual),
            _ => (2, *residual),
        };
        let (mut c, other) = if rank(&second) < rank(&first) { (second.0, first.0) } else { (first.0, second.0) };
        c.iterations += other.iterations;
        Ok(c)
    }

    /// A point and its residual in scaled units, infinite for a certificate.
    fn in_measure(&self, program: &QuadraticProgram, measure: Measure) -> Result<(Candidate, f64)> {
        let scaling = Scaling::new(program, measure);
        let scaled = scaling.apply(program);
        Ok(match working_rows::solve(&scaled, |rows| self.once(rows))? {
            Outcome::Point(mut c, residual) => {
                if residual > ACCEPTED {
                    c.status = Status::Stalled;
                }
                (scaling.restore(program, &scaled, c), residual)
            }
            Outcome::Infeasible { iterations } => (nowhere(program, iterations, Status::Stalled), f64::INFINITY),
            Outcome::Unbounded { iterations } => (nowhere(program, iterations, Status::Unbounded), f64::INFINITY),
        })
    }

    /// The interior point method and the polish, on a scaled program with all its rows.
    fn once(&self, scaled: &QuadraticProgram) -> Result<Outcome> {
        use SolverStatus as S;
        let found = interior_point::solve(scaled, self.tolerance, self.iterations)?;
        let iterations = found.iterations;
        Ok(match found.status {
            S::PrimalInfeasible | S::AlmostPrimalInfeasible => Outcome::Infeasible { iterations },
            S::DualInfeasible | S::AlmostDualInfeasible => Outcome::Unbounded { iterations },
            _ => {
                let rough = Candidate {
                    x: found.x,
                    multipliers: found.multipliers,
                    lower: found.lower,
                    upper: found.upper,
                    iterations,
                    status: Status::Solved,
                    relaxation: None,
                };
                let (c, residual) = polish::polish(scaled, rough);
                Outcome::Point(inside(scaled, c), residual)
            }
        })
    }
}

impl SubproblemSolver for Conic {
    fn name(&self) -> &'static str {
        "conic"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        self.solve_convex(program, start)?.ok_or_else(|| {
            let why = "the quadratic objective is not convex";
            Error::definition("conic solver", why, "use the SQP solver, or several starts of it")
        })
    }
}

/// The program with its infinite bounds moved to `far` units from the centre.
fn fenced(program: &QuadraticProgram, far: f64) -> QuadraticProgram {
    let mut out = program.clone();
    for j in 0..out.center.len() {
        let reach = far * Measure::largest_unit(program, j);
        out.lower[j] = if out.lower[j].is_finite() { out.lower[j] } else { out.center[j] - reach };
        out.upper[j] = if out.upper[j].is_finite() { out.upper[j] } else { out.center[j] + reach };
    }
    out
}

/// The centre, where nothing better is known.
fn nowhere(program: &QuadraticProgram, iterations: usize, status: Status) -> Candidate {
    let (n, m) = (program.gradient.len(), program.offset.len());
    let none = vec![0.0; n];
    let (x, multipliers) = (program.center.clone(), vec![0.0; m]);
    Candidate { x, multipliers, lower: none.clone(), upper: none, iterations, status, relaxation: None }
}

/// True if the Hessian is positive semidefinite to rounding.
fn is_convex(program: &QuadraticProgram) -> bool {
    let scaled = Scaling::new(program, Measure::Bounds).apply(program);
    let Some(h) = scaled.hessian else { return true };
    let n = h.nrows();
    let shift = 1e-10 * h.amax();
    shift == 0.0 || (h + nalgebra::DMatrix::identity(n, n) * shift).cholesky().is_some()
}

/// `x` moved into the bounds: the interior point may end a rounding outside.
fn inside(program: &QuadraticProgram, mut c: Candidate) -> Candidate {
    for (j, v) in c.x.iter_mut().enumerate() {
        *v = v.clamp(program.lower[j], program.upper[j]);
    }
    c.multipliers.iter_mut().zip(&program.equality).filter(|(_, e)| !**e).for_each(|(λ, _)| *λ = λ.max(0.0));
    c.lower.iter_mut().chain(c.upper.iter_mut()).for_each(|μ| *μ = μ.max(0.0));
    c
}
