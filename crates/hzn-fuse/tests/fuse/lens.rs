//! The lens as an unknown of the whole flight.
//!
//! `HZN_FLIGHTS=20 cargo test --test fuse lens:: -- --nocapture` flies 20 flights; without the variable a few of them.

use crate::common::{Draws, Slow, flights};
use crate::points::Cones;
use crate::solve::{Table, differences, drawn_with, own, rms};
use hzn_core::HostHorizon;
use hzn_core::camera::{Camera, Config, Covariance as Calibration, Intrinsic, Model};
use hzn_core::ellipsoid::{EARTH_MEAN_RADIUS_M, WGS84_A_M, WGS84_B_M, geodetic};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_fuse::finding::{Cause, Level};
use hzn_fuse::flight::{Wanted, with_problem};
use hzn_fuse::fuse;
use hzn_fuse::input::{Body, Inputs, Recording, Seen};
use hzn_fuse::settings::{Camera as Settings, LensSetting, Treatment};
use hzn_fuse::simulated::Errors;
use hzn_fuse::solve::Lens;
use hzn_host::Compiled;
use hzn_mcap::{Row, RowMeta};
use hzn_nav::filter::basis;
use hzn_sim::Scenario;
use nalgebra::{Matrix3, Vector3};

/// First seed of the flights: no setting of the solve was looked at with them.
const FIRST_SEED: u64 = 91_000;
/// 1-sigma of the lenses of the flights: focal length in percent, principal point in px.
const SIGMAS: [f64; 2] = [0.5, 3.0];

/// Returns a lens with an error: the focal lengths as a fraction, the principal point in px.
pub(crate) fn with_error(told: &Config, error: &Vector3<f64>) -> Config {
    let mut out = told.clone();
    (out.fx_px, out.fy_px) = (told.fx_px * (1.0 + error.x), told.fy_px * (1.0 + error.x));
    (out.cx_px, out.cy_px) = (told.cx_px + error.y, told.cy_px + error.z);
    out
}

/// Returns the cone that a sensor with the told lens fits to the limb in the picture of the true lens. `cos` is fixed
/// if it is not free.
fn measured(told: &Config, true_lens: &Config, axis: Vector3<f64>, cos: f64, free: bool) -> (Vector3<f64>, f64) {
    let [lens, true_lens] = [told, true_lens].map(|c| Camera::<f64>::try_new(c).unwrap());
    let b = basis(&axis);
    let sin = (1.0 - cos * cos).sqrt();
    let point = |i: i32| {
        let (s, c) = (f64::from(i) * 1e-4 * core::f64::consts::TAU).sin_cos();
        let ray = axis * cos + (b.row(0).transpose() * c + b.row(1).transpose() * s) * sin;
        let p = true_lens.project(&UnitVec3::try_new(ray.into())?)?;
        let is_inside =
            (-0.5..f64::from(told.width) - 0.5).contains(&p.u) && (-0.5..f64::from(told.height) - 0.5).contains(&p.v);
        is_inside.then_some(p)
    };
    // Edge points are as dense as pixels; a point counts for half of the way to both neighbours.
    let all: Vec<Option<ImagePoint<f64>>> = (0..10_000).map(point).collect();
    let far = |a: &ImagePoint<f64>, b: Option<&Option<ImagePoint<f64>>>| {
        b.copied().flatten().map_or(0.0, |b| 0.5 * (a.u - b.u).hypot(a.v - b.v))
    };
    let neighbours = |i: usize| [all.get((i + 9_999) % 10_000), all.get((i + 1) % 10_000)];
    let points = (0..10_000).filter_map(|i| all[i].map(|p| (p, neighbours(i).map(|b| far(&p, b)).iter().sum::<f64>())));
    let points: Vec<(ImagePoint<f64>, f64)> = points.collect();
    if points.len() < 5 {
        return (axis, cos);
    }
    let (mut e, mut c) = (axis, cos);
    for _ in 0..6 {
        let b = basis(&e);
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (p, pixels) in &points {
            let Some(ray) = lens.ray(*p) else { continue };
            let (s, j) = (Vector3::from(ray.direction().xyz()), ray.jacobian());
            let slope = [0, 1].map(|k| (0..3).map(|i| e[i] * j[i][k]).sum::<f64>());
            let weight = pixels / (slope[0].powi(2) + slope[1].powi(2));
            let across = b * s;
            let row = Vector3::new(across.x, across.y, if free { -1.0 } else { 0.0 });
            normal += row * row.transpose() * weight;
            right += row * (c - s.dot(&e)) * weight;
        }
        if !free {
            normal.m33 = 1.0;
        }
        // The edge of the picture shows too little of a disc.
        let Some(inverse) = normal.try_inverse() else { return (axis, cos) };
        let step = inverse * right;
        e = (e + b.transpose() * step.fixed_rows::<2>(0)).normalize();
        c += step.z;
    }
    (e, c)
}

