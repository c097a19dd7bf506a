//! Drawn discs whose place is known: uncertain altitudes, small bodies, lost blocks, glow, and noise.

use hzn_core::body::Kind;
use hzn_core::camera::{self, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::image::{Grey, Layout};
use hzn_core::status::Status;
use hzn_core::verdict::Verdict;
use hzn_core::{Config, HostHorizon, Prior, Report};

/// A disc with its axis, half-angle in degrees, and brightness above the sky.
struct Disc {
    axis: [f64; 3],
    half_angle_deg: f64,
    brightness: f64,
}

/// Random numbers for noise.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    /// Returns a number that is nearly normal, with a sigma of 1.
    pub(crate) fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f64 / f64::from(1u32 << 24)
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

fn unit([x, y, z]: [f64; 3]) -> [f64; 3] {
    let n = (x * x + y * y + z * z).sqrt();
    [x / n, y / n, z / n]
}

/// Returns the angle between two directions in degrees, also a small one.
fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (unit(a), unit(b));
    let chord = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    2.0 * (chord / 2.0).asin().to_degrees()
}

fn sensor(width: u16, height: u16, focal_px: f64) -> Config {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, width, height, focal_px));
    config.body.kind = Kind::Sphere;
    config.body.radius_km = Some(1737.4);
    (config.body.limb_height_km, config.body.limb_height_sigma_km) = (0.0, 2.0);
    config
}

/// Draws discs with a soft edge of one pixel over a sky of `sky` counts with noise of `sigma` counts.
fn draw(config: &Config, discs: &[Disc], sky: f64, sigma: f64) -> Vec<u8> {
    let camera = &config.camera;
    let (w, h) = (u32::from(camera.width), u32::from(camera.height));
    let mut noise = Noise(7);
    (0..w * h)
        .map(|i| {
            let ray = unit([
                (f64::from(i % w) - camera.cx_px) / camera.fx_px,
                (f64::from(i / w) - camera.cy_px) / camera.fy_px,
                1.0,
            ]);
            let light: f64 = discs
                .iter()
                .map(|d| {
                    let inside_deg = d.half_angle_deg - angle_deg(ray, d.axis);
                    d.brightness * (0.5 + inside_deg.to_radians() * camera.fx_px).clamp(0.0, 1.0)
                })
                .sum();
            (sky + light + sigma * noise.normal()).round().clamp(0.0, 255.0) as u8
        })
        .collect()
}

fn process(config: &Config, data: &[u8]) -> Report<f64> {
    process_with(&Prior::default(), config, data)
}

fn process_with(prior: &Prior<f64>, config: &Config, data: &[u8]) -> Report<f64> {
    let mut horizon = HostHorizon::boxed(config).unwrap();
    let expected = horizon.expect(prior).unwrap();
    let layout = Layout::packed(config.camera.width.into(), config.camera.height.into(), 1, 8);
    horizon.process(&Grey::try_new(data, layout).unwrap(), &expected)
}

/// Asserts that the answer is within three sigmas of the truth.
fn assert_answer(report: &Report<f64>, axis: [f64; 3]) {
    let Some(found) = &report.solution else { panic!("{}: {:?}", report.status, report.candidates) };
    let (error, sigma) = (angle_deg(found.axis.xyz(), axis), found.covariance.sigma_max_rad().to_degrees());
    assert!(error <= 3.0 * sigma, "{error}° with a sigma of {sigma}°");
}

