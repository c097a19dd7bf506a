//! Tests with flights of edge points whose limb height and noise are known.

use hzn_core::body::{self, Kind};
use hzn_core::camera::{self, Camera, Model};
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M, from_geodetic};
use hzn_core::frames::{Cov3, UnitVec3};
use hzn_core::{Config, Prior, Solution};
use nalgebra::Vector3;

use super::{Calibration, Refusal, Sighting, WeightedPoints, cone, edge, into_sensor_toml};
use crate::draws::Draws;

/// Edge noise: its sigma and correlation length in pixels, and its white part.
#[derive(Clone, Copy)]
pub(crate) struct Noise(pub(crate) f64, pub(crate) f64, pub(crate) f64);

pub(super) fn camera(fov_deg: f64) -> camera::Config {
    camera::Config::ideal(Model::Equidistant, 960, 720, 960.0 / fov_deg.to_radians())
}

pub(crate) fn earth() -> body::Config {
    body::Config { kind: Kind::EarthSphere, limb_height_km: 15.0, limb_height_sigma_km: 30.0, ..Default::default() }
}

/// Returns edge points of a limb in the picture of `camera`, with noise across the limb. The limb is a cone with the
/// axis `axis` (camera frame); `cos` gives cos α by the direction from the axis.
pub(crate) fn limb(
    camera: &Camera<f64>,
    axis: Vector3<f64>,
    cos: &dyn Fn(&Vector3<f64>) -> f64,
    noise: Noise,
    draws: &mut Draws,
) -> WeightedPoints {
    let (b1, b2) = cone::basis(&axis);
    let Noise(sigma, length, white) = noise;
    let mut points: WeightedPoints = Vec::new();
    let (mut correlated, mut last) = (draws.normal(), None::<[f64; 2]>);
    let steps = 5_000;
    for k in 0..steps {
        let (s, c) = (core::f64::consts::TAU * k as f64 / steps as f64).sin_cos();
        let across = b1 * c + b2 * s;
        let cos = cos(&across);
        let ray = axis * cos + across * (1.0 - cos * cos).sqrt();
        let Some(ray) = UnitVec3::try_new([ray.x, ray.y, ray.z]) else { continue };
        let Some(p) = camera.project(&ray) else { continue };
        let inside = p.u > 0.0 && p.v > 0.0 && p.u < f64::from(camera.width()) && p.v < f64::from(camera.height());
        let step = last.map_or(1e9, |[u, v]: [f64; 2]| (p.u - u).hypot(p.v - v));
        if !inside || step < 2.0 {
            continue;
        }
        last = Some([p.u, p.v]);
        let rho = (-step / length).exp();
        correlated = rho * correlated + (1.0 - rho * rho).sqrt() * draws.normal();
        let off = sigma * ((1.0 - white).sqrt() * correlated + white.sqrt() * draws.normal());
        // The noise is along the gradient of s·e in the picture.
        let j = camera.ray(p).unwrap().jacobian();
        let g = [0, 1].map(|i| (0..3).map(|r| j[r][i] * axis[r]).sum::<f64>());
        let norm = g[0].hypot(g[1]);
        points.push(([p.u + off * g[0] / norm, p.v + off * g[1] / norm], 1.0));
    }
    points
}

pub(crate) fn solution(axis: Vector3<f64>, half_angle_rad: f64) -> Solution<f64> {
    Solution {
        axis: UnitVec3::try_new([axis.x, axis.y, axis.z]).unwrap(),
        covariance: Cov3::from_upper([1e-8, 0.0, 0.0, 1e-8, 0.0, 1e-8]),
        common: None,
        axis_fixed: None,
        axis_vehicle: None,
        half_angle_rad,
        fused_half_angle_rad: half_angle_rad,
        altitude_m: None,
        free: None,
        axis_by_cos: None,
        position: None,
        p_limb: None,
        is_airglow: false,
        rms_px: 0.1,
        inliers: 400,
        arc_px: 800.0,
        candidate: 0,
    }
}

