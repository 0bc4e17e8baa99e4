//! Motions with events: orders of convergence, and derivatives by every method.

mod balls;
mod conditions;
mod coupled_friction;
mod derivative_methods;
mod explicit;
#[path = "../support/finite_differences.rs"]
mod finite_differences;
mod function_jumps;
mod lasting;
mod models;
mod orders;
mod reactions;
mod releases3;
mod several_parts;
mod short_loads;
mod sides;
mod turns;
