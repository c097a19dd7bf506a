//! The private half of the Python package `hzn`: classes over the sensor that the command line has too.
//!
//! Arrays come in without a copy when they are C-contiguous, and the interpreter is free while a picture is processed.

mod camera;
mod errors;
mod image;
mod overlay;
mod recording;
mod report;
mod sensor;

/// `hzn._hzn`.
#[pyo3::pymodule(gil_used = false)]
mod _hzn {
    #[pymodule_export]
    use crate::camera::Camera;
    #[pymodule_export]
    use crate::errors::{ConfigError, HznError, ImageError};
    #[pymodule_export]
    use crate::overlay::overlay;
    #[pymodule_export]
    use crate::recording::read_mcap;
    #[pymodule_export]
    use crate::report::Report;
    #[pymodule_export]
    use crate::sensor::Sensor;

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "Python's own spelling")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
