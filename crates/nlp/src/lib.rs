//! Solvers for the approximate problem of a cycle.
//!
//! | solver | programs |
//! |---|---|
//! | [`Conic`] | linear and convex quadratic, through Clarabel |
//! | [`Sqp`] | any smooth program, to a local solution |
//! | [`Falk`] | separable and strictly convex with few rows: the dual, for millions of variables |
//! | [`InteriorPoint`] | separable and convex, with many rows |
//! | [`SecondOrder`] | linear or convex quadratic objective with convex quadratic rows, through Clarabel |
//! | [`Automatic`] | the one of these that fits |
//! | [`MultiStart`] | any of these from several points, for non-convex programs |
//! | [`ConcurrentSolver`] | any two of these, compared |
//!
//! Every [`Solution`] carries a [`KktResidual`] that is computed apart from the solver.

mod automatic;
mod bookkeeping;
mod conic;
mod elastic;
mod falk;
mod interior_point;
mod kkt;
mod low_rank;
mod multi_start;
mod normalized;
mod program;
mod quadratic_program;
mod race;
mod second_order;
pub mod separable;
mod solution;
mod solver;
mod sqp;

pub use automatic::Automatic;
pub use conic::Conic;
pub use error::{Error, Result};
pub use falk::{Falk, FalkState};
pub use interior_point::InteriorPoint;
pub use kkt::{ActiveSet, KktResidual, variable_scale};
pub use low_rank::LowRank;
pub use multi_start::MultiStart;
pub use program::{Gradients, Program, Structure, Values};
pub use quadratic_program::QuadraticProgram;
pub use race::{Comparison, ConcurrentSolver};
pub use second_order::SecondOrder;
pub use separable::Separable;
pub use solution::{Evaluations, Solution, Status};
pub use solver::SubproblemSolver;
pub use sqp::{Curvature, Sqp, SqpState};
