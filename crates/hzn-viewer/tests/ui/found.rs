//! Tests of what a careful user found: nothing is lost, nothing is silent, and every refusal has numbers.

use std::path::Path;

use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use hzn_core::status::Status;
use hzn_viewer::model::cause::Reason;
use hzn_viewer::model::diagnosis::{self, Suspect};
use hzn_viewer::ui::Viewer;
use hzn_viewer::work::open::Request;

use crate::window::*;

const CTRL: Modifiers = Modifiers::COMMAND;

fn scale_to(window: &mut Window, scale: f64) {
    window.get_by_role_and_label(egui::Role::Slider, "scale").set_value_accesskit(scale);
    settled(window);
}

fn is_changed(window: &Window) -> bool {
    window.state().session().unwrap().is_changed()
}

#[test]
fn unsaved_changes_are_never_lost_without_a_question() {
    let (dir, pictures) = folder();
    let (_other_dir, other) = folder();
    let mut window = window_on(&pictures);
    scale_to(&mut window, 1.5);
    open(&mut window, &other);
    window.run_steps(3);
    assert!(window.query_by_label("Unsaved changes").is_some());
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    assert!(is_changed(&window) && window.state().sequence().inputs == [pictures.clone()]);

    // The changes are saved, and then the other folder is opened.
    open(&mut window, &other);
    window.run_steps(3);
    window.get_by_label("Save changes").click();
    until(&mut window, "not opened", |v| v.sequence().inputs == [other.clone()] && v.is_settled());
    let saved = std::fs::read_to_string(pictures.join("sensor.toml")).unwrap();
    assert!(saved.contains("scale = 1.5 ") && !is_changed(&window));

    // The changes are discarded.
    scale_to(&mut window, 1.7);
    open(&mut window, &dir.path().join("pictures"));
    window.run_steps(3);
    window.get_by_label("Discard changes").click();
    until(&mut window, "not opened", |v| v.sequence().inputs == [pictures.clone()] && v.is_settled());
    assert!(!std::fs::read_to_string(other.join("sensor.toml")).unwrap().contains("scale = 1.7"));
}

#[test]
fn the_window_does_not_close_over_unsaved_changes() {
    let (_dir, mut window) = window_on_flight();
    let close = |window: &mut Window| {
        let id = egui::ViewportId::ROOT;
        window.input_mut().viewports.entry(id).or_default().events.push(egui::ViewportEvent::Close);
        window.step();
        let commands = &window.output().viewport_output[&id].commands;
        commands.contains(&egui::ViewportCommand::CancelClose)
    };
    assert!(!close(&mut window), "nothing would be lost");
    scale_to(&mut window, 1.5);
    assert!(close(&mut window));
    window.run_steps(3);
    assert!(window.query_by_label("Unsaved changes").is_some());
}

#[test]
fn shortcuts_need_exactly_their_modifiers() {
    let (_dir, mut window) = window_on_flight();
    scale_to(&mut window, 1.5);
    let tuned = window.state().session().unwrap().sheet().clone();
    window.key_press_modifiers(CTRL, Key::Z);
    settled(&mut window);
    assert!(!is_changed(&window));
    window.key_press_modifiers(CTRL | Modifiers::SHIFT, Key::Z);
    settled(&mut window);
    assert_eq!(window.state().session().unwrap().sheet(), &tuned, "Ctrl+Shift+Z makes the change again");
    let stages = |w: &Window| w.query_by_label("preset").is_some();
    assert!(stages(&window));
    window.key_press_modifiers(Modifiers::SHIFT, Key::S);
    window.run_steps(3);
    assert!(stages(&window), "Shift+S is no command");
    window.key_press(Key::S);
    window.run_steps(3);
    assert!(!stages(&window));
}

#[test]
fn comparing_keeps_the_results_of_all_pictures() {
    let (_dir, mut window) = window_on_flight();
    until(&mut window, "not processed", |v| v.processed() == 4);
    menu(&mut window, "Compare", "with preset dlr-2022");
    until(&mut window, "not compared", |v| v.results().other_len() == 4);
    assert_eq!(window.state().processed(), 4);
    let words = window.state().results().compare(0);
    assert_eq!((words.pictures, words.changed.len()), (4, words.better + words.worse));
}

