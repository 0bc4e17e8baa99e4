//! Selection of a solver by the structure of the program.

use super::cone::SecondOrder;
use super::dual::Falk;
use super::interior_point::InteriorPoint;
use super::qp::Conic;
use super::sqp::Sqp;
use crate::program::{Program, Structure};
use crate::solution::{Solution, SubproblemSolver};
use error::Result;

/// Largest number of rows for which the dual solver is faster than the interior point solver. For 3 variables with 1 000 and
/// 10 000 rows the interior point solver needs 0.4 and 1.5 ms, SQP 16 and 69 ms.
const FEW_ROWS: usize = 200;
/// Largest number of variables for which dense n × n matrices are stored.
const DENSE: usize = 1000;

/// Selects a solver by the structure of the program.
///
/// | program | solver |
/// |---|---|
/// | linear or convex quadratic | [`Conic`] |
/// | convex quadratic rows with factors | [`SecondOrder`] |
/// | separable, up to 200 rows | [`Falk`] |
/// | separable with more rows, or coupled by a quadratic of low rank | [`InteriorPoint`] |
/// | any other, and programs on which these solvers fail | [`Sqp`] |
///
/// # Examples
/// ```
/// use linkwright_nlp::{AutoSolver, QuadraticProgram, SubproblemSolver};
/// use nalgebra::DMatrix;
/// // A concave objective −x² on [−1, 2] is not accepted by the conic solver.
/// let program = QuadraticProgram::new(vec![0.0])
///     .hessian(DMatrix::from_element(1, 1, -2.0))
///     .bounds(vec![-1.0], vec![2.0]);
/// let solution = AutoSolver::default().solve(&program, &[0.5])?;
/// assert_eq!((solution.x[0], solution.objective), (2.0, -4.0));
/// # Ok::<(), linkwright_nlp::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct AutoSolver {
    /// Solver for linear and convex quadratic programs.
    pub conic: Conic,
    /// Solver for separable programs with few rows.
    pub falk: Falk,
    /// Solver for separable programs with many rows.
    pub interior_point: InteriorPoint,
    /// Solver for all other programs.
    pub sqp: Sqp,
}

impl AutoSolver {
    /// Replaces the solver for linear and convex quadratic programs.
    #[must_use]
    pub fn with_conic(self, conic: Conic) -> Self {
        Self { conic, ..self }
    }

    /// Replaces the dual solver.
    #[must_use]
    pub fn with_falk(self, falk: Falk) -> Self {
        Self { falk, ..self }
    }

    /// Replaces the interior point solver.
    #[must_use]
    pub fn with_interior_point(self, interior_point: InteriorPoint) -> Self {
        Self { interior_point, ..self }
    }

    /// Replaces the SQP solver.
    #[must_use]
    pub fn with_sqp(self, sqp: Sqp) -> Self {
        Self { sqp, ..self }
    }
}

impl SubproblemSolver for AutoSolver {
    fn name(&self) -> &'static str {
        "automatic"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        if program.coupled().is_some() {
            let solution = self.interior_point.solve(program, start)?;
            if solution.status.is_usable() || start.len() > DENSE {
                return Ok(solution);
            }
        }
        if program.structure() != Structure::Nonlinear
            && let Some(solution) = self.conic.solve_convex(program, start)?
        {
            return Ok(solution);
        }
        if program.row_factors().is_some() {
            return SecondOrder::default().with_sqp(self.sqp).solve(program, start);
        }
        let few_rows = program.rows() <= FEW_ROWS;
        if program.separable().is_some() {
            let solution =
                if few_rows { self.falk.solve(program, start)? } else { self.interior_point.solve(program, start)? };
            if solution.status.is_usable() || start.len() > DENSE {
                return Ok(solution);
            }
        }
        self.sqp.solve(program, start)
    }
}
