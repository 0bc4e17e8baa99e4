//! Solvers for the approximate problem of a cycle.
