//! Tests of the results of other commands: navigation, residuals of a calibration.

use std::path::Path;

use egui_kittest::kittest::Queryable;

use crate::window::*;

/// The columns that the window reads from the table of `hzn fuse`, which begins with the first three of them.
const NAV: &str = "time_s,phase,qw,yaw_deg,pitch_deg,roll_deg,sigma_x_deg,sigma_y_deg,sigma_z_deg,position_sigma_m,\
                   limb_height_km,limb_height_sigma_km\n";
const INNOVATIONS: &str =
    "time_s,source,kind,first,second,third,first_sigma,second_sigma,third_sigma,unit,nis,taken,angle_deg\n";

/// Times of the pictures at which the cameras of [`write_navigation`] measure, s.
const TIMES_S: [f64; 4] = [100.0, 101.0, 102.0, 103.0];

/// Writes times of the pictures, s.
fn write_times(pictures: &Path, times_s: [f64; 4]) {
    let rows: String = (0..4).zip(times_s).map(|(n, t)| format!("{n}.png,{t}\n")).collect();
    std::fs::write(pictures.join("frames.csv"), format!("file,time_s\n{rows}")).unwrap();
}

/// Writes the results of a flight from a time on, s.
fn write_navigation(folder: &Path, from_s: f64) {
    let state = |n: u32, phase: &str| {
        let t = from_s + 0.2 * f64::from(n);
        format!("{t},{phase},1.0,{},2.0,3.0,0.1,0.2,0.3,,0.5,1.0\n", 170.0 + f64::from(n))
    };
    let states: String = (0..20).map(|n| state(n, "filter")).chain((8..14).map(|n| state(n, "smoothed"))).collect();
    std::fs::write(folder.join("nav.csv"), format!("{NAV}{states}")).unwrap();
    let innovation = |n: u32| format!("{},left,limb,0.1,0.2,,0.1,0.1,,deg,1.0,{},\n", from_s + f64::from(n), n != 2);
    let rows: String = (0..4).map(innovation).collect();
    std::fs::write(folder.join("nav.innovations.csv"), format!("{INNOVATIONS}{rows}")).unwrap();
}

fn offers(window: &Window, plot: &str) -> bool {
    window.query_by_label(plot).is_some()
}

#[test]
fn results_of_fuse_are_plotted_with_the_pictures() {
    let (dir, pictures) = folder();
    write_times(&pictures, TIMES_S);
    write_navigation(dir.path(), 99.0);
    // The results lie next to the folder of pictures.
    let mut window = window_on(&pictures);
    said(&mut window, "nav.csv: the plots");
    until(&mut window, "not processed", |v| v.processed() == 4);
    window.state_mut().settings_mut().plotted = ["Nav: attitude", "Nav: innovations"].map(str::to_owned).to_vec();
    window.run_steps(4);
    assert!(["Plot Nav: attitude", "Plot Nav: innovations"].iter().all(|plot| offers(&window, plot)));

    let svg = dir.path().join("nav.svg");
    menu(&mut window, "Export", "Save plots as SVG…");
    path(&mut window, &svg, "Write");
    said(&mut window, "nav.svg");
    let text = std::fs::read_to_string(&svg).unwrap();
    for word in ["Nav: attitude [°]", "yaw", "yaw (smoothed)", "left limb", "left limb (refused)"] {
        assert!(text.contains(word), "{word}");
    }
    // Only the solutions during the pictures have a place: 100 to 102.8 s.
    let parts = text.matches("<polyline").count();
    assert!(parts >= 6, "{parts}");
}

#[test]
fn a_sequence_without_such_results_offers_none() {
    let (_dir, mut window) = window_on_flight();
    until(&mut window, "not read", |v| v.processed() == 4 && !v.is_working());
    window.state_mut().settings_mut().plotted = ["Nav: attitude", "RMS", "Third axis"].map(str::to_owned).to_vec();
    window.run_steps(4);
    assert!(offers(&window, "Plot RMS"));
    for name in ["Nav: attitude", "Nav: innovations", "Third axis", "Position", "Range", "Lens residuals"] {
        assert!(!offers(&window, name), "{name}");
    }
    assert_eq!(window.state().messages().count(), 0, "{:?}", window.state().messages().collect::<Vec<_>>());
}

#[test]
fn results_on_another_clock_say_so() {
    let (_dir, pictures) = folder();
    write_times(&pictures, TIMES_S);
    // In the folder of the pictures, the user has put them there.
    write_navigation(&pictures, 5000.0);
    let mut window = window_on(&pictures);
    said(&mut window, "nav.csv");
    window.state_mut().settings_mut().plotted = vec!["Nav: attitude".to_owned()];
    window.run_steps(4);
    let why = window.query_by_label_contains("their clocks have other epochs");
    assert!(why.is_some());
}

/// The span is the same, and the pictures were taken at other times.
#[test]
fn results_of_other_pictures_are_named_and_not_shown() {
    for times_s in [[100.0, 100.6, 101.5, 103.0], [7.0, 8.0, 9.0, 10.0]] {
        let (dir, pictures) = folder();
        write_times(&pictures, times_s);
        write_navigation(dir.path(), 99.0);
        let mut window = window_on(&pictures);
        said(&mut window, "is of other pictures than these and is not shown");
        let words = format!("nav.csv in {} (camera left), 99.0 to 102.8 s", dir.path().display());
        assert!(window.state().messages().any(|m| m.starts_with(&words)), "{words}");
        window.run_steps(4);
        assert!(!offers(&window, "Nav: attitude"));
        // The user knows better.
        open(&mut window, &dir.path().join("nav.csv"));
        said(&mut window, "nav.csv: the plots “Nav: …” show these results of hzn fuse (camera left).");
        window.run_steps(4);
        assert!(offers(&window, "Nav: attitude"));
    }
}

#[test]
fn results_next_to_a_recording_are_shown_if_a_camera_has_its_name() {
    let (dir, pictures) = folder();
    write_navigation(dir.path(), 99.0);
    let mut window = window_on(&pictures);
    for (name, words) in [("left.mcap", "nav.csv: the plots"), ("right.mcap", "is of other pictures than these")] {
        let recording = dir.path().join(name);
        run_into(&mut window, &recording);
        open(&mut window, &recording);
        until(&mut window, "not opened", |v| v.sequence().inputs == [recording.clone()] && v.is_settled());
        said(&mut window, words);
    }
}

#[test]
fn residuals_of_a_calibration_are_drawn_and_damaged_tables_are_refused() {
    let (dir, pictures) = folder();
    let header = "file,u_px,v_px,error_u_px,error_v_px,counts\n";
    std::fs::write(pictures.join("residuals.csv"), format!("{header}0.png,100,100,0.3,0.4,1\n")).unwrap();
    let mut window = window_on(&pictures);
    said(&mut window, "residuals.csv: the overlay");
    assert!(window.query_by_label("Lens residuals").is_some());
    assert_eq!(frame_view(&window).name, "0.png");

    // A file that is opened later replaces it; one that cannot be read is named with its line.
    let broken = dir.path().join("broken.csv");
    std::fs::write(&broken, format!("{header}0.png,100,x,0.3,0.4,1\n")).unwrap();
    open(&mut window, &broken);
    said(&mut window, "broken.csv:2");
    assert_eq!(window.state().sequence().len(), 4, "the pictures stay");

    // Without pictures there is nothing to draw it on.
    let mut empty = crate::window::window();
    open(&mut empty, &pictures.join("residuals.csv"));
    said(&mut empty, "holds results and no pictures");
}
