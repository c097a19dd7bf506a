//! Writes what the window shows to files: a picture, a video or a table. It also recovers a recording that was cut off.

use std::collections::HashMap;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;

use hzn_core::Config;
use hzn_core::camera::Camera;
use hzn_files::FrameData;
use hzn_files::truth::Truth;
use hzn_mcap::{Annotations, Row};
use hzn_run::engine::AnySensor;
use hzn_run::overlay::caption::{self, Caption, Entry};
use hzn_run::overlay::letters::Letters;
use hzn_run::overlay::{self, canvas::Canvas};
use hzn_run::provenance;
use hzn_run::sink::{Existing, RowFile as Table};
use hzn_run::source::{Picture, Source};
use image::RgbImage;

use super::frame_view::{FrameInput, FrameView, Outcome, process_frame};
use super::job::{Done, JobError, Progress};
use super::sequence_source::SequenceSource;
use super::{sky, stars};
use crate::model::settings::Layer;
use crate::model::{Sequence, atomic_file};

/// Colours of masked parts, and of Sun and Moon.
const MASK: [u8; 3] = [120, 120, 132];
const SKY: [u8; 3] = [255, 236, 170];
/// Colour of Sun and Moon behind a body.
const HIDDEN: [u8; 3] = [128, 118, 85];

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
    let caption = Caption::new(name, time_s, &[], drawing);
    let Some(outcome) = outcome else { return caption };
    let mut text = caption.text.clone();
    for body in &outcome.bodies {
        let reason = body.cause.and_then(|c| c.reason).map(|r| r.name());
        text += &format!("; {}", caption::answer(&body.row, reason));
        let ends = [outcome.config.camera.width, outcome.config.camera.height].map(|n| f64::from(n) - 0.5);
        let is_inside = |p: [f64; 2]| p.iter().zip(ends).all(|(x, end)| (-0.5..end).contains(x));
        if !body.axis.is_some_and(is_inside) {
            // The picture cannot show where the axis is.
            let z = body.solution().map(|s| s.axis.xyz()[2].clamp(-1.0, 1.0));
            text.extend(z.map(|z| format!(", axis {:.1}° off the optical axis", z.acos().to_degrees())));
        }
    }
    let hash = provenance::hash(&outcome.config);
    let line = provenance::line(hash.as_deref(), &provenance::command("hzn view"));
    Caption { text, ..caption }.with_scale(outcome.config.camera.fx_px).with_provenance(line)
}

/// A picture that is drawn, and what is known about it.
struct Drawn<'a> {
    picture: &'a Picture,
    name: &'a str,
    time_s: Option<f64>,
    data: Option<&'a FrameData>,
    truth: Option<&'a Truth>,
    outcome: Option<&'a Outcome>,
}

impl Drawn<'_> {
    /// Draws the layers that are switched on, with a caption below the picture.
    fn draw(&self, letters: &Letters, layers: &[Layer]) -> RgbImage {
        let drawing = self.outcome.map(|o| annotations(o, layers)).unwrap_or_default();
        let mut caption = describe(self.name, self.time_s, self.outcome, &drawing);
        let mut canvas = Canvas { image: overlay::draw_plain(self.picture.to_rgb(), &drawing, &[]) };
        if let Some(outcome) = self.outcome {
            self.draw_mask(&mut canvas, outcome, layers, &mut caption);
            self.draw_sky(&mut canvas, letters, outcome, layers);
        }
        caption::add(letters, &canvas.image, &caption)
    }

    /// Width of a thin line: it is visible if the whole picture is shown on a screen.
    fn pen(&self) -> f64 {
        let layout = self.picture.layout;
        (f64::from(layout.width.max(layout.height)) / 800.0).max(1.0)
    }

    fn draw_mask(&self, canvas: &mut Canvas, outcome: &Outcome, layers: &[Layer], caption: &mut Caption) {
        let polygons = outcome.config.mask.polygons_px.iter().filter(|p| p.len() > 2);
        for polygon in polygons.filter(|_| layers.contains(&Layer::Mask)) {
            let closed: Vec<[f64; 2]> = polygon.iter().chain(polygon.first()).copied().collect();
            canvas.polyline(&closed, 1.5 * self.pen(), MASK);
            if caption.legend.iter().all(|entry| entry.name != "mask") {
                caption.legend.push(Entry { name: "mask".to_owned(), colours: vec![MASK] });
            }
        }
    }

    fn draw_sky(&self, canvas: &mut Canvas, letters: &Letters, outcome: &Outcome, layers: &[Layer]) {
        let camera = Camera::try_new(&outcome.config.camera).ok().filter(|_| layers.contains(&Layer::Sky));
        let Some(camera) = camera else { return };
        for place in sky::places(self.data, self.truth, &outcome.bodies, &camera) {
            let colour = if place.is_hidden { HIDDEN } else { SKY };
            self.draw_place(canvas, letters, (place.at, 9.0), &place.name, colour);
        }
        for star in stars::places(self.data, &outcome.bodies, &camera) {
            self.draw_place(canvas, letters, (star.at, 5.0), star.name, SKY);
        }
    }

    /// Draws a circle, given by its centre and its radius, with a name next to it.
    fn draw_place(
        &self,
        canvas: &mut Canvas,
        letters: &Letters,
        (at, radius): ([f64; 2], f64),
        name: &str,
        colour: [u8; 3],
    ) {
        let radius = radius * self.pen();
        let around = |i: u32| {
            let (s, c) = (f64::from(i) / 48.0 * std::f64::consts::TAU).sin_cos();
            [at[0] + radius * c, at[1] + radius * s]
        };
        canvas.polyline(&(0..=48).map(around).collect::<Vec<_>>(), self.pen(), colour);
        let corner = [at[0] + 1.4 * radius, at[1] - 7.0 * self.pen()].map(|x| x as f32);
        let size = 14.0 * self.pen() as f32;
        letters.write(&mut canvas.image, corner, name, size, colour);
    }
}

/// Writes the shown picture with its annotations as PNG, in the size of the picture, with a caption below it. `truth`
/// gives the directions of Sun and Moon where nothing else does.
///
/// # Errors
/// There is no picture, the name does not end in `.png`, or the file cannot be written.
pub fn save_picture(
    frame_view: &FrameView,
    truth: Option<&Truth>,
    layers: &[Layer],
    path: &Path,
) -> Result<Done, JobError> {
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(JobError::Failed(format!("{}: the file name of a picture must end in .png", path.display())));
    }
    let picture = frame_view.picture.as_ref().map_err(Clone::clone)?;
    let outcome = frame_view.answers.first().map(|o| &**o);
    let FrameView { name, time_s, data, .. } = frame_view;
    let drawn = Drawn { picture, name, time_s: *time_s, data: data.as_ref(), truth, outcome };
    let image = drawn.draw(&Letters::default(), layers);
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
    /// Truth of the pictures by their name, for the directions of Sun and Moon.
    pub truth: HashMap<String, Vec<Truth>>,
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
        let letters = Letters::default();
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
                    let truth = self.truth.get(name).and_then(|all| all.first());
                    let outcome = Some(&outcome);
                    let drawn = Drawn { picture: &picture, name, time_s, data: data.as_ref(), truth, outcome };
                    let image = drawn.draw(&letters, &self.layers);
                    if image.dimensions() == size { image } else { RgbImage::new(size.0, size.1) }
                }
                Err(_) => RgbImage::new(size.0, size.1),
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