pub(crate) fn settings(sigmas: [f64; 2]) -> Settings {
    let [focal_percent, centre_px] = sigmas.map(|sigma| LensSetting { mode: Treatment::Estimated, sigma: Some(sigma) });
    Settings { focal_percent, centre_px, ..Settings::default() }
}

/// The derivative against cones that are fitted to drawn points of another lens.
#[test]
fn a_cone_moves_with_the_lens_as_told() {
    let mut fisheye = Config::ideal(Model::KannalaBrandt, 1920, 1080, 700.0);
    fisheye.k = [-0.05, 0.01, -0.003, 0.0002].into_iter().collect();
    let mut brown = Config::ideal(Model::BrownConrady, 1600, 1200, 1400.0);
    brown.k = [-0.2, 0.05, 0.001, -0.0005, 0.0].into_iter().collect();
    let narrow = Config::ideal(Model::Pinhole, 1024, 1024, 9000.0);
    // Half-angles of an orbit, of a rocket, of the Sun, of the Moon's distance.
    let cases = [
        (&fisheye, 67.0, 75.0),
        (&fisheye, 75.0, 60.0),
        (&brown, 66.0, 70.0),
        (&narrow, 65.0, 66.0),
        (&brown, 0.27, 20.0),
        (&fisheye, 10.0, 15.0),
    ];
    for (config, half_deg, off_deg) in cases {
        for azimuth in [0.3f64, 1.4, 2.9, 4.6] {
            let lens = Lens::new(config, &settings([1.0, 1.0])).unwrap();
            let off = f64::to_radians(off_deg);
            let axis = Vector3::new(off.sin() * azimuth.cos(), off.sin() * azimuth.sin(), off.cos());
            let cos = f64::to_radians(half_deg).cos();
            for free in [true, false] {
                if free && half_deg < 1.0 {
                    continue;
                }
                let by = lens.by_lens(&axis, cos, free).unwrap();
                for (i, step) in [1e-4, 0.1, 0.1].into_iter().enumerate() {
                    let error = Vector3::ith(i, step);
                    let [(e1, c1), (e0, c0)] =
                        [error, -error].map(|error| measured(config, &with_error(config, &error), axis, cos, free));
                    let numeric = [(e1 - e0) / (2.0 * step), Vector3::z() * (c1 - c0) / (2.0 * step)];
                    let own = by.column(i);
                    let size = own.norm().max(if i == 0 { 1e-2 } else { 1e-2 / config.fx_px });
                    let off = (numeric[0] - own.fixed_rows::<3>(0)).norm().hypot(numeric[1].z - own[3]) / size;
                    assert!(off < 0.03, "{half_deg} {off_deg} {azimuth} {free} {i}: {off} {} {}", numeric[0], own);
                }
            }
        }
    }
}

