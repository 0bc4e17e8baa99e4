//! Motions with events: orders of convergence, and derivatives by every method.

mod explicit;
mod methods;
mod models;
mod orders;