/// Returns sightings of a limb at `limb_km` from 180 km altitude on, with `fov_deg`. `scatter_km` is the scatter
/// between pictures.
pub(super) fn flight(
    count: usize,
    fov_deg: f64,
    limb_km: f64,
    scatter_km: f64,
    noise: Noise,
    seed: u64,
) -> Vec<Sighting> {
    flight_through(camera(fov_deg), count, limb_km, scatter_km, noise, seed)
}

fn flight_through(
    config: camera::Config,
    count: usize,
    limb_km: f64,
    scatter_km: f64,
    noise: Noise,
    seed: u64,
) -> Vec<Sighting> {
    let camera = Camera::try_new(&config).unwrap();
    let mut draws = Draws(seed);
    let radius = earth().mean_radius_km();
    let each = (0..count).filter_map(|k| {
        let altitude_km = 180.0 + 3.0 * k as f64;
        let km = limb_km + scatter_km * draws.normal();
        let alpha = ((radius + km) / (radius + altitude_km)).asin();
        let below = alpha + (0.1 * k as f64).sin() * 0.1;
        let axis = Vector3::new(0.3 * below.sin(), 0.954 * below.sin(), below.cos()).normalize();
        let points = limb(&camera, axis, &|_| alpha.cos(), noise, &mut draws);
        let prior = Prior { altitude_m: Some(altitude_km * 1e3), ..Prior::default() };
        // The start differs from the solution.
        Sighting::measure("p", &camera, &earth(), &prior, &points, &solution(axis, alpha + 1e-3))
    });
    each.collect()
}

#[test]
fn a_flight_without_noise_gives_the_height_exactly() {
    let sightings = flight(12, 90.0, 21.5, 0.0, Noise(1e-3, 30.0, 0.5), 1);
    assert_eq!(sightings.len(), 12);
    for s in &sightings {
        assert!((s.limb_height_km - 21.5).abs() < 0.01, "{}", s.limb_height_km);
    }
}

#[test]
fn height_scatter_and_noise_are_found_within_their_errors() {
    let c = Calibration::new(&earth(), &flight(30, 90.0, 18.7, 8.0, Noise(0.3, 40.0, 0.5), 2)).unwrap();
    let h = &c.height;
    assert!((h.km - 18.7).abs() < 2.0 * h.statistical_km && h.statistical_km < 2.5, "{h:?}");
    assert!((4.0..11.0).contains(&h.scatter_km), "{h:?}");
    assert!((0.25..0.35).contains(&c.edge.sigma_px), "{:?}", c.edge);
    assert!((10.0..=80.0).contains(&c.edge.length_px) && (0.25..=0.7).contains(&c.edge.white), "{:?}", c.edge);
    // (1 − ν) L or more, because one picture does not determine the length.
    assert!((15.0..=200.0).contains(&c.edge.correlation_px), "{:?}", c.edge);
    assert!(c.correlation.first().is_some_and(|p| (p.1 - 1.0).abs() < 1e-9));
    // What averages out, and the slow part, are the whole variance; the slow part is the smaller one of such errors.
    let (whole, slow) = (c.edge.sigma_px.powi(2), c.edge.sigma_px.powi(2) - c.edge.white_px.powi(2));
    assert!((0.05..0.5).contains(&(slow / whole)) && c.edge.bias_px >= slow.sqrt() - 1e-12, "{:?}", c.edge);
    assert!(c.edge.slow_px >= c.edge.length_px, "{:?}", c.edge);
    // The residuals show no tilt of the whole edge: its RMS is that of the shift.
    assert!((c.edge.tilt_px / c.edge.bias_px - 3f64.sqrt()).abs() < 1e-9, "{:?}", c.edge);
}

#[test]
fn errors_of_heights_agree_with_their_sigmas() {
    let sightings = flight(60, 90.0, 18.7, 0.0, Noise(0.2, 20.0, 0.7), 3);
    let c = Calibration::new(&earth(), &sightings).unwrap();
    // Sigma is conservative, because it is averaged over lengths up to the arc.
    assert!((0.02..1.3).contains(&c.chi2), "{}", c.chi2);
    assert!(c.alarm().is_none());
}

#[test]
fn pictures_that_contradict_each_other_raise_the_alarm() {
    let c = Calibration::new(&earth(), &flight(24, 90.0, 18.7, 15.0, Noise(0.2, 20.0, 0.7), 4)).unwrap();
    assert!(matches!(c.alarm(), Some(Refusal::Alarm { chi2, .. }) if chi2 > 2.0), "{}", c.chi2);
}

