//! Arguments of a fixed number of numbers, and of seconds.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::errors;

/// `N` numbers. In the message about another count, Python then names the argument, which it does not do for an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers<const N: usize>(pub(crate) [f64; N]);

impl<'py, const N: usize> FromPyObject<'_, 'py> for Numbers<N> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let hint = if N == 4 { ": a quaternion is (w, x, y, z)" } else { "" };
        let given: Vec<f64> = object.extract().map_err(|_| {
            let shape = object.getattr("shape").and_then(|shape| Ok(shape.cast_into::<PyTuple>()?.str()?.to_string()));
            let (what, hint) = match shape {
                Ok(shape) => (format!("an array of shape {shape}"), hint),
                Err(_) => (class_of(&object), ""),
            };
            PyTypeError::new_err(format!("{N} numbers are expected, not {what}{hint}"))
        })?;
        let count = given.len();
        let numbers = given.try_into().map_err(|_| {
            let hint = if count == 3 { hint } else { "" };
            PyTypeError::new_err(format!("{N} numbers are expected, not {count}{hint}"))
        });
        numbers.map(Self)
    }
}

/// Width and height in pixels, as a tuple, a list or an array.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Size(pub(crate) u32, pub(crate) u32);

impl<'py> FromPyObject<'_, 'py> for Size {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        // The items of an array are taken one by one: they are numbers of NumPy.
        match object.extract::<Vec<u32>>().as_deref() {
            Ok(&[width, height]) => Ok(Self(width, height)),
            _ => Err(PyTypeError::new_err(format!(
                "two whole numbers (width, height) are expected, not {}",
                object.repr().map_or_else(|_| class_of(&object), |repr| repr.to_string())
            ))),
        }
    }
}

impl Size {
    /// Returns width and height if a camera can have them.
    pub(crate) fn in_u16(self) -> PyResult<(u16, u16)> {
        let Self(width, height) = self;
        match (width.try_into(), height.try_into()) {
            (Ok(width), Ok(height)) => Ok((width, height)),
            _ => Err(errors::config(format!("size: ({width}, {height}) is refused: must be 1 to 65535 pixels"))),
        }
    }
}

/// A time in seconds. The message about an object that is a date says how it becomes seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seconds(pub(crate) f64);

impl<'py> FromPyObject<'_, 'py> for Seconds {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let class = class_of(&object);
        let hint = match class.as_str() {
            "datetime" | "Timestamp" => {
                ": write time.timestamp(), which are the seconds since 1970; a time without a zone counts as local time"
            }
            "datetime64" => ": write time.astype(\"datetime64[ns]\").astype(float) * 1e-9, the seconds since 1970",
            _ => "",
        };
        // A time of NumPy in nanoseconds is a whole number, and would be taken for seconds.
        let number = if hint.is_empty() { object.extract::<f64>().ok() } else { None };
        let wrong = || PyTypeError::new_err(format!("a number of seconds is expected, not {class}{hint}"));
        number.map(Self).ok_or_else(wrong)
    }
}

/// Returns the name of the class of an object.
pub(crate) fn class_of(object: &Bound<'_, PyAny>) -> String {
    object.get_type().name().map_or_else(|_| "this object".to_owned(), |name| name.to_string())
}
