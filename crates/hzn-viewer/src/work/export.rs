//! Files of what is shown: a picture, a video, a table; and a recording that is made whole again.

use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;

use hzn_core::Config;
use hzn_mcap::{Annotations, Row};
use hzn_run::engine::AnySensor;
use hzn_run::overlay;
use hzn_run::sink::{Existing, RowFile as Table};
use hzn_run::source::{Picture, Source};

use super::frame_view::{self, FrameInput, FrameView, Outcome};
use super::job::{Done, Halt, Progress};
use super::walk::Walk;
use crate::model::settings::Layer;
use crate::model::{Sequence, whole};

/// What is drawn over a picture, as far as it is shown.
pub fn annotations(outcome: &Outcome, layers: &[Layer]) -> Annotations {
    let on = |layer| layers.contains(&layer);
    let mut out = Annotations::default();
    for answer in &outcome.bodies {
        if on(Layer::Edges) {
            let border =
                |e: &hzn_run::engine::trace::Edge| e.border.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
            out.edges.extend(answer.edges.iter().map(border));
        }
        for r in &answer.residuals {
            match r.weight > 0.0 {
                true if on(Layer::Inliers) => out.inliers.push(r.at),
                false if on(Layer::Rejected) => out.rejected.push(r.at),
                _ => {}
            }
        }
        if on(Layer::Limb) {
            out.limb.extend(answer.limb.iter().cloned());
        }
        if on(Layer::Axis) {
            out.axes.extend(answer.axis);
        }
    }
    out
}

fn title(outcome: &Outcome) -> String {
    let each: Vec<&str> = outcome.bodies.iter().map(|b| b.row.status.name()).collect();
    each.join(", ")
}

fn draw(picture: &Picture, outcome: Option<&Outcome>, layers: &[Layer]) -> image::RgbImage {
    let image = picture.to_rgb();
    match outcome {
        Some(outcome) => overlay::draw_annotations(image, &annotations(outcome, layers), &title(outcome)),
        None => image,
    }
}

/// Writes the picture that is shown, with what is drawn over it, as PNG in its own size.
///
/// # Errors
/// There is no picture, the name is not that of a PNG, or the disk says no.
pub fn picture(sight: &FrameView, layers: &[Layer], path: &Path) -> Result<Done, Halt> {
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(Halt::Failed(format!("{}: the picture's ending must be .png", path.display())));
    }
    let picture = sight.picture.as_ref().map_err(Clone::clone)?;
    let image = draw(picture, sight.answers.first().map(|o| &**o), layers);
    let bytes = overlay::png(&image).map_err(|e| format!("{}: {e:#}", path.display()))?;
    whole::write(path, &bytes)?;
    Ok(Done::Written(path.to_owned()))
}

/// Writes results as CSV or JSON Lines, by the ending.
///
/// # Errors
/// Another ending, or the disk says no.
pub fn table(rows: &[Row], path: &Path, progress: &Progress) -> Result<Done, Halt> {
    let told = |error: hzn_run::Error| error.to_string();
    let mut table = Table::create(path, Existing::Replace).map_err(told)?;
    let total = rows.len() as u64;
    for (i, row) in (0..).zip(rows) {
        let written = progress.at(i, total).and_then(|()| table.write(row).map_err(|e| format!("{e:#}").into()));
        if written.is_err() {
            table.discard();
            return written.map(|()| Done::Written(path.to_owned()));
        }
    }
    table.finish().map_err(told)?;
    Ok(Done::Written(path.to_owned()))
}

/// Makes a recording that was cut off whole again, in a file beside it that is not there yet.
///
/// # Errors
/// It cannot be read, or the disk says no.
pub fn recover(path: &Path, progress: &Progress) -> Result<Done, Halt> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.trim_end_matches(".part").trim_end_matches(".mcap");
    let free = |name: String| Some(path.with_file_name(name)).filter(|p| !p.exists());
    let numbered = || (2..).find_map(|n: u64| free(format!("{stem}-recovered-{n}.mcap")));
    let out = free(format!("{stem}-recovered.mcap")).or_else(numbered).ok_or_else(|| "no free name".to_owned())?;
    match hzn_mcap::recover_while(path, &out, |done, total| progress.at(done, total).is_ok()) {
        Ok(found) => Ok(Done::Recovered { path: out, frames: found.frames }),
        Err(hzn_mcap::Error::Stopped { .. }) => Err(Halt::Stopped),
        Err(e) => Err(Halt::Failed(e.to_string())),
    }
}

