//! Does the same as `measure` without a picture in memory: pictures of 640×480 pixels come row by row, as from a
//! camera, and external memory is not used. `cases.bin` and `results.bin` are those of `measure`. The second count of
//! ticks is for taking all rows, the third for the end of the picture; the counts of the stages are 0.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_core::{Prior, Sensor};
use hzn_core::{
    observer::Unobserved,
    pipeline::{ROWS_HELD, RowBuffers, Workspace},
};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::Writer;
use hzn_flight::table;
use hzn_mps2::board::Board;
use hzn_mps2::host::{File, exit};
use hzn_mps2::watermark;
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
        let mut header = [0u8; 32];
        if !cases.read(&mut header) {
            return Some(());
        }
        let words: [u32; 8] = core::array::from_fn(|i| {
            header.get(4 * i..).and_then(|h| h.first_chunk()).map_or(0, |w| u32::from_le_bytes(*w))
        });
        let [magic, table_len, frame_len, altitude, ..] = words;
        if magic != u32::from_le_bytes(*b"CASE") || frame_len as usize != WIDTH * HEIGHT {
            return None;
        }
        let table_bytes = table_buffer.get_mut(..table_len as usize)?;
        if !cases.read(table_bytes) {
            return None;
        }
        let (parameters, _) = table::read(table_bytes).ok()?;
        let known = Prior { altitude_m: Some(f32::from_bits(altitude)).filter(|v| !v.is_nan()), ..Prior::default() };

        let t0 = timer.ticks();
        let sensor = Sensor::new(&parameters.sensor).ok()?;
        let t1 = timer.ticks();
        let expected = sensor.expect(&known).ok()?;
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

        let mut bytes = [0u8; 640];
        let mut out = Writer::new(&mut bytes);
        PictureAnswer::from_report(&report).write(&mut out);
        let len = out.finish()?;
        let mut head = [0u8; 88];
        let mut out = Writer::new(&mut head);
        out.bytes(b"DONE");
        for ticks in [t1.wrapping_sub(t0), taking, t3.wrapping_sub(t2)] {
            out.u32(ticks);
        }
        for _ in 0..8 {
            out.u64(0);
        }
        out.u32(watermark::stack_bytes());
        out.u32(len as u32);
        out.finish()?;
        if !results.write(&head) || !results.write(bytes.get(..len)?) {
            return None;
        }
    }
}
