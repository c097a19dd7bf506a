//! Altitude, position, attitude and other values that are given with a picture.

use hzn_files::FrameData;
use pyo3::prelude::*;

use crate::errors;
use crate::numbers::{Numbers, Seconds};

/// The values that are given with a picture, from Python's arguments. A table of pandas has NaN for a gap. NaN, or an
/// array of NaN, is therefore an unknown value, like an empty cell of a frames.csv.
#[pyclass(frozen, name = "_Prior", module = "hzn._hzn")]
pub(crate) struct Prior {
    pub(crate) data: FrameData,
}

#[pymethods]
impl Prior {
    #[new]
    #[pyo3(signature = (*, altitude_km = None, position_km = None, attitude = None, attitude_sigma_deg = None,
                        rate_rad_s = None, range_km = None, range_sigma_km = None, pole = None, sun = None,
                        time_s = None, camera_temperature_c = None))]
    pub(crate) fn new(
        altitude_km: Option<f64>,
        position_km: Option<Numbers<3>>,
        attitude: Option<Numbers<4>>,
        attitude_sigma_deg: Option<f64>,
        rate_rad_s: Option<Numbers<3>>,
        range_km: Option<f64>,
        range_sigma_km: Option<f64>,
        pole: Option<Numbers<3>>,
        sun: Option<Numbers<3>>,
        time_s: Option<Seconds>,
        camera_temperature_c: Option<f64>,
    ) -> PyResult<Self> {
        let time_s = number(time_s.map(|Seconds(time_s)| time_s));
        if time_s.is_some_and(f64::is_infinite) {
            return Err(errors::config("time_s: must be a finite number"));
        }
        let data = FrameData {
            time_s,
            utc_s: utc(time_s),
            altitude_km: number(altitude_km),
            position_km: numbers(position_km),
            q_fixed_from_camera_wxyz: numbers(attitude).map(check_attitude).transpose()?,
            attitude_sigma_deg: number(attitude_sigma_deg),
            rate_rad_s: numbers(rate_rad_s),
            range_km: number(range_km),
            range_sigma_km: number(range_sigma_km),
            pole_camera: direction("pole", numbers(pole))?,
            sun_camera: direction("sun", numbers(sun))?,
            camera_temperature_c: number(camera_temperature_c),
            ..FrameData::default()
        };
        Ok(Self { data })
    }
}

impl Prior {
    /// Issues a warning for each value that is possible but looks wrong, as `hzn run` does for a frames.csv. The texts
    /// name arguments instead of columns.
    pub(crate) fn tell_doubts(&self, py: Python<'_>, config: &hzn_core::Config) -> PyResult<()> {
        for doubt in self.data.check_sensor(config) {
            let named = doubt.replace("x_km, y_km, z_km", "position_km").replace("qw, qx, qy, qz", "attitude");
            errors::warn(py, named)?;
        }
        Ok(())
    }
}

fn number(x: Option<f64>) -> Option<f64> {
    x.filter(|x| !x.is_nan())
}

fn numbers<const N: usize>(x: Option<Numbers<N>>) -> Option<[f64; N]> {
    x.map(|Numbers(x)| x).filter(|x| !x.iter().all(|x| x.is_nan()))
}

/// Checks a direction in the camera frame.
pub(crate) fn direction(name: &str, v: Option<[f64; 3]>) -> PyResult<Option<[f64; 3]>> {
    let is_direction = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>() > 1e-18 && v.iter().all(|x| x.is_finite());
    match v {
        Some(v) if !is_direction(&v) => Err(errors::config(format!("{name}: three finite numbers that are not all 0"))),
        v => Ok(v),
    }
}

/// Checks a quaternion.
pub(crate) fn check_attitude(q: [f64; 4]) -> PyResult<[f64; 4]> {
    if (q.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() < 0.01 {
        return Ok(q);
    }
    Err(errors::config("attitude: a quaternion (w, x, y, z) of length 1 is expected"))
}

/// Returns the UTC of a picture in seconds since 1970, if its time is one. A smaller number counts from the begin of a
/// flight or a recording: as a UTC it would be in 1970, and would tell the wrong Sun.
pub(crate) fn utc(time_s: Option<f64>) -> Option<f64> {
    const YEAR_S: f64 = 365.0 * 86_400.0;
    time_s.filter(|time_s| !(0.0..YEAR_S).contains(time_s))
}
