//! A picture that comes row by row, for a flight computer without room for a whole one.
//!
//! The threshold of the first picture is unknown, so it only gives the threshold for the second one. Run it with
//! `cargo run --example rows -p hzn-core --features std`.

mod drawing;

use hzn_core::camera::{self, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::observer::Unobserved;
use hzn_core::pipeline::{ROWS_HELD, RowBuffers};
use hzn_core::{Config, FlightWorkspace, Prior, Sensor};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// Room for the rows that are held, 8192 changes between dark and lit, and 4096 edge points.
type Buffers = RowBuffers<u8, { ROWS_HELD as usize * WIDTH }, HEIGHT, 8192, 4096>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let lens = camera::Config::ideal(Model::Pinhole, WIDTH as u16, HEIGHT as u16, 500.0);
    let mut config = Config::new(lens);
    config.body.altitude_km = Some(200.0);
    // Rows are gone once they are through, so there is no second look at the picture.
    config.retry.levels.clear();
    let sensor = Sensor::<f32>::new(&config)?;
    let mut workspace = Box::new(FlightWorkspace::new());
    let mut buffers = Box::new(Buffers::new());

    let truth = UnitVec3::try_new([0.1, 1.0, 0.2]).ok_or("an axis of length zero")?;
    let half_angle_rad = sensor.expect(&Prior::default())?.half_angle_rad();
    let drawn = drawing::limb(&config.camera, &truth, f64::from(half_angle_rad));

    let mut level = None;
    for picture in 1..=2 {
        let expected = sensor.expect(&Prior { level, ..Prior::default() })?;
        let mut rows = sensor.rows(&mut buffers, 8, &expected)?;
        for row in drawn.chunks(WIDTH) {
            rows.push_row(row)?;
        }
        let report = rows.finish(&mut workspace, &Unobserved);
        println!("picture {picture}: {} at stage {}", report.status, report.stage.name());
        if let Some(solution) = &report.solution {
            println!("axis {:?}, {} inliers", solution.axis.xyz(), solution.inliers);
        }
        level = report.next_level;
    }
    println!("the buffers take {} KiB, the picture {} KiB", size_of::<Buffers>() / 1024, WIDTH * HEIGHT / 1024);
    Ok(())
}
