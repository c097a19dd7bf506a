//! Tests of small things that a new user stumbled over: numbers with a comma, what is worst, what is kept, and what
//! lies over what.

use std::fmt::Write as _;
use std::path::Path;

use egui::{Key, Modifiers, Role};
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;
use hzn_viewer::ui::Command;

use crate::window::*;

fn shows(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

#[test]
fn a_decimal_comma_is_read_and_other_texts_are_named() {
    let (_dir, mut window) = window_on_flight();
    window.get_by_label("Rays").click_accesskit();
    window.run_steps(30);
    let number = |w: &Window| w.state().session().unwrap().number("camera", "cx_px", 0).unwrap();
    type_number(&mut window, "cx_px", "158,25");
    assert_eq!(number(&window), 158.25);
    type_number(&mut window, "cx_px", "1.158,5");
    assert_eq!(number(&window), 158.25);
    assert!(window.state().messages().any(|m| m == "“1.158,5” is no number, so the value stays as it was."));
    // The form for a first sensor.toml has the same fields.
    type_number(&mut window, "gamma", "1,5");
    assert_eq!(window.state_mut().settings_mut().gamma, 1.5);
}

/// Writes the true axes of a flight; that of picture `wrong` is `by_deg` away.
fn write_truth(folder: &Path, wrong: usize, by_deg: f64) {
    let mut text = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,qw,qx,qy,qz\n".to_owned();
    for frame in 0..4 {
        let (pitch, roll) = (1.15 + 0.03 * f64::from(frame), 0.1 * f64::from(frame));
        let pitch = pitch + if frame as usize == wrong { by_deg.to_radians() } else { 0.0 };
        let [x, y, z] = [pitch.sin() * roll.sin(), pitch.sin() * roll.cos(), pitch.cos()];
        writeln!(text, "{frame}.png,{frame},earth-sphere,1,{x},{y},{z},74.8,240,1,0,0,0").unwrap();
    }
    std::fs::write(folder.join("truth.csv"), text).unwrap();
}

#[test]
fn the_worst_answer_is_marked_and_no_refused_picture_is_worst() {
    let (_dir, pictures) = folder();
    write_truth(&pictures, 1, 8.0);
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    assert_eq!(answer(&window).0, Status::Ok);
    assert!(!shows(&window, "the truth lies outside of 3σ"));
    window.key_press(Key::W);
    settled(&mut window);
    window.run_steps(2);
    assert_eq!((frame_view(&window).index, answer(&window).0), (1, Status::Ok));
    assert!(shows(&window, "the truth lies outside of 3σ"));
    for _ in 0..4 {
        window.key_press(Key::W);
        settled(&mut window);
        assert_eq!(answer(&window).0, Status::Ok, "the dark picture has no answer that could be bad");
    }
}

#[test]
fn an_answer_with_large_residuals_is_marked() {
    let (_dir, pictures) = folder();
    // Every other column of one picture lies a pixel lower.
    let even = image::open(pictures.join("1.png")).unwrap().into_luma8();
    let jagged = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
        *even.get_pixel(x, y.saturating_sub(if x / 8 % 2 == 0 { 1 } else { 0 }))
    });
    jagged.save(pictures.join("1.png")).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    let words = "that are usual in these pictures";
    assert!(!shows(&window, words));
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    window.run_steps(2);
    assert_eq!(answer(&window).0, Status::Ok);
    assert!(shows(&window, words), "{:?}", frame_view(&window).answers[0].bodies[0].row.rms_px);
    // The noise that sensor.toml tells counts more than the other pictures.
    let told = SENSOR.to_owned() + "\n[covariance]\nsigma_px = 0.6\n";
    window.state_mut().session_mut().unwrap().set_text(&told);
    settled(&mut window);
    window.run_steps(3);
    assert_eq!(answer(&window).0, Status::Ok);
    assert!(!shows(&window, words) && !shows(&window, "that sensor.toml tells"));
    let told = told.replace("sigma_px = 0.6", "sigma_px = 0.05");
    window.state_mut().session_mut().unwrap().set_text(&told);
    settled(&mut window);
    window.run_steps(3);
    assert!(shows(&window, "that sensor.toml tells"));
}

