//! Tests a panoramic annular lens, whose picture is a ring around a blind centre.

use hzn_core::Config;
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_sim::pose::position_m;
use hzn_sim::{Look, Picture, Pose, Scene};
use hzn_tests::{Sensors, Tally};

/// Returns a lens that sees from 30° to 100° off axis.
fn lens() -> camera::Config {
    camera::Config {
        theta_min_deg: Some(30.0),
        theta_max_deg: Some(100.0),
        ..camera::Config::ideal(Model::Equidistant, 480, 480, 130.0)
    }
}

/// Returns 24 scenes at 600 km. The camera looks up to 57° away from the nadir, so that the blind centre cuts the limb
/// in some of the pictures.
fn scenes() -> Vec<Scene> {
    let scene = |n: u32| {
        let turn = f64::from(n);
        let depression_rad = (90.0 - 2.5 * turn).to_radians();
        let look = Look { azimuth_rad: 0.7 * turn, depression_rad, roll_rad: 0.4 * turn };
        let mut scene = Scene::new(lens(), Pose::looking(position_m(40.0 - 3.0 * turn, 10.0, 600.0), look));
        scene.seed = 900 + u64::from(n);
        scene.detector.psf_sigma_px = 0.9;
        scene.detector.read_noise = 0.02;
        scene
    };
    (0..24).map(scene).collect()
}

/// Returns the brightness of a picture, with a stripe of stray light in the blind centre.
fn with_stray_light(picture: &Picture) -> Vec<u8> {
    let brightness = |x: u16, y: u16| {
        let (u, v) = (f64::from(x) - 239.5, f64::from(y) - 239.5);
        let is_stray = u.hypot(v) < 130.0 * 30f64.to_radians() && (0.3 * u + v).abs() < 30.0;
        if is_stray { 230 } else { picture.at(x, y) as u8 }
    };
    (0..480).flat_map(|y| (0..480).map(move |x| (x, y))).map(|(x, y)| brightness(x, y)).collect()
}

#[test]
fn the_limb_is_found_around_a_blind_centre() {
    let scenes = scenes();
    let mut sensors = Sensors::new(&Config { body: scenes[0].body.clone(), ..Config::new(lens()) });
    let mut tallies = [Tally::default(), Tally::default()];
    for scene in &scenes {
        assert!(scene.visible_limb_px().unwrap() > 200.0);
        let truth = scene.truth("", 0.0).unwrap();
        let picture = scene.render().unwrap();
        assert!(picture.at(240, 240) < 40, "the simulator leaves the blind centre dark, apart from noise");
        let data = with_stray_light(&picture);
        let view = Grey::try_new(&data, Layout::packed(480, 480, 1, 8)).unwrap();
        let (host, flight) = sensors.both(&view, scene);
        for (tally, answer) in tallies.iter_mut().zip([host, flight]) {
            tally.add(answer.ok().as_ref(), [truth.axis_x, truth.axis_y, truth.axis_z]);
        }
    }
    for tally in &tallies {
        println!("{tally}");
        assert_eq!(tally.answered(), 24);
        assert!(tally.worst_deg() < 0.1);
    }
}
