//! The exact and the rendered limb, compared with an independent library and with each other.

use hzn_core::camera::{Config, Model};
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M};
use hzn_core::frames::UnitVec3;
use hzn_sim::{
    Disc, EdgeNoise, LimbCircle, Look, Picture, Pose, Profile, Scene, Sky, limb::LimbPoint, pose::position_m,
};

fn three(v: &serde_json::Value) -> [f64; 3] {
    std::array::from_fn(|i| v[i].as_f64().unwrap())
}

fn camera(model: Model, k: &[f64]) -> Config {
    let mut c = Config::ideal(model, 640, 480, 400.0);
    c.k = k.iter().copied().collect();
    c
}

#[test]
fn circle_and_truth_equal_spice() {
    let golden: serde_json::Value = serde_json::from_str(include_str!("../data/limb_ellipsoid.json")).unwrap();
    for case in golden["cases"].as_array().unwrap() {
        let height_m = case["atmosphere_d_m"].as_f64().unwrap();
        assert!((case["a_m"].as_f64().unwrap() - height_m - WGS84_A_M).abs() < 1e-6);
        assert!((case["b_m"].as_f64().unwrap() - height_m - WGS84_B_M).abs() < 1e-6);
        let rows: [[f64; 3]; 3] = std::array::from_fn(|i| three(&case["R_ec"][i]));
        let pose = Pose::from_axes(three(&case["r_ecef_m"]), std::array::from_fn(|c| rows.map(|row| row[c])));
        let mut scene = Scene::new(camera(Model::Equidistant, &[]), pose);
        scene.body.limb_height_km = height_m * 1e-3;

        let axis = UnitVec3::try_new(three(&case["limb_axis_c"])).unwrap();
        let truth = scene.truth("", 0.0).unwrap();
        assert!(truth.axis().unwrap().angle_rad(&axis).to_degrees() < 1e-10, "{}", case["id"]);
        let cot2 = |key: &str| case[key].as_f64().unwrap().to_radians().tan().powi(-2);
        let mean = 0.5 * (cot2("cone_half_angle_east_deg") + cot2("cone_half_angle_meridian_deg"));
        assert!((truth.half_angle_deg - mean.sqrt().recip().atan().to_degrees()).abs() < 1e-9);

        let circle = LimbCircle::new(&scene).unwrap();
        for ray in case["rays_ecef"].as_array().unwrap() {
            let ray = UnitVec3::<hzn_core::frames::Fixed, f64>::try_new(three(ray)).unwrap();
            let azimuth = circle.azimuth_rad(ray.xyz());
            let ours = UnitVec3::try_new(circle.ray_fixed(azimuth)).unwrap();
            assert!(ours.angle_rad(&ray) < 1e-9, "{} {:e}", case["id"], ours.angle_rad(&ray));
        }
    }
}

/// Returns the crossings of the limb with whole rows (or columns if `transposed`) as (row, position). Only steep
/// crossings well inside the picture count.
fn crossings(points: &[LimbPoint], transposed: bool, width: f64, height: f64) -> Vec<(u16, f64)> {
    let swap = |p: &LimbPoint| if transposed { (p.exact.v, p.exact.u) } else { (p.exact.u, p.exact.v) };
    let (width, height) = if transposed { (height, width) } else { (width, height) };
    let mut found = Vec::new();
    for pair in points.windows(2).filter(|pair| pair[0].segment == pair[1].segment) {
        let ((u0, v0), (u1, v1)) = (swap(&pair[0]), swap(&pair[1]));
        let row = v0.max(v1).floor();
        if v0.min(v1) < row && (v1 - v0).abs() > 0.8 * (u1 - u0).abs() {
            let u = u0 + (u1 - u0) * (row - v0) / (v1 - v0);
            if (10.0..width - 10.0).contains(&u) && (10.0..height - 10.0).contains(&row) {
                found.push((row as u16, u));
            }
        }
    }
    found
}

/// Returns the position at which the brightness crosses `level` along a row (or column), within three pixels of `near`.
fn half_level(picture: &Picture, transposed: bool, row: u16, near: f64, level: f64) -> f64 {
    let at = |x: i32| f64::from(if transposed { picture.at(row, x as u16) } else { picture.at(x as u16, row) }) - level;
    let middle = near.floor() as i32;
    (middle - 3..=middle + 3)
        .filter(|&x| (at(x) > 0.0) != (at(x + 1) > 0.0))
        .map(|x| f64::from(x) + at(x) / (at(x) - at(x + 1)))
        .min_by(|a, b| (a - near).abs().total_cmp(&(b - near).abs()))
        .expect("the edge is where the limb is")
}

