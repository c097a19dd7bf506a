//! `hzn.Report.mask`: what hides the stars in a picture.

use std::sync::Arc;

use hzn_core::Solution;
use hzn_files::FrameData;
use hzn_run::mask::{self, Masker};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;

use crate::errors;
use crate::state::State;

/// What the mask of a picture needs: the answer of each body, and what was given with the picture.
pub(crate) struct Seen {
    state: Arc<State>,
    answers: Vec<Option<Solution<f64>>>,
    data: Option<FrameData>,
}

impl Seen {
    /// Keeps what the mask needs.
    pub(crate) fn new<'a>(
        state: &Arc<State>,
        answers: impl Iterator<Item = Option<&'a Solution<f64>>>,
        data: Option<&FrameData>,
    ) -> Self {
        Self { state: Arc::clone(state), answers: answers.map(|a| a.copied()).collect(), data: data.cloned() }
    }

    /// Draws the mask, as `hzn run --mask-pictures` does.
    pub(crate) fn draw<'py>(&self, py: Python<'py>, margin_deg: f64) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let Self { state, answers, data } = self;
        let data = data.as_ref();
        let answers: Vec<Option<&Solution<f64>>> = answers.iter().map(Option::as_ref).collect();
        let drawn = errors::detached(py, || {
            let masker = Masker::new(&state.config).map_err(|e| e.to_string())?;
            let covered = masker.cover(&answers, data, margin_deg.to_radians())?;
            // With its temperature, and with the rate of rotation for each row of a rolling shutter.
            let lens = state.camera.lens.with_rate(data.and_then(|d| d.rate_rad_s));
            let lens = lens.with_temperature(data.and_then(|d| d.camera_temperature_c));
            Ok::<_, String>((mask::draw(&covered.outlines, &lens), covered.without))
        })?;
        let (picture, without) = drawn.map_err(|why| errors::other(format!("there is no mask: {why}")))?;
        for body in without {
            let what = "which was not found, and its direction is not known";
            errors::warn(py, format_args!("the mask is without {}, {what}", body.name()))?;
        }
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let array = Array2::from_shape_vec((height, width), picture.into_raw()).map_err(errors::image)?;
        Ok(array.into_pyarray(py))
    }
}

/// Refuses a margin that is no angle from 0 to 90 degrees.
pub(crate) fn check_margin(margin_deg: f64) -> PyResult<()> {
    if (0.0..=90.0).contains(&margin_deg) {
        return Ok(());
    }
    Err(errors::config(format!("margin_deg: {margin_deg} is outside of its range, from 0 to 90")))
}

/// Returns the error of a report that has not processed its picture.
pub(crate) fn lost() -> PyErr {
    errors::other(
        "the mask is drawn only from the report that processed the picture, and for all bodies at once: not from a \
         pickle, a recording, or Report.others",
    )
}
