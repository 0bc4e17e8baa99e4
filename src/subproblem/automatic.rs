//! The solver that fits a program, chosen by its structure.

use super::{Conic, Solution, Sqp, SubproblemSolver};
use crate::error::Result;
use crate::problem::{Program, Structure};

/// Linear and convex quadratic programs go to [`Conic`], all others to [`Sqp`].
///
/// ```
/// use linkwright::subproblem::{Automatic, QuadraticProgram, SubproblemSolver};
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
    /// For the rest.
    pub sqp: Sqp,
}

impl SubproblemSolver for Automatic {
    fn name(&self) -> &'static str {
        "automatic"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        if program.structure() != Structure::Nonlinear {
            if let Some(solution) = self.conic.solve_convex(program, start)? {
                return Ok(solution);
            }
        }
        self.sqp.solve(program, start)
    }
}
