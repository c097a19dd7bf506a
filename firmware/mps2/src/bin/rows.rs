//! Does the same as `measure` without a picture in memory: pictures of 640×480 pixels come row by row, as from a
//! camera, and external memory is not used. [`hzn_mps2::cases`] describes the files. The three calls are making the
//! sensor, taking all rows, and the end of the picture; the ticks of the stages are 0. The position of a case is not
//! used.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_core::{Prior, Sensor};
use hzn_core::{
    observer::Unobserved,
    pipeline::{ROWS_HELD, RowBuffers, Workspace},
};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::table;
use hzn_mps2::board::Board;
use hzn_mps2::cases::{CaseHeader, STAGES, write_result};
use hzn_mps2::host::{File, exit};
use static_cell::ConstStaticCell;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
type Picture = RowBuffers<u8, { ROWS_HELD as usize * WIDTH }, HEIGHT, 8192, 2560>;
/// Has room for 600 points of an edge.
type Lists = Workspace<f32, 2048, 76, 512>;

static PICTURE: ConstStaticCell<Picture> = ConstStaticCell::new(Picture::new());
static LISTS: ConstStaticCell<Lists> = ConstStaticCell::new(Lists::new());
static TABLE: ConstStaticCell<[u8; table::MAX_BYTES]> = ConstStaticCell::new([0; table::MAX_BYTES]);

#[entry]
fn main() -> ! {
    exit(match run() {
        Some(()) => 0,
        None => 1,
    })
}

fn run() -> Option<()> {
    let timer = Board::take()?.timer;
    let mut cases = File::open(c"cases.bin")?;
    let mut results = File::create(c"results.bin")?;
    let (picture, lists, table_buffer) = (PICTURE.try_take()?, LISTS.try_take()?, TABLE.try_take()?);
    loop {
        let Some(header) = CaseHeader::read(&mut cases).ok()? else { return Some(()) };
        if header.picture_bytes != WIDTH * HEIGHT {
            return None;
        }
        let table_bytes = table_buffer.get_mut(..header.table_bytes)?;
        if !cases.read(table_bytes) {
            return None;
        }
        let (parameters, _) = table::read(table_bytes).ok()?;
        let prior = Prior { altitude_m: header.altitude_m, ..Prior::default() };

        let t0 = timer.ticks();
        let sensor = Sensor::new(&parameters.sensor).ok()?;
        let t1 = timer.ticks();
        let expected = sensor.expect(&prior).ok()?;
        let mut stream = sensor.rows(picture, 8, &expected).ok()?;
        let (mut row, mut taking) = ([0u8; WIDTH], 0u32);
        for _ in 0..HEIGHT {
            if !cases.read(&mut row) {
                return None;
            }
            let t = timer.ticks();
            stream.push_row(&row).ok()?;
            taking = taking.wrapping_add(timer.ticks().wrapping_sub(t));
        }
        let t2 = timer.ticks();
        let report = stream.finish(lists, &Unobserved);
        let t3 = timer.ticks();

        let calls = [t1.wrapping_sub(t0), taking, t3.wrapping_sub(t2)];
        write_result(&mut results, calls, [0; STAGES], &PictureAnswer::from_report(&report, &parameters.sensor))?;
    }
}
