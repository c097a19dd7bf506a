//! Videos, read through `ffmpeg` and `ffprobe` on PATH.
//!
//! Brightness is the luma plane as it is stored in the stream (`extractplanes=y`), because a conversion to grey would
//! stretch limited range. If one colour is wanted (`input.channel`), ffmpeg converts to RGB of full range. Pixels are
//! taken as they are stored, whatever turn the container asks for. Each frame has its own time, from ffprobe, which
//! runs in parallel; a constant rate is never assumed.
//!
//! A missing end is detected by the messages of ffmpeg and by the sizes in an AVI. It is not detected for a y4m, or for
//! a stream such as MPEG-TS that was cut between two frames.

mod gpmf;
pub mod measured;
mod mp4;
mod riff;
mod times;
mod tool;

use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::JoinHandle;

use hzn_core::image::{Channel, Layout};
use hzn_core::tone::Tone;
use hzn_files::FrameData;

use super::decode::check_size;
use super::item::{Item, TimeSource};
use super::payload::Payload;
use super::picture::{Picture, Samples};
use super::sequence::Source;
use super::tone::FoundTone;
use crate::error::{Error, failed, unusable};
use crate::explain;
use measured::Measured;
use times::Times;
use tool::{Running, ToolErrors, add_input, cannot_start, tool};

pub(super) const ENDINGS: &[&str] = &[
    "mp4", "m4v", "mov", "avi", "mkv", "webm", "mpg", "mpeg", "ts", "mts", "m2ts", "wmv", "flv", "y4m", "mjpeg", "mj2",
];

/// Exit code of ffmpeg when a signal stops it.
const STOPPED: i32 = 255;

pub(super) struct Video {
    path: PathBuf,
    stem: String,
    width: u32,
    height: u32,
    /// Number of samples of a pixel: 1 (luma) or 3 (colours).
    channels: u8,
    /// Significant bits of a sample.
    bits: u8,
    pix_fmt: String,
    /// Width of a pixel over its height.
    pixel_aspect: f64,
    /// The turn that the container asks for when the video is shown.
    rotation: Option<&'static str>,
    frames: Running,
    pixels: Pixels,
    /// The thread that reads the messages of ffmpeg while it runs.
    errors: Option<JoinHandle<ToolErrors>>,
    times: Times,
    /// What an action camera measured while it filmed.
    measured: Option<Measured>,
    index: u64,
    count: Option<u64>,
    ended: bool,
    loss: Option<String>,
}

impl Video {
    pub(super) fn open(path: &Path) -> Result<Self, Error> {
        let name = path.display();
        let mut command = tool("ffprobe");
        command.args([
            "-select_streams",
            "v:0",
            "-show_entries",
            "stream=width,height,sample_aspect_ratio,pix_fmt,nb_frames:stream_side_data=rotation:stream_tags=rotate",
            "-of",
            "default=nw=1",
        ]);
        let probe = add_input(&mut command, path).and_then(Command::output).map_err(|e| cannot_start("ffprobe", &e))?;
        if !probe.status.success() {
            let why = String::from_utf8_lossy(&probe.stderr);
            return Err(unusable(format!("{name}: ffprobe cannot read it: {}", why.trim())));
        }
        let text = String::from_utf8_lossy(&probe.stdout);
        let entry = |key: &str| text.lines().find_map(|l| l.strip_prefix(key)?.strip_prefix('='));
        let side = |key: &str| entry(key).and_then(|v| v.trim().parse::<u32>().ok());
        let (Some(width), Some(height)) = (side("width"), side("height")) else {
            return Err(unusable(format!("{name}: no video stream in this file")));
        };
        check_size(width, height, None).map_err(|e| unusable(format!("{name}: {e}")))?;
        let pix_fmt = entry("pix_fmt").unwrap_or_default().trim();
        let (bits, arguments) = luma_output(pix_fmt);
        let (frames, pixels, errors) = start(path, &arguments)?;
        let degrees = |key: &str| entry(key).and_then(|deg| deg.trim().parse::<f64>().ok());
        // The tag of older files counts clockwise, so its sign is inverted.
        let rotation = degrees("rotation").or(degrees("TAG:rotate").map(|deg| -deg)).and_then(describe_rotation);
        Ok(Self {
            path: path.to_owned(),
            stem: path.file_name().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default(),
            width,
            height,
            channels: 1,
            bits,
            pix_fmt: pix_fmt.to_owned(),
            pixel_aspect: entry("sample_aspect_ratio").and_then(parse_ratio).unwrap_or(1.0),
            rotation,
            frames,
            pixels,
            errors: Some(errors),
            times: Times::start(path)?,
            measured: measured::read(path).map_err(|e| failed(format!("{name}: cannot be read: {e}")))?,
            index: 0,
            count: entry("nb_frames").and_then(|n| n.trim().parse().ok()),
            ended: false,
            loss: None,
        })
    }

