//! Etman, van Campen & Schoofs, *Design optimization of multibody systems by sequential approximation*,
//! Multibody System Dynamics 2 (1998) 393–415: its tables and figures, regenerated.

mod figures;
pub mod four_bar;
mod four_bar_figures;
mod printed_rows;
mod runs;
mod summary;

pub use figures::{animations, figures, slider_crank_at};
pub use four_bar_figures::{four_bar_animation, four_bar_figures};
pub use printed_rows::{PrintedRow, printed_rows};
pub use runs::{Observer, Regenerated, ReproducedRun, TABLES, regenerate, table1};
pub use summary::{Active, Entry, SCHEMA, Summary, Variable};
