//! `hzn.Expected`.

use hzn_core::Expected as CoreExpected;
use hzn_files::FrameData;
use pyo3::prelude::*;

use crate::errors;
use crate::state::State;

#[doc = doc!("Expected")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Expected {
    pub(crate) core: CoreExpected<f64>,
}

impl Expected {
    pub(crate) fn new(state: &State, data: &FrameData, body: usize) -> PyResult<Self> {
        let bodies = state.config.each_body().len();
        if body >= bodies {
            return Err(errors::config(format!("body: {body} is refused: must be 0 to {}", bodies - 1)));
        }
        Ok(Self { core: state.expect_body(body, data)? })
    }
}

#[pymethods]
impl Expected {
    #[doc = doc!("Expected.half_angle_deg")]
    #[getter]
    fn half_angle_deg(&self) -> f64 {
        self.core.half_angle_rad().to_degrees()
    }
}
