//! Compares with reference data from independent sources (`tests/golden/`, origin in the README there) and with Monte
//! Carlo runs on edge points. The tests are here because the stages between an edge point and an answer are not public.

mod dense;
#[cfg(feature = "dlr")]
mod dlr;
mod ellipsoid;
mod fits;
#[cfg(feature = "horace")]
mod horace;
mod lens;
mod monte_carlo;
#[cfg(feature = "position")]
mod position;
#[cfg(feature = "position")]
mod position_runs;
mod projection;
mod uneven;
#[cfg(feature = "zju")]
mod zju;

use crate::base::linalg::{V3, basis, invert_spd2, unit};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::{Camera, Config as CameraConfig, Model};
use crate::geometry::ellipsoid::LimbCone;
use crate::geometry::frames::{Cam, Cov3, Fixed, Rotation, UnitVec3};
use crate::geometry::pixel::ImagePoint;
use crate::model::body::{self, Expected, Prior};
use crate::model::work::WorkBudget;
use crate::pipeline::edges::Edges;
use crate::stages::consensus;
use crate::stages::covariance;
use crate::stages::fit::{self, HalfAngle};
use serde_json::Value;
use std::vec::Vec;

fn load(text: &str) -> Vec<Value> {
    serde_json::from_str::<Value>(text).unwrap()["cases"].as_array().unwrap().clone()
}
fn num(v: &Value) -> f64 {
    v.as_f64().unwrap()
}
fn triple(v: &Value) -> [f64; 3] {
    core::array::from_fn(|i| num(&v[i]))
}
fn rows(v: &Value) -> [[f64; 3]; 3] {
    core::array::from_fn(|i| triple(&v[i]))
}
fn camera_config(v: &Value) -> CameraConfig {
    let model = match v["model"].as_str().unwrap() {
        "pinhole" => Model::Pinhole,
        _ => Model::Equidistant,
    };
    let (w, h) = (num(&v["width"]) as u16, num(&v["height"]) as u16);
    CameraConfig {
        fx_px: num(&v["fx"]),
        fy_px: num(&v["fy"]),
        cx_px: num(&v["cx"]),
        cy_px: num(&v["cy"]),
        ..CameraConfig::ideal(model, w, h, 1.0)
    }
}
fn direction<T: Real>(v: [f64; 3]) -> UnitVec3<Cam, T> {
    UnitVec3::try_new(v.map(T::from_f64)).unwrap()
}

/// Makes edge points as the stage `edge_points` does. The lit side is the side of the axis `e`.
fn blocks<T: Real>(camera: &Camera<T>, points: &[(f64, f64)], e: &UnitVec3<Cam, T>) -> Vec<Block<T>> {
    let points: Vec<_> = points.iter().map(|&(u, v)| ImagePoint { u: T::from_f64(u), v: T::from_f64(v) }).collect();
    Edges::new(camera, &points, e).blocks
}

/// Returns the quaternion (scalar first) of a rotation matrix whose rows map camera to ECEF.
fn quaternion(r: &[[f64; 3]; 3]) -> [f64; 4] {
    let m = nalgebra::Matrix3::from_fn(|i, j| r[i][j]);
    let q = nalgebra::UnitQuaternion::from_matrix(&m);
    [q.w, q.i, q.j, q.k]
}

struct Answer<T> {
    axis: UnitVec3<Cam, T>,
    covariance: Cov3<Cam, T>,
    p: [T; 3],
    inliers: u32,
}

fn solve<T: Real>(
    camera: &Camera<T>,
    points: &[(f64, f64)],
    lit_towards: &UnitVec3<Cam, T>,
    expected: &Expected<T>,
    half_angle: HalfAngle,
    sigma_px: f64,
    correlation_px: f64,
) -> Option<Answer<T>> {
    let mut blocks = blocks(camera, points, lit_towards);
    let config = consensus::Config::default();
    let (fx, _) = camera.focal_px();
    let start = consensus::find(
        &mut blocks,
        points.len() as u32,
        expected,
        fx,
        consensus::Threshold::from_config(&config),
        &config,
        &mut WorkBudget::unlimited(),
    )?;
    let estimate = fit::Config { half_angle, ..Default::default() };
    let noise = covariance::Config::given(sigma_px, correlation_px);
    let fit = fit::fit(&mut blocks, &start, expected, camera, T::from_f64(config.threshold_px), &estimate, &noise)?;
    let fused = covariance::fuse(&blocks, &fit, expected, &noise, &estimate, camera, None)?;
    let (b1, b2) = basis(&fused.e);
    Some(Answer {
        axis: UnitVec3::assume_unit(fused.e),
        covariance: Cov3::from_tangent(&b1, &b2, fused.p),
        p: fused.p,
        inliers: fit.inliers,
    })
}

