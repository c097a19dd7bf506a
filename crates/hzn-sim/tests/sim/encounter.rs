//! Scenes with a planet or moon in scene.toml.

use hzn_sim::scenario::{BUILTIN, Fit, Known};
use hzn_sim::trajectory::{Aimed, Attitude, Encounter, Orbit, Table, Trajectory};
use hzn_sim::{Light, Scenario, World};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

const SCENES: [&str; 4] = ["jupiter", "enceladus", "saturn", "geo"];

fn scene(name: &str, frames: u32) -> Scenario {
    let mut scenario = Scenario::builtin(name).unwrap();
    scenario.capture.frames = frames;
    scenario
}

fn encounter(scenario: &mut Scenario) -> &mut Encounter {
    match &mut scenario.trajectory {
        Trajectory::Encounter(encounter) => encounter,
        _ => panic!("the scene has an encounter"),
    }
}

/// Diameter of the disc of a truth in pixels, for a pinhole of this focal length.
fn diameter_px(truth: &hzn_files::truth::Truth, focal_px: f64) -> f64 {
    2.0 * focal_px * truth.half_angle_deg.to_radians().tan()
}

#[test]
fn scenes_have_the_sizes_and_phases_that_they_promise() {
    for (name, sizes_px, phases_deg) in [
        ("jupiter", [8.0, 2000.0], [20.0, 60.0]),
        ("enceladus", [250.0, 900.0], [0.0, 165.0]),
        ("saturn", [170.0, 620.0], [5.0, 70.0]),
        ("geo", [700.0, 800.0], [0.0, 75.0]),
    ] {
        let mut scenario = scene(name, 3);
        encounter(&mut scenario).scatter_deg = 0.0;
        let flight = scenario.flight().unwrap();
        let truths: Vec<_> = flight.frames.iter().map(|f| f.truth().unwrap()).collect();
        for (i, k) in [(0, 0), (2, 1)] {
            let size_px = diameter_px(&truths[i], scenario.camera.fx_px);
            assert!((size_px / sizes_px[k] - 1.0).abs() < 0.1, "{name} {size_px}");
            let phase_deg = truths[i].phase_deg.unwrap();
            assert!((phase_deg - phases_deg[k]).abs() < 1e-6, "{name} {phase_deg}");
        }
        assert!(truths.iter().all(hzn_files::truth::Truth::has_limb), "{name}");
        assert_eq!(truths[0].body, if name == "geo" { "ellipsoid" } else { name });
    }
}

#[test]
fn the_position_is_the_range_in_the_camera_frame() {
    for name in SCENES {
        let scenario = scene(name, 5);
        for frame in &scenario.flight().unwrap().frames {
            let truth = frame.truth().unwrap();
            let position_km = Vector3::from(truth.position_km().unwrap());
            let pose = frame.scene.pose;
            assert!((position_km.norm() * 1e3 / Vector3::from(pose.position_m).norm() - 1.0).abs() < 1e-12);
            // The columns of the attitude turn the vector into body-fixed axes: there it is minus the camera's place.
            let q = UnitQuaternion::from_quaternion(Quaternion::new(truth.qw, truth.qx, truth.qy, truth.qz));
            let body_km = q * position_km + Vector3::from(pose.position_m) * 1e-3;
            assert!(body_km.norm() < 1e-9 * position_km.norm());
            let Light::Sun { direction, .. } = frame.scene.light else { panic!("a planet has a Sun") };
            let sun = Vector3::new(truth.sun_x.unwrap(), truth.sun_y.unwrap(), truth.sun_z.unwrap());
            assert!((q * sun - Vector3::from(direction)).norm() < 1e-9);
        }
    }
}