#[test]
fn an_uncertain_altitude_allows_the_half_angles_of_its_bounds() {
    let mut config = sensor(640, 480, 946.5);
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(6000.0), 5000.0);
    let moon = || Disc { axis: unit([0.05, -0.66, 0.75]), half_angle_deg: 33.34, brightness: 90.0 };
    let earth = || Disc { axis: unit([0.117, 0.032, 0.993]), half_angle_deg: 0.95, brightness: 150.0 };
    // The altitude of the limb is 1424 km, 0.9 sigmas from the given one. That of the disc is 103 000 km.
    let both = process(&config, &draw(&config, &[moon(), earth()], 6.0, 1.5));
    assert_answer(&both, moon().axis);
    let disc = process(&config, &draw(&config, &[earth()], 6.0, 1.5));
    assert!(disc.solution.is_none() && disc.status == Status::Rejected, "{:?}", disc.solution);
    // With a smaller sigma, the limb contradicts the altitude.
    config.body.altitude_sigma_km = 1000.0;
    let limb = process(&config, &draw(&config, &[moon()], 6.0, 1.5));
    assert!(limb.solution.is_none(), "{:?}", limb.solution);
}

#[test]
fn a_bright_patch_of_a_disc_is_no_body_far_away() {
    let mut config = sensor(640, 480, 686.0);
    config.fit.position = Some(true);
    let body = || Disc { axis: unit([0.03, -0.02, 1.0]), half_angle_deg: 15.0, brightness: 60.0 };
    // Nothing is expected of the half-angle, and the patch has the shape of a sphere that is nine times as far away.
    let patch = || Disc { axis: unit([0.1, 0.05, 1.0]), half_angle_deg: 1.7, brightness: 150.0 };
    let report = process(&config, &draw(&config, &[body(), patch()], 6.0, 1.5));
    if report.solution.is_some() {
        assert_answer(&report, body().axis);
    }
    assert!(report.candidates.iter().any(|edge| edge.verdict == Verdict::NoSky), "{:?}", report.candidates);
    // The same patch alone in the sky is a body.
    assert_answer(&process(&config, &draw(&config, &[patch()], 6.0, 1.5)), patch().axis);
}

