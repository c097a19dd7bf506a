//! The sensor alone, as small as possible: one prepared sensor, one picture, both in external memory, one answer. The
//! flash and RAM of this image are the resources that the `hzn` chain needs on a flight computer, without the bytes of
//! the sensor.
//!
//! `sensor.bin` is the sensor that `hzn prepare` writes, and zeros behind it, as a page of flash has. `picture.bin` is
//! the picture, 1920×1080 bytes. `answer.bin` is the result in little-endian words: status, axis (3), covariance (xx,
//! xy, xz, yy, yz, zz), and the high-water mark of the stack in bytes. Axis and covariance are single-precision
//! numbers; the other two words are integers.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_core::image::{Grey, Layout};
use hzn_core::prepared::MAX_BYTES;
use hzn_core::{Prior, SensorPlace};
use hzn_core::{observer::Unobserved, pipeline::Workspace};
use hzn_mps2::board::Board;
use hzn_mps2::host::{File, exit};
use hzn_mps2::watermark;
use static_cell::ConstStaticCell;

const WIDTH: u16 = 1920;
const HEIGHT: u16 = 1080;

/// Has room for the 600 points of an edge that the default `edge_points.keep_points` keeps.
type Lists = Workspace<f32, 2048, 76, 512>;
static WORKSPACE: ConstStaticCell<Lists> = ConstStaticCell::new(Lists::new());
static SENSOR: ConstStaticCell<SensorPlace<f32>> = ConstStaticCell::new(SensorPlace::empty());

#[entry]
fn main() -> ! {
    exit(match run() {
        Some(()) => 0,
        None => 1,
    })
}

fn run() -> Option<()> {
    let mut board = Board::take()?;
    let [picture, sensor] = &mut board.frames;
    let sensor = sensor.get_mut(..MAX_BYTES)?;
    let picture = picture.get_mut(..usize::from(WIDTH) * usize::from(HEIGHT))?;
    if !File::open(c"picture.bin")?.read(picture) {
        return None;
    }
    let workspace = WORKSPACE.try_take()?;
    let place = SENSOR.try_take()?;
    if !File::open(c"sensor.bin")?.read(sensor) {
        return None;
    }
    hzn_setup::load(place, sensor).ok()?;
    let sensor = place.sensor()?;
    let expected = hzn_setup::expect(sensor, &Prior::default()).ok()?;
    let picture = Grey::try_new(&*picture, Layout::packed(WIDTH.into(), HEIGHT.into(), 1, 8)).ok()?;
    let report = sensor.process(workspace, &picture, &expected, &Unobserved);

    let mut words = [0u32; 11];
    let [status, direction @ .., stack]: &mut [u32; 11] = &mut words;
    *status = report.status as u32;
    if let Some(solution) = &report.solution {
        let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = solution.covariance.rows();
        for (word, value) in direction.iter_mut().zip(solution.axis.xyz().into_iter().chain([xx, xy, xz, yy, yz, zz])) {
            *word = value.to_bits();
        }
    }
    *stack = watermark::stack_bytes();
    let mut answer = File::create(c"answer.bin")?;
    words.iter().all(|w| answer.write(&w.to_le_bytes())).then_some(())
}
