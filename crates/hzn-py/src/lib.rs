//! The private half of the Python package `hzn`: classes over the sensor that the command line has too.
//!
//! Arrays come in without a copy, and the interpreter is free while there is work.

#![allow(clippy::doc_lazy_continuation, reason = "docstrings are NumPy's, not Markdown")]

/// The docstring of a class or function, as the stubs have it.
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

/// `hzn._hzn`.
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
