use nalgebra::UnitQuaternion;

use super::*;
use crate::scene::{Light, Scene};

#[test]
fn built_in_scenes_are_valid_and_show_their_bodies() {
    for (name, what, text) in BUILTIN {
        let mut scenario = Scenario::builtin(name).unwrap();
        assert_eq!(scenario.name, name);
        assert!(!what.is_empty());
        // A user's file would have the same text.
        assert_eq!(toml::from_str::<Scenario>(text).unwrap(), scenario);
        let again = toml::to_string(&scenario).unwrap();
        assert_eq!(toml::from_str::<Scenario>(&again).unwrap(), scenario, "{again}");
        scenario.capture.frames = 24;
        // Of a vehicle with several cameras, the last one sees the Sun.
        let scenario = scenario.by_camera().pop().unwrap();
        let flight = scenario.flight().unwrap();
        flight.sensor.check().unwrap();
        let bodies = scenario.bodies.clone();
        for kind in bodies {
            let seen = flight.frames.iter().filter(|f| f.scene.has_limb(kind).unwrap()).count();
            println!("{name}: {kind:?} in {seen} of {}", flight.frames.len());
            assert!(seen >= 6, "{name} {kind:?}: {seen}");
        }
    }
}

#[test]
fn each_body_has_edge_errors_of_its_own() {
    let scenario = Scenario::builtin("sun-moon").unwrap();
    let fits = Fit::measure(&scenario, 8, &|_, _| ()).unwrap();
    let [sun, moon] = &fits[..] else { panic!("{fits:?}") };
    assert_eq!((sun.body, moon.body), (Kind::Sun, Kind::Moon));
    // The Moon's disc is half in shade and the Sun's disc is whole.
    assert!(moon.sigma_px > 3.0 * sun.sigma_px, "{sun:?} {moon:?}");
    let mut sensor = scenario.sensor();
    fits.iter().for_each(|fit| fit.apply(&mut sensor));
    sensor.check().unwrap();
    for (body, fit) in sensor.bodies.iter().zip(&fits) {
        let noise = body.covariance.unwrap();
        assert!((noise.sigma_px - fit.sigma_px).abs() < 6e-4 && noise.correlation_px == fit.correlation_px);
    }
    assert_eq!(sensor.covariance, scenario.sensor().covariance);
}

#[test]
fn what_is_refused_is_named() {
    let error = |change: &dyn Fn(&mut Scenario)| {
        let mut s = Scenario::builtin("tumble").unwrap();
        s.capture.frames = 4;
        change(&mut s);
        s.flight().unwrap_err().to_string()
    };
    assert_eq!(error(&|s| s.capture.frames = 0), "[capture] frames: 0 is refused: must be 1 to 100000");
    assert_eq!(error(&|s| s.camera.fx_px = -1.0), "[camera] fx_px: must be above 0");
    assert!(error(&|s| s.name = "a/b".into()).starts_with("name: "));
    let visible = |change: fn(&mut crate::Visible)| {
        error(&|s| {
            let World::Visible(world) = &mut s.world else { panic!("tumble is visible") };
            change(world);
        })
    };
    assert_eq!(visible(|w| w.clouds.cover = 25.0), "[world] visible.clouds.cover: 25 is refused: must be 0 to 1");
    assert_eq!(
        visible(|w| w.clouds.smallest_km = 5e3),
        "[world] visible.clouds.smallest_km: 5000 is refused: must be 0.01 to 900"
    );
    assert!(visible(|w| w.air.brightness = f64::NAN).starts_with("[world] visible.air.brightness: NaN is refused"));
    assert_eq!(
        error(&|s| s.known.attitude_sigma_deg = Some(-5.0)),
        "[known] attitude_sigma_deg: -5 is refused: must be above 0, at most 180"
    );
    assert_eq!(
        error(&|s| s.exposure.limits = [3.0, 2.0]),
        "[exposure] limits: 3 is refused: must be above 0, at most 2"
    );
    assert!(error(&|s| s.detector.bits = 7).starts_with("[detector] bits: 7 is refused"));
    assert!(
        error(&|s| s.attitude = Attitude::Spin(Default::default()))
            .contains("is allowed only with [trajectory.rocket]")
    );
    let inside = error(&|s| {
        s.trajectory = Trajectory::Orbit(crate::trajectory::Orbit { perigee_km: 50.0, ..Default::default() });
        s.world = World::Infrared(crate::Infrared { half_level_km: 70.0, ..Default::default() });
    });
    assert!(inside.contains("inside the Earth or below its limb"), "{inside}");
    let limb = error(&|s| {
        s.world = World::Infrared(crate::Infrared { limb: Some(hzn_core::body::Limb::Visible), ..Default::default() });
    });
    assert!(limb.starts_with("[world] infrared.limb: is no thermal band"), "{limb}");
    assert!(error(&|s| s.shutter.halves_s = 0.25).contains("has no effect without halves"));
    let nothing = error(&|s| {
        s.attitude =
            Attitude::Pointing(crate::trajectory::Pointing { off_nadir_deg: [180.0; 2], ..Default::default() });
    });
    assert!(nothing.contains("no picture shows a lit limb of the earth"), "{nothing}");
    let unknown = toml::from_str::<Scenario>(&BUILTIN[0].2.replace("[imu]", "[imu]\nrate = 3")).unwrap_err();
    assert!(unknown.to_string().contains("unknown field `rate`"), "{unknown}");
}

