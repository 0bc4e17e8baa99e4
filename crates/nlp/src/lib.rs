//! Mathematical programs, solvers for them, and an independent check of the optimality conditions.
//!
//! A [`Program`] has a smooth objective, rows gᵢ(x) ≤ 0 or = 0, and bounds. A [`SubproblemSolver`] returns a [`Solution`]:
//! point, multipliers, [`ProgramStatus`] and a [`KktResidual`] that is computed independently of the solver.
//!
//! | solver | programs | when to use |
//! |---|---|---|
//! | [`AutoSolver`] | all | by default: it selects one of the solvers below by the structure of the program |
//! | [`Conic`] | linear, convex quadratic | solutions to rounding, through Clarabel |
//! | [`SecondOrder`] | convex quadratic rows with known factors | through Clarabel, finished by SQP |
//! | [`Falk`] | separable, strictly convex, bounded | few rows, up to millions of variables: MMA and CONLIN subproblems |
//! | [`InteriorPoint`] | separable, convex; also with a coupling of low rank | many rows, or terms without curvature |
//! | [`Sqp`] | all smooth programs | everything else; a local solution, dense matrices |
//! | [`MultiStart`] | those of the inner solver | several local solutions |
//! | [`ConcurrentSolver`] | those of both solvers | to check one solver against another |
//!
//! [`Sqp`], [`Falk`] and [`InteriorPoint`] run in argmin's `Executor`. [`Sqp::executor`] gives access to it, for
//! observers, checkpoints, timing and a time limit. Wall time never enters a [`Solution`]: equal input gives equal bits.
//!
//! Programs are given by their matrices ([`QuadraticProgram`]), by separable terms ([`separable`]), or by an
//! implementation of [`Program`]:
//!
//! ```
//! use linkwright_nlp::{AutoSolver, Gradients, Program, Result, ProgramStatus, SubproblemSolver, Values};
//! use nalgebra::DMatrix;
//!
//! /// The point of the unit disk with the largest x + y.
//! struct Disk;
//!
//! impl Program for Disk {
//!     fn variables(&self) -> usize { 2 }
//!     fn rows(&self) -> usize { 1 }
//!     fn lower(&self) -> &[f64] { &[-2.0; 2] }
//!     fn upper(&self) -> &[f64] { &[2.0; 2] }
//!     fn values(&self, x: &[f64]) -> Result<Values> {
//!         Ok(Values { objective: -x[0] - x[1], rows: vec![x[0] * x[0] + x[1] * x[1] - 1.0] })
//!     }
//!     fn gradients(&self, x: &[f64]) -> Result<Gradients> {
//!         let rows = DMatrix::from_row_slice(1, 2, &[2.0 * x[0], 2.0 * x[1]]);
//!         Ok(Gradients { values: self.values(x)?, objective: vec![-1.0; 2], rows })
//!     }
//! }
//!
//! let solution = AutoSolver::default().solve(&Disk, &[0.5, 0.0])?;
//! assert_eq!(solution.status, ProgramStatus::Solved);
//! assert!((solution.objective + 2f64.sqrt()).abs() < 1e-9 && solution.kkt.largest() < 1e-7);
//! # Ok::<(), linkwright_nlp::Error>(())
//! ```

mod kkt;
mod low_rank;
mod orthonormal;
mod program;
mod quadratic_program;
mod quasi_newton;
pub mod separable;
mod solution;
mod solvers;

pub use error::{Error, Result};
pub use kkt::{KktResidual, variable_scale};
pub use low_rank::LowRank;
pub use orthonormal::{orthogonal_part, orthonormal_basis};
pub use program::{Gradients, Program, Separable, Structure, Values};
pub use quadratic_program::QuadraticProgram;
pub use quasi_newton::powell_damping;
pub use solution::{ActiveSet, Evaluations, ProgramStatus, Solution, SubproblemSolver};
pub use solvers::{
    AutoSolver, ConcurrentSolver, Conic, Curvature, Falk, FalkState, InteriorPoint, MultiStart, SecondOrder,
    SolverComparison, Sqp, SqpState, least_squares_multipliers,
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