#[test]
fn settings_are_kept_when_the_window_is_killed() {
    let (dir, pictures) = folder();
    let store = dir.path().join("config").join("viewer.json");
    let mut window = stored_window(&store);
    open(&mut window, &pictures);
    settled(&mut window);
    window.key_press(Key::P);
    until(&mut window, "not stored", |_| std::fs::read_to_string(&store).is_ok_and(|t| t.contains("\"plots\": false")));
    let text = std::fs::read_to_string(&store).unwrap();
    assert!(text.contains(&pictures.display().to_string()), "{text}");
}

#[test]
fn only_the_longest_candidates_are_drawn() {
    let (_dir, pictures) = folder();
    let discs = image::GrayImage::from_fn(WIDTH.into(), HEIGHT.into(), |x, y| {
        let (dx, dy) = (f64::from(x % 80) - 40.0, f64::from(y % 80) - 40.0);
        let radius = 20.0 + f64::from(x / 80) * 4.0;
        image::Luma([(8.0 + 190.0 / (1.0 + ((dx.hypot(dy) - radius) / 0.6).exp())) as u8])
    });
    discs.save(pictures.join("0.png")).unwrap();
    let window = window_on(&pictures);
    let body = &frame_view(&window).answers[0].bodies[0];
    assert_ne!(body.row.status, Status::Ok);
    let drawn = body.longest_candidates();
    assert!(body.candidate_limbs.len() > 3, "{}", body.candidate_limbs.len());
    let length = |c: u32| body.edges.iter().find(|e| e.candidate == c).unwrap().outcome.unwrap().length_px;
    let most = body.candidate_limbs.iter().map(|(c, _)| length(*c)).max().unwrap();
    assert!(drawn.len() == 3 && length(drawn[0]) == most && length(drawn[0]) >= length(drawn[2]));
}

#[test]
fn a_window_of_1024_points_shows_the_diagnosis_at_once() {
    let (_dir, pictures) = folder();
    std::fs::write(pictures.join("sensor.toml"), SENSOR.replace("fx_px = 260.0", "fx_px = 330.0")).unwrap();
    let mut window = sized_window(1024.0, 768.0);
    open(&mut window, &pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    assert_ne!(answer(&window).0, Status::Ok);
    assert!(window.query_by_label("Diagnosis").is_some());
    let picture = window.get_by_label("Picture 0.png").rect();
    assert!(picture.width() > 350.0, "{picture:?}");
}

#[test]
fn other_pictures_are_shown_from_the_top() {
    let (_dir, pictures) = folder();
    let (_other_dir, other) = folder();
    let mut window = window_on(&pictures);
    let top = |w: &Window| w.get_by_label("Body").rect().top();
    let before = top(&window);
    let at = window.get_by_label("Body").rect().center();
    window.event(egui::Event::PointerMoved(at));
    window.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: egui::vec2(0.0, -300.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    window.run_steps(40);
    assert!(top(&window) < before - 50.0, "the column is scrolled");
    open(&mut window, &other);
    until(&mut window, "not opened", |v| v.sequence().inputs == [other.clone()] && v.is_settled());
    window.run_steps(10);
    assert_eq!(top(&window), before);
}

/// Gives the pictures of a flight times in seconds.
fn with_times(pictures: &Path, times_s: [f64; 4]) {
    let mut text = "file,time_s\n".to_owned();
    (0..4).zip(times_s).for_each(|(i, t)| writeln!(text, "{i}.png,{t}").unwrap());
    std::fs::write(pictures.join("frames.csv"), text).unwrap();
}

#[test]
fn a_slow_recording_plays_at_two_pictures_a_second_or_more() {
    let (_dir, pictures) = folder();
    with_times(&pictures, [0.0, 16.0, 32.0, 48.0]);
    let window = window_on(&pictures);
    assert_eq!(window.state().speed(), 100.0);
    with_times(&pictures, [0.0, 0.1, 0.2, 0.3]);
    assert_eq!(window_on(&pictures).state().speed(), 1.0);
}

#[test]
fn the_time_line_and_the_plots_have_one_axis() {
    let (_dir, pictures) = folder();
    with_times(&pictures, [0.0, 1.0, 2.0, 30.0]);
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4);
    window.run_steps(3);
    let (band, plot) = (window.get_by_label("Time line").rect(), window.get_by_label("Plot RMS").rect());
    // The labels of the axis are left of the plot. The picture at 2 s reaches to 16 s.
    let left = plot.right() - (plot.right() - band.left() - 60.0);
    let at = egui::pos2(left + 0.4 * (plot.right() - left), band.center().y);
    for pressed in [true, false] {
        window.event(egui::Event::PointerMoved(at));
        let (pos, button, modifiers) = (at, egui::PointerButton::Primary, Modifiers::NONE);
        window.event(egui::Event::PointerButton { pos, button, pressed, modifiers });
        window.run_steps(2);
    }
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 2);
    // The tooltip of a plot has the values of the picture, not those of the pointer.
    window.event(egui::Event::PointerMoved(egui::pos2(at.x, plot.center().y)));
    window.run_steps(60);
    assert!(shows(&window, "picture 3, 2.000 s"));
}

