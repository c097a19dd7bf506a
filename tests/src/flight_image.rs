//! Runs the flight image in QEMU, with its camera, its flash and its serial line.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use hzn_core::Config;
use hzn_flight::answer::PictureAnswer;
use hzn_flight::assembly::Assembly;
use hzn_flight::packet::{self, Apid, Scan};
use hzn_flight::{Parameters, table};

use crate::emulated::Board;

/// Exponent of the time of an instruction in nanoseconds, where instructions are counted by the clock: 15 million of
/// them take one second, so that the watchdog of two seconds does not end an expensive picture. A microsecond is 16.
const SHIFT: u32 = 6;

/// Flight image of a board, with its files.
#[derive(Debug)]
pub struct Bench {
    board: Board,
    image: &'static str,
    dir: tempfile::TempDir,
}

impl Bench {
    /// Makes a flight image with an empty folder.
    ///
    /// # Panics
    /// Panics if a temporary folder cannot be made.
    pub fn new(board: Board) -> Self {
        Self { board, image: "flight", dir: tempfile::tempdir().expect("a temporary folder can be made") }
    }
    /// Makes a flight image whose telecommands need a key, with an empty folder: the key is missing.
    ///
    /// # Panics
    /// Panics if a temporary folder cannot be made.
    pub fn with_keys(board: Board) -> Self {
        Self { image: "flight-keys", ..Self::new(board) }
    }
    /// Returns the folder of the files.
    pub fn dir(&self) -> &Path {
        self.dir.path()
    }
    /// Returns the path of a file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
    /// Writes a copy of the parameters of a sensor.
    pub fn write_parameter_copy(&self, number: u8, config: &Config, generation: u32) {
        self.write_copy_of(number, &Parameters::new(config.clone()), generation);
    }
    /// Writes a copy of parameters.
    ///
    /// # Panics
    /// Panics if the folder is not writable.
    pub fn write_copy_of(&self, number: u8, parameters: &Parameters, generation: u32) {
        let mut bytes = vec![0; table::MAX_BYTES];
        let n = table::write(parameters, generation, &mut bytes).expect("files and programs of this machine work");
        std::fs::write(self.path(&format!("copy{number}.bin")), &bytes[..n])
            .expect("files and programs of this machine work");
    }
    /// Writes the pictures of the camera, each with the number of pictures that were lost before it.
    ///
    /// # Panics
    /// Panics if the folder is not writable.
    pub fn write_frames(&self, pictures: &[(Vec<u8>, u32)]) {
        let mut out = Vec::new();
        for (bytes, lost) in pictures {
            out.extend_from_slice(b"FRAM");
            for word in [bytes.len() as u32, *lost, 0] {
                out.extend_from_slice(&word.to_le_bytes());
            }
            out.extend_from_slice(bytes);
        }
        std::fs::write(self.path("frames.bin"), out).expect("files and programs of this machine work");
    }
    /// Runs the image until it ends by itself and returns its exit status. What the image sends is in `sent.bin`.
    pub fn run(&self, line: &[u8]) -> i32 {
        self.run_with_shift(line, 0)
    }
    /// Does the same as `run`, with an instruction that takes `2^shift` ns.
    pub fn run_with_shift(&self, line: &[u8], shift: u32) -> i32 {
        self.run_in_parts(&[(0, line)], shift)
    }
    /// Flies over the pictures of the camera in flight mode, and ends after the last answer. Returns the answers, each
    /// with the instructions from the picture to the answer. The packets are in `sent.bin`.
    ///
    /// # Panics
    /// Panics if QEMU fails, or if the answers do not come within five minutes.
    pub fn fly(&self, sensor: &Config, pictures: &[Vec<u8>]) -> Vec<(PictureAnswer, u64)> {
        let mut parameters = Parameters::new(sensor.clone());
        parameters.operations.boot_mode = 1;
        self.write_copy_of(1, &parameters, 1);
        self.write_frames(&pictures.iter().map(|picture| (picture.clone(), 0)).collect::<Vec<_>>());
        let mut command = self.board.qemu(&self.board.image(self.image), SHIFT);
        let command = command.args(["-serial", "file:sent.bin"]).current_dir(self.dir.path());
        let mut child = command.spawn().expect("files and programs of this machine work");
        let deadline = Instant::now() + Duration::from_secs(300);
        let (answers, end) = loop {
            std::thread::sleep(Duration::from_millis(50));
            let (answers, end) = read_answers(&std::fs::read(self.path("sent.bin")).unwrap_or_default());
            let has_ended = child.try_wait().expect("files and programs of this machine work").is_some();
            if answers.len() >= pictures.len() || has_ended || Instant::now() > deadline {
                break (answers, end);
            }
        };
        let _ = child.kill();
        let _ = child.wait();
        assert_eq!(answers.len(), pictures.len(), "{}: answers are missing", self.board.name());
        // The last packet may have been cut off.
        let sent = std::fs::read(self.path("sent.bin")).expect("files and programs of this machine work");
        std::fs::write(self.path("sent.bin"), &sent[..end]).expect("files and programs of this machine work");
        answers
    }
    /// Runs the image with parts of a line. A part is sent when the image has sent at least its number of bytes.
    ///
    /// # Panics
    /// Panics if QEMU fails or the image does not end within two minutes.
    pub fn run_in_parts(&self, parts: &[(u64, &[u8])], shift: u32) -> i32 {
        let sent = std::fs::File::create(self.path("sent.bin")).expect("files and programs of this machine work");
        let mut command = self.board.qemu(&self.board.image(self.image), shift);
        let mut child = command
            .args(["-serial", "stdio"])
            .current_dir(self.dir.path())
            .stdin(Stdio::piped())
            .stdout(sent)
            .spawn()
            .expect("files and programs of this machine work");
        let mut stdin = child.stdin.take().expect("files and programs of this machine work");
        // QEMU throws away what its STM32 USART receives before the program has started it.
        let first = u64::from(self.board == Board::Stm32F405);
        let parts: Vec<_> = parts.iter().map(|(bytes, line)| (first.max(*bytes), line.to_vec())).collect();
        let (ended, sent) = (Arc::new(AtomicBool::new(false)), self.path("sent.bin"));
        let ended_here = ended.clone();
        // The line stays open until the image ends, because QEMU would end with the line.
        let feed = std::thread::spawn(move || {
            for (bytes, line) in parts {
                let waits = || std::fs::metadata(&sent).is_ok_and(|file| file.len() < bytes);
                while waits() && !ended_here.load(Ordering::Relaxed) {
                    std::thread::sleep(Duration::from_millis(10));
                }
                let _ = stdin.write_all(&line);
                let _ = stdin.flush();
            }
            stdin
        });
        let deadline = Instant::now() + Duration::from_secs(120);
        let code = loop {
            if let Some(status) = child.try_wait().expect("files and programs of this machine work") {
                break status.code().unwrap_or(-1);
            }
            if Instant::now() > deadline {
                let _ = child.kill();
                ended.store(true, Ordering::Relaxed);
                panic!("{}: the image did not end", self.board.name());
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        ended.store(true, Ordering::Relaxed);
        drop(feed.join());
        code
    }
}

/// Returns the answers in packets, each with its instructions, and the number of bytes of whole packets.
fn read_answers(sent: &[u8]) -> (Vec<(PictureAnswer, u64)>, usize) {
    let (mut answers, mut end, mut assembly) = (Vec::new(), 0, Assembly::default());
    while let Scan::Packet { end: length, packet } = packet::scan(&sent[end..]) {
        end += length;
        let picture = Apid::from_number(packet.apid).and_then(|apid| assembly.take(apid, packet.user)).flatten();
        let counted = picture.map(|p| (p.answer, (u64::from(p.exposure.calculation_us) * 1000) >> SHIFT));
        answers.extend(counted);
    }
    (answers, end)
}

/// Returns a call of the `hzn` that the tests have built.
fn hzn() -> Command {
    let mut path = std::env::current_exe().expect("files and programs of this machine work");
    path.pop();
    path.pop();
    Command::new(path.join("hzn"))
}

/// Runs `hzn` in a folder, and returns what it prints on standard error.
///
/// # Panics
/// Panics if `hzn` was not built or fails.
pub fn hzn_run(dir: &Path, args: &[&str]) -> String {
    let out = hzn().current_dir(dir).args(args).output().expect("hzn was built with the tests");
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success(), "hzn {args:?}: {text}");
    text
}
