//! Videos, through `ffmpeg` and `ffprobe` on PATH.
//!
//! Brightness is the luma plane as it stands in the stream (`extractplanes=y`): converting to grey would stretch
//! limited range. Times are every frame's own, from ffprobe, which runs alongside; a constant rate is never assumed.
//!
//! That the end is missing is known by what ffmpeg says and by the sizes in an AVI. A y4m, or a stream such as MPEG-TS that was cut
//! between two frames, does not tell.

mod riff;
mod times;
mod tool;

use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::thread::JoinHandle;

use hzn_core::image::Layout;

use super::picture::{Picture, Samples, check_size};
use super::{Item, Payload, Source};
use crate::exit::{Stop, usage};
use crate::tell;
use times::Times;
use tool::{Running, Said, absent, tool};

pub(super) const ENDINGS: &[&str] = &[
    "mp4", "m4v", "mov", "avi", "mkv", "webm", "mpg", "mpeg", "ts", "mts", "m2ts", "wmv", "flv", "y4m", "mjpeg", "mj2",
];

/// What ffmpeg ends with when a signal stops it.
const STOPPED: i32 = 255;

pub(super) struct Video {
    path: PathBuf,
    stem: String,
    width: u32,
    height: u32,
    /// Significant bits of a sample.
    bits: u8,
    frames: Running,
    pixels: BufReader<Box<dyn Read + Send>>,
    /// What ffmpeg says, while it runs.
    said: Option<JoinHandle<Said>>,
    times: Times,
    index: u64,
    count: Option<u64>,
    ended: bool,
    lost: Option<String>,
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
        let mut command = tool("ffmpeg");
        command
            .args(["-nostdin", "-noautorotate", "-i"])
            .arg(path)
            .args(["-map", "0:v:0", "-fps_mode", "passthrough", "-vf", filter, "-pix_fmt", &out_format])
            .args(["-f", "rawvideo", "-"])
            .stderr(Stdio::piped());
        let (mut frames, pixels) = Running::start("ffmpeg", &mut command)?;
        let said = frames.listen();
        Ok(Self {
            path: path.to_owned(),
            stem: path.file_name().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
            width,
            height,
            bits,
            frames,
            pixels: BufReader::with_capacity(1 << 20, Box::new(pixels)),
            said: Some(said),
            times: Times::start(path)?,
            index: 0,
            count: entry("nb_frames").and_then(|n| n.trim().parse().ok()),
            ended: false,
            lost: None,
        })
    }

    /// Nothing more comes. What is missing at the end of a video, or was lost in it, is told by [`Source::lost`]; a video of
    /// which nothing came, and an ffmpeg that was ended from outside, are errors.
    fn end(&mut self, rest: usize) -> Option<anyhow::Result<Item>> {
        self.ended = true;
        let name = self.path.display();
        let code = self.frames.wait().ok().and_then(|status| status.code());
        let said = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default().summary();
        let frames = tell::counted(self.index, "frame");
        let Some(code) = code.filter(|code| *code != STOPPED) else {
            return Some(Err(anyhow::anyhow!("{name}: ffmpeg was ended from outside after {frames}")));
        };
        let missing = riff::missing_bytes(&self.path).map(|n| format!("{n} bytes are missing at its end"));
        let said = said.map(|said| format!("ffmpeg: {said}"));
        let bad = (code != 0).then(|| format!("ffmpeg ended with code {code}"));
        let torn = (rest > 0).then(|| "it ends in the middle of a frame".to_owned());
        let why = missing.or(said).or(bad).or(torn);
        if self.index == 0 {
            let why = why.map(|why| format!(": {why}")).unwrap_or_default();
            return Some(Err(anyhow::anyhow!("{name}: no frame of this video can be decoded{why}")));
        }
        self.lost = why.map(|why| {
            format!("{name}: was cut off or is damaged ({why}); {frames} could be decoded and were processed")
        });
        None
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
        let time = self.times.next();
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
    fn lost(&self) -> Option<String> {
        self.lost.clone()
    }
}
