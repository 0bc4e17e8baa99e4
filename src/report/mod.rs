//! What a reader sees of a run: figures, animations, tables, CSV files.
//!
//! Everything here takes plain numbers with names and units, so that any method or analysis can be shown; [`methods`]
//! and [`proof`] alone know what the library's comparison and the check of derivatives hand over.

pub mod animation;
pub mod figure;
pub mod methods;
pub mod picture;
pub mod proof;
pub mod table;