#[test]
fn a_body_of_any_size_is_fitted_as_well() {
    // A radius of 40 px at every focal length: the half-angle is 4e-3 to 4e-6 rad.
    for focal_px in [1e4, 6e5, 1.2e6, 1e7] {
        let half_angle_deg = (40.0f64 / focal_px).to_degrees();
        let mut config = sensor(320, 240, focal_px);
        config.body.radius_km = Some(100.0);
        config.body.altitude_km = Some(100.0 * (1.0 / half_angle_deg.to_radians().sin() - 1.0));
        config.body.altitude_sigma_km = config.body.altitude_km.unwrap_or_default() * 0.01;
        let axis = unit([21.3 / focal_px, -17.7 / focal_px, 1.0]);
        let report = process(&config, &draw(&config, &[Disc { axis, half_angle_deg, brightness: 150.0 }], 6.0, 1.5));
        assert_answer(&report, axis);
        let found = report.solution.unwrap();
        let off_px = angle_deg(found.axis.xyz(), axis).to_radians() * focal_px;
        assert!(off_px < 0.1 && found.rms_px < 0.3, "{focal_px} px: {off_px} px, RMS {} px", found.rms_px);
        assert!((found.half_angle_rad.to_degrees() / half_angle_deg - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_disc_between_the_places_of_both_samples_is_found() {
    let mut config = sensor(3280, 2464, 2716.33);
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(527_887.0), 5300.0);
    for (u, v) in [(1137.3, 1789.6), (2920.8, 207.1)] {
        let axis = unit([(u - 1639.5) / 2716.33, (v - 1231.5) / 2716.33, 1.0]);
        let half_angle_deg = (8.9f64 / 2716.33).atan().to_degrees();
        let mut data = draw(&config, &[Disc { axis, half_angle_deg, brightness: 128.0 }], 1.0, 0.0);
        // Hot pixels are no body.
        (0..40).for_each(|k| data[k * 201_811 % (3280 * 2464)] = 255);
        let report = process(&config, &data);
        assert_answer(&report, axis);
        assert!(report.level > 40 && report.level < 90, "{}", report.level);
    }
    // In a black picture, the report says how many places were read.
    let black = process(&config, &vec![0; 3280 * 2464]);
    assert_eq!(black.status, Status::NoLimb);
    assert!(black.counters.sampled > 50_000, "{}", black.counters.sampled);
}

#[test]
fn grey_blocks_of_lost_packets_do_not_set_the_threshold() {
    let mut config = sensor(640, 480, 946.5);
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(7000.0), 3000.0);
    let moon = || Disc { axis: unit([-0.05, 0.02, 1.0]), half_angle_deg: 11.0, brightness: 16.0 };
    let mut data = draw(&config, &[moon()], 3.0, 1.0);
    for y in 0..16 {
        data[y * 640..y * 640 + 544].fill(128);
    }
    let report = process(&config, &data);
    assert_answer(&report, moon().axis);
    // Without noise every body has one grey: its pixels are no lost blocks.
    let mut clean = sensor(640, 480, 946.5);
    (clean.body.altitude_km, clean.body.altitude_sigma_km) = (Some(7000.0), 3000.0);
    assert_answer(&process(&clean, &draw(&clean, &[moon()], 0.0, 0.0)), moon().axis);
}

#[test]
fn the_first_threshold_is_above_the_noise_of_the_sky() {
    // A limb in a corner of a dark picture: most pixels are noise, and Otsu's threshold separates it.
    let mut config = sensor(640, 480, 946.5);
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(7000.0), 100.0);
    let half_angle_deg = (1737.4f64 / 8737.4).asin().to_degrees();
    let disc = || Disc { axis: unit([0.475, -0.32, 1.0]), half_angle_deg, brightness: 8.0 };
    // The noise is cut off at 0 counts. Its sigma is 2.5 counts, and the mean of the sky is 1 count.
    let report = process(&config, &draw(&config, &[disc()], 0.0, 2.5));
    assert!((7..=10).contains(&report.level), "threshold {}: {}", report.level, report.status);
    // A fixed threshold is the user's.
    config.threshold.method = hzn_core::threshold::Method::Fixed;
    config.threshold.level = 4.0;
    assert_eq!(process(&config, &draw(&config, &[disc()], 0.0, 2.5)).level, 4);
}

#[test]
fn a_camera_below_the_airglow_sees_no_glow() {
    // The light of the sky falls to a fifth over 80 px, much more slowly than the air of the standard atmosphere.
    let limb = |altitude_km: f64| {
        let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 518.0));
        config.body.kind = Kind::EarthSphere;
        config.body.altitude_km = Some(altitude_km);
        let half_angle_deg = ((6371.0088 + 17.0) / (6371.0088 + altitude_km)).asin().to_degrees();
        let axis = unit([0.41, 0.895, 0.173]);
        let mut noise = Noise(3);
        let data: Vec<u8> = (0..640 * 480u32)
            .map(|i| {
                let ray = [(f64::from(i % 640) - 319.5) / 518.0, (f64::from(i / 640) - 239.5) / 518.0, 1.0];
                let above_px = (angle_deg(ray, axis) - half_angle_deg).to_radians() * 518.0;
                let sky = 12.0 + 60.0 * (-above_px.max(0.0) / 50.0).exp();
                let step = 80.0 * (0.5 - above_px / 3.0).clamp(0.0, 1.0);
                (sky + step + noise.normal()) as u8
            })
            .collect();
        (process(&config, &data), axis)
    };
    let (below, axis) = limb(60.0);
    assert_answer(&below, axis);
    let (above, _) = limb(400.0);
    assert!(above.solution.is_none(), "{:?}", above.solution);
}

