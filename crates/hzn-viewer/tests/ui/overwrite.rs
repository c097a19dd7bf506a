//! Tests of the files that could be lost: no file of another flight, of another program or of another kind is written
//! without a question.

use std::path::{Path, PathBuf};

use egui::{Key, Modifiers, Role};
use egui_kittest::kittest::Queryable;
use hzn_viewer::model::Autosave;
use hzn_viewer::ui::Viewer;
use hzn_viewer::work::open::Request;

use crate::window::*;

const CTRL: Modifiers = Modifiers::COMMAND;
const SHIFT: Modifiers = Modifiers::SHIFT;

/// Returns a folder of pictures without a sensor.toml.
fn bare_folder() -> (tempfile::TempDir, PathBuf) {
    let (dir, pictures) = folder();
    std::fs::remove_file(pictures.join("sensor.toml")).unwrap();
    (dir, pictures)
}

fn scale_to(window: &mut Window, scale: f64) {
    window.get_by_role_and_label(Role::Slider, "scale").set_value_accesskit(scale);
    settled(window);
}

fn save(window: &mut Window) {
    window.key_press_modifiers(CTRL, Key::S);
    window.run_steps(3);
}

fn click(window: &mut Window, label: &str) {
    window.get_by_label(label).click();
    window.run_steps(3);
}

fn shows(window: &Window, words: &str) -> bool {
    window.query_all_by_label_contains(words).next().is_some()
}

fn text(window: &Window) -> String {
    window.state().session().unwrap().sheet().text().to_owned()
}

/// Opens pictures and waits until they are on the screen.
fn open_and_wait(window: &mut Window, what: &Path) {
    open(window, what);
    let inputs = [what.to_owned()];
    until(window, "not opened", |v| v.sequence().inputs == inputs && v.sequence().complete && v.is_settled());
}

#[test]
fn a_folder_without_a_sensor_takes_none_of_another_flight() {
    let (first_dir, first) = folder();
    let (_bare_dir, bare) = bare_folder();
    let mut window = window_on(&first);
    menu(&mut window, "Compare", "with preset dlr-2022");
    open_and_wait(&mut window, &bare);
    assert!(window.state().session().is_none(), "the sensor of the first flight ends with its pictures");
    assert!(frame_view(&window).answers.is_empty(), "so does the preset that was compared with it");
    said(&mut window, "There is no sensor.toml, so the pictures are shown but not processed");

    // The sensor of a recording ends with the recording, also after it was saved.
    open_and_wait(&mut window, &first);
    let recording = first_dir.path().join("run.mcap");
    run_into(&mut window, &recording);
    open_and_wait(&mut window, &recording);
    assert!(window.state().session().is_some());
    window.key_press_modifiers(CTRL | SHIFT, Key::S);
    path(&mut window, &first_dir.path().join("kept.toml"), "Write");
    said(&mut window, "Saved");
    open_and_wait(&mut window, &bare);
    assert!(window.state().session().is_none());
}

#[test]
fn a_sensor_that_the_user_opened_stays_and_its_path_is_shown() {
    let (dir, pictures) = folder();
    let (_bare_dir, bare) = bare_folder();
    let own = another_sensor(dir.path());
    let mut window = window_on(&pictures);
    open(&mut window, &own);
    settled(&mut window);
    open_and_wait(&mut window, &bare);
    assert_eq!(window.state().session().unwrap().path(), Some(own.as_path()));
    said(&mut window, &format!("The one that you opened stays: {}", own.display()));
    // The title has only the names; the paths are in its tooltip.
    window.get_by_label("pictures   other.toml").hover();
    window.run_steps(60);
    assert!(shows(&window, &format!("Sensor: {}", own.display())));
    assert!(shows(&window, &format!("Pictures: {}", bare.display())));

    // The banner stays until the user decides.
    let banner = format!("Sensor of {} is used", own.display());
    assert!(shows(&window, &banner));
    click(&mut window, "Keep");
    assert!(!shows(&window, &banner) && window.state().session().is_some());

    // The file that the command line names is one that the user opened.
    let request = Request { inputs: vec![pictures], sensor: Some(own.clone()), ..Request::default() };
    window.state_mut().open(request);
    settled(&mut window);
    open_and_wait(&mut window, &bare);
    assert_eq!(window.state().session().unwrap().path(), Some(own.as_path()));
}

