//! The single stages, which `hzn.threshold` and its neighbours call.

use std::sync::{Mutex, MutexGuard, PoisonError};

use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pipeline::edges::{ConsensusCone, Edges, Fitted};
use hzn_core::pixel::{ImagePoint, Pixel};
use numpy::ndarray::{Array1, Array2, arr1, arr2};
use numpy::{AllowTypeChange, PyArray1, PyArray2, PyArrayLike1, ToPyArray};
use pyo3::prelude::*;

use crate::camera::rows;
use crate::errors;
use crate::expected::Expected;
use crate::image::{Array, View};
use crate::sensor::Sensor;

/// A NumPy array with two axes.
type Array2d<'py> = Bound<'py, PyArray2<f64>>;

#[doc = doc!("Cone")]
#[pyclass(frozen, subclass, module = "hzn.consensus")]
pub(crate) struct Cone(ConsensusCone<f64>);

#[pymethods]
impl Cone {
    #[new]
    fn new(axis: [f64; 3], cos_half_angle: f64) -> PyResult<Self> {
        let axis =
            UnitVec3::<Cam, f64>::try_new(axis).ok_or_else(|| errors::config("axis: must be finite and not zero"))?;
        if !(cos_half_angle.abs() < 1.0) {
            return Err(errors::config(format!(
                "cos_half_angle: {cos_half_angle} is refused: must be between -1 and 1"
            )));
        }
        Ok(Self(ConsensusCone { axis, cos_half_angle, draws: 0, all: false }))
    }
    #[doc = doc!("Cone.axis")]
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        arr1(&self.0.axis.xyz()).to_pyarray(py)
    }
    #[doc = doc!("Cone.cos_half_angle")]
    #[getter]
    fn cos_half_angle(&self) -> f64 {
        self.0.cos_half_angle
    }
    #[doc = doc!("Cone.draws")]
    #[getter]
    fn draws(&self) -> u32 {
        self.0.draws
    }
    fn __repr__(&self) -> String {
        let [x, y, z] = self.0.axis.xyz();
        format!("Cone([{x:.6}, {y:.6}, {z:.6}], half-angle {:.4} deg)", self.0.cos_half_angle.acos().to_degrees())
    }
}

#[doc = doc!("Fit")]
#[pyclass(frozen, extends = Cone, module = "hzn.fit")]
pub(crate) struct Fit(Fitted<f64>);

#[pymethods]
impl Fit {
    #[doc = doc!("Fit.rms_px")]
    #[getter]
    fn rms_px(&self) -> f64 {
        self.0.rms_px()
    }
    #[doc = doc!("Fit.inliers")]
    #[getter]
    fn inliers(&self) -> u32 {
        self.0.inliers()
    }
}

#[doc = doc!("Rays")]
#[pyclass(frozen, module = "hzn.rays")]
pub(crate) struct Rays(Mutex<Edges<f64>>);

impl Rays {
    fn new(edges: Edges<f64>) -> Self {
        Self(Mutex::new(edges))
    }
    fn edges(&self) -> MutexGuard<'_, Edges<f64>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Rays {
    #[doc = doc!("Rays.points")]
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> Array2d<'py> {
        let points: Vec<[f64; 2]> = self.edges().points().map(|(p, _)| [p.u, p.v]).collect();
        arr2(&points).to_pyarray(py)
    }
    #[doc = doc!("Rays.lit")]
    #[getter]
    fn lit<'py>(&self, py: Python<'py>) -> Array2d<'py> {
        let lit: Vec<[f64; 2]> = self.edges().points().map(|(_, lit)| lit.map(f64::from)).collect();
        arr2(&lit).to_pyarray(py)
    }
    #[doc = doc!("Rays.directions")]
    #[getter]
    fn directions<'py>(&self, py: Python<'py>) -> Array2d<'py> {
        let rays: Vec<[f64; 3]> = self.edges().rays().collect();
        arr2(&rays).to_pyarray(py)
    }
    #[doc = doc!("Rays.weights")]
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.edges().weights().collect::<Array1<f64>>().to_pyarray(py)
    }
    #[setter]
    fn set_weights(&self, weights: &Bound<'_, PyAny>) -> PyResult<()> {
        let n = self.__len__();
        let given: PyArrayLike1<'_, f64, AllowTypeChange> =
            weights.extract().map_err(|_| errors::config(format!("weights: shape ({n},) is expected")))?;
        let given: Vec<f64> = given.as_array().iter().copied().collect();
        if given.len() != n || given.iter().any(|w| !(0.0..=1.0).contains(w)) {
            return Err(errors::config(format!("weights: {n} numbers from 0 to 1 are expected")));
        }
        self.edges().set_weights(&given);
        Ok(())
    }
    fn __len__(&self) -> usize {
        self.edges().points().len()
    }
}

/// Reads the array as a picture of this sensor and passes it on, packed or strided.
macro_rules! with_picture {
    ($image:expr, $state:expr, $bits:expr, |$picture:ident| $work:expr) => {{
        let array = Array::from_object($image)?;
        $state.check_size(&array)?;
        let input = &$state.config.input;
        match array.view(array.bits($bits, input), input.channel)? {
            View::Packed($picture) => $work,
            View::Strided($picture) => $work,
        }
    }};
}

#[pyfunction]
#[pyo3(name = "_level", signature = (sensor, image, expected, bits = None))]
pub(crate) fn find_threshold(
    sensor: &Sensor,
    image: &Bound<'_, PyAny>,
    expected: &Expected,
    bits: Option<u8>,
) -> PyResult<u16> {
    let state = sensor.state();
    let core = state.core()?;
    let found = with_picture!(image, state, bits, |picture| core.level(&picture, &expected.core));
    found.map(|l| l.level).map_err(|status| errors::other(format!("no threshold: {}", status.name())))
}

