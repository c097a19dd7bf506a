//! Runs the firmware in QEMU. The input is pictures; the output is answers with every bit, and instruction counts.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, FlightHorizon, Prior, Sensor, camera, prepared};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::{Parameters, table};
use hzn_host::Compiled;

/// Board that QEMU emulates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// Cortex-M4F, single precision.
    An386,
    /// Cortex-M7, double precision.
    An500,
    /// Cortex-M4F with 192 KiB of RAM. It has only the images `flight`, which takes the rows of a picture one by one,
    /// and `example`.
    Stm32F405,
    /// Code for a Cortex-M0+, which the Cortex-M7 runs. It has only the images for thermal arrays, without memory for a
    /// picture.
    Array,
    /// 32-bit RISC-V without a floating-point unit. It has only the image for an array of 160×120 pixels.
    RiscV,
}

impl Board {
    /// Returns the boards with memory for pictures, which have every image; only one of them if the variable
    /// `HZN_BOARD` names it.
    ///
    /// # Panics
    /// Panics if the variable names no such board.
    pub fn with_pictures() -> Vec<Self> {
        let boards = vec![Self::An386, Self::An500];
        match std::env::var("HZN_BOARD").unwrap_or_default().as_str() {
            "" => boards,
            name => vec![boards.into_iter().find(|board| board.name() == name).expect("HZN_BOARD: an386 or an500")],
        }
    }

    /// Returns the name that the folders of the images use.
    pub fn name(self) -> &'static str {
        match self {
            Self::An386 => "an386",
            Self::An500 => "an500",
            Self::Stm32F405 => "stm32f405",
            Self::Array => "array",
            Self::RiscV => "riscv",
        }
    }

    /// Returns QEMU's name of the machine.
    fn machine(self) -> &'static str {
        match self {
            Self::An386 => "mps2-an386",
            Self::An500 | Self::Array => "mps2-an500",
            Self::Stm32F405 => "netduinoplus2",
            Self::RiscV => "virt",
        }
    }

    /// Returns the name of the core, for messages.
    pub fn core(self) -> &'static str {
        match self {
            Self::An386 | Self::Stm32F405 => "Cortex-M4F",
            Self::An500 => "Cortex-M7",
            Self::Array => "Cortex-M0+",
            Self::RiscV => "RISC-V",
        }
    }

    /// Returns the path of an image that `cargo xtask firmware` has built.
    ///
    /// # Panics
    /// Panics if the image was not built.
    pub fn image(self, name: &str) -> PathBuf {
        let target = std::env::var_os("CARGO_TARGET_DIR")
            .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"), PathBuf::from);
        let path = target.join("firmware").join(self.name()).join("images").join(name);
        assert!(path.is_file(), "{} is missing; run `cargo xtask firmware`", path.display());
        path
    }

    /// Returns a call of QEMU for this board with an exact clock: an instruction takes `2^shift` ns. With `shift` = 10
    /// the timer counts single instructions. With 0 the board's clock is slower than that of this machine, so serial
    /// input arrives in time even on a busy machine.
    pub fn qemu(self, image: &Path, shift: u32) -> Command {
        let mut command = Command::new(if self == Self::RiscV { "qemu-system-riscv32" } else { "qemu-system-arm" });
        if self == Self::RiscV {
            command.args(["-bios", "none"]);
        }
        command
            .args(["-M", self.machine(), "-display", "none", "-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native", "-icount", &format!("shift={shift}"), "-kernel"])
            .arg(image)
            .stdin(Stdio::null());
        command
    }
}

/// Picture with its sensor and its prior.
#[derive(Debug, Clone)]
pub struct Case {
    /// Name in messages.
    pub name: String,
    /// Configuration of the sensor.
    pub sensor: Config,
    /// Prior of the picture.
    pub prior: Prior<f32>,
    /// The picture, one byte per pixel, in the size that the sensor expects.
    pub bytes: Vec<u8>,
}

/// Result of one picture.
#[derive(Debug, Clone)]
pub struct Measured {
    /// The answer.
    pub answer: PictureAnswer,
    /// Instructions of `Sensor::new`, `expect` and `process`.
    pub calls: [u64; 3],
    /// Instructions of each stage. Their sum is a little above `process`, because reading the timer costs instructions.
    pub stages: [u64; 8],
    /// Largest stack so far, in bytes.
    pub stack_bytes: u32,
}

