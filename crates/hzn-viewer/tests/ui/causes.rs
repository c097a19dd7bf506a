//! The diagnosis finds a wrong altitude and a wrong focal length in flights whose seeds occur nowhere else.

use std::fmt::Write as _;
use std::path::Path;

use hzn_sim::flight::{Flight, rocket};
use hzn_viewer::model::diagnosis::{self, Consensus, Suspect};

use super::window::{until, window_on};

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
