//! One rule says whether a picture shows a limb: for every body, every lens and every size of picture.

use std::f64::consts::TAU;

use hzn_core::body::Kind;
use hzn_core::camera::{Config, Model};
use hzn_sim::{Ellipsoid, Foreground, Light, Look, Pose, Scenario, Scene, World, pose::position_m};
use nalgebra::Vector3;

/// Returns a pose whose optical axis is `turn_rad` beside a direction, towards the side of the picture.
fn towards(position_m: [f64; 3], axis: [f64; 3], turn_rad: f64) -> Pose {
    let axis = Vector3::from(axis).normalize();
    let helper = if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let right = axis.cross(&helper).normalize();
    let axes = [right, axis.cross(&right), axis].map(Into::into);
    Pose::from_axes(position_m, axes).disturbed([0.0, turn_rad, 0.0])
}

/// A direction at right angles to the position: the Earth is below the middle of the picture.
const LEVEL: [f64; 3] = [0.0, 1.0, 0.2];
const POSITION_M: [f64; 3] = [7e6, 0.0, 0.0];

/// A scene with the Sun `turn_rad` beside the optical axis.
fn sun_scene(camera: Config, turn_rad: f64) -> Scene {
    Scene {
        world: World::Visible(Box::default()),
        light: Light::Sun { direction: LEVEL, twilight_rad: 0.01 },
        ..Scene::new(camera, towards(POSITION_M, LEVEL, turn_rad))
    }
}

fn has_limb(scene: &Scene, kind: Kind) -> bool {
    scene.body_truth(kind, "", 0.0).unwrap().has_limb()
}

#[test]
fn a_small_sun_counts_while_a_quarter_of_its_outline_is_in_view() {
    // Radii of 2.7 and 5.4 px, as in a lens of 94 degrees; of 0.2 px; of 7.9 px, whose outline has just 50 px.
    for (model, focal_px) in
        [(Model::Equidistant, 580.0), (Model::Pinhole, 1160.0), (Model::Pinhole, 43.0), (Model::Pinhole, 1710.0)]
    {
        let camera = Config::ideal(model, 1920, 1080, focal_px);
        let radius_rad = 0.004_652_4;
        let half_width_rad = match model {
            Model::Pinhole => (960.0 / focal_px).atan(),
            _ => 960.0 / focal_px,
        };
        let whole = sun_scene(camera.clone(), 0.0);
        let px = whole.visible_px(Kind::Sun).unwrap();
        assert!((px / (TAU * focal_px * radius_rad) - 1.0).abs() < 0.01, "{px}");
        assert!(has_limb(&whole, Kind::Sun), "{focal_px}: {px} px");
        // Of the azimuths about the centre, 160 degrees are in the picture, then 60 degrees.
        for (out, in_view) in [(0.17, true), (0.87, false), (1.5, false)] {
            let beside = sun_scene(camera.clone(), half_width_rad + out * radius_rad);
            let px = beside.visible_px(Kind::Sun).unwrap();
            assert_eq!(has_limb(&beside, Kind::Sun), in_view, "{focal_px}: {out} {px} px");
        }
    }
}

#[test]
fn a_whole_disc_that_is_hidden_or_unlit_does_not_count() {
    let camera = Config::ideal(Model::Pinhole, 1920, 1080, 1160.0);
    let mut hidden = sun_scene(camera.clone(), 0.0);
    hidden.foreground.push(Foreground {
        polygon_px: vec![[900.0, 500.0], [1000.0, 500.0], [1000.0, 600.0], [900.0, 600.0]],
        brightness: 0.5,
    });
    assert!(!has_limb(&hidden, Kind::Sun));
    // The Earth hides the Sun.
    let direction = [-1.0, 0.0, 0.0];
    let night = Scene {
        light: Light::Sun { direction, twilight_rad: 0.01 },
        pose: towards(POSITION_M, direction, 0.0),
        ..sun_scene(camera.clone(), 0.0)
    };
    assert!(!has_limb(&night, Kind::Sun));
    // A new Moon has no lit limb, and half of the outline of any other one is lit.
    let moon = |sun: [f64; 3]| Scene {
        light: Light::Sun { direction: sun, twilight_rad: 0.01 },
        moon_ecef_m: Some(LEVEL.map(|x| x * 3.8e8)),
        ..sun_scene(camera.clone(), 0.0)
    };
    assert!(!has_limb(&moon(LEVEL), Kind::Moon));
    for sun in [[0.0, -0.2, 1.0], [0.0, 1.0, 0.8], [1.0, 0.0, 0.0]] {
        assert!(has_limb(&moon(sun), Kind::Moon), "{sun:?}");
    }
}

