//! Videos, through `ffmpeg` and `ffprobe` on PATH.
//!
//! Brightness is the luma plane as it stands in the stream (`extractplanes=y`): converting to grey would stretch
//! limited range. Times are every frame's own, from ffprobe, which runs alongside; a constant rate is never assumed.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use hzn_core::image::Layout;

use super::picture::{Picture, Samples, check_size};
use super::{Item, Payload, Source, TimeSource};
use crate::exit::{Stop, failed, usage};

pub(super) const ENDINGS: &[&str] = &[
    "mp4", "m4v", "mov", "avi", "mkv", "webm", "mpg", "mpeg", "ts", "mts", "m2ts", "wmv", "flv", "y4m", "mjpeg", "mj2",
];

pub(super) struct Video {
    path: PathBuf,
    stem: String,
    width: u32,
    height: u32,
    /// Significant bits of a sample.
    bits: u8,
    frames: Child,
    pixels: BufReader<ChildStdout>,
    stamps: Child,
    times: BufReader<ChildStdout>,
    index: u64,
    count: Option<u64>,
    ended: bool,
}

impl Video {
    pub(super) fn open(path: &Path) -> Result<Self, Stop> {
        let name = path.display();
        let probe = tool("ffprobe")
            .args([
                "-select_streams",
                "v:0",
                "-show_entries",
                "stream=width,height,pix_fmt,nb_frames",
                "-of",
                "default=nw=1",
            ])
            .arg(path)
            .output()
            .map_err(|e| absent("ffprobe", &e))?;
        if !probe.status.success() {
            let why = String::from_utf8_lossy(&probe.stderr);
            return Err(usage(format!("{name}: ffprobe cannot read it: {}", why.trim())));
        }
        let text = String::from_utf8_lossy(&probe.stdout);
        let entry = |key: &str| text.lines().find_map(|l| l.strip_prefix(key)?.strip_prefix('='));
        let side = |key: &str| entry(key).and_then(|v| v.trim().parse::<u32>().ok());
        let (Some(width), Some(height)) = (side("width"), side("height")) else {
            return Err(usage(format!("{name}: no video stream in this file")));
        };
        check_size(width, height, None).map_err(|e| usage(format!("{name}: {e}")))?;
        let pix_fmt = entry("pix_fmt").unwrap_or_default().trim();
        let bits = [("16", 16), ("14", 14), ("12", 12), ("10", 10), ("9", 9)]
            .iter()
            .find(|(n, _)| pix_fmt.ends_with(&format!("{n}le")) || pix_fmt.ends_with(&format!("{n}be")))
            .map_or(8, |(_, bits)| *bits);
        let out_format = if bits == 8 { "gray".to_owned() } else { format!("gray{bits}le") };
        // Colour planes have no luma plane to extract.
        let filter = if ["rgb", "bgr", "gbr", "pal"].iter().any(|p| pix_fmt.contains(p)) {
            "format=gray"
        } else {
            "extractplanes=y"
        };
        let mut frames = tool("ffmpeg")
            .args(["-nostdin", "-noautorotate", "-i"])
            .arg(path)
            .args(["-map", "0:v:0", "-fps_mode", "passthrough", "-vf", filter, "-pix_fmt", &out_format])
            .args(["-f", "rawvideo", "-"])
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| absent("ffmpeg", &e))?;
        let mut stamps = tool("ffprobe")
            .args(["-select_streams", "v:0", "-show_entries", "frame=best_effort_timestamp_time", "-of", "csv=p=0"])
            .arg(path)
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| absent("ffprobe", &e))?;
        let (Some(pixels), Some(times)) = (frames.stdout.take(), stamps.stdout.take()) else {
            return Err(failed("ffmpeg gave no output"));
        };
        Ok(Self {
            path: path.to_owned(),
            stem: path.file_name().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
            width,
            height,
            bits,
            frames,
            pixels: BufReader::with_capacity(1 << 20, pixels),
            stamps,
            times: BufReader::new(times),
            index: 0,
            count: entry("nb_frames").and_then(|n| n.trim().parse().ok()),
            ended: false,
        })
    }

    fn time_s(&mut self) -> Option<f64> {
        let mut line = String::new();
        self.times.read_line(&mut line).ok()?;
        line.trim().trim_end_matches(',').parse().ok()
    }

    /// What ffmpeg said at the end of its output.
    fn end(&mut self, rest: usize) -> Option<anyhow::Result<Item>> {
        self.ended = true;
        let status = self.frames.wait();
        if rest > 0 {
            let what = format!("{}: the video ends in the middle of frame {}", self.path.display(), self.index);
            return Some(Err(anyhow::anyhow!(what)));
        }
        match status {
            Ok(status) if status.success() => None,
            _ => Some(Err(anyhow::anyhow!("{}: ffmpeg failed after {} frames", self.path.display(), self.index))),
        }
    }
}

fn tool(name: &str) -> Command {
    let mut command = Command::new(name);
    command.args(["-v", "error"]).stdin(Stdio::null());
    command
}

fn absent(tool: &str, error: &std::io::Error) -> Stop {
    match error.kind() {
        std::io::ErrorKind::NotFound => usage(format!(
            "videos need `{tool}` on PATH, and it is not there; install ffmpeg, or extract the frames as pictures"
        )),
        _ => failed(format!("{tool} cannot be started: {error}")),
    }
}

impl Source for Video {
    fn bits(&self) -> Option<u8> {
        Some(self.bits)
    }
    fn next(&mut self) -> Option<anyhow::Result<Item>> {
        if self.ended {
            return None;
        }
        let pixels = self.width as usize * self.height as usize;
        let mut data = vec![0; if self.bits == 8 { pixels } else { 2 * pixels }];
        let mut have = 0;
        while have < data.len() {
            match self.pixels.read(&mut data[have..]) {
                Ok(0) => return self.end(have),
                Ok(n) => have += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => {
                    self.ended = true;
                    return Some(Err(anyhow::anyhow!("{}: {e}", self.path.display())));
                }
            }
        }
        let samples = if self.bits == 8 {
            Samples::Bytes(data)
        } else {
            Samples::Words(data.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect())
        };
        let picture =
            Picture { samples, layout: Layout::packed(self.width, self.height, 1, self.bits), exif_time_s: None };
        let name = format!("{}#{:06}", self.stem, self.index);
        let time = self.time_s().map_or(TimeSource::Count, TimeSource::Container);
        self.index += 1;
        Some(Ok(Item { name, time, data: None, payload: Payload::Decoded(picture) }))
    }
    fn total(&self) -> Option<u64> {
        self.count
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        Box::new(std::iter::once((self.stem.clone(), (self.width, self.height))))
    }
    fn folder(&self) -> PathBuf {
        self.path.parent().map(Path::to_owned).unwrap_or_default()
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        // Both end by themselves when their pipe closes; waiting for them would not.
        for child in [&mut self.frames, &mut self.stamps] {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
