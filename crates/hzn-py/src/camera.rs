//! `hzn.Camera`.

use std::path::PathBuf;

use hzn_calib::{camera_file, sensor};
use hzn_core::camera::{self, Config};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use numpy::ndarray::Array2;
use numpy::{PyArray2, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray};
use pyo3::prelude::*;

use crate::errors;

/// A lens: from directions to pixels and back.
#[pyclass(frozen, module = "hzn")]
#[derive(Clone)]
pub(crate) struct Camera {
    pub(crate) config: Config,
    lens: camera::Camera<f64>,
}

impl Camera {
    pub(crate) fn of(config: Config) -> PyResult<Self> {
        let lens = camera::Camera::try_new(&config).map_err(errors::config)?;
        Ok(Self { config, lens })
    }
}

#[pymethods]
impl Camera {
    #[staticmethod]
    fn from_toml(path: PathBuf) -> PyResult<Self> {
        Self::of(sensor::load(&path).map_err(errors::config)?.config.camera)
    }

    #[staticmethod]
    #[pyo3(signature = (path, *, camera = None))]
    fn from_kalibr(path: PathBuf, camera: Option<&str>) -> PyResult<Self> {
        Self::of(camera_file::load(&path, camera).map_err(errors::config)?)
    }

    #[staticmethod]
    fn from_opencv(path: PathBuf) -> PyResult<Self> {
        Self::of(camera_file::load(&path, None).map_err(errors::config)?)
    }

    #[getter]
    fn width(&self) -> u16 {
        self.config.width
    }
    #[getter]
    fn height(&self) -> u16 {
        self.config.height
    }
    #[getter]
    fn model(&self) -> &'static str {
        self.config.model.name()
    }
    #[getter]
    fn k(&self) -> Vec<f64> {
        self.config.k.to_vec()
    }
    /// The camera matrix.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let c = &self.config;
        numpy::ndarray::arr2(&[[c.fx_px, 0.0, c.cx_px], [0.0, c.fy_px, c.cy_px], [0.0, 0.0, 1.0]]).to_pyarray(py)
    }

    fn project<'py>(&self, py: Python<'py>, rays: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        columns(&rays, 3, "rays")?;
        let rays = rays.as_array();
        let mut out = Array2::from_elem((rays.nrows(), 2), f64::NAN);
        for (ray, mut row) in rays.outer_iter().zip(out.outer_iter_mut()) {
            let ray = UnitVec3::try_new([ray[0], ray[1], ray[2]]);
            if let Some(p) = ray.and_then(|r| self.lens.project(&r)) {
                (row[0], row[1]) = (p.u, p.v);
            }
        }
        Ok(out.to_pyarray(py))
    }

    fn unproject<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        columns(&points, 2, "points")?;
        let points = points.as_array();
        let mut out = Array2::from_elem((points.nrows(), 3), f64::NAN);
        for (point, mut row) in points.outer_iter().zip(out.outer_iter_mut()) {
            if let Some(ray) = self.lens.unproject(ImagePoint { u: point[0], v: point[1] }) {
                row.iter_mut().zip(ray.xyz()).for_each(|(slot, x)| *slot = x);
            }
        }
        Ok(out.to_pyarray(py))
    }

    fn __repr__(&self) -> String {
        let c = &self.config;
        format!("Camera({} x {} px, {}, f = {:.2} x {:.2} px)", c.width, c.height, c.model.name(), c.fx_px, c.fy_px)
    }
    fn __eq__(&self, other: &Self) -> bool {
        self.config == other.config
    }
}

fn columns(array: &PyReadonlyArray2<'_, f64>, n: usize, name: &str) -> PyResult<()> {
    match array.shape() {
        [_, have] if *have == n => Ok(()),
        shape => Err(errors::image(format!("{name}: shape (n, {n}) is expected, not {shape:?}"))),
    }
}
