//! Writes what the window shows to files: a picture, a video or a table. It also recovers a recording that was cut off.

use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;

use hzn_core::Config;
use hzn_core::status::Status;
use hzn_mcap::{Annotations, Row};
use hzn_run::engine::AnySensor;
use hzn_run::overlay;
use hzn_run::sink::{Existing, RowFile as Table};
use hzn_run::source::{Picture, Source};

use super::caption::{self, Caption, Writer};
use super::frame_view::{FrameInput, FrameView, Outcome, process_frame};
use super::job::{Done, JobError, Progress};
use super::sequence_source::SequenceSource;
use crate::model::settings::Layer;
use crate::model::{Sequence, atomic_file};

/// Returns the annotations of the layers that are switched on.
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
                true if on(Layer::Inliers) => out.inliers.push(r.point),
                false if on(Layer::Rejected) => out.rejected.push(r.point),
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

/// Returns the caption of a picture: its name, time, status and reason, the legend of what is drawn, and a scale.
fn describe(name: &str, time_s: Option<f64>, outcome: Option<&Outcome>, drawing: &Annotations) -> Caption {
    use hzn_mcap::palette::{AXIS, EDGE, INLIER, LIMB, REJECTED};
    let mut text = name.to_owned();
    text.extend(time_s.map(|t| format!(", {t:.3} s")));
    let Some(outcome) = outcome else { return Caption { text, ..Caption::default() } };
    for body in &outcome.bodies {
        let row = &body.row;
        let reason = body.cause.and_then(|c| c.reason).map(|r| format!(" ({})", r.name())).unwrap_or_default();
        text += &format!("; {}: {}{reason}", row.body, row.status);
        text.extend(row.sigma_max_deg.map(|s| format!(", 3σ {:.4}°", 3.0 * s)));
        text.extend(row.rms_px.map(|rms| format!(", RMS {rms:.2} px")));
        if row.status != Status::Ok && body.cause.is_none() && !row.detail.is_empty() {
            text += &format!(" ({})", row.detail);
        }
    }
    let entries = [
        ("edges", drawing.edges.is_empty(), EDGE),
        ("outliers", drawing.rejected.is_empty(), REJECTED),
        ("inliers", drawing.inliers.is_empty(), INLIER),
        ("fitted limb", drawing.limb.is_empty(), LIMB),
        ("axis", drawing.axes.is_empty(), AXIS),
    ];
    let legend = entries.iter().filter(|(_, none, _)| !none).map(|(name, _, c)| ((*name).to_owned(), *c)).collect();
    // The bar is as long as 5° are near the optical axis.
    let camera = &outcome.config.camera;
    Caption { text, legend, scale: Some((camera.fx_px * 5f64.to_radians().tan(), "5°".to_owned())) }
}

fn draw(
    writer: &mut Writer,
    picture: &Picture,
    name: &str,
    time_s: Option<f64>,
    outcome: Option<&Outcome>,
    layers: &[Layer],
) -> image::RgbImage {
    let drawing = outcome.map(|o| annotations(o, layers)).unwrap_or_default();
    let drawn = overlay::draw_plain(picture.to_rgb(), &drawing, &[]);
    writer.add(&drawn, &describe(name, time_s, outcome, &drawing))
}

/// Writes the shown picture with its annotations as PNG, in the size of the picture, with a caption below it.
///
/// # Errors
/// There is no picture, the name does not end in `.png`, or the file cannot be written.
pub fn save_picture(frame_view: &FrameView, layers: &[Layer], path: &Path) -> Result<Done, JobError> {
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(JobError::Failed(format!("{}: the file name of a picture must end in .png", path.display())));
    }
    let picture = frame_view.picture.as_ref().map_err(Clone::clone)?;
    let outcome = frame_view.answers.first().map(|o| &**o);
    let image = draw(&mut Writer::default(), picture, &frame_view.name, frame_view.time_s, outcome, layers);
    let bytes = overlay::png(&image).map_err(|e| format!("{}: {e:#}", path.display()))?;
    atomic_file::write(path, &bytes)?;
    Ok(Done::Written(path.to_owned()))
}

/// Writes results as CSV or JSON Lines, depending on the ending.
///
/// # Errors
/// The ending is another one, or the file cannot be written.
pub fn save_table(rows: &[Row], path: &Path, progress: &Progress) -> Result<Done, JobError> {
    let to_text = |error: hzn_run::Error| error.to_string();
    let mut table = Table::create(path, Existing::Replace).map_err(to_text)?;
    let total = rows.len() as u64;
    for (i, row) in (0..).zip(rows) {
        let written = progress.report(i, total).and_then(|()| table.write(row).map_err(|e| format!("{e:#}").into()));
        if written.is_err() {
            table.discard();
            return written.map(|()| Done::Written(path.to_owned()));
        }
    }
    table.finish().map_err(to_text)?;
    Ok(Done::Written(path.to_owned()))
}

