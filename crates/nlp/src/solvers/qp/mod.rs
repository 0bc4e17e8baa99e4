//! Linear and quadratic programs through Clarabel, polished to rounding.
//!
//! | file | content |
//! |---|---|
//! | `scaling` | units in which the numbers are of order one |
//! | `working_rows` | drops rows that cannot be active, adds many rows a few at a time |
//! | `clarabel_qp` | the program in the form of Clarabel |
//! | `polish` | the exact solution of the active set |

mod clarabel_qp;
mod polish;
mod scaling;
mod working_rows;

pub(super) use clarabel_qp::clarabel_error;

use crate::QuadraticProgram;
use crate::program::Program;
use crate::solution::{Candidate, Evaluations, ProgramStatus, Solution, SubproblemSolver};
use crate::solvers::elastic;
use clarabel::solver::SolverStatus;
use error::{Error, Result};
use nalgebra::DMatrix;
use scaling::{Scaling, VariableUnits};
use working_rows::ScaledResult;

/// Largest residual of a solution, in scaled units.
const ACCEPTED: f64 = 1e-8;
/// Residual in scaled units below which no other scaling is tried.
const ACCURATE: f64 = 1e-11;
/// Least curvature of a variable, relative to the largest one, that is not negligible compared with it.
const UNBALANCED: f64 = 1e-8;
/// Largest KKT residual of a solution.
const LARGEST_KKT_RESIDUAL: f64 = 1e-6;

/// Distances of the artificial bounds that decide whether a program is unbounded, in units of its numbers.
const ARTIFICIAL_BOUNDS: [f64; 3] = [1e4, 1e6, 1e2];

/// Solver of linear and convex quadratic programs, through Clarabel.
///
/// Variables, rows and objective are scaled. Clarabel's interior point method computes an approximate solution, and the
/// optimality conditions of the active set give the solution to rounding. A program without a feasible point is relaxed.
/// The solver returns [`Error::Unsupported`] for nonlinear programs and for quadratic objectives that are not convex.
///
/// # Sources
/// Goulart & Chen, *Clarabel: an interior-point solver for conic programs with quadratic objectives*, arXiv 2405.12762
/// (2024).
///
/// # Examples
/// ```
/// use linkwright_nlp::{Conic, QuadraticProgram, ProgramStatus, SubproblemSolver};
/// // min −x − 2y  subject to  x + y ≤ 4,  0 ≤ x ≤ 3,  0 ≤ y ≤ 2
/// let program = QuadraticProgram::new(vec![-1.0, -2.0])
///     .at_most(&[1.0, 1.0], 4.0)
///     .bounds(vec![0.0, 0.0], vec![3.0, 2.0]);
/// let solution = Conic::default().solve(&program, &[0.0, 0.0])?;
/// assert_eq!(solution.status, ProgramStatus::Solved);
/// assert!(solution.x.iter().all(|x| (x - 2.0).abs() < 1e-12));
/// assert!((solution.multipliers[0] - 1.0).abs() < 1e-12 && (solution.upper_multipliers[1] - 1.0).abs() < 1e-12);
/// # Ok::<(), linkwright_nlp::Error>(())
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
    /// Sets the relative gap and residual of the interior point method, in 1e-14 … 1e-4 (default 1e-10).
    ///
    /// The polished solution is usually accurate to rounding for any value.
    ///
    /// # Errors
    /// [`Error::Option`] outside this range.
    pub fn with_tolerance(self, tolerance: f64) -> Result<Self> {
        let is_valid = (1e-14..=1e-4).contains(&tolerance);
        Error::check_option("tolerance of the conic solver", "between 1e-14 and 1e-4", tolerance, is_valid)?;
        Ok(Self { tolerance, ..self })
    }

    /// Sets the largest number of iterations of one run of the interior point method, at least 1 (default 200).
    ///
    /// # Errors
    /// [`Error::Option`] for zero.
    pub fn with_iterations(self, iterations: u32) -> Result<Self> {
        let got = f64::from(iterations);
        Error::check_option("iterations of the conic solver", "at least 1", got, iterations >= 1)?;
        Ok(Self { iterations, ..self })
    }

    /// The solution; `None` for a quadratic objective that is not convex.
    pub(in crate::solvers) fn solve_convex(&self, program: &dyn Program, start: &[f64]) -> Result<Option<Solution>> {
        let matrices = QuadraticProgram::of(program, start)?;
        if !is_convex(&matrices) {
            return Ok(None);
        }
        let mut candidate = self.candidate(&matrices)?;
        if candidate.status != ProgramStatus::Solved {
            let unrelaxed = |p: &dyn Program, x: &[f64]| self.candidate(&QuadraticProgram::of(p, x)?);
            candidate = elastic::resolve(&matrices, &matrices.center, candidate, &unrelaxed)?;
        }
        let evaluations = Evaluations { values: 0, gradients: 2, hessians: usize::from(matrices.hessian.is_some()) };
        let gradients = program.gradients(&candidate.x)?;
        let start_gradient = Some(matrices.gradient.as_slice());
        let solution = candidate.certified(program, &matrices.center, evaluations, &gradients, start_gradient);
        Ok(Some(solution.checked(LARGEST_KKT_RESIDUAL)))
    }

    /// Solves `program` without relaxation: contradictory rows give the status `Stalled`.
    pub(crate) fn candidate(&self, program: &QuadraticProgram) -> Result<Candidate> {
        let found = self.scaled_candidate(program)?;
        if found.status != ProgramStatus::Unbounded {
            return Ok(found);
        }
        // The certificate may be wrong for badly scaled numbers: solve again with distant artificial bounds.
        let mut iterations = found.iterations;
        for far in ARTIFICIAL_BOUNDS {
            let mut inner = self.scaled_candidate(&with_artificial_bounds(program, far))?;
            iterations += inner.iterations;
            if inner.status == ProgramStatus::Solved {
                let at_artificial =
                    |μ: &[f64], own: &[f64]| μ.iter().zip(own).any(|(μ, b)| *μ > 0.0 && b.is_infinite());
                if at_artificial(&inner.lower, &program.lower) || at_artificial(&inner.upper, &program.upper) {
                    inner.status = ProgramStatus::Unbounded;
                }
                return Ok(Candidate { iterations, ..inner });
            }
        }
        Ok(Candidate { iterations, status: ProgramStatus::Stalled, ..found })
    }

    /// The better candidate of two scalings; the second one is tried only if the first is not accurate. Curvatures that differ too much
    /// in units of the bounds would have no effect.
    fn scaled_candidate(&self, program: &QuadraticProgram) -> Result<Candidate> {
        let mut units = [VariableUnits::Bounds, VariableUnits::Entries];
        if Scaling::new(program, units[0]).apply(program).has_curvatures_below(UNBALANCED) {
            units.reverse();
        }
        let first = self.in_units(program, units[0])?;
        if first.1 <= ACCURATE {
            return Ok(first.0);
        }
        let second = self.in_units(program, units[1])?;
        // Solutions first, then certificates of unboundedness, then the smallest residual.
        let rank = |(c, residual): &(Candidate, f64)| match c.status {
            ProgramStatus::Solved => (0, *residual),
            ProgramStatus::Unbounded => (1, *residual),
            _ => (2, *residual),
        };
        let (mut c, other) = if rank(&second) < rank(&first) { (second.0, first.0) } else { (first.0, second.0) };
        c.iterations += other.iterations;
        Ok(c)
    }

    /// A point and its residual in scaled units, infinite for a certificate.
    fn in_units(&self, program: &QuadraticProgram, units: VariableUnits) -> Result<(Candidate, f64)> {
        let scaling = Scaling::new(program, units);
        let scaled = scaling.apply(program);
        Ok(match working_rows::solve(&scaled, |rows| self.all_rows(rows))? {
            ScaledResult::Point(mut c, residual) => {
                if residual > ACCEPTED {
                    c.status = ProgramStatus::Stalled;
                }
                (scaling.restore(program, &scaled, c), residual)
            }
            ScaledResult::Infeasible { iterations } => {
                (at_center(program, iterations, ProgramStatus::Stalled), f64::INFINITY)
            }
            ScaledResult::Unbounded { iterations } => {
                (at_center(program, iterations, ProgramStatus::Unbounded), f64::INFINITY)
            }
        })
    }

    /// Interior point method and polishing, on a scaled program with all its rows.
    fn all_rows(&self, scaled: &QuadraticProgram) -> Result<ScaledResult> {
        use SolverStatus as S;
        let found = clarabel_qp::solve(scaled, self.tolerance, self.iterations)?;
        let iterations = found.iterations;
        Ok(match found.status {
            S::PrimalInfeasible | S::AlmostPrimalInfeasible => ScaledResult::Infeasible { iterations },
            S::DualInfeasible | S::AlmostDualInfeasible => ScaledResult::Unbounded { iterations },
            _ => {
                let approximate = Candidate {
                    x: found.x,
                    multipliers: found.multipliers,
                    lower: found.lower,
                    upper: found.upper,
                    iterations,
                    status: ProgramStatus::Solved,
                    relaxation: None,
                };
                let (c, residual) = polish::polish(scaled, approximate);
                ScaledResult::Point(inside(scaled, c), residual)
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
            Error::unsupported("conic solver", why, "use the SQP solver, or several starts of it")
        })
    }
}