#[test]
fn a_sensor_of_other_pictures_gives_way_to_a_new_one() {
    let (dir, pictures) = folder();
    let (_bare_dir, bare) = bare_folder();
    let own = another_sensor(dir.path());
    let mut window = window_on(&pictures);
    open(&mut window, &own);
    settled(&mut window);
    open_and_wait(&mut window, &bare);
    // Changes of the old sensor are not lost without a question. A mistyped name is told before it.
    scale_to(&mut window, 1.2);
    open(&mut window, &bare.join("none"));
    said(&mut window, "no such file or folder");
    assert!(!shows(&window, "Unsaved changes") && window.state().session().is_some_and(|s| s.is_changed()));
    click(&mut window, "Make a new one");
    assert!(shows(&window, "Unsaved changes"));
    click(&mut window, "Discard changes");
    assert!(window.state().session().is_none() && !shows(&window, "is used"));
    click(&mut window, "Make sensor.toml");
    settled(&mut window);
    assert_eq!(window.state().session().unwrap().home(), bare.join("sensor.toml"));
    save(&mut window);
    path(&mut window, &bare.join("sensor.toml"), "Write");
    said(&mut window, &format!("Saved: {}", bare.join("sensor.toml").display()));
}

#[test]
fn a_file_outside_the_folder_is_written_only_if_the_user_agrees() {
    let (dir, pictures) = folder();
    let (_bare_dir, bare) = bare_folder();
    let own = another_sensor(dir.path());
    let before = std::fs::read_to_string(&own).unwrap();
    let mut window = window_on(&pictures);
    open(&mut window, &own);
    settled(&mut window);
    open_and_wait(&mut window, &bare);
    scale_to(&mut window, 1.5);
    save(&mut window);
    let asks = |window: &Window| shows(window, "Save into another folder?");
    assert!(asks(&window) && shows(&window, &own.canonicalize().unwrap().display().to_string()));
    click(&mut window, "Cancel");
    assert!(!asks(&window) && std::fs::read_to_string(&own).unwrap() == before);

    // One answer is enough for these pictures.
    save(&mut window);
    click(&mut window, "Save there");
    said(&mut window, &format!("Saved: {}", own.display()));
    scale_to(&mut window, 1.7);
    save(&mut window);
    assert!(!asks(&window) && std::fs::read_to_string(&own).unwrap() == text(&window));

    // Other pictures ask again, and their folder is the other choice.
    let (_last_dir, last) = bare_folder();
    open_and_wait(&mut window, &last);
    scale_to(&mut window, 1.9);
    open(&mut window, &pictures);
    click(&mut window, "Save changes");
    assert!(asks(&window), "saving before leaving asks, too");
    click(&mut window, "Cancel");
    assert_eq!(window.state().sequence().inputs, std::slice::from_ref(&last));
    save(&mut window);
    assert!(asks(&window));
    click(&mut window, "Save into the folder…");
    window.run_steps(3);
    click(&mut window, "Write");
    said(&mut window, &format!("Saved: {}", last.canonicalize().unwrap().join("sensor.toml").display()));
    assert!(!std::fs::read_to_string(&own).unwrap().contains("1.9"));
    assert_eq!(std::fs::read_to_string(last.join("sensor.toml")).unwrap(), text(&window));
    // This file lies in the folder, so it needs no question.
    scale_to(&mut window, 1.3);
    save(&mut window);
    assert!(!asks(&window) && !window.state().session().unwrap().is_changed());
}

#[test]
fn changes_that_are_made_while_pictures_are_opened_are_not_lost() {
    let (_dir, pictures) = folder();
    let (_bare_dir, bare) = bare_folder();
    let mut window = window_on(&pictures);
    let request = Request { inputs: vec![bare.clone()], ..Request::default() };
    window.state_mut().open(request);
    window.state_mut().session_mut().unwrap().set("threshold", "scale", 0, Some(1.5.into()));
    let begin = std::time::Instant::now();
    while window.query_by_label("Unsaved changes").is_none() {
        assert!(begin.elapsed().as_secs() < 60, "there is no question");
        window.step();
    }
    window.run_steps(2);
    assert_eq!((window.state().sequence().inputs.as_slice(), window.state().sequence().len()), (&[pictures][..], 4));
    click(&mut window, "Discard changes");
    until(&mut window, "not opened", |v| v.sequence().inputs == [bare.clone()] && v.is_settled());
}

#[test]
fn restored_changes_do_not_come_to_other_pictures() {
    let (dir, pictures) = folder();
    let (_other_dir, other) = folder();
    let store = dir.path().join("config").join("viewer.json");
    let mut window = stored_window(&store);
    open(&mut window, &pictures);
    settled(&mut window);
    scale_to(&mut window, 1.5);
    let own = store.with_file_name(format!("unsaved-{}.json", std::process::id()));
    until(&mut window, "not autosaved", |_| own.exists());
    // The window crashes, and its pictures are moved away. No process has this number.
    std::fs::rename(&own, store.with_file_name("unsaved-4294967295.json")).unwrap();
    drop(window);
    std::fs::remove_dir_all(&pictures).unwrap();

    let mut later = stored_window(&store);
    later.run_steps(3);
    click(&mut later, "Restore changes");
    said(&mut later, "the next window offers them again");
    open_and_wait(&mut later, &other);
    assert_eq!(later.state().session().unwrap().path(), Some(other.join("sensor.toml").as_path()));
    assert_eq!(text(&later), SENSOR);
    assert!(Autosave::find_lost(store.parent().unwrap()).is_some());
}