/// Draws an edge in the place of the Earth's limb from 400 km. `light` is the brightness above the sky, as a part of
/// that of the body, at a height above the edge in km and at an image point.
fn earth_edge(light: impl Fn(f64, [f64; 2]) -> f64) -> Vec<u8> {
    let (half_angle_deg, per_px) = ((6388.0 / 6771.0f64).asin().to_degrees(), 1.0 / 1200f64);
    let axis = unit([0.1, 0.94, 0.33]);
    let mut noise = Noise(9);
    (0..640 * 480)
        .map(|i| {
            let at = [f64::from(i % 640), f64::from(i / 640)];
            let ray = unit([(at[0] - 319.5) * per_px, (at[1] - 239.5) * per_px, 1.0]);
            // The distance of the limb is 2244 km.
            let above_km = (angle_deg(ray, axis) - half_angle_deg).to_radians() * 2244.0;
            (5.0 + 180.0 * light(above_km, at) + 1.5 * noise.normal()).round().clamp(0.0, 255.0) as u8
        })
        .collect()
}

/// Light of sunlit air at a height above the edge, as a part of that of thick air.
fn air(above_km: f64) -> f64 {
    -(-core::f64::consts::LN_2 * (-above_km / 7.5).exp()).exp_m1()
}

/// Light of the limb by day: the body becomes darker inwards.
fn limb_light(above_km: f64) -> f64 {
    air(above_km) * (1.0 - 0.2 * (-above_km / 100.0).clamp(0.0, 1.0))
}

fn earth_sensor() -> Config {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 1200.0));
    config.body.kind = Kind::EarthSphere;
    config.body.altitude_km = Some(400.0);
    config.gates.min_p_limb = 0.0;
    config
}

fn p_limb_of(config: &Config, light: impl Fn(f64, [f64; 2]) -> f64) -> f64 {
    process(config, &earth_edge(light)).solution.and_then(|s| s.p_limb).expect("the edge has a probability")
}

#[test]
fn what_lies_on_both_sides_of_an_edge_is_evidence() {
    let config = earth_sensor();
    let odds = |p: f64| p / (1.0 - p);
    let day = p_limb_of(&config, |km, _| limb_light(km));
    assert!(day > 0.98, "{day}");
    // A flat body, as that of a ghost.
    let flat = p_limb_of(&config, |km, _| air(km));
    assert!(odds(flat) < 0.1 * odds(day), "flat {flat} {day}");
    // The light of a layer of airglow falls with the root of the depth, and ends at the limb of the ground.
    let layer = |km: f64| air(km) * (15.0 / (-km).max(15.0)).sqrt();
    let night = p_limb_of(&config, |km, _| layer(km) * if km < -95.0 { 0.6 } else { 1.0 });
    let without_end = p_limb_of(&config, |km, _| layer(km));
    assert!(odds(night) < 0.05 * odds(without_end), "layer {night} {without_end}");
    // Ground beyond the edge is uneven, and not dark.
    let mottled = |km: f64, [u, _]: [f64; 2]| limb_light(km) + 0.11 * (1.0 + (u / 20.0).sin());
    let coast = p_limb_of(&config, mottled);
    assert!(odds(coast) < 0.8 * odds(day), "mottled {coast} {day}");
    // A thermal camera sees no sunlit air, so that none of it is evidence.
    let mut thermal = config.clone();
    thermal.body.sunlit = Some(false);
    let [flat, day] = [p_limb_of(&thermal, |km, _| air(km)), p_limb_of(&thermal, |km, _| limb_light(km))];
    assert!(flat > 0.9 && (odds(flat) / odds(day)).ln().abs() < 1.0, "thermal {flat} {day}");
}

#[test]
fn the_sun_is_evidence_only_where_a_gate_asks_for_its_light() {
    let mut config = earth_sensor();
    let data = earth_edge(|km, _| air(km));
    let sun = UnitVec3::try_new(unit([-0.1, -0.94, -0.33]));
    assert!(sun.is_some());
    let odds = |prior: &Prior<f64>, config: &Config| {
        let p = process_with(prior, config, &data).solution.and_then(|s| s.p_limb).unwrap();
        p / (1.0 - p)
    };
    let (told, untold) = (Prior { sun, ..Prior::default() }, Prior::default());
    let without = odds(&untold, &config);
    // Of the edges that are no limb, two in five follow the body all the same, and the Sun would light the wrong side
    // of half of the others: seven in ten pass.
    let ratio = odds(&told, &config) / without;
    assert!((ratio - 10.0 / 7.0).abs() < 1e-6, "{ratio}");
    config.gates.max_unlit = 1.0;
    assert_eq!(odds(&told, &config), odds(&untold, &config));
}

