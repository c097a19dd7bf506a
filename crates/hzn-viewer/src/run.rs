//! From the command line to the window.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow, bail};
use egui::{ColorImage, ScreenshotCallback, ViewportCommand};

use crate::args::Args;
use crate::measure::Measure;
use crate::model::Settings;
use crate::ui::Viewer;

/// Longest time to wait for the screenshot.
const SHOT_LIMIT: Duration = Duration::from_secs(60);
/// Passes of the window before the screenshot is taken; plots find their bounds and panels their sizes in these passes.
const PASSES: u32 = 6;

/// Opens the window and returns when it is closed.
///
/// # Errors
/// There is no display or no OpenGL. With `--screenshot`, it is also an error if there is nothing to show.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let began = Instant::now();
    if !(args.fps > 0.0 && args.fps.is_finite()) {
        bail!("--fps: must be a finite number above 0");
    }
    let shot = args.screenshot.clone();
    // A screenshot for documents must not depend on the settings of an earlier run.
    let store = if shot.is_some() || args.measure.is_some() { None } else { Settings::place() };
    let mut settings = store.as_deref().map(Settings::load).unwrap_or_default();
    if args.light {
        settings.dark = false;
    }
    if let Some(size) = args.size {
        settings.window = size;
    }
    let outcome = Arc::new(Mutex::new(None));
    let viewport = egui::ViewportBuilder::default()
        .with_title("hzn viewer")
        .with_app_id("hzn-viewer")
        .with_inner_size(settings.window)
        .with_min_inner_size([720.0, 480.0])
        .with_drag_and_drop(true);
    let options = eframe::NativeOptions { viewport, ..Default::default() };
    let measure = args.measure.map(|kind| Measure::new(kind, began));
    let (args, taken) = (args.clone(), Arc::clone(&outcome));
    let made = eframe::run_native(
        "hzn-viewer",
        options,
        Box::new(move |cc| {
            let ctx = cc.egui_ctx.clone();
            let wake = Arc::new(move || ctx.request_repaint());
            let mut viewer = Viewer::new(settings, store, wake);
            viewer.set_flight(args.flight);
            if !args.input.is_empty() {
                viewer.open(args.request());
            }
            Ok(Box::new(Window { viewer, shot, measure, begin: Instant::now(), passes: 0, told: false, taken }))
        }),
    );
    made.map_err(|e| anyhow!("{e}")).context("the window cannot be opened (it needs a display and OpenGL)")?;
    let outcome = outcome.lock().map_err(|_| anyhow!("the window ended with an error"))?.take();
    outcome.unwrap_or(Ok(()))
}

type RunResult = Arc<Mutex<Option<anyhow::Result<()>>>>;

struct Window {
    viewer: Viewer,
    /// File for the screenshot of the window; `None` without `--screenshot`.
    shot: Option<PathBuf>,
    measure: Option<Measure>,
    begin: Instant,
    /// Passes of the window since the picture is shown.
    passes: u32,
    told: bool,
    taken: RunResult,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        if let Some(measure) = &mut self.measure
            && measure.before(&mut self.viewer, &ctx)
        {
            ctx.send_viewport_cmd(ViewportCommand::Close);
            self.measure = None;
        }
        self.viewer.show(ui);
        if let Some(measure) = &mut self.measure {
            measure.after(&self.viewer, &ctx);
        }
        if self.shot.is_none() {
            let size = ctx.input(|i| i.viewport().inner_rect.map(|r| r.size()));
            if let Some(size) = size {
                self.viewer.settings_mut().window = size.into();
            }
            return;
        }
        ctx.request_repaint_after(Duration::from_millis(20));
        if self.begin.elapsed() > SHOT_LIMIT {
            let said: Vec<&str> = self.viewer.messages().collect();
            return self.end(&ctx, Err(anyhow!("no picture was shown within {} s: {}", SHOT_LIMIT.as_secs(), said.join("; "))));
        }
        if !self.viewer.is_settled() {
            let failed = self.viewer.sequence().is_empty() && self.viewer.messages().next().is_some();
            if failed && self.begin.elapsed() > Duration::from_secs(2) {
                let said: Vec<&str> = self.viewer.messages().collect();
                return self.end(&ctx, Err(anyhow!("{}", said.join("; "))));
            }
            return;
        }
        self.passes += 1;
        if self.passes == PASSES
            && let Some(shot) = self.shot.clone()
        {
            let (taken, again) = (Arc::clone(&self.taken), ctx.clone());
            let callback = ScreenshotCallback::new(move |image| {
                if let Ok(mut taken) = taken.lock() {
                    *taken = Some(save(&image, &shot));
                }
                again.request_repaint();
            });
            ctx.send_viewport_cmd(ViewportCommand::Screenshot(callback));
        }
        let done = self.taken.lock().is_ok_and(|t| t.is_some());
        if done && !std::mem::replace(&mut self.told, true) {
            tell(&self.viewer);
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    fn on_exit(&mut self, _: Option<&eframe::glow::Context>) {
        self.viewer.close();
    }
}

impl Window {
    fn end(&self, ctx: &egui::Context, result: anyhow::Result<()>) {
        if let Ok(mut taken) = self.taken.lock() {
            taken.get_or_insert(result);
        }
        ctx.send_viewport_cmd(ViewportCommand::Close);
    }
}

/// Prints what the window shows, one line for each body.
fn tell(viewer: &Viewer) {
    let Some(sight) = viewer.sight() else { return };
    let rows = sight.answers.first().into_iter().flat_map(|o| &o.bodies).map(|b| &b.row);
    for row in rows {
        let axis = row.axis().map_or_else(|| "-".to_owned(), |[x, y, z]| format!("{x} {y} {z}"));
        println!("frame {} {} {} {} {axis}", sight.index, sight.name, row.body, row.status);
    }
}

fn save(image: &ColorImage, path: &std::path::Path) -> anyhow::Result<()> {
    let [w, h] = image.size;
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| [p.r(), p.g(), p.b()]).collect();
    let picture =
        image::RgbImage::from_raw(w as u32, h as u32, bytes).ok_or_else(|| anyhow!("the window has no size"))?;
    hzn_run::overlay::save(&picture, path)
}