#[test]
fn old_and_new_results_are_different_lines() {
    let (_dir, mut window) = window_on_flight();
    until(&mut window, "not processed", |v| v.processed() == 4);
    scale_to(&mut window, 1.5);
    let results = window.state().results();
    // The shown picture is new; the others still have their earlier results, and only these.
    assert!(results.current(0, 0).is_some() && results.earlier(1, 0).is_some());
    until(&mut window, "not processed again", |v| v.processed() == 4);
    assert!(window.state().results().current(1, 0).is_some());
    window.run_steps(2);
    assert!(window.query_all_by_label("before the change").next().is_some());
}

#[test]
fn a_plot_without_values_says_why() {
    let (_dir, mut window) = window_on_flight();
    window.get_by_label("Roll, pitch").click();
    window.run_steps(4);
    let why = "Roll and pitch need the mounting of the camera: set [mount] q_vehicle_from_camera_wxyz in sensor.toml.";
    assert!(window.query_by_label(why).is_some());
    assert!(window.query_by_label("Plot Roll, pitch").is_none());
}

#[test]
fn many_plots_keep_their_time_axis_within_the_window() {
    let (_dir, mut window) = window_on_flight();
    let names = ["Axis", "3 sigma", "RMS", "Points", "Half-angle", "Altitude", "Threshold", "Processing", "Residuals"];
    window.state_mut().settings_mut().plotted = names.map(str::to_owned).to_vec();
    window.run_steps(4);
    let screen = window.ctx.content_rect();
    let axis = window.get_by_label("Plot time axis").rect();
    assert!(screen.contains_rect(axis) && axis.width() > 300.0, "{axis:?}");
}

#[test]
fn a_folder_without_times_has_no_invented_seconds() {
    let (_dir, mut window) = window_on_flight();
    assert!(window.state().sequence().entries.iter().all(|e| e.time_s.is_none()));
    assert!(window.query_by_label("time unknown").is_some());
    window.run_steps(1);
}

/// Opens a flight after a change of its sensor.toml, and waits until all pictures are processed.
fn window_with(change: impl Fn(String) -> String) -> (tempfile::TempDir, Window) {
    let (dir, pictures) = folder();
    std::fs::write(pictures.join("sensor.toml"), change(SENSOR.to_owned())).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    (dir, window)
}

fn fits(window: &Window) -> Vec<diagnosis::FitFacts> {
    window.state().results().fits(0).copied().collect()
}

#[test]
fn a_wrong_focal_length_is_measured_and_applied() {
    let wrong = |text: String| {
        // The pictures show a limb at 10 km.
        let text = text.replace("altitude_km = 240.0", "altitude_km = 240.0\nlimb_height_km = 10.0");
        text.replace("fx_px = 260.0", "fx_px = 300.0").replace("fy_px = 260.0", "fy_px = 300.0")
    };
    let (_dir, mut window) = window_with(wrong);
    assert_ne!(answer(&window).0, Status::Ok);
    let all = fits(&window);
    assert!(all.len() >= 3, "every picture with a limb says something: {all:?}");
    let focal = diagnosis::summarise(all.iter()).into_iter().find(|c| c.suspect == Suspect::Focal).unwrap();
    assert!((300.0 * focal.value - 260.0).abs() < 3.0, "{focal:?}");
    window.get_by_label("Apply focal length").click();
    window.run_steps(2);
    until(&mut window, "no answer", |v| v.is_settled() && !v.is_working());
    assert_eq!(answer(&window).0, Status::Ok);
    let camera = window.state().session().unwrap().config().unwrap().camera.clone();
    assert!((camera.fx_px - 260.0).abs() < 3.0 && camera.fx_px == camera.fy_px);
}

