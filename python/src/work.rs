//! The interface between Python and Rust: interpreter lock, panics, forked processes, exceptions of callbacks.

use linkwright::Error;
use linkwright::model_file::DiagnosticReport;
use linkwright::responses::program::{end_programs, permit_programs};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Time between two checks for signals while programs compute.
const PAUSE: Duration = Duration::from_millis(50);

/// True once work was done in this process, so that there may be worker threads.
static USED: AtomicBool = AtomicBool::new(false);
/// True in a child process that was forked from such a process: its worker threads do not exist.
static FORKED: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// The exception of a Python function during the work of this thread.
    ///
    /// [`Error`] carries text only, and a failed analysis means "try a smaller step". The exception is kept here and raised when
    /// the work returns, with its traceback.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// Stores the exception of a Python function. The work then ends as soon as it can.
pub fn keep(error: PyErr) {
    RAISED.set(Some(error));
}

/// True if a Python function has raised an exception during the work of this thread.
pub fn is_interrupted() -> bool {
    RAISED.with_borrow(Option::is_some)
}

/// Does work without the interpreter's lock.
///
/// Everything that may reach the thread pool goes through here: a thread that waits for the pool while it holds the lock, and
/// a pool thread that waits for the lock, are in deadlock.
///
/// # Errors
///
/// An exception of a Python function that was called, then the error of the work. A panic becomes a `RuntimeError`, and so does
/// work in a forked process, whose worker threads do not exist.
pub fn work<T: Send>(py: Python<'_>, task: impl FnOnce() -> Result<T, Error> + Send) -> PyResult<T> {
    check_threads()?;
    let (outcome, raised) = py.detach(|| done(task));
    concluded(py, outcome, raised)
}

/// Does work during which programs may compute: Ctrl-C ends them, and the work with them.
///
/// The work is done by another thread, because this one handles signals. Python functions must not be called by it.
///
/// # Errors
///
/// `KeyboardInterrupt`, or another exception of a signal handler; those of [`work`].
pub fn work_with_programs<T: Send>(py: Python<'_>, task: impl FnOnce() -> Result<T, Error> + Send) -> PyResult<T> {
    work_until(py, |_| task())
}

/// As [`work_with_programs`], for work that looks at a flag, which Ctrl-C sets, and ends early if it is set.
///
/// # Errors
///
/// Those of [`work_with_programs`].
pub fn work_until<T: Send>(py: Python<'_>, task: impl FnOnce(&AtomicBool) -> Result<T, Error> + Send) -> PyResult<T> {
    check_threads()?;
    let is_stopped = AtomicBool::new(false);
    let is_stopped = &is_stopped;
    let (ended, interrupt) = py.detach(|| {
        thread::scope(|scope| {
            let (working, end) = channel::<()>();
            let worker = scope.spawn(move || {
                let _working = working;
                done(|| task(is_stopped))
            });
            let mut interrupt = None;
            while end.recv_timeout(PAUSE) == Err(RecvTimeoutError::Timeout) {
                let signal = Python::attach(|py| py.check_signals());
                if let (None, Err(error)) = (&interrupt, signal) {
                    is_stopped.store(true, Relaxed);
                    end_programs();
                    interrupt = Some(error);
                }
            }
            (worker.join(), interrupt)
        })
    });
    if let Some(error) = interrupt {
        permit_programs();
        return Err(error);
    }
    let (outcome, raised) = ended.unwrap_or_else(|panic| (Err(panic), None));
    concluded(py, outcome, raised)
}

/// A result, or the value of a panic.
type CaughtResult<T> = std::thread::Result<Result<T, Error>>;

fn done<T>(task: impl FnOnce() -> Result<T, Error>) -> (CaughtResult<T>, Option<PyErr>) {
    let outcome = catch_unwind(AssertUnwindSafe(task));
    (outcome, RAISED.take())
}

fn concluded<T>(py: Python<'_>, outcome: CaughtResult<T>, raised: Option<PyErr>) -> PyResult<T> {
    if let Some(error) = raised {
        return Err(error);
    }
    match outcome {
        Ok(result) => result.map_err(|error| raise(py, &error)),
        Err(panic) => Err(PyRuntimeError::new_err(format!(
            "a bug of linkwright: {}; please report it with the model",
            message(&*panic)
        ))),
    }
}

/// Rejects work in a forked process, whose worker threads do not exist.
fn check_threads() -> PyResult<()> {
    if FORKED.load(Relaxed) {
        return Err(PyRuntimeError::new_err(
            "linkwright was used before this process was forked, and its threads do not exist here; start processes with \
             multiprocessing.get_context(\"forkserver\") or \"spawn\"",
        ));
    }
    USED.store(true, Relaxed);
    Ok(())
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without a message")
}

/// The exception classes, defined in `package/linkwright/_errors.py`.
pub struct Exceptions {
    failed: Py<PyType>,
    definition: Py<PyType>,
    model: Py<PyType>,
    other: Py<PyType>,
}

/// The exception classes.
pub fn exceptions(py: Python<'_>) -> PyResult<&'static Exceptions> {
    static CLASSES: PyOnceLock<Exceptions> = PyOnceLock::new();
    CLASSES.get_or_try_init(py, || {
        let module = py.import("linkwright._errors")?;
        let class = |name| -> PyResult<Py<PyType>> { Ok(module.getattr(name)?.cast_into::<PyType>()?.unbind()) };
        Ok(Exceptions {
            failed: class("AnalysisError")?,
            definition: class("DefinitionError")?,
            model: class("ModelError")?,
            other: class("Error")?,
        })
    })
}

/// True if the exception says that a design cannot be analysed.
pub fn is_failed_analysis(py: Python<'_>, error: &PyErr) -> bool {
    exceptions(py).is_ok_and(|classes| error.is_instance(py, classes.failed.bind(py)))
}

fn exception(py: Python<'_>, class: impl FnOnce(&Exceptions) -> &Py<PyType>, text: String) -> PyErr {
    match exceptions(py) {
        Ok(classes) => PyErr::from_type(class(classes).bind(py).clone(), text),
        Err(error) => error,
    }
}

/// The exception of an error.
pub fn raise(py: Python<'_>, error: &Error) -> PyErr {
    raise_as(py, error, error.to_string())
}

/// The exception of an error, with another text.
pub fn raise_as(py: Python<'_>, error: &Error, text: String) -> PyErr {
    match error {
        Error::Analysis { .. } | Error::NotFinite { .. } => exception(py, |e| &e.failed, text),
        Error::Subproblem { .. } => exception(py, |e| &e.other, text),
        _ => exception(py, |e| &e.definition, text),
    }
}

/// The exception of a model that cannot be read.
pub fn raise_report(py: Python<'_>, report: &DiagnosticReport) -> PyErr {
    exception(py, |e| &e.model, report.to_string())
}

/// Called in a child process after a fork.
#[pyfunction]
pub fn after_fork() {
    FORKED.store(USED.load(Relaxed), Relaxed);
}

/// Panics, for the test that a panic becomes a `RuntimeError`.
#[pyfunction]
pub fn panic(py: Python<'_>) -> PyResult<()> {
    work(py, || panic!("on request"))
}
