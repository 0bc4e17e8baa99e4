//! What a reader sees of a run: figures, animations, tables, CSV files.
//!
//! Everything here takes plain numbers with names and units, so that any method or analysis can be shown; [`methods`] alone
//! knows what the library's comparison hands over.

pub mod animation;
pub mod figure;
pub mod methods;
pub mod picture;
pub mod table;
