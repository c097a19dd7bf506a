//! The viewer through its accessibility tree, as a user or a screen reader would drive it.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Key, Modifiers, Role};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;
use hzn_core::status::Status;
use hzn_viewer::model::Settings;
use hzn_viewer::ui::Viewer;
use hzn_viewer::work::Sight;

const WIDTH: u16 = 320;
const HEIGHT: u16 = 240;
/// Half-angle of the Earth from 240 km, with the limb 10 km above the ground.
const HALF_ANGLE: f64 = 6381.0088 / 6611.0088;

const SENSOR: &str = "# tuned by hand
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

[binarize]
scale = 1.0     # times Otsu's level
";

/// Pictures of a limb with a soft edge that turns from frame to frame; the last one is dark.
fn flight(folder: &Path) {
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 260.0)).unwrap();
    for frame in 0..4 {
        let (pitch, roll) = (1.15 + 0.03 * f64::from(frame), 0.1 * f64::from(frame));
        let axis = [pitch.sin() * roll.sin(), pitch.sin() * roll.cos(), pitch.cos()];
        let picture = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
            let ray = camera.unproject(ImagePoint { u: x.into(), v: y.into() }).unwrap().xyz();
            let cos: f64 = ray.iter().zip(axis).map(|(a, b)| a * b).sum();
            let inside_px = (HALF_ANGLE.asin() - cos.clamp(-1.0, 1.0).acos()) * 260.0;
            let light = 1.0 / (1.0 + (-inside_px / 0.6).exp());
            image::Luma([if frame == 3 { 4 } else { (8.0 + 190.0 * light) as u8 }])
        });
        picture.save(folder.join(format!("{frame}.png"))).unwrap();
    }
    std::fs::write(folder.join("sensor.toml"), SENSOR).unwrap();
}

type Window = Harness<'static, Viewer>;

fn window() -> Window {
    let viewer = Viewer::new(Settings::default(), None, Arc::new(|| {}));
    let mut window = Harness::builder()
        .with_size(egui::vec2(1400.0, 1000.0))
        .with_step_dt(0.02)
        .build_ui_state(|ui, v: &mut Viewer| v.show(ui), viewer);
    window.step();
    window
}

/// Steps until `ready`, for as long as threads beside the window may take.
fn until(window: &mut Window, what: &str, ready: impl Fn(&Viewer) -> bool) {
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

fn settled(window: &mut Window) {
    // A step for what was clicked, one for what follows from it.
    window.run_steps(2);
    until(window, "the frame is not there", Viewer::is_settled);
}

/// Opens by typing the path.
fn open(window: &mut Window, path: &Path) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::O);
    window.run_steps(3);
    window.get_by_role_and_label(Role::TextInput, "Path").focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.get_by_role_and_label(Role::TextInput, "Path").type_text(&path.display().to_string());
    window.run_steps(2);
    window.get_by_label("Open this").click();
    window.run_steps(2);
}

fn sight(window: &Window) -> &Sight {
    window.state().sight().unwrap()
}

/// Status, level and axis of the frame that is shown.
fn answer(window: &Window) -> (Status, Option<u16>, Option<[f64; 3]>) {
    let row = &sight(window).answers[0].bodies[0].row;
    (row.status, row.level, row.axis())
}

#[test]
fn open_step_tune_save_and_open_again() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    assert_eq!(window.state().sequence().len(), 4);
    assert_eq!(answer(&window).0, Status::Ok);

    window.get_by_label("Next frame").click();
    settled(&mut window);
    let first = answer(&window);
    assert_eq!((sight(&window).index, first.0), (1, Status::Ok));

    // The level is turned, and the answer follows.
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    let tuned = answer(&window);
    assert!(tuned.1 > first.1, "{:?} {:?}", tuned.1, first.1);
    assert_ne!(tuned.2, first.2);
    assert!(window.state().session().unwrap().is_changed());

    // Back and forth.
    window.get_by_label("Undo").click();
    settled(&mut window);
    assert_eq!(answer(&window), first);
    window.get_by_label("Redo").click();
    settled(&mut window);
    assert_eq!(answer(&window), tuned);

    // Saved: one value is another, everything else is as it was.
    window.get_by_label("Save").click();
    window.run_steps(3);
    let text = std::fs::read_to_string(dir.path().join("sensor.toml")).unwrap();
    assert_eq!(text, SENSOR.replace("scale = 1.0 ", "scale = 1.5 "));

    // Opened again by another window, the frame is the same to the last bit.
    let mut again = self::window();
    open(&mut again, dir.path());
    settled(&mut again);
    again.get_by_label("Next frame").click();
    settled(&mut again);
    assert_eq!(answer(&again), tuned);
}

