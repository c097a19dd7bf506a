//! The sensor of a thermal array: pictures come row by row, and nothing but the answer is kept.
//!
//! The images `array32` and `array160` have room for arrays of 32×24 and of 160×120 pixels. They are built for
//! processors without a floating-point unit: a Cortex-M0+, which has no compare-and-swap either, and a 32-bit RISC-V.
//!
//! `sensor.bin` is the sensor that `hzn prepare` writes, and zeros behind it, as a page of flash has; it is read into
//! external memory, which stands for flash. `pictures.bin` is the pictures, one after another, with a little-endian
//! word of 16 bits per pixel. Each picture takes its threshold from the one before. `answer.bin` has 13 little-endian
//! words for each picture: status, axis (3), covariance (xx, xy, xz, yy, yz, zz), ticks of the rows, ticks of the end
//! of the picture, and the high-water mark of the stack in bytes. Axis and covariance are single-precision numbers; the
//! other words are integers.

use hzn_core::observer::Unobserved;
use hzn_core::pipeline::{RowBuffers, Workspace};
use hzn_core::prepared::MAX_BYTES;
use hzn_core::{Prior, Sensor, SensorPlace};

use crate::host::File;
use crate::watermark;

/// Significant bits of a sample.
const BITS: u8 = 16;
/// Words of an answer.
const WORDS: usize = 13;
/// Longest row.
const MAX_WIDTH: usize = 160;

/// Processes all pictures. `page` stands for the flash in which the sensor lies on the real part; `ticks` is the clock.
/// Returns `None` if a file is missing or the sensor does not fit.
pub fn run<
    const WINDOW: usize,
    const HEIGHT: usize,
    const TURNS: usize,
    const EDGES: usize,
    const POINTS: usize,
    const BLOCKS: usize,
    const MARKS: usize,
>(
    page: &mut [u8; MAX_BYTES],
    ticks: impl Fn() -> u32,
    place: &mut SensorPlace<f32>,
    rows: &mut RowBuffers<u16, WINDOW, HEIGHT, TURNS, EDGES>,
    lists: &mut Workspace<f32, POINTS, BLOCKS, MARKS>,
) -> Option<()> {
    if !File::open(c"sensor.bin")?.read(page) {
        return None;
    }
    hzn_setup::load(place, page).ok()?;
    let sensor = place.sensor()?;
    let mut pictures = File::open(c"pictures.bin")?;
    let mut answers = File::create(c"answer.bin")?;
    let mut level = None;
    loop {
        let mut words = [0u32; WORDS];
        let [status, direction @ .., taking, ending, stack]: &mut [u32; WORDS] = &mut words;
        let expected = hzn_setup::expect(sensor, &Prior { level, ..Prior::default() }).ok()?;
        let mut stream = sensor.rows(rows, BITS, &expected).ok()?;
        for _ in 0..HEIGHT {
            let Some(row) = read_row(&mut pictures, sensor) else { return Some(()) };
            let begin = ticks();
            stream.push_row(row.get(..usize::from(sensor.camera().width()))?).ok()?;
            *taking = taking.wrapping_add(ticks().wrapping_sub(begin));
        }
        let begin = ticks();
        let report = stream.finish(lists, &Unobserved);
        *ending = ticks().wrapping_sub(begin);
        level = report.next_level;
        *status = report.status as u32;
        if let Some(solution) = &report.solution {
            let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = solution.covariance.rows();
            let numbers = solution.axis.xyz().into_iter().chain([xx, xy, xz, yy, yz, zz]);
            for (word, value) in direction.iter_mut().zip(numbers) {
                *word = value.to_bits();
            }
        }
        *stack = watermark::stack_bytes();
        if !words.iter().all(|word| answers.write(&word.to_le_bytes())) {
            return None;
        }
    }
}

/// Reads the next row; `None` at the end of the file.
#[inline(never)]
fn read_row(pictures: &mut File, sensor: &Sensor<f32>) -> Option<[u16; MAX_WIDTH]> {
    let mut bytes = [0; 2 * MAX_WIDTH];
    let bytes = bytes.get_mut(..2 * usize::from(sensor.camera().width()))?;
    if !pictures.read(bytes) {
        return None;
    }
    let mut row = [0; MAX_WIDTH];
    for (pixel, pair) in row.iter_mut().zip(bytes.as_chunks().0) {
        *pixel = u16::from_le_bytes(*pair);
    }
    Some(row)
}
