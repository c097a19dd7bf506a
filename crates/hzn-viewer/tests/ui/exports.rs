//! Tests of all files that the window writes: pictures, videos, tables, recordings, sensor.toml.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;
use hzn_viewer::model::settings::Layer;

use crate::window::*;

/// Like [`folder`], with thousands of pictures.
fn long() -> (tempfile::TempDir, std::path::PathBuf) {
    let (dir, pictures) = folder();
    lengthen(&pictures, 3000);
    (dir, pictures)
}

fn colours(picture: &image::RgbImage) -> usize {
    picture.pixels().filter(|p| p[0] != p[1] || p[1] != p[2]).count()
}

#[test]
fn the_picture_is_saved_as_it_is_shown() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    let png = dir.path().join("shown.png");
    path(&mut window, &png, "Write");
    said(&mut window, "Written");
    let saved = image::open(&png).unwrap().to_rgb8();
    let (width, height) = (u32::from(WIDTH), u32::from(HEIGHT));
    let caption = hzn_run::overlay::caption::height_px(width, height);
    assert_eq!(saved.dimensions(), (width, height + caption), "a caption is below the picture");
    // The saved picture shows the fitted limb in its place.
    let limb = frame_view(&window).answers[0].bodies[0].limb.concat();
    let inside = |p: &&[f64; 2]| p[0] > 2.0 && p[1] > 2.0 && p[0] < 317.0 && p[1] < 237.0;
    let coloured = |p: &[f64; 2]| {
        let p = saved.get_pixel(p[0].round() as u32, p[1].round() as u32);
        p[0] != p[2]
    };
    let points: Vec<_> = limb.iter().filter(inside).collect();
    assert!(points.len() > 10 && points.iter().filter(|p| coloured(p)).count() * 10 > points.len() * 9);

    // With the overlays hidden, the saved file is the picture itself, except for the line of text.
    window.key_press(Key::H);
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    let plain = dir.path().join("plain.png");
    path(&mut window, &plain, "Write");
    said(&mut window, "plain.png");
    let plain = image::open(&plain).unwrap().to_rgb8();
    let [saved, plain] = [saved, plain].map(|p| image::imageops::crop_imm(&p, 0, 0, width, height).to_image());
    assert!(colours(&saved) > 200 && colours(&plain) == 0, "{} {}", colours(&saved), colours(&plain));

    // A name with another ending is refused.
    window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    path(&mut window, &dir.path().join("shown.jpg"), "Write");
    refused(&mut window, "must end in .png");
    assert_eq!(files(dir.path()), ["pictures", "plain.png", "shown.png"]);
}

/// Returns how many pixels around a point are redder than blue (positive sign) or bluer than red. The picture is grey.
fn coloured_near(picture: &image::RgbImage, [u, v]: [u32; 2], reach: u32, sign: i32) -> usize {
    let part = image::imageops::crop_imm(picture, u - reach, v - reach, 2 * reach, 2 * reach).to_image();
    part.pixels().filter(|p| sign * (i32::from(p[0]) - i32::from(p[2])) > 8).count()
}

