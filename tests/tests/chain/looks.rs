//! Tests that the search alone does not make the sensor refuse a picture: discs under an image circle, a dark frame,
//! thresholds that follow the clouds, arrays of few pixels, words with few used bits.

use hzn_core::body::{self, Kind};
use hzn_core::camera::{self, Model};
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::image::{Grey, Layout};
use hzn_core::status::Status;
use hzn_core::threshold::{self, Method};
use hzn_core::{Config, HostHorizon, Prior, Report};
use hzn_host::Compiled;
use hzn_sim::painted::LensWithDiscs;
use hzn_sim::pose::position_m;
use hzn_sim::{Clouds, Light, Look, Pose, Scene, Visible};
use hzn_tests::real::Photograph;
use hzn_tests::sensors::process;
use hzn_tests::{Sensors, Tally};

/// Returns the configuration of a sensor with a fixed threshold and with the disc's altitude.
fn fixed_threshold_config(lens: &camera::Config, altitude_km: f64, level: f64) -> Config {
    let mut config = Config::new(lens.clone());
    config.body = body::Config {
        kind: Kind::EarthSphere,
        altitude_km: Some(altitude_km),
        altitude_sigma_km: 1.0,
        limb_height_km: 0.0,
        limb_height_sigma_km: 2.0,
        ..config.body
    };
    config.threshold = threshold::Config { method: Method::Fixed, level, ..config.threshold };
    config
}

fn process_picture(horizon: &mut HostHorizon, data: &[u8], lens: &camera::Config) -> Report<f64> {
    let picture = Grey::try_new(data, Layout::packed(lens.width.into(), lens.height.into(), 1, 8)).unwrap();
    let expected = horizon.expect(&Prior::default()).unwrap();
    horizon.find(&picture, &expected)
}

/// Tests random discs under an image circle, each at ten thresholds; at least half of the outline is in view. A disc
/// may touch the image circle over fewer pixels than the strides along the border. Then only a search line meets its
/// edge at first, and it gives only a part of the edge. The sensor must find every disc within 0.2°.
#[test]
fn no_disc_is_lost_under_an_image_circle() {
    let (mut count, mut lost) = (0, Vec::new());
    for circle in 0..10 {
        let with_discs = LensWithDiscs::new(circle, 6);
        for (disc, altitude_km) in &with_discs.discs {
            let data = with_discs.canvas.paint(disc);
            let axis = UnitVec3::try_new(disc.axis).unwrap();
            for k in 0..10 {
                let level = disc.dark + (disc.lit - disc.dark) * (0.05 + 0.09 * f64::from(k));
                let mut horizon =
                    HostHorizon::boxed(&fixed_threshold_config(&with_discs.lens, *altitude_km, level)).unwrap();
                let report = process_picture(&mut horizon, &data, &with_discs.lens);
                let right = report.solution.is_some_and(|s| s.axis.angle_rad(&axis).to_degrees() < 0.2);
                count += 1;
                if !right {
                    lost.push((circle, *disc, level, report.status, report.counters));
                }
            }
        }
    }
    assert!(count == 600 && lost.is_empty(), "{} of {count}: {lost:#?}", lost.len());
}

/// Tests a picture with a black frame of one pixel, which demosaicing left, and with wide haze. The haze fades over 25
/// pixels of this reduced picture. At every threshold the sensor answers, both precisions agree within 0.001°, and the
/// answers differ by less than their sigma. (The largest difference is 0.11°, which is 4.6 pixels.)
#[test]
fn a_dark_frame_and_a_wide_haze_leave_the_answer_alone() {
    let mut p = Photograph::load("opssat-2020-08-16.png");
    let answer = |sensor: &Config| {
        let sensors = &mut Sensors::new(sensor);
        let [host, flight] = [
            process(&mut sensors.host, p.view(), &Prior::default()),
            process(&mut sensors.flight, p.view(), &Prior::default()),
        ];
        let why = || {
            let mut horizon = HostHorizon::boxed(sensor).unwrap();
            let expected = horizon.expect(&Prior::default()).unwrap();
            format!("{:?}", horizon.find(p.view(), &expected).candidates)
        };
        let (host, flight) = (
            host.unwrap_or_else(|s| panic!("{s}: {}", why())),
            flight.unwrap_or_else(|s| panic!("f32, {s}: {}", why())),
        );
        assert!(host.error_deg(flight.axis) < 1e-3);
        host
    };
    let mut axes = vec![answer(&p.sensor).axis];
    for level in [0.08, 0.12, 0.16, 0.2, 0.3, 0.4, 0.5] {
        let mut sensor = p.sensor.clone();
        sensor.threshold = threshold::Config { method: Method::Fixed, level, ..sensor.threshold };
        let found = answer(&sensor);
        println!(
            "level {level}: {} of {} points, RMS {:.2} px, {:.5?}",
            found.inliers, found.points, found.rms_px, found.axis
        );
        let difference_deg = axes.iter().map(|&axis| found.error_deg(axis)).fold(0.0, f64::max);
        assert!(difference_deg < found.sigma_deg(), "level {level}: {difference_deg}, sigma {}", found.sigma_deg());
        axes.push(found.axis);
    }
    // If the frame is not left out, the picture's own outline belongs to the edge. The sensor then has no answer, or
    // fewer than half of the points are inliers.
    p.sensor.retry.frame_px = 0;
    p.sensor.threshold = threshold::Config { method: Method::Fixed, level: 0.08, ..p.sensor.threshold };
    let with = process(&mut Sensors::new(&p.sensor).host, p.view(), &Prior::default());
    assert!(
        with.is_err() || with.is_ok_and(|a| 2 * a.inliers < a.points && a.error_deg(axes[0]) < a.sigma_deg()),
        "{with:?}"
    );
}

