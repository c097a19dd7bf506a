//! Does the same as `measure` with pictures that are a sequence: the sensor of the first case looks for the limb where
//! the picture before puts it. [`hzn_mps2::cases`] describes the files. A tenth of a second is between two pictures.
//! The three calls are making the sensor, `expect`, and the whole picture; the ticks of the stages are 0.

#![no_std]
#![no_main]

use cortex_m_rt::entry;
use hzn_core::image::{Grey, Layout};
use hzn_core::{FlightWorkspace, Prior, Sensor, Step, Tracker, Unobserved};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::table;
use hzn_mps2::board::Board;
use hzn_mps2::cases::{CaseHeader, STAGES, write_result};
use hzn_mps2::host::{File, exit};
use static_cell::ConstStaticCell;

static WORKSPACE: ConstStaticCell<FlightWorkspace> = ConstStaticCell::new(FlightWorkspace::new());

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
    let mut tracker = Tracker::default();
    let mut made: Option<Sensor<f32>> = None;
    loop {
        let Some(header) = CaseHeader::read(&mut cases).ok()? else { return Some(()) };
        let table_bytes = table_buffer.get_mut(..header.table_bytes)?;
        let frame_bytes = frame_buffer.get_mut(..header.picture_bytes)?;
        if !cases.read(table_bytes) || !cases.read(frame_bytes) {
            return None;
        }
        let t0 = timer.ticks();
        let sensor = match &made {
            Some(sensor) => sensor,
            None => made.insert(hzn_setup::new_sensor(&table::read(table_bytes).ok()?.0.sensor).ok()?),
        };
        let t1 = timer.ticks();
        let camera = &sensor.config().camera;
        let layout = Layout::packed(camera.width.into(), camera.height.into(), 1, 8);
        let picture = Grey::try_new(&*frame_bytes, layout).ok()?;
        let prior = Prior { altitude_m: header.altitude_m, position_m: header.position_m, ..Prior::default() };
        let t2 = timer.ticks();
        let expected = hzn_setup::expect(sensor, &prior).ok()?;
        let step = Step::from_prior(&prior, Some(0.1));
        let t3 = timer.ticks();
        let report = sensor.track(workspace, &mut tracker, &picture, (&expected, &step), &Unobserved);
        let t4 = timer.ticks();
        let calls = [t1.wrapping_sub(t0), t3.wrapping_sub(t2), t4.wrapping_sub(t3)];
        write_result(&mut results, calls, [0; STAGES], &PictureAnswer::from_report(&report, sensor.config()))?;
    }
}
