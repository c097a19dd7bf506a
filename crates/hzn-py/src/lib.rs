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

mod calibration;
mod camera;
mod cells;
mod drawing;
mod drawn;
mod errors;
mod expected;
mod image;
mod locate;
mod made;
mod mask;
mod nav;
mod notebook;
mod numbered;
mod numbers;
mod overlay;
mod parameters;
mod pickled;
mod prior;
mod read;
mod recording;
mod report;
mod rig;
mod sensor;
mod sequence;
mod simulation;
mod stages;
mod start;
mod state;
mod view;

/// The module `hzn._hzn`.
#[pyo3::pymodule(gil_used = false)]
mod _hzn {
    #[pymodule_export]
    use crate::calibration::{Calibration, calibrate, calibrate_points, find_corners};
    #[pymodule_export]
    use crate::camera::Camera;
    #[pymodule_export]
    use crate::errors::{ConfigError, HznError, ImageError, panic_within};
    #[pymodule_export]
    use crate::expected::Expected;
    #[pymodule_export]
    use crate::locate::locate;
    #[pymodule_export]
    use crate::nav::{Filter, celestial, fuse, triad_of, wahba_of};
    #[pymodule_export]
    use crate::numbered::number;
    #[pymodule_export]
    use crate::overlay::overlay;
    #[pymodule_export]
    use crate::prior::Prior;
    #[pymodule_export]
    use crate::recording::{Frame, Recording, open_mcap, read_mcap, write_mcap};
    #[pymodule_export]
    use crate::report::Report;
    #[pymodule_export]
    use crate::rig::{Rig, RigEpoch, RigMemory};
    #[pymodule_export]
    use crate::sensor::Sensor;
    #[pymodule_export]
    use crate::sequence::{Item, Sequence, check_prior, process_encoded};
    #[pymodule_export]
    use crate::simulation::{SimulatedFrame, Simulation, design, evaluate};
    #[pymodule_export]
    use crate::stages::{
        Cone, Fit, Rays, exclude_body, find_borders, find_consensus, find_threshold, fit_cone, fuse_half_angle,
        locate_points, to_rays,
    };
    #[pymodule_export]
    use crate::view::render;

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "Python's own spelling")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
