//! The example of the documents, on a board with 192 KiB of RAM: the sensor and its lists are in a `static`. A test
//! compares the lines of the documents with this file.
//!
//! `picture.bin` is the picture, 64×48 bytes. `answer.bin` is the answer with every bit, and the high-water mark of the
//! stack in bytes, a little-endian word.

#![no_std]
#![no_main]

use core::fmt::Debug;

use cortex_m_rt::entry;
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, FlightHorizon, Prior};
use hzn_firmware::host::{File, exit};
use hzn_firmware::watermark;
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::Writer;
use static_cell::ConstStaticCell;

static HORIZON: ConstStaticCell<FlightHorizon> = ConstStaticCell::new(FlightHorizon::empty());
static PIXELS: ConstStaticCell<[u8; 64 * 48]> = ConstStaticCell::new([0; 64 * 48]);

/// Any error. It makes `?` work as in the documents, where an error is in a `Box`.
struct Failed;

impl<E: Debug> From<E> for Failed {
    fn from(_: E) -> Self {
        Self
    }
}

#[entry]
fn main() -> ! {
    let written = process().ok().and_then(|answer| write(&answer));
    exit(if written.is_some() { 0 } else { 1 })
}

fn process() -> Result<PictureAnswer, Failed> {
    let data = PIXELS.try_take().ok_or("the pixels are in use")?;
    if !File::open(c"picture.bin").ok_or("there is no picture")?.read(data) {
        return Err(Failed);
    }
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
    config.body.altitude_km = Some(230.0);
    let horizon = HORIZON.try_take().ok_or("the sensor is in use")?;
    horizon.configure(&config)?;

    let picture = Grey::try_new(&data[..], Layout::packed(64, 48, 1, 8))?;
    let expected = horizon.expect(&Prior { altitude_m: Some(231.5e3), ..Prior::default() })?;
    let report = horizon.process(&picture, &expected);
    Ok(PictureAnswer::from_report(&report, &config))
}

fn write(answer: &PictureAnswer) -> Option<()> {
    let mut bytes = [0; 640];
    let mut out = Writer::new(&mut bytes);
    answer.write(&mut out);
    let n = out.finish()?;
    let mut file = File::create(c"answer.bin")?;
    (file.write(bytes.get(..n)?) && file.write(&watermark::stack_bytes().to_le_bytes())).then_some(())
}