/// Returns the largest and the mean signed distance between the rendered half level and the exact limb, and the number
/// of compared points.
fn compare(scene: &Scene, share: f64) -> (f64, f64, usize) {
    let picture = scene.render().unwrap();
    let points = scene.limb_points(8000, EdgeNoise::None).unwrap();
    let (w, h) = (f64::from(picture.width()), f64::from(picture.height()));
    let (dark, bright) = (scene.sky.brightness, scene.disc.surface);
    let level = (dark + share * (bright - dark)) * 65535.0;
    let (mut worst, mut sum, mut count) = (0.0f64, 0.0, 0);
    for transposed in [false, true] {
        for (row, exact) in crossings(&points, transposed, w, h) {
            let error = half_level(&picture, transposed, row, exact, level) - exact;
            worst = worst.max(error.abs());
            sum += error;
            count += 1;
        }
    }
    (worst, sum / count as f64, count)
}

fn clean(camera: Config, pose: Pose) -> Scene {
    let mut scene = Scene::new(camera, pose);
    scene.detector.bits = 16;
    scene.detector.psf_sigma_px = 1.2;
    scene
}

#[test]
fn rendered_edge_is_on_the_limb_for_every_lens() {
    let look = Look { azimuth_rad: 0.7, depression_rad: 0.3, roll_rad: 0.5 };
    let pose = Pose::looking(position_m(45.0, 10.0, 240.0), look);
    for camera in [
        camera(Model::KannalaBrandt, &[-0.055, 0.011, -0.0035, 0.0002]),
        camera(Model::Equidistant, &[]),
        camera(Model::Pinhole, &[]),
        camera(Model::BrownConrady, &[-0.12, 0.02, 0.0008, -0.0005, 0.0]),
    ] {
        let (worst, mean, count) = compare(&clean(camera.clone(), pose), 0.5);
        assert!(count > 300 && worst < 0.02 && mean.abs() < 0.002, "{:?}: {worst} {mean} {count}", camera.model);
    }
}

#[test]
fn rendered_edge_follows_a_height_that_depends_on_latitude() {
    let camera = Config::ideal(Model::Equidistant, 640, 640, 180.0);
    let pose = Pose::looking(position_m(30.0, 10.0, 600.0), Look::off_nadir(0.2, 0.3, 0.4));
    let mut scene = clean(camera, pose);
    scene.body.limb_height_km = 25.0;
    scene.limb_height_by_latitude_km = vec![[-90.0, 20.5], [0.0, 25.0], [90.0, 29.5]];
    let (worst, mean, count) = compare(&scene, 0.5);
    // The error is the same as for a uniform height; the blur of an edge with a radius of 200 px causes 0.005 px of it.
    assert!(count > 500 && worst < 0.025 && mean.abs() < 0.002, "{worst} {mean} {count}");
    // A uniform height gives other limb points.
    let uniform = Scene { limb_height_by_latitude_km: Vec::new(), ..scene.clone() };
    let far = |s: &Scene| s.limb_points(8, EdgeNoise::None).unwrap();
    let shift = far(&scene)
        .iter()
        .zip(far(&uniform))
        .map(|(a, b)| (a.exact.u - b.exact.u).hypot(a.exact.v - b.exact.v))
        .fold(0.0, f64::max);
    assert!((0.05..1.0).contains(&shift), "{shift}");
}

#[test]
fn rendered_edge_is_on_the_limb_of_a_small_disc() {
    // The Moon has a diameter of 100 pixels.
    let mut scene = clean(
        camera(Model::Pinhole, &[]),
        Pose { position_m: [0.0, 0.0, -14.1e6], q_fixed_from_camera_wxyz: [1.0, 0.02, -0.03, 0.4] },
    );
    scene.body.kind = hzn_core::body::Kind::Moon;
    scene.body.limb_height_km = 0.0;
    let (worst, _, count) = compare(&scene, 0.5);
    // The blur of a curved edge moves it inward by about σ²/2r along its normal: up to 0.02 px along a row here.
    assert!(count > 100 && worst < 0.02 + 0.02, "{worst} {count}");
}

#[test]
fn exponential_profile_is_at_half_brightness_at_the_limb_height() {
    let pose = Pose::looking(position_m(-20.0, 100.0, 150.0), Look { depression_rad: 0.25, ..Look::default() });
    let mut scene = clean(camera(Model::KannalaBrandt, &[]), pose);
    // The profile covers many pixels, so the blur does not move it.
    scene.profile = Profile::Exponential { scale_km: 40.0 };
    scene.body.limb_height_km = 30.0;
    scene.detector.psf_sigma_px = 0.3;
    let (worst, _, count) = compare(&scene, 0.5);
    assert!(count > 100 && worst < 0.05, "{worst} {count}");
}

#[test]
fn no_limb_no_edge() {
    let up = Look { depression_rad: -1.0, ..Look::default() };
    let mut scene = Scene::new(camera(Model::Pinhole, &[]), Pose::looking(position_m(0.0, 0.0, 300.0), up));
    scene.sky = Sky { brightness: 0.1, ..Sky::default() };
    scene.disc = Disc::default();
    let picture = scene.render().unwrap();
    assert!((0..480).all(|y| (0..640).all(|x| picture.at(x, y) == 26)));
    assert!(scene.limb_points(10, EdgeNoise::None).unwrap().is_empty());
}
