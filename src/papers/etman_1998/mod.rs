//! Etman, van Campen & Schoofs, *Design optimization of multibody systems by sequential approximation*,
//! Multibody System Dynamics 2 (1998) 393–415: its tables and figures, regenerated.

mod figures;
mod runs;
mod summary;

pub use figures::figures;
pub use runs::{Observer, Regenerated, Run, TABLES, regenerate};
pub use summary::{Active, Entry, SCHEMA, Summary, Variable};
