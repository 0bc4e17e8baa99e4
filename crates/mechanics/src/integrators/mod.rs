//! Time integration: implicit steps on the index-3 equations, and explicit Runge–Kutta methods.

pub mod explicit;
pub mod generalized_alpha;
pub mod predictor;
pub(crate) mod step_limit;
pub mod time_stepper;