impl Case {
    /// Renders a scene.
    ///
    /// # Panics
    /// Panics if the scene cannot be rendered, or not as bytes.
    pub fn rendered(name: String, sensor: &Config, frame: &hzn_sim::FlightFrame) -> Self {
        let picture = frame.render().expect("the scene can be rendered");
        let hzn_sim::Samples::Bytes(bytes) = picture.samples() else { panic!("{name}: the picture must have 8 bits") };
        let known = frame.prior();
        let prior = Prior {
            altitude_m: known.altitude_m.map(|h| h as f32),
            position_m: known.position_m.map(|p| p.map(|x| x as f32)),
            ..Prior::default()
        };
        Self { name, sensor: sensor.clone(), prior, bytes: bytes.clone() }
    }

    /// Returns the answer of the same sensor on this machine.
    ///
    /// # Panics
    /// Panics if the configuration or the prior is refused.
    pub fn answer_on_host(&self) -> PictureAnswer {
        let mut horizon = FlightHorizon::boxed(&self.sensor).expect("the configuration is valid");
        let camera = &self.sensor.camera;
        let layout = Layout::packed(camera.width.into(), camera.height.into(), 1, 8);
        let picture = Grey::try_new(&self.bytes, layout).expect("the picture is whole");
        let expected = horizon.expect(&self.prior).expect("the prior is possible");
        PictureAnswer::from_report(&horizon.find(&picture, &expected), &self.sensor)
    }

    fn write(&self, out: &mut Vec<u8>) {
        let mut bytes = [0; table::MAX_BYTES];
        let parameters = Parameters::new(self.sensor.clone());
        let n = table::write(&parameters, 1, &mut bytes).expect("a table fits");
        let [x, y, z] = self.prior.position_m.unwrap_or([f32::NAN; 3]);
        let altitude = self.prior.altitude_m.unwrap_or(f32::NAN);
        write_case(out, &bytes[..n], [altitude, x, y, z], &self.bytes);
    }
}

/// Writes a case with its parameter table, its prior (altitude and position, m) and its picture.
fn write_case(out: &mut Vec<u8>, table: &[u8], prior: [f32; 4], picture: &[u8]) {
    out.extend_from_slice(b"CASE");
    out.extend_from_slice(&(table.len() as u32).to_le_bytes());
    out.extend_from_slice(&(picture.len() as u32).to_le_bytes());
    for float in prior.into_iter().chain([0.0]) {
        out.extend_from_slice(&float.to_le_bytes());
    }
    out.extend_from_slice(table);
    out.extend_from_slice(picture);
}

/// Returns the bytes of an answer. Two answers have equal bytes if every bit is equal.
pub fn answer_bytes(answer: &PictureAnswer) -> Vec<u8> {
    let mut bytes = vec![0; 640];
    let mut out = Writer::new(&mut bytes);
    answer.write(&mut out);
    let n = out.finish().expect("an answer fits");
    bytes.truncate(n);
    bytes
}

/// Runs cases through the image `measure` of a board.
///
/// # Panics
/// Panics if QEMU or the image fails.
pub fn measure(board: Board, cases: &[Case]) -> Vec<Measured> {
    run(board, "measure", cases)
}

/// Runs the pictures of one sensor through the image `track` of a board, a tenth of a second apart.
///
/// # Panics
/// Panics if QEMU or the image fails.
pub fn measure_sequence(board: Board, sensor: &Config, pictures: &[Vec<u8>]) -> Vec<Measured> {
    let case = |bytes: &Vec<u8>| Case {
        name: String::new(),
        sensor: sensor.clone(),
        prior: Prior::default(),
        bytes: bytes.clone(),
    };
    run(board, "track", &pictures.iter().map(case).collect::<Vec<_>>())
}

/// Runs cases of 640×480 pixels through the image `rows` of a board, row by row. Here `calls` counts making the sensor,
/// taking all rows, and the end of the picture.
///
/// # Panics
/// Panics if QEMU or the image fails.
pub fn measure_rows(board: Board, cases: &[Case]) -> Vec<Measured> {
    run(board, "rows", cases)
}

