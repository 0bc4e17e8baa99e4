//! Mechanics held to closed forms, published solutions, identities and differences.

mod derivatives;
mod elements;
mod failures;
mod order;
mod reference;
mod zoo;
