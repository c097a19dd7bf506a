//! The firmware in QEMU: frames go in, answers with every bit and instruction counts come out.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, FlightHorizon, Prior};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::bytes::{Reader, Writer};
use hzn_flight::{Parameters, table};

/// A board that QEMU emulates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// Cortex-M4F, single precision.
    An386,
    /// Cortex-M7, double precision.
    An500,
}

impl Board {
    /// Both.
    pub const ALL: [Self; 2] = [Self::An386, Self::An500];

    /// The name that QEMU and the images' folders have.
    pub fn name(self) -> &'static str {
        match self {
            Self::An386 => "an386",
            Self::An500 => "an500",
        }
    }

    /// The core, for people.
    pub fn core(self) -> &'static str {
        match self {
            Self::An386 => "Cortex-M4F",
            Self::An500 => "Cortex-M7",
        }
    }

    /// An image that `cargo xtask firmware` has built.
    ///
    /// # Panics
    /// It was not built.
    pub fn image(self, name: &str) -> PathBuf {
        let target = std::env::var_os("CARGO_TARGET_DIR")
            .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"), PathBuf::from);
        let path = target.join("firmware").join(self.name()).join("images").join(name);
        assert!(path.is_file(), "{}: `cargo xtask firmware` builds it", path.display());
        path
    }

    /// QEMU for this board, with an exact clock: an instruction takes `2^shift` ns. Ten count instructions to one; with
    /// none the board's clock is slower than this machine's, so that a line is in time however busy this machine is.
    pub fn qemu(self, image: &Path, shift: u32) -> Command {
        let mut command = Command::new("qemu-system-arm");
        command
            .args(["-M", &format!("mps2-{}", self.name()), "-display", "none", "-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native", "-icount", &format!("shift={shift}"), "-kernel"])
            .arg(image)
            .stdin(Stdio::null());
        command
    }
}

/// A frame with everything that is known about it.
#[derive(Debug, Clone)]
pub struct Case {
    /// For people.
    pub name: String,
    /// What the sensor is told.
    pub sensor: Config,
    /// What is known about the picture.
    pub known: Prior<f32>,
    /// The picture, a byte a pixel, of the size that the sensor expects.
    pub bytes: Vec<u8>,
}

/// What one frame gave.
#[derive(Debug, Clone)]
pub struct Measured {
    /// The answer.
    pub answer: PictureAnswer,
    /// Instructions of `FlightHorizon::new`, of `expect`, of `process`.
    pub calls: [u64; 3],
    /// Instructions by stage; together a few more than `process`, for the looks at the timer.
    pub stages: [u64; 8],
    /// Most bytes of stack so far.
    pub stack_bytes: u32,
}

impl Case {
    /// A rendered scene.
    ///
    /// # Panics
    /// It cannot be rendered, or not as bytes.
    pub fn rendered(name: String, sensor: &Config, frame: &hzn_sim::FlightFrame) -> Self {
        let picture = frame.render().expect("the scene can be rendered");
        let hzn_sim::Samples::Bytes(bytes) = picture.samples() else { panic!("{name}: 8 bits are expected") };
        let known = frame.prior();
        let known = Prior {
            altitude_m: known.altitude_m.map(|h| h as f32),
            position_m: known.position_m.map(|p| p.map(|x| x as f32)),
            ..Prior::default()
        };
        Self { name, sensor: sensor.clone(), known, bytes: bytes.clone() }
    }

    /// What the same sensor answers here.
    ///
    /// # Panics
    /// The configuration or what is known is refused.
    pub fn here(&self) -> PictureAnswer {
        let mut horizon = Box::new(FlightHorizon::new(&self.sensor).expect("the configuration is valid"));
        let camera = &self.sensor.camera;
        let layout = Layout::packed(camera.width.into(), camera.height.into(), 1, 8);
        let picture = Grey::try_new(&self.bytes, layout).expect("the picture is whole");
        let expected = horizon.expect(&self.known).expect("what is known is possible");
        PictureAnswer::from_report(&horizon.process(&picture, &expected))
    }