#[test]
fn the_saved_picture_has_axis_sun_and_mask() {
    let (dir, pictures) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    disc(pictures.path());
    let sensor = std::fs::read_to_string(pictures.path().join("sensor.toml")).unwrap();
    let mask = "\n[mask]\npolygons_px = [[[4.0, 4.0], [60.0, 4.0], [60.0, 40.0], [4.0, 40.0]]]\n";
    std::fs::write(pictures.path().join("sensor.toml"), sensor + mask).unwrap();
    // The Sun is beside the Earth, at the left. The sensor is not told, because it would miss the night on the Earth.
    let header = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,sun_x,sun_y,sun_z,qw,qx,qy,qz";
    let row = "disc.png,0,earth-sphere,1,0.0998,0,0.995,15,18283,-0.447,0.179,0.876,1,0,0,0";
    std::fs::write(pictures.path().join("truth.csv"), format!("{header}\n{row}\n")).unwrap();
    let mut window = window_on(pictures.path());
    assert_eq!(answer(&window).0, Status::Ok);
    let save = |window: &mut Window, name: &str| {
        let png = dir.path().join(name);
        window.key_press_modifiers(Modifiers::COMMAND, Key::E);
        path(window, &png, "Write");
        said(window, name);
        let saved = image::open(&png).unwrap().to_rgb8();
        // The caption has a legend with these colours.
        image::imageops::crop_imm(&saved, 0, 0, WIDTH.into(), HEIGHT.into()).to_image()
    };
    // Where each part is drawn: an edge of the mask is bluish, the Sun yellow, the axis pink.
    let parts = [("mask", [40, 40], 30, -1), ("Sun", [27, 173], 20, 1), ("axis", [186, 120], 12, 1)];
    let with = save(&mut window, "with.png");
    for (part, at, reach, sign) in parts {
        let count = coloured_near(&with, at, reach, sign);
        assert!(count >= 20, "{part}: {count}");
    }
    for layer in [Layer::Mask, Layer::Sky, Layer::Axis] {
        window.state_mut().settings_mut().show(layer, false);
    }
    window.run_steps(2);
    let without = save(&mut window, "without.png");
    for (part, at, reach, sign) in parts {
        assert_eq!(coloured_near(&without, at, reach, sign), 0, "{part}");
    }
}

/// The export draws what is hidden in a darker colour, as the window does, and says what hides it.
#[test]
fn a_moon_behind_the_earth_is_fainter_in_the_saved_picture() {
    // The first one is 7° from the centre of a disc of 15°.
    for (moon, at, is_hidden) in [("0.0998,0.12,0.9877", [186, 151], true), ("-0.447,0.179,0.876", [27, 173], false)] {
        let (dir, pictures) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        disc(pictures.path());
        let header = "file,time_s,body,limb,axis_x,axis_y,axis_z,half_angle_deg,altitude_km,moon_x,moon_y,moon_z,qw,qx,\
                      qy,qz";
        let row = format!("disc.png,0,earth-sphere,1,0.0998,0,0.995,15,18283,{moon},1,0,0,0");
        std::fs::write(pictures.path().join("truth.csv"), format!("{header}\n{row}\n")).unwrap();
        let mut window = window_on(pictures.path());
        window.run_steps(3);
        let name = if is_hidden { "Moon, behind the Earth" } else { "Moon" };
        place_of(&window, |text| text == name);
        let png = dir.path().join("moon.png");
        window.key_press_modifiers(Modifiers::COMMAND, Key::E);
        path(&mut window, &png, "Write");
        said(&mut window, "moon.png");
        let saved = image::open(&png).unwrap().to_rgb8();
        let near = image::imageops::crop_imm(&saved, at[0] - 14, at[1] - 14, 28, 28).to_image();
        let yellow = near.pixels().map(|p| i32::from(p[0]) - i32::from(p[2])).max().unwrap();
        // The colour of Sun, Moon and stars has 85 counts more in red than in blue.
        let expected = if is_hidden { 25..55 } else { 60..90 };
        assert!(expected.contains(&yellow), "{name}: {yellow}");
    }
}

#[test]
fn the_table_holds_what_is_shown() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4);
    let csv = dir.path().join("shown.csv");
    menu(&mut window, "Export", "Save results as CSV…");
    path(&mut window, &csv, "Write");
    said(&mut window, "Written");
    let rows = hzn_run::results::read(&csv).map_err(|e| e.to_string()).unwrap().rows;
    let statuses: Vec<Status> = rows.iter().map(|r| r.status).collect();
    assert_eq!(statuses, [Status::Ok, Status::Ok, Status::Ok, Status::NoLimb]);
    assert_eq!(rows[0].axis(), answer(&window).2, "to the last bit");
}

