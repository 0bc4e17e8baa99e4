//! The model file: a mechanism, an optimization problem and a method as text.
//!
//! | folder | what |
//! |---|---|
//! | `expression/` | formulas such as `2*pi*r^2`: parsed once, evaluated over any [`Scalar`](autodiff::Scalar) |
//! | `file/` | sections of the file: what may stand in them, and what they make |
//! | `complaint` | what is wrong with a file, and where |
//! | `document` | the list of all keys |
//! | `schema` | the same for editors, as JSON schema |
//! | `settings` | all values of a file by their keys, for telling two files apart |
//! | `limits` | sizes beyond which a file is refused |
//!
//! A file is read completely, every name resolved and every formula compiled, before anything is analysed. All keys are
//! listed in `docs/model-file.md`.

mod complaint;
mod document;
pub mod expression;
mod file;
mod limits;
mod schema;
mod settings;

pub use complaint::{Diagnostic, DiagnosticReport};
pub use document::document;
pub use file::{Accepts, Key, Model, Need, Table, read, tables};
pub use schema::schema;
pub use settings::settings;