#[test]
fn a_wrong_altitude_is_measured_and_applied() {
    let (_dir, mut window) = window_with(|text| text.replace("altitude_km = 240.0", "altitude_km = 420.0"));
    assert_ne!(answer(&window).0, Status::Ok);
    let all = fits(&window);
    let altitude = diagnosis::summarise(all.iter()).into_iter().find(|c| c.suspect == Suspect::Altitude).unwrap();
    assert!((420.0 + altitude.value - 240.0).abs() < 20.0, "{altitude:?}");
    let can = |name: &str| !window.get_by_label(name).accesskit_node().is_disabled();
    assert!(!can("Apply limb height") && can("Apply altitude"), "a limb of the Earth is nowhere near 190 km high");
    window.get_by_label("Apply altitude").click();
    window.run_steps(2);
    until(&mut window, "no answer", |v| v.is_settled() && !v.is_working());
    assert_eq!(answer(&window).0, Status::Ok);
}

#[test]
fn altitudes_of_frames_csv_that_are_too_high_are_named() {
    let (_dir, pictures) = folder();
    let mut table = "file,altitude_km\n".to_owned();
    let mut names: Vec<_> = std::fs::read_dir(&pictures).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    let pictures_only = names.iter().filter_map(|n| n.to_str()).filter(|n| n.ends_with(".png"));
    pictures_only.for_each(|name| table += &format!("{name},420.0\n"));
    std::fs::write(pictures.join("frames.csv"), table).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    assert_ne!(answer(&window).0, Status::Ok);
    assert!(window.get_by_label("Apply limb height").accesskit_node().is_disabled());
    // The field of the altitude would change nothing, and says so.
    window.get_by_label("Body").click();
    window.run_steps(3);
    let why = "The pictures have altitudes of their own (frames.csv), which are used instead.";
    assert!(window.query_by_label(why).is_some());
    // The altitudes are shifted on trial; no file changes.
    let table = std::fs::read_to_string(pictures.join("frames.csv")).unwrap();
    window.get_by_label("Try altitude").click_accesskit();
    window.run_steps(2);
    until(&mut window, "no answer", |v| v.is_settled() && !v.is_working() && v.processed() == 4);
    window.run_steps(2);
    assert_eq!(answer(&window).0, Status::Ok);
    let shift_km = window.state().sequence().altitude_shift_km;
    assert!((shift_km + 180.0).abs() < 20.0, "{shift_km}");
    assert!(!window.state().session().unwrap().is_changed());
    window.get_by_label("End the trial").click_accesskit();
    window.run_steps(2);
    until(&mut window, "not processed again", |v| v.is_settled() && !v.is_working());
    assert_ne!(answer(&window).0, Status::Ok);
    assert_eq!(window.state().sequence().altitude_shift_km, 0.0);
    assert_eq!(std::fs::read_to_string(pictures.join("frames.csv")).unwrap(), table);
}

#[test]
fn the_column_of_stages_keeps_its_width() {
    let (_dir, mut window) = window_on_flight();
    window.get_by_label("Body").click();
    window.run_steps(5);
    let before = window.state_mut().settings_mut().stages_width;
    // This changes no text that is wider than the column.
    window.get_by_role_and_label(egui::Role::Slider, "limb_height_sigma_km").set_value_accesskit(2.125);
    settled(&mut window);
    window.run_steps(40);
    assert!(window.query_by_label("file").is_some(), "the value can be restored");
    let after = window.state_mut().settings_mut().stages_width;
    assert!(after <= before + 1.0, "{before} {after}");
}

#[test]
fn a_threshold_that_is_too_high_is_named_and_cured() {
    let high = |text: String| text.replace("scale = 1.0     # times", "method = \"fixed\"\nlevel = 202.0  # times");
    let (_dir, mut window) = window_with(high);
    assert_ne!(answer(&window).0, Status::Ok);
    let cause = window.state().results().cause(0, 0).unwrap();
    assert_eq!(cause.reason, Some(Reason::Level));
    window.get_by_label("Use Otsu's threshold").click();
    window.run_steps(2);
    until(&mut window, "no answer", |v| v.is_settled() && !v.is_working());
    assert_eq!(answer(&window).0, Status::Ok);
    assert!(window.query_by_label("3 ok").is_some(), "the summary counts all pictures");
}

