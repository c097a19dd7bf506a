//! Reads other TOML files with the same checks as a sensor.toml. Errors have line numbers, misspelt names get
//! suggestions, and `[camera]` may come from the `file` of another tool.

use std::path::Path;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use crate::Problem;
use crate::camera_section::camera_from_file;
use crate::located::{check_list_lengths, find_places, translate_serde_error, translate_syntax_error};
use crate::merge::merge_missing;
use crate::migrate::refuse_old_names;

/// Reads `text` as a `T`. `path` is used in messages, and the path of a camera `file` is relative to its folder.
/// `check` tests the value after it has been read. It returns the key, as `[section] key` or `[[tables]] 2 key`, and
/// the rule that is broken.
///
/// # Errors
/// The first error in the text.
pub fn parse<T: DeserializeOwned>(
    text: &str,
    path: &Path,
    check: impl FnOnce(&T) -> Result<(), (String, String)>,
) -> Result<T, Problem> {
    let mut table = DeTable::parse(text).map_err(|e| translate_syntax_error(&e, text, path))?;
    let places = find_places(table.get_ref());
    refuse_old_names(text, path, &places)?;
    check_list_lengths(text, path, &places)?;
    let camera = match camera_from_file(table.get_mut(), text, path)? {
        Some((camera, _)) => toml::to_string(&camera).unwrap_or_default(),
        None => String::new(),
    };
    if !camera.is_empty()
        && let Ok(camera) = DeTable::parse(&camera)
        && let Some(DeValue::Table(own)) = table.get_mut().get_mut("camera").map(toml::Spanned::get_mut)
    {
        // The keys next to `file` are kept.
        merge_missing(own, camera.into_inner());
    }
    let value = T::deserialize(toml::Deserializer::from(table))
        .map_err(|e| translate_serde_error(&e, text, path, &places, &[]))?;
    check(&value).map_err(|(field, what)| {
        let problem = Problem::new(path, what).in_field(field.clone());
        let parts = field.split(|c: char| "[]. ".contains(c)).filter(|part| !part.is_empty());
        // The tables of a list are counted from 1 in messages.
        let place =
            |part: &str| part.parse().map_or_else(|_| part.to_owned(), |n: usize| n.saturating_sub(1).to_string());
        let parts: Vec<String> = parts.map(place).collect();
        // The place of the key, or of the section that lacks it.
        let place = (1..=parts.len()).rev().find_map(|n| places.iter().find(|p| p.path == parts[..n]));
        match place {
            Some(place) => problem.at_offset(text, place.key.start),
            None => problem,
        }
    })?;
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Scene {
        camera: hzn_core::camera::Config,
        capture: Capture,
    }
    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Capture {
        frames: u32,
    }

    const CAMERA: &str = "[camera]\nwidth = 640\nheight = 480\nmodel = \"pinhole\"\nfx_px = 500.0\nfy_px = 500\ncx_px \
        = 319.5\ncy_px = 239.5\n";

    fn read(text: &str) -> Result<Scene, String> {
        let check = |s: &Scene| match s.capture.frames {
            0 => Err(("[capture] frames".to_owned(), "0 is refused: must be above 0".to_owned())),
            _ => Ok(()),
        };
        parse(text, Path::new("scene.toml"), check).map_err(|e| e.to_string())
    }

    #[test]
    fn errors_have_lines_and_suggestions() {
        let with = |rest: &str| read(&format!("{CAMERA}{rest}"));
        assert_eq!(with("[capture]\nframes = 3\n").unwrap().camera.width, 640);
        let error = |rest: &str| with(rest).unwrap_err();
        assert_eq!(
            error("[capture]\nframe = 3\n"),
            "scene.toml:10: [capture] frame: unknown key; did you mean frames?"
        );
        assert_eq!(
            error("[capture]\n\nframes = 0\n"),
            "scene.toml:11: [capture] frames: 0 is refused: must be above 0"
        );
        assert!(error("[captures]\nframes = 1\n").contains("did you mean capture?"));
        assert!(error("[capture]\nframes = \"many\"\n").starts_with("scene.toml:10: [capture] frames: "));
        let above = |line: &str| read(&format!("{line}\n{CAMERA}")).unwrap_err();
        assert_eq!(above("capture = []"), "scene.toml:1: capture: is a list; a table is expected");
        assert_eq!(above("capture = 3"), "scene.toml:1: capture: is a number; a table is expected");
        assert!(error("[capture]\nframes = {}\n").contains("[capture] frames: is a table: must be a whole number"));
        assert_eq!(error(""), "scene.toml: capture: the section [capture] is missing");
        // serde alone would read the first four numbers.
        for mount in ["[attitude_mount]\n", "[[cameras]]\nmount."] {
            let message = error(&format!("{mount}q_vehicle_from_camera_wxyz = [1, 0, 0, 0, 0]\n"));
            assert!(message.ends_with("q_vehicle_from_camera_wxyz: has 5 numbers; at most 4 are allowed"), "{message}");
        }
    }

    #[test]
    fn the_camera_may_come_from_another_file() {
        let dir = tempfile::tempdir().unwrap();
        let chain = "cam0:\n  camera_model: pinhole\n  intrinsics: [300.0, 301.0, 320.0, 240.0]\n  \
                     distortion_model: equidistant\n  distortion_coeffs: [0.01, 0.0, 0.0, 0.0]\n  resolution: [640, \
                     480]\n";
        std::fs::write(dir.path().join("camchain.yaml"), chain).unwrap();
        let text = "[camera]\nfile = \"camchain.yaml\"\ntheta_max_deg = 50\n[capture]\nframes = 3\n";
        let scene: Scene = parse(text, &dir.path().join("scene.toml"), |_| Ok(())).unwrap();
        assert_eq!((scene.camera.fy_px, scene.camera.theta_max_deg), (301.0, Some(50.0)));
    }
}
