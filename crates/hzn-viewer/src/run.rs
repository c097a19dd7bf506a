//! From the command line to the window.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, bail};
use egui::{ColorImage, ScreenshotCallback, ViewportCommand};
use hzn_mcap::Row;
use hzn_run::terminal;

use crate::args::Args;
use crate::measure::Measure;
use crate::model::Settings;
use crate::ui::{Situation, Viewer};

/// Longest time to wait for the screenshot.
const SHOT_LIMIT: Duration = Duration::from_secs(60);
/// Passes of the window before the screenshot is taken; plots find their bounds and panels their sizes in these passes.
const SHOT_PASSES: u32 = 6;

/// Time until the window is drawn when a thread has something to show.
const WAKE_DELAY: Duration = Duration::from_millis(1);

/// Opens the window and returns when it is closed.
///
/// # Errors
/// There is no display or no OpenGL. With `--screenshot`, it is also an error if there is nothing to show.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let program_start = Instant::now();
    if args.fps.is_some_and(|fps| !(fps > 0.0 && fps.is_finite())) {
        bail!("--fps: must be a finite number above 0");
    }
    let shot = args.screenshot.clone();
    if let Some(shot) = &shot {
        check_shot(shot, &args.input)?;
    }
    // A screenshot for documents must not depend on the settings of an earlier run.
    let store = if shot.is_some() || args.measure.is_some() { None } else { Settings::default_path() };
    let settings = settings(args, store.as_deref());
    let outcome = Arc::new(Mutex::new(None));
    let options = eframe::NativeOptions { viewport: viewport(settings.window), ..Default::default() };
    let measure = args.measure.map(|kind| Measure::new(kind, program_start));
    let (args, result) = (args.clone(), Arc::clone(&outcome));
    let store_is_used = store.is_some();
    let is_unfitted = store_is_used && args.size.is_none();
    let window = eframe::run_native(
        "hzn-viewer",
        options,
        Box::new(move |cc| {
            let ctx = cc.egui_ctx.clone();
            // Without a delay, the window would be drawn twice.
            let wake = Arc::new(move || ctx.request_repaint_after(WAKE_DELAY));
            let mut viewer = Viewer::new(settings, store, wake);
            viewer.set_flight(args.flight);
            if store_is_used && native_dialogs() {
                viewer.use_native_dialogs();
            } else if !store_is_used {
                viewer.allow_close();
            }
            if !args.input.is_empty() {
                viewer.open(args.request());
            }
            let is_welcome = args.input.is_empty();
            let (begun, situation) = (Instant::now(), args.situation);
            let window = Window {
                viewer,
                shot,
                is_welcome,
                is_unfitted,
                situation,
                measure,
                begun,
                passes: 0,
                is_printed: false,
                result,
            };
            Ok(Box::new(window))
        }),
    );
    window.map_err(|e| anyhow!("{e}")).context("the window cannot be opened (it needs a display and OpenGL)")?;
    let outcome = outcome.lock().map_err(|_| anyhow!("the window ended with an error"))?.take();
    outcome.unwrap_or(Ok(()))
}

/// Returns the stored settings, with what the command line says.
fn settings(args: &Args, store: Option<&Path>) -> Settings {
    let mut settings = store.map(Settings::load).unwrap_or_default();
    if args.light {
        settings.dark = false;
    }
    if let Some(size) = args.size {
        settings.window = size;
    }
    settings
}

fn viewport(size: [f32; 2]) -> egui::ViewportBuilder {
    egui::ViewportBuilder::default()
        .with_title("hzn viewer")
        .with_app_id("hzn-viewer")
        .with_inner_size(size)
        .with_min_inner_size([720.0, 480.0])
        .with_drag_and_drop(true)
}

