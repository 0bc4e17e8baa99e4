//! The names that most programs need: `use linkwright::prelude::*;`.
//!
//! Analyses of mechanisms are in `linkwright::responses::mechanism`, approximations in [`approximation`](crate::approximation),
//! and problems of the literature in [`cases`](crate::cases).

pub use crate::function;
pub use crate::problem::{
    Analysis, ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity, TimeGrid,
};
pub use crate::sao::{Method, Screening, State, Status, Stop};
pub use autodiff::Scalar;
