//! Compares the methods of Braun & Barf 2022 with reference data, and the correct form of each equation with the
//! printed erratum.

use super::*;
use crate::base::linalg::{M3, symmetric_eigen};
use crate::model::work::WorkBudget;
use crate::stages::covariance::braun_barf;
use crate::stages::fit::{conic, direct};

/// Compares with `nadir_cases.json`: (24) by scipy, with inliers only and pinholes only.
fn directions<T: Real>(tolerance_deg: f64) {
    let mut compared = 0;
    for case in load(include_str!("../../golden/nadir_cases.json")) {
        if case["reference"]["eq24_direction_c"].is_null() {
            continue;
        }
        let camera = Camera::<T>::try_new(&camera_config(&case["camera"])).unwrap();
        let points: Vec<(f64, f64)> = case["pixels"]
            .as_array()
            .unwrap()
            .iter()
            .zip(case["is_outlier"].as_array().unwrap())
            .filter(|(_, o)| o.as_i64() != Some(1) && o.as_bool() != Some(true))
            .map(|(p, _)| (num(&p[0]), num(&p[1])))
            .collect();
        let truth = direction::<T>(triple(&case["true_nadir_c"]));
        let (e, c) = direct::fit(&blocks(&camera, &points, &truth)).unwrap();
        let want = direction::<T>(triple(&case["reference"]["eq24_direction_c"]));
        let off = UnitVec3::<Cam, T>::assume_unit(e).angle_rad(&want).to_f64().to_degrees();
        assert!(off < tolerance_deg, "{}: {off:e}", case["id"]);
        if num(&case["noise_sigma_px"]) == 0.0 {
            // The length of the vector gives the half-angle without any assumption: the paper's "needs α" does not
            // hold.
            assert!((c.to_f64() - num(&case["cos_alpha"])).abs() < 1e-6, "{}: {c}", case["id"]);
        }
        compared += 1;
    }
    assert!(compared >= 8, "{compared}");
}

#[test]
fn direct_nadir_equals_scipy() {
    directions::<f64>(1e-9);
    directions::<f32>(1e-4);
}

/// Equation (13) has five coefficients in pixels, r = κ₁θ + κ₂θ³ + κ₃θ⁵ + κ₄θ⁷ + κ₅θ⁹. The same lens has f = κ₁, and
/// the other four are divided by κ₁. Equation (16) gives the point on the image plane by tan θ and ends at 90°; rays do
/// not.
#[test]
fn five_coefficients_are_a_focal_length_and_four() {
    let kappa = [1235.0, -67.9, 13.6, -4.3, 0.25];
    let config = CameraConfig {
        k: kappa[1..].iter().map(|k| k / kappa[0]).collect(),
        theta_max_deg: Some(100.0),
        ..CameraConfig::ideal(Model::KannalaBrandt, 6000, 6000, kappa[0])
    };
    let camera = Camera::<f64>::try_new(&config).unwrap();
    for deg in [0.0, 20.0, 54.0, 89.9, 90.1, 99.0] {
        let theta = f64::to_radians(deg);
        let (s, c) = libm::sincos(theta);
        let d = direction::<f64>([0.6 * s, 0.8 * s, c]);
        let p = camera.project(&d).unwrap();
        let radius: f64 = (0..5i32).zip(kappa).map(|(j, k)| k * theta.powi(2 * j + 1)).sum();
        assert!((p.u - config.cx_px - 0.6 * radius).abs() < 1e-9 && (p.v - config.cy_px - 0.8 * radius).abs() < 1e-9);
        assert!(camera.unproject(p).unwrap().angle_rad(&d) < 1e-11);
        // The printed inverse, with the correct side of the ray chosen by hand.
        let printed = direction::<f64>([0.6 * libm::tan(theta), 0.8 * libm::tan(theta), 1.0]);
        assert_eq!(printed.angle_rad(&d) < 1e-6, deg < 90.0, "{deg}");
    }
}