    /// Ends the video. [`Source::describe_loss`] describes what is missing at the end of a video or was lost in it. If
    /// no frame could be decoded, or ffmpeg was ended from outside, this is an error.
    fn end(&mut self, rest: usize) -> Option<Result<Item, Error>> {
        self.ended = true;
        let name = self.path.display();
        let code = self.frames.wait().ok().and_then(|status| status.code());
        let error = self.errors.take().and_then(|errors| errors.join().ok()).unwrap_or_default().summary();
        let frames = explain::counted(self.index, "frame");
        let Some(code) = code.filter(|code| *code != STOPPED) else {
            return Some(Err(failed(format!("{name}: ffmpeg was ended from outside after {frames}"))));
        };
        let missing = riff::missing_bytes(&self.path).map(|n| format!("{n} bytes are missing at its end"));
        let error = error.map(|error| format!("ffmpeg: {error}"));
        let bad = (code != 0).then(|| format!("ffmpeg ended with code {code}"));
        let torn = (rest > 0).then(|| "it ends in the middle of a frame".to_owned());
        let why = missing.or(error).or(bad).or(torn);
        if self.index == 0 {
            let why = why.map(|why| format!(": {why}")).unwrap_or_default();
            return Some(Err(failed(format!("{name}: no frame of this video can be decoded{why}"))));
        }
        self.loss = why.map(|why| {
            format!("{name}: was cut off or is damaged ({why}); {frames} could be decoded and were processed")
        });
        None
    }
}

/// Returns the value of a ratio such as `4:3`; `None` for the `0:1` and `N/A` of an unknown one.
fn parse_ratio(text: &str) -> Option<f64> {
    let (over, under) = text.trim().split_once(':')?;
    let ratio = over.parse::<f64>().ok()? / under.parse::<f64>().ok()?;
    (ratio > 0.0 && ratio.is_finite()).then_some(ratio)
}

/// Returns the bits of a stream's luma, and the arguments that make ffmpeg write it.
fn luma_output(pix_fmt: &str) -> (u8, Vec<String>) {
    let bits = sample_bits(pix_fmt);
    let out_format = if bits == 8 { "gray".to_owned() } else { format!("gray{bits}le") };
    // RGB and palette formats have no luma plane to extract.
    let filter = if ["rgb", "bgr", "gbr", "pal"].iter().any(|p| pix_fmt.contains(p)) {
        "format=gray"
    } else {
        "extractplanes=y"
    };
    (bits, ["-vf", filter, "-pix_fmt", &out_format].map(str::to_owned).to_vec())
}

/// Returns the bits of the colours that are handed out, and the arguments that make ffmpeg write them.
fn colour_output(pix_fmt: &str) -> (u8, Vec<String>) {
    let (bits, out_format) = if sample_bits(pix_fmt) == 8 { (8, "rgb24") } else { (16, "rgb48le") };
    (bits, ["-pix_fmt", out_format].map(str::to_owned).to_vec())
}

fn sample_bits(pix_fmt: &str) -> u8 {
    let deep = [("16", 16), ("14", 14), ("12", 12), ("10", 10), ("9", 9)];
    let named = |n: &str| pix_fmt.ends_with(&format!("{n}le")) || pix_fmt.ends_with(&format!("{n}be"));
    deep.iter().find(|(n, _)| named(n)).map_or(8, |(_, bits)| *bits)
}

/// Returns a container's rotation in words; `None` if there is none.
fn describe_rotation(counter_clockwise_deg: f64) -> Option<&'static str> {
    match (counter_clockwise_deg / 90.0).round().rem_euclid(4.0) as u8 {
        1 => Some("turned by 90 degrees counter-clockwise"),
        2 => Some("turned by 180 degrees"),
        3 => Some("turned by 90 degrees clockwise"),
        _ => None,
    }
}

type Pixels = BufReader<Box<dyn Read + Send>>;

