//! Mechanics held to closed forms, published solutions, identities and differences.

mod derivatives;
mod elements;
mod explicit;
mod failures;
mod order;
mod reference;
mod rigid_limit;
mod zoo;