/// The program with its infinite bounds replaced by bounds at `far` units from the centre.
fn with_artificial_bounds(program: &QuadraticProgram, far: f64) -> QuadraticProgram {
    let mut out = program.clone();
    for j in 0..out.center.len() {
        let distance = far * VariableUnits::largest_unit(program, j);
        out.lower[j] = if out.lower[j].is_finite() { out.lower[j] } else { out.center[j] - distance };
        out.upper[j] = if out.upper[j].is_finite() { out.upper[j] } else { out.center[j] + distance };
    }
    out
}

/// A candidate at the centre, for a program without a point.
fn at_center(program: &QuadraticProgram, iterations: usize, status: ProgramStatus) -> Candidate {
    let (n, m) = (program.gradient.len(), program.offset.len());
    let zeros = vec![0.0; n];
    let (x, multipliers) = (program.center.clone(), vec![0.0; m]);
    Candidate { x, multipliers, lower: zeros.clone(), upper: zeros, iterations, status, relaxation: None }
}

/// True if the Hessian is positive semidefinite to rounding.
fn is_convex(program: &QuadraticProgram) -> bool {
    let scaled = Scaling::new(program, VariableUnits::Bounds).apply(program);
    let Some(h) = scaled.hessian else { return true };
    let n = h.nrows();
    let shift = 1e-10 * h.amax();
    shift == 0.0 || (h + DMatrix::identity(n, n) * shift).cholesky().is_some()
}

/// The candidate moved into the bounds, with non-negative multipliers: rounding may violate both slightly.
fn inside(program: &QuadraticProgram, mut c: Candidate) -> Candidate {
    for (j, v) in c.x.iter_mut().enumerate() {
        *v = v.clamp(program.lower[j], program.upper[j]);
    }
    c.multipliers.iter_mut().zip(&program.equality).filter(|(_, e)| !**e).for_each(|(λ, _)| *λ = λ.max(0.0));
    c.lower.iter_mut().chain(c.upper.iter_mut()).for_each(|μ| *μ = μ.max(0.0));
    c
}