#[test]
fn sun_stands_where_the_ephemeris_says_and_seeds_change_the_clouds() {
    let mut s = Scenario::builtin("rocket-clean").unwrap();
    s.capture.frames = 2;
    let (a, b) = (s.flight().unwrap(), Scenario { seed: 2, ..s.clone() }.flight().unwrap());
    let Light::Sun { direction, .. } = a.frames[1].scene.light else { panic!("a visible world has a Sun") };
    assert_eq!(direction, hzn_nav::ephemeris::sun(s.start_unix_s() + 430.0).direction.xyz());
    assert_ne!(a.frames[0].scene.world, b.frames[0].scene.world);
    assert_eq!(a, s.flight().unwrap());
    // At 10:30 UTC on 13 June the Sun is 45 degrees above the horizon of Esrange.
    let up = nalgebra::Vector3::from(a.frames[0].scene.pose.position_m).normalize();
    let elevation = libm::asin(up.dot(&nalgebra::Vector3::from(direction))).to_degrees();
    assert!((elevation - 45.0).abs() < 2.0, "{elevation}");
}

#[test]
fn half_pictures_are_those_of_two_poses() {
    let mut s = Scenario::builtin("thermal-array").unwrap();
    s.capture.frames = 2;
    s.detector = Detector { psf_sigma_px: 0.6, bits: 16, ..Detector::default() };
    let scene = s.flight().unwrap().frames[1].scene.clone();
    let halves = scene.halves.unwrap();
    let render = |pose| Scene { pose, halves: None, ..scene.clone() }.render().unwrap();
    let (whole, [first, second]) = (scene.render().unwrap(), halves.poses(&scene.pose).map(render));
    let at_once = render(scene.pose);
    let mut differ = 0;
    for (x, y) in (0..32).flat_map(|x| (0..24).map(move |y| (x, y))) {
        let half = if (x + y) % 2 == 0 { &first } else { &second };
        assert_eq!(whole.at(x, y), half.at(x, y));
        differ += u32::from(whole.at(x, y) != at_once.at(x, y));
    }
    // The pose of the picture is in the middle, so that near the limb neither half is that of the pose.
    assert!(differ > 24, "{differ}");
}

