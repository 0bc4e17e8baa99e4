//! The optimization problem: design variables, responses over time, objective and constraints.

mod program;

pub use program::{Gradients, Program, Structure, Values};
