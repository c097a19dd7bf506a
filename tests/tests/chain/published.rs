//! Tests the presets of published systems on rendered scenes: they must answer as well as their methods can.

use hzn_core::camera::{self, Camera, Model};
use hzn_core::edge_points::SubPixel;
use hzn_core::{Config, Preset, fit};
use hzn_sim::flight::{Flight, leo_infrared, rocket};
use hzn_sim::pose::position_m;
use hzn_sim::{Detector, Disc, EdgeNoise, Look, Pose, Scene};
use hzn_tests::sensors::process;
use hzn_tests::{Sensors, Tally};

/// Runs a flight through the f64 sensor of a preset with the flight's camera, body and mask; `change` alters the
/// configuration.
fn fly(flight: &Flight, preset: Preset, change: impl Fn(&mut Config)) -> Tally {
    let mut config = Config::preset(preset, flight.sensor.camera.clone());
    config.body = flight.sensor.body.clone();
    config.mask = flight.sensor.mask.clone();
    change(&mut config);
    let mut sensors = Sensors::new(&config);
    let mut tally = Tally::default();
    for frame in &flight.frames {
        let truth = frame.truth().unwrap();
        let answer = process(&mut sensors.host, frame.render().unwrap().view(), &frame.prior());
        if let Err(status) = &answer {
            println!("{}: {status}", frame.file);
        }
        tally.add(answer.as_ref().ok(), [truth.axis_x, truth.axis_y, truth.axis_z]);
    }
    println!("{} {}: {tally}", flight.name, preset.name());
    tally
}

/// Tests Braun & Barf 2022 on the kind of flight that they built it for. Two thousand points compensate for whole
/// pixels and a free half-angle. The overbound makes the covariance far too large.
#[test]
fn braun_barf_on_a_rocket_flight() {
    let tally = fly(&rocket(1920, 1080, 8, 1), Preset::Dlr2022, |_| {});
    assert_eq!(tally.answered(), tally.frames, "{tally}");
    assert!(tally.rms_deg() < 0.1 && tally.worst_deg() < 0.5, "{tally}");
    assert!(tally.mean_nees() < 0.5, "{tally}");
}

/// Tests the same with a masked part of the vehicle in view, and half the resolution. It also tests the conic in place
/// of the direct nadir; the conic has three more unknowns.
#[test]
fn braun_barf_with_payload_in_view() {
    let flight = rocket(960, 540, 6, 3).with_payload();
    let tally = fly(&flight, Preset::Dlr2022, |_| {});
    assert_eq!(tally.answered(), tally.frames, "{tally}");
    assert!(tally.rms_deg() < 0.3 && tally.worst_deg() < 1.0, "{tally}");
    let tally = fly(&flight, Preset::Dlr2022, |config| config.fit.method = fit::Method::Conic);
    assert!(tally.answered() * 2 >= tally.frames && tally.worst_deg() < 20.0, "{tally}");
}

/// Tests Wang et al. 2022 on the kind of scene that they built it for, by off-nadir angle. They report 0.04° with the
/// whole Earth in view and 0.16° at 120°. The preset uses neither the altitude nor the size of the Earth here.
#[test]
fn wang_on_an_infrared_earth() {
    let flight = leo_infrared(25, 1);
    for (frames, rms_deg) in [(0..13, 0.03), (13..20, 0.07), (20..25, 0.25)] {
        let part = Flight { frames: flight.frames[frames].to_vec(), ..flight.clone() };
        let tally = fly(&part, Preset::Zju2022, |config| config.covariance = flight.sensor.covariance);
        assert_eq!(tally.answered(), tally.frames, "{tally}");
        assert!(tally.rms_deg() < rms_deg && tally.worst_deg() < 2.0 * rms_deg, "{tally}");
        // The chain `hzn` uses the known size of the Earth, here with the best edge points.
        let best = fly(&part, Preset::Hzn, |config| {
            config.covariance = flight.sensor.covariance;
            config.edge_points.sub_pixel = SubPixel::Erf;
            config.edge_points.keep_points = 0;
        });
        assert_eq!(best.answered(), best.frames, "{best}");
        assert!(best.rms_deg() < tally.rms_deg() && best.rms_deg() < 0.04, "{best} against {tally}");
        let _ = fly(&part, Preset::Hzn, |config| config.covariance = flight.sensor.covariance);
        // The bias of the moments changes from pixel to pixel and counts as noise, so the covariance is too large.
        assert!((0.1..2.5).contains(&tally.mean_nees()), "{tally}");
    }
}

