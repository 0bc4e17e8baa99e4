//! Derivatives of analyses with respect to the design.

pub(crate) mod activity;
pub mod adjoint;
pub mod forward;
pub mod history;
pub mod method;
pub mod modal;
pub(crate) mod saltation;
pub mod second_order;
pub(crate) mod seeding;
pub mod semi_analytical;
