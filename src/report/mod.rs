//! Tables, CSV files, figures, animations and HTML pages.
//!
//! [`figure`], [`plots`], [`animation`], [`table`] and [`page`] take plain numbers with names and units. [`benchmark`], [`suite`],
//! [`gradient_check`] and [`run`] report comparisons of methods, a gradient check and an optimization. [`outcome`] gives objective and
//! constraints in the terms in which they are stated, [`between_points`] looks for larger values between the time points, [`number`] writes
//! numbers for people.

pub mod animation;
pub mod benchmark;
pub mod between_points;
pub mod figure;
pub mod gradient_check;
pub mod number;
pub mod outcome;
pub mod page;
pub mod plots;
pub mod run;
pub mod suite;
pub mod table;
