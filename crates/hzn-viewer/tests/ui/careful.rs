//! Tests of the window's words and of its memory. It has the same words everywhere, and loses no work of a user.

use std::path::{Path, PathBuf};
use std::time::Instant;

use egui::{Key, Modifiers, Role};
use egui_kittest::kittest::Queryable;

use crate::window::*;

const CTRL: Modifiers = Modifiers::COMMAND;

fn shows(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

#[test]
fn a_window_that_is_killed_after_an_edit_gives_it_back() {
    let (dir, pictures) = folder();
    let store = dir.path().join("config").join("viewer.json");
    let mut window = stored_window(&store);
    open(&mut window, &pictures);
    settled(&mut window);
    let own = store.with_file_name(format!("unsaved-{}.json", std::process::id()));
    let text = || std::fs::read_to_string(&own).unwrap_or_default();
    let slide = |window: &mut Window, scale: f64| {
        window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(scale);
        window.run_steps(2);
    };
    slide(&mut window, 1.5);
    assert!(text().contains("scale = 1.5"), "the first change is written at once");
    // A slider that moves all the time does not put the writing off.
    let begin = Instant::now();
    let mut scale = 1.5;
    while begin.elapsed().as_secs_f64() < 0.6 {
        scale += 0.001;
        slide(&mut window, scale);
    }
    assert!(!text().contains("scale = 1.5 "), "{}", text());
    // The last change follows as soon as the file may be written again.
    slide(&mut window, 1.9);
    until(&mut window, "not autosaved", |_| text().contains("scale = 1.9"));
}

/// Writes the pictures of a flight with 12 bits in words of 16 bits.
fn with_12_bits(pictures: &Path) {
    for frame in 0..3 {
        let path = pictures.join(format!("{frame}.png"));
        let grey = image::open(&path).unwrap().to_luma8();
        let words = image::ImageBuffer::<image::Luma<u16>, _>::from_fn(grey.width(), grey.height(), |x, y| {
            image::Luma([16 * u16::from(grey.get_pixel(x, y).0[0])])
        });
        words.save(&path).unwrap();
    }
    std::fs::remove_file(pictures.join("3.png")).unwrap();
}

#[test]
fn what_is_saved_is_what_is_shown_as_the_difference() {
    let (_dir, pictures) = folder();
    with_12_bits(&pictures);
    let mut window = window_on(&pictures);
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    window.key_press_modifiers(CTRL, Key::D);
    window.run_steps(3);
    assert!(shows(&window, "+bits = 12") && shows(&window, "+scale = 1.5"));
    assert!(shows(&window, "The number of bits was found in the pictures"));
    let shown: Vec<String> =
        window.state().session().unwrap().unsaved_lines().into_iter().flat_map(|(_, lines)| lines).collect();
    window.key_press_modifiers(CTRL, Key::S);
    said(&mut window, "Saved");
    let saved = std::fs::read_to_string(pictures.join("sensor.toml")).unwrap();
    let added = saved.lines().filter(|line| SENSOR.lines().all(|old| old != *line)).map(|line| format!("+{line}"));
    assert_eq!(
        added.collect::<Vec<_>>(),
        shown.iter().filter(|l| l.len() > 1 && l.starts_with('+')).cloned().collect::<Vec<_>>()
    );
    window.run_steps(3);
    assert!(shows(&window, "Nothing has changed."));
}

#[test]
fn each_cause_of_an_unreadable_picture_has_its_word() {
    let (_dir, pictures) = folder();
    image::GrayImage::new(64, 48).save(pictures.join("1.png")).unwrap();
    let whole = std::fs::read(pictures.join("2.png")).unwrap();
    std::fs::write(pictures.join("2.png"), &whole[..whole.len() / 2]).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    window.run_steps(3);
    for words in ["2 unreadable:", "1 wrong size", "1 broken file"] {
        assert!(window.query_by_label(words).is_some(), "{words}");
    }
    // The sentence is that of `hzn run`, and only a wrong size can be mended by another camera.
    window.state_mut().go(1);
    settled(&mut window);
    window.run_steps(3);
    assert!(shows(&window, "picture is 64x48 but the camera is 320x240") && shows(&window, "Scale the camera to"));
}

#[test]
fn a_picture_without_the_channel_is_not_called_a_wrong_size() {
    let (_dir, pictures) = folder();
    // The second channel of this picture is its transparency.
    image::GrayAlphaImage::new(WIDTH.into(), HEIGHT.into()).save(pictures.join("0.png")).unwrap();
    std::fs::write(pictures.join("sensor.toml"), format!("{SENSOR}\n[input]\nchannel = \"green\"\n")).unwrap();
    let mut window = window_on(&pictures);
    window.run_steps(3);
    assert!(window.query_by_label("wrong channel").is_some() && window.query_by_label("wrong size").is_none());
    assert!(!shows(&window, "Scale the camera to"));
}

#[test]
fn the_player_and_the_plots_tell_the_same_time() {
    let (_dir, pictures) = folder();
    let table: String = (0..4).map(|i| format!("{i}.png,{}\n", 72.5 + 10.0 * f64::from(i))).collect();
    std::fs::write(pictures.join("frames.csv"), format!("file,time_s\n{table}")).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4);
    window.run_steps(3);
    assert!(window.query_by_label("72.500 s").is_some());
    let plot = window.get_by_label("Plot 3 sigma").rect();
    // The axis has a margin of a hundredth at each end.
    let x = plot.left() + plot.width() * (0.01 + 2.0 / 3.0 * 0.98);
    window.hover_at(egui::pos2(x, plot.center().y));
    window.run_steps(60);
    assert!(shows(&window, "picture 3, 92.500 s (20.000 s since the first picture)"), "{:?}", painted(&window));
}