/// Checks that a screenshot replaces neither a file of another kind nor a file that is opened.
///
/// # Errors
/// The name does not end in `.png`, or the file is one of the inputs or lies in a folder that is opened.
fn check_shot(shot: &Path, inputs: &[PathBuf]) -> anyhow::Result<()> {
    if hzn_run::source::ending(shot) != "png" {
        bail!("--screenshot {}: the file name must end in .png", shot.display());
    }
    let opens = |file: &Path, input: &PathBuf| input.canonicalize().is_ok_and(|input| file.starts_with(input));
    if shot.canonicalize().is_ok_and(|file| inputs.iter().any(|input| opens(&file, input))) {
        bail!("--screenshot {}: is one of the files that are opened; choose another name", shot.display());
    }
    Ok(())
}

/// Returns true if a window with its decorations does not fit on the screen. It is then maximised, because only the
/// system knows how much of the screen its bars leave.
fn is_too_large(outer: egui::Vec2, screen: egui::Vec2) -> bool {
    outer.x >= screen.x || outer.y >= screen.y
}

/// Returns true if the system can show its own dialogs. On Linux they come over the session bus.
fn native_dialogs() -> bool {
    let bus = || std::env::var_os("XDG_RUNTIME_DIR").is_some_and(|d| PathBuf::from(d).join("bus").exists());
    !cfg!(target_os = "linux") || std::env::var_os("DBUS_SESSION_BUS_ADDRESS").is_some() || bus()
}

type RunResult = Arc<Mutex<Option<anyhow::Result<()>>>>;

struct Window {
    viewer: Viewer,
    /// File for the screenshot of the window; `None` without `--screenshot`.
    shot: Option<PathBuf>,
    /// Nothing is opened, so the welcome page is shown.
    is_welcome: bool,
    /// The size of the window has not been compared with that of the screen yet.
    is_unfitted: bool,
    /// Situation that the window has to be brought into before the screenshot.
    situation: Option<Situation>,
    measure: Option<Measure>,
    begun: Instant,
    /// Passes of the window since the picture is shown.
    passes: u32,
    is_printed: bool,
    result: RunResult,
}

impl Window {
    /// Maximises a window that is larger than the screen, once.
    fn fit_to_screen(&mut self, ctx: &egui::Context) {
        let (outer, screen) = ctx.input(|i| (i.viewport().outer_rect, i.viewport().monitor_size));
        if let (true, Some(outer), Some(screen)) = (self.is_unfitted, outer, screen) {
            self.is_unfitted = false;
            if is_too_large(outer.size(), screen) {
                ctx.send_viewport_cmd(ViewportCommand::Maximized(true));
            }
        }
    }
}