/// Compares with `covariance.json`: (33) by dense matrices, with the paper's correlation by sample and with ours by
/// distance.
fn covariances<T: Real>(tolerance: f64) {
    let mut compared = 0;
    for case in load(include_str!("../../golden/covariance.json")) {
        let camera = Camera::<T>::try_new(&camera_config(&case["camera"])).unwrap();
        let points: Vec<(f64, f64)> =
            case["pixels"].as_array().unwrap().iter().map(|p| (num(&p[0]), num(&p[1]))).collect();
        let e = direction::<T>(triple(&case["nadir_c"]));
        let length = num(&case["L_px"]);
        for form in ["eq33", "eq33_arc"] {
            // The form of the paper is for pinholes only.
            if case[form].is_null() {
                continue;
            }
            compared += 1;
            let mut blocks = blocks(&camera, &points, &e);
            for (i, step) in case["step_px"].as_array().unwrap().iter().enumerate() {
                let step = match form {
                    "eq33" => -length * libm::log(1.0 - 1.0 / length),
                    _ => num(step),
                };
                blocks[(i + 1) / LANES].step_px[(i + 1) % LANES] = T::from_f64(step);
            }
            let got =
                braun_barf::covariance(&blocks, e.v(), T::from_f64(length)).unwrap() * T::from_f64(num(&case["R_px2"]));
            let want = rows(&case[form]["P_c"]);
            let scale = want.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
            for i in 0..3 {
                for j in 0..3 {
                    let off = (got[(i, j)].to_f64() - want[i][j]).abs() / scale;
                    assert!(off < tolerance, "{} {form} [{i}][{j}]: {off:e}", case["id"]);
                }
            }
            let [bound, zero, same] = braun_barf::project(&got, e.v(), true);
            if form == "eq33" {
                assert!((bound.to_f64() / num(&case[form]["lambda_max"]) - 1.0).abs() < tolerance);
            }
            assert!(zero == T::ZERO && same == bound);
            // No variance across the axis is larger than the overbound.
            let [a, b, d] = braun_barf::project(&got, e.v(), false);
            assert!(a > T::ZERO && a * d > b * b && a + d < (bound + bound) * T::from_f64(1.0001));
        }
    }
    assert_eq!(compared, 6);
}

#[test]
fn braun_barf_covariance_equals_the_dense_product() {
    covariances::<f64>(1e-9);
    covariances::<f32>(1e-4);
}

/// As printed, (35) assumes that the points are one pixel apart. With the 16 px of the golden cases the variance is too
/// small by a factor above 3.
#[test]
fn correlation_by_sample_is_not_that_by_distance() {
    let case = &load(include_str!("../../golden/covariance.json"))[0];
    let (printed, right) = (rows(&case["eq33"]["P_c"]), rows(&case["eq33_arc"]["P_c"]));
    assert!(right[1][1] / printed[1][1] > 3.0);
}

/// Camera, nadir in the camera frame, cos α, points of the limb.
type Rocket = (Camera<f64>, UnitVec3<Cam, f64>, f64, Vec<(f64, f64)>);

/// Returns a pinhole camera 20° below the horizontal, and the exact limb that it sees from 120 km.
fn rocket() -> Rocket {
    let camera = Camera::try_new(&CameraConfig::ideal(Model::Pinhole, 1920, 1080, 888.97)).unwrap();
    let tilt = 20f64.to_radians();
    let e = direction([0.1, libm::cos(tilt), libm::sin(tilt)]);
    let sin: f64 = 6_371_008.8 / (6_371_008.8 + 120e3);
    let c = libm::sqrt(1.0 - sin * sin);
    let points = limb(&camera, &e, c, 3.0);
    (camera, e, c, points)
}

