//! What a reader sees of a run: figures, animations, tables, CSV files.
//!
//! Everything here takes plain numbers with names and units, so that any method or analysis can be shown.

pub mod animation;
pub mod figure;
pub mod picture;
pub mod table;
