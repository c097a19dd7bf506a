//! A window with a small flight, and the actions that most tests use.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::epaint::Shape;
use egui::{Key, Modifiers, Rect, Role};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_viewer::model::Settings;
use hzn_viewer::ui::Viewer;
use hzn_viewer::work::FrameView;
use tempfile::TempDir;

pub(crate) const WIDTH: u16 = 320;
pub(crate) const HEIGHT: u16 = 240;
/// Sine of the half-angle of the Earth from 240 km, with the limb 10 km above the ground.
const HALF_ANGLE: f64 = 6381.0088 / 6611.0088;

pub(crate) const SENSOR: &str = "# tuned by hand
preset = \"hzn\"

[camera]
width = 320
height = 240
model = \"pinhole\"
fx_px = 260.0
fy_px = 260.0
cx_px = 159.5
cy_px = 119.5

[body]
kind = \"earth-sphere\"   # no positions here
altitude_km = 240.0

[threshold]
scale = 1.0     # times Otsu's level
";

/// Returns a picture of a limb with a soft edge around an axis in the camera frame.
pub(crate) fn limb(axis: [f64; 3]) -> image::GrayImage {
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 260.0)).unwrap();
    image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
        let ray = camera.unproject(ImagePoint { u: x.into(), v: y.into() }).unwrap().xyz();
        let cos: f64 = ray.iter().zip(axis).map(|(a, b)| a * b).sum();
        let inside_px = (HALF_ANGLE.asin() - cos.clamp(-1.0, 1.0).acos()) * 260.0;
        image::Luma([(8.0 + 190.0 / (1.0 + (-inside_px / 0.6).exp())) as u8])
    })
}

/// Writes pictures of a limb with a soft edge, which turns from picture to picture. The last picture is dark.
pub(crate) fn flight(folder: &Path) {
    for frame in 0..4 {
        let (pitch, roll) = (1.15 + 0.03 * f64::from(frame), 0.1 * f64::from(frame));
        let axis = [pitch.sin() * roll.sin(), pitch.sin() * roll.cos(), pitch.cos()];
        let dark = || image::GrayImage::from_pixel(WIDTH.into(), HEIGHT.into(), image::Luma([4]));
        let picture = if frame == 3 { dark() } else { limb(axis) };
        picture.save(folder.join(format!("{frame}.png"))).unwrap();
    }
    std::fs::write(folder.join("sensor.toml"), SENSOR).unwrap();
}

/// Altitude in km at which the Earth of [`disc`] has a half-angle of 15 degrees, with the limb 10 km above the ground.
const DISC_ALTITUDE: &str = "altitude_km = 18282.9";

/// Writes a picture of the whole Earth, whose axis is in the picture, and its sensor.
pub(crate) fn disc(folder: &Path) {
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 260.0)).unwrap();
    let axis = [0.1f64.sin(), 0.0, 0.1f64.cos()];
    let picture = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
        let ray = camera.unproject(ImagePoint { u: x.into(), v: y.into() }).unwrap().xyz();
        let cos: f64 = ray.iter().zip(axis).map(|(a, b)| a * b).sum();
        let inside_px = (15f64.to_radians() - cos.clamp(-1.0, 1.0).acos()) * 260.0;
        image::Luma([(8.0 + 190.0 / (1.0 + (-inside_px / 0.6).exp())) as u8])
    });
    picture.save(folder.join("disc.png")).unwrap();
    std::fs::write(folder.join("sensor.toml"), SENSOR.replace("altitude_km = 240.0", DISC_ALTITUDE)).unwrap();
}

/// Creates a folder that contains a folder of pictures, so that written files go next to the pictures.
pub(crate) fn folder() -> (TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let pictures = dir.path().join("pictures");
    std::fs::create_dir(&pictures).unwrap();
    flight(&pictures);
    (dir, pictures)
}

/// Makes a flight longer by links to its pictures.
pub(crate) fn lengthen(pictures: &Path, frames: usize) {
    for i in 4..frames {
        std::fs::hard_link(pictures.join(format!("{}.png", i % 3)), pictures.join(format!("{i:05}.png"))).unwrap();
    }
}

/// Writes a sensor.toml with a higher threshold.
pub(crate) fn another_sensor(folder: &Path) -> PathBuf {
    let path = folder.join("other.toml");
    std::fs::write(&path, SENSOR.replace("scale = 1.0", "scale = 1.6")).unwrap();
    path
}

pub(crate) type Window = Harness<'static, Viewer>;

pub(crate) fn window() -> Window {
    sized_window(1400.0, 1000.0)
}

/// Returns a window of this size in points.
pub(crate) fn sized_window(width: f32, height: f32) -> Window {
    harness(width, height, None)
}

/// Returns a window that keeps its settings and its unsaved changes next to `store`.
pub(crate) fn stored_window(store: &Path) -> Window {
    harness(1400.0, 1000.0, Some(store.to_owned()))
}

fn harness(width: f32, height: f32, store: Option<PathBuf>) -> Window {
    let viewer = Viewer::new(Settings::default(), store, Arc::new(|| {}));
    let mut window = Harness::builder()
        .with_size(egui::vec2(width, height))
        .with_step_dt(0.02)
        .build_ui_state(|ui, v: &mut Viewer| v.show(ui), viewer);
    window.step();
    window
}