/// A video of all frames, each with what is drawn over it.
pub struct Film {
    /// The frames.
    pub sequence: Sequence,
    /// What they are processed with.
    pub config: Arc<Config>,
    /// As on the flight computer.
    pub flight: bool,
    /// What is drawn.
    pub layers: Vec<Layer>,
    /// Frames a second.
    pub fps: f64,
}

impl Film {
    /// Writes it, by ffmpeg.
    ///
    /// # Errors
    /// There is no ffmpeg, it cannot write this, or the sequence cannot be read to its end.
    pub fn write(self, path: &Path, progress: &Progress) -> Result<Done, Halt> {
        whole::replace(path, |part| self.shoot(part, path, progress))?;
        Ok(Done::Written(path.to_owned()))
    }

    fn shoot(self, part: &Path, path: &Path, progress: &Progress) -> Result<(), Halt> {
        let mut sensor = AnySensor::new(&self.config, self.flight).map_err(|e| e.to_string())?;
        let size = (u32::from(self.config.camera.width), u32::from(self.config.camera.height));
        let mut pipe = start_ffmpeg(part, size, self.fps)?;
        let fed = self.feed(&mut pipe, &mut sensor, size, progress);
        drop(pipe.stdin.take());
        if fed.is_err() {
            let _ = pipe.kill();
        }
        let end = pipe.wait_with_output().map_err(|e| e.to_string());
        fed?;
        let end = end?;
        let why = String::from_utf8_lossy(&end.stderr);
        match why.trim().lines().last() {
            _ if end.status.success() => Ok(()),
            Some(_) if why.contains("No space left") => {
                let full = std::io::Error::from(std::io::ErrorKind::StorageFull);
                Err(Halt::Failed(hzn_run::disk::advice(path, &full)))
            }
            last => Err(Halt::Failed(format!("{}: ffmpeg: {}", path.display(), last.unwrap_or("ended with an error")))),
        }
    }

    fn feed(self, pipe: &mut Child, sensor: &mut AnySensor, size: (u32, u32), progress: &Progress) -> Result<(), Halt> {
        let known: Vec<_> = self.sequence.entries.iter().map(|e| e.data.clone()).collect();
        let total = known.len() as u64;
        let mut walk = Walk::new(self.sequence)?;
        for (index, data) in known.iter().enumerate() {
            progress.at(index as u64, total)?;
            let item = walk.next().ok_or_else(|| "the sequence ends before its last frame".to_owned())?;
            let item = item.map_err(|e| format!("{e:#}"))?;
            // A picture that cannot be read, or has another size, is a black frame: times stay right.
            let image = match item.payload.decode(Some(&self.config)) {
                Ok((picture, _)) => {
                    let (name, time_s) = (&*item.name, item.data.as_ref().and_then(|d| d.time_s));
                    let subject = FrameInput { index, name, time_s, data: data.as_ref(), picture: &picture };
                    let outcome = frame_view::look(subject, &self.config, sensor, false);
                    draw(&picture, Some(&outcome), &self.layers)
                }
                Err(_) => image::RgbImage::new(size.0, size.1),
            };
            let input = pipe.stdin.as_mut().ok_or_else(|| "ffmpeg takes no input".to_owned())?;
            if input.write_all(image.as_raw()).is_err() {
                // Why, it says itself.
                break;
            }
        }
        Ok(())
    }
}

fn start_ffmpeg(path: &Path, (width, height): (u32, u32), fps: f64) -> Result<Child, String> {
    Command::new("ffmpeg")
        .args(["-v", "error", "-nostdin", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"])
        .args(["-s", &format!("{width}x{height}"), "-r", &format!("{fps}"), "-i", "-"])
        // Most players want even sides.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
        .arg(path)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => {
                "a video needs `ffmpeg` on PATH, and it is not there: install it".to_owned()
            }
            _ => format!("ffmpeg cannot be started: {e}"),
        })
}
