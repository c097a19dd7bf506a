//! `hzn.calibrate`, `hzn.calibrate_points` and `hzn.find_corners`.

use hzn_calib::board::{self, Board, Calibrated, PlanarPoint, PlanarView, ViewResult};
use hzn_calib::corners::{self, Grey};
use hzn_calib::points::{self, Point, Points};
use hzn_core::camera::Model;
use hzn_core::image::Channel;
use numpy::ndarray::Array2;
use numpy::{PyArray2, ToPyArray};
use pyo3::prelude::*;

use crate::camera::{Camera, rows};
use crate::errors;
use crate::image::{Array, View};
use crate::numbers::Size;

#[doc = doc!("Calibration")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Calibration {
    calibrated: Calibrated,
}

#[pymethods]
impl Calibration {
    #[doc = doc!("Calibration.camera")]
    #[getter]
    fn camera(&self) -> PyResult<Camera> {
        Camera::from_config(self.calibrated.camera.clone())
    }
    #[doc = doc!("Calibration.names")]
    #[getter]
    fn names(&self) -> Vec<&'static str> {
        self.calibrated.camera.model.intrinsics().iter().map(|i| i.name()).collect()
    }
    #[doc = doc!("Calibration.values")]
    #[getter]
    fn values(&self) -> Vec<f64> {
        let camera = &self.calibrated.camera;
        camera.model.intrinsics().iter().map(|i| camera.intrinsic(*i).unwrap_or(0.0)).collect()
    }
    #[doc = doc!("Calibration.covariance")]
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let camera = &self.calibrated.camera;
        let n = camera.model.intrinsics().len();
        let at = |(i, j): (usize, usize)| camera.covariance.as_ref()?.rows.get(i)?.get(j).copied();
        Array2::from_shape_fn((n, n), |place| at(place).unwrap_or(f64::NAN)).to_pyarray(py)
    }
    #[doc = doc!("Calibration.rms_px")]
    #[getter]
    fn rms_px(&self) -> f64 {
        self.calibrated.rms_px
    }
    #[doc = doc!("Calibration.sigma_px")]
    #[getter]
    fn sigma_px(&self) -> f64 {
        self.calibrated.sigma_px
    }
    #[doc = doc!("Calibration.held_out_rms_px")]
    #[getter]
    fn held_out_rms_px(&self) -> Option<f64> {
        self.calibrated.held_out_rms_px
    }
    #[doc = doc!("Calibration.residuals_px")]
    #[getter]
    fn residuals_px<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray2<f64>>> {
        let of_view = |view: &ViewResult| {
            let r = &view.residuals;
            Array2::from_shape_fn((r.len(), 2), |(i, k)| r[i].error_px[k]).to_pyarray(py)
        };
        self.calibrated.views.iter().map(of_view).collect()
    }
    #[doc = doc!("Calibration.outliers")]
    #[getter]
    fn outliers(&self) -> Vec<Vec<usize>> {
        let of_view = |view: &ViewResult| {
            let places = view.residuals.iter().enumerate().filter(|(_, r)| !r.counts);
            places.map(|(place, _)| place).collect()
        };
        self.calibrated.views.iter().map(of_view).collect()
    }
    #[doc = doc!("Calibration.dropped")]
    #[getter]
    fn dropped(&self) -> Vec<Option<String>> {
        self.calibrated.views.iter().map(|view| view.dropped.map(|why| why.to_string())).collect()
    }
    #[doc = doc!("Calibration.warnings")]
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.calibrated.warnings.iter().map(ToString::to_string).collect()
    }

    #[doc = doc!("Calibration.to_toml")]
    fn to_toml(&self) -> PyResult<String> {
        let format = hzn_files::camera_file::Format::Sensor;
        hzn_files::camera_file::write(&self.calibrated.camera, format).map_err(errors::config)
    }

    fn __repr__(&self) -> String {
        let c = &self.calibrated;
        let used = c.views.iter().filter(|v| v.dropped.is_none()).count();
        format!(
            "Calibration({}, {used} of {} views, RMS {:.4} px, fx {:.2} px)",
            c.camera.model.name(),
            c.views.len(),
            c.rms_px,
            c.camera.fx_px
        )
    }
}

#[doc = doc!("calibrate")]
#[pyfunction]
#[pyo3(signature = (object_points, image_points, size, *, model = "kannala-brandt"))]
pub(crate) fn calibrate(
    py: Python<'_>,
    object_points: Vec<Bound<'_, PyAny>>,
    image_points: Vec<Bound<'_, PyAny>>,
    size: Size,
    model: &str,
) -> PyResult<Calibration> {
    let (model, size) = (find_model(model)?, size.in_u16()?);
    let views = paired(&object_points, &image_points, "object_points")?.map(|(n, place, at)| {
        let columns = if is_three_wide(place)? { 3 } else { 2 };
        let (places, pixels) = (rows_of_points(place, columns, "object_points")?, image_rows(at)?);
        same_length(n, places.nrows(), pixels.nrows())?;
        if columns == 3 && places.column(2).iter().any(|z| *z != 0.0) {
            return Err(errors::config(format!("object_points[{n}]: a flat target is expected, with z = 0")));
        }
        let point = |i: usize| PlanarPoint {
            place_mm: [places[(i, 0)], places[(i, 1)]],
            at_px: [pixels[(i, 0)], pixels[(i, 1)]],
        };
        Ok(PlanarView { name: n.to_string(), points: (0..places.nrows()).map(point).collect() })
    });
    let views = views.collect::<PyResult<Vec<_>>>()?;
    let calibrated = errors::detached(py, || board::calibrate_planar(model, size.into(), &views))?;
    Ok(Calibration { calibrated: calibrated.map_err(errors::config)? })
}

