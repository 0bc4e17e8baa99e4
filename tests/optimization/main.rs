//! Optimization held to published optima, iterates and tables.

mod check;
mod cli;
mod derivatives;
mod histories;
mod invalid;
mod issues;
mod library;
mod matrix;
mod optima;
mod papers;
mod parts;
mod properties;
mod resume;
mod separable;
mod status;
mod svanberg_1987;
mod threads;
