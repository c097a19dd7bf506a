//! The sensor of an array of 160×120 pixels; [`hzn_firmware::array`] describes the files.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_core::SensorPlace;
use hzn_core::pipeline::{ROWS_HELD, RowBuffers, Workspace};
use hzn_core::prepared::MAX_BYTES;
use hzn_firmware::array;
use hzn_mps2::board::Board;
use hzn_mps2::host::exit;
use static_cell::ConstStaticCell;

const WIDTH: usize = 160;
const HEIGHT: usize = 120;
/// Has room for 320 border pixels of all edges, and for 384 changes between dark and lit.
type Rows = RowBuffers<u16, { ROWS_HELD as usize * WIDTH }, HEIGHT, 384, 320>;
/// Has room for 320 points of an edge.
type Lists = Workspace<f32, 320, 20, 160>;

static SENSOR: ConstStaticCell<SensorPlace<f32>> = ConstStaticCell::new(SensorPlace::empty());
static ROWS: ConstStaticCell<Rows> = ConstStaticCell::new(Rows::new());
static LISTS: ConstStaticCell<Lists> = ConstStaticCell::new(Lists::new());

#[entry]
fn main() -> ! {
    exit(match run() {
        Some(()) => 0,
        None => 1,
    })
}

fn run() -> Option<()> {
    let Board { frames: [page, _], timer, .. } = Board::take()?;
    let page = page.first_chunk_mut::<MAX_BYTES>()?;
    array::run(page, || timer.ticks(), SENSOR.try_take()?, ROWS.try_take()?, LISTS.try_take()?)
}
