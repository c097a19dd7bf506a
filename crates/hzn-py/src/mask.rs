//! `Report.mask`.

use std::sync::Arc;

use hzn_core::Solution;
use hzn_files::FrameData;
use hzn_run::mask;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::errors;
use crate::report::Report;
use crate::state::State;

/// What the mask of a picture is drawn from. The reports of all bodies in the picture share it.
pub(crate) struct Masking {
    pub(crate) state: Arc<State>,
    /// The answer of each body of the sensor.
    pub(crate) answers: Vec<Option<Solution<f64>>>,
    /// What was given with the picture.
    pub(crate) data: FrameData,
}

/// Draws the mask of the picture of a report.
pub(crate) fn draw<'py>(py: Python<'py>, report: &Report, margin_deg: f64) -> PyResult<Bound<'py, PyArray2<bool>>> {
    if !(0.0..=90.0).contains(&margin_deg) {
        return Err(errors::config(format!("margin_deg: {margin_deg} is refused: must be 0 to 90")));
    }
    // An exception and not None, because `image[None] = 0` would change every pixel.
    let Some(masking) = report.masking.as_ref() else {
        return Err(errors::other(match report.is_answer() {
            true => "mask: only the report of Sensor.process has one, not a recorded or pickled report".to_owned(),
            false => format!("mask: the picture has no answer ({})", report.row.status),
        }));
    };
    let answers: Vec<_> = masking.answers.iter().map(Option::as_ref).collect();
    let (camera, data) = (&masking.state.camera.lens, &masking.data);
    let camera = camera.with_rate(data.rate_rad_s).with_temperature(data.camera_temperature_c);
    let drawn = errors::detached(py, || {
        let covered = masking.state.masker().cover(&answers, Some(data), margin_deg.to_radians())?;
        Ok::<_, String>(mask::draw(&covered.outlines, &camera))
    })?;
    let drawn = drawn.map_err(|why| errors::other(format!("mask: {why} ({})", report.row.status)))?;
    let (width, height) = (drawn.width() as usize, drawn.height() as usize);
    let covered: Vec<bool> = drawn.into_raw().into_iter().map(|value| value == mask::COVERED).collect();
    PyArray1::from_vec(py, covered).reshape([height, width])
}