#[test]
fn an_edge_without_air_is_an_unlikely_limb() {
    let mut config = earth_sensor();
    let limb = p_limb_of(&config, |km, _| limb_light(km));
    let sharp = |km: f64, _: [f64; 2]| f64::from(u8::from(km < 0.0));
    let ghost = p_limb_of(&config, sharp);
    assert!(limb > 0.98 && ghost < 0.5, "{limb} {ghost}");
    config.gates.min_p_limb = 0.75;
    assert_eq!(p_limb_of(&config, |km, _| limb_light(km)), limb);
    let refused = process(&config, &earth_edge(sharp));
    assert!(refused.solution.is_none(), "{:?}", refused.solution);
    assert!(refused.candidates.iter().any(|c| c.verdict == Verdict::Unlikely), "{:?}", refused.candidates);
    config.gates.min_p_limb = 0.0;
    // Rarer limbs make every edge less probable.
    config.gates.prior_odds = 0.01;
    assert!(p_limb_of(&config, |km, _| limb_light(km)) < 0.5 * limb);
    // The weights are those of the Earth.
    let moon = sensor(640, 480, 600.0);
    let config = Config { body: hzn_core::body::Config { altitude_km: Some(500.0), ..moon.body.clone() }, ..moon };
    let half_angle_deg = (1737.4f64 / 2237.4).asin().to_degrees();
    let disc = Disc { axis: unit([0.1, 0.8, 0.6]), half_angle_deg, brightness: 180.0 };
    let moon = process(&config, &draw(&config, &[disc], 5.0, 1.5));
    assert!(moon.solution.is_some_and(|s| s.p_limb.is_none()));
}

#[test]
fn an_edge_in_the_air_above_the_limb_is_no_limb() {
    let data = earth_edge(|km, _| limb_light(km));
    let mut config = earth_sensor();
    // The points are at the threshold, wherever it is.
    config.edge_points.sub_pixel = hzn_core::edge_points::SubPixel::None;
    config.threshold.method = hzn_core::threshold::Method::Fixed;
    (config.body.limb_height_km, config.body.limb_height_sigma_km) = (17.0, 10.0);
    // A thermal camera sees no sunlit air, so that the gate is off.
    let mut unguarded = config.clone();
    unguarded.body.sunlit = Some(false);
    let height_km = |config: &Config| {
        let solution = process(config, &data).solution?;
        Some((solution.half_angle_rad - (6388.0 / 6771.0f64).asin()) * 2244.0)
    };
    for level in [13, 16, 20, 60, 80, 95, 110] {
        (config.threshold.level, unguarded.threshold.level) = (f64::from(level), f64::from(level));
        let [answer, without] = [height_km(&config), height_km(&unguarded)];
        println!("threshold {level}: {answer:?} km, without the gate {without:?} km");
        if level <= 20 {
            assert!(answer.is_none() && without.is_some_and(|km| km > 5.0), "threshold {level}: {without:?} km");
        } else {
            assert!(answer == without && answer.is_some_and(|km| km < 7.5), "threshold {level}: {answer:?} km");
        }
    }
}

/// Draws a circle of the picture and processes it. Returns the report and the true axis.
fn circle(config: &Config, centre: [f64; 2], radius_px: f64) -> (Report<f64>, [f64; 3]) {
    let camera = &config.camera;
    let width = u32::from(camera.width);
    let pixel = |i: u32| {
        let off = (f64::from(i % width) - centre[0]).hypot(f64::from(i / width) - centre[1]);
        (128.0 * (radius_px + 0.5 - off).clamp(0.0, 1.0)) as u8
    };
    let data: Vec<u8> = (0..width * u32::from(camera.height)).map(pixel).collect();
    let axis = unit([(centre[0] - camera.cx_px) / camera.fx_px, (centre[1] - camera.cy_px) / camera.fy_px, 1.0]);
    (process(config, &data), axis)
}

