//! The model file: a mechanism, an optimization problem and a method as text.
//!
//! | module | content |
//! |---|---|
//! | `complete` | completion of a text at a place |
//! | `attached` | files that a model names: `include`, tables of numbers |
//! | `text_parts` | the parts of a text: the own text of a model, and those of attached files |
//! | `diagnostics` | errors and notes about a file, with their locations |
//! | [`unit`](mod@unit) | units of numbers: `120 mm` |
//! | [`robot`] | robots of URDF and MJCF files as model files |
//! | `settings` | the TOML of a file: parsing, all settings by their keys, the fingerprint |
//! | `version` | versions of the format and renamed words |
//! | `limits` | sizes beyond which a file is rejected |
//! | [`expression`] | formulas such as `2*pi*r^2`: parsed once, evaluated over any [`Scalar`](autodiff::Scalar) |
//! | `file` | sections of the file: their keys, and what they define |
//! | `document` | the reference of all keys, for the documentation and for editors |
//!
//! A file is read completely, every name resolved and every formula compiled, before anything is analysed. All keys are
//! listed in `docs/model-file.md`.
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     version = 2
//!     [design.width]
//!     start = 3.0
//!     lower = 0.5
//!     [[output]]
//!     name = "stress"
//!     value = "1/width"
//!     [objective]
//!     minimize = "width"
//!     [[constraint]]
//!     name = "strength"
//!     value = "stress"
//!     at_most = 0.5
//! "#;
//! let model = linkwright::model_file::read("bar.toml", text)?;
//! let end = model.method().solve(&model.problem()?, |_| ())?;
//! assert!((end.design[0] - 2.0).abs() < 1e-2);
//! # Ok(())
//! # }
//! ```

mod attached;
mod complete;
mod diagnostics;
mod document;
pub mod expression;
mod file;
mod limits;
mod number;
pub mod robot;
mod settings;
mod text_parts;
pub mod unit;
mod version;

pub use attached::with_files;
pub use complete::{Completion, Completions, completions};
pub use diagnostics::{Diagnostic, DiagnosticReport, Severity, visible};
pub use document::{document, schema, tables};
#[cfg(feature = "report")]
pub use file::DrawnOutputs;
pub use file::{Accepts, Constant, Key, Model, Need, TableKeys, read, read_generated, read_of_run};
#[cfg(feature = "report")]
pub(crate) use file::{
    FileSource, Read, Section, Word, default, find, optional, ordered, read_document, required, wrong_type,
};
pub use number::{number_in, with_start};
pub use settings::{settings, toml_string, with_setting};
#[cfg(feature = "report")]
pub(crate) use {number::number_of, settings::with_constant_as_variable};
