//! Writes a few pictures to look at into the folder given, and says how long they took.

use std::path::PathBuf;
use std::time::Instant;

use hzn_core::camera::{Config, Model};
use hzn_sim::{Clouds, Detector, Disc, Look, Pose, Profile, Scene, pose::position_m};

fn main() {
    let dir = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "look".into()));
    std::fs::create_dir_all(&dir).expect("the folder can be made");
    let camera = Config::ideal(Model::Equidistant, 1920, 1080, 1235.0);
    let look = Look { azimuth_rad: 0.4, depression_rad: 0.25, roll_rad: 0.3 };
    let mut scene = Scene::new(camera, Pose::looking(position_m(68.0, 21.0, 200.0), look));
    scene.profile = Profile::Exponential { scale_km: 4.0 };
    scene.disc = Disc { surface: 0.15, clouds: Some(Clouds::default()), band: None };
    scene.detector = Detector { psf_sigma_px: 0.9, read_noise: 0.02, ..Detector::default() };
    let start = Instant::now();
    let picture = scene.render().expect("the scene is valid");
    println!("{:?}", start.elapsed());
    picture.save(&dir.join("clouds.png")).expect("the picture can be written");
}
