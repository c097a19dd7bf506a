//! Properties of a rendered picture: determinism, masks, circle, noise, light.

use hzn_core::camera::{Config, Model};
use hzn_core::image::Pixels;
use hzn_sim::{
    Band, Clouds, Disc, EdgeNoise, Foreground, Light, Look, Picture, Pose, Scene, SceneError, flight, pose::position_m,
};

fn scene() -> Scene {
    let look = Look { azimuth_rad: 0.7, depression_rad: 0.4, roll_rad: 0.1 };
    let camera = Config::ideal(Model::Equidistant, 320, 240, 200.0);
    Scene::new(camera, Pose::looking(position_m(45.0, 10.0, 240.0), look))
}

/// Returns mean and standard deviation over a rectangle, as fractions of full scale.
fn statistics(p: &Picture, columns: std::ops::Range<u16>, rows: std::ops::Range<u16>) -> (f64, f64) {
    let full = f64::from(p.view().full_scale());
    let values: Vec<f64> =
        rows.flat_map(|y| columns.clone().map(move |x| (x, y))).map(|(x, y)| f64::from(p.at(x, y)) / full).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt())
}

#[test]
fn same_seed_same_picture_on_any_number_of_threads() {
    let frame = &flight::rocket(480, 270, 3, 5).frames[1];
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| frame.render().unwrap())
    };
    let one = on(1);
    assert_eq!(one, on(3));
    let other = Scene { seed: frame.scene.seed + 1, ..frame.scene.clone() };
    assert_ne!(one, other.render().unwrap());
}

#[test]
fn noise_is_as_stated() {
    let mut s = scene();
    s.sky.brightness = 0.2;
    s.detector.bits = 12;
    s.detector.read_noise = 0.02;
    let p = s.render().unwrap();
    // The limb is around row 90: sky above, disc below.
    let (mean, sigma) = statistics(&p, 10..310, 5..40);
    assert!((mean - 0.2).abs() < 1e-3 && (sigma / 0.02 - 1.0).abs() < 0.05, "{mean} {sigma}");
    let (mean, sigma) = statistics(&p, 10..310, 180..235);
    assert!((mean - 0.8).abs() < 1e-3 && (sigma / 0.02 - 1.0).abs() < 0.05, "{mean} {sigma}");
}

#[test]
fn every_depth_has_its_full_scale() {
    for (bits, full) in [(8u8, 255u16), (10, 1023), (12, 4095), (16, 65535)] {
        let mut s = scene();
        s.disc.surface = 1.0;
        s.detector.bits = bits;
        let p = s.render().unwrap();
        assert_eq!((p.view().full_scale(), p.at(160, 230), p.bits()), (full, full, bits));
    }
}

#[test]
fn vehicle_hides_scene_and_limb() {
    let mut s = scene();
    s.foreground.push(Foreground {
        polygon_px: vec![[200.0, -5.0], [330.0, -5.0], [330.0, 250.0], [200.0, 250.0]],
        brightness: 0.4,
    });
    let p = s.render().unwrap();
    assert!((210..320).all(|x| (0..240).all(|y| p.at(x, y) == 102)));
    assert!(s.limb_points(200, EdgeNoise::None).unwrap().iter().all(|l| l.exact.u < 200.0));
}

#[test]
fn nothing_reaches_beyond_the_image_circle() {
    let mut s = scene();
    s.sky.brightness = 0.3;
    // 30° at 200 px/rad is 104.72 px.
    s.camera.theta_max_deg = Some(30.0);
    let p = s.render().unwrap();
    for (x, y) in (0..320u16).flat_map(|x| (0..240u16).map(move |y| (x, y))) {
        let r = (f64::from(x) - 159.5).hypot(f64::from(y) - 119.5);
        assert_eq!(p.at(x, y) == 0, r > 104.7198, "{x} {y}");
    }
    let limb = s.limb_points(300, EdgeNoise::None).unwrap();
    assert!(!limb.is_empty() && limb.iter().all(|l| (l.exact.u - 159.5).hypot(l.exact.v - 119.5) < 104.72));
}

