//! Instructions by stage of the firmware in QEMU.

use hzn_core::status::Stage;
use hzn_core::{Config, camera};
use hzn_sim::flight::rocket;
use hzn_sim::{Disc, FlightFrame, Sky};
use hzn_tests::emulated::{Board, Case, bits, measure};

/// Frames of a rocket's flight: clean or cloudy.
fn frames(width: u16, height: u16, clean: bool, count: usize) -> Vec<Case> {
    let mut flight = rocket(width, height, count * 2, 7);
    // The lens scaled by the diagonal, as in the benchmarks: the image circle stays outside of the picture.
    let (w, h) = (f64::from(width), f64::from(height));
    let focal_px = 1233.0 * w.hypot(h) / 1920f64.hypot(1080.0);
    let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
    let lens = camera::Config { k, ..camera::Config::ideal(camera::Model::KannalaBrandt, width, height, focal_px) };
    let sensor = Config { camera: lens.clone(), ..flight.sensor.clone() };
    for frame in &mut flight.frames {
        frame.scene.camera = lens.clone();
        if clean {
            frame.scene.disc = Disc::default();
            frame.scene.sky = Sky { stars: 0, ..frame.scene.sky };
        }
    }
    let shown = |f: &&FlightFrame| f.scene.visible_limb_px().is_ok_and(|px| px > w * 0.5);
    let kind = if clean { "clean" } else { "cloudy" };
    let named = |(i, f): (usize, &FlightFrame)| Case::rendered(format!("{width}x{height} {kind} {i}"), &sensor, f);
    flight.frames.iter().filter(shown).take(count).enumerate().map(named).collect()
}

fn main() {
    let mut cases = Vec::new();
    for (w, h) in [(640, 480), (1024, 768), (1920, 1080)] {
        for clean in [true, false] {
            cases.extend(frames(w, h, clean, 4));
        }
    }
    for board in [Board::An500, Board::An386] {
        println!("\n{} ({}), instructions in thousands\n", board.core(), board.name());
        print!("{:22}{:>8}{:>8}{:>8}", "frame", "new", "expect", "process");
        for stage in Stage::ALL {
            print!("{:>11}", stage.name());
        }
        println!("  points cands stack same");
        for (case, m) in cases.iter().zip(measure(board, &cases)) {
            print!("{:22}", case.name);
            for n in m.calls {
                print!("{:8.1}", n as f64 / 1e3);
            }
            for n in m.stages {
                print!("{:11.1}", n as f64 / 1e3);
            }
            let same = bits(&case.here()) == bits(&m.answer);
            println!(
                "  {:6} {:5} {:5} {same} {}",
                m.answer.edge_points, m.answer.candidates, m.stack_bytes, m.answer.status
            );
        }
    }
}