fn sphere(altitude_m: f64, radius_m: f64, limb_sigma_km: f64) -> (body::Config, Prior<f64>) {
    let body = body::Config {
        kind: body::Kind::Sphere,
        radius_km: Some(radius_m / 1e3),
        altitude_sigma_km: 0.0,
        limb_height_km: 0.0,
        limb_height_sigma_km: limb_sigma_km,
        ..body::Config::default()
    };
    (body, Prior { altitude_m: Some(altitude_m), ..Prior::default() })
}

fn single<T: Real>(frame: &Prior<f64>) -> Prior<T> {
    Prior { altitude_m: frame.altitude_m.map(T::from_f64), ..Prior::default() }
}

/// Approximately normal random numbers for the Monte Carlo runs: sums of twelve uniform ones.
struct Gauss(crate::base::rng::Rng);
impl Gauss {
    fn next(&mut self) -> f64 {
        (0..12).map(|_| f64::from(self.0.below(1 << 24)) / f64::from(1 << 24)).sum::<f64>() - 6.0
    }
}

/// Returns points of the limb in view, in order, one per `step_px` along it.
fn limb(camera: &Camera<f64>, e: &UnitVec3<Cam, f64>, c: f64, step_px: f64) -> Vec<(f64, f64)> {
    let (b1, b2) = basis(e.v());
    let s = libm::sqrt(1.0 - c * c);
    in_view(camera, step_px, |azimuth| {
        let (sp, cp) = libm::sincos(azimuth);
        UnitVec3::assume_unit(e.v() * c + (b1 * cp + b2 * sp) * s)
    })
}

/// Returns the points in view of a curve that has a ray for each azimuth, in order, one per `step_px` along it.
fn in_view(camera: &Camera<f64>, step_px: f64, ray: impl Fn(f64) -> UnitVec3<Cam, f64>) -> Vec<(f64, f64)> {
    let inside = |p: &ImagePoint<f64>| {
        p.u >= 0.0 && p.v >= 0.0 && p.u <= f64::from(camera.width()) - 1.0 && p.v <= f64::from(camera.height()) - 1.0
    };
    let mut points: Vec<(f64, f64)> = Vec::new();
    for i in 0..40_000 {
        let d = ray(f64::from(i) * core::f64::consts::TAU / 40_000.0);
        let Some(p) = camera.project(&d).filter(inside) else { continue };
        let far = points.last().is_none_or(|q| libm::hypot(p.u - q.0, p.v - q.1) >= step_px);
        if far {
            points.push((p.u, p.v));
        }
    }
    // The list starts after the longest gap, so that it follows the limb once.
    let gap = (0..points.len())
        .max_by(|&i, &j| {
            let d = |i: usize| {
                let (a, b) = (points[i], points[(i + 1) % points.len()]);
                libm::hypot(a.0 - b.0, a.1 - b.1)
            };
            d(i).total_cmp(&d(j))
        })
        .unwrap();
    let first = (gap + 1) % points.len();
    points.rotate_left(first);
    points
}

/// Returns the camera of math §5.1 and nadir: 1920×1080, 94.4° horizontal field of view, 20° below the horizontal.
fn rocket_camera() -> (Camera<f64>, UnitVec3<Cam, f64>) {
    let camera = Camera::try_new(&CameraConfig::ideal(Model::Pinhole, 1920, 1080, 888.97)).unwrap();
    let tilt = 20f64.to_radians();
    (camera, direction([0.0, libm::cos(tilt), libm::sin(tilt)]))
}

#[test]
fn workspaces_fit_their_budgets() {
    // The flight computer has 96 KiB next to the picture, which must also hold the stack.
    assert!(size_of::<crate::pipeline::FlightHorizon>() < 92 * 1024, "{}", size_of::<crate::pipeline::FlightHorizon>());
    assert!(size_of::<crate::pipeline::HostHorizon>() < 1536 * 1024, "{}", size_of::<crate::pipeline::HostHorizon>());
}