/// Compares both forms of the left side of (29), the printed one and the correct one, with the numerical derivative of
/// the equation's value with respect to its edge point.
#[test]
fn error_of_an_equation_follows_from_that_of_its_point() {
    let (_, e, c, _) = rocket();
    let e = V3::from(e.xyz());
    let p = V3::new(0.3, -0.35, 1.0);
    let value = |p: &V3<f64>| c * p.norm() - p.dot(&e);
    let right = p * (c / p.norm()) - e;
    // As printed, the left side is δpᵀ e, whose derivative is e.
    let printed = e;
    for k in 0..2 {
        let mut step = V3::new(0.0, 0.0, 0.0);
        step[k] = 1e-6;
        let central = (value(&(p + step)) - value(&(p - step))) / 2e-6;
        assert!((central - right[k]).abs() < 1e-8);
        assert!((central - printed[k]).abs() > 1e-2);
    }
}

/// Equation (33) with raw pixels ignores the lens: through a fisheye it differs from the measured errors.
#[test]
fn covariance_goes_through_the_lens() {
    let camera = Camera::<f64>::try_new(&CameraConfig::ideal(Model::Equidistant, 1200, 900, 500.0)).unwrap();
    let e = direction::<f64>([0.05, 0.8, 0.6]);
    let sin: f64 = 6371.0 / (6371.0 + 800.0);
    let c = libm::sqrt(1.0 - sin * sin);
    let exact = limb(&camera, &e, c, 3.0);
    let mut gauss = Gauss(crate::base::rng::Rng::new(5));
    let (sigma, runs) = (0.05, 200);
    let mut measured = M3::zeros();
    for _ in 0..runs {
        let points: Vec<(f64, f64)> =
            exact.iter().map(|p| (p.0 + sigma * gauss.next(), p.1 + sigma * gauss.next())).collect();
        let (got, got_c) = direct::fit(&blocks(&camera, &points, &e)).unwrap();
        let off = got * (c / got_c) - V3::from(e.xyz());
        measured += off * off.transpose() / f64::from(runs);
    }
    let mut claimed = braun_barf::covariance(&blocks(&camera, &exact, &e), e.v(), 0.0).unwrap() * (sigma * sigma);
    let ratio = measured.trace() / claimed.trace();
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    // The printed form corresponds to the same rays through a pinhole with this focal length.
    let flat = Camera::<f64>::try_new(&CameraConfig::ideal(Model::Pinhole, 9000, 9000, 500.0)).unwrap();
    let printed: Vec<(f64, f64)> = exact
        .iter()
        .map(|&(u, v)| {
            let ray = camera.unproject(crate::geometry::pixel::ImagePoint { u, v }).unwrap();
            flat.project(&ray).map(|p| (p.u, p.v)).unwrap()
        })
        .collect();
    claimed = braun_barf::covariance(&blocks(&flat, &printed, &e), e.v(), 0.0).unwrap() * (sigma * sigma);
    let ratio = measured.trace() / claimed.trace();
    assert!(!(0.8..1.25).contains(&ratio), "the printed form must not hold: {ratio}");
}