#[test]
fn plots_of_positive_values_have_a_logarithmic_scale() {
    let (_dir, pictures) = folder();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    window.state_mut().settings_mut().plotted = vec!["3 sigma".to_owned()];
    window.run_steps(3);
    assert!(shows(&window, "3 sigma [°]") && !shows(&window, ", log"));
    for is_log in [true, false] {
        window.get_by_label("log").click();
        window.run_steps(3);
        assert_eq!(shows(&window, "3 sigma [°], log"), is_log);
    }
}

#[test]
fn a_comparison_names_its_keys_and_ends_with_its_pictures() {
    let (dir, pictures) = folder();
    std::fs::write(pictures.join("sensor.toml"), SENSOR.replace("altitude_km = 240.0", "altitude_km = 900.0")).unwrap();
    let file = dir.path().join("other.toml");
    let text = SENSOR.replace("altitude_km = 240.0", "altitude_km = 910.0");
    std::fs::write(&file, text.replace("scale = 1.0", "scale = 1.1")).unwrap();
    let mut window = window_on(&pictures);
    menu(&mut window, "Compare", "with another sensor.toml…");
    path(&mut window, &file, "Open this");
    until(&mut window, "not compared", |v| v.results().other_len() == 4 && v.processed() == 4);
    window.run_steps(3);
    assert!(shows(&window, "no picture is answered by both") && !shows(&window, "0.0000°"));
    window.get_by_label_contains("2 keys differ").click();
    window.run_steps(20);
    assert!(shows(&window, "body.altitude_km: 900.0 → 910.0") && shows(&window, "threshold.scale: 1.0 → 1.1"));
    let (_other_dir, other) = folder();
    open(&mut window, &other);
    until(&mut window, "not opened", |v| v.sequence().inputs == [other.clone()] && v.is_settled());
    window.run_steps(2);
    assert!(!shows(&window, "Compared with"));
}

#[test]
fn the_help_has_two_columns_that_begin_together_and_says_the_version() {
    let (_dir, mut window) = window_on_flight();
    window.key_press(Key::F1);
    window.run_steps(4);
    let rect = |key: &str| window.get_by_label(key).rect();
    let (left, right) = (rect("Ctrl+O"), rect(second_column(&window)));
    assert!(right.left() > left.right() + 100.0, "{left} {right}");
    assert!(shows(&window, "About: hzn viewer"));
    // The key of the help closes it, and no other key acts behind it.
    window.key_press(Key::S);
    window.run_steps(3);
    assert!(window.query_by_label("preset").is_some());
    window.key_press(Key::F1);
    window.run_steps(3);
    assert!(!shows(&window, "Keys and mouse"));
}

