//! Tables, CSV files, figures, animations and HTML pages.
//!
//! [`figure`], [`plots`], [`animation`], [`table`] and [`page`] take plain numbers with names and units. [`benchmark`], [`suite`],
//! [`gradient_check`] and [`run`] report comparisons of methods, a gradient check and an optimization.

pub mod animation;
pub mod benchmark;
pub mod figure;
pub mod gradient_check;
pub mod page;
pub mod plots;
pub mod run;
pub mod suite;
pub mod table;
