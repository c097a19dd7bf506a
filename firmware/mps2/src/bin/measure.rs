//! Processes pictures from a file of the host. Writes the answers with every bit, and the instructions of each stage.
//!
//! `cases.bin` has for each case eight words (little-endian): "CASE", the length of the parameter table, the length of
//! the picture, altitude and ECEF position as single-precision numbers in metres (NaN if not known), and one spare. The
//! table follows, and then the picture with one byte per pixel.
//!
//! `results.bin` has for each case "DONE" and the ticks for making the sensor, for `expect` and for the whole picture.
//! Then follow the ticks of each of the eight stages (two words each, from a second run with an observer), the
//! high-water mark of the stack, the length of the answer, and the answer.

#![no_std]
#![no_main]

use core::cell::Cell;

use cortex_m_rt::entry;
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::{Observer, Unobserved};
use hzn_core::status::Stage;
use hzn_core::{FlightWorkspace, Prior};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::Writer;
use hzn_flight::table;
use hzn_mps2::board::{Board, Timer};
use hzn_mps2::host::{File, exit};
use hzn_mps2::watermark;
use static_cell::ConstStaticCell;

static WORKSPACE: ConstStaticCell<FlightWorkspace> = ConstStaticCell::new(FlightWorkspace::new());

/// Counts the ticks of each stage.
struct Clock {
    timer: Timer,
    since: Cell<u32>,
    stage: Cell<usize>,
    ticks: [Cell<u64>; 8],
}

impl Clock {
    fn lap(&self) {
        let now = self.timer.ticks();
        if let Some(cell) = self.ticks.get(self.stage.get()) {
            // A lap is shorter than the timer's 168 million instructions, but the sum of laps may be longer.
            cell.set(cell.get().wrapping_add(u64::from(now.wrapping_sub(self.since.get()))));
        }
    }
}
impl Observer<f32> for Clock {
    fn enter(&self, stage: Stage) {
        self.lap();
        self.stage.set(stage as usize);
        self.since.set(self.timer.ticks());
    }
    fn leave(&self) {
        self.lap();
        self.stage.set(usize::MAX);
    }
}

#[entry]
fn main() -> ! {
    exit(match run() {
        Some(()) => 0,
        None => 1,
    })
}

fn run() -> Option<()> {
    let mut board = Board::take()?;
    let mut cases = File::open(c"cases.bin")?;
    let mut results = File::create(c"results.bin")?;
    let [frame_buffer, table_buffer] = &mut board.frames;
    let workspace = WORKSPACE.try_take()?;
    let timer = board.timer;
    loop {
        let mut header = [0u8; 32];
        if !cases.read(&mut header) {
            return Some(());
        }
        let words: [u32; 8] = core::array::from_fn(|i| {
            header.get(4 * i..).and_then(|h| h.first_chunk()).map_or(0, |w| u32::from_le_bytes(*w))
        });
        let [magic, table_len, frame_len, altitude, x, y, z, _] = words;
        if magic != u32::from_le_bytes(*b"CASE") {
            return None;
        }
        let table_bytes = table_buffer.get_mut(..table_len as usize)?;
        let frame_bytes = frame_buffer.get_mut(..frame_len as usize)?;
        if !cases.read(table_bytes) || !cases.read(frame_bytes) {
            return None;
        }
        let (parameters, _) = table::read(table_bytes).ok()?;
        let camera = &parameters.sensor.camera;
        let layout = Layout::packed(camera.width.into(), camera.height.into(), 1, 8);
        let picture = Grey::try_new(&*frame_bytes, layout).ok()?;
        let given = |bits: u32| Some(f32::from_bits(bits)).filter(|v| !v.is_nan());
        let position_m = match (given(x), given(y), given(z)) {
            (Some(x), Some(y), Some(z)) => Some([x, y, z]),
            _ => None,
        };
        let frame = Prior { altitude_m: given(altitude), position_m, ..Prior::default() };

        let t0 = timer.ticks();
        let sensor = hzn_setup::sensor(&parameters.sensor).ok()?;
        let t1 = timer.ticks();
        let expected = hzn_setup::expect(&sensor, &frame).ok()?;
        let t2 = timer.ticks();
        let report = sensor.process(workspace, &picture, &expected, &Unobserved);
        let t3 = timer.ticks();
        let clock = Clock {
            timer,
            since: Cell::new(0),
            stage: Cell::new(usize::MAX),
            ticks: core::array::from_fn(|_| Cell::new(0)),
        };
        let again = sensor.process(workspace, &picture, &expected, &clock);
        let answer = PictureAnswer::from_report(&report);
        if PictureAnswer::from_report(&again).status != answer.status {
            return None;
        }

        let mut bytes = [0u8; 640];
        let mut out = Writer::new(&mut bytes);
        answer.write(&mut out);
        let len = out.finish()?;
        let mut head = [0u8; 88];
        let mut out = Writer::new(&mut head);
        out.bytes(b"DONE");
        for ticks in [t1.wrapping_sub(t0), t2.wrapping_sub(t1), t3.wrapping_sub(t2)] {
            out.u32(ticks);
        }
        for ticks in &clock.ticks {
            out.u64(ticks.get());
        }
        out.u32(watermark::stack_bytes());
        out.u32(len as u32);
        out.finish()?;
        if !results.write(&head) || !results.write(bytes.get(..len)?) {
            return None;
        }
    }
}
