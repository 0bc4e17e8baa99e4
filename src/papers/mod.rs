//! Papers whose tables are regenerated and compared with the printed ones, and whose figures are drawn.
//!
//! Each paper is a folder here with a [`Paper`], an entry in [`papers`], and a folder `papers/NAME` of the repository with its
//! printed numbers and a README.

pub mod etman_1998;
mod paper;
mod summary;
pub mod svanberg_1987;

pub use paper::{Observer, Paper, PaperTable, ReproducedRun, ReproducedTable};
pub use summary::{ActiveConstraint, ReproductionSummary, RunSummary, SCHEMA, VariableValue};

/// All papers, by year.
pub fn papers() -> &'static [&'static dyn Paper] {
    &[&svanberg_1987::Svanberg1987, &etman_1998::Etman1998]
}