/// The covariance is honest at 200 km with errors that are correlated along the edge. Squared errors divided by the
/// covariance across the axis are two on average; divided by the overbound (37) they are a twentieth of that. The
/// errors are those of a free half-angle.
#[test]
fn covariance_is_honest_and_the_overbound_is_not() {
    let (camera, e) = rocket_camera();
    let sin: f64 = 6_371_008.8 / (6_371_008.8 + 200e3);
    let exact = limb(&camera, &e, libm::sqrt(1.0 - sin * sin), 1.0);
    let mut gauss = Gauss(crate::base::rng::Rng::new(11));
    let (runs, rho) = (200, libm::exp(-1.0 / 300.0));
    let (mut squares, mut nees, mut bounded) = (0.0, 0.0, 0.0);
    for _ in 0..runs {
        let (mut du, mut dv) = (gauss.next(), gauss.next());
        let mut points = Vec::new();
        for &(u, v) in &exact {
            points.push((u + du, v + dv));
            let fresh = libm::sqrt(1.0 - rho * rho);
            (du, dv) = (rho * du + fresh * gauss.next(), rho * dv + fresh * gauss.next());
        }
        let blocks = blocks(&camera, &points, &e);
        let (got, _) = direct::fit(&blocks).unwrap();
        let p = braun_barf::covariance(&blocks, &got, 300.0).unwrap();
        let (b1, b2) = basis(&got);
        let off = V3::from(e.xyz()) - got;
        let (x, y) = (off.dot(&b1), off.dot(&b2));
        squares += x * x + y * y;
        let [a, b, d] = invert_spd2(braun_barf::project(&p, &got, false)).unwrap();
        nees += a * x * x + 2.0 * b * x * y + d * y * y;
        bounded += (x * x + y * y) / braun_barf::project(&p, &got, true)[0];
    }
    let n = f64::from(runs);
    let (rms_deg, nees, bounded) = (libm::sqrt(squares / n).to_degrees(), nees / n, bounded / n);
    assert!((0.15..0.23).contains(&rms_deg), "{rms_deg}");
    assert!((1.6..2.5).contains(&nees), "{nees}");
    assert!((0.05..0.15).contains(&bounded), "{bounded}");
}

/// Returns the conic as a quadratic form of rays, times any factor.
fn form(e: &V3<f64>, c: f64, factor: f64) -> [[f64; 3]; 3] {
    let m = (e * e.transpose() - M3::identity() * (c * c)) * factor;
    core::array::from_fn(|i| core::array::from_fn(|j| m[(i, j)]))
}

/// The axis from (18) is correct for a conic with any signs and any factor of its coefficients.
#[test]
fn axis_of_a_conic_keeps_its_signs() {
    for e in [[-0.57, 0.79, -0.23], [0.1, 0.2, 0.97], [0.9, -0.3, 0.3], [-0.6, -0.6, 0.5]] {
        let e = unit(&V3::from(e)).unwrap();
        for factor in [1.0, -1.0, 3e5, -2e-7] {
            let m = form(&e, 0.25, factor);
            let (got, c) = conic::cone(&m, &e).unwrap();
            assert!((got - e).norm() < 1e-12 && (c - 0.25).abs() < 1e-12, "{e:?} {factor}");
            // The printed form takes roots of coefficients and assumes that the factor is 1.
            let printed = V3::from_fn(|i, _| libm::sqrt((m[i][i] + 0.25 * 0.25).abs()));
            let cannot = (printed - e).norm() > 0.1 || factor == 1.0 && e.iter().all(|x| *x > 0.0);
            assert!(cannot, "{e:?} {factor}: {printed:?}");
        }
    }
    // If all eigenvalues have the same sign, there is no cone.
    assert!(conic::cone(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]], &V3::x()).is_none());
}

/// Equations (20) and (21) relate the coefficients of a conic to cos α. Their last term has f² in the correct form and
/// f⁴ in print.
#[test]
fn coefficients_of_a_limb_fulfil_the_constraints() {
    let e = unit(&V3::new(0.3, -0.5, 0.6)).unwrap();
    let (c, f) = (0.3, 800.0);
    let m = form(&e, c, 1.0);
    let (a, cc, ff) = (m[0][0], m[1][1], m[2][2] * f * f);
    let (d, ee) = (2.0 * m[0][2] * f, 2.0 * m[1][2] * f);
    let c2 = c * c;
    for (square, own) in [(d * d, a), (ee * ee, cc)] {
        let sum = |last: f64, shared: f64| square - 4.0 * own * ff - 4.0 * (shared + ff / (f * f)) * c2 * f * f - last;
        let right = sum(4.0 * c2 * c2 * f * f, own);
        let scale = square.abs().max((4.0 * own * ff).abs());
        assert!(right.abs() / scale < 1e-12, "{right}");
        assert!(sum(4.0 * c2 * c2 * f.powi(4), own).abs() / scale > 1.0);
        if own == cc {
            // Equation (21) is printed with A in place of C.
            assert!(sum(4.0 * c2 * c2 * f * f, a).abs() / scale > 1e-3);
        }
    }
}

