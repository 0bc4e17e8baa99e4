//! Etman, van Campen & Schoofs, *Design optimization of multibody systems by sequential approximation*,
//! Multibody System Dynamics 2 (1998) 393–415: its tables and figures, regenerated.

mod printed;
mod runs;
mod summary;
mod table;

pub use runs::{Observer, Run, TABLES, run, table3};
pub use summary::{Active, Entry, SCHEMA, Summary, Variable};
pub use table::{Cell, Table};
