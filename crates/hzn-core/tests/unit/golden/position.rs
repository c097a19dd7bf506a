//! The position of an ellipsoid: against mpmath (`ellipsoid_position.json`), in both precisions.

use super::*;
use crate::model::body::Target;
use crate::pipeline::Sensor;
use crate::stages::covariance::consider::Sensitivity;
use crate::stages::covariance::position;
use crate::stages::fit::{Fit, closed, fit_position_from};

type M3 = nalgebra::Matrix3<f64>;
type Vec3 = nalgebra::Vector3<f64>;

/// One case: its sensor, its body in scaled space, and the truth.
struct Case<T> {
    value: Value,
    sensor: Sensor<T>,
    expected: Expected<T>,
    truth_km: Vec3,
    sigma_range_km: f64,
    sigma_px: f64,
}

impl<T: Real> Case<T> {
    fn new(value: Value) -> Self {
        let (camera, f) = (&value["camera"], num(&value["camera"]["f_px"]));
        let model = if camera["model"] == "pinhole" { Model::Pinhole } else { Model::Equidistant };
        let theta_max_deg = (model == Model::Equidistant).then_some(170.0);
        // The points lie about the principal point at (0, 0), and only the distance from it matters.
        let config =
            CameraConfig { cx_px: 0.0, cy_px: 0.0, theta_max_deg, ..CameraConfig::ideal(model, 65_000, 65_000, f) };
        let mut config = crate::Config::new(config);
        config.body = body::Config {
            limb_height_km: 0.0,
            limb_height_sigma_km: 0.0,
            ..body::Config::of_kind(body::Kind::Ellipsoid, Some(triple(&value["semi_axes_km"])))
        };
        config.covariance = covariance::Config::given(num(&value["sigma_px"]), 0.0);
        let sensor = Sensor::new(&config).unwrap();
        let camera_from_fixed = rows(&value["camera_from_body"]);
        let fixed_from_camera: [[f64; 3]; 3] =
            core::array::from_fn(|i| core::array::from_fn(|j| camera_from_fixed[j][i]));
        let attitude =
            Rotation::<Cam, Fixed, T>::assume_from_quaternion(quaternion(&fixed_from_camera).map(T::from_f64));
        let prior = Prior { fixed_from_camera: attitude, attitude_sigma_rad: Some(T::ZERO), ..Prior::default() };
        let expected = sensor.expect(&prior).unwrap();
        Self {
            truth_km: Vec3::from(triple(&value["r_km"])),
            sigma_range_km: num(&value["crlb"]["sigma_range_km"]),
            sigma_px: num(&value["sigma_px"]),
            value,
            sensor,
            expected,
        }
    }

    fn target(&self) -> &Target<T> {
        self.expected.target.as_ref().unwrap()
    }

    /// Makes the points in scaled space, exact or with the noise of the file.
    fn blocks(&self, noisy: bool) -> Vec<Block<T>> {
        let camera = self.sensor.camera_for(&self.expected).unwrap();
        let pixels = self.value["pixels"].as_array().unwrap();
        let point = |i: usize| {
            let noise = if noisy { [0, 1].map(|k| num(&self.value["noise_px"][i][k])) } else { [0.0; 2] };
            (num(&pixels[i][0]) + noise[0], num(&pixels[i][1]) + noise[1])
        };
        let points: Vec<_> = (0..pixels.len()).map(point).collect();
        let axis = UnitVec3::<Cam, T>::try_new((self.truth_km / self.truth_km.norm()).map(T::from_f64).into()).unwrap();
        let lit = UnitVec3::assume_unit(self.target().scaling.scale(axis.v()));
        blocks(&camera, &points, &lit)
    }

    fn centre_km(&self, e: &V3<T>, k: T) -> Vec3 {
        let k = k.to_f64();
        let r = self.target().scaling.from * e * self.target().unit_m;
        r.map(|x| x.to_f64()) / (k * (2.0 - k)).sqrt() / 1e3
    }