/// A sensor that processes the same pictures with another lens moves its answers as the derivative says.
#[test]
fn rendered_limbs_move_with_the_lens_as_told() {
    let (mut worst, mut all) = (0.0f64, Vec::new());
    for flight in [hzn_sim::flight::leo_infrared(8, 61), hzn_sim::flight::rocket(960, 540, 8, 61)] {
        for frame in &flight.frames {
            let (prior, picture) = (frame.prior(), frame.render().unwrap());
            let answer = |error: Vector3<f64>| -> Option<Seen> {
                let mut sensor = flight.sensor.clone();
                sensor.camera = with_error(&sensor.camera, &error);
                let mut horizon = HostHorizon::boxed(&sensor).unwrap();
                let expected = horizon.expect(&prior).unwrap();
                let report = horizon.find(picture.view(), &expected);
                let (altitude_m, _) = geodetic(prior.position_m.unwrap(), WGS84_A_M, WGS84_B_M);
                let altitude_km = Some(altitude_m / 1e3);
                let meta = RowMeta {
                    index: 0,
                    file: frame.file.clone(),
                    time_s: Some(0.0),
                    body: "earth".into(),
                    altitude_km,
                };
                let row = Row::from_report(&meta, &report, None);
                Recording::new("cam".into(), vec![row], Some(&sensor)).unwrap().seen.first().copied()
            };
            let Some(told) = answer(Vector3::zeros()) else { continue };
            let lens = Lens::new(&flight.sensor.camera, &settings([1.0, 1.0])).unwrap();
            let by = lens.by_lens_of(&told).unwrap();
            for (i, step) in [2e-3, 1.0, 1.0].into_iter().enumerate() {
                let error = Vector3::ith(i, step);
                // A lens with this error made the picture, seen from the one that is told.
                let [Some(plus), Some(minus)] = [error, -error].map(&answer) else { continue };
                let numeric = (minus.axis - plus.axis).into_inner() / (2.0 * step);
                let size = by.column(i).norm().max(if i == 0 { 0.1 } else { 0.1 / flight.sensor.camera.fx_px });
                let off = (numeric - by.column(i)).norm() / size;
                println!("{} {i}: {off:.3} of {:.2e}", frame.file, by.column(i).norm());
                worst = worst.max(off);
                all.push(off);
            }
        }
    }
    println!("RMS {:.3}, worst {worst:.3} of {}", rms(&all), all.len());
    assert!(all.len() > 20 && rms(&all) < 0.1 && worst < 0.5, "{}", rms(&all));
}

/// A flight whose lenses have errors that are larger than told by a factor, and the errors.
fn drawn(seed: u64, errors: &mut dyn Errors, larger: f64) -> (Scenario, Inputs, Vec<Vector3<f64>>) {
    let (scene, mut inputs) = drawn_with(seed, errors);
    let (mut draws, mut lenses) = (Draws(seed ^ 0x1e25), Vec::new());
    let sigma = Vector3::new(0.01 * SIGMAS[0], SIGMAS[1], SIGMAS[1]);
    for recording in &mut inputs.recordings {
        let mut config = recording.camera.clone().unwrap();
        let error = sigma.map(|s| larger * s * draws.normal());
        for seen in &mut recording.seen {
            let axis = seen.axis.into_inner();
            let distance_km = 1e-3 * EARTH_MEAN_RADIUS_M + seen.altitude_km.unwrap();
            let is_limb = seen.body == Body::Limb;
            let sin = if is_limb { 1e-3 * EARTH_MEAN_RADIUS_M / distance_km } else { 0.00465 };
            let cos = (1.0 - sin * sin).sqrt();
            let gain = seen.by_limb_height.into_inner() * distance_km * cos / sin;
            let moved = |error: &Vector3<f64>| {
                let (e, c) = measured(&config, &with_error(&config, error), axis, cos, is_limb);
                e - axis - gain * (c - cos)
            };
            // The covariance of the sensor contains the lens.
            let mut own = seen.covariance_rad2.into_inner();
            for i in 0..3 {
                let by = moved(&Vector3::ith(i, sigma[i]));
                own += by * by.transpose();
            }
            seen.covariance_rad2 = own.into();
            if let Some(cone) = &mut seen.cone {
                let at = cone.axis.into_inner();
                let change = |error: &Vector3<f64>| {
                    let (e, c) = measured(&config, &with_error(&config, error), at, cone.cos, true);
                    (e - at, c - cone.cos)
                };
                let (mut whole, mut with, mut var_cos) =
                    (cone.covariance_rad2.into_inner(), cone.axis_with_cos_rad.into_inner(), cone.var_cos);
                for i in 0..3 {
                    let (by, cos) = change(&Vector3::ith(i, sigma[i]));
                    whole += by * by.transpose();
                    with += by * cos;
                    var_cos += cos * cos;
                }
                let (e, c) = change(&error);
                (cone.axis, cone.cos) = ((at + e).normalize().into(), cone.cos + c);
                (cone.covariance_rad2, cone.axis_with_cos_rad, cone.var_cos) = (whole.into(), with.into(), var_cos);
            }
            seen.axis = (axis + moved(&error)).normalize().into();
        }
        (config.focal_sigma_percent, config.centre_sigma_px) = (SIGMAS[0], SIGMAS[1]);
        recording.camera = Some(config);
        lenses.push(error);
    }
    (scene, inputs, lenses)
}

