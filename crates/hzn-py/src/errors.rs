//! The exceptions, one for each family of errors, and a wrapper that turns panics into exceptions.
//!
//! Python prints a message as it is, also to a terminal. A message can contain a name or a key from a file, so it is
//! made harmless here.

use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};

use hzn_files::Problem;
use hzn_run::terminal;
use pyo3::exceptions::{PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::{PyErr, create_exception};

create_exception!(hzn, HznError, PyValueError, "Base class of hzn's exceptions.");
create_exception!(
    hzn,
    ConfigError,
    HznError,
    "An impossible sensor, calibration or prior of a picture; the message names the field."
);
create_exception!(hzn, ImageError, HznError, "An array that is no picture, or not one of this camera.");

/// Returns the exception for an invalid configuration.
pub(crate) fn config(what: impl std::fmt::Display) -> PyErr {
    ConfigError::new_err(terminal::lines(what))
}

/// Returns the exception for a problem in a text that was made here. Nobody sees that text, so its lines say nothing.
pub(crate) fn unseen(problem: Problem) -> PyErr {
    config(Problem { line: None, column: None, ..problem })
}

/// Returns the exception for an invalid picture.
pub(crate) fn image(what: impl std::fmt::Display) -> PyErr {
    ImageError::new_err(terminal::lines(what))
}

/// Returns the exception for all other errors, for example of a file.
pub(crate) fn other(what: impl std::fmt::Display) -> PyErr {
    HznError::new_err(terminal::lines(what))
}

/// Returns the exception for the reason why a run cannot begin or ends early.
pub(crate) fn run(error: hzn_run::Error) -> PyErr {
    match error.kind() {
        hzn_run::Kind::Unusable => config(error),
        hzn_run::Kind::Failed => other(error),
    }
}

/// Issues a warning: work goes on, but the user should check something.
pub(crate) fn warn(py: Python<'_>, what: impl std::fmt::Display) -> PyResult<()> {
    let text = CString::new(terminal::lines(what)).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

/// Runs `work` without holding the interpreter. A panic becomes an exception: the values that `work` owned are lost,
/// but the process goes on.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(work))).map_err(|panic| {
        let what = panic.downcast_ref::<&str>().copied().or(panic.downcast_ref::<String>().map(String::as_str));
        PyRuntimeError::new_err(format!("internal error of hzn, please report it: {}", what.unwrap_or("no message")))
    })
}

/// Panics within [`detached`], for the tests.
#[pyfunction]
#[pyo3(name = "_panic")]
pub(crate) fn panic_within(py: Python<'_>) -> PyResult<()> {
    detached(py, || panic!("asked for by a test"))
}
