//! The diagnosis finds a wrong altitude and a wrong focal length in flights whose seeds occur nowhere else.

use std::fmt::Write as _;
use std::path::Path;

use egui_kittest::kittest::Queryable;
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_sim::flight::{Flight, rocket};
use hzn_viewer::model::diagnosis::{self, Consensus, Suspect};

use super::window::{HEIGHT, WIDTH, answer, folder, settled, until, window_on};

/// A value of the sensor or of the priors that is changed.
#[derive(Debug, Clone, Copy)]
enum Wrong {
    /// All altitudes are higher by this many km.
    Altitude(f64),
    /// Both focal lengths are larger by this factor.
    Focal(f64),
}

const ALL: [Wrong; 6] = [
    Wrong::Altitude(-25.0),
    Wrong::Altitude(20.0),
    Wrong::Altitude(45.0),
    Wrong::Focal(0.85),
    Wrong::Focal(0.95),
    Wrong::Focal(1.1),
];

/// Writes the sensor and the priors with a wrong value. Without positions, the altitude has no second source.
fn write(flight: &Flight, wrong: Wrong, folder: &Path) {
    let mut sensor = flight.sensor.clone();
    let mut shift_km = 0.0;
    match wrong {
        Wrong::Altitude(km) => shift_km = km,
        Wrong::Focal(factor) => {
            sensor.camera.fx_px *= factor;
            sensor.camera.fy_px *= factor;
        }
    }
    let mut table = "file,time_s,altitude_km\n".to_owned();
    for frame in &flight.frames {
        writeln!(table, "{},{},{}", frame.file, frame.time_s, frame.row().altitude_km + shift_km).unwrap();
    }
    std::fs::write(folder.join("frames.csv"), table).unwrap();
    std::fs::write(folder.join("sensor.toml"), toml::to_string(&sensor).unwrap()).unwrap();
}

/// Returns what the frames say in the window, the best cause first.
fn consensus(folder: &Path, frames: usize) -> Vec<Consensus> {
    let mut window = window_on(folder);
    until(&mut window, "not processed", |v| v.processed() == frames && !v.is_working());
    diagnosis::summarise(window.state().results().fits(0))
}

#[test]
fn wrong_values_are_measured_in_new_flights() {
    let (mut altitude_km, mut focal) = (0.0f64, 0.0f64);
    for seed in [9201, 9202] {
        let dir = tempfile::tempdir().unwrap();
        let flight = rocket(960, 540, 14, seed);
        flight.frames.iter().for_each(|f| f.render().unwrap().save(&dir.path().join(&f.file)).unwrap());
        for wrong in ALL {
            write(&flight, wrong, dir.path());
            let all = consensus(dir.path(), flight.frames.len());
            println!("seed {seed}, {wrong:?}");
            all.iter().for_each(|c| {
                println!("    {:?} {:.4} ± {:.4}, {:.2} σ", c.suspect, c.value, c.scatter, c.disagreement)
            });
            let of = |suspect| all.iter().find(|c| c.suspect == suspect).unwrap();
            match wrong {
                Wrong::Altitude(km) => altitude_km = altitude_km.max((of(Suspect::Altitude).value + km).abs()),
                Wrong::Focal(factor) => {
                    focal = focal.max((of(Suspect::Focal).value * factor - 1.0).abs());
                    assert_eq!(all[0].suspect, Suspect::Focal, "seed {seed}, {wrong:?}");
                }
            }
        }
    }
    println!("largest errors: altitude {altitude_km:.1} km, focal length {:.1} %", 100.0 * focal);
    assert!(altitude_km < 5.0 && focal < 0.02);
}

#[test]
fn a_single_frame_with_another_disc_is_not_blamed_on_the_sensor() {
    let (_dir, pictures) = folder();
    // A body of half the Earth's half-angle.
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 260.0)).unwrap();
    let axis = [0.1, 0.75f64.sin(), 0.75f64.cos()];
    let disc = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
        let ray = camera.unproject(ImagePoint { u: x.into(), v: y.into() }).unwrap().xyz();
        let cos: f64 = ray.iter().zip(axis).map(|(a, b)| a * b).sum::<f64>() / (1.0 + 0.01f64).sqrt();
        let inside_px = (0.65 - cos.acos()) * 260.0;
        image::Luma([(8.0 + 190.0 / (1.0 + (-inside_px / 0.6).exp())) as u8])
    });
    disc.save(pictures.join("4.png")).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 5 && !v.is_working());
    window.state_mut().go(4);
    settled(&mut window);
    window.run_steps(3);
    assert_ne!(answer(&window).0, Status::Ok);
    let words = "so this edge is probably not the limb";
    assert!(window.query_all_by_label_contains(words).next().is_some());
    assert!(window.query_by_label("Apply altitude").is_none());
    // The fourth picture is dark.
    window.state_mut().go(3);
    settled(&mut window);
    window.run_steps(3);
    assert!(window.query_all_by_label_contains("probably out of view, or hidden").next().is_some());
}