impl eframe::App for Window {
    fn raw_input_hook(&mut self, _: &egui::Context, raw_input: &mut egui::RawInput) {
        // A screenshot does not depend on where the pointer happens to be.
        if self.shot.is_some() {
            raw_input.events.retain(|event| !matches!(event, egui::Event::PointerMoved(_)));
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        if let Some(measure) = &mut self.measure
            && measure.before_pass(&mut self.viewer, &ctx)
        {
            ctx.send_viewport_cmd(ViewportCommand::Close);
            self.measure = None;
        }
        self.viewer.show(ui);
        let is_watched = self.shot.is_some() || self.measure.is_some();
        if is_watched && !self.is_welcome && self.viewer.is_without_pictures() {
            let messages: Vec<&str> = self.viewer.messages().collect();
            return self.finish(&ctx, Err(anyhow!("{}", messages.join("; "))));
        }
        if let Some(measure) = &mut self.measure {
            measure.after_pass(&self.viewer, &ctx);
        }
        if self.shot.is_none() {
            self.fit_to_screen(&ctx);
            let size = ctx.input(|i| i.viewport().inner_rect.map(|r| r.size()));
            if let Some(size) = size {
                self.viewer.settings_mut().window = size.into();
            }
            return;
        }
        ctx.request_repaint_after(Duration::from_millis(20));
        if self.begun.elapsed() > SHOT_LIMIT {
            let messages: Vec<&str> = self.viewer.messages().collect();
            return self.finish(
                &ctx,
                Err(anyhow!("no picture was shown within {} s: {}", SHOT_LIMIT.as_secs(), messages.join("; "))),
            );
        }
        let is_busy = self.viewer.is_working() || self.viewer.is_calibrating();
        if !self.is_welcome && (!self.viewer.is_settled() || is_busy) {
            return;
        }
        if let Some(situation) = self.situation.take() {
            return self.viewer.arrange(situation, &ctx);
        }
        self.passes += 1;
        if self.passes == SHOT_PASSES
            && let Some(shot) = self.shot.clone()
        {
            let (result, again) = (Arc::clone(&self.result), ctx.clone());
            let callback = ScreenshotCallback::new(move |image| {
                if let Ok(mut result) = result.lock() {
                    *result = Some(save(&image, &shot));
                }
                again.request_repaint();
            });
            ctx.send_viewport_cmd(ViewportCommand::Screenshot(callback));
        }
        let done = self.result.lock().is_ok_and(|t| t.is_some());
        if done && !std::mem::replace(&mut self.is_printed, true) {
            print_answers(&self.viewer);
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    fn on_exit(&mut self, _: Option<&eframe::glow::Context>) {
        self.viewer.close();
    }
}

impl Window {
    fn finish(&self, ctx: &egui::Context, result: anyhow::Result<()>) {
        if let Ok(mut slot) = self.result.lock() {
            slot.get_or_insert(result);
        }
        ctx.send_viewport_cmd(ViewportCommand::Close);
    }
}

/// Prints what the window shows, one line for each body.
fn print_answers(viewer: &Viewer) {
    let Some(frame_view) = viewer.frame_view() else { return };
    for body in frame_view.answers.first().into_iter().flat_map(|o| &o.bodies) {
        println!("{}", answer_line(frame_view.index, &frame_view.name, &body.row));
    }
}

/// Returns an answer as a line. The names can come from a recording.
fn answer_line(index: usize, name: &str, row: &Row) -> String {
    let axis = row.axis().map_or_else(|| "-".to_owned(), |[x, y, z]| format!("{x} {y} {z}"));
    terminal::one_line(format_args!("frame {index} {name} {} {} {axis}", row.body, row.status))
}

fn save(image: &ColorImage, path: &Path) -> anyhow::Result<()> {
    let [w, h] = image.size;
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]).collect();
    let picture =
        image::RgbImage::from_raw(w as u32, h as u32, bytes).ok_or_else(|| anyhow!("the window has no size"))?;
    Ok(hzn_run::overlay::save(&picture, path)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_as_large_as_the_screen_is_maximised() {
        let size = egui::vec2;
        // The title bar makes a window of 1440 x 900 points higher.
        assert!(is_too_large(size(1442.0, 932.0), size(1440.0, 900.0)));
        assert!(is_too_large(size(1024.0, 700.0), size(1024.0, 768.0)));
        assert!(!is_too_large(size(1442.0, 932.0), size(1920.0, 1080.0)));
    }

    #[test]
    fn an_answer_prints_nothing_that_a_terminal_obeys() {
        let name = "\u{1b}]52;c;aGk\u{7}\u{202e}.png".to_owned();
        let meta =
            hzn_mcap::RowMeta { index: 3, file: name, time_s: None, body: "\u{9b}31m\n".into(), altitude_km: None };
        let row = Row::unprocessed(&meta, hzn_core::status::Status::NoLimb, "");
        let line = answer_line(3, &meta.file, &row);
        assert_eq!(line, r"frame 3 \x1b]52;c;aGk\x07\u{202e}.png \x9b31m\n no-limb -");
    }

    #[test]
    fn a_screenshot_replaces_nothing_that_is_opened() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str| dir.path().join(name);
        for name in ["flight.mcap", "a.png", "shot.png"] {
            std::fs::write(file(name), b"").unwrap();
        }
        let refused = |shot: &str, input: &Path| check_shot(&file(shot), &[input.to_owned()]).is_err();
        assert!(refused("flight.mcap", &file("flight.mcap")) && refused("shot", &file("flight.mcap")));
        assert!(refused("a.png", &file("a.png")) && refused("a.png", &dir.path().join(".")));
        assert!(!refused("shot.png", &file("flight.mcap")) && !refused("new.png", dir.path()));
    }
}
