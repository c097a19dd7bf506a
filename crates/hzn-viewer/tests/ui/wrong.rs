//! Tests with wrong input: the window reports it in place, and everything else keeps working.

use egui::Key;
use egui_kittest::kittest::Queryable;
use hzn_core::status::Status;

use crate::window::*;

#[test]
fn wrong_files_are_said_and_the_rest_goes_on() {
    let (dir, mut window) = window_on_flight();

    // The file is no recording, so the open sequence stays.
    let bad = dir.path().join("bad.mcap");
    std::fs::write(&bad, b"no recording").unwrap();
    open(&mut window, &bad);
    until(&mut window, "nothing is said", |v| v.messages().any(|m| m.contains("is not an MCAP file")));
    assert_eq!(window.state().sequence().len(), 4);

    // One picture cannot be decoded, and one has another size.
    std::fs::write(dir.path().join("1.png"), b"no picture").unwrap();
    image::GrayImage::new(40, 30).save(dir.path().join("2.png")).unwrap();
    open(&mut window, dir.path());
    settled(&mut window);
    assert_eq!(answer(&window).0, Status::Ok);
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert!(frame_view(&window).picture.as_ref().is_err_and(|why| why.contains("not a picture")));
    assert!(window.query_by_label("unreadable").is_some());
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    let refused = frame_view(&window).answers[0].refused.clone().unwrap();
    assert!(refused.contains("picture is 40x30 but the camera is 320x240"), "{refused}");
    window.key_press(Key::ArrowRight);
    settled(&mut window);
    assert_eq!(answer(&window).0, Status::NoLimb);
}

#[test]
fn missing_pictures_are_named() {
    let dir = tempfile::tempdir().unwrap();
    flight(dir.path());
    std::fs::write(dir.path().join("frames.csv"), "file,time_s\n0.png,0\n1.png,1\nlost.png,2\ngone.png,3\n").unwrap();
    let mut window = window_on(dir.path());
    said(&mut window, "2 pictures in frames.csv do not exist; the first one is lost.png");
    assert_eq!((window.state().sequence().len(), answer(&window).0), (4, Status::Ok));
}

#[test]
fn a_recording_that_was_cut_off_is_recovered() {
    let (dir, pictures) = folder();
    let mut window = window_on(&pictures);

    // The window writes the recording.
    let whole = dir.path().join("run.mcap");
    run_into(&mut window, &whole);
    let folder = answer(&window);

    // The recording gives the same answer as the folder.
    open(&mut window, &whole);
    settled(&mut window);
    assert_eq!(answer(&window), folder);
    assert_eq!(window.state().recorded(0).and_then(|r| r.axis()), folder.2);

    // The file is cut off before the end of its data. All pictures are there, and it can be recovered.
    let cut = cut_off(&whole);
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