#[test]
fn a_sensor_of_a_thermal_band_knows_its_name_or_what_was_measured() {
    let scenario = Scenario::builtin("thermal-array").unwrap();
    let mut sensor = scenario.sensor();
    let limb = hzn_core::body::Limb::Window;
    assert_eq!((sensor.body.limb, sensor.body.limb_height_km, sensor.body.limb_height_sigma_km), (limb, 12.0, 7.0));
    let [fit] = Fit::measure(&scenario, 16, &|_, _| ()).unwrap()[..] else { panic!("one body has one fit") };
    fit.apply(&mut sensor);
    sensor.check().unwrap();
    assert_eq!((sensor.body.limb, sensor.body.sunlit), (hzn_core::body::Limb::Height, Some(false)));
    assert!((sensor.body.limb_height_km - 12.0).abs() < 20.0, "{fit:?}");
}

#[test]
fn frames_csv_says_what_is_known_and_no_more() {
    let mut s = Scenario::builtin("leo-infrared").unwrap();
    s.capture.frames = 3;
    let flight = s.flight().unwrap();
    let row = s.frame_row(&flight.frames[1]);
    assert!(row.qw.is_none() && row.utc.as_deref() == Some("2021-07-15T00:48:20.000Z"), "{:?}", row.utc);
    s.known = Known { position_sigma_km: 0.1, attitude_sigma_deg: Some(5.0), ..Known::default() };
    let noisy = s.frame_row(&flight.frames[1]);
    assert!(noisy.x_km != row.x_km && (noisy.x_km - row.x_km).abs() < 0.5);
    let [w, x, y, z] = flight.frames[1].scene.pose.q_fixed_from_camera_wxyz;
    let dot = noisy.qw.unwrap() * w + noisy.qx.unwrap() * x + noisy.qy.unwrap() * y + noisy.qz.unwrap() * z;
    let off_deg = 2.0 * libm::acos(dot.abs().min(1.0)).to_degrees();
    assert!((1.0..25.0).contains(&off_deg), "{off_deg}");
}

#[test]
fn several_cameras_fly_on_one_vehicle() {
    let mut s = Scenario::builtin("atek").unwrap();
    s.capture.frames = 3;
    let refused = s.flight().unwrap_err().to_string();
    assert!(refused.contains("the cameras left, right; choose one"), "{refused}");
    assert!(s.with_camera("middle").unwrap_err().to_string().contains("no camera middle; the scene has left, right"));
    let [left, right] = [s.with_camera("left").unwrap(), s.with_camera("right").unwrap()];
    // The vehicle is the same, and the mounts differ from the told ones by about one degree, each in its own way.
    assert_eq!(left.path().unwrap().state(200.0), right.path().unwrap().state(200.0));
    let rotation = |[w, x, y, z]: [f64; 4]| UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    let error = |s: &Scenario| {
        rotation(s.mount.unwrap().q_vehicle_from_camera_wxyz).inverse() * rotation(s.true_q_vehicle_from_camera_wxyz())
    };
    for one in [&left, &right] {
        assert!((0.2..4.0).contains(&error(one).angle().to_degrees()));
        assert_eq!(one.sensor().mount, one.mount);
    }
    assert!(error(&left).angle_to(&error(&right)).to_degrees() > 0.2);
    // The pictures have other noise, but the same world.
    let [a, b] = [left.flight().unwrap(), right.flight().unwrap()];
    assert_eq!(a.frames[1].scene.world, b.frames[1].scene.world);
    assert_ne!(a.frames[1].scene.seed, b.frames[1].scene.seed);
    // The truth has the true time, frames.csv the stamp and the position at the stamp.
    let row = left.frame_row(&a.frames[1]);
    assert!((row.time_s - a.frames[1].time_s - 0.15).abs() < 0.03, "{}", row.time_s);
    let at_stamp = left.path().unwrap().camera(row.time_s).position_m;
    assert!((row.x_km - at_stamp[0] * 1e-3).abs() < 1e-9);
    let twice = Scenario { cameras: vec![s.cameras[0].clone(), s.cameras[0].clone()], ..s };
    assert!(twice.check().unwrap_err().to_string().contains("left stands twice"));
}

