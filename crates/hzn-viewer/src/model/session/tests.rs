//! Tests of the session.

use super::*;

const TEXT: &str = "preset = \"hzn\"\n[camera]\nwidth = 640\nheight = 480\nfx_px = 500.0\nfy_px = 500.0\ncx_px = \
                                    319.5\ncy_px = 239.5\nmodel = \"pinhole\"\n[consensus]\nthreshold_px = 3.0 # \
                                    mine\n";

fn session() -> Session {
    Session::new(TEXT, Path::new("sensor.toml"), None)
}

fn threshold(s: &Session) -> f64 {
    s.config().unwrap().consensus.threshold_px
}

#[test]
fn a_change_counts_and_is_undone() {
    let mut s = session();
    assert!(!s.is_changed() && s.problem().is_none());
    s.set("consensus", "threshold_px", 0, Some(5.0.into()));
    assert_eq!(threshold(&s), 5.0);
    assert!(s.is_changed() && s.can_undo());
    s.undo();
    assert_eq!(threshold(&s), 3.0);
    assert!(!s.is_changed() && s.can_redo());
    s.redo();
    assert_eq!(threshold(&s), 5.0);
    s.reset();
    assert_eq!((threshold(&s), s.is_changed()), (3.0, false));
    s.undo();
    assert_eq!(threshold(&s), 5.0);
}

#[test]
fn one_value_goes_back_to_the_files() {
    let mut s = session();
    s.set("consensus", "threshold_px", 0, Some(5.0.into()));
    s.set("brightness", "max_mean", 0, Some(0.5.into()));
    assert!(s.differs("consensus", "threshold_px", 0) && !s.differs("consensus", "seed", 0));
    s.restore("consensus", "threshold_px", 0);
    s.restore("brightness", "max_mean", 0);
    assert!(!s.differs("consensus", "threshold_px", 0));
    assert_eq!((threshold(&s), s.config().unwrap().brightness.max_mean), (3.0, 0.98));
}

#[test]
fn a_drag_is_one_step() {
    let mut s = session();
    for x in [3.1, 3.7, 4.4] {
        s.set("consensus", "threshold_px", 0, Some(x.into()));
    }
    s.end_step();
    s.set("consensus", "threshold_px", 0, Some(9.0.into()));
    s.set("brightness", "max_mean", 0, Some(0.5.into()));
    s.undo();
    s.undo();
    assert_eq!(threshold(&s), 4.4);
    s.undo();
    assert_eq!(threshold(&s), 3.0);
    assert!(!s.can_undo());
}

#[test]
fn a_refused_value_is_said_and_the_last_good_one_counts() {
    let mut s = session();
    s.set("consensus", "threshold_px", 0, Some((-1.0).into()));
    let what = s.problem().unwrap().to_string();
    assert!(what.contains("[consensus] threshold_px") && what.contains("above 0"), "{what}");
    assert_eq!(threshold(&s), 3.0);
    s.undo();
    assert!(s.problem().is_none());
}

#[test]
fn values_are_those_that_count() {
    let s = session();
    assert_eq!(s.number("consensus", "threshold_px", 0), Some(3.0));
    assert_eq!(s.number("edge_points", "keep_points", 0), Some(600.0), "the preset's");
    assert_eq!(s.number("gates", "min_arc_px", 0), None);
    assert_eq!(s.value("threshold", "method", 0).unwrap().as_str(), Some("otsu"));
}

#[test]
fn a_slider_reaches_as_far_while_it_is_moved_as_before() {
    let dir = tempfile::tempdir().unwrap();
    let mut s = session();
    let magnitude = |s: &Session| s.usual_magnitude("threshold", "scale", 0);
    assert_eq!(magnitude(&s), 1.0);
    s.set("threshold", "scale", 0, Some(0.15.into()));
    assert_eq!((s.number("threshold", "scale", 0), magnitude(&s)), (Some(0.15), 1.0));
    s.save(&dir.path().join("sensor.toml")).unwrap();
    assert_eq!(magnitude(&s), 0.1);
    // Without a saved value, the value in effect sets the magnitude.
    assert_eq!(s.usual_magnitude("gates", "min_arc_px", 0), 1.0);
    s.set("gates", "min_arc_px", 0, Some(120.0.into()));
    assert_eq!(s.usual_magnitude("gates", "min_arc_px", 0), 100.0);
}

#[test]
fn whole_numbers_stay_whole() {
    let mut s = session();
    let key = |path: &str| keys::find(path).unwrap();
    s.set_number(key("edge_points.keep_points"), 0, 299.7);
    s.set_number(key("contour.line_spacing_px"), 0, 4.2);
    s.set_number(key("consensus.threshold_px"), 0, 3.0000001);
    assert!(s.problem().is_none(), "{:?}", s.problem());
    let config = s.config().unwrap();
    assert_eq!((config.edge_points.keep_points, config.contour.line_spacing_px), (300, Some(4)));
    assert_eq!(threshold(&s), 3.0);
}

#[test]
fn polygons_go_into_the_text_and_back() {
    let mut s = session();
    let polygons = vec![vec![[10.04, 5.0], [20.0, 5.0], [10.0, 15.5]]];
    s.set_polygons(&polygons);
    assert_eq!(s.polygons(), [[[10.0, 5.0], [20.0, 5.0], [10.0, 15.5]]]);
    assert!(s.sheet().text().contains("polygons_px = [[[10.0, 5.0], [20.0, 5.0], [10.0, 15.5]]]"));
}