/// Widens HORACE's own limits, which are for its camera and rocket: here it may see the Earth from 1 to 1000 km, and in
/// full size.
fn anywhere(config: &mut Config) {
    config.input.scale_to_height = None;
    config.gates.altitude_limits_km = Some([1.0, 1000.0]);
    config.gates.radius_margin = 0.5;
}

/// Tests HORACE where it is right: the camera points at the Earth. These are the first frames of a swing that starts
/// straight down.
#[test]
fn horace_near_nadir() {
    let mut flight = leo_infrared(25, 1);
    flight.frames.truncate(6);
    let tally = fly(&flight, Preset::Horace2015, anywhere);
    assert_eq!(tally.answered(), tally.frames, "{tally}");
    assert!(tally.rms_deg() < 1.0 && tally.worst_deg() < 2.0, "{tally}");
}

/// Returns a flight with HORACE's own geometry: a pinhole camera on the side of a rocket at 80 km looks at the horizon,
/// and the Earth is bright. The circle's centre then differs from the nadir by up to about 20°.
fn horizon_camera(frames: usize) -> Flight {
    let mut flight = rocket(720, 576, frames, 1);
    let camera = camera::Config::ideal(Model::Pinhole, 720, 576, 600.0);
    flight.sensor.camera = camera.clone();
    for (i, frame) in flight.frames.iter_mut().enumerate() {
        let look =
            Look { azimuth_rad: i as f64, depression_rad: (2.0 * i as f64).to_radians(), roll_rad: 0.3 * i as f64 };
        frame.scene.camera = camera.clone();
        frame.scene.pose = Pose::looking(position_m(67.9, 21.1, 80.0), look);
        frame.scene.disc = Disc { surface: 0.7, clouds: None, band: None };
    }
    flight
}

#[test]
fn horace_at_the_horizon() {
    let flight = horizon_camera(8);
    for rows in [None, Some(240)] {
        let tally = fly(&flight, Preset::Horace2015, |config| {
            anywhere(config);
            config.input.scale_to_height = rows;
        });
        assert_eq!(tally.answered(), tally.frames, "{tally}");
        assert!((1.0..10.0).contains(&tally.rms_deg()) && tally.worst_deg() < 20.0, "{tally}");
    }
}

/// Tests rays beyond 90° off the optical axis, through a lens whose image radius is an odd polynomial of the angle. A
/// camera at 600 km that looks 30° off nadir sees the limb from 36° to 96° off its axis.
#[test]
fn a_limb_beyond_ninety_degrees() {
    let camera = camera::Config {
        k: [0.012, -0.003, 0.0, 0.0].into_iter().collect(),
        theta_max_deg: Some(105.0),
        ..camera::Config::ideal(Model::KannalaBrandt, 384, 384, 92.0)
    };
    for preset in [Preset::Zju2022, Preset::Hzn] {
        let look_at = Look::off_nadir(30f64.to_radians(), 0.7, 0.4);
        let mut scene = Scene::new(camera.clone(), Pose::looking(position_m(35.0, 20.0, 600.0), look_at));
        scene.detector = Detector { psf_sigma_px: 1.0, read_noise: 0.01, ..Detector::default() };
        let lens = Camera::<f64>::try_new(&camera).unwrap();
        let off_axis = |p| lens.unproject(p).unwrap().xyz()[2].acos().to_degrees();
        let points = scene.limb_points(400, EdgeNoise::None).unwrap();
        let widest = points.iter().map(|p| off_axis(p.exact)).fold(0.0, f64::max);
        assert!(widest > 94.0, "the limb in view reaches {widest}° only");
        let mut config = Config::preset(preset, camera.clone());
        config.body = scene.body.clone();
        let truth = scene.truth("", 0.0).unwrap();
        let mut sensors = Sensors::new(&config);
        let (host, flight) = sensors.both(scene.render().unwrap().view(), &scene);
        for answer in [host.unwrap(), flight.unwrap()] {
            let error = answer.error_deg([truth.axis_x, truth.axis_y, truth.axis_z]);
            assert!(error < 0.05, "{}: {error}°", preset.name());
        }
    }
}