#[test]
fn a_height_that_the_air_cannot_have_or_that_is_told_otherwise_is_refused() {
    let at = |limb_km: f64, told: [f64; 2]| {
        let mut found = Calibration::new(&earth(), &flight(24, 90.0, limb_km, 0.3, Noise(0.2, 20.0, 0.7), 13)).unwrap();
        assert!(found.alarm().is_none(), "{:?}", found.alarm());
        let mut sensor = Config::new(camera(90.0));
        (sensor.body, sensor.body.altitude_sigma_km) = (earth(), 0.0);
        sensor.body.tell_limb_height(told[0], told[1]);
        found.compare_with(&sensor);
        found.alarm()
    };
    assert_eq!(at(18.7, [16.5, 3.0]), None);
    assert_eq!(at(18.7, [15.0, 7.0]), None);
    let below = at(-6.3, [15.0, 30.0]).unwrap();
    assert!(matches!(below, Refusal::BelowSurface { km, .. } if km < -3.0), "{below}");
    assert!(below.to_string().contains("km below the surface is not possible"), "{below}");
    let told = at(3.0, [16.5, 3.0]).unwrap();
    assert!(matches!(told, Refusal::Told { sigmas, .. } if sigmas > 2.58), "{told}");
    assert!(told.to_string().contains("but sensor.toml tells 16.5 km ± 3.0 km"), "{told}");
    // The limb of a body without air lies at its surface.
    let moon = body::Config { kind: Kind::Sphere, ..earth() };
    assert!(crate::limb_prior::has_air(&earth()) && !crate::limb_prior::has_air(&moon));
}

#[test]
fn what_pictures_do_not_determine_is_refused_with_the_number() {
    let noise = Noise(0.3, 40.0, 0.5);
    let few = Calibration::new(&earth(), &flight(11, 90.0, 18.7, 0.0, noise, 5)).unwrap_err();
    assert_eq!(few, Refusal::TooFew { answered: 11, min_pictures: 12 });
    assert!(few.to_string().starts_with("11 pictures have an answer, but at least 12 are needed"), "{few}");
    // Sigma grows with the inverse square of the field of view.
    let narrow = Calibration::new(&earth(), &flight(24, 15.0, 18.7, 0.0, noise, 6)).unwrap_err();
    assert!(matches!(narrow, Refusal::TooVague { sigma_km, .. } if sigma_km > 3.5), "{narrow:?}");
    // A third of the pictures has other edges.
    let mut mixed = flight(16, 90.0, 18.7, 0.0, noise, 7);
    mixed.iter_mut().skip(11).for_each(|s| s.limb_height_km += 90.0);
    assert_eq!(
        Calibration::new(&earth(), &mixed).unwrap_err(),
        Refusal::Inconsistent { inconsistent: 5, pictures: 16 }
    );
}

/// A limb whose height depends on latitude. The camera looks straight down from a polar orbit and sees the whole limb.
#[test]
fn a_flight_over_all_latitudes_gives_rows() {
    let config = camera(140.0);
    let camera = Camera::try_new(&config).unwrap();
    let body = body::Config { kind: Kind::Earth, ..earth() };
    let mut draws = Draws(8);
    let height_km = |deg: f64| 25.0 + 4.5 * deg / 90.0;
    let sightings: Vec<Sighting> = (0..24)
        .filter_map(|k| {
            let latitude = (-80.0 + 160.0 * k as f64 / 23.0f64).to_radians();
            let position = from_geodetic(latitude, 0.3, 600e3, WGS84_A_M, WGS84_B_M);
            let prior = Prior { position_m: Some(position), ..Prior::default() };
            // The mean height of the ring, because the whole limb is visible.
            let limb_m = height_km(latitude.to_degrees()) * 1e3 * 0.91 + 25e3 * 0.09;
            let cone = LimbCone::try_new(position, WGS84_A_M + limb_m, WGS84_B_M + limb_m)?;
            let axis = Vector3::new(0.05, 0.02, 1.0).normalize();
            let alpha = cone.mean_half_angle_rad();
            let points = limb(&camera, axis, &|_| alpha.cos(), Noise(0.05, 10.0, 0.8), &mut draws);
            Sighting::measure("p", &camera, &body, &prior, &points, &solution(axis, alpha))
        })
        .collect();
    let c = Calibration::new(&body, &sightings).unwrap();
    assert!(c.height.by_latitude.len() >= 2, "{:?}", c.height);
    for [deg, km, sigma] in &c.height.by_latitude {
        assert!((km - height_km(*deg)).abs() < 1.0, "{deg}: {km} ± {sigma}");
    }
    let mut sensor = Config::new(config);
    c.apply(&mut sensor);
    sensor.check().unwrap();
    assert_eq!(sensor.body.limb_height_by_latitude_km.len(), c.height.by_latitude.len());
}

