//! The sensor alone, as small as possible: one configuration in flash, one picture in external memory, one answer. The
//! flash and RAM of this image are the resources that the `hzn` chain needs on a flight computer.
//!
//! `picture.bin` is the picture, 1920×1080 bytes. `answer.bin` is the result in little-endian words: status, axis (3),
//! covariance (xx, xy, xz, yy, yz, zz), and the high-water mark of the stack in bytes. Axis and covariance are
//! single-precision numbers; the other two words are integers.

#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, Prior, SensorPlace};
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

/// Makes the sensor where it lies.
// Not inlined: the configuration must not stay on the stack while a picture is processed.
#[inline(never)]
fn configure(place: &mut SensorPlace<f32>) -> Option<()> {
    // `black_box` hides the configuration from the compiler, which would otherwise leave out the methods that it does
    // not choose.
    hzn_setup::configure(place, black_box(&config())).ok()
}

/// Returns the configuration with the lens of the rocket's flight, at an altitude of 150 km.
fn config() -> Config {
    let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
    let lens = camera::Config { k, ..camera::Config::ideal(Model::KannalaBrandt, WIDTH, HEIGHT, 1233.0) };
    let mut config = Config::new(lens);
    config.body.altitude_km = Some(150.0);
    config
}

fn run() -> Option<()> {
    let mut board = Board::take()?;
    let [picture, _] = &mut board.frames;
    let picture = picture.get_mut(..usize::from(WIDTH) * usize::from(HEIGHT))?;
    if !File::open(c"picture.bin")?.read(picture) {
        return None;
    }
    let workspace = WORKSPACE.try_take()?;
    let place = SENSOR.try_take()?;
    configure(place)?;
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