/// Returns every edge of a picture at a threshold, with at least `edge_points.min_points` border pixels, in the order
/// in which the sensor examines them.
#[pyfunction]
#[pyo3(name = "_borders", signature = (sensor, image, level, expected, bits = None))]
pub(crate) fn find_borders<'py>(
    py: Python<'py>,
    sensor: &Sensor,
    image: &Bound<'py, PyAny>,
    level: u16,
    expected: &Expected,
    bits: Option<u8>,
) -> PyResult<Vec<Array2d<'py>>> {
    let state = sensor.state();
    let core = state.core()?;
    let borders = with_picture!(image, state, bits, |picture| core.borders(&picture, level, &expected.core));
    let table = |border: &Vec<Pixel>| {
        let cell = |(i, k): (usize, usize)| f64::from(if k == 0 { border[i].x } else { border[i].y });
        Array2::from_shape_fn((border.len(), 2), cell).to_pyarray(py)
    };
    Ok(borders.iter().map(table).collect())
}

#[pyfunction]
#[pyo3(name = "_pick", signature = (sensor, image, level, border, bits = None))]
pub(crate) fn locate_points(
    sensor: &Sensor,
    image: &Bound<'_, PyAny>,
    level: u16,
    border: &Bound<'_, PyAny>,
    bits: Option<u8>,
) -> PyResult<Rays> {
    let state = sensor.state();
    let core = state.core()?;
    let border = rows(border, 2, "border")?;
    let region = (f64::from(state.config.camera.width), f64::from(state.config.camera.height));
    let pixel = |r: numpy::ndarray::ArrayView1<'_, f64>| {
        let inside = (0.0..region.0).contains(&r[0]) && (0.0..region.1).contains(&r[1]);
        inside.then_some(Pixel { x: r[0] as u16, y: r[1] as u16 })
    };
    let border: Option<Vec<Pixel>> = border.as_array().outer_iter().map(pixel).collect();
    let border = border.ok_or_else(|| errors::image("border: a pixel lies outside the picture"))?;
    Ok(Rays::new(with_picture!(image, state, bits, |picture| Edges::pick(core, &picture, level, &border))))
}

#[pyfunction]
#[pyo3(name = "_rays")]
pub(crate) fn to_rays(sensor: &Sensor, points: &Bound<'_, PyAny>, lit: &Bound<'_, PyAny>) -> PyResult<Rays> {
    let state = sensor.state();
    let (points, lit) = (rows(points, 2, "points")?, rows(lit, 2, "lit")?);
    if points.as_array().nrows() != lit.as_array().nrows() {
        return Err(errors::image("lit: must have one row for each point"));
    }
    let both: Vec<_> = points
        .as_array()
        .outer_iter()
        .zip(lit.as_array().outer_iter())
        .map(|(p, l)| (ImagePoint { u: p[0], v: p[1] }, [l[0], l[1]]))
        .collect();
    Ok(Rays::new(Edges::towards(state.core()?.camera(), &both)))
}

#[pyfunction]
#[pyo3(name = "_keep")]
pub(crate) fn find_consensus(
    py: Python<'_>,
    sensor: &Sensor,
    rays: &Rays,
    expected: &Expected,
) -> PyResult<Option<Cone>> {
    let state = sensor.state();
    state.core()?;
    Ok(errors::detached(py, || rays.edges().consensus(&expected.core, &state.config.consensus))?.map(Cone))
}

#[pyfunction]
#[pyo3(name = "_withdraw")]
pub(crate) fn exclude_body(sensor: &Sensor, rays: &Rays, found: &Cone) -> PyResult<u32> {
    let state = sensor.state();
    state.core()?;
    Ok(rays.edges().withdraw(&found.0.axis, found.0.cos_half_angle, &state.config.consensus))
}

#[pyfunction]
#[pyo3(name = "_fit")]
pub(crate) fn fit_cone(
    py: Python<'_>,
    sensor: &Sensor,
    rays: &Rays,
    start: &Cone,
    expected: &Expected,
) -> PyResult<Option<Py<Fit>>> {
    let state = sensor.state();
    let core = state.core()?;
    let fitted = errors::detached(py, || rays.edges().fit(core, &start.0, &expected.core))?;
    let cone = |f: &Fitted<f64>| ConsensusCone { axis: f.axis(), cos_half_angle: f.cos_half_angle(), ..start.0 };
    let fit = |f: Fitted<f64>| Py::new(py, PyClassInitializer::from(Cone(cone(&f))).add_subclass(Fit(f)));
    fitted.map(fit).transpose()
}

/// Axis, covariance and cosine of the half-angle; None if the points do not determine them.
type Fused<'py> = Option<(Bound<'py, PyArray1<f64>>, Array2d<'py>, f64)>;

#[pyfunction]
#[pyo3(name = "_fuse")]
pub(crate) fn fuse_half_angle<'py>(
    py: Python<'py>,
    sensor: &Sensor,
    rays: &Rays,
    fit: &Bound<'py, Cone>,
    expected: &Expected,
) -> PyResult<Fused<'py>> {
    let state = sensor.state();
    let core = state.core()?;
    let mut edges = rays.edges();
    let fitted = match fit.cast::<Fit>() {
        Ok(fit) => Some(fit.get().0),
        Err(_) => edges.fit_at(&fit.get().0.axis, fit.get().0.cos_half_angle),
    };
    let fused = fitted.and_then(|fit| edges.fuse(core, &fit, &expected.core));
    Ok(fused.map(|f| (arr1(&f.axis.xyz()).to_pyarray(py), arr2(&f.covariance.rows()).to_pyarray(py), f.cos_half_angle)))
}