#[test]
fn frames_and_sensor_tell_what_is_known_and_no_position() {
    let header = |scenario: &Scenario| {
        let flight = scenario.flight().unwrap();
        let mut rows = csv::Writer::from_writer(Vec::new());
        flight.frames.iter().for_each(|f| rows.serialize(scenario.body_frame_row(f).unwrap()).unwrap());
        let text = String::from_utf8(rows.into_inner().unwrap()).unwrap();
        assert_eq!(text.lines().count(), 5);
        text.lines().next().unwrap().to_owned()
    };
    let mut scenario = scene("saturn", 4);
    assert_eq!(header(&scenario), "file,time_s,qw,qx,qy,qz,attitude_sigma_deg,sun_x,sun_y,sun_z");
    scenario.known = Known { range_sigma_km: Some(500.0), ..Known::default() };
    assert_eq!(header(&scenario), "file,time_s,sun_x,sun_y,sun_z,range_km,range_sigma_km");
    let flight = scenario.flight().unwrap();
    let off_km: Vec<f64> = flight
        .frames
        .iter()
        .map(|f| {
            let range_km = Vector3::from(f.truth().unwrap().position_km().unwrap()).norm();
            scenario.body_frame_row(f).unwrap().range_km.unwrap() - range_km
        })
        .collect();
    assert!(off_km.iter().all(|x| x.abs() < 2500.0 && *x != 0.0) && off_km[0] != off_km[1], "{off_km:?}");
    let body = scenario.body_table().unwrap();
    assert_eq!(body["kind"].as_str(), Some("saturn"));
    assert!(!body.contains_key("radii_km") && body["limb_height_km"].as_float().unwrap() > 100.0);
    let geo = scene("geo", 2).body_table().unwrap();
    assert_eq!(geo["kind"].as_str(), Some("ellipsoid"));
    assert_eq!(geo["radii_km"].as_array().unwrap().len(), 3);
    // The Earth's air is as high as in its own world, where green light has half of its light at 17 km.
    let height_km = geo["limb_height_km"].as_float().unwrap();
    assert!((15.0..22.0).contains(&height_km), "{height_km}");
    assert_eq!(Fit::measure(&scenario, 8, &|_, _| ()).unwrap(), vec![]);
    // At the Earth there is no such row.
    let rocket = scene("rocket-clean", 2);
    assert!(rocket.body_frame_row(&rocket.flight().unwrap().frames[0]).is_none() && rocket.body_table().is_none());
}

#[test]
fn another_seed_is_another_encounter() {
    let one = scene("enceladus", 4);
    let other = Scenario { seed: 2, ..one.clone() };
    let (a, b) = (one.flight().unwrap(), other.flight().unwrap());
    assert_eq!(a, one.flight().unwrap());
    for (f, g) in a.frames.iter().zip(&b.frames) {
        let turned = Vector3::from(f.scene.pose.position_m).angle(&Vector3::from(g.scene.pose.position_m));
        assert!(turned.to_degrees() > 0.1, "{turned}");
        assert_ne!(f.scene.world, g.scene.world);
        assert_ne!(f.truth().unwrap().phase_deg, g.truth().unwrap().phase_deg);
    }
}

/// A limb that is aimed at is in the middle of the picture.
#[test]
fn the_camera_looks_where_it_is_aimed() {
    let mut scenario = scene("jupiter", 2);
    for (limb, azimuth_deg) in [(0.0, 0.0), (1.0, 0.0), (1.0, 90.0)] {
        let aimed = Aimed { limb: [limb; 2], azimuth_deg: [azimuth_deg; 2], ..Aimed::default() };
        scenario.attitude = Attitude::Aimed(aimed);
        let flight = scenario.flight().unwrap();
        let truth = flight.frames[1].truth().unwrap();
        let position = Vector3::from(truth.position_km().unwrap());
        let off = position.angle(&Vector3::z()) / (69_911.0 / position.norm()).asin();
        assert!((off - limb).abs() < 0.01, "{off}");
        // Across the optical axis, the centre is opposite to the aim.
        let sun = Vector3::new(truth.sun_x.unwrap(), truth.sun_y.unwrap(), truth.sun_z.unwrap());
        let flat = |v: Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
        let sunward = flat(sun - position * (sun.dot(&position) / position.norm_squared()));
        let (from_sun, turned) = (sunward.angle(&flat(-position)).to_degrees(), sunward.cross(&flat(-position)).z);
        if limb > 0.0 {
            assert!((from_sun - azimuth_deg).abs() < 3.0, "{from_sun} {azimuth_deg}");
            // x is right and y is down, so a positive turn is clockwise.
            assert!(azimuth_deg == 0.0 || turned > 0.0);
        }
    }
}