#[test]
fn band_is_bright_and_ends_where_it_should() {
    let mut s = scene();
    s.disc = Disc { surface: 0.2, clouds: None, band: Some(Band { brightness: 0.9, depth_km: 30.0, fade_km: 0.0 }) };
    let p = s.render().unwrap();
    let column: Vec<u16> = (0..240).map(|y| p.at(160, y)).collect();
    let bright = column.iter().filter(|&&v| v > 128).count();
    // A depth of 30 km, seen tangentially from 240 km at a distance of about 1720 km, is 17.4 mrad or 3.5 px.
    assert!((3..=4).contains(&bright), "{bright}");
    assert_eq!((column[0], column[239]), (5, 51));
}

#[test]
fn light_falls_where_the_sun_is() {
    let mut s = scene();
    let sector = |centre_rad| Light::Sector { centre_rad, half_width_rad: 0.3, fade_rad: 0.0 };
    let whole = s.limb_points(400, EdgeNoise::None).unwrap();
    let middle = whole[200].azimuth_rad;
    s.light = sector(middle);
    let lit = s.limb_points(100, EdgeNoise::None).unwrap();
    assert!(lit.iter().all(|l| (l.azimuth_rad - middle).abs() < 0.3 + 1e-9));
    assert!(s.visible_limb_px().unwrap() < scene().visible_limb_px().unwrap());
    // The Sun is straight below the Earth and lights nothing in view.
    let night = s.pose.position_m.map(|x| -x);
    s.light = Light::Sun { direction: night, twilight_rad: 0.02 };
    let p = s.render().unwrap();
    assert!((0..240).all(|y| p.at(160, y) == 5));
    s.light = Light::Sun { direction: s.pose.position_m, twilight_rad: 0.02 };
    assert_eq!(s.render().unwrap(), scene().render().unwrap());
}

#[test]
fn clouds_make_many_edges() {
    let mut s = scene();
    s.disc = Disc { surface: 0.1, clouds: Some(Clouds::default()), band: None };
    let p = s.render().unwrap();
    let flips = |y: u16| (1..320).filter(|&x| (p.at(x - 1, y) > 100) != (p.at(x, y) > 100)).count();
    let edges: usize = (120..240).map(flips).sum();
    assert!(edges > 500, "{edges}");
}

#[test]
fn impossible_scenes_are_refused() {
    let mut s = scene();
    s.pose.position_m = [1e6, 0.0, 0.0];
    assert_eq!(s.render().unwrap_err(), SceneError::Pose);
    assert_eq!(s.truth("", 0.0).unwrap_err(), SceneError::Pose);
    let mut s = scene();
    s.pose.q_fixed_from_camera_wxyz = [0.0; 4];
    assert_eq!(s.render().unwrap_err(), SceneError::Pose);
    assert_eq!(s.limb_points(3, EdgeNoise::None).unwrap_err(), SceneError::Pose);
    let mut s = scene();
    s.camera.fx_px = -1.0;
    assert!(matches!(s.render(), Err(SceneError::Config(_))));
    let mut s = scene();
    s.light = Light::Sun { direction: [0.0; 3], twilight_rad: 0.1 };
    assert_eq!(s.render().unwrap_err(), SceneError::Sun);
}

#[test]
fn truth_and_frames_have_the_columns_of_their_files() {
    let frame = &flight::leo_infrared(2, 1).frames[1];
    let mut truth = csv::Writer::from_writer(Vec::new());
    truth.serialize(frame.truth().unwrap()).unwrap();
    let text = String::from_utf8(truth.into_inner().unwrap()).unwrap();
    let header = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,\
                  moon_x,moon_y,moon_z,qw,qx,qy,qz,position_x_km,position_y_km,position_z_km,phase_deg";
    assert_eq!(text.lines().next(), Some(header));
    let back: hzn_files::truth::Truth =
        csv::Reader::from_reader(text.as_bytes()).deserialize().next().unwrap().unwrap();
    assert_eq!(back, frame.truth().unwrap());

    let mut frames = csv::Writer::from_writer(Vec::new());
    frames.serialize(frame.row()).unwrap();
    let text = String::from_utf8(frames.into_inner().unwrap()).unwrap();
    assert_eq!(
        text.lines().next(),
        Some("file,time_s,utc,altitude_km,x_km,y_km,z_km,qw,qx,qy,qz,attitude_sigma_deg,rate_x,rate_y,rate_z")
    );
    assert!((frame.row().altitude_km - 600.0).abs() < 1e-6 && frame.row().x_km.hypot(frame.row().y_km) > 1000.0);
}