/// Checks that both estimators find a noise-free limb. Ellipses, hyperbolae and (nearly) parabolae are covered, in both
/// precisions.
fn exact<T: Real>(altitude_km: f64, tilt_deg: f64, tolerance_deg: f64) {
    let camera = Camera::try_new(&CameraConfig::ideal(Model::Pinhole, 1920, 1080, 888.97)).unwrap();
    let tilt = tilt_deg.to_radians();
    let e = direction::<f64>([0.2, libm::cos(tilt), libm::sin(tilt)]);
    let sin = 6371.0 / (6371.0 + altitude_km);
    let c = libm::sqrt(1.0 - sin * sin);
    let (points, cos) = (limb(&camera, &e, c, 5.0), c);
    assert!(points.len() > 50, "{altitude_km} {tilt_deg}");
    let camera = Camera::<T>::try_new(&CameraConfig::ideal(Model::Pinhole, 1920, 1080, 888.97)).unwrap();
    let e = direction::<T>(e.xyz());
    let blocks = blocks(&camera, &points, &e);
    for (name, got) in [("conic", conic::fit(&blocks)), ("direct", direct::fit(&blocks))] {
        let (got, got_c) = got.unwrap_or_else(|| panic!("{name} {altitude_km} {tilt_deg}"));
        let off = UnitVec3::<Cam, T>::assume_unit(got).angle_rad(&e).to_f64().to_degrees();
        assert!(off < tolerance_deg, "{name} {altitude_km} km {tilt_deg}°: {off:e}");
        assert!((got_c.to_f64() - cos).abs() < tolerance_deg, "{name} {got_c} {cos}");
    }
}

#[test]
fn conic_and_direct_find_exact_limbs() {
    for (altitude, tilt) in [(60.0, 20.0), (240.0, 20.0), (800.0, 30.0), (6000.0, 60.0), (36000.0, 80.0)] {
        exact::<f64>(altitude, tilt, 1e-6);
    }
    // The limb is a parabola: Δ = sin²α − e_z² = 0.
    exact::<f64>(3000.0, libm::asin(6371.0 / 9371.0).to_degrees(), 1e-6);
    exact::<f32>(800.0, 30.0, 0.01);
    exact::<f32>(36000.0, 80.0, 0.01);
}

/// Coefficients are fitted in normalised coordinates. The constraint of the conic keeps it an ellipse under noise.
#[test]
fn conic_bears_noise_on_a_whole_disc() {
    let camera = Camera::try_new(&CameraConfig::ideal(Model::Pinhole, 1000, 1000, 500.0)).unwrap();
    let e = direction::<f64>([0.1, 0.15, 1.0]);
    let exact = limb(&camera, &e, libm::cos(0.5), 3.0);
    let mut gauss = Gauss(crate::base::rng::Rng::new(9));
    let points: Vec<(f64, f64)> = exact.iter().map(|p| (p.0 + 0.3 * gauss.next(), p.1 + 0.3 * gauss.next())).collect();
    let (got, c) = conic::fit(&blocks(&camera, &points, &e)).unwrap();
    assert!(UnitVec3::<Cam, f64>::assume_unit(got).angle_rad(&e).to_degrees() < 0.02);
    assert!((libm::acos(c) - 0.5).abs() < 1e-3);
}