#[test]
fn keys_step_and_find_what_has_no_answer() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert_eq!(sight(&window).index, 1);
    window.get_by_label("Process all").click();
    window.run_steps(2);
    until(&mut window, "not processed", |v| v.processed() == 4);
    window.key_press(Key::N);
    settled(&mut window);
    assert_eq!(sight(&window).index, 3);
    assert_eq!(answer(&window).0, Status::NoLimb);
    assert!(window.query_by_label("no-limb").is_some());
    window.key_press(Key::Home);
    settled(&mut window);
    assert_eq!(sight(&window).index, 0);
    window.key_press(Key::F1);
    window.run_steps(4);
    assert!(window.query_by_label("Keys and mouse").is_some());
}

#[test]
fn two_presets_stand_side_by_side() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    window.get_by_label("Compare").click();
    window.run_steps(3);
    window.get_by_label("with preset dlr-2022").click();
    window.run_steps(2);
    until(&mut window, "not compared", |v| v.sight().is_some_and(|s| s.answers.len() == 2));
    let [a, b] = [0, 1].map(|i| sight(&window).answers[i].clone());
    assert_ne!(a.config, b.config);
    assert_eq!(a.config.camera, b.config.camera);
    assert!(window.query_by_label("Compared with dlr-2022").is_some());
}

#[test]
fn a_refused_value_is_said_in_place() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);
    let before = answer(&window);
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(-3.0);
    settled(&mut window);
    // Whatever the slider makes of it, the sensor never has a value beyond its limits.
    let config = window.state().session().unwrap().config().unwrap().clone();
    assert!((0.1..=10.0).contains(&config.binarize.scale));
    assert_eq!(before.0, Status::Ok);
}

#[test]
fn wrong_files_are_said_and_the_rest_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    let mut window = window();
    open(&mut window, dir.path());
    settled(&mut window);

    // Not a recording: what was open stays.
    let bad = dir.path().join("bad.mcap");
    std::fs::write(&bad, b"no recording").unwrap();
    open(&mut window, &bad);
    until(&mut window, "nothing is said", |v| v.messages().any(|m| m.contains("is not an MCAP file")));
    assert_eq!(window.state().sequence().len(), 4);

    // A picture that cannot be decoded, and one of another size.
    std::fs::write(dir.path().join("1.png"), b"no picture").unwrap();
    image::GrayImage::new(40, 30).save(dir.path().join("2.png")).unwrap();
    open(&mut window, dir.path());
    settled(&mut window);
    assert_eq!(answer(&window).0, Status::Ok);
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert!(sight(&window).picture.as_ref().is_err_and(|why| why.contains("no picture")));
    assert!(window.query_by_label("unreadable").is_some());
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    let refused = sight(&window).answers[0].refused.clone().unwrap();
    assert!(refused.contains("40 x 30") && refused.contains("320 x 240"), "{refused}");
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert_eq!(answer(&window).0, Status::NoLimb);
}

#[test]
fn a_recording_that_was_cut_off_is_recovered() {
    let dir = tempfile::tempdir().unwrap();
    let pictures = dir.path().join("pictures");
    std::fs::create_dir(&pictures).unwrap();
    flight(&pictures);
    let mut window = window();
    open(&mut window, &pictures);
    settled(&mut window);

    // Run into a recording, by the window itself.
    let whole = dir.path().join("run.mcap");
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    window.run_steps(3);
    window.get_by_role_and_label(Role::TextInput, "Path").focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.get_by_role_and_label(Role::TextInput, "Path").type_text(&whole.display().to_string());
    window.run_steps(2);
    window.get_by_label("Write").click();
    window.run_steps(2);
    until(&mut window, "not written", |v| v.messages().any(|m| m.starts_with("Written")));
    let folder = answer(&window);

    // The recording says the same as the folder.
    open(&mut window, &whole);
    settled(&mut window);
    assert_eq!(answer(&window), folder);
    assert_eq!(window.state().recorded(0).and_then(|r| r.axis()), folder.2);

    // Cut before the end of its data: every frame is there, and it can be closed.
    let bytes = std::fs::read(&whole).unwrap();
    let cut = dir.path().join("cut.mcap");
    let end = bytes.windows(9).rposition(|w| w == [0x0f, 4, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    std::fs::write(&cut, &bytes[..end]).unwrap();
    open(&mut window, &cut);
    until(&mut window, "not said", |v| v.messages().any(|m| m.contains("was not closed")));
    settled(&mut window);
    assert_eq!(answer(&window), folder);
    window.get_by_label("Recover it").click();
    window.run_steps(2);
    until(&mut window, "not recovered", |v| v.sequence().title == "cut-recovered.mcap" && v.is_settled());
    assert_eq!(window.state().sequence().len(), 4);
    assert_eq!(answer(&window), folder);
}