#[test]
fn the_plots_are_saved_as_they_are_chosen() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4);
    let svg = dir.path().join("flight.svg");
    menu(&mut window, "Export", "Save plots as SVG…");
    path(&mut window, &svg, "Write");
    said(&mut window, "Written");
    let text = std::fs::read_to_string(&svg).unwrap();
    assert!(text.contains("3 sigma [°]") && text.contains("RMS [px]") && !text.contains("Half-angle"), "{text}");
    assert!(text.contains("pictures, 4 pictures") && text.contains("<polyline"), "{text}");
    // The last line says where the plots come from.
    let version = format!("hzn {}, ", env!("CARGO_PKG_VERSION"));
    assert!(text.contains(&version) && text.contains(", sensor ") && text.contains(", hzn view"), "{text}");

    menu(&mut window, "Export", "Save plots as SVG…");
    path(&mut window, &dir.path().join("flight.pdf"), "Write");
    refused(&mut window, "must end in .svg or .png");
    let png = dir.path().join("flight.png");
    menu(&mut window, "Export", "Save plots as PNG…");
    path(&mut window, &png, "Write");
    said(&mut window, "flight.png");
    assert_eq!(image::open(&png).unwrap().width(), 2700);
}

#[test]
fn the_video_shows_every_frame_or_nothing_is_left() {
    if std::process::Command::new("ffmpeg").arg("-version").output().is_err() {
        eprintln!("skipped: there is no ffmpeg");
        return;
    }
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    let film = dir.path().join("flight.mp4");
    menu(&mut window, "Export", "Save video with overlays…");
    path(&mut window, &film, "Write");
    said(&mut window, "Written");
    let mut watched = self::window();
    open(&mut watched, &film);
    until(&mut watched, "the video has pictures", |v| v.sequence().complete && v.frame_view().is_some());
    assert_eq!(watched.state().sequence().len(), 4);
    assert_eq!(files(dir.path()), ["flight.mp4", "pictures"]);

    // A stopped job leaves an earlier file of the same name as it was.
    let (dir, pictures) = long();
    let film = dir.path().join("long.mp4");
    std::fs::write(&film, b"before").unwrap();
    let mut window = window_on(&pictures);
    menu(&mut window, "Export", "Save video with overlays…");
    path(&mut window, &film, "Write");
    replace(&mut window);
    let begin = std::time::Instant::now();
    while window.query_by_label("Cancel saving the video").is_none() {
        assert!(begin.elapsed().as_secs() < 60, "there is nothing to cancel");
        window.step();
    }
    window.get_by_label("Cancel saving the video").click();
    said(&mut window, "Saving the video was stopped");
    assert_eq!(files(dir.path()), ["long.mp4", "pictures"]);
    assert_eq!(std::fs::read(&film).unwrap(), b"before");
    // The ending is not that of a video.
    menu(&mut window, "Export", "Save video with overlays…");
    path(&mut window, &dir.path().join("long.nothing"), "Write");
    refused(&mut window, "must end in .mp4");
    assert_eq!(files(dir.path()), ["long.mp4", "pictures"]);
}

#[test]
fn a_run_that_is_cancelled_leaves_no_recording() {
    let (dir, pictures) = long();
    let mut window = window_on(&pictures);
    let recording = dir.path().join("again.mcap");
    let run = |window: &mut Window, exists: bool| {
        window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
        path(window, &recording, "Write");
        if exists {
            replace(window);
        }
        window.get_by_label("Cancel").click();
        said(window, "Processing was stopped");
        // The message is closed, so that it is not taken for the message of the next run.
        window.get_by_label("Close").click();
        window.run_steps(2);
    };
    run(&mut window, false);
    assert_eq!(files(dir.path()), ["pictures"]);
    std::fs::write(&recording, b"before").unwrap();
    run(&mut window, true);
    assert_eq!(
        (files(dir.path()), std::fs::read(&recording).unwrap()),
        (vec!["again.mcap".into(), "pictures".into()], b"before".to_vec())
    );
}

#[test]
fn a_window_that_is_closed_leaves_nothing_half_written() {
    let (dir, pictures) = long();
    let mut window = window_on(&pictures);
    menu(&mut window, "Export", "Save video with overlays…");
    path(&mut window, &dir.path().join("long.mp4"), "Write");
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    path(&mut window, &dir.path().join("again.mcap"), "Write");
    window.state().close();
    assert_eq!(files(dir.path()), ["pictures"]);
}

