//! Solvers compared with published optima, other solvers and optimality conditions.

mod conic;
mod sqp;