#[doc = doc!("calibrate_points")]
#[pyfunction]
#[pyo3(signature = (directions, image_points, size, *, model = "kannala-brandt"))]
pub(crate) fn calibrate_points(
    py: Python<'_>,
    directions: Vec<Bound<'_, PyAny>>,
    image_points: Vec<Bound<'_, PyAny>>,
    size: Size,
    model: &str,
) -> PyResult<Calibration> {
    let (model, size) = (find_model(model)?, size.in_u16()?);
    let pictures = paired(&directions, &image_points, "directions")?.map(|(n, vectors, at)| {
        let (vectors, pixels) = (rows_of_points(vectors, 3, "directions")?, image_rows(at)?);
        same_length(n, vectors.nrows(), pixels.nrows())?;
        let point = |i: usize| {
            let v = [vectors[(i, 0)], vectors[(i, 1)], vectors[(i, 2)]];
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if !(length > 0.0 && length.is_finite()) {
                return Err(errors::config(format!("directions[{n}]: row {i} is not a direction")));
            }
            Ok(Point { at_px: [pixels[(i, 0)], pixels[(i, 1)]], direction: v.map(|x| x / length) })
        };
        Ok(Points { name: n.to_string(), points: (0..vectors.nrows()).map(point).collect::<PyResult<_>>()? })
    });
    let pictures = pictures.collect::<PyResult<Vec<_>>>()?;
    let calibrated = errors::detached(py, || points::calibrate(model, size.into(), &pictures))?;
    Ok(Calibration { calibrated: calibrated.map_err(errors::config)? })
}

/// Places on the board (column, row) and in the picture (u, v).
type Corners<'py> = (Bound<'py, PyArray2<u16>>, Bound<'py, PyArray2<f64>>);

#[doc = doc!("find_corners")]
#[pyfunction]
pub(crate) fn find_corners<'py>(
    py: Python<'py>,
    picture: &Bound<'py, PyAny>,
    board: (u16, u16),
) -> PyResult<Option<Corners<'py>>> {
    let array = Array::from_object(picture)?;
    let view = array.view(None, Channel::Mean)?;
    let grey = match &view {
        View::Packed(view) => Grey::from_pixels(view),
        View::Strided(view) => Grey::from_pixels(view),
    };
    let board = Board { columns: board.0, rows: board.1, square_mm: 1.0 };
    let Ok(found) = errors::detached(py, || corners::find_corners(&grey, &board))? else { return Ok(None) };
    let c = &found.corners;
    let cells = Array2::from_shape_fn((c.len(), 2), |(i, k)| [c[i].column, c[i].row][k]);
    let places = Array2::from_shape_fn((c.len(), 2), |(i, k)| c[i].at_px[k]);
    Ok(Some((cells.to_pyarray(py), places.to_pyarray(py))))
}

fn find_model(name: &str) -> PyResult<Model> {
    Model::ALL.iter().copied().find(|m| m.name() == name).ok_or_else(|| {
        let names: Vec<&str> = Model::ALL.iter().map(|m| m.name()).collect();
        errors::config(format!("model: {name:?} is not a lens model; expected is one of {}", names.join(", ")))
    })
}

type Pair<'a, 'py> = (usize, &'a Bound<'py, PyAny>, &'a Bound<'py, PyAny>);

/// Pairs the arrays of each view.
fn paired<'a, 'py>(
    known: &'a [Bound<'py, PyAny>],
    seen: &'a [Bound<'py, PyAny>],
    name: &str,
) -> PyResult<impl Iterator<Item = Pair<'a, 'py>>> {
    if known.len() != seen.len() {
        let what = format!("{name} has {} views, but image_points has {}", known.len(), seen.len());
        return Err(errors::config(what));
    }
    Ok(known.iter().zip(seen).enumerate().map(|(n, (known, seen))| (n, known, seen)))
}

fn same_length(view: usize, known: usize, seen: usize) -> PyResult<()> {
    let what = || errors::config(format!("view {view}: {known} known points, but {seen} image points"));
    if known == seen { Ok(()) } else { Err(what()) }
}

/// Returns the rows of an array as cv2 makes them: (n, k), (n, 1, k) or (1, n, k).
fn rows_of_points(array: &Bound<'_, PyAny>, columns: usize, name: &str) -> PyResult<Array2<f64>> {
    let numpy = array.py().import("numpy")?;
    let flat = numpy.call_method1("reshape", (numpy.call_method1("asarray", (array,))?, (-1, columns)))?;
    Ok(rows(&flat, columns, name)?.as_array().to_owned())
}

fn image_rows(array: &Bound<'_, PyAny>) -> PyResult<Array2<f64>> {
    rows_of_points(array, 2, "image_points")
}

/// Returns whether the last axis of an array has three elements.
fn is_three_wide(array: &Bound<'_, PyAny>) -> PyResult<bool> {
    let shape = array.py().import("numpy")?.call_method1("shape", (array,))?;
    let shape = shape.cast_into::<pyo3::types::PyTuple>()?;
    Ok(shape.iter().next_back().is_some_and(|n| n.extract::<usize>().is_ok_and(|n| n == 3)))
}