/// Points that do not determine a cone give none.
#[test]
fn degenerate_points_give_no_cone() {
    let camera = Camera::<f64>::try_new(&CameraConfig::ideal(Model::Pinhole, 1920, 1080, 888.97)).unwrap();
    let e = direction::<f64>([0.0, 0.9, 0.4]);
    let cases: [Vec<(f64, f64)>; 6] = [
        Vec::new(),
        Vec::from([(100.0, 100.0)]),
        Vec::from([(100.0, 100.0), (200.0, 100.0)]),
        // All points are in one place.
        Vec::from([(700.5, 300.5); 40]),
        // The points are on a straight line: the limb of a body that fills a hemisphere.
        (0..200).map(|i| (f64::from(i) * 9.0, 300.0)).collect(),
        (0..200).map(|i| (f64::from(i) * 9.0, 539.5)).collect(),
    ];
    for points in cases {
        let blocks = blocks(&camera, &points, &e);
        for (e, c) in [direct::fit(&blocks), conic::fit(&blocks)].into_iter().flatten() {
            assert!((e.norm() - 1.0).abs() < 1e-9 && c > 0.0 && c < 1.0, "{points:?}: {e:?} {c}");
        }
        if points.len() < 3 {
            assert!(direct::fit(&blocks).is_none());
        }
        if points.len() < 5 {
            assert!(conic::fit(&blocks).is_none());
        }
        assert!(braun_barf::covariance(&blocks, e.v(), 300.0).is_none_or(|p| p.iter().all(|v| v.is_finite())));
    }
}

/// Three-point RANSAC finds the limb with half of the points anywhere. Points far from the limb have no weight
/// afterwards.
#[test]
fn ransac_leaves_outliers_out() {
    let (camera, e, c, exact) = rocket();
    let mut rng = crate::base::rng::Rng::new(3);
    let points: Vec<(f64, f64)> = exact
        .iter()
        .map(|&p| match rng.below(2) {
            0 => (f64::from(rng.below(1920)), f64::from(rng.below(1080))),
            _ => p,
        })
        .collect();
    let mut blocks = blocks(&camera, &points, &e);
    let body = crate::model::body::Config { altitude_km: Some(120.0), ..Default::default() };
    let expected = crate::model::body::Expected::new(&body, &crate::model::body::Prior::default()).unwrap();
    let config = consensus::Config { method: consensus::Method::Ransac, threshold_px: 1.0, ..Default::default() };
    let found = consensus::find(
        &mut blocks,
        points.len() as u32,
        &expected,
        888.97,
        consensus::Threshold::from_config(&config),
        &config,
        &mut WorkBudget::unlimited(),
    )
    .unwrap();
    assert!(found.draws < config.max_draws);
    for (i, p) in points.iter().enumerate() {
        let near = exact.iter().any(|q| libm::hypot(p.0 - q.0, p.1 - q.1) < 5.0);
        if blocks[i / LANES].weight[i % LANES] > 0.0 {
            assert!(near, "{p:?}");
        }
    }
    let (got, got_c) = direct::fit(&blocks).unwrap();
    assert!(UnitVec3::<Cam, f64>::assume_unit(got).angle_rad(&e).to_degrees() < 0.2 && (got_c - c).abs() < 0.01);
    let few = consensus::find(
        &mut blocks[..1],
        2,
        &expected,
        888.97,
        consensus::Threshold::from_config(&config),
        &config,
        &mut WorkBudget::unlimited(),
    );
    assert!(few.is_none());
}

/// The overbound (37) is the largest eigenvalue of (33).
#[test]
fn overbound_is_the_largest_eigenvalue() {
    let p = M3::new(2.0, 0.3, 0.1, 0.3, 1.0, -0.2, 0.1, -0.2, 0.5);
    let e = unit(&V3::new(0.0, 0.6, 0.8)).unwrap();
    let ([_, _, largest], _) = symmetric_eigen::<f64, 3>(core::array::from_fn(|i| core::array::from_fn(|j| p[(i, j)])));
    assert_eq!(braun_barf::project(&p, &e, true), [largest, 0.0, largest]);
}