#[test]
fn the_fit_of_a_refused_candidate_is_drawn_with_the_expected_limb() {
    let wrong = |text: String| text.replace("altitude_km = 240.0", "altitude_km = 420.0");
    let (_dir, window) = window_with(wrong);
    let body = &frame_view(&window).answers[0].bodies[0];
    assert!(body.limb.is_empty() && !body.candidate_limbs.is_empty() && !body.expected_limb.is_empty());
    let fit = body.fit.unwrap();
    assert!(fit.sigmas.abs() > 3.0 && fit.fitted_deg > fit.expected_deg, "{fit:?}");
}

#[test]
fn the_summary_filters_what_next_refused_visits() {
    let (_dir, mut window) = window_on_flight();
    until(&mut window, "not processed", |v| v.processed() == 4);
    window.run_steps(3);
    window.get_by_label("1 no-limb").click();
    window.run_steps(3);
    window.key_press(Key::N);
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 3);
    window.get_by_label("Show all").click();
    window.run_steps(3);
    assert!(window.query_by_label("Show all").is_none());
}

#[test]
fn messages_lie_over_the_panels_and_move_nothing() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    let place = |w: &Window| w.get_by_label(&format!("Picture {}", frame_view(w).name)).rect();
    let before = place(&window);
    let bad = dir.path().join("bad.mcap");
    std::fs::write(&bad, b"no recording").unwrap();
    open(&mut window, &bad);
    said(&mut window, "is not an MCAP file");
    assert_eq!(place(&window), before);
    window.get_by_label("Close").click();
    window.run_steps(3);
    assert_eq!(window.state().messages().count(), 0);
}

#[test]
fn a_picture_of_another_size_has_a_badge_and_a_cure() {
    let half = |text: String| {
        let text = text.replace("width = 320", "width = 640").replace("height = 240", "height = 480");
        let text = text.replace("fx_px = 260.0", "fx_px = 520.0").replace("fy_px = 260.0", "fy_px = 520.0");
        text.replace("cx_px = 159.5", "cx_px = 319.5").replace("cy_px = 119.5", "cy_px = 239.5")
    };
    let (dir, pictures) = folder();
    std::fs::write(pictures.join("sensor.toml"), half(SENSOR.to_owned())).unwrap();
    let mut window = window_on(&pictures);
    assert!(window.query_by_label("wrong size").is_some());
    window.get_by_label("Scale the camera to 320 × 240").click();
    settled(&mut window);
    window.run_steps(3);
    assert_eq!(answer(&window).0, Status::Ok);
    drop(dir);
}

#[test]
fn an_invalid_sensor_file_has_a_badge_and_a_cure() {
    let (_dir, pictures) = folder();
    std::fs::write(pictures.join("sensor.toml"), SENSOR.replace("scale = 1.0", "scale = 99.0")).unwrap();
    let mut window = window();
    open(&mut window, &pictures);
    until(&mut window, "not shown", |v| v.frame_view().is_some());
    assert!(window.query_by_label("invalid sensor.toml").is_some());
    window.get_by_label("Remove threshold.scale").click();
    settled(&mut window);
    assert_eq!(answer(&window).0, Status::Ok);
}

#[test]
fn the_picture_keeps_most_of_a_small_window() {
    for (width, height, least) in [(720.0, 480.0, [500.0, 300.0]), (800.0, 600.0, [550.0, 240.0])] {
        let (_dir, pictures) = folder();
        let mut window = sized_window(width, height);
        open(&mut window, &pictures);
        settled(&mut window);
        let rect = window.get_by_label("Picture 0.png").rect();
        assert!(rect.width() >= least[0] && rect.height() >= least[1], "{width}×{height}: {rect:?}");
        window.key_press(Key::S);
        window.run_steps(4);
        assert!(window.query_by_label("preset").is_some(), "the stages open over the picture");
        assert_eq!(window.get_by_label("Picture 0.png").rect(), rect);
        window.key_press(Key::S);
        window.run_steps(4);
        // A picture without an answer has a link to its diagnosis, which opens them, too.
        window.state_mut().go(3);
        settled(&mut window);
        window.get_by_label("Why, and what to do").click_accesskit();
        window.run_steps(6);
        assert!(window.query_by_label("Diagnosis").is_some(), "{width}×{height}");
    }
}