#[test]
fn the_dialog_says_how_large_the_saved_picture_is() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    window.key_press_modifiers(CTRL, Key::E);
    window.run_steps(3);
    let png = dir.path().join("shown.png");
    path(&mut window, &png, "Write");
    said(&mut window, "Written");
    let saved = image::open(&png).unwrap();
    window.key_press_modifiers(CTRL, Key::E);
    window.run_steps(3);
    let [w, h] = [saved.width(), saved.height()];
    assert!(shows(&window, &format!("The file has {w} × {h} px; its upper 320 × 240 px are those of the picture.")));
}

#[test]
fn the_form_takes_size_and_exif_of_one_picture() {
    let dir = tempfile::tempdir().unwrap();
    let pictures: PathBuf = dir.path().join("pictures");
    std::fs::create_dir(&pictures).unwrap();
    // A small picture with the EXIF of a camera.
    let full = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/real/full/iss-limb-2020-11-20.jpg");
    let taken = std::fs::read(full).unwrap();
    let exif = taken.windows(4).position(|w| w == *b"Exif").unwrap() - 4;
    let length = 2 + usize::from(u16::from_be_bytes([taken[exif + 2], taken[exif + 3]]));
    let mut small = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(160, 120).write_to(&mut small, image::ImageFormat::Jpeg).unwrap();
    let small = small.into_inner();
    std::fs::write(pictures.join("a.jpg"), [&small[..2], &taken[exif..exif + length], &small[2..]].concat()).unwrap();
    // This picture takes longer to decode than the click that follows.
    image::RgbImage::from_fn(2000, 2000, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]))
        .save(pictures.join("b.png"))
        .unwrap();
    let mut window = window();
    open(&mut window, &pictures);
    until(&mut window, "not shown", |v| v.frame_view().is_some() && v.sequence().complete);
    window.state_mut().go(1);
    window.get_by_label("Make a sensor.toml…").click_accesskit();
    window.run_steps(2);
    assert_eq!(frame_view(&window).index, 0, "the other picture is still shown");
    until(&mut window, "no form", |v| v.frame_view().is_some_and(|f| f.index == 1));
    window.run_steps(3);
    assert!(window.query_by_label("2000 × 2000 px").is_some(), "{:?}", painted(&window));
}

/// Adds a covariance to a sensor: the focal length is a guess with this sigma.
fn with_guessed_lens(sensor: &str, part: f64) -> String {
    let variance = (part * 260.0f64).powi(2);
    let rows = format!("[[{variance:.3}, {variance:.3}], [{variance:.3}, {variance:.3}]]");
    let covariance = format!("[camera.covariance]\norder = [\"fx_px\", \"fy_px\"]\nrows = {rows}\n");
    sensor.replace("[body]", &format!("{covariance}\n[body]"))
}