/// Off the axis, a disc is an ellipse. Blur of a tenth of a pixel makes a circle of a small ellipse, and a large circle
/// is a ghost.
#[test]
fn only_a_large_disc_is_told_from_a_circle() {
    for (centre, radius_px) in [([205.3, 410.6], 9.0), ([70.8, 61.2], 6.4), ([520.1, 33.7], 12.3)] {
        let mut config = sensor(640, 480, 1100.0);
        let off = unit([centre[0] - 319.5, centre[1] - 239.5, 1100.0])[2];
        let half_angle = (radius_px * off / 1100.0 * off.sqrt()).atan();
        config.body.altitude_km = Some(1737.4 * (1.0 / half_angle.sin() - 1.0));
        config.body.altitude_sigma_km = config.body.altitude_km.unwrap_or_default() * 0.02;
        let (report, axis) = circle(&config, centre, radius_px);
        assert_answer(&report, axis);
    }
    let mut config = sensor(640, 480, 500.0);
    config.body.altitude_km = Some(1737.4 * (1.0 / 0.14f64.sin() - 1.0));
    config.body.altitude_sigma_km = config.body.altitude_km.unwrap_or_default() * 0.1;
    let (report, _) = circle(&config, [500.0, 100.0], 86.0);
    assert_eq!(report.candidates.first().map(|c| c.verdict), Some(Verdict::Circle), "{report:?}");
    assert!(report.solution.is_none());
}

/// Draws an outline of the mean radius 22 px: `radius_px` is its radius by the angle. The Earth has this size from
/// 36 000 km through a lens of 150 px.
fn outline(radius_px: impl Fn(f64) -> f64) -> (Config, Vec<u8>) {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 320, 240, 150.0));
    config.body.kind = Kind::EarthSphere;
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(37_000.0), 2000.0);
    let mut noise = Noise(5);
    let data = (0..320 * 240)
        .map(|i| {
            let [x, y] = [f64::from(i % 320) - 172.3, f64::from(i / 320) - 108.8];
            let depth_px = radius_px(y.atan2(x)) - x.hypot(y);
            (6.0 + 150.0 * (0.5 + depth_px).clamp(0.0, 1.0) + 1.5 * noise.normal()) as u8
        })
        .collect();
    (config, data)
}

#[test]
fn an_outline_with_corners_is_no_small_disc() {
    // A regular polygon with this number of corners, whose mean radius is 22 px.
    let polygon = |corners: f64| {
        let half = core::f64::consts::PI / corners;
        let mean = (core::f64::consts::FRAC_PI_4 + half / 2.0).tan().ln() / half;
        outline(move |angle: f64| 22.0 / mean / ((angle + 20.0).rem_euclid(2.0 * half) - half).cos())
    };
    let (config, disc) = outline(|_| 22.0);
    let disc = process(&config, &disc).solution.expect("a disc");
    assert!(disc.rms_px < 0.15 && disc.p_limb.is_some_and(|p| p > 0.99), "{:?} {}", disc.p_limb, disc.rms_px);
    let (config, pentagon) = polygon(5.0);
    let report = process(&config, &pentagon);
    assert!(report.solution.is_none(), "{:?}", report.solution);
    assert!(report.candidates.iter().any(|c| c.verdict == Verdict::Residuals), "{:?}", report.candidates);
    // What a gate cannot refuse is less probable.
    let (config, octagon) = polygon(8.0);
    if let Some(octagon) = process(&config, &octagon).solution {
        let odds = |p: Option<f64>| p.map_or(0.0, |p| p / (1.0 - p));
        assert!(odds(octagon.p_limb) < 0.2 * odds(disc.p_limb), "{:?} {:?}", octagon.p_limb, disc.p_limb);
    }
}