/// Heights that drift with time must not become rows by latitude if all pictures see the same latitudes.
#[test]
fn a_flight_at_one_latitude_gives_no_rows() {
    let config = camera(90.0);
    let camera = Camera::try_new(&config).unwrap();
    let body = body::Config { kind: Kind::Earth, ..earth() };
    let mut draws = Draws(12);
    let sightings: Vec<Sighting> = (0..24)
        .filter_map(|k| {
            let position = from_geodetic((67.9 + 0.05 * f64::from(k)).to_radians(), 0.3, 200e3, WGS84_A_M, WGS84_B_M);
            let prior = Prior { position_m: Some(position), ..Prior::default() };
            let limb_m = 15e3 + 500.0 * f64::from(k);
            let cone = LimbCone::try_new(position, WGS84_A_M + limb_m, WGS84_B_M + limb_m)?;
            let alpha = cone.mean_half_angle_rad();
            let axis = Vector3::new(0.3 * alpha.sin(), 0.954 * alpha.sin(), alpha.cos()).normalize();
            let points = limb(&camera, axis, &|_| alpha.cos(), Noise(0.02, 10.0, 0.8), &mut draws);
            Sighting::measure("p", &camera, &body, &prior, &points, &solution(axis, alpha))
        })
        .collect();
    assert_eq!(sightings.len(), 24);
    let c = Calibration::new(&body, &sightings).unwrap();
    assert!(c.height.by_latitude.is_empty(), "{:?}", c.height);
}

#[test]
fn variance_of_the_cone_is_that_of_dense_matrices() {
    let config = camera(90.0);
    let camera = Camera::try_new(&config).unwrap();
    let axis = Vector3::new(0.3, 0.9, 0.5).normalize();
    let points = limb(&camera, axis, &|_| 0.3, Noise(0.2, 30.0, 0.5), &mut Draws(9));
    let cone = cone::Cone::fit(&camera, &points, axis.into(), 0.3, None).unwrap();
    let (sigma, length, white) = (0.4, 50.0, 0.3);
    let places: Vec<f64> = cone
        .rows
        .iter()
        .scan(0.0, |at, r| {
            let here = *at;
            *at += r.step_px;
            Some(here)
        })
        .collect();
    let a = cone.inverse * cone.to_cos;
    let mut dense = 0.0;
    for (i, one) in cone.rows.iter().enumerate() {
        for (j, other) in cone.rows.iter().enumerate() {
            let rho =
                (-(places[i] - places[j]).abs() / length).exp() * (1.0 - white) + if i == j { white } else { 0.0 };
            dense += sigma * sigma * rho * one.weight * other.weight * a.dot(&one.h) * a.dot(&other.h);
        }
    }
    let found = cone.variance_of_cos(sigma, length, white);
    assert!((found / dense - 1.0).abs() < 1e-9, "{found} {dense}");
    let shares: f64 = cone.shares().iter().sum();
    assert!((shares - 1.0).abs() < 1e-9, "{shares}");
    assert!(edge::variance_of_cos(&cone, &edge::score_models(&cone).unwrap()) > 0.0);
}