#[test]
fn saved_is_what_is_read_again() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sensor.toml");
    let mut s = session();
    s.set("consensus", "threshold_px", 0, Some(5.0.into()));
    s.save(&path).unwrap();
    assert!(!s.is_changed());
    let again = Session::open(&path).unwrap();
    assert_eq!(again.config(), s.config());
    assert_eq!(again.sheet().text(), TEXT.replace("3.0", "5.0"));
    let nowhere = s.save(&dir.path().join("no").join("sensor.toml")).unwrap_err();
    assert!(nowhere.contains("the folder does not exist"), "{nowhere}");
    assert!(Session::open(&dir.path().join("none.toml")).is_err());
}

#[test]
fn under_another_preset_the_camera_stays() {
    let mut s = session();
    s.set("consensus", "threshold_px", 0, Some(5.0.into()));
    let other = s.under_preset(Preset::Dlr2022);
    assert!(other.problem().is_none(), "{:?}", other.problem());
    let (a, b) = (s.config().unwrap(), other.config().unwrap());
    assert_eq!(a.camera, b.camera);
    assert_eq!(**b, Config::preset(Preset::Dlr2022, a.camera.clone()));
}

#[test]
fn an_unreadable_text_is_no_end() {
    let mut s = Session::new("preset = ", Path::new("sensor.toml"), None);
    assert!(s.config().is_none() && s.problem().is_some());
    s.replace(Sheet::new(TEXT), None);
    assert!(s.config().is_some() && s.problem().is_none());
    assert_eq!(tidy(0.000123456), 0.00012346);
    assert_eq!(tidy(123456.7), 123457.0);
}

#[test]
fn a_change_by_another_program_is_noticed() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sensor.toml");
    let theirs = TEXT.replace("3.0", "4.0");
    std::fs::write(&path, TEXT).unwrap();
    let mut s = Session::open(&path).unwrap();
    s.set("consensus", "threshold_px", 0, Some(5.0.into()));
    assert_eq!(s.file_change(), None);
    std::fs::write(&path, &theirs).unwrap();
    assert_eq!(s.file_change(), Some(FileChange::Changed));
    // The file has the text of the session, so nothing would be lost.
    std::fs::write(&path, s.sheet().text()).unwrap();
    assert_eq!(s.file_change(), None);
    // A file that is larger than a sensor.toml can be is not read.
    std::fs::write(&path, vec![b'#'; 2 << 20]).unwrap();
    assert_eq!(s.file_change(), Some(FileChange::Changed));
    std::fs::remove_file(&path).unwrap();
    assert_eq!(s.file_change(), Some(FileChange::Removed));
    s.save(&path).unwrap();
    assert_eq!(s.file_change(), None);
    assert_eq!(session().file_change(), None, "a text from a recording has no file");
}

#[test]
fn the_text_of_the_file_is_read_again() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sensor.toml");
    let theirs = TEXT.replace("3.0", "4.0");
    std::fs::write(&path, TEXT).unwrap();
    let mut s = Session::open(&path).unwrap();
    s.set("consensus", "threshold_px", 0, Some(5.0.into()));
    std::fs::write(&path, &theirs).unwrap();
    s.reload().unwrap();
    assert_eq!((threshold(&s), s.is_changed(), s.file_change()), (4.0, false, None));
    s.undo();
    assert_eq!((threshold(&s), s.is_changed()), (5.0, true));
    // The same text in the window and in the file leaves no difference.
    std::fs::write(&path, s.sheet().text()).unwrap();
    s.reload().unwrap();
    assert!(!s.is_changed() && !s.differs("consensus", "threshold_px", 0));
    std::fs::remove_file(&path).unwrap();
    assert!(s.reload().is_err() && threshold(&s) == 5.0);
}

#[test]
fn the_bits_that_the_pictures_show_stay_after_a_reload() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sensor.toml");
    std::fs::write(&path, TEXT).unwrap();
    let completed = format!("{TEXT}\n[input]\nbits = 12\n");
    let mut s = Session::new(&completed, &path, Some(Fingerprint::of(TEXT))).completed_from(TEXT);
    let lines = s.unsaved_lines().into_iter().flat_map(|(_, lines)| lines);
    assert_eq!(lines.collect::<Vec<_>>(), ["+", "+[input]", "+bits = 12"], "saving writes them");
    assert_eq!(s.file_change(), None, "the window added the bits, no other program");
    let bits = |s: &Session| s.config().unwrap().input.bits;
    let theirs = TEXT.replace("3.0", "4.0");
    std::fs::write(&path, &theirs).unwrap();
    s.reload().unwrap();
    assert_eq!((threshold(&s), bits(&s), s.is_changed()), (4.0, Some(12), false));
    std::fs::write(&path, format!("{theirs}\n[input]\nbits = 10\n")).unwrap();
    s.reload().unwrap();
    assert_eq!(bits(&s), Some(10), "the file knows better");
    std::fs::write(&path, theirs).unwrap();
    s.reload().unwrap();
    assert_eq!(bits(&s), None, "the other program removed its own key");
}