/// What the image `rig` measures and sends.
#[derive(Debug)]
pub struct MeasuredRig {
    /// Instructions of a turn without a picture.
    pub idle: u64,
    /// Instructions of a turn with a picture of the first head.
    pub one: u64,
    /// Instructions of a turn with pictures of all heads, with their joint answer.
    pub all: u64,
    /// Memory of a rig with one head, without the lists of a picture, in bytes.
    pub first_bytes: u32,
    /// Memory of each further head, in bytes.
    pub further_bytes: u32,
    /// The packets of the last turn.
    pub sent: Vec<u8>,
}

/// Runs the pictures of four heads through the image `rig` of a board. The parameters of each head are given, too.
///
/// # Panics
/// Panics if QEMU or the image fails.
pub fn measure_rig(board: Board, heads: &[(Parameters, Vec<u8>); 4]) -> MeasuredRig {
    let mut cases = Vec::new();
    for (parameters, picture) in heads {
        let mut bytes = [0; table::MAX_BYTES];
        let n = table::write(parameters, 1, &mut bytes).expect("a table fits");
        write_case(&mut cases, &bytes[..n], [f32::NAN; 4], picture);
    }
    let results = run_cases(board, "rig", &cases);
    let (words, sent) = results.split_at(20);
    let mut words = words.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
    let mut word = || words.next().expect("five words are written");
    MeasuredRig {
        idle: instructions(word().into()),
        one: instructions(word().into()),
        all: instructions(word().into()),
        first_bytes: word(),
        further_bytes: word(),
        sent: sent.to_vec(),
    }
}

/// Returns the sensor of the image `chain`: the lens of the rocket's flight, at an altitude of 150 km.
pub fn chain_sensor() -> Config {
    let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
    let lens = camera::Config { k, ..camera::Config::ideal(camera::Model::KannalaBrandt, 1920, 1080, 1233.0) };
    let mut config = Config::new(lens);
    config.body.altitude_km = Some(150.0);
    config
}

/// Returns [`chain_sensor`] as it is prepared, with zeros behind it, and its length in bytes.
///
/// # Panics
/// Panics if the configuration is refused.
pub fn chain_page() -> ([u8; prepared::MAX_BYTES], usize) {
    page(&chain_sensor())
}

/// Returns a sensor as it is prepared, with zeros behind it, and its length in bytes.
fn page(config: &Config) -> ([u8; prepared::MAX_BYTES], usize) {
    let sensor = Sensor::<f32>::new(config).expect("the configuration is right");
    let mut page = [0; prepared::MAX_BYTES];
    let length = sensor.prepare(&mut page).expect("the page is long enough");
    (page, length)
}

/// Runs a picture through the image `chain` of a board, with [`chain_sensor`], and returns the eleven words of its
/// answer. The source of the image describes them.
///
/// # Panics
/// Panics if QEMU or the image fails.
pub fn run_chain(board: Board, picture: &[u8]) -> [u32; 11] {
    let (page, _) = chain_page();
    let answer = run_files(board, "chain", &[("sensor.bin", &page), ("picture.bin", picture)]);
    let mut words = answer.as_chunks::<4>().0.iter().map(|w| u32::from_le_bytes(*w));
    std::array::from_fn(|_| words.next().expect("eleven words are written"))
}

/// Runs a picture of 64×48 pixels through the image `example`. Returns the bytes of the answer, as [`answer_bytes`],
/// and the largest stack in bytes.
///
/// # Panics
/// Panics if QEMU or the image fails.
pub fn run_example(picture: &[u8]) -> (Vec<u8>, u32) {
    let mut answer = run_files(Board::Stm32F405, "example", &[("picture.bin", picture)]);
    let stack_bytes = answer.split_off(answer.len() - 4);
    (answer, u32::from_le_bytes(stack_bytes.try_into().expect("four bytes")))
}

/// The answer of an image for a thermal array.
#[derive(Debug, Clone, Copy)]
pub struct ArrayAnswer {
    /// Status of the picture.
    pub status: u32,
    /// Axis (3) and covariance (xx, xy, xz, yy, yz, zz), as bits of single-precision numbers; zeros without an answer.
    pub direction: [u32; 9],
    /// Instructions for all rows.
    pub rows: u64,
    /// Instructions for the end of the picture.
    pub end: u64,
    /// Largest stack so far, in bytes.
    pub stack_bytes: u32,
}