#[test]
fn a_file_that_another_program_changed_is_reloaded_or_overwritten_as_the_user_says() {
    let (dir, mut window) = window_on_flight();
    let file = dir.path().join("sensor.toml");
    let theirs = SENSOR.replace("altitude_km = 240.0", "altitude_km = 300.0");
    let on_disk = || std::fs::read_to_string(&file).unwrap();
    let asks = |window: &Window| shows(window, "Another program changed this file after the window read it:");
    scale_to(&mut window, 1.5);
    let ours = text(&window);
    std::fs::write(&file, &theirs).unwrap();
    save(&mut window);
    assert!(asks(&window) && shows(&window, &file.display().to_string()));
    click(&mut window, "Cancel");
    assert_eq!((on_disk(), text(&window)), (theirs.clone(), ours.clone()));
    assert!(!asks(&window));

    // The difference shows the line of the file and that of the window.
    save(&mut window);
    assert!(!shows(&window, "altitude_km = 300.0"));
    click(&mut window, "Show the difference");
    window.run_steps(3);
    let lines = ["altitude_km = 300.0", "altitude_km = 240.0"];
    assert!(lines.iter().all(|line| window.query_by_label_contains(line).is_some()));
    click(&mut window, "Cancel");

    // The window takes the text of the file, and undo brings its own back.
    save(&mut window);
    click(&mut window, "Reload");
    settled(&mut window);
    assert_eq!((on_disk(), text(&window)), (theirs.clone(), theirs.clone()));
    let session = window.state().session().unwrap();
    assert!(!session.is_changed() && session.config().unwrap().body.altitude_km == Some(300.0));
    window.key_press_modifiers(CTRL, Key::Z);
    settled(&mut window);
    assert_eq!(text(&window), ours);

    // The file is the one that was reloaded, so it is saved without a question, and after another change with one.
    save(&mut window);
    assert_eq!(on_disk(), ours);
    std::fs::write(&file, &theirs).unwrap();
    save(&mut window);
    assert!(asks(&window) && on_disk() == theirs);
    click(&mut window, "Overwrite");
    assert_eq!(on_disk(), ours);

    // There is nothing to lose if the other program wrote the same text.
    scale_to(&mut window, 1.7);
    std::fs::write(&file, text(&window)).unwrap();
    save(&mut window);
    assert!(!asks(&window) && !window.state().session().unwrap().is_changed());
}

#[test]
fn a_window_without_changes_takes_the_changed_file_when_the_user_comes_back() {
    let (dir, mut window) = window_on_flight();
    let file = dir.path().join("sensor.toml");
    let theirs = SENSOR.replace("altitude_km = 240.0", "altitude_km = 300.0");
    std::fs::write(&file, &theirs).unwrap();
    window.event(egui::Event::WindowFocused(true));
    settled(&mut window);
    assert_eq!(text(&window), theirs);
    assert!(!window.state().session().unwrap().is_changed());

    // Changes of the window stay, whatever happens to the file.
    scale_to(&mut window, 1.5);
    let ours = text(&window);
    std::fs::write(&file, SENSOR).unwrap();
    window.event(egui::Event::WindowFocused(true));
    settled(&mut window);
    assert_eq!(text(&window), ours);
}

#[test]
fn a_file_that_was_removed_is_not_written_without_a_question() {
    let (dir, mut window) = window_on_flight();
    let file = dir.path().join("sensor.toml");
    scale_to(&mut window, 1.5);
    std::fs::remove_file(&file).unwrap();
    save(&mut window);
    assert!(shows(&window, "Another program removed this file") && window.query_by_label("Reload").is_none());
    assert!(!file.exists());
    click(&mut window, "Write it again");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text(&window));
}

#[test]
fn saving_before_leaving_and_saving_under_the_same_name_ask_too() {
    let (_dir, pictures) = folder();
    let (_other_dir, other) = folder();
    let file = pictures.join("sensor.toml");
    let mut window = window_on(&pictures);
    scale_to(&mut window, 1.5);
    std::fs::write(&file, "# theirs").unwrap();
    open(&mut window, &other);
    click(&mut window, "Save changes");
    assert!(shows(&window, "The file has changed"));
    click(&mut window, "Cancel");
    window.run_steps(3);
    assert_eq!(window.state().sequence().inputs[0], pictures, "the other pictures are not opened");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "# theirs");

    window.key_press_modifiers(CTRL | SHIFT, Key::S);
    path(&mut window, &pictures.join("..").join("pictures").join("sensor.toml"), "Write");
    window.run_steps(2);
    assert!(shows(&window, "The file has changed"), "the path has another form");
    click(&mut window, "Overwrite");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text(&window));
}

