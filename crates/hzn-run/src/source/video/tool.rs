//! The programs that read videos, as children of ours.

use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;

use crate::error::{Error, failed, unusable};

/// What ffmpeg calls errors and what loses nothing: frames at the same time, and what some cameras write into JPEG.
const HARMLESS: &[&str] = &["non monotonically increasing dts", "unable to decode APP fields"];

/// A program that says nothing but errors. The Ctrl-C of a terminal goes to us alone, who still want the frames that
/// were begun.
pub(super) fn tool(name: &str) -> Command {
    let mut command = Command::new(name);
    command.args(["-v", "repeat+error"]).stdin(Stdio::null());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
}

/// Why a program cannot be started.
pub(super) fn absent(tool: &str, error: &std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::NotFound => unusable(format!(
            "videos need `{tool}` on PATH, and it is not there; install ffmpeg, or extract the frames as pictures"
        )),
        _ => failed(format!("{tool} cannot be started: {error}")),
    }
}

/// A program at work. It ends with us: killed when this is dropped, by its closed pipe when we are killed.
pub(super) struct Running(Child);

impl Running {
    /// Starts it; also gives what it writes to stdout.
    pub(super) fn start(name: &str, command: &mut Command) -> Result<(Self, impl Read + Send + use<>), Error> {
        let mut child = command.stdout(Stdio::piped()).spawn().map_err(|e| absent(name, &e))?;
        let out = child.stdout.take();
        let running = Self(child);
        Ok((running, out.ok_or_else(|| failed(format!("{name} gives no output")))?))
    }

    /// Listens to what it writes to stderr, which must be a pipe.
    pub(super) fn listen(&mut self) -> JoinHandle<Said> {
        let errors = self.0.stderr.take();
        std::thread::spawn(move || errors.map(|e| Said::read(BufReader::new(e))).unwrap_or_default())
    }

    pub(super) fn wait(&mut self) -> std::io::Result<ExitStatus> {
        self.0.wait()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Errors that a program told of.
#[derive(Default)]
pub(super) struct Said {
    count: u64,
    last: String,
}

impl Said {
    fn read(mut errors: impl BufRead) -> Self {
        let mut said = Self::default();
        let mut line = Vec::new();
        while errors.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
            let text = String::from_utf8_lossy(&line);
            // Without who says it: `[h264 @ 0x55d0a0] `.
            let text = text.trim();
            let text = text.strip_prefix('[').and_then(|t| t.split_once("] ")).map_or(text, |(_, what)| what);
            if !text.is_empty() && !HARMLESS.iter().any(|h| text.contains(h)) {
                said.count += 1;
                said.last = text.to_owned();
            }
            line.clear();
        }
        said
    }

    /// The last of them, and how many there were.
    pub(super) fn summary(&self) -> Option<String> {
        match self.count {
            0 => None,
            1 => Some(self.last.clone()),
            n => Some(format!("{}; {n} errors in all", self.last)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_error_is_told() {
        let told = |text: &str| Said::read(text.as_bytes()).summary();
        assert_eq!(told(""), None);
        assert_eq!(told("[matroska,webm @ 0x55c8] File ended prematurely\n").unwrap(), "File ended prematurely");
        let several = "[h264 @ 0x1] Invalid NAL unit size\n\nError while decoding stream #0:0: no\n[mjpeg @ 0x2] \
                       unable to decode APP fields: x\n";
        assert_eq!(told(several).unwrap(), "Error while decoding stream #0:0: no; 2 errors in all");
        assert_eq!(
            told("[rawvideo @ 0x1] Application provided invalid, non monotonically increasing dts to muxer\n"),
            None
        );
    }
}