/// Returns a disc that is seen from far above and lit from the side, with bright clouds over ground of the brightness
/// `ground` + 0.1 times a random number.
fn half_lit_disc(n: u32, ground: f64) -> Scene {
    let random =
        |k: u32| f64::from((n + 1u32).wrapping_mul(2_654_435_761).wrapping_add(k * 40_503_001) >> 8 & 0xFFFF) / 65536.0;
    let altitude_km = 3000.0 * 10f64.powf(random(1));
    let half_angle = (6371.0 / (6371.0 + altitude_km)).asin();
    let lens = camera::Config::ideal(Model::Pinhole, 320, 320, 320.0 * (0.25 + 0.15 * random(2)) / half_angle.tan());
    let turn = std::f64::consts::TAU;
    let look_to =
        Look { azimuth_rad: turn * random(3), depression_rad: (89.0 - 3.0 * random(4)).to_radians(), roll_rad: 0.3 };
    let pose = Pose::looking(position_m(120.0 * random(5) - 60.0, 20.0, altitude_km), look_to);
    let (phase, side) = ((60.0 + 40.0 * random(6)).to_radians(), turn * random(7));
    let sun = [phase.sin() * side.cos(), phase.sin() * side.sin(), -phase.cos()];
    let direction = pose.fixed_from_camera().unwrap().apply(&UnitVec3::try_new(sun).unwrap()).xyz();
    let mut scene = Scene::new(lens, pose);
    let clouds = Clouds { cover: 0.3 + 0.3 * random(8), brightness: 0.9, seed: n.into(), ..Visible::default().clouds };
    scene.disc = hzn_sim::Disc { surface: ground + 0.1 * random(9), clouds: Some(clouds), band: None };
    scene.light = Light::Sun { direction, twilight_rad: 0.02 };
    scene.body.limb_height_km = 15.0;
    (scene.detector.psf_sigma_px, scene.detector.read_noise, scene.seed) = (0.9, 0.01, n.into());
    scene
}

/// Returns the report of a disc with these thresholds of further looks, and the true axis.
fn look_at(scene: &Scene, levels: &[f64]) -> (Report<f64>, UnitVec3<Cam, f64>) {
    let (picture, axis) = (scene.render().unwrap(), scene.truth("", 0.0).unwrap().axis().unwrap());
    let mut config = Config::new(scene.camera.clone());
    (config.body.limb_height_km, config.body.limb_height_sigma_km) = (17.0, 7.0);
    config.retry.levels = levels.iter().copied().collect();
    let mut horizon = HostHorizon::boxed(&config).unwrap();
    let expected = horizon.expect(&hzn_tests::prior_of_scene(scene)).unwrap();
    (horizon.find(picture.view(), &expected), axis)
}

/// Tests discs that are seen from far above and lit from the side, with bright clouds over dark ground. Otsu's
/// threshold may follow the clouds, so the first look does not answer every picture. After the further looks every
/// picture has an answer, with an error below five sigma.
#[test]
fn half_lit_discs_are_looked_at_again() {
    let levels = Config::new(half_lit_disc(0, 0.12).camera).retry.levels;
    let (mut answered, mut at_once) = (0, 0);
    let count = 24;
    for n in 0..count {
        let scene = half_lit_disc(n, 0.12);
        let [(one, axis), (several, _)] = [&[], levels.as_slice()].map(|levels| look_at(&scene, levels));
        println!(
            "{n}: {} once, {} after {} looks: {:?}",
            one.status, several.status, several.counters.looks, several.candidates
        );
        assert_eq!(one.counters.looks, 1);
        // The sensor takes no further look if the first gives an answer.
        assert!(one.status != Status::Ok || several.counters == one.counters);
        at_once += u32::from(one.status == Status::Ok);
        if let Some(s) = several.solution {
            answered += 1;
            let off = s.axis.angle_rad(&axis);
            assert!(off < 5.0 * s.covariance.sigma_max_rad(), "{n}: {:.3}°", off.to_degrees());
        }
    }
    println!("{at_once} of {count} at the first level, {answered} after all looks");
    assert!(answered == count && at_once < count, "{at_once}, {answered}");
}

