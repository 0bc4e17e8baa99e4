//! Mechanics compared with closed forms, published solutions, identities and finite differences.

mod accelerating_drives;
mod adaptive;
mod adjoint;
mod allocations;
mod beams;
mod derivatives;
mod drift;
mod elements;
mod events;
mod explicit;
mod failures;
mod four_bar;
mod hessian;
mod impacts;
mod initial_equilibrium;
mod modes;
mod order;
mod outputs;
mod reference;
mod rejected;
mod rigid_limit;
mod semi_analytical;
mod switches;
mod table;
mod zoo;
