//! Compares the lens with OpenCV and mpmath.

use super::*;

/// Compares with `kb_lens.json`, which comes from OpenCV 5.0 fisheye and mpmath.
fn lens<T: Real>(tolerance_rad: f64, tolerance_px: f64) {
    for case in load(include_str!("../../golden/kb_lens.json")) {
        let k: Vec<f64> = case["k"].as_array().unwrap().iter().map(num).collect();
        let limit = case["monotonic_limit_deg"].as_f64();
        // The cases end at 112°. A lens with a monotone limit is compared up to 2° before this limit.
        let theta_max = limit.map_or(112.0, |l| (l - 2.0).min(112.0));
        let config = CameraConfig {
            fx_px: num(&case["fx"]),
            fy_px: num(&case["fy"]),
            cx_px: num(&case["cx"]),
            cy_px: num(&case["cy"]),
            k: heapless::Vec::from_slice(&k).unwrap(),
            theta_max_deg: Some(theta_max),
            ..CameraConfig::ideal(Model::KannalaBrandt, 8000, 8000, 1.0)
        };
        let camera = Camera::<T>::try_new(&config).unwrap();
        let mut compared = 0;
        let mut check = |ray: &Value, pixel: &Value| {
            let d = direction::<T>(triple(ray));
            let p = ImagePoint { u: T::from_f64(num(&pixel[0])), v: T::from_f64(num(&pixel[1])) };
            let Some(back) = camera.unproject(p) else { return };
            assert!(
                back.angle_rad(&d).to_f64() < tolerance_rad,
                "{} {p:?}: {:e}",
                case["name"],
                back.angle_rad(&d).to_f64()
            );
            if let Some(q) = camera.project(&d) {
                assert!((q.u - p.u).abs().to_f64() < tolerance_px && (q.v - p.v).abs().to_f64() < tolerance_px);
            }
            compared += 1;
        };
        for (ray, pixel) in case["rays"].as_array().unwrap().iter().zip(case["pixels"].as_array().unwrap()) {
            check(ray, pixel);
        }
        for far in case["beyond"].as_array().unwrap() {
            if far["monotone_up_to_here"].as_bool().unwrap() && num(&far["theta_deg"]) < theta_max {
                check(&far["ray"], &far["pixel"]);
            }
        }
        assert!(compared >= 15, "{} only {compared}", case["name"]);
        if let Some(limit) = limit {
            let error = Camera::<T>::try_new(&CameraConfig { theta_max_deg: Some((limit - 1.0).min(175.0)), ..config })
                .unwrap_err();
            let crate::base::error::Limit::Monotone(got) = error.limit else { panic!("{error}") };
            assert!((got - limit).abs() < 1e-3, "{}: {got} {limit}", case["name"]);
        }
    }
}
#[test]
fn kannala_brandt_equals_opencv() {
    // The tolerance is 1e-10 rad because the pixels are printed to about 1e-13 of their value.
    lens::<f64>(1e-10, 1e-9);
    lens::<f32>(2e-6, 2e-3);
}