fn wanted(points: bool) -> Wanted {
    Wanted { solved: true, points, rate_hz: Some(2.0), ..Wanted::default() }
}

#[test]
fn derivatives_are_those_of_differences() {
    for points in [false, true] {
        let (_, mut inputs, _) = drawn(1, &mut Cones::new(1), 1.0);
        inputs.imu.retain(|s| s.imu.time_s < 150.0);
        let worst = with_problem(&inputs, &own(), points, |problem, first| {
            assert_eq!(problem.places().lenses.iter().filter(|lens| lens.focal.is_some()).count(), 2);
            differences(problem, first)
        });
        assert!(worst.unwrap() < 6e-3);
    }
}

/// Errors of the lenses over their sigmas, and their sigmas over those before.
#[derive(Default)]
struct Lenses {
    errors: Vec<f64>,
    shares: [Vec<f64>; 2],
}

/// Lenses whose errors are drawn from their priors: what the solve says of them is honest, and the attitude, too.
#[test]
fn flights_with_unknown_lenses() {
    let mut off = own();
    (off.camera.focal_percent.mode, off.camera.centre_px.mode) = (Treatment::Off, Treatment::Off);
    for points in [false, true] {
        let (mut tables, mut lenses) = ([Table::default(), Table::default()], Lenses::default());
        for seed in FIRST_SEED.. {
            if tables[0].len() >= flights(1, 20) as usize {
                break;
            }
            let mut errors: Box<dyn Errors> =
                if points { Box::new(Cones::new(seed)) } else { Box::new(Slow::new(seed, 0.1)) };
            let (scene, inputs, truth) = drawn(seed, errors.as_mut(), 1.0);
            let Ok(fused) = fuse(&inputs, &own(), wanted(points)) else { continue };
            if fused.begin.is_none_or(|begin| begin.time_s > 200.0) {
                continue;
            }
            tables[0].add(&scene, &fused);
            tables[1].add(&scene, &fuse(&inputs, &off, wanted(points)).unwrap());
            let determined = &fused.solved.as_ref().unwrap().determined;
            for (recording, truth) in inputs.recordings.iter().zip(&truth) {
                let find = |what: &str| {
                    let name = format!("{what} of {}", recording.name);
                    determined.iter().find(|d| d.name == name).unwrap()
                };
                let (focal, centre) = (find("focal length"), find("principal point"));
                lenses.errors.push((focal.estimate[0] - 100.0 * truth.x) / focal.sigma[0]);
                lenses.errors.extend([0, 1].map(|i| (centre.estimate[i] - truth[1 + i]) / centre.sigma[i]));
                lenses.shares[0].push(focal.sigma[0] / focal.before[0]);
                lenses.shares[1].extend([0, 1].map(|i| centre.sigma[i] / centre.before[i]));
            }
        }
        let what = if points { "cones" } else { "axes" };
        tables[0].print(&format!("{what}, lens unknown"));
        tables[1].print(&format!("{what}, lens in the covariance"));
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        println!(
            "    errors of the lens over their sigma, RMS {:.2} of {}; sigma over that before: focal length {:.2}, \
             principal point {:.2}",
            rms(&lenses.errors),
            lenses.errors.len(),
            mean(&lenses.shares[0]),
            mean(&lenses.shares[1])
        );
        assert!(rms(&lenses.errors) < 2.0 && tables[0].nees.iter().all(|nees| *nees < 20.0));
        assert!(lenses.shares.iter().flatten().all(|share| *share <= 1.0 + 1e-9));
    }
}

