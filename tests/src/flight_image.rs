//! Runs the flight image in QEMU, with its camera, its flash and its serial line.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use hzn_core::Config;
use hzn_flight::{Parameters, table};

use crate::emulated::Board;

/// Flight image of a board, with its files.
#[derive(Debug)]
pub struct Bench {
    board: Board,
    dir: tempfile::TempDir,
}

impl Bench {
    /// Makes a flight image with an empty folder.
    ///
    /// # Panics
    /// Panics if a temporary folder cannot be made.
    pub fn new(board: Board) -> Self {
        Self { board, dir: tempfile::tempdir().expect("a temporary folder can be made") }
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
    /// Runs the image with parts of a line. A part is sent when the image has sent at least its number of bytes.
    ///
    /// # Panics
    /// Panics if QEMU fails or the image does not end within two minutes.
    pub fn run_in_parts(&self, parts: &[(u64, &[u8])], shift: u32) -> i32 {
        let sent = std::fs::File::create(self.path("sent.bin")).expect("files and programs of this machine work");
        let mut command = self.board.qemu(&self.board.image("flight"), shift);
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
