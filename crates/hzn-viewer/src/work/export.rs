//! Pictures, videos and tables of what is shown.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crossbeam_channel::{Receiver, bounded};
use hzn_cli::engine::AnySensor;
use hzn_cli::input::{Picture, Source};
use hzn_cli::output::{Existing, Rows as Table};
use hzn_cli::overlay;
use hzn_core::Config;
use hzn_mcap::{Annotations, Pictures, Row};

use super::Wake;
use super::sight::{self, Outcome, Sight, Subject};
use super::sweep::Walk;
use crate::model::Entry;
use crate::model::settings::Layer;

/// What is drawn over a picture, as far as it is shown.
pub fn annotations(outcome: &Outcome, layers: &[Layer]) -> Annotations {
    let on = |layer| layers.contains(&layer);
    let mut out = Annotations::default();
    for answer in &outcome.bodies {
        if on(Layer::Edges) {
            let border =
                |e: &hzn_cli::engine::trace::Edge| e.border.iter().map(|p| [f64::from(p.x), f64::from(p.y)]).collect();
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
/// There is no picture, or the disk says no.
pub fn picture(sight: &Sight, layers: &[Layer], path: &Path) -> Result<(), String> {
    let picture = sight.picture.as_ref().map_err(Clone::clone)?;
    let image = draw(picture, sight.answers.first().map(|o| &**o), layers);
    overlay::save(&image, path).map_err(|e| format!("{e:#}"))
}

/// Writes results as CSV or JSON Lines, by the ending.
///
/// # Errors
/// Another ending, or the disk says no.
pub fn table<'a>(rows: impl Iterator<Item = &'a Row>, path: &Path) -> Result<usize, String> {
    let told = |stop: hzn_cli::exit::Stop| format!("{:#}", stop.error);
    let mut table = Table::create(path, Existing::Replace).map_err(told)?;
    let mut count = 0;
    for row in rows {
        table.write(row).map_err(|e| format!("{e:#}"))?;
        count += 1;
    }
    table.finish().map_err(told)?;
    Ok(count)
}

/// A video that is being written. Dropped, it stops and leaves no file.
pub struct Export {
    stop: Arc<AtomicBool>,
    done: Arc<AtomicUsize>,
    end: Receiver<Result<String, String>>,
    /// Frames in all.
    pub total: usize,
}

impl Export {
    /// Begins a video of all frames.
    pub fn video(
        entries: Vec<Entry>,
        inputs: Vec<PathBuf>,
        pictures: Option<Pictures>,
        config: Arc<Config>,
        flight: bool,
        layers: Vec<Layer>,
        fps: f64,
        path: PathBuf,
        wake: &Wake,
    ) -> Self {
        let (stop, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        let (send, end) = bounded(1);
        let total = entries.len();
        let (flag, count, wake) = (Arc::clone(&stop), Arc::clone(&done), Arc::clone(wake));
        std::thread::spawn(move || {
            let walk = Walk::new(entries.clone(), inputs, pictures);
            let film = Film { config, flight, layers, fps };
            let result = film.write(&entries, walk, &path, &flag, &count, &wake);
            let _ = send.send(result.map(|()| format!("Written: {}", path.display())));
            wake();
        });
        Self { stop, done, end, total }
    }
    /// Frames that are written.
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }
    /// Stops; no file is left.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
    /// How it ended, once it has.
    pub fn end(&mut self) -> Option<Result<String, String>> {
        self.end.try_recv().ok()
    }
}

impl Drop for Export {
    fn drop(&mut self) {
        self.stop();
    }
}

struct Film {
    config: Arc<Config>,
    flight: bool,
    layers: Vec<Layer>,
    fps: f64,
}

impl Film {
    fn write(
        &self,
        entries: &[Entry],
        mut walk: Walk,
        path: &Path,
        stop: &AtomicBool,
        done: &AtomicUsize,
        wake: &Wake,
    ) -> Result<(), String> {
        let ending = path.extension().map_or("mp4".into(), |e| e.to_string_lossy().into_owned());
        let part = path.with_extension(format!("part.{ending}"));
        let mut sensor = AnySensor::new(&self.config, self.flight).map_err(|e| e.to_string())?;
        let size = (u32::from(self.config.camera.width), u32::from(self.config.camera.height));
        let mut pipe = start_ffmpeg(&part, size, self.fps)?;
        let mut written = || -> Result<(), String> {
            for (index, entry) in entries.iter().enumerate() {
                if stop.load(Ordering::Relaxed) {
                    return Err("The video was stopped; nothing is left of it.".into());
                }
                let item =
                    walk.next().ok_or("the sequence ends before its last frame")?.map_err(|e| format!("{e:#}"))?;
                // A picture that cannot be read, or has another size, is a black frame: times stay right.
                let image = match item.payload.decode(Some(size)) {
                    Ok((picture, _)) => {
                        let subject = Subject {
                            index,
                            name: &entry.name,
                            time_s: entry.time_s,
                            data: entry.data.as_ref(),
                            picture: &picture,
                        };
                        let outcome = sight::look(subject, &self.config, &mut sensor, false);
                        draw(&picture, Some(&outcome), &self.layers)
                    }
                    Err(_) => image::RgbImage::new(size.0, size.1),
                };
                let input = pipe.stdin.as_mut().ok_or("ffmpeg takes no input")?;
                if input.write_all(image.as_raw()).is_err() {
                    // Why, it says itself.
                    break;
                }
                done.fetch_add(1, Ordering::Relaxed);
                wake();
            }
            Ok(())
        };
        let fed = written();
        drop(pipe.stdin.take());
        if fed.is_err() {
            let _ = pipe.kill();
        }
        let end = pipe.wait_with_output().map_err(|e| e.to_string());
        let result = fed.and_then(|()| {
            let end = end?;
            if end.status.success() {
                return std::fs::rename(&part, path).map_err(|e| hzn_cli::output::advice(path, &e));
            }
            let why = String::from_utf8_lossy(&end.stderr);
            Err(format!("ffmpeg: {}", why.trim().lines().last().unwrap_or("ended with an error")))
        });
        if result.is_err() {
            let _ = std::fs::remove_file(&part);
        }
        result
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
