//! What a reader sees of a run: figures, animations, tables, CSV files.
//!
//! Everything here takes plain numbers with names and units, so that any method or analysis can be shown; [`methods`],
//! [`proof`] and [`run`] alone know what the library's comparison, the check of derivatives and an optimization hand over.

pub mod animation;
pub mod figure;
pub mod methods;
pub mod page;
pub mod plots;
pub mod proof;
pub mod run;
pub mod table;
