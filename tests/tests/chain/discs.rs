//! Tests Sun and Moon: discs inside and at the edge of the picture, blooming, lit from the side, and next to the Earth.

use hzn_core::body::{self, Kind};
use hzn_core::camera::{self, Camera, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::image::{Grey, Layout};
use hzn_core::pixel::ImagePoint;
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{Config, HostHorizon, Preset, Prior};
use hzn_host::Compiled;
use hzn_sim::pose::position_m;
use hzn_sim::{Detector, Light, Look, Pose, Scene, Visible, World};
use hzn_tests::disc::{Disc, direction, distance_px};
use hzn_tests::sensors::process;
use hzn_tests::{Answer, Sensors};

fn config(preset: Preset, focal_px: f64) -> Config {
    Config::preset(preset, camera::Config::ideal(Model::Pinhole, 640, 480, focal_px))
}

fn prior_with_sun<T: Real>(sun: Option<[f64; 3]>) -> Prior<T> {
    Prior { sun: sun.and_then(|s| UnitVec3::try_new(s.map(T::from_f64))), ..Prior::default() }
}

/// Returns the answers of both precisions.
fn process_both(sensors: &mut Sensors, data: &[u8], sun: Option<[f64; 3]>) -> [Result<Answer, Status>; 2] {
    let picture = Grey::try_new(data, Layout::packed(640, 480, 1, 8)).unwrap();
    [
        process(&mut sensors.host, &picture, &prior_with_sun(sun)),
        process(&mut sensors.flight, &picture, &prior_with_sun(sun)),
    ]
}

fn sun(axis: [f64; 3], half_angle_rad: f64) -> Disc {
    Disc { axis, half_angle_rad, sun: None, brightness: 900.0, halo: 60.0, blur_px: 0.9, noise: 3.0 }
}

#[test]
fn the_sun_blooms() {
    // The radius in the picture is 3.7 px without bloom, and up to ten times that with bloom.
    let config = config(Preset::Sun, 800.0);
    let mut sensors = Sensors::new(&config);
    let mut squares = [0.0; 2];
    let places = [(320.4, 240.3), (100.7, 60.2), (550.1, 400.9), (77.3, 411.6), (20.0, 240.5), (601.9, 30.8)];
    for (n, &(u, v)) in places.iter().enumerate() {
        for bloom in [1.0, 2.0, 5.0, 10.0f64] {
            let axis = direction(&config, u, v);
            let bloom = bloom.min(if n >= 4 { 4.0 } else { 10.0 });
            let data = sun(axis, 0.2666f64.to_radians() * bloom).paint(&config, 7 * n as u32 + 1);
            for (k, answer) in process_both(&mut sensors, &data, None).into_iter().enumerate() {
                let answer = answer.unwrap_or_else(|s| panic!("{u} {v}, bloom {bloom}: {s}"));
                let px = distance_px(&config, answer.axis, axis);
                squares[k] += px * px / 24.0;
                assert!(px < 0.3, "{u} {v}, bloom {bloom}: {px}");
            }
        }
    }
    let [host, flight] = squares.map(f64::sqrt);
    println!("inside: {host:.4} px in f64, {flight:.4} px in f32");
    assert!(host < 0.06 && flight < 0.06, "{host} {flight}");
}

#[test]
fn the_sun_at_the_edge_of_the_picture() {
    let config = config(Preset::Sun, 800.0);
    let mut sensors = Sensors::new(&config);
    // The radius is 19 px. The centre lies from 12 px inside to 8 px outside the picture.
    let mut worst = 0.0f64;
    let mut squares = 0.0;
    for n in 0..12 {
        let v = 100.3 + 20.7 * f64::from(n);
        let u = f64::from(12 - 20 * n / 11) - 0.4;
        let axis = direction(&config, u, v);
        let data = sun(axis, 0.2666f64.to_radians() * 5.0).paint(&config, n as u32 + 1);
        for answer in process_both(&mut sensors, &data, None) {
            let answer = answer.unwrap_or_else(|s| panic!("{u} {v}: {s}"));
            let px = distance_px(&config, answer.axis, axis);
            (worst, squares) = (worst.max(px), squares + px * px / 24.0);
        }
    }
    println!("at the edge: {:.3} px RMS, {worst:.3} px at worst", squares.sqrt());
    assert!(squares.sqrt() < 0.5 && worst < 1.5);
}

#[test]
fn single_precision_holds_a_twentieth_of_a_pixel_through_a_long_lens() {
    // As in the real picture, the radius is 203 px, so cos α differs from 1 by 1e-5.
    let config = config(Preset::Sun, 43_600.0);
    let mut sensors = Sensors::new(&config);
    for (u, v) in [(320.4, 240.3), (250.9, 260.1), (390.2, 220.7)] {
        let axis = direction(&config, u, v);
        let data = Disc { noise: 1.0, ..sun(axis, 0.2666f64.to_radians()) }.paint(&config, 5);
        let [host, flight] = process_both(&mut sensors, &data, None).map(Result::unwrap);
        let (px, radius_px) = (distance_px(&config, host.axis, flight.axis), |a: &Answer| a.half_angle_rad * 43_600.0);
        println!(
            "{u} {v}: f64 {:.4} px off, f32 {px:.4} px from it, radii {:.3} {:.3}",
            distance_px(&config, host.axis, axis),
            radius_px(&host),
            radius_px(&flight)
        );
        assert!(px < 0.02 && (radius_px(&host) - radius_px(&flight)).abs() < 0.02);
    }
}

#[test]
fn the_moon_is_lit_from_the_side() {
    let config = config(Preset::Moon, 6000.0);
    let mut sensors = Sensors::new(&config);
    let axis = direction(&config, 300.6, 250.2);
    let half_angle_rad = 0.2589f64.to_radians();
    let mut squares = [0.0; 2];
    let mut count = 0.0;
    // The phase angles go from a thick crescent to full, with the Sun on several sides.
    for phase_deg in [10.0f64, 50.0, 80.0, 100.0, 120.0] {
        for turn_deg in [0.0f64, 70.0, 200.0] {
            let (sp, cp) = phase_deg.to_radians().sin_cos();
            let (st, ct) = turn_deg.to_radians().sin_cos();
            let to_sun = [sp * ct, sp * st, -cp];
            let disc = Disc {
                axis,
                half_angle_rad,
                sun: Some(to_sun),
                brightness: 110.0,
                halo: 0.0,
                blur_px: 0.9,
                noise: 2.0,
            };
            let data = disc.paint(&config, phase_deg as u32 + turn_deg as u32);
            count += 1.0;
            for (k, known) in [None, Some(to_sun)].into_iter().enumerate() {
                for answer in process_both(&mut sensors, &data, known) {
                    let answer = answer.unwrap_or_else(|s| panic!("phase {phase_deg}, {turn_deg}, Sun {known:?}: {s}"));
                    let px = distance_px(&config, answer.axis, axis);
                    println!("phase {phase_deg}, {turn_deg}, Sun known {}: {px:.3} px", known.is_some());
                    squares[k] += px * px / 2.0;
                    assert!(px < 2.0, "phase {phase_deg}, {turn_deg}, Sun {known:?}: {px}");
                }
            }
        }
    }
    let [without, with] = squares.map(|s| (s / count).sqrt());
    println!("Moon: {without:.3} px without and {with:.3} px with the direction to the Sun");
    assert!(without < 0.5 && with < 0.5);
}

#[test]
fn the_moon_is_no_larger_than_it_blooms() {
    // Bloom adds a few pixels with any lens. A disc of twice the Moon's size is glare, a ghost or the Sun.
    for (focal_px, times, is_moon) in
        [(6000.0, 1.0, true), (6000.0, 1.2, true), (6000.0, 2.0, false), (800.0, 2.0, true)]
    {
        let config = config(Preset::Moon, focal_px);
        let axis = direction(&config, 300.6, 250.2);
        let disc = Disc { sun: None, ..sun(axis, 0.2589f64.to_radians() * times) };
        let data = Disc { halo: 0.0, ..disc }.paint(&config, 5);
        for answer in process_both(&mut Sensors::new(&config), &data, None) {
            assert_eq!(answer.is_ok(), is_moon, "{focal_px} px, {times}: {answer:?}");
            assert!(answer.is_ok() || matches!(answer, Err(Status::Rejected)), "{answer:?}");
        }
    }
}

#[test]
fn the_level_follows_the_limb_of_the_picture_before() {
    let mut config = config(Preset::Sun, 800.0);
    config.threshold.method = hzn_core::threshold::Method::Track;
    let mut sensors = Sensors::new(&config);
    let axis = direction(&config, 310.2, 250.4);
    // Each picture has two thirds of the brightness of the one before. No fixed threshold fits all of them, and the
    // disc is too small for the sample of `otsu`.
    let mut levels = Vec::new();
    for brightness in [240.0, 160.0, 107.0, 71.0, 47.0] {
        let disc = Disc { brightness, halo: 0.0, noise: 1.0, ..sun(axis, 0.2666f64.to_radians() * 10.0) };
        let data = disc.paint(&config, 3);
        let picture = Grey::try_new(&data, Layout::packed(640, 480, 1, 8)).unwrap();
        let expected = sensors.host.expect(&Prior::default()).unwrap();
        let report = sensors.host.find(&picture, &expected);
        assert_eq!(report.status, Status::Ok, "{brightness}");
        // The next threshold is halfway between the sky at 8 counts and the disc.
        let next = report.next_level.unwrap();
        assert!(f64::from(next).mul_add(1.0, -(8.0 + brightness / 2.0)).abs() < 6.0, "{brightness}: {next}");
        levels.push((report.level, next));
    }
    // Each picture uses the threshold that the picture before it gave.
    assert!(levels.windows(2).all(|w| w[1].0 == w[0].1), "{levels:?}");
    // Another configuration resets the threshold, and so does a picture without an answer.
    sensors.host.configure(&config).unwrap();
    let dark = vec![8u8; 640 * 480];
    let expected = sensors.host.expect(&Prior::default()).unwrap();
    let report = sensors.host.find(&Grey::try_new(&dark, Layout::packed(640, 480, 1, 8)).unwrap(), &expected);
    assert_eq!((report.status, report.next_level), (Status::NoLimb, None));
}

/// Tests the Moon above the Earth's limb, half lit like the Earth below it. The sensor answers both from one picture.
#[test]
fn earth_and_moon_in_one_picture() {
    let camera = camera::Config::ideal(Model::Pinhole, 1280, 960, 3600.0);
    let mut config = Config::preset(Preset::Moon, camera.clone());
    let body = |kind: Kind, preset: Preset| body::Config {
        kind,
        limb_height_km: if kind == Kind::Earth { 18.7 } else { 0.0 },
        limb_height_sigma_km: if kind == Kind::Earth { 2.0 } else { 0.0 },
        threshold: Some(Config::preset(preset, camera.clone()).threshold),
        ..body::Config::default()
    };
    let mut moon = body(Kind::Moon, Preset::Moon);
    // The Moon's ground is dark compared with clouds and air.
    if let Some(own) = &mut moon.threshold {
        own.level = 0.06;
    }
    config.bodies = [body(Kind::Earth, Preset::Hzn), moon].into_iter().collect();
    let mut horizon = HostHorizon::boxed(&config).unwrap();
    let lens = Camera::<f64>::try_new(&camera).unwrap();
    for (n, (u, v)) in [(400.3, 240.6), (860.8, 120.2), (640.1, 560.9)].into_iter().enumerate() {
        let look = Look { azimuth_rad: 0.7, depression_rad: 17f64.to_radians(), roll_rad: 0.0 };
        let pose = Pose::looking(position_m(30.0, 20.0, 400.0), look);
        let ecef = |s: [f64; 3]| pose.fixed_from_camera().unwrap().apply(&UnitVec3::try_new(s).unwrap()).xyz();
        let moon = ecef(lens.unproject(ImagePoint { u, v }).unwrap().xyz());
        let mut scene = Scene::new(camera.clone(), pose);
        scene.world = World::Visible(Box::new(Visible { sun_in_view: false, ..Visible::default() }));
        scene.body.limb_height_km = 18.7;
        // The Sun is to the right of the camera, behind it and above.
        let sun = [0.5, -0.7, -0.5];
        scene.light = Light::Sun { direction: ecef(sun), twilight_rad: 0.01 };
        scene.moon_ecef_m = Some([0, 1, 2].map(|i| pose.position_m[i] + 3.844e8 * moon[i]));
        scene.detector = Detector { psf_sigma_px: 0.9, read_noise: 0.01, ..Detector::default() };
        scene.seed = n as u64;
        let picture = scene.render().unwrap();
        let known = Prior { position_m: Some(pose.position_m), ..prior_with_sun(Some(sun)) };
        let expected = [0, 1].map(|which| horizon.expect_body(which, &known).unwrap());
        let reports = horizon.find_each(picture.view(), &expected);
        for (report, (kind, limit_deg)) in reports.iter().zip([(Kind::Earth, 0.1), (Kind::Moon, 0.016)]) {
            let truth = scene.body_truth(kind, "", 0.0).unwrap();
            let solution = report.solution.as_ref().unwrap_or_else(|| panic!("{kind:?} at {u} {v}: {}", report.status));
            let off_deg = solution.axis.angle_rad(&truth.axis().unwrap()).to_degrees();
            println!("{kind:?}, Moon at {u} {v}: {off_deg:.4} deg off");
            assert!(off_deg < limit_deg, "{kind:?} at {u} {v}: {off_deg}");
        }
    }
}