/// Tests the same discs over ground as dark as an ocean. Some clouds are so much brighter than most of the limb that
/// only a look just above the noise of the sky shows the whole limb. In a few pictures even that look does not: the
/// limb between the clouds is within three sigmas of the noise.
#[test]
fn half_lit_discs_over_dark_ground_are_answered_above_the_noise() {
    let (mut answered, mut without) = (0, 0);
    let count = 60;
    for n in 100..100 + count {
        let scene = half_lit_disc(n, 0.02);
        let (before, _) = look_at(&scene, &[0.5, 0.25, 2.0]);
        let (found, axis) = look_at(&scene, &[0.5, 0.25, 2.0, 0.0]);
        without += u32::from(before.solution.is_some());
        let Some(s) = found.solution else {
            println!("{n}: {:?}", found.candidates);
            continue;
        };
        answered += 1;
        let off = s.axis.angle_rad(&axis);
        assert!(off < 5.0 * s.covariance.sigma_max_rad(), "{n}: {:.3}°", off.to_degrees());
    }
    println!("{answered} of {count}, {without} without the look above the noise");
    assert!(answered > without && 10 * answered >= 8 * count, "{answered}, {without}");
}

/// Tests a limb through a lens of 55 degrees on an array of 32×24. Of the 16 bits, a range of 1200 counts above a sky
/// at 7000 is used. The sensor knows only the camera and the altitude. It answers every picture, and the RMS of its
/// errors is below twice the bound.
#[test]
fn a_thermal_array_answers_by_default() {
    let camera = camera::Config::ideal(Model::Equidistant, 32, 24, 33.0);
    let mut sensor = Config::new(camera.clone());
    sensor.body.kind = Kind::EarthSphere;
    let mut known = sensor.clone();
    // This sensor gives the bound: a known half-angle, and independent points with the errors of the points in the
    // picture.
    known.fit.half_angle = hzn_core::fit::HalfAngle::Known;
    (known.covariance.sigma_px, known.covariance.correlation_px) = (1e-3, 0.0);
    let body = sensor.body.clone();
    let [mut sensor, mut known] = [sensor, known].map(|c| HostHorizon::boxed(&c).unwrap());
    let (mut tally, mut bound_deg2, mut count) = (Tally::default(), 0.0, 0.0);
    for seed in 0..60u32 {
        let random =
            |k: u32| f64::from(seed.wrapping_mul(2_654_435_761).wrapping_add(k * 40_503) >> 8 & 0xFFFF) / 65536.0;
        let look_to = Look {
            azimuth_rad: core::f64::consts::TAU * random(1),
            depression_rad: (16.0 + 8.0 * random(2)).to_radians(),
            roll_rad: core::f64::consts::TAU * random(3),
        };
        let mut scene = Scene::new(camera.clone(), Pose::looking(position_m(20.0, 10.0, 400.0), look_to));
        scene.body = body.clone();
        (scene.detector.psf_sigma_px, scene.detector.read_noise, scene.seed) = (0.7, 0.01, seed.into());
        let grey = scene.render().unwrap();
        let view = grey.view();
        let words: Vec<u16> = (0..24 * 32u16)
            .map(|i| 7000 + (f64::from(hzn_core::image::Pixels::at(&view, i % 32, i / 32)) * 1200.0 / 255.0) as u16)
            .collect();
        let picture = Grey::try_new(&words[..], Layout::packed(32, 24, 1, 16)).unwrap();
        let truth = scene.truth("", 0.0).unwrap();
        let prior = hzn_tests::prior_of_scene(&scene);
        let answer = process(&mut sensor, &picture, &prior);
        if let Err(status) = answer {
            let expected = sensor.expect(&prior).unwrap();
            println!("{seed}: {status}, {:?}", sensor.find(&picture, &expected).candidates);
        }
        tally.add(answer.as_ref().ok(), [truth.axis_x, truth.axis_y, truth.axis_z]);
        if let Ok(bound) = process(&mut known, &picture, &prior) {
            let p = bound.covariance_rad2;
            bound_deg2 += (p[0][0] + p[1][1] + p[2][2]).sqrt().to_degrees().powi(2);
            count += 1.0;
        }
    }
    let ratio = tally.rms_deg() / (bound_deg2 / count).sqrt();
    println!("{tally}, {ratio:.2} of the bound");
    assert_eq!(tally.answered(), 60);
    assert!(ratio < 2.0, "{ratio}");
}
