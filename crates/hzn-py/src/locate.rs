//! `hzn.locate`: the position of a body from limb points that were found elsewhere.

use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pipeline::edges::{Edges, Fitted};
use hzn_core::pixel::ImagePoint;
use hzn_core::{Config, Expected, Sensor, body, covariance};
use hzn_files::FrameData;
use numpy::ndarray::{arr1, arr2};
use numpy::{PyArray1, PyArray2, ToPyArray};
use pyo3::prelude::*;

use crate::camera::{Camera, rows};
use crate::errors;
use crate::prior::{check_attitude, direction};

/// How the position is fitted.
#[derive(Clone, Copy)]
enum Method {
    LeastSquares,
    GaussNewton,
    Robust,
}

impl Method {
    fn from_name(name: &str) -> PyResult<Self> {
        match name {
            "least-squares" => Ok(Self::LeastSquares),
            "gauss-newton" => Ok(Self::GaussNewton),
            "robust" => Ok(Self::Robust),
            _ => Err(errors::config(format!(
                "method: \"{name}\" is refused: must be gauss-newton, least-squares or robust"
            ))),
        }
    }
}

/// A position in kilometres and its covariance in km².
type Place = ([f64; 3], [[f64; 3]; 3]);
/// The same as arrays; None if the points do not determine a position.
type Located<'py> = Option<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>)>;

#[doc = doc!("locate")]
#[pyfunction]
#[pyo3(signature = (points, *, camera, radii_km, attitude, method = "gauss-newton", sigma_px = 1.0, lit = None))]
pub(crate) fn locate<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    camera: &Camera,
    radii_km: [f64; 3],
    attitude: [f64; 4],
    method: &str,
    sigma_px: f64,
    lit: Option<[f64; 3]>,
) -> PyResult<Located<'py>> {
    let method = Method::from_name(method)?;
    let points = limb_points(points, camera)?;
    let config = sensor_config(camera, radii_km, sigma_px)?;
    let sensor = Sensor::new(&config).map_err(errors::config)?;
    let lit = direction("lit", lit)?.and_then(UnitVec3::try_new);
    let data = FrameData {
        q_fixed_from_camera_wxyz: Some(check_attitude(attitude)?),
        attitude_sigma_deg: Some(0.0),
        ..FrameData::default()
    };
    let expected = sensor.expect(&data.to_prior(None)).map_err(errors::config)?;
    let place = errors::detached(py, || place(&sensor, &expected, &points, lit, method, sigma_px))?;
    Ok(place.map(|(r, p)| (arr1(&r).to_pyarray(py), arr2(&p).to_pyarray(py))))
}

/// Reads the points and checks that the lens sees each of them.
fn limb_points(points: &Bound<'_, PyAny>, camera: &Camera) -> PyResult<Vec<ImagePoint<f64>>> {
    let points = rows(points, 2, "points")?;
    let seen = |(i, p): (usize, numpy::ndarray::ArrayView1<'_, f64>)| {
        let point = ImagePoint { u: p[0], v: p[1] };
        let is_seen = p.iter().all(|x| x.is_finite()) && camera.lens.ray(point).is_some();
        let refused =
            || errors::image(format!("points: row {i}, ({}, {}), is not in the field of view of the lens", p[0], p[1]));
        is_seen.then_some(point).ok_or_else(refused)
    };
    points.as_array().outer_iter().enumerate().map(seen).collect()
}

/// Returns a sensor for points on the limb of an ellipsoid. The radii are those of the limb itself, and the noise is
/// white, so nothing is added to the covariance of the points.
fn sensor_config(camera: &Camera, radii_km: [f64; 3], sigma_px: f64) -> PyResult<Config> {
    if !(sigma_px > 0.0 && sigma_px.is_finite()) {
        return Err(errors::config(format!("sigma_px: {sigma_px} is refused: must be above 0 and finite")));
    }
    let body = body::Config {
        limb_height_km: 0.0,
        limb_height_sigma_km: 0.0,
        ..body::Config::of_kind(body::Kind::Ellipsoid, Some(radii_km))
    };
    Ok(Config { body, covariance: covariance::Config::given(sigma_px, 0.0), ..Config::new(camera.config.clone()) })
}

/// Returns the position, or `None` if the points do not determine it.
fn place(
    sensor: &Sensor<f64>,
    expected: &Expected<f64>,
    points: &[ImagePoint<f64>],
    lit: Option<UnitVec3<Cam, f64>>,
    method: Method,
    sigma_px: f64,
) -> Option<Place> {
    // The closed form needs no lit side, and its position is good enough to tell the sides of the points.
    let forward = UnitVec3::try_new([0.0, 0.0, 1.0])?;
    let plain = || Edges::for_body(sensor, expected, points, &forward).least_squares(expected);
    if let Method::LeastSquares = method {
        let plain = plain()?;
        let by_sigma = sigma_px * sigma_px * 1e-6;
        return Some((plain.centre_m.map(|x| x * 1e-3), plain.covariance_m2.map(|row| row.map(|x| x * by_sigma))));
    }
    let lit = lit.or_else(|| UnitVec3::try_new(plain()?.centre_m))?;
    let mut edges = Edges::for_body(sensor, expected, points, &lit);
    let fitted: Fitted<f64> = match method {
        Method::Robust => {
            let start = edges.consensus(expected, &sensor.config().consensus)?;
            edges.fit(sensor, &start, expected)?
        }
        _ => edges.fit_position(expected)?,
    };
    let position = edges.fuse(sensor, &fitted, expected)?.position?;
    let [xx, xy, xz, yy, yz, zz] = position.covariance_m2.map(|x| x * 1e-6);
    Some((position.centre_m.map(|x| x * 1e-3), [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
}