    /// Converts a covariance of (δ₁₂, δc) to one of the position, km².
    fn covariance_km2(&self, fit: &Fit<T>, blocks: &[Block<T>]) -> M3 {
        let noise = covariance::Config::given(self.sigma_px, 0.0);
        let estimate = fit::Config::default();
        let camera = self.sensor.camera_for(&self.expected).unwrap();
        let fused = covariance::fuse(blocks, fit, &self.expected, &noise, &estimate, &camera, None).unwrap();
        let p = fused.located.unwrap().free_p * (self.target().unit_m * self.target().unit_m);
        p.map(|x| x.to_f64() * 1e-6)
    }
}

fn cases<T: Real>() -> Vec<Case<T>> {
    load(include_str!("../../golden/ellipsoid_position.json")).into_iter().map(Case::new).collect()
}

fn matrix(v: &Value) -> M3 {
    let r = rows(v);
    M3::from_fn(|i, j| r[i][j])
}

#[test]
fn exact_rays_give_the_position() {
    for case in cases::<f64>() {
        let (id, mut blocks) = (&case.value["id"], case.blocks(false));
        let off = |(e, k): (V3<f64>, f64)| (case.centre_km(&e, k) - case.truth_km).norm() / case.truth_km.norm();
        let (ls, gtls) = (closed::least_squares(&blocks).unwrap(), closed::generalised_tls(&blocks).unwrap());
        let fit = fit_position_from(&mut blocks, ls, &case.target().scaling).unwrap();
        let errors = [off(ls), off(gtls), off((fit.e, fit.k))];
        assert!(errors[0] < 1e-11 && errors[1] < 1e-7 && errors[2] < 1e-11, "{id}: {errors:?}");
    }
}

#[test]
fn noisy_rays_give_the_reference_of_each_method() {
    for case in cases::<f64>() {
        let (id, mut blocks) = (&case.value["id"], case.blocks(true));
        let off = |(e, k): (V3<f64>, f64), name: &str| {
            (case.centre_km(&e, k) - Vec3::from(triple(&case.value[name]["r_km"]))).norm() / case.sigma_range_km
        };
        let (ls, gtls) = (closed::least_squares(&blocks).unwrap(), closed::generalised_tls(&blocks).unwrap());
        let fit = fit_position_from(&mut blocks, gtls, &case.target().scaling).unwrap();
        let errors = [off(ls, "cra"), off(gtls, "generalised_tls"), off((fit.e, fit.k), "gauss_newton")];
        assert!(errors[0] < 1e-6 && errors[1] < 1e-4 && errors[2] < 1e-3, "{id}: {errors:?}");
        let rms = num(&case.value["gauss_newton"]["rms_px"]);
        assert!((fit.rms_px / rms - 1.0).abs() < 0.05, "{id}: {} {rms}", fit.rms_px);
        // (13.6) at the noisy rays, to first order.
        let (found, reference) = (case.covariance_km2(&fit, &blocks), matrix(&case.value["gauss_newton"]["cov_km2"]));
        let scale = (case.sigma_px / fit.rms_px).powi(2).min(1.0);
        assert!((found * scale - reference).norm() / reference.norm() < 0.02, "{id}: {found} {reference}");
    }
}

#[test]
fn the_covariance_of_least_squares_is_that_of_christian_and_robinson() {
    for case in cases::<f64>() {
        let blocks = case.blocks(true);
        let points: Vec<_> = (0..case.value["pixels"].as_array().unwrap().len())
            .map(|i| {
                let at = |k: usize| num(&case.value["pixels"][i][k]) + num(&case.value["noise_px"][i][k]);
                ImagePoint { u: at(0), v: at(1) }
            })
            .collect();
        let lit = UnitVec3::try_new(case.truth_km.into()).unwrap();
        let edges = Edges::for_body(&case.sensor, &case.expected, &points, &lit);
        assert_eq!(edges.blocks.len(), blocks.len());
        let plain = edges.least_squares(&case.expected).unwrap();
        let found = M3::from_fn(|i, j| plain.covariance_m2[i][j]) * (case.sigma_px * case.sigma_px * 1e-6);
        let reference = matrix(&case.value["cra"]["cov_km2"]);
        let off = (found - reference).norm() / reference.norm();
        assert!(off < 1e-6, "{}: {off:e}", case.value["id"]);
    }
}

