//! Compares the effect of a wrong calibration on a fit with the effect that the covariance predicts.

use super::*;
use crate::geometry::camera::{Covariance, Intrinsic};
use crate::stages::covariance::{ErrorBudget, Noise, Term};
use std::vec;

/// Returns lenses with their names, the half-angle of the limb in degrees, and the axis in the camera frame.
fn scenes() -> Vec<(&'static str, CameraConfig, f64, [f64; 3])> {
    let rocket = CameraConfig {
        fx_px: 1235.0,
        fy_px: 1231.0,
        cx_px: 963.2,
        cy_px: 536.7,
        k: [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect(),
        theta_max_deg: Some(54.0),
        ..CameraConfig::ideal(Model::KannalaBrandt, 1920, 1080, 1.0)
    };
    let brown = CameraConfig {
        k: [-0.1, 0.02, 5e-4, -3e-4, 0.0].into_iter().collect(),
        ..CameraConfig::ideal(Model::BrownConrady, 1280, 960, 1000.0)
    };
    let infrared =
        CameraConfig { theta_max_deg: Some(110.0), ..CameraConfig::ideal(Model::Equidistant, 384, 288, 92.0) };
    vec![
        ("rocket", rocket, 80.0, [0.1, 0.97, 0.15]),
        ("pinhole", CameraConfig::ideal(Model::Pinhole, 1280, 960, 1000.0), 75.0, [-0.3, 0.85, 0.2]),
        ("brown", brown, 75.0, [0.2, 0.9, 0.25]),
        ("infrared", infrared.clone(), 66.0, [0.1, 0.4, 0.9]),
        ("infrared, far off nadir", infrared, 66.0, [0.5, 0.8, 0.1]),
    ]
}

/// Fits points of the lens `right` with the lens `used` and a free half-angle. Returns axis, cos and error budget.
fn fitted(
    right: &CameraConfig,
    used: &CameraConfig,
    half_angle_deg: f64,
    towards: [f64; 3],
) -> (V3<f64>, f64, ErrorBudget<f64>) {
    let e = direction::<f64>(towards);
    let points = limb(&Camera::try_new(right).unwrap(), &e, libm::cos(half_angle_deg.to_radians()), 2.0);
    let camera = Camera::<f64>::try_new(used).unwrap();
    let altitude = 6_371_008.8 / libm::sin(half_angle_deg.to_radians()) - 6_371_008.8;
    let (body, frame) = sphere(altitude, 6_371_008.8, 300.0);
    let expected = Expected::new(&body, &frame).unwrap();
    let mut blocks = blocks(&camera, &points, &e);
    let config = consensus::Config { threshold_px: 30.0, ..consensus::Config::default() };
    let (fx, _) = camera.focal_px();
    let start = consensus::find(
        &mut blocks,
        points.len() as u32,
        &expected,
        fx,
        consensus::Threshold::from_config(&config),
        &config,
        &mut WorkBudget::unlimited(),
    )
    .unwrap();
    let estimate = fit::Config { half_angle: HalfAngle::Free, ..Default::default() };
    let noise = covariance::Config::given(0.1, 60.0);
    let fit = fit::fit(&mut blocks, &start, &expected, &camera, 30.0, &estimate, &noise).unwrap();
    let mut budget = ErrorBudget::new();
    covariance::fuse(&blocks, &fit, &expected, &noise, &estimate, &camera, Some(&mut budget)).unwrap();
    (fit.e, fit.c, budget)
}

/// Returns the relative difference between the outer product of the shift (δ₁₂, δc) that the other lens makes, and the
/// lens term of the covariance.
fn difference(right: &CameraConfig, used: &CameraConfig, half_angle_deg: f64, towards: [f64; 3]) -> f64 {
    let exact = CameraConfig { focal_sigma_percent: 0.0, centre_sigma_px: 0.0, covariance: None, ..right.clone() };
    let (e0, c0, _) = fitted(&exact, &exact, half_angle_deg, towards);
    // The shift is linearised at the fit with the other lens.
    let (e1, c1, budget) = fitted(&exact, used, half_angle_deg, towards);
    let (b1, b2) = basis(&e1);
    let off = e1 - e0;
    let shift = V3::new(off.dot(&b1), off.dot(&b2), c1 - c0);
    let p = budget.fit_term(Term::Lens);
    (shift * shift.transpose() - p).norm() / p.norm()
}

#[test]
fn a_wrong_focal_length_moves_the_fit_as_the_covariance_says() {
    for (name, right, half_angle_deg, towards) in scenes() {
        for percent in [0.3, 1.0] {
            let scale = 1.0 + percent * 0.01;
            let used = CameraConfig {
                fx_px: right.fx_px * scale,
                fy_px: right.fy_px * scale,
                focal_sigma_percent: percent,
                ..right.clone()
            };
            let off = difference(&right, &used, half_angle_deg, towards);
            // The difference is that of squares, twice that of the shift, for which 2 % are allowed.
            assert!(off < 0.04, "{name} {percent} %: {off}");
        }
    }
}

#[test]
fn so_do_the_principal_point_and_the_coefficients() {
    for (name, right, half_angle_deg, towards) in scenes() {
        let one = |order: &[Intrinsic], sigma: f64| {
            let rows = [heapless::Vec::from_slice(&[sigma * sigma]).unwrap()];
            Some(Covariance {
                order: heapless::Vec::from_slice(order).unwrap(),
                rows: heapless::Vec::from_slice(&rows).unwrap(),
            })
        };
        let moved =
            CameraConfig { cx_px: right.cx_px + 1.5, covariance: one(&[Intrinsic::CxPx], 1.5), ..right.clone() };
        let off = difference(&right, &moved, half_angle_deg, towards);
        assert!(off < 0.04, "{name} cx: {off}");
        if matches!(right.model, Model::KannalaBrandt | Model::BrownConrady) {
            let mut other = right.clone();
            if let Some(k) = other.k.first_mut() {
                *k += 1e-3;
            }
            other.covariance = one(&[Intrinsic::K1], 1e-3);
            let off = difference(&right, &other, half_angle_deg, towards);
            assert!(off < 0.06, "{name} k1: {off}");
        }
    }
}

#[test]
fn a_full_covariance_beats_the_scalars_and_says_the_same_where_it_is_the_same() {
    let (_, right, half_angle_deg, towards) = scenes().swap_remove(0);
    let scalar = CameraConfig { focal_sigma_percent: 0.5, centre_sigma_px: 2.0, ..right.clone() };
    let order = [Intrinsic::CyPx, Intrinsic::FyPx, Intrinsic::FxPx, Intrinsic::CxPx];
    let (fx, fy) = (0.005 * right.fx_px, 0.005 * right.fy_px);
    let rows = [[4.0, 0.0, 0.0, 0.0], [0.0, fy * fy, fx * fy, 0.0], [0.0, fx * fy, fx * fx, 0.0], [0.0, 0.0, 0.0, 4.0]];
    let full = CameraConfig {
        focal_sigma_percent: 50.0,
        covariance: Some(Covariance {
            order: heapless::Vec::from_slice(&order).unwrap(),
            rows: rows.iter().map(|row| heapless::Vec::from_slice(row).unwrap()).collect(),
        }),
        ..right.clone()
    };
    let [a, b] =
        [scalar, full.clone()].map(|used| *fitted(&right, &used, half_angle_deg, towards).2.fit_term(Term::Lens));
    assert!((a - b).norm() < 1e-9 * a.norm(), "{a} {b}");

    let refused = |change: &dyn Fn(&mut Covariance)| {
        let mut config = full.clone();
        config.covariance.iter_mut().for_each(change);
        Camera::<f64>::try_new(&config).unwrap_err().field
    };
    assert_eq!(refused(&|c| c.rows[0][1] = 1.0), "camera.covariance.rows");
    assert_eq!(refused(&|c| c.rows[0][0] = -1.0), "camera.covariance.rows");
    assert_eq!(refused(&|c| (c.rows[1][2], c.rows[2][1]) = (2.0 * fx * fy, 2.0 * fx * fy)), "camera.covariance.rows");
    assert_eq!(refused(&|c| c.rows[3][3] = f64::NAN), "camera.covariance.rows");
    assert_eq!(refused(&|c| drop(c.rows.pop())), "camera.covariance.rows");
    assert_eq!(refused(&|c| c.order[0] = Intrinsic::FyPx), "camera.covariance.order");
    assert_eq!(refused(&|c| c.order[0] = Intrinsic::P1), "camera.covariance.order");
}

/// Fails if the parts of a budget do not add up to the covariance, or all but the errors of the edge points not to its
/// common part.
fn assert_parts_add_up(name: &str, budget: &ErrorBudget<f64>, fused: &covariance::Fused<f64>) {
    let (mut sum, mut shared) = ([0.0; 6], [0.0; 6]);
    for term in Term::ALL {
        let part = budget.covariance(term).upper_rad2;
        sum.iter_mut().zip(part).for_each(|(s, x)| *s += x);
        // Only the errors of the edge points are new in the next picture.
        let shared = shared.iter_mut().filter(|_| term != Term::EdgeNoise);
        shared.zip(part).for_each(|(s, x)| *s += x);
    }
    let (n1, n2) = basis(&fused.e);
    let whole = Cov3::<Cam, f64>::from_tangent(&n1, &n2, fused.p).upper_rad2;
    let scale = whole[0] + whole[3] + whole[5];
    let common = Cov3::<Cam, f64>::from_tangent(&n1, &n2, fused.common.unwrap()).upper_rad2;
    for (parts, fused) in [(sum, whole), (shared, common)] {
        for (s, w) in parts.iter().zip(fused) {
            // The tangent planes before and after the fusion are some hundredths of a degree apart.
            assert!((s - w).abs() < 0.01 * scale, "{name}: {parts:?} {fused:?}");
        }
    }
    assert!(common[0] + common[3] + common[5] < scale, "{name}: {common:?} {whole:?}");
}

/// The parts of all sources add up to the whole covariance. Measured noise never gives a smaller covariance than the
/// told noise.
#[test]
fn the_budget_adds_up_and_measured_noise_has_the_told_as_floor() {
    for (name, right, half_angle_deg, towards) in scenes() {
        let used = CameraConfig { focal_sigma_percent: 0.1, centre_sigma_px: 0.3, ..right };
        let camera = Camera::<f64>::try_new(&used).unwrap();
        let e = direction::<f64>(towards);
        let altitude = 6_371_008.8 / libm::sin(half_angle_deg.to_radians()) - 6_371_008.8;
        let expected = Expected::new(
            &body::Config::default(),
            &Prior { altitude_m: Some(altitude.max(30e3)), ..Prior::default() },
        )
        .unwrap();
        let mut gauss = Gauss(crate::base::rng::Rng::new(3));
        let points: Vec<_> = limb(&camera, &e, expected.cos, 2.0)
            .into_iter()
            .map(|(u, v)| (u + 0.3 * gauss.next(), v + 0.3 * gauss.next()))
            .collect();
        let config = consensus::Config::default();
        let (fx, _) = camera.focal_px();
        let estimate = fit::Config::default();
        let mut told = None;
        for noise in [Noise::Given, Noise::Rms] {
            let mut blocks = blocks(&camera, &points, &e);
            let mut work = WorkBudget::unlimited();
            let (threshold, count) = (consensus::Threshold::from_config(&config), points.len() as u32);
            let start = consensus::find(&mut blocks, count, &expected, fx, threshold, &config, &mut work).unwrap();
            let noise = covariance::Config { noise, ..Default::default() };
            let fit = fit::fit(&mut blocks, &start, &expected, &camera, 3.0, &estimate, &noise).unwrap();
            let mut budget = ErrorBudget::new();
            let fused =
                covariance::fuse(&blocks, &fit, &expected, &noise, &estimate, &camera, Some(&mut budget)).unwrap();
            assert_parts_add_up(name, &budget, &fused);
            let floor: [f64; 3] = *told.get_or_insert(fused.p);
            let more = [fused.p[0] - floor[0], fused.p[1] - floor[1], fused.p[2] - floor[2]];
            let slack = 1e-3 * (floor[0] + floor[2]);
            assert!(more[0] > -slack && more[2] > -slack, "{name}: {floor:?} {:?}", fused.p);
        }
    }
}
