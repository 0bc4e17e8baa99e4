//! The solver that fits a program, chosen by its structure.

use super::{Conic, Falk, InteriorPoint, SecondOrder, Solution, Sqp, SubproblemSolver};
use crate::{Program, Structure};
use error::Result;

/// Rows up to which the dual is the faster one. Beyond, the interior point needs 0.4 and 1.5 ms for 3 variables with 1 000 and
/// 10 000 rows, SQP 16 and 69 ms.
const FEW: usize = 200;
/// Variables up to which matrices of n × n are affordable.
const DENSE: usize = 1000;

/// Linear and convex quadratic programs go to [`Conic`], those with convex quadratic rows to [`SecondOrder`]; separable
/// ones to [`Falk`] or, with more than 200 rows, to [`InteriorPoint`], which also takes those that a quadratic of low rank
/// couples; all others, and those that these do not settle, to [`Sqp`].
///
/// ```
/// use linkwright_nlp::{Automatic, QuadraticProgram, SubproblemSolver};
/// use nalgebra::DMatrix;
/// // A concave objective −x² on [−1, 2] is not for the conic solver.
/// let program = QuadraticProgram::new(vec![0.0])
///     .hessian(DMatrix::from_element(1, 1, -2.0))
///     .bounds(vec![-1.0], vec![2.0]);
/// let solution = Automatic::default().solve(&program, &[0.5])?;
/// assert_eq!((solution.x[0], solution.objective), (2.0, -4.0));
/// # Ok::<(), linkwright::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Automatic {
    /// For linear and convex quadratic programs.
    pub conic: Conic,
    /// For separable programs with few rows.
    pub falk: Falk,
    /// For separable programs with many rows.
    pub interior_point: InteriorPoint,
    /// For the rest.
    pub sqp: Sqp,
}

impl SubproblemSolver for Automatic {
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
            return SecondOrder { sqp: self.sqp }.solve(program, start);
        }
        let few_rows = program.rows() <= FEW;
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