/// Runs the pictures of a thermal array, one word of 16 bits per pixel, through an image of a board for it.
///
/// # Panics
/// Panics if QEMU or the image fails, or the configuration is refused.
pub fn run_array(board: Board, image: &str, config: &Config, pictures: &[Vec<u16>]) -> Vec<ArrayAnswer> {
    let words: Vec<u8> = pictures.iter().flatten().flat_map(|pixel| pixel.to_le_bytes()).collect();
    let answers = run_files(board, image, &[("sensor.bin", &page(config).0), ("pictures.bin", &words)]);
    // The clock of the RISC-V counts instructions.
    let count = if board == Board::RiscV { u64::from } else { instructions };
    let answer = |words: &[u8; 52]| {
        let mut words = words.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
        let mut word = || words.next().expect("thirteen words are written");
        ArrayAnswer {
            status: word(),
            direction: std::array::from_fn(|_| word()),
            rows: count(word().into()),
            end: count(word().into()),
            stack_bytes: word(),
        }
    };
    answers.as_chunks::<52>().0.iter().map(answer).collect()
}

/// Runs an image that reads files and writes `answer.bin`, and returns what it writes.
fn run_files(board: Board, image: &str, files: &[(&str, &[u8])]) -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a temporary folder can be made");
    for (name, bytes) in files {
        std::fs::write(dir.path().join(name), bytes).expect("the folder is writable");
    }
    // The counter of the RISC-V's instructions counts nanoseconds of the exact clock.
    let shift = if board == Board::RiscV { 0 } else { 10 };
    let status = board.qemu(&board.image(image), shift).args(["-serial", "null"]).current_dir(dir.path()).status();
    let status = status.expect("QEMU is installed");
    assert!(status.success(), "{}: the image ended with {status}", board.name());
    std::fs::read(dir.path().join("answer.bin")).expect("the image wrote its answer")
}

fn run(board: Board, image: &str, cases: &[Case]) -> Vec<Measured> {
    let mut input = Vec::new();
    cases.iter().for_each(|case| case.write(&mut input));
    let results = run_cases(board, image, &input);
    let mut from = Reader::new(&results);
    let out: Vec<_> = std::iter::from_fn(|| read(&mut from)).collect();
    assert!(from.rest().is_empty() && out.len() == cases.len(), "{}: results are cut off", board.name());
    out
}

/// Runs an image that reads `cases.bin`, and returns its `results.bin`.
fn run_cases(board: Board, image: &str, cases: &[u8]) -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a temporary folder can be made");
    std::fs::write(dir.path().join("cases.bin"), cases).expect("the folder is writable");
    let status = board.qemu(&board.image(image), 10).args(["-serial", "null"]).current_dir(dir.path()).status();
    let status = status.expect("QEMU is installed");
    assert!(status.success(), "{}: the image ended with {status}", board.name());
    std::fs::read(dir.path().join("results.bin")).expect("the image wrote its results")
}

/// Returns the instructions of an interval, in ticks of the timer. A tick takes 40 ns, an instruction 1024 ns. Reading
/// the timer costs one instruction.
pub fn instructions(ticks: u64) -> u64 {
    ((ticks * 40 + 512) / 1024).saturating_sub(1)
}

fn read(from: &mut Reader<'_>) -> Option<Measured> {
    let magic = from.u32()?;
    assert_eq!(magic.to_be_bytes(), *b"DONE");
    let mut calls = [0; 3];
    for n in &mut calls {
        *n = instructions(from.u32()?.into());
    }
    let mut stages = [0; 8];
    for n in &mut stages {
        *n = instructions(from.u64()?);
    }
    // The timer wraps after 168 million instructions. The stages are read in parts, so their sum shows how often it
    // did.
    const WRAP: u64 = (1 << 32) * 40 / 1024;
    let sum: u64 = stages.iter().sum();
    calls[2] += (sum.saturating_sub(calls[2]) + WRAP / 2) / WRAP * WRAP;
    let (stack_bytes, _) = (from.u32()?, from.u32()?);
    Some(Measured { answer: PictureAnswer::read(from)?, calls, stages, stack_bytes })
}