/// Returns the label of the key that begins the second column of the help.
fn second_column(window: &Window) -> &'static str {
    let keys = ["+", "Plus", "0", "1", "-", "Minus", "C", "Period", ".", ","];
    let left = window.get_by_label("Ctrl+O").rect();
    let begins = |key: &&str| window.query_by_label(key).is_some_and(|k| k.rect().top() == left.top());
    keys.into_iter().find(begins).expect("no key lies beside the first one")
}

#[test]
fn windows_open_over_the_picture_and_the_key_esc_closes_them() {
    let (_dir, mut window) = window_on_flight();
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    window.key_press_modifiers(Modifiers::COMMAND, Key::D);
    window.run_steps(6);
    let picture = window.get_by_label("Picture 0.png").rect();
    let title = window.get_by_role_and_label(Role::Window, "Unsaved changes").rect();
    assert!(picture.contains(title.left_top()), "{title:?} {picture:?}");
    window.key_press(Key::Escape);
    window.run_steps(6);
    assert!(window.query_by_role_and_label(Role::Window, "Unsaved changes").is_none());
}

#[test]
fn menus_open_by_key_and_pictures_are_read_again() {
    let (_dir, pictures) = folder();
    let mut window = window_on(&pictures);
    window.key_press_modifiers(Modifiers::ALT, Key::F);
    window.run_steps(4);
    assert!(shows(&window, "Reload the pictures"));
    window.key_press(Key::Escape);
    window.run_steps(4);
    assert!(!shows(&window, "Reload the pictures"));
    window.state_mut().go(2);
    settled(&mut window);
    std::fs::copy(pictures.join("0.png"), pictures.join("4.png")).unwrap();
    window.key_press(Key::F5);
    until(&mut window, "not read again", |v| v.sequence().len() == 5 && v.is_settled());
    assert_eq!(frame_view(&window).index, 2);
}

#[test]
fn a_sensor_that_was_made_here_does_not_come_from_a_recording() {
    let (_dir, pictures) = folder();
    std::fs::remove_file(pictures.join("sensor.toml")).unwrap();
    let mut window = window();
    open(&mut window, &pictures);
    until(&mut window, "not shown", |v| v.frame_view().is_some());
    window.run_steps(3);
    window.get_by_label("Make a sensor.toml…").click();
    window.run_steps(4);
    type_number(&mut window, "field of view over the width", "63,2");
    window.get_by_label("Make sensor.toml").click();
    settled(&mut window);
    let focal = window.state().session().unwrap().number("camera", "fx_px", 0).unwrap();
    assert!((focal - 260.0).abs() < 0.5, "{focal}");
    assert!(shows(&window, "unsaved: new sensor.toml") && !shows(&window, "sensor of the recording"));
}

#[test]
fn keys_do_nothing_behind_a_question() {
    let (_dir, pictures) = folder();
    let (_other_dir, other) = folder();
    let mut window = window_on(&pictures);
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    open(&mut window, &other);
    window.run_steps(3);
    assert!(shows(&window, "Unsaved changes"));
    for key in [Key::S, Key::ArrowRight, Key::D] {
        window.key_press(key);
    }
    window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    window.run_steps(4);
    assert!(window.state().session().unwrap().is_changed() && window.query_by_label("preset").is_some());
    assert_eq!(frame_view(&window).index, 0);
    assert_eq!(std::fs::read_to_string(pictures.join("sensor.toml")).unwrap(), SENSOR);
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert_eq!(frame_view(&window).index, 1);
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_to_a_sensor_is_followed() {
    let (dir, pictures) = folder();
    let (link, file) = (pictures.join("sensor.toml"), dir.path().join("shared.toml"));
    std::fs::rename(&link, &file).unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    let mut window = window_on(&pictures);
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    let ctx = window.ctx.clone();
    window.state_mut().run(Command::Save, &ctx);
    window.run_steps(3);
    // The link leads out of the folder, so the window asks once.
    assert!(window.query_by_label("Save into the folder…").is_none(), "it is the same file");
    window.get_by_label("Save there").click();
    window.run_steps(3);
    assert!(link.is_symlink());
    assert!(std::fs::read_to_string(&file).unwrap().contains("scale = 1.5 "));
}