/// Starts ffmpeg on a video.
fn start(path: &Path, arguments: &[String]) -> Result<(Running, Pixels, JoinHandle<ToolErrors>), Error> {
    let mut command = tool("ffmpeg");
    command.args(["-nostdin", "-noautorotate"]);
    add_input(&mut command, path)
        .map_err(|e| cannot_start("ffmpeg", &e))?
        .args(["-map", "0:v:0", "-fps_mode", "passthrough"])
        .args(arguments)
        .args(["-f", "rawvideo", "-"])
        .stderr(Stdio::piped());
    let (mut frames, pixels) = Running::start("ffmpeg", &mut command)?;
    let errors = frames.read_errors();
    Ok((frames, BufReader::with_capacity(1 << 20, Box::new(pixels)), errors))
}

impl Source for Video {
    fn pixel_aspect(&self) -> f64 {
        self.pixel_aspect
    }
    fn measured(&self) -> Option<&Measured> {
        self.measured.as_ref()
    }
    fn notes(&self) -> Vec<String> {
        self.measured.iter().map(|measured| format!("{}: {}", self.stem, measured.describe())).collect()
    }
    fn display_turn(&self) -> Option<(String, &'static str)> {
        self.rotation.map(|how| (self.stem.clone(), how))
    }
    fn want_channel(&mut self, channel: Channel) -> Result<(), Error> {
        // A grey video has no colours: its luma is the value of each colour.
        if channel == Channel::Mean || self.channels == 3 || self.pix_fmt.starts_with("gray") {
            return Ok(());
        }
        let (bits, arguments) = colour_output(&self.pix_fmt);
        let (frames, pixels, errors) = start(&self.path, &arguments)?;
        (self.frames, self.pixels, self.errors) = (frames, pixels, Some(errors));
        (self.bits, self.channels) = (bits, 3);
        Ok(())
    }
    fn bits(&self) -> Option<u8> {
        Some(self.bits)
    }
    fn tone(&self) -> Option<FoundTone> {
        Some(FoundTone { tone: Tone::Bt709, kind: "a video" })
    }
    fn next(&mut self) -> Option<Result<Item, Error>> {
        if self.ended {
            return None;
        }
        let samples = self.width as usize * self.height as usize * usize::from(self.channels);
        let mut data = vec![0; if self.bits == 8 { samples } else { 2 * samples }];
        let mut have = 0;
        while have < data.len() {
            match self.pixels.read(&mut data[have..]) {
                Ok(0) => return self.end(have),
                Ok(n) => have += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => {
                    self.ended = true;
                    return Some(Err(failed(format!("{}: {e}", self.path.display()))));
                }
            }
        }
        let samples = if self.bits == 8 {
            Samples::Bytes(data)
        } else {
            Samples::Words(data.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect())
        };
        let layout = Layout::packed(self.width, self.height, self.channels, self.bits);
        let picture = Picture { is_video_frame: true, ..Picture::new(samples, layout) };
        let name = format!("{}#{:06}", self.stem, self.index);
        let time = self.times.next();
        self.index += 1;
        let data = match (&self.measured, time) {
            (Some(measured), TimeSource::Container(Some(time_s))) => {
                Some(FrameData { file: name.clone(), ..measured.at(time_s) })
            }
            _ => None,
        };
        Some(Ok(Item { name, time, stamp: None, data, payload: Payload::Decoded(picture) }))
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
    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
    fn describe_loss(&self) -> Option<String> {
        self.loss.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_described_by_the_way_they_turn() {
        assert_eq!(describe_rotation(-90.0), Some("turned by 90 degrees clockwise"));
        assert_eq!(describe_rotation(270.0), describe_rotation(-90.0));
        assert_eq!(describe_rotation(90.0), Some("turned by 90 degrees counter-clockwise"));
        assert_eq!((describe_rotation(-180.0), describe_rotation(0.0)), (Some("turned by 180 degrees"), None));
    }

    #[test]
    fn colours_are_requested_only_if_wanted() {
        assert_eq!(luma_output("yuv420p10le").1, ["-vf", "extractplanes=y", "-pix_fmt", "gray10le"]);
        assert_eq!(luma_output("gbrp").1, ["-vf", "format=gray", "-pix_fmt", "gray"]);
        assert_eq!(
            (colour_output("yuv420p").0, colour_output("yuv422p12le")),
            (8, (16, vec!["-pix_fmt".into(), "rgb48le".into()]))
        );
    }
}