#[test]
fn a_recording_does_not_take_its_own_place() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    let recording = dir.path().join("run.mcap");
    run_into(&mut window, &recording);
    open(&mut window, &recording);
    settled(&mut window);
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    path(&mut window, &recording, "Write");
    refused(&mut window, "This window has opened");
}

#[test]
fn the_sensor_is_saved_elsewhere_with_its_comments() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    window.get_by_role_and_label(egui::Role::Slider, "scale").set_value_accesskit(1.5);
    settled(&mut window);
    let other = dir.path().join("tuned.toml");
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    path(&mut window, &other, "Write");
    said(&mut window, "Saved");
    assert_eq!(std::fs::read_to_string(&other).unwrap(), SENSOR.replace("scale = 1.0 ", "scale = 1.5 "));
    assert_eq!(std::fs::read_to_string(pictures.join("sensor.toml")).unwrap(), SENSOR);
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_said_and_the_rest_goes_on() {
    let (dir, pictures) = folder();
    // /dev/full takes the place of unfinished files, so every write to them reports a full disk.
    let full = |name: &str| std::os::unix::fs::symlink("/dev/full", dir.path().join(name)).unwrap();
    let mut window = window_on(&pictures);
    let write = |window: &mut Window, name: &str, words: &str| {
        path(window, &dir.path().join(name), "Write");
        // The unfinished file of a run can be recovered, so the window asks before it is replaced.
        if dir.path().join(format!("{name}.part")).is_symlink() {
            replace(window);
        }
        said(window, words);
        let bad: Vec<String> = window.state().messages().filter(|m| m.contains(name)).map(str::to_owned).collect();
        assert!(bad.iter().any(|m| m.contains("full") || m.contains("no space is left")), "{bad:?}");
    };

    full("a.part.png");
    window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    write(&mut window, "a.png", "a.png: the disk is full");
    full("b.csv.part");
    menu(&mut window, "Export", "Save results as CSV…");
    write(&mut window, "b.csv", "b.csv: the disk is full");
    full("c.part.toml");
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::S);
    write(&mut window, "c.toml", "c.toml: the disk is full");
    if std::process::Command::new("ffmpeg").arg("-version").output().is_ok() {
        full("d.part.mp4");
        menu(&mut window, "Export", "Save video with overlays…");
        write(&mut window, "d.mp4", "d.mp4: the disk is full");
    }
    assert_eq!(files(dir.path()), ["pictures"], "nothing is left of what could not be written");
    // A recording keeps its finished pictures, and the message says where.
    full("e.mcap.part");
    window.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::P);
    write(&mut window, "e.mcap", "no space is left on the disk");
    assert!(!dir.path().join("e.mcap").exists());

    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert_eq!((frame_view(&window).index, answer(&window).0), (1, Status::Ok));
}

#[cfg(unix)]
#[test]
fn what_cannot_be_recovered_for_want_of_space_stays_open() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    let whole = dir.path().join("run.mcap");
    run_into(&mut window, &whole);
    let cut = cut_off(&whole);
    open(&mut window, &cut);
    said(&mut window, "was not closed");
    settled(&mut window);
    std::os::unix::fs::symlink("/dev/full", dir.path().join("cut-recovered.mcap.part")).unwrap();
    window.get_by_label("Recover it").click();
    said(&mut window, "no space is left on the disk");
    assert_eq!(window.state().sequence().title, "cut.mcap");
    assert_eq!(files(dir.path()), ["cut.mcap", "pictures", "run.mcap"]);
    // If the name is taken, recovery takes another name.
    open(&mut window, &cut);
    said(&mut window, "was not closed");
    settled(&mut window);
    std::fs::write(dir.path().join("cut-recovered.mcap"), b"mine").unwrap();
    window.get_by_label("Recover it").click();
    said(&mut window, "4 pictures recovered");
    until(&mut window, "not opened", |v| v.sequence().title == "cut-recovered-2.mcap");
}
