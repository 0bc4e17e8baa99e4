//! The compiled part of the Python package `linkwright`: models, problems and runs of the Rust library.
//!
//! | module | contents |
//! |---|---|
//! | `work` | the interface between Python and Rust: interpreter lock, panics, forked processes, exceptions of callbacks |
//! | `function` | an analysis that calls Python functions |
//! | `problem` | model files and problems: analyses, derivatives, checks, runs |
//! | `state` | the state of a run: history and results |
//! | `report` | the report of a run: a page, and its figures |
//! | `study` | studies: runs, rows, conclusions, and the file of rows |
//!
//! The Python part in `python/package` checks arguments and gives results their labels.

mod function;
mod problem;
mod report;
mod state;
mod study;
mod work;

use linkwright::sao::presets;
use pyo3::prelude::*;

/// Names and titles of all methods.
#[pyfunction]
fn methods() -> Vec<(&'static str, &'static str)> {
    presets().iter().map(|preset| (preset.name, preset.title)).collect()
}

/// Ends the programs that analyses have started, at the end of this process.
#[pyfunction]
fn end_programs(py: Python<'_>) {
    py.detach(linkwright::responses::program::end_programs);
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<problem::Problem>()?;
    module.add_class::<state::State>()?;
    module.add_class::<study::Study>()?;
    module.add_class::<study::RowFile>()?;
    module.add_function(wrap_pyfunction!(methods, module)?)?;
    module.add_function(wrap_pyfunction!(problem::model_text, module)?)?;
    module.add_function(wrap_pyfunction!(report::report, module)?)?;
    module.add_function(wrap_pyfunction!(report::figures, module)?)?;
    module.add_function(wrap_pyfunction!(study::study_model, module)?)?;
    module.add_function(wrap_pyfunction!(end_programs, module)?)?;
    module.add_function(wrap_pyfunction!(work::after_fork, module)?)?;
    module.add_function(wrap_pyfunction!(work::panic, module)?)
}