#[test]
fn a_longer_focal_length_raises_the_limb_as_predicted() {
    let config = camera(90.0);
    let camera = Camera::try_new(&config).unwrap();
    let longer =
        Camera::try_new(&camera::Config { fx_px: config.fx_px * 1.001, fy_px: config.fy_px * 1.001, ..config.clone() });
    let radius = earth().mean_radius_km();
    // The limb of the height that the sensor expects.
    let alpha = ((radius + 15.0) / (radius + 200.0)).asin();
    let axis = Vector3::new(0.1, alpha.sin(), alpha.cos()).normalize();
    let points = limb(&camera, axis, &|_| alpha.cos(), Noise(1e-4, 10.0, 0.5), &mut Draws(10));
    let prior = Prior { altitude_m: Some(200e3), ..Prior::default() };
    let at = |camera: &Camera<f64>| {
        Sighting::measure("p", camera, &earth(), &prior, &points, &solution(axis, alpha)).unwrap()
    };
    let (before, after) = (at(&camera), at(&longer.unwrap()));
    let grown = after.limb_height_km - before.limb_height_km;
    assert!((grown / (before.km_per_focal * 1e-3) - 1.0).abs() < 0.02, "{grown} {}", before.km_per_focal);
}

/// At one altitude, the change of a picture's limb height by the focal length differs from picture to picture mainly by
/// the place of the limb in it. If the noise of the picture were in that change, too, right lenses would be blamed.
#[test]
fn right_lenses_are_not_blamed() {
    let brown = camera::Config {
        k: [-0.2, 0.05, 0.0, 0.0, 0.0].into_iter().collect(),
        ..camera::Config::ideal(Model::BrownConrady, 240, 180, 190.0)
    };
    let lenses = [
        camera::Config::ideal(Model::Pinhole, 240, 180, 190.0),
        brown,
        camera::Config::ideal(Model::KannalaBrandt, 240, 180, 190.0),
    ];
    for config in lenses {
        let camera = Camera::try_new(&config).unwrap();
        let (radius, mut squares, flights) = (earth().mean_radius_km(), 0.0, 12);
        for seed in 0..flights {
            let mut draws = Draws(100 + seed);
            let each = (0..35).filter_map(|k| {
                let altitude_km = 713.0 + 0.1 * f64::from(k);
                let alpha = ((radius + 17.0) / (radius + altitude_km)).asin();
                let roll = 0.4 * (0.2 * f64::from(k)).sin();
                let below = alpha + 0.15 * (0.31 * f64::from(k)).sin();
                let axis = Vector3::new(roll.sin() * below.sin(), roll.cos() * below.sin(), below.cos());
                let points = limb(&camera, axis, &|_| alpha.cos(), Noise(0.12, 20.0, 0.5), &mut draws);
                let prior = Prior { altitude_m: Some(altitude_km * 1e3), ..Prior::default() };
                Sighting::measure("p", &camera, &earth(), &prior, &points, &solution(axis, alpha))
            });
            let sightings: Vec<Sighting> = each.collect();
            assert_eq!(sightings.len(), 35);
            let focal = Calibration::new(&earth(), &sightings).unwrap().focal.unwrap();
            squares += (focal.percent / focal.sigma_percent).powi(2) / flights as f64;
        }
        assert!(squares < 2.0, "{:?}: {squares:.2}", config.model);
    }
}

#[test]
fn a_focal_length_beyond_what_a_line_can_mean_has_no_percentage() {
    let mut c = Calibration::new(&earth(), &flight(16, 90.0, 18.7, 0.5, Noise(0.3, 40.0, 0.5), 11)).unwrap();
    let mut told = |percent, sigma_percent| {
        c.focal = c.focal.map(|f| super::Focal { percent, sigma_percent, ..f });
        let lines = super::lines(&c, "16 pictures", &camera(90.0));
        lines.into_iter().find(|(name, _)| *name == "focal length").unwrap().1
    };
    assert!(
        told(-3.0, 0.5).starts_with("-3.00 % ± 0.50 %") && told(-3.0, 0.5).ends_with("check the camera's calibration")
    );
    for (percent, sigma) in [(-54.1, 12.3), (-17.8, 2.5), (0.5, 12.0), (0.0, f64::NAN)] {
        let line = told(percent, sigma);
        assert!(line.starts_with("not determined: ") && !line.contains("check the camera"), "{line}");
    }
}

