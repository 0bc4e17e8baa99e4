//! Etman, van Campen & Schoofs, *Design optimization of multibody systems by sequential approximation*,
//! Multibody System Dynamics 2 (1998) 393–415: its tables and figures, regenerated.

mod figures;
#[cfg(feature = "multibody")]
pub mod four_bar;
#[cfg(feature = "multibody")]
mod printed_rows;
mod runs;
mod summary;

pub use figures::figures;
#[cfg(feature = "multibody")]
pub use printed_rows::{PrintedRow, printed_rows};
pub use runs::{Observer, Regenerated, Run, TABLES, regenerate};
pub use summary::{Active, Entry, SCHEMA, Summary, Variable};
