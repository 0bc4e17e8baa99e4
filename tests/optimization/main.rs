//! Optimization compared with published optima, iterates and tables.

mod automatic;
mod claims;
mod cli;
mod derivatives;
mod documented;
mod ends;
mod feasible_starts;
mod gradient_check;
mod histories;
mod invalid;
mod issues;
mod library;
mod many_designs;
mod matrix;
mod optima;
mod papers;
mod parts;
mod problem_data;
mod properties;
mod reproducibility;
mod second_order;
mod separable;
mod status;
mod suite;
mod svanberg_1987;