/// Recovers a recording that was cut off, into a new file next to it. Existing files stay as they are.
///
/// # Errors
/// The recording cannot be read, or the new file cannot be written.
pub fn recover(path: &Path, progress: &Progress) -> Result<Done, JobError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.trim_end_matches(".part").trim_end_matches(".mcap");
    let free = |name: String| Some(path.with_file_name(name)).filter(|p| !p.exists());
    let numbered = || (2..).find_map(|n: u64| free(format!("{stem}-recovered-{n}.mcap")));
    let out = free(format!("{stem}-recovered.mcap"))
        .or_else(numbered)
        .ok_or_else(|| format!("{}: no file name is free for the recovered recording", path.display()).to_owned())?;
    match hzn_mcap::recover_while(path, &out, |done, total| progress.report(done, total).is_ok()) {
        Ok(found) => Ok(Done::Recovered { path: out, frames: found.frames }),
        Err(hzn_mcap::Error::Stopped { .. }) => Err(JobError::Stopped),
        Err(e) => Err(JobError::Failed(e.to_string())),
    }
}

/// A video of all pictures with their annotations.
pub struct Video {
    /// The pictures.
    pub sequence: Sequence,
    /// Configuration that the pictures are processed with.
    pub config: Arc<Config>,
    /// Single precision and at most 2048 points, as `FlightHorizon` has.
    pub flight: bool,
    /// Layers that are drawn.
    pub layers: Vec<Layer>,
    /// Pictures per second.
    pub fps: f64,
}

impl Video {
    /// Writes the video with ffmpeg.
    ///
    /// # Errors
    /// There is no ffmpeg, ffmpeg fails, or the sequence cannot be read to its end.
    pub fn write(self, path: &Path, progress: &Progress) -> Result<Done, JobError> {
        atomic_file::replace(path, |part| self.encode(part, path, progress))?;
        Ok(Done::Written(path.to_owned()))
    }

    fn encode(self, part: &Path, path: &Path, progress: &Progress) -> Result<(), JobError> {
        let mut sensor = AnySensor::new(&self.config, self.flight).map_err(|e| e.to_string())?;
        let [w, h] = [self.config.camera.width, self.config.camera.height].map(u32::from);
        let size = (w, h + caption::height_px(w, h));
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
                Err(JobError::Failed(hzn_run::disk::advice(path, &full)))
            }
            last => {
                Err(JobError::Failed(format!("{}: ffmpeg: {}", path.display(), last.unwrap_or("ended with an error"))))
            }
        }
    }

    fn feed(
        self,
        pipe: &mut Child,
        sensor: &mut AnySensor,
        size: (u32, u32),
        progress: &Progress,
    ) -> Result<(), JobError> {
        let known: Vec<_> = self.sequence.entries.iter().map(|e| e.data.clone()).collect();
        let total = known.len() as u64;
        let mut source = SequenceSource::new(self.sequence)?;
        let mut writer = Writer::default();
        for (index, data) in known.iter().enumerate() {
            progress.report(index as u64, total)?;
            let item = source.next().ok_or_else(|| "the sequence ends before its last picture".to_owned())?;
            let item = item.map_err(|e| format!("{e:#}"))?;
            // A picture that cannot be read or has another size becomes a black picture, so that the times stay right.
            let image = match item.payload.decode(Some(&self.config)) {
                Ok((picture, _)) => {
                    let (name, time_s) = (&*item.name, item.data.as_ref().and_then(|d| d.time_s));
                    let input = FrameInput { index, name, time_s, data: data.as_ref(), picture: &picture };
                    let outcome = process_frame(input, &self.config, sensor, false, None);
                    let image = draw(&mut writer, &picture, name, time_s, Some(&outcome), &self.layers);
                    if image.dimensions() == size { image } else { image::RgbImage::new(size.0, size.1) }
                }
                Err(_) => image::RgbImage::new(size.0, size.1),
            };
            let stdin = pipe.stdin.as_mut().ok_or_else(|| "ffmpeg does not take input".to_owned())?;
            if stdin.write_all(image.as_raw()).is_err() {
                // ffmpeg itself says why, on its error output.
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
        // Most players need even widths and heights.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
        .arg(path)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => "a video needs `ffmpeg` on PATH: install it".to_owned(),
            _ => format!("ffmpeg cannot be started: {e}"),
        })
}