/// A lens that is far from its calibration is named; a lens that nobody knows cannot be an unknown.
#[test]
fn a_wrong_lens_is_named_and_a_missing_one_refused() {
    let (_, mut inputs, truth) = drawn(2, &mut Slow::new(2, 0.05), 12.0);
    println!("{truth:?}");
    let fused = fuse(&inputs, &own(), wanted(false)).unwrap();
    for one in fused.solved.iter().flat_map(|solved| &solved.determined).filter(|one| one.name.starts_with("focal")) {
        println!("{one:?}");
    }
    let lens = fused.verdict.findings.iter().find(|f| f.cause == Cause::Lens);
    assert!(lens.is_some_and(|f| f.level == Level::Contradicts), "{:?}", fused.verdict.findings);
    inputs.recordings[1].camera = None;
    assert!(fuse(&inputs, &own(), wanted(false)).is_ok());
    let mut told = own();
    told.camera.focal_percent.sigma = Some(0.5);
    let (text, name) = (fuse(&inputs, &told, wanted(false)).unwrap_err().to_string(), &inputs.recordings[1].name);
    assert!(text.starts_with(&format!("{name}: focal_percent has a sigma")) && text.contains("--mount"), "{text}");
}

/// What a calibration ties to the focal length follows it, and settings replace its sigmas.
#[test]
fn a_covariance_of_the_calibration_is_taken_apart() {
    let mut config = Config::ideal(Model::KannalaBrandt, 1920, 1080, 1000.0);
    config.k = [-0.03, 0.0, 0.0, 0.0].into_iter().collect();
    let order = [Intrinsic::FxPx, Intrinsic::FyPx, Intrinsic::K1];
    // A larger focal length comes with a smaller k1.
    let rows = [[4.0, 4.0, -0.008], [4.0, 4.0, -0.008], [-0.008, -0.008, 2e-5]];
    config.covariance = Some(Calibration {
        order: order.into_iter().collect(),
        rows: rows.map(|row| row.into_iter().collect()).into_iter().collect(),
    });
    let (axis, cos) = (Vector3::y(), 67f64.to_radians().cos());
    let by =
        |lens: Option<Lens>| lens.unwrap().by_lens(&axis, cos, false).unwrap().fixed_view::<3, 1>(0, 0).into_owned();
    let tied = by(Lens::new(&config, &Settings::default()));
    config.covariance = None;
    let alone = by(Lens::new(&config, &settings([0.2, 0.0])));
    let mut true_lens = with_error(&config, &Vector3::new(1e-3, 0.0, 0.0));
    true_lens.k[0] -= 0.002;
    let numeric = (measured(&config, &true_lens, axis, cos, false).0 - axis) / 1e-3;
    assert!((tied - numeric).norm() < 0.03 * numeric.norm(), "{tied} {numeric} {alone}");
    assert!((alone - numeric).norm() > 0.2 * numeric.norm(), "{alone} {numeric}");
}