    fn write(&self, out: &mut Vec<u8>) {
        let mut bytes = [0; table::MAX_BYTES];
        let parameters = Parameters::new(self.sensor.clone());
        let n = table::write(&parameters, 1, &mut bytes).expect("a table fits");
        let [x, y, z] = self.known.position_m.unwrap_or([f32::NAN; 3]);
        let altitude = self.known.altitude_m.unwrap_or(f32::NAN);
        out.extend_from_slice(b"CASE");
        out.extend_from_slice(&(n as u32).to_le_bytes());
        out.extend_from_slice(&(self.bytes.len() as u32).to_le_bytes());
        for float in [altitude, x, y, z, 0.0] {
            out.extend_from_slice(&float.to_le_bytes());
        }
        out.extend_from_slice(&bytes[..n]);
        out.extend_from_slice(&self.bytes);
    }
}

/// The bytes of an answer: equal when every bit is.
pub fn bits(answer: &PictureAnswer) -> Vec<u8> {
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
/// QEMU or the image fails.
pub fn measure(board: Board, cases: &[Case]) -> Vec<Measured> {
    run(board, "measure", cases)
}

/// Runs cases of 640×480 pixels through the image `rows` of a board, row by row. The calls are those of making the
/// sensor, of taking all rows, and of the end of the picture.
///
/// # Panics
/// QEMU or the image fails.
pub fn measure_rows(board: Board, cases: &[Case]) -> Vec<Measured> {
    run(board, "rows", cases)
}

/// What the image `chain` of a board answers to a picture: its eleven words, as that image describes them.
///
/// # Panics
/// QEMU or the image fails.
pub fn chain(board: Board, picture: &[u8]) -> [u32; 11] {
    let dir = tempfile::tempdir().expect("a temporary folder can be made");
    std::fs::write(dir.path().join("picture.bin"), picture).expect("the folder is writable");
    let status = board.qemu(&board.image("chain"), 10).args(["-serial", "null"]).current_dir(dir.path()).status();
    let status = status.expect("qemu-system-arm is installed");
    assert!(status.success(), "{}: the image ended with {status}", board.name());
    let answer = std::fs::read(dir.path().join("answer.bin")).expect("the image wrote its answer");
    let mut words = answer.as_chunks::<4>().0.iter().map(|w| u32::from_le_bytes(*w));
    std::array::from_fn(|_| words.next().expect("eleven words are written"))
}

fn run(board: Board, image: &str, cases: &[Case]) -> Vec<Measured> {
    let dir = tempfile::tempdir().expect("a temporary folder can be made");
    let mut input = Vec::new();
    cases.iter().for_each(|case| case.write(&mut input));
    std::fs::write(dir.path().join("cases.bin"), input).expect("the folder is writable");
    let status = board.qemu(&board.image(image), 10).args(["-serial", "null"]).current_dir(dir.path()).status();
    let status = status.expect("qemu-system-arm is installed");
    assert!(status.success(), "{}: the image ended with {status}", board.name());
    let results = std::fs::read(dir.path().join("results.bin")).expect("the image wrote its results");
    let mut from = Reader::new(&results);
    let out: Vec<_> = std::iter::from_fn(|| read(&mut from)).collect();
    assert!(from.rest().is_empty() && out.len() == cases.len(), "{}: results are cut off", board.name());
    out
}

fn read(from: &mut Reader<'_>) -> Option<Measured> {
    let magic = from.u32()?;
    assert_eq!(magic.to_be_bytes(), *b"DONE");
    // Ticks of 40 ns, instructions of 1024 ns; reading the timer costs one.
    let instructions = |ticks: u64| ((ticks * 40 + 512) / 1024).saturating_sub(1);
    let mut calls = [0; 3];
    for n in &mut calls {
        *n = instructions(from.u32()?.into());
    }
    let mut stages = [0; 8];
    for n in &mut stages {
        *n = instructions(from.u64()?);
    }
    // The timer wraps after 168 million instructions: stages, read in parts, tell how often it did.
    const WRAP: u64 = (1 << 32) * 40 / 1024;
    let sum: u64 = stages.iter().sum();
    calls[2] += (sum.saturating_sub(calls[2]) + WRAP / 2) / WRAP * WRAP;
    let (stack_bytes, _) = (from.u32()?, from.u32()?);
    Some(Measured { answer: PictureAnswer::read(from)?, calls, stages, stack_bytes })
}