#[test]
fn a_guessed_focal_length_is_doubted_before_an_altitude_that_was_given() {
    let rows = |part: Option<f64>| {
        let (_dir, pictures) = folder();
        for name in ["1.png", "2.png", "3.png"] {
            std::fs::remove_file(pictures.join(name)).unwrap();
        }
        let sensor = SENSOR.replace("altitude_km = 240.0", "altitude_km = 900.0");
        let sensor = part.map_or(sensor.clone(), |part| with_guessed_lens(&sensor, part));
        std::fs::write(pictures.join("sensor.toml"), sensor).unwrap();
        let mut window = window_on(&pictures);
        until(&mut window, "not processed", |v| v.processed() == 1 && !v.is_working());
        window.run_steps(5);
        let row = |name: &str| place_of(&window, |text| text == name).top();
        let order = row("focal length") < row("altitude");
        // One picture has no scatter, and its sigma is not zero for that.
        assert!(painted(&window).iter().all(|(text, _)| !text.contains("± 0.0 ")), "{:?}", painted(&window));
        (order, shows(&window, "Correct the focal length first: it is a guess with a sigma of 6.3 %."))
    };
    assert_eq!(rows(Some(0.063)), (true, true));
    assert_eq!(rows(Some(0.002)), (false, false), "a calibrated lens is as good as the altitude");
    assert_eq!(rows(None), (false, false));
}

#[test]
fn a_picture_without_an_edge_has_its_own_advice() {
    let (_dir, pictures) = folder();
    std::fs::write(pictures.join("sensor.toml"), SENSOR.replace("altitude_km = 240.0", "altitude_km = 420.0")).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    window.run_steps(5);
    assert!(window.query_by_label("Apply altitude").is_some());
    // The last picture is dark: another altitude would not help it.
    window.state_mut().go(3);
    settled(&mut window);
    window.run_steps(5);
    assert!(window.query_by_label("Apply altitude").is_none());
}

#[test]
fn a_trial_that_goes_on_is_the_first_thing_to_end() {
    let (_dir, pictures) = folder();
    let table: String = (0..4).map(|i| format!("{i}.png,420.0\n")).collect();
    std::fs::write(pictures.join("frames.csv"), format!("file,altitude_km\n{table}")).unwrap();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4 && !v.is_working());
    window.run_steps(3);
    assert!(!shows(&window, "1. End the trial"));
    window.get_by_label("Try altitude").click_accesskit();
    window.run_steps(2);
    until(&mut window, "not processed again", |v| v.is_settled() && !v.is_working() && v.processed() == 4);
    window.state_mut().go(3);
    settled(&mut window);
    window.run_steps(3);
    assert!(shows(&window, "1. End the trial: all altitudes are shifted by -"), "{:?}", painted(&window));
    assert!(shows(&window, "2. "));
}

/// Returns the texts that the border of their panel cuts at the left or at the right.
fn cut_texts(window: &Window) -> Vec<String> {
    fn collect(shape: &egui::epaint::Shape, clip: egui::Rect, out: &mut Vec<String>) {
        match shape {
            egui::epaint::Shape::Vec(all) => all.iter().for_each(|one| collect(one, clip, out)),
            egui::epaint::Shape::Text(text) => {
                let rect = text.visual_bounding_rect();
                let is_cut = rect.left() < clip.left() - 1.0 || rect.right() > clip.right() + 1.0;
                if clip.intersects(rect) && is_cut && rect.is_positive() {
                    out.push(format!("{} at {rect:?} in {clip:?}", text.galley.text()));
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

#[test]
fn no_text_is_cut_by_the_border_of_its_panel() {
    let (_dir, pictures) = folder();
    let table: String = (0..4).map(|i| format!("{i}.png,{}\n", 72.5 + 10.0 * f64::from(i))).collect();
    std::fs::write(pictures.join("frames.csv"), format!("file,time_s\n{table}")).unwrap();
    let mut cut = Vec::new();
    for (width, height) in [(1440.0, 900.0), (1024.0, 768.0)] {
        let mut window = sized_window(width, height);
        open(&mut window, &pictures);
        until(&mut window, "not processed", |v| v.processed() == 4 && v.is_settled());
        for plots in [&["3 sigma", "RMS"][..], &["σ budget", "Axis"], &["Residuals", "Half-angle"]] {
            window.state_mut().settings_mut().plotted = plots.iter().map(|name| (*name).to_owned()).collect();
            for frame in [0, 3] {
                window.state_mut().go(frame);
                settled(&mut window);
                window.run_steps(6);
                cut.extend(cut_texts(&window).into_iter().map(|text| format!("{width}×{height}: {text}")));
            }
        }
    }
    assert!(cut.is_empty(), "{}", cut.join("\n"));
}
