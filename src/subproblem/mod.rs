//! Solvers for the approximate problem of a cycle.
//!
//! | solver | programs |
//! |---|---|
//! | [`Conic`] | linear and convex quadratic, through Clarabel |
//! | [`Sqp`] | any smooth program, to a local solution |
//! | [`Automatic`] | the one of these that fits |
//!
//! Every [`Solution`] carries a [`KktResidual`] that is computed apart from the solver.

mod automatic;
mod conic;
mod elastic;
mod kkt;
mod quadratic_program;
mod solution;
mod solver;
mod sqp;

pub use automatic::Automatic;
pub use conic::Conic;
pub use kkt::{ActiveSet, KktResidual, variable_scale};
pub use quadratic_program::QuadraticProgram;
pub use solution::{Evaluations, Solution, Status};
pub use solver::SubproblemSolver;
pub use sqp::{Curvature, Sqp, SqpState};
