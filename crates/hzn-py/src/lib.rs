//! The private half of the Python package `hzn`: classes that wrap the sensor of the command line.
//!
//! Arrays are read without a copy, and other Python threads can run during the work.

#![allow(clippy::doc_lazy_continuation, reason = "docstrings are NumPy's, not Markdown")]

/// Includes the docstring of a class or function from the stubs.
macro_rules! doc {
    ($name:literal) => {
        include_str!(concat!(env!("OUT_DIR"), "/", $name))
    };
}

mod camera;
mod errors;
mod image;
mod overlay;
mod parameters;
mod recording;
mod report;
mod sensor;
mod sequence;
mod simulation;
mod stages;

/// The module `hzn._hzn`.
#[pyo3::pymodule(gil_used = false)]
mod _hzn {
    #[pymodule_export]
    use crate::camera::Camera;
    #[pymodule_export]
    use crate::errors::{ConfigError, HznError, ImageError, panic_within};
    #[pymodule_export]
    use crate::overlay::overlay;
    #[pymodule_export]
    use crate::recording::{Frame, Recording, open_mcap, read_mcap, write_mcap};
    #[pymodule_export]
    use crate::report::Report;
    #[pymodule_export]
    use crate::sensor::Sensor;
    #[pymodule_export]
    use crate::sequence::{Item, Sequence, process_encoded};
    #[pymodule_export]
    use crate::simulation::{SimulatedFrame, Simulation, design, evaluate};
    #[pymodule_export]
    use crate::stages::{Cone, Expected, Fit, Rays, borders, fit, fuse, keep, level, pick, rays, withdraw};

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "Python's own spelling")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