#[test]
fn a_crashed_window_gives_its_changes_back() {
    let (dir, pictures) = folder();
    let store = dir.path().join("config").join("viewer.json");
    let unsaved = || hzn_viewer::model::Autosave::find_lost(store.parent().unwrap());
    let mut window = stored_window(&store);
    open(&mut window, &pictures);
    settled(&mut window);
    scale_to(&mut window, 1.5);
    let own = store.with_file_name(format!("unsaved-{}.json", std::process::id()));
    until(&mut window, "not autosaved", |_| own.exists());
    // The window crashes. No process has this number.
    std::fs::rename(&own, store.with_file_name("unsaved-4294967295.json")).unwrap();
    drop(window);
    let mut later = stored_window(&store);
    later.run_steps(3);
    later.get_by_label("Later").click();
    later.run_steps(3);
    assert!(later.query_by_label("Later").is_none() && unsaved().is_some());
    drop(later);
    // Other pictures are open when the changes come back: their own pictures are opened.
    let (_other_dir, other) = folder();
    let mut again = stored_window(&store);
    // The command line opens them, because keys do nothing behind the question.
    again.state_mut().open(Request { inputs: vec![other], ..Request::default() });
    settled(&mut again);
    again.get_by_label("Restore changes").click();
    until(&mut again, "not restored", |v: &Viewer| v.session().is_some_and(|s| s.is_changed()) && v.is_settled());
    assert_eq!(again.state().sequence().inputs, [std::path::absolute(&pictures).unwrap()]);
    assert!(again.state().session().unwrap().sheet().text().contains("scale = 1.5"));
    assert!(unsaved().is_none());
    assert!(Path::new(&pictures).exists());
}

#[test]
fn a_damaged_recording_says_so() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    let recording = dir.path().join("run.mcap");
    run_into(&mut window, &recording);
    let mut bytes = std::fs::read(&recording).unwrap();
    // The data of the second PNG are changed.
    let starts: Vec<usize> =
        bytes.windows(8).enumerate().filter(|(_, w)| *w == b"\x89PNG\r\n\x1a\n").map(|(i, _)| i).collect();
    assert_eq!(starts.len(), 4);
    bytes[starts[1] + 60..starts[1] + 90].fill(0x55);
    let damaged = dir.path().join("damaged.mcap");
    std::fs::write(&damaged, bytes).unwrap();
    open(&mut window, &damaged);
    said(&mut window, "The recording is damaged");
}

#[test]
fn a_folder_without_a_sensor_gets_one_from_the_form() {
    let (_dir, pictures) = folder();
    std::fs::remove_file(pictures.join("sensor.toml")).unwrap();
    let mut window = window();
    open(&mut window, &pictures);
    until(&mut window, "not shown", |v| v.frame_view().is_some());
    window.run_steps(3);
    window.get_by_label("Make a sensor.toml…").click();
    window.run_steps(4);
    // 63.2° over 320 px are a focal length of 260 px.
    window.get_by_label("field of view over the width").set_value_accesskit(63.2);
    window.get_by_label("altitude above the ground").set_value_accesskit(240.0);
    window.run_steps(3);
    window.get_by_label("Make sensor.toml").click();
    settled(&mut window);
    let session = window.state().session().unwrap();
    assert!(session.is_changed() && session.path().is_none(), "it is not saved yet");
    assert_eq!(answer(&window).0, Status::Ok);
}

#[test]
fn an_empty_window_offers_the_first_steps() {
    let window = window();
    for label in ["Open file…", "Open folder…", "Open the demo flight"] {
        assert!(window.query_by_label(label).is_some(), "{label}");
    }
}
