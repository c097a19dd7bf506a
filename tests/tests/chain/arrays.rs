//! Tests the images for thermal arrays: code for a Cortex-M0+ and for a RISC-V gives the same bits as this machine. The
//! tests need the images that `cargo xtask test --all firmware` builds.

use hzn_core::camera::{self, Model};
use hzn_core::observer::Unobserved;
use hzn_core::pipeline::{ROWS_HELD, RowBuffers, Workspace};
use hzn_core::status::Status;
use hzn_core::{Config, Prior, Sensor, SensorPlace};
use hzn_sim::flight::leo_infrared;
use hzn_sim::pose::position_m;
use hzn_sim::{FlightFrame, Look, Pose, Samples};
use hzn_tests::emulated::{ArrayAnswer, Board, run_array};
use hzn_tests::stack_bound::stack_bound;

/// Altitude of the flight above the mean Earth.
const ALTITUDE_KM: f64 = 600.0;

/// Returns pictures of an infrared Earth through the lens of an array, with the limb in view, and their sensor.
fn pictures(lens: &camera::Config, count: usize, seed: u64) -> (Config, Vec<Vec<u16>>) {
    let flight = leo_infrared(count, seed);
    let mut config = flight.sensor.clone();
    config.camera = lens.clone();
    (config.body.altitude_km, config.body.altitude_sigma_km) = (Some(ALTITUDE_KM), 10.0);
    let render = |(number, frame): (usize, &FlightFrame)| {
        let mut scene = frame.scene.clone();
        scene.camera = lens.clone();
        scene.detector.bits = 16;
        let turn = number as f64;
        let depression_rad = (19.0 + 10.0 * (turn * 0.618).fract()).to_radians();
        let look = Look { azimuth_rad: turn, depression_rad, roll_rad: 2.4 * turn };
        scene.pose = Pose::looking(position_m(13.0 * turn % 160.0 - 80.0, 29.0 * turn, ALTITUDE_KM), look);
        match scene.render().expect("the scene can be rendered").samples() {
            Samples::Words(words) => words.clone(),
            Samples::Bytes(_) => panic!("the picture must have 16 bits"),
        }
    };
    (config, flight.frames.iter().enumerate().map(render).collect())
}

/// Returns the answers of this machine with lists of the same sizes.
fn answers_here<
    const WINDOW: usize,
    const HEIGHT: usize,
    const TURNS: usize,
    const EDGES: usize,
    const POINTS: usize,
    const BLOCKS: usize,
    const MARKS: usize,
>(
    rows: &mut RowBuffers<u16, WINDOW, HEIGHT, TURNS, EDGES>,
    lists: &mut Workspace<f32, POINTS, BLOCKS, MARKS>,
    config: &Config,
    pictures: &[Vec<u16>],
) -> Vec<(u32, [u32; 9])> {
    let sensor = Sensor::<f32>::new(config).unwrap();
    let mut level = None;
    let mut answer = |picture: &Vec<u16>| {
        let expected = sensor.expect(&Prior { level, ..Prior::default() }).unwrap();
        let mut stream = sensor.rows(rows, 16, &expected).unwrap();
        picture.chunks(config.camera.width.into()).for_each(|row| stream.push_row(row).unwrap());
        let report = stream.finish(lists, &Unobserved);
        level = report.next_level;
        let direction = report.solution.as_ref().map_or([0; 9], |s| {
            let ([x, y, z], [[xx, xy, xz], [_, yy, yz], [_, _, zz]]) = (s.axis.xyz(), s.covariance.rows());
            [x, y, z, xx, xy, xz, yy, yz, zz].map(f32::to_bits)
        });
        (report.status as u32, direction)
    };
    pictures.iter().map(&mut answer).collect()
}

/// Asserts that a board agrees with this machine, and prints what a picture costs. Returns the largest stack, in bytes.
fn compare(board: Board, there: &[ArrayAnswer], here: &[(u32, [u32; 9])]) -> usize {
    let mut answered = 0;
    for (number, (there, here)) in there.iter().zip(here).enumerate() {
        assert_eq!((there.status, there.direction), *here, "{board:?}, picture {number}");
        answered += usize::from(here.0 == Status::Ok as u32);
    }
    assert_eq!(there.len(), here.len());
    // The first picture gives only the threshold of the second one.
    assert!(10 * answered >= 9 * (here.len() - 1), "{answered} of {}", here.len());
    let most = |part: fn(&ArrayAnswer) -> u64| there.iter().map(part).max().unwrap_or_default();
    println!(
        "{}: {answered} of {} answered, with the same bits; at most {} thousand instructions for the rows and {} for \
         the end",
        board.core(),
        here.len(),
        most(|a| a.rows) / 1000,
        most(|a| a.end) / 1000,
    );
    most(|a| a.stack_bytes.into()) as usize
}

/// Asserts that lists and stack of an image for a Cortex-M0+ take at most this number of bytes.
fn assert_ram(image: &str, list_bytes: usize, stack_bytes: usize, most_bytes: usize) {
    let bound = stack_bound(&Board::Array.image(image)).unwrap().bytes as usize;
    let all = list_bytes + bound;
    println!(
        "{image}: {list_bytes} bytes of lists, {stack_bytes} of stack, at most {bound} by the calls, together {all}"
    );
    assert!(stack_bytes <= bound && all <= most_bytes, "{image}: {all} bytes");
}

#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn an_array_of_160_columns_fits_into_48_kib() {
    type Rows = RowBuffers<u16, { ROWS_HELD as usize * 160 }, 120, 384, 320>;
    type Lists = Workspace<f32, 320, 20, 160>;
    let (config, pictures) = pictures(&camera::Config::ideal(Model::Equidistant, 160, 120, 160.8), 12, 31);
    let here = answers_here(&mut Rows::new(), &mut Lists::new(), &config, &pictures);
    let list_bytes = size_of::<Rows>() + size_of::<Lists>() + size_of::<SensorPlace<f32>>();
    let stack_bytes = compare(Board::Array, &run_array(Board::Array, "array160", &config, &pictures), &here);
    assert_ram("array160", list_bytes, stack_bytes, 48 * 1024);
    // The linker gives the RISC-V 48 KiB of RAM. The stack is what the lists leave.
    let stack_bytes = compare(Board::RiscV, &run_array(Board::RiscV, "array160", &config, &pictures), &here);
    println!("RISC-V: {stack_bytes} bytes of stack");
    assert!(list_bytes + stack_bytes < 48 * 1024, "{stack_bytes}");
}

/// An array of 32×24 needs 34 KiB and not 24: the sensor has 8 KiB, and the stack 18.
#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn an_array_of_32_columns_fits_into_34_kib() {
    type Rows = RowBuffers<u16, { ROWS_HELD as usize * 32 }, 24, 128, 96>;
    type Lists = Workspace<f32, 96, 12, 32>;
    let (config, pictures) = pictures(&camera::Config::ideal(Model::Equidistant, 32, 24, 16.67), 24, 32);
    let here = answers_here(&mut Rows::new(), &mut Lists::new(), &config, &pictures);
    let list_bytes = size_of::<Rows>() + size_of::<Lists>() + size_of::<SensorPlace<f32>>();
    let stack_bytes = compare(Board::Array, &run_array(Board::Array, "array32", &config, &pictures), &here);
    assert_ram("array32", list_bytes, stack_bytes, 34 * 1024);
}
