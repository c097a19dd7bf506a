//! What the results tell a filter about the limb height: the axis of the free fit, and the derivative of the axis.

use hzn_core::report::Free;
use hzn_core::{Config, Prior, Solution};
use hzn_host::Compiled;
use hzn_sim::flight;
use hzn_tests::Sensors;
use nalgebra::{Matrix3, Vector3};

fn vector(v: [f64; 3]) -> Vector3<f64> {
    Vector3::from(v)
}

fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

/// Returns the answer and the cosine of the expected half-angle. The Sun is high, so that no term is added after the
/// fusion.
fn answer(config: &Config, picture: &hzn_sim::Picture, prior: &Prior<f64>) -> (Solution<f64>, f64) {
    let mut sensor = Sensors::new(config).host;
    let prior = Prior { sun_elevation_rad: Some(core::f64::consts::FRAC_PI_2), ..*prior };
    let expected = sensor.expect(&prior).unwrap();
    let report = sensor.find(picture.view(), &expected);
    (report.solution.expect("the limb is in view"), expected.half_angle_rad().cos())
}

#[test]
fn the_axis_moves_with_the_limb_height_as_the_derivative_says() {
    let flown = flight::rocket(960, 540, 12, 4171);
    let mut compared = 0;
    for frame in flown.frames.iter().skip(1).step_by(2) {
        let (picture, prior) = (frame.render().unwrap(), frame.prior());
        let mut config = flown.sensor.clone();
        let (told, cos) = answer(&config, &picture, &prior);
        config.body.limb_height_km += 0.5;
        let (higher, cos_higher) = answer(&config, &picture, &prior);
        let by_cos = vector(told.axis_by_cos.unwrap());
        let predicted = by_cos * (cos_higher - cos);
        let moved = vector(higher.axis.xyz()) - vector(told.axis.xyz());
        // The gates on the residuals may choose slightly different points.
        let size = predicted.norm();
        assert!((moved - predicted).norm() < 0.1 * size + 2e-6, "{}: {moved} instead of {predicted}", frame.file);
        compared += usize::from(size > 1e-4);

        // The fusion itself: axis = unit(axis_free + by_cos (c₀ − ĉ)), and the covariance loses k kᵀ (P₃₃ + σ_c²).
        let Free { axis, covariance, cos: fitted, var_cos, .. } = told.free.unwrap();
        let fused = (vector(axis.xyz()) + by_cos * (cos - fitted)).normalize();
        assert!((fused - vector(told.axis.xyz())).norm() < 1e-12);
        let gain = matrix(covariance.rows()) - matrix(told.covariance.rows());
        let s = gain.trace() / by_cos.norm_squared();
        assert!(s > var_cos, "{s} {var_cos}");
        let expected = by_cos * by_cos.transpose() * s;
        assert!((gain - expected).norm() < 0.02 * expected.norm(), "{gain} {expected}");
    }
    assert!(compared >= 3, "the derivative is too small in most pictures to be tested: {compared}");
}

#[test]
fn a_free_half_angle_has_no_derivative() {
    let flown = flight::rocket(640, 360, 3, 4172);
    let frame = &flown.frames[1];
    let mut config = flown.sensor.clone();
    config.fit.half_angle = hzn_core::fit::HalfAngle::Free;
    let (told, _) = answer(&config, &frame.render().unwrap(), &frame.prior());
    assert_eq!(told.axis_by_cos, Some([0.0; 3]));
    assert_eq!(told.free.unwrap().covariance.upper_rad2, told.covariance.upper_rad2);
    config.fit.half_angle = hzn_core::fit::HalfAngle::Known;
    let (told, _) = answer(&config, &frame.render().unwrap(), &frame.prior());
    assert!(told.free.is_none() && vector(told.axis_by_cos.unwrap()).norm() > 0.0);
}
