//! Processes pictures from a file of the host. Writes the answers with every bit, and the instructions of each stage.
//!
//! [`hzn_mps2::cases`] describes the files. The three calls are making the sensor, `expect`, and the whole picture. The
//! ticks of the stages come from a second run with an observer.

#![no_std]
#![no_main]

use core::cell::Cell;

use cortex_m_rt::entry;
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Observer;
use hzn_core::status::Stage;
use hzn_core::{FlightWorkspace, Prior};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::table;
use hzn_mps2::board::{Board, Timer};
use hzn_mps2::cases::{CaseHeader, STAGES, write_result};
use hzn_mps2::host::{File, exit};
use static_cell::ConstStaticCell;

static WORKSPACE: ConstStaticCell<FlightWorkspace> = ConstStaticCell::new(FlightWorkspace::new());

/// Counts the ticks of each stage, if it has a timer.
// The run without a timer has this type, too: with another observer the whole pipeline would be in the image twice.
struct Clock {
    timer: Option<Timer>,
    since: Cell<u32>,
    stage: Cell<usize>,
    ticks: [Cell<u64>; STAGES],
}

impl Clock {
    fn new(timer: Option<Timer>) -> Self {
        Self { timer, since: Cell::new(0), stage: Cell::new(usize::MAX), ticks: core::array::from_fn(|_| Cell::new(0)) }
    }
    fn lap(&self) {
        let Some(timer) = &self.timer else { return };
        let now = timer.ticks();
        if let Some(cell) = self.ticks.get(self.stage.get()) {
            // A lap is shorter than the timer's 168 million instructions, but the sum of laps may be longer.
            cell.set(cell.get().wrapping_add(u64::from(now.wrapping_sub(self.since.get()))));
        }
    }
}
impl Observer<f32> for Clock {
    fn enter(&self, stage: Stage) {
        self.lap();
        if let Some(timer) = &self.timer {
            self.stage.set(stage as usize);
            self.since.set(timer.ticks());
        }
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
        let Some(header) = CaseHeader::read(&mut cases).ok()? else { return Some(()) };
        let table_bytes = table_buffer.get_mut(..header.table_bytes)?;
        let frame_bytes = frame_buffer.get_mut(..header.picture_bytes)?;
        if !cases.read(table_bytes) || !cases.read(frame_bytes) {
            return None;
        }
        let (parameters, _) = table::read(table_bytes).ok()?;
        let camera = &parameters.sensor.camera;
        let layout = Layout::packed(camera.width.into(), camera.height.into(), 1, 8);
        let picture = Grey::try_new(&*frame_bytes, layout).ok()?;
        let prior = Prior { altitude_m: header.altitude_m, position_m: header.position_m, ..Prior::default() };

        let t0 = timer.ticks();
        let sensor = hzn_setup::new_sensor(&parameters.sensor).ok()?;
        let t1 = timer.ticks();
        let expected = hzn_setup::expect(&sensor, &prior).ok()?;
        let t2 = timer.ticks();
        let report = sensor.process(workspace, &picture, &expected, &Clock::new(None));
        let t3 = timer.ticks();
        let clock = Clock::new(Some(timer));
        let again = sensor.process(workspace, &picture, &expected, &clock);
        let answer = PictureAnswer::from_report(&report, &parameters.sensor);
        if again.status as u8 != answer.status {
            return None;
        }
        let calls = [t1.wrapping_sub(t0), t2.wrapping_sub(t1), t3.wrapping_sub(t2)];
        write_result(&mut results, calls, clock.ticks.map(Cell::into_inner), &answer)?;
    }
}