#[test]
fn what_the_lens_may_change_belongs_to_the_sigma_of_the_height() {
    let with = |focal_sigma_percent| {
        let config = camera::Config { focal_sigma_percent, ..camera(90.0) };
        Calibration::new(&earth(), &flight_through(config, 16, 18.7, 0.5, Noise(0.3, 40.0, 0.5), 11))
    };
    let exact = with(0.0).unwrap();
    assert_eq!(exact.height.lens_km, 0.0);
    let permille = exact.focal.unwrap().km_per_permille.abs();
    let known = with(0.1).unwrap().height;
    assert!((known.lens_km / permille - 1.0).abs() < 1e-6, "{known:?} {permille}");
    let grown = known.sigma_km.powi(2) - exact.height.sigma_km.powi(2);
    assert!((grown.sqrt() / permille - 1.0).abs() < 1e-6 && known.km == exact.height.km, "{known:?}");
    // The lens of a data sheet.
    let refused = with(2.9).unwrap_err();
    assert!(matches!(refused, Refusal::Lens { lens_km, .. } if lens_km > 3.5), "{refused}");
    // After `sky` with the same pictures, the user must know what else would do.
    assert!(refused.to_string().contains("times as many pictures"), "{refused}");
}

const SENSOR: &str = "# mine\npreset = \"hzn\"\n\n[camera]\nwidth = 960\nheight = 720\nmodel = \"equidistant\"\nfx_px \
    = 600.0\n\
                      fy_px = 600.0\ncx_px = 479.5\ncy_px = 359.5\n\n[body]\nkind = \"earth-sphere\"\n# the old guess\n\
                      limb_height_km = 12.0 # from a book\nlimb_height_sigma_km = 3.0\n\n[consensus]\nthreshold_px = \
                      2.5\n";

#[test]
fn the_keys_are_written_and_all_other_text_stays() {
    let c = Calibration::new(&earth(), &flight(16, 90.0, 18.7, 0.5, Noise(0.3, 40.0, 0.5), 11)).unwrap();
    let written = into_sensor_toml(SENSOR, &c, "flight").unwrap();
    let text = &written.text;
    for kept in ["# mine\n", "# the old guess\n", "# from a book", "threshold_px = 2.5", "cx_px = 479.5"] {
        assert!(text.contains(kept), "{kept} in {text}");
    }
    assert!(text.contains("measured on 16 pictures of flight by `hzn calibrate noise`"), "{text}");
    let read = hzn_files::sensor::parse(text, std::path::Path::new("sensor.toml")).unwrap().config;
    let mut applied = hzn_files::sensor::parse(SENSOR, std::path::Path::new("sensor.toml")).unwrap().config;
    c.apply(&mut applied);
    assert_eq!(read, applied);
    // A second calibration replaces the comments of the first and does not repeat them.
    // A measured height replaces the table of a band, and the body still shines by itself.
    let band = SENSOR.replace("[body]\n", "[body]\nlimb = \"co2-15um\"\n");
    let band = into_sensor_toml(&band, &c, "flight").unwrap().text;
    assert!(band.contains("limb = \"height\"\n") && band.contains("sunlit = false\n"), "{band}");
    let again = into_sensor_toml(text, &c, "flight").unwrap();
    assert_eq!(again.text, *text);
}

#[test]
fn of_several_bodies_the_earth_gets_its_own_noise() {
    let bodies = SENSOR.replace(
        "[body]\nkind = \"earth-sphere\"",
        "[[bodies]]\nkind = \"sun\"\n\n[[bodies]]\nkind = \"earth-sphere\"",
    );
    let c = Calibration::new(&earth(), &flight(16, 90.0, 18.7, 0.5, Noise(0.3, 40.0, 0.5), 11)).unwrap();
    let written = into_sensor_toml(&bodies, &c, "flight").unwrap();
    let read = hzn_files::sensor::parse(&written.text, std::path::Path::new("sensor.toml")).unwrap().config;
    let mut applied = hzn_files::sensor::parse(&bodies, std::path::Path::new("sensor.toml")).unwrap().config;
    c.apply(&mut applied);
    assert_eq!(read, applied);
    let wide = super::config_for_calibration(&read).unwrap();
    assert_eq!((wide.body.kind, wide.bodies.len(), wide.body.limb_height_sigma_km), (Kind::EarthSphere, 0, 30.0));
}
