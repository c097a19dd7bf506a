//! `hzn.Camera`.

use std::path::{Path, PathBuf};

use hzn_core::camera::{self, Config, Model, Ray};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_files::{camera_file, plausible, sensor};
use numpy::ndarray::{Array2, Array3, ArrayView2, Axis};
use numpy::{AllowTypeChange, PyArray2, PyArray3, PyArrayLike2, PyUntypedArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::numbers::Size;
use crate::{errors, parameters};

#[doc = doc!("Camera")]
#[pyclass(frozen, module = "hzn")]
#[derive(Clone)]
pub(crate) struct Camera {
    pub(crate) config: Config,
    pub(crate) lens: camera::Camera<f64>,
}

impl Camera {
    pub(crate) fn from_config(config: Config) -> PyResult<Self> {
        let lens = camera::Camera::try_new(&config).map_err(errors::config)?;
        Ok(Self { config, lens })
    }

    fn from_keys(py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let sections = PyDict::new(py);
        sections.set_item("camera", keys.map_or_else(|| PyDict::new(py), Clone::clone))?;
        Self::from_config(parameters::config(&sections)?.camera)
    }

    /// Returns the camera after a warning for each value that looks wrong, for example if width and height are swapped.
    fn warned(self, py: Python<'_>) -> PyResult<Self> {
        let doubts = plausible::find_implausible(&hzn_core::Config::new(self.config.clone()));
        doubts.iter().try_for_each(|doubt| errors::warn(py, format_args!("{}: {}", doubt.key, doubt.what)))?;
        Ok(self)
    }

    /// Reads a camera file, and passes its doubts on as warnings.
    fn from_file(py: Python<'_>, path: &Path, camera: Option<&str>) -> PyResult<Self> {
        let choice = camera_file::Choice { camera, size_px: None };
        let read = camera_file::load_any(path, choice).and_then(|read| read.exact(path));
        let (config, doubts) = read.map_err(errors::config)?;
        doubts.iter().try_for_each(|doubt| errors::warn(py, format_args!("{doubt}")))?;
        Self::from_config(config)?.warned(py)
    }

    /// Returns `then` of the ray of each of n points. A row is NaN outside the field of view of the lens or if `then`
    /// is `None`.
    fn each_ray<'py, const N: usize>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        then: impl Fn(&Ray<f64>) -> Option<[f64; N]> + Sync,
    ) -> PyResult<Array2<f64>> {
        let points = rows(points, 2, "points")?;
        let points = points.as_array();
        errors::detached(py, || map_rows(points, |p| then(&self.lens.ray(ImagePoint { u: p[0], v: p[1] })?)))
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (**keys))]
    fn new(py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        Self::from_keys(py, keys)?.warned(py)
    }

    #[doc = doc!("Camera.from_toml")]
    #[staticmethod]
    fn from_toml(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::from_config(sensor::load(&path).map_err(errors::config)?.config.camera)?.warned(py)
    }

    #[doc = doc!("Camera.from_kalibr")]
    #[staticmethod]
    #[pyo3(signature = (path, *, camera = None))]
    fn from_kalibr(py: Python<'_>, path: PathBuf, camera: Option<&str>) -> PyResult<Self> {
        Self::from_file(py, &path, camera)
    }

    #[doc = doc!("Camera.from_opencv")]
    #[staticmethod]
    #[pyo3(signature = (source, distortion = None, *, size = None, fisheye = false))]
    fn from_opencv(
        source: &Bound<'_, PyAny>,
        distortion: Option<&Bound<'_, PyAny>>,
        size: Option<Size>,
        fisheye: bool,
    ) -> PyResult<Self> {
        if let Ok(path) = source.extract::<PathBuf>() {
            return Self::from_file(source.py(), &path, None);
        }
        let matrix = rows(source, 3, "camera matrix");
        let matrix = matrix.ok().filter(|matrix| matrix.as_array().nrows() == 3).ok_or_else(|| {
            let what = "camera matrix: three rows of three numbers are expected: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]";
            errors::config(what)
        })?;
        let m = matrix.as_array();
        let rows: [f64; 9] = core::array::from_fn(|i| m[(i / 3, i % 3)]);
        let [fx_px, fy_px, cx_px, cy_px] =
            camera_file::camera_matrix(rows).map_err(|what| errors::config(format!("camera matrix: {what}")))?;
        let Some(size) = size else {
            return Err(errors::config("size: is required with a camera matrix; pass size=(width, height)"));
        };
        let (width, height) = size.in_u16()?;
        let k: Vec<f64> = match distortion {
            Some(d) => d.py().import("numpy")?.call_method1("ravel", (d,))?.call_method0("tolist")?.extract()?,
            None => Vec::new(),
        };
        let model = match (fisheye, k.len()) {
            (true, 0..=4) => Model::KannalaBrandt,
            (false, 0) => Model::Pinhole,
            (false, 4 | 5) => Model::BrownConrady,
            (_, n) => {
                let allowed = if fisheye { "up to 4 (fisheye)" } else { "4 or 5 (k1, k2, p1, p2, k3)" };
                return Err(errors::config(format!("distortion: {n} coefficients; {allowed} are expected")));
            }
        };
        if let Some(bad) = k.iter().find(|k| !k.is_finite()) {
            return Err(errors::config(format!("distortion: {bad} is not a finite number")));
        }
        let ideal = Config::ideal(model, width, height, fx_px);
        let k = k.into_iter().collect();
        Self::from_config(Config { fx_px, fy_px, cx_px, cy_px, k, ..ideal })?.warned(source.py())
    }

    #[doc = doc!("Camera.parameters")]
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        parameters::to_python(py, &self.config)
    }
    #[doc = doc!("Camera.width")]
    #[getter]
    fn width(&self) -> u16 {
        self.config.width
    }
    #[doc = doc!("Camera.height")]
    #[getter]
    fn height(&self) -> u16 {
        self.config.height
    }
    #[doc = doc!("Camera.model")]
    #[getter]
    fn model(&self) -> &'static str {
        self.config.model.name()
    }
    #[doc = doc!("Camera.k")]
    #[getter]
    fn k(&self) -> Vec<f64> {
        self.config.k.to_vec()
    }
    #[doc = doc!("Camera.matrix")]
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let c = &self.config;
        numpy::ndarray::arr2(&[[c.fx_px, 0.0, c.cx_px], [0.0, c.fy_px, c.cy_px], [0.0, 0.0, 1.0]]).to_pyarray(py)
    }

    #[doc = doc!("Camera.project")]
    fn project<'py>(&self, py: Python<'py>, rays: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rays = rows(rays, 3, "rays")?;
        let rays = rays.as_array();
        let pixel = |ray: &[f64]| {
            let p = self.lens.project(&UnitVec3::try_new([ray[0], ray[1], ray[2]])?)?;
            Some([p.u, p.v])
        };
        Ok(errors::detached(py, || map_rows(rays, pixel))?.to_pyarray(py))
    }

    #[doc = doc!("Camera.unproject")]
    fn unproject<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(self.each_ray(py, points, |ray| Some(ray.direction().xyz()))?.to_pyarray(py))
    }

    #[doc = doc!("Camera.undistort_points")]
    fn undistort_points<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let plane = |ray: &Ray<f64>| {
            let [x, y, z] = ray.direction().xyz();
            (z > 0.0).then(|| [x / z, y / z])
        };
        Ok(self.each_ray(py, points, plane)?.to_pyarray(py))
    }

    #[doc = doc!("Camera.jacobian")]
    fn jacobian<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let flat = self.each_ray(py, points, |ray| {
            let [[a, b], [c, d], [e, f]] = ray.jacobian();
            Some([a, b, c, d, e, f])
        })?;
        Ok(to_jacobians(&flat).to_pyarray(py))
    }

    fn __repr__(&self) -> String {
        let c = &self.config;
        format!("Camera({} x {} px, {}, f = {:.2} x {:.2} px)", c.width, c.height, c.model.name(), c.fx_px, c.fy_px)
    }
    fn __eq__(&self, other: &Self) -> bool {
        self.config == other.config
    }
    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (Py<PyAny>,))> {
        let make = slf.get_type().getattr("_of")?.unbind();
        Ok((make, (slf.get().parameters(slf.py())?.unbind(),)))
    }
    #[staticmethod]
    fn _of(keys: &Bound<'_, PyDict>) -> PyResult<Self> {
        Self::from_keys(keys.py(), Some(keys))
    }
}