#[test]
fn a_table_gives_any_position_and_attitude() {
    let mut scenario = scene("enceladus", 2);
    scenario.capture.to_s = 1.0;
    let text = "time_s,x_km,y_km,z_km,qw,qx,qy,qz\n0,0,0,-3000,1,0,0,0\n1,0,0,-2000,1,0,0,0\n";
    scenario.trajectory = Trajectory::Table(Table { file: "way.csv".into(), text: Some(text.into()) });
    scenario.attitude = Attitude::Table;
    let missing = scenario.check().unwrap_err().to_string();
    assert!(missing.starts_with("[world] ellipsoid.sun: is missing"), "{missing}");
    let World::Ellipsoid(body) = &mut scenario.world else { panic!("a moon") };
    body.sun = Some([0.0, 1.0, -1.0]);
    let truth = scenario.flight().unwrap().frames[0].truth().unwrap();
    assert_eq!(truth.position_km(), Some([0.0, 0.0, 3000.0]));
    assert!((truth.phase_deg.unwrap() - 45.0).abs() < 1e-9);
}

#[test]
fn what_does_not_belong_together_is_named() {
    let says = |name: &str, change: &dyn Fn(&mut Scenario)| {
        let mut scenario = scene(name, 2);
        change(&mut scenario);
        scenario.flight().unwrap_err().to_string()
    };
    let jupiter = |change: &dyn Fn(&mut Scenario)| says("jupiter", change);
    let orbit = jupiter(&|s| s.trajectory = Trajectory::Orbit(Orbit::default()));
    assert!(orbit.starts_with("[trajectory]: must be encounter or table with [world.ellipsoid]"), "{orbit}");
    let attitude = jupiter(&|s| s.attitude = Attitude::Table);
    assert!(attitude.starts_with("[attitude]: must be aimed"), "{attitude}");
    let phase = jupiter(&|s| encounter(s).phase_deg = [0.0, 190.0]);
    assert_eq!(phase, "[trajectory] encounter.phase_deg: 190 is refused: must be 0 (full) to 180");
    let inside = jupiter(&|s| encounter(s).range_km[1] = 60_000.0);
    assert!(inside.starts_with("[trajectory] encounter.range_km: 60000 is refused: must be above"), "{inside}");
    let above_mean = jupiter(&|s| encounter(s).range_km[1] = 70_000.0);
    assert!(above_mean.contains("inside the body or below its limb"), "{above_mean}");
    let night = jupiter(&|s| {
        let World::Ellipsoid(body) = &mut s.world else { panic!("a planet") };
        body.haze = None;
        *encounter(s) = Encounter { phase_deg: [180.0; 2], scatter_deg: 0.0, ..*encounter(s) };
    });
    assert!(night.contains("no picture shows a lit limb of the jupiter"), "{night}");
    let bodies = jupiter(&|s| s.bodies = vec![hzn_core::body::Kind::Moon]);
    assert!(bodies.starts_with("bodies: is not allowed with [world.ellipsoid]"), "{bodies}");
    let gnss = jupiter(&|s| s.gnss = Some(Default::default()));
    assert!(gnss.starts_with("[imu], [gnss]: are not allowed"), "{gnss}");
    let range = says("tumble", &|s| s.known.range_sigma_km = Some(1.0));
    assert!(range.starts_with("[known] range_sigma_km: is allowed only with [world.ellipsoid]"), "{range}");
    let wrong = jupiter(&|s| s.known.range_sigma_km = Some(-1.0));
    assert!(wrong.starts_with("[known] range_sigma_km: -1 is refused"), "{wrong}");
    let text = BUILTIN.iter().find(|b| b.0 == "saturn").unwrap().2.replace("opacity", "opaque");
    let unknown = Scenario::parse(&text, "scene.toml".as_ref()).unwrap_err().to_string();
    assert!(unknown.contains("rings 1: unknown key; valid here: inner_km, outer_km, opacity"), "{unknown}");
}