#[test]
fn a_receiver_fails_and_lies_as_the_scene_says() {
    let mut s = Scenario::builtin("atek").unwrap();
    let path = s.path().unwrap();
    let gnss = Gnss { outages_s: vec![[100.0, 110.0]], jumps_s: vec![[200.0, 202.0]], ..s.gnss.take().unwrap() };
    let rows: Vec<_> = gnss.rows(&path, [60.0, 430.0], 1).collect();
    assert_eq!((rows.len(), rows[0].time_s), (431 - 11, 0.0));
    for row in rows {
        let off = nalgebra::Vector3::new(row.x_m, row.y_m, row.z_m) - path.state(row.time_s).position_m;
        let jumped = (200.0..=202.0).contains(&row.time_s);
        assert!((off.norm() - if jumped { 1000.0 } else { 0.0 }).abs() < 40.0, "{} {}", row.time_s, off.norm());
    }
    let backwards = Gnss { outages_s: vec![[3.0, 2.0]], ..Gnss::default() };
    assert!(backwards.check().unwrap_err().1.contains("the second time must be the later one"));
}

/// Without noise the unit measures b + (1 + S) ω + m × ω.
#[test]
fn an_inertial_unit_has_the_errors_that_it_tells() {
    let imu = Imu {
        from_s: Some(10.0),
        gyro_noise_deg_s: 0.0,
        gyro_step_deg_s: 0.0,
        gyro_scale_ppm: 2000.0,
        gyro_misalignment_mrad: 2.0,
        ..Imu::default()
    };
    let path = Scenario::builtin("atek").unwrap().path().unwrap();
    let errors = imu.errors(7);
    let row = imu.rows(&path, [60.0, 70.0], 7).next().unwrap();
    let rate = path.state(10.0).rate_radps;
    let three = nalgebra::Vector3::from;
    let expected = rate
        + three(errors.gyro_bias_radps)
        + three(errors.gyro_scale).component_mul(&rate)
        + three(errors.gyro_misalignment_rad).cross(&rate);
    assert_eq!(row.time_s, 10.0);
    assert!((nalgebra::Vector3::new(row.gyro_x_radps, row.gyro_y_radps, row.gyro_z_radps) - expected).norm() < 1e-12);
    assert!(three(errors.gyro_scale).norm() > 1e-4 && three(errors.gyro_misalignment_rad).norm() > 1e-4);
}

#[test]
fn a_view_is_the_picture_of_the_flight_without_its_vehicle_and_motion() {
    let mut scenario = Scenario::builtin("rocket-clean").unwrap();
    scenario.capture.frames = 3;
    let frame = &scenario.flight().unwrap().frames[1];
    let mut of_flight = frame.scene.clone();
    assert!(of_flight.motion.take().is_some());
    let unix_s = scenario.start_unix_s() + frame.time_s;
    let view = |pose, unix_s| scenario.view(&scenario.camera, pose, unix_s, of_flight.seed);
    let seen = view(of_flight.pose, unix_s).unwrap();
    assert_eq!(seen, of_flight);
    // An hour later the Sun is elsewhere.
    assert_ne!(view(of_flight.pose, unix_s + 3600.0).unwrap().light, of_flight.light);
    let inside = crate::Pose { position_m: [6.0e6, 0.0, 0.0], ..of_flight.pose };
    assert!(view(inside, unix_s).unwrap_err().to_string().contains("inside the Earth"));
    let jupiter = Scenario::builtin("jupiter").unwrap();
    let far = crate::Pose { position_m: [1.0e9, 0.0, 0.0], ..of_flight.pose };
    let refused = jupiter.view(&jupiter.camera, far, unix_s, 0).unwrap_err().to_string();
    assert!(refused.contains("ellipsoid.sun"), "{refused}");
}

#[test]
fn scenes_are_written_and_read() {
    let scene = &crate::flight::rocket(320, 180, 2, 1).with_payload().frames[1].scene;
    let text = toml::to_string(scene).unwrap();
    assert_eq!(&toml::from_str::<Scene>(&text).unwrap(), scene);
}