#[test]
fn a_small_planet_and_a_small_moon_have_the_same_rule() {
    let camera = Config::ideal(Model::Pinhole, 1024, 1024, 1000.0);
    let planet = |turn_rad: f64, sun: [f64; 3]| Scene {
        world: World::Ellipsoid(Box::new(Ellipsoid::from_radii([100.0, 95.0, 90.0]))),
        light: Light::Sun { direction: sun, twilight_rad: 0.0 },
        ..Scene::new(camera.clone(), towards([2e7, 0.0, 0.0], [-1.0, 0.0, 0.0], turn_rad))
    };
    let edge_rad = 0.512f64.atan();
    let (full, behind) = ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    for (turn_rad, sun, in_view) in
        [(0.0, full, true), (edge_rad, full, true), (edge_rad + 0.0046, full, false), (0.0, behind, false)]
    {
        let scene = planet(turn_rad, sun);
        assert_eq!(has_limb(&scene, Kind::Ellipsoid), in_view, "{turn_rad} {sun:?}");
    }
}

#[test]
fn half_of_the_shorter_side_is_enough_in_a_small_picture() {
    let earth = |camera: Config, depression_rad: f64| {
        Scene::new(camera, Pose::looking(position_m(0.0, 0.0, 500.0), Look { depression_rad, ..Look::default() }))
    };
    // The limb crosses the 32 columns of a thermal array, then only a corner of it.
    let array = |width, height| Config::ideal(Model::Pinhole, width, height, 30.0);
    let level = earth(array(32, 24), 0.38);
    assert!(has_limb(&level, Kind::Earth), "{}", level.visible_limb_px().unwrap());
    // Where the limb has less than 12 px, the picture shows none; the picture of 640 x 480 px needs 50 px.
    for (width, height, focal_px, least_px) in [(32, 24, 30.0, 12.0), (80, 60, 70.0, 30.0), (640, 480, 500.0, 50.0)] {
        let (mut fewest_px, mut most_px) = (f64::INFINITY, 0.0f64);
        for step in 0..2000 {
            let roll_rad = 0.8;
            let look = Look { depression_rad: -0.3 + 0.001 * f64::from(step), roll_rad, ..Look::default() };
            let camera = Config::ideal(Model::Pinhole, width, height, focal_px);
            let scene = Scene::new(camera, Pose::looking(position_m(0.0, 0.0, 500.0), look));
            let px = scene.visible_limb_px().unwrap();
            match scene.truth("", 0.0).unwrap().has_limb() {
                true => fewest_px = fewest_px.min(px),
                false => most_px = most_px.max(px),
            }
        }
        assert!(most_px < least_px && fewest_px >= least_px, "{width}: {most_px} {fewest_px}");
        assert!(fewest_px - most_px < 0.1 * least_px, "{width}: {most_px} {fewest_px}");
    }
}

/// Both cameras of `atek` see the Sun, whose disc has a radius of 5.4 px and less beside the optical axis.
#[test]
fn the_sun_of_atek_is_in_view() {
    let mut scene = Scenario::builtin("atek").unwrap();
    scene.capture.frames = 90;
    for one in scene.by_camera() {
        let (mut seen, mut whole) = (0, 0);
        for frame in one.flight().unwrap().frames {
            let visible_px = frame.scene.visible_px(Kind::Sun).unwrap();
            seen += u32::from(has_limb(&frame.scene, Kind::Sun));
            whole += u32::from(visible_px > 0.8 * TAU * 5.0);
            assert!(visible_px > 0.0 || !has_limb(&frame.scene, Kind::Sun));
        }
        println!("{}: {seen} pictures with the Sun, {whole} of them with most of it", one.name);
        assert!(seen >= whole && whole >= 6, "{}: {seen} {whole}", one.name);
    }
}