#[test]
fn limb_height_and_attitude_move_the_position_as_the_reference_says() {
    for case in cases::<f64>() {
        let mut blocks = case.blocks(false);
        let start = closed::least_squares(&blocks).unwrap();
        let fit = fit_position_from(&mut blocks, start, &case.target().scaling).unwrap();
        let target = case.target();
        let given = Sensitivity::new(&blocks, &fit, target).unwrap();
        let sin = (fit.k * (2.0 - fit.k)).sqrt();
        let g = position::by_cone(target, &fit.e, sin, fit.c);
        // The signs are truth − estimate, and the signal is the observed limb minus the model.
        let by_limb = -(g * given.by_limb);
        let reference = Vec3::from(triple(&case.value["sensitivity"]["limb_height"]));
        assert!((by_limb - reference).norm() / reference.norm() < 2e-6, "{}: {by_limb} {reference}", case.value["id"]);
        let found = M3::from_columns(&given.by_rotation.map(|v| g * -v)) * (target.unit_m / 1e3);
        let reference = matrix(&case.value["sensitivity"]["attitude_km_per_rad"]);
        let off = (found - reference).norm() / reference.norm().max(case.truth_km.norm() * 1e-9);
        assert!(off < 2e-6, "{}: {off:e} {found} {reference}", case.value["id"]);
    }
}

#[test]
fn a_known_distance_is_fused_to_convergence() {
    for case in cases::<f64>() {
        let prior = &case.value["range_prior"];
        let unit_km = case.target().unit_m / 1e3;
        let r = Vec3::from(triple(&case.value["gauss_newton"]["r_km"])) / unit_km;
        let p = matrix(&case.value["gauss_newton"]["cov_km2"]) / (unit_km * unit_km);
        let free = covariance::Located { r, p, common: p, free_r: r, free_p: p, turn: None };
        let mut target = *case.target();
        target.set_range(num(&prior["r0_km"]) * 1e3, num(&prior["sigma_km"]) * 1e3);
        let sigma = num(&prior["sigma_km"]) / unit_km;
        let (found, _) = position::with_range(&free, &target, sigma).unwrap();
        let off = (found.r * unit_km - Vec3::from(triple(&prior["r_km"]))).norm() / num(&prior["sigma_km"]);
        assert!(off < 1e-4, "{}: {off:e}", case.value["id"]);
        let reference = matrix(&prior["cov_km2"]);
        let off = (found.p * (unit_km * unit_km) - reference).norm() / reference.norm();
        assert!(off < 1e-4, "{}: {off:e}", case.value["id"]);
        // Here the whole error is common, before and after the fusion; the two are computed by different equations.
        let off = (found.common - found.p).norm() / found.p.norm();
        assert!(off < 1e-6, "{}: {off:e}", case.value["id"]);
    }
}

/// In single precision the angle keeps a small disc: the error stays far below the sigma of the range.
#[test]
fn single_precision_is_as_good_as_its_own_sigma() {
    for case in cases::<f32>() {
        let mut blocks = case.blocks(true);
        let Some(start) = closed::least_squares(&blocks) else { panic!("{}", case.value["id"]) };
        let fit = fit_position_from(&mut blocks, start, &case.target().scaling).unwrap();
        let off = case.centre_km(&fit.e, fit.k) - Vec3::from(triple(&case.value["gauss_newton"]["r_km"]));
        assert!(off.norm() < 0.2 * case.sigma_range_km, "{}: {}", case.value["id"], off.norm() / case.sigma_range_km);
    }
}