/// Steps the window until `ready`, and allows for the time of the other threads.
pub(crate) fn until(window: &mut Window, what: &str, ready: impl Fn(&Viewer) -> bool) {
    let begin = Instant::now();
    while !ready(window.state()) {
        assert!(
            begin.elapsed() < Duration::from_secs(60),
            "{what}: {:?}",
            window.state().messages().collect::<Vec<_>>()
        );
        std::thread::sleep(Duration::from_millis(2));
        window.step();
    }
    window.run_steps(3);
}

pub(crate) fn settled(window: &mut Window) {
    // One step handles the click, the other one its effects.
    window.run_steps(2);
    until(window, "the picture is not there", Viewer::is_settled);
}

/// Types a path into the dialog, and accepts it.
pub(crate) fn path(window: &mut Window, path: &Path, accept: &str) {
    type_path(window, path);
    window.get_by_label(accept).click();
    window.run_steps(2);
}

/// Types a path into the dialog.
pub(crate) fn type_path(window: &mut Window, path: &Path) {
    window.run_steps(3);
    window.get_by_role_and_label(Role::TextInput, "Path").focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.get_by_role_and_label(Role::TextInput, "Path").type_text(&path.display().to_string());
    window.run_steps(2);
}

/// Types a number into a field, and leaves the field.
pub(crate) fn type_number(window: &mut Window, field: &str, text: &str) {
    window.get_by_role_and_label(Role::SpinButton, field).focus();
    window.run_steps(3);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(2);
    window.event(egui::Event::Text(text.to_owned()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
}

/// Agrees to replace a file that exists.
pub(crate) fn replace(window: &mut Window) {
    window.get_by_label("Replace").click();
    window.run_steps(2);
}

/// Checks that the dialog refuses the path with these words, and closes it.
pub(crate) fn refused(window: &mut Window, words: &str) {
    window.run_steps(2);
    assert!(window.query_by_label_contains(words).is_some(), "{words}");
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    assert!(window.query_by_label_contains(words).is_none());
}

/// Opens a path by typing it.
pub(crate) fn open(window: &mut Window, what: &Path) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::O);
    path(window, what, "Open this");
}

/// Returns a window with a folder of pictures.
pub(crate) fn window_on(folder: &Path) -> Window {
    let mut window = window();
    open(&mut window, folder);
    settled(&mut window);
    window
}

/// Returns a window with a flight, whose folder exists until the first value is dropped.
pub(crate) fn window_on_flight() -> (TempDir, Window) {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let window = window_on(dir.path());
    (dir, window)
}

/// Processes the sequence into a new recording.
pub(crate) fn run_into(window: &mut Window, recording: &Path) {
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    path(window, recording, "Write");
    said(window, "Written");
}

/// Writes a copy next to a recording, cut off where the end of the data should be.
pub(crate) fn cut_off(recording: &Path) -> PathBuf {
    let bytes = std::fs::read(recording).unwrap();
    let end = bytes.windows(9).rposition(|w| w == [0x0f, 4, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    let cut = recording.with_file_name("cut.mcap");
    std::fs::write(&cut, &bytes[..end]).unwrap();
    cut
}

/// Chooses an entry of a menu.
pub(crate) fn menu(window: &mut Window, menu: &str, entry: &str) {
    window.get_by_label(menu).click();
    window.run_steps(3);
    window.get_by_label(entry).click();
    window.run_steps(2);
}

/// Waits for a message that contains these words.
pub(crate) fn said(window: &mut Window, words: &str) {
    until(window, words, |v| v.messages().any(|m| m.contains(words)));
}

/// Returns the names of the files in a folder, sorted.
pub(crate) fn files(folder: &Path) -> Vec<String> {
    let name = |e: std::io::Result<std::fs::DirEntry>| e.unwrap().file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = std::fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
}

pub(crate) fn frame_view(window: &Window) -> &FrameView {
    window.state().frame_view().unwrap()
}

/// Returns all texts that are painted, with their places.
pub(crate) fn painted(window: &Window) -> Vec<(String, Rect)> {
    fn collect(shape: &Shape, clip: Rect, out: &mut Vec<(String, Rect)>) {
        match shape {
            Shape::Vec(all) => all.iter().for_each(|one| collect(one, clip, out)),
            Shape::Text(text) => {
                let rect = text.visual_bounding_rect();
                if clip.intersects(rect) {
                    out.push((text.galley.text().to_owned(), rect));
                }
            }
            _ => {}
        }
    }
    let mut out = Vec::new();
    for clipped in &window.output().shapes {
        collect(&clipped.shape, clipped.clip_rect, &mut out);
    }
    out
}

/// Returns the place of the first painted text that is looked for.
pub(crate) fn place_of(window: &Window, is_it: impl Fn(&str) -> bool) -> Rect {
    let texts = painted(window);
    texts.iter().find(|(text, _)| is_it(text)).unwrap_or_else(|| panic!("not painted: {texts:?}")).1
}

/// Returns status, threshold and axis of the shown picture.
pub(crate) fn answer(window: &Window) -> (Status, Option<u16>, Option<[f64; 3]>) {
    let row = &frame_view(window).answers[0].bodies[0].row;
    (row.status, row.level, row.axis())
}
