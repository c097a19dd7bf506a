//! The programs that read videos, as child processes.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;

use crate::error::{Error, failed, unusable};

/// Messages that ffmpeg calls errors but that lose nothing: frames with equal times, and special data of some cameras
/// in JPEG.
const HARMLESS: &[&str] = &["non monotonically increasing dts", "unable to decode APP fields"];

/// Makes the command for a program that prints nothing but errors. It runs in its own process group, so Ctrl-C in a
/// terminal stops only our process, which still needs the frames that were begun.
pub(super) fn tool(name: &str) -> Command {
    let mut command = Command::new(name);
    command.args(["-v", "repeat+error"]).stdin(Stdio::null());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command
}

/// Adds a file as the input. Its name alone could be an option (`-y.mp4`) or a protocol (`pipe:0.mp4`), and a play list
/// can name other places; therefore only the absolute path of a file and the protocol for files are allowed.
pub(super) fn add_input<'a>(command: &'a mut Command, path: &Path) -> std::io::Result<&'a mut Command> {
    let mut file = OsString::from("file:");
    file.push(std::path::absolute(path)?);
    Ok(command.args(["-protocol_whitelist", "file", "-i"]).arg(file))
}

/// Returns the error for a program that cannot be started.
pub(super) fn cannot_start(tool: &str, error: &std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::NotFound => unusable(format!(
            "videos need `{tool}`, which is not on PATH; install ffmpeg, or extract the frames as pictures"
        )),
        _ => failed(format!("{tool} cannot be started: {error}")),
    }
}

/// A running program. It ends with our process: dropping this value kills it, and if we are killed, its closed pipe
/// ends it.
pub(super) struct Running(Child);

impl Running {
    /// Starts the program. Also returns the reader of its stdout.
    pub(super) fn start(name: &str, command: &mut Command) -> Result<(Self, impl Read + Send + use<>), Error> {
        let mut child = command.stdout(Stdio::piped()).spawn().map_err(|e| cannot_start(name, &e))?;
        let out = child.stdout.take();
        let running = Self(child);
        Ok((running, out.ok_or_else(|| failed(format!("{name} gives no output")))?))
    }

    /// Starts a thread that reads the program's stderr, which must be a pipe.
    pub(super) fn read_errors(&mut self) -> JoinHandle<ToolErrors> {
        let errors = self.0.stderr.take();
        std::thread::spawn(move || errors.map(|e| ToolErrors::read(BufReader::new(e))).unwrap_or_default())
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

/// Errors that a program printed.
#[derive(Default)]
pub(super) struct ToolErrors {
    count: u64,
    last: String,
}

impl ToolErrors {
    fn read(mut errors: impl BufRead) -> Self {
        let mut found = Self::default();
        let mut line = Vec::new();
        while errors.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
            let text = String::from_utf8_lossy(&line);
            // The prefix with the name of the part, such as `[h264 @ 0x55d0a0] `, is removed.
            let text = text.trim();
            let text = text.strip_prefix('[').and_then(|t| t.split_once("] ")).map_or(text, |(_, what)| what);
            if !text.is_empty() && !HARMLESS.iter().any(|h| text.contains(h)) {
                found.count += 1;
                found.last = text.to_owned();
            }
            line.clear();
        }
        found
    }

    /// Returns the last error, and the number of errors if there are several.
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
    fn the_last_error_is_reported() {
        let summary = |text: &str| ToolErrors::read(text.as_bytes()).summary();
        assert_eq!(summary(""), None);
        assert_eq!(summary("[matroska,webm @ 0x55c8] File ended prematurely\n").unwrap(), "File ended prematurely");
        let several = "[h264 @ 0x1] Invalid NAL unit size\n\nError while decoding stream #0:0: no\n[mjpeg @ 0x2] \
                       unable to decode APP fields: x\n";
        assert_eq!(summary(several).unwrap(), "Error while decoding stream #0:0: no; 2 errors in all");
        assert_eq!(
            summary("[rawvideo @ 0x1] Application provided invalid, non monotonically increasing dts to muxer\n"),
            None
        );
    }
}
