//! One exception a family of errors.

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, create_exception};

create_exception!(hzn, HznError, PyValueError, "Base of hzn's exceptions.");
create_exception!(
    hzn,
    ConfigError,
    HznError,
    "A sensor, a calibration or a frame's own data that cannot be; names the field."
);
create_exception!(hzn, ImageError, HznError, "An array that is no picture, or not one of this camera.");

/// A wrong configuration.
pub(crate) fn config(what: impl std::fmt::Display) -> PyErr {
    ConfigError::new_err(what.to_string())
}

/// A wrong picture.
pub(crate) fn image(what: impl std::fmt::Display) -> PyErr {
    ImageError::new_err(what.to_string())
}
