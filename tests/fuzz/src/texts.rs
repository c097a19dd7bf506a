//! Arbitrary texts: configurations, tables, camera files.

use std::path::Path;

use hzn_core::HostHorizon;
use hzn_core::body::Kind;
use hzn_fuse::input::Map;

use crate::input::with_file;

/// A path that does not exist, so that a text cannot name a file of this machine.
const NOWHERE: &str = "/nowhere/at/all/file";

/// Calls `read` with the bytes as text.
fn with_text(bytes: &[u8], read: impl FnOnce(&str, &Path)) {
    // A text may name other files; an absolute path would leave the folder that does not exist.
    if let Ok(text) = std::str::from_utf8(bytes)
        && !text.contains("file")
    {
        read(text, Path::new(NOWHERE));
    }
}

pub(crate) fn sensor_toml(bytes: &[u8]) {
    with_text(bytes, |text, path| match hzn_files::sensor::parse(text, path) {
        // What was read and checked makes a sensor, or the refusal names the key.
        Ok(sensor) => {
            if let Err(e) = HostHorizon::boxed(&sensor.config) {
                assert!(!e.to_string().is_empty());
            }
        }
        Err(problem) => assert!(!problem.to_string().is_empty()),
    });
}

pub(crate) fn frames_csv(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(frames) = hzn_files::frames::parse(text, Path::new(NOWHERE)) else { return };
    for kind in [Kind::Earth, Kind::EarthSphere, Kind::Moon] {
        let warnings = frames.check_altitudes(kind, 6371.0);
        assert!(warnings.len() < 10, "{} warnings", warnings.len());
    }
    for row in &frames.rows {
        let found = frames.get(&row.file).expect("every row is found by its picture");
        assert_eq!(found.line, row.line);
        let _ = row.to_prior::<f32>(None);
    }
}

pub(crate) fn scene_toml(bytes: &[u8]) {
    with_text(bytes, |text, path| {
        let _ = hzn_sim::scenario::parse(text, path, Some(3), None);
    });
}

pub(crate) fn camera_file(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    for name in [None, Some("cam1")] {
        if let Ok(camera) = hzn_files::camera_file::parse(text, Path::new(NOWHERE), name) {
            let _ = hzn_core::camera::Camera::<f64>::try_new(&camera);
        }
    }
}

/// Tables of instruments, of truth, and of points. The first byte chooses the table.
pub(crate) fn tables(bytes: &[u8]) {
    let Some((which, rest)) = bytes.split_first() else { return };
    with_file("table.csv", rest, |path, _| match which % 6 {
        0 => drop(hzn_fuse::input::imu(path, &Map::default())),
        1 => drop(hzn_fuse::input::gnss(path, &Map::default(), None)),
        2 => drop(hzn_fuse::input::attitudes(path, &Map::default())),
        3 => drop(hzn_files::truth::load(path)),
        4 => drop(hzn_calib::points::table::load(path, [640, 480])),
        _ => drop(hzn_fuse::Settings::load(path)),
    });
}