/// Opens a dialog for a file to write.
type Begin = fn(&mut Window);

/// Returns the dialogs for all files that the window can write; the second value is a name with the right ending.
fn writers() -> [(Begin, &'static str); 7] {
    [
        (|w| w.key_press_modifiers(CTRL | SHIFT, Key::S), "a.toml"),
        (|w| w.key_press_modifiers(CTRL, Key::E), "a.png"),
        (|w| menu(w, "Export", "Save video with overlays…"), "a.mp4"),
        (|w| menu(w, "Export", "Save results as CSV…"), "a.csv"),
        (|w| menu(w, "Export", "Save results as CSV…"), "a.jsonl"),
        (|w| menu(w, "Export", "Save plots as SVG…"), "a.svg"),
        (|w| w.key_press_modifiers(CTRL | SHIFT, Key::P), "a.mcap"),
    ]
}

#[test]
fn no_file_is_replaced_before_the_user_agrees() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    until(&mut window, "not processed", |v| v.processed() == 4);
    for (begin, name) in writers() {
        let file = dir.path().join(name);
        std::fs::write(&file, vec![b'x'; 8_100_000]).unwrap();
        begin(&mut window);
        type_path(&mut window, &file);
        // The key Enter opens the question, and a second one does not answer it.
        window.key_press(Key::Enter);
        window.run_steps(3);
        window.key_press(Key::Enter);
        window.run_steps(3);
        assert!(shows(&window, "Replace the file?") && shows(&window, "It has 8.1 MB"), "{name}");
        assert_eq!(std::fs::metadata(&file).unwrap().len(), 8_100_000);
        // The dialog comes back with the name, so that it can be changed.
        click(&mut window, "Choose another name");
        assert!(window.query_by_role_and_label(Role::TextInput, "Path").is_some(), "{name}");
        click(&mut window, "Cancel");
    }
    for (_, name) in writers() {
        assert_eq!(std::fs::metadata(dir.path().join(name)).unwrap().len(), 8_100_000, "{name}");
    }
    window.key_press_modifiers(CTRL | SHIFT, Key::S);
    path(&mut window, &dir.path().join("a.toml"), "Write");
    replace(&mut window);
    said(&mut window, "a.toml");
    assert_eq!(std::fs::read_to_string(dir.path().join("a.toml")).unwrap(), SENSOR);
}

#[test]
fn every_kind_of_file_has_its_own_endings() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    for (begin, own) in writers() {
        for name in ["a.toml", "a.mcap", "a"].into_iter().filter(|name| *name != own) {
            begin(&mut window);
            type_path(&mut window, &dir.path().join(name));
            window.key_press(Key::Enter);
            refused(&mut window, "The file name must end in");
        }
    }
    assert_eq!(files(dir.path()), ["pictures"]);
}

#[test]
fn what_the_window_reads_is_not_written() {
    let (_dir, pictures) = folder();
    let table = pictures.join("frames.csv");
    std::fs::write(&table, "file,time_s\n0.png,0\n").unwrap();
    let before = std::fs::read(pictures.join("1.png")).unwrap();
    let mut window = window_on(&pictures);
    window.key_press_modifiers(CTRL, Key::E);
    path(&mut window, &pictures.join("..").join("pictures").join("1.png"), "Write");
    refused(&mut window, "This window has opened");
    menu(&mut window, "Export", "Save results as CSV…");
    path(&mut window, &table, "Write");
    refused(&mut window, "This window has opened");
    assert_eq!(std::fs::read(pictures.join("1.png")).unwrap(), before);
    assert_eq!(std::fs::read_to_string(&table).unwrap(), "file,time_s\n0.png,0\n");
}

/// Returns true if the window is closed after these steps.
fn closes(window: &Window) -> bool {
    let commands = &window.output().viewport_output[&egui::ViewportId::ROOT].commands;
    commands.contains(&egui::ViewportCommand::Close)
}

#[test]
fn a_save_that_fails_does_not_close_the_window_later() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);
    scale_to(&mut window, 1.5);
    window.input_mut().viewports.entry(egui::ViewportId::ROOT).or_default().events.push(egui::ViewportEvent::Close);
    window.run_steps(3);
    // The folder is moved away, so the file cannot be written.
    let away = dir.path().join("away");
    std::fs::rename(&pictures, &away).unwrap();
    click(&mut window, "Save changes");
    click(&mut window, "Write it again");
    said(&mut window, "the folder does not exist");
    std::fs::rename(&away, &pictures).unwrap();
    save(&mut window);
    let unsaved = |v: &Viewer| v.session().is_some_and(|s| s.is_changed());
    assert!(!unsaved(window.state()) && !closes(&window));
}