/// Converts an object to an array of shape (n, `columns`), as NumPy would.
pub(crate) fn rows<'py>(
    object: &Bound<'py, PyAny>,
    columns: usize,
    name: &str,
) -> PyResult<PyArrayLike2<'py, f64, AllowTypeChange>> {
    let wrong = |shape: String| errors::image(format!("{name}: shape (n, {columns}) is expected, not {shape}"));
    let array: PyArrayLike2<'py, f64, AllowTypeChange> = object.extract().map_err(|_| {
        let shape = object.py().import("numpy").and_then(|np| np.call_method1("shape", (object,)));
        wrong(shape.map_or_else(|e| e.to_string(), |s| s.to_string()))
    })?;
    match array.shape() {
        [_, have] if *have == columns => Ok(array),
        shape => Err(wrong(format!("{shape:?}"))),
    }
}

/// Returns N numbers for each row, or NaN where `then` returns `None`.
pub(crate) fn map_rows<const N: usize>(
    rows: ArrayView2<'_, f64>,
    then: impl Fn(&[f64]) -> Option<[f64; N]>,
) -> Array2<f64> {
    let mut out = Array2::from_elem((rows.nrows(), N), f64::NAN);
    let mut row = vec![0.0; rows.ncols()];
    for (from, mut to) in rows.outer_iter().zip(out.outer_iter_mut()) {
        row.iter_mut().zip(from).for_each(|(slot, x)| *slot = *x);
        if let Some(values) = then(&row) {
            to.iter_mut().zip(values).for_each(|(slot, x)| *slot = x);
        }
    }
    out
}

/// Reshapes (n, 6) to (n, 3, 2).
pub(crate) fn to_jacobians(flat: &Array2<f64>) -> Array3<f64> {
    Array3::from_shape_fn((flat.len_of(Axis(0)), 3, 2), |(i, j, k)| flat[(i, 2 * j + k)])
}
