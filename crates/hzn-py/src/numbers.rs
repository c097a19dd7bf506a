//! Arguments of a fixed number of numbers.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// `N` numbers. In the message about another count, Python then names the argument, which it does not do for an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers<const N: usize>(pub(crate) [f64; N]);

impl<'py, const N: usize> FromPyObject<'_, 'py> for Numbers<N> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let given: Vec<f64> = object.extract().map_err(|_| {
            let name = object.get_type().name().map(|name| name.to_string()).unwrap_or_default();
            PyTypeError::new_err(format!("{N} numbers are expected, not {name}"))
        })?;
        let count = given.len();
        let numbers = given.try_into().map_err(|_| {
            let hint = if (N, count) == (4, 3) { ": a quaternion is (w, x, y, z)" } else { "" };
            PyTypeError::new_err(format!("{N} numbers are expected, not {count}{hint}"))
        });
        numbers.map(Self)
    }
}
