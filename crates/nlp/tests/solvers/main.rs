//! Solvers held to published optima, second solvers and optimality conditions.

mod conic;
mod sqp;
