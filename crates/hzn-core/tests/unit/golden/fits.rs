//! Compares the fits with scipy, and finds a limb among outliers.

use super::*;

/// Compares with `nadir_cases.json`, which has maximum-likelihood fits by scipy.
fn nadir<T: Real>(noise_free_deg: f64) {
    let (mut noisy, mut clean) = (0, 0);
    for case in load(include_str!("../../golden/nadir_cases.json")) {
        let camera = Camera::<T>::try_new(&camera_config(&case["camera"])).unwrap();
        let outlier: Vec<bool> = case["is_outlier"]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_i64() == Some(1) || v.as_bool() == Some(true))
            .collect();
        let points: Vec<(f64, f64)> =
            case["pixels"].as_array().unwrap().iter().map(|p| (num(&p[0]), num(&p[1]))).collect();
        let truth = direction::<T>(triple(&case["true_nadir_c"]));
        let (body, frame) = sphere(num(&case["altitude_m"]), num(&case["earth_radius_m"]), 0.1);
        let expected = Expected::new(&body, &single::<T>(&frame)).unwrap();
        let sigma = num(&case["noise_sigma_px"]);
        let inliers: Vec<(f64, f64)> = points.iter().zip(&outlier).filter(|(_, o)| !**o).map(|(p, _)| *p).collect();
        let reference = &case["reference"];
        for (which, key) in [(HalfAngle::Known, "known_alpha_nadir_c"), (HalfAngle::Free, "free_alpha_nadir_c")] {
            let want = direction::<T>(triple(&reference[key]));
            // The reference gives all inliers the same weight, as does the fit without robust weights.
            let got = plain(&camera, &inliers, &truth, &expected, which);
            let off = got.angle_rad(&want).to_f64().to_degrees();
            let limit = if sigma == 0.0 {
                clean += 1;
                noise_free_deg
            } else if which == HalfAngle::Free {
                3e-3
            } else if case["gauss_markov_L_px"].is_null() {
                noisy += 1;
                0.03 * num(&reference["white_crlb_known_alpha_deg"])
            } else {
                1e-3
            };
            assert!(off < limit.max(noise_free_deg), "{} {key}: {off:e} > {limit:e}", case["id"]);
        }
        // With the outliers included, the error of the whole chain stays within the noise.
        if outlier.iter().any(|o| *o) {
            let answer = solve(&camera, &points, &truth, &expected, HalfAngle::Known, sigma.max(0.1), 0.0).unwrap();
            let off = answer.axis.angle_rad(&truth).to_f64().to_degrees();
            let bound = reference["white_crlb_known_alpha_deg"].as_f64().unwrap_or(0.05);
            assert!(off < 6.0 * bound, "{}: {off} with outliers, bound {bound}", case["id"]);
            assert!(f64::from(answer.inliers) > 0.8 * inliers.len() as f64);
        }
    }
    assert!(noisy >= 5 && clean >= 4, "{noisy} {clean}");
}

/// Fits all points with equal weights, from a start that is two degrees off.
fn plain<T: Real>(
    camera: &Camera<T>,
    points: &[(f64, f64)],
    truth: &UnitVec3<Cam, T>,
    expected: &Expected<T>,
    which: HalfAngle,
) -> UnitVec3<Cam, T> {
    let mut blocks = blocks(camera, points, truth);
    let (b1, _) = basis(truth.v());
    let start = consensus::Consensus {
        e: unit(&(truth.v() + b1 * T::from_f64(0.03))).unwrap(),
        c: expected.cos,
        draws: 0,
        all: false,
    };
    let estimate = fit::Config { half_angle: which, ..Default::default() };
    // With this wide threshold all of Tukey's weights are one.
    let fit =
        fit::fit(&mut blocks, &start, expected, camera, T::from_f64(1e5), &estimate, &covariance::Config::default())
            .unwrap();
    UnitVec3::assume_unit(fit.e)
}

#[test]
fn fits_equal_scipy() {
    nadir::<f64>(1e-6);
    nadir::<f32>(1e-5);
}

/// With 80 % of the points anywhere in the picture, two-point draws find the limb.
#[test]
fn eighty_percent_outliers() {
    let (camera, e) = rocket_camera();
    let (body, frame) = sphere(120e3, 6_371_008.8, 0.5);
    let expected = Expected::new(&body, &frame).unwrap();
    let exact = limb(&camera, &e, expected.cos, 1.0);
    let mut rng = crate::base::rng::Rng::new(3);
    let mut gauss = Gauss(crate::base::rng::Rng::new(4));
    let mut found = 0;
    let runs = 200;
    for _ in 0..runs {
        let mut points: Vec<(f64, f64)> = (0..400)
            .map(|i| {
                if i % 5 == 0 {
                    let (u, v) = exact[rng.below(exact.len() as u32) as usize];
                    (u + 0.3 * gauss.next(), v + 0.3 * gauss.next())
                } else {
                    (f64::from(rng.below(1920)), f64::from(rng.below(1080)))
                }
            })
            .collect();
        for i in (1..points.len()).rev() {
            points.swap(i, rng.below(i as u32 + 1) as usize);
        }
        let answer = solve(&camera, &points, &e, &expected, HalfAngle::Known, 0.3, 0.0);
        found += u32::from(answer.is_some_and(|a| a.axis.angle_rad(&e).to_degrees() < 0.3));
    }
    assert!(found * 100 >= runs * 99, "{found} of {runs}");
}
