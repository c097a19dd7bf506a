//! `sensor.toml`: one file that describes a sensor.
//!
//! The structure is [`hzn_core::Config`] with two more keys: `preset` at the top, and `file` in `[camera]`. `preset`
//! gives the keys that the file does not have, as [`Config::preset`] does for the camera of the file. `file` takes the
//! calibration from another tool's file (see [`crate::camera_file`]). Its path is relative to the sensor.toml.
//! `camera = "cam1"` next to it selects one of several cameras.

use std::path::Path;

use hzn_core::camera::{self, Camera};
use hzn_core::error::ConfigError;
use hzn_core::{Config, Preset};
use serde::Deserialize;
use toml::de::{DeTable, DeValue};

use crate::body_defaults::{body_defaults, merge_body_defaults};
use crate::camera_section::camera_from_file;
use crate::located::{
    check_list_lengths, find_places, problem_at_key, translate_config_error, translate_serde_error,
    translate_syntax_error,
};
use crate::merge::{merge_missing, take};
use crate::migrate::refuse_old_names;
use crate::nearest::suggestion;
use crate::shapes::{check_bodies, refuse_wrong_shape};
use crate::{Problem, limited, plausible};

/// A sensor.toml that was read and checked.
#[derive(Debug, Clone)]
pub struct Sensor {
    /// The configuration.
    pub config: Config,
    /// The text of the file as it is on disk, to be stored with the results.
    pub text: String,
    /// Warnings about values that are possible but look wrong, for example a swapped width and height.
    pub warnings: Vec<Problem>,
}

/// Reads and checks a sensor.toml, including its lens.
///
/// # Errors
/// The first error in the file.
pub fn load(path: &Path) -> Result<Sensor, Problem> {
    let text = limited::read_text(path, limited::SETTINGS_BYTES).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => {
            Problem::new(path, "no such file; `hzn init` writes a commented sensor.toml to start from")
        }
        std::io::ErrorKind::InvalidData => Problem::new(path, "is not text; a sensor.toml is expected"),
        std::io::ErrorKind::FileTooLarge => Problem::new(path, format!("{e}; a sensor.toml is expected")),
        std::io::ErrorKind::IsADirectory => Problem::new(path, "is a folder; name the sensor.toml in it"),
        _ => Problem::new(path, format!("cannot be read: {e}")),
    })?;
    parse(&text, path)
}

/// Reads a sensor.toml as [`load`] does, but from text. Messages name `path`; its folder is that of a camera `file`.
///
/// # Errors
/// The first error in the text.
pub fn parse(text: &str, path: &Path) -> Result<Sensor, Problem> {
    let mut table = DeTable::parse(text).map_err(|e| translate_syntax_error(&e, text, path))?;
    // The place of every key, for errors that are found after the table is consumed.
    let places = find_places(table.get_ref());
    refuse_old_names(text, path, &places)?;
    refuse_wrong_shape(table.get_ref(), text, path)?;
    let preset = match take(table.get_mut(), "preset") {
        None => Preset::default(),
        Some((value, span)) => find_preset(value.as_str().unwrap_or_default())
            .map_err(|what| Problem::new(path, what).at_offset(text, span.start).in_field("preset"))?,
    };
    let body_defaults = body_defaults(table.get_ref());
    check_bodies(table.get_ref(), text, path)?;
    check_list_lengths(text, path, &places)?;
    let (from_file, of_camera) = camera_from_file(table.get_mut(), text, path)?.unzip();
    if from_file.is_some() {
        // `Config` requires a camera. This one is a placeholder; `merge_camera` replaces it and keeps the keys next to
        // `file`.
        let stand_in = DeTable::parse("width = 2\nheight = 2\nfx_px = 1.0\nfy_px = 1.0\ncx_px = 0.0\ncy_px = 0.0\n");
        if let (Ok(stand_in), Some(DeValue::Table(own))) =
            (stand_in, table.get_mut().get_mut("camera").map(toml::Spanned::get_mut))
        {
            merge_missing(own, stand_in.into_inner());
        }
    }
    merge_body_defaults(table.get_mut(), &body_defaults);
    let read = |table: toml::Spanned<DeTable<'_>>| {
        Config::deserialize(toml::Deserializer::from(table))
            .map_err(|e| translate_serde_error(&e, text, path, &places, &["preset"]))
    };
    // Values of a preset follow from the camera, which is therefore read first.
    let camera = merge_camera(read(table.clone())?.camera, from_file);
    let starting_values = starting_values(preset, camera.clone());
    let mut complete = table;
    if let Ok(values) = DeTable::parse(&starting_values) {
        merge_missing(complete.get_mut(), values.into_inner());
    }
    let mut config = Config { camera, ..read(complete)? };
    if let Some(tone) = config.input.tone {
        config.set_tone(tone);
    }
    if let Some(what) = plausible::explain_five_coefficients(&config.camera) {
        return Err(problem_at_key("camera.k", None, what, text, path, &places));
    }
    check(&config).map_err(|e| translate_config_error(&e, text, path, &places))?;
    let found = plausible::find_implausible(&config).into_iter();
    let mut warnings = of_camera.unwrap_or_default();
    warnings.extend(found.map(|doubt| problem_at_key(doubt.key, doubt.body, doubt.what, text, path, &places)));
    Ok(Sensor { config, text: text.to_owned(), warnings })
}

/// Returns the preset of that name, or the reason why it cannot be used.
fn find_preset(name: &str) -> Result<Preset, String> {
    let preset = Preset::from_name(name).ok_or_else(|| {
        let names: Vec<&str> = Preset::ALL.iter().map(|p| p.name()).collect();
        format!("no preset {name:?}{}", suggestion(name, &names))
    })?;
    preset.check().map_err(|e| e.limit.to_string())?;
    Ok(preset)
}

/// Returns the camera of another tool's file with the keys of `[camera]` that are next to `file`; without such a file,
/// the camera of `[camera]`.
fn merge_camera(section: camera::Config, from_file: Option<camera::Config>) -> camera::Config {
    let Some(camera) = from_file else { return section };
    let camera::Config { focal_sigma_percent, centre_sigma_px, covariance, temperature, readout_s, .. } = section;
    camera::Config { focal_sigma_percent, centre_sigma_px, covariance, temperature, readout_s, ..camera }
}

/// Returns a configuration as the text of a sensor.toml. It is a function of this crate, so that the code for all keys
/// is compiled once and not again in each crate that writes a sensor.
///
/// # Errors
/// A value is not TOML, for example an integer above 2⁶³.
pub fn to_text(config: &Config) -> Result<String, toml::ser::Error> {
    toml::to_string(config)
}

/// Returns a configuration as the table of a sensor.toml, as [`to_text`] does.
///
/// # Errors
/// The errors of [`to_text`].
pub fn to_table(config: &Config) -> Result<toml::Table, toml::ser::Error> {
    toml::Table::try_from(config)
}

/// Writes the preset of a sensor with this camera as the text of a sensor.toml without camera.
fn starting_values(preset: Preset, camera: camera::Config) -> String {
    let mut table = match to_table(&Config::preset(preset, camera)) {
        Ok(table) => table,
        Err(e) => unreachable!("plain numbers, texts and lists are TOML: {e}"),
    };
    table.remove("camera");
    table.to_string()
}

/// Checks everything that `Sensor::new` checks.
///
/// # Errors
/// The first field that is out of its limits.
pub fn check(config: &Config) -> Result<(), ConfigError> {
    config.check()?;
    Camera::<f64>::try_new(&config.camera).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: &str = "[camera]\nwidth = 640\nheight = 480\nmodel = \"pinhole\"\nfx_px = 500.0\nfy_px = 500\ncx_px \
        = 319.5\ncy_px = 239.5\n";

    fn error(rest: &str) -> String {
        parse(&format!("{CAMERA}{rest}"), Path::new("sensor.toml")).unwrap_err().to_string()
    }

    #[test]
    fn a_camera_is_enough() {
        let sensor = parse(CAMERA, Path::new("sensor.toml")).unwrap();
        assert_eq!(sensor.config, Config::new(sensor.config.camera.clone()));
        assert!(parse(&format!("preset = \"hzn\"\n{CAMERA}"), Path::new("s.toml")).is_ok());
    }

    #[test]
    fn what_is_written_beats_the_preset() {
        let sun = parse(&format!("preset = \"sun\"\n{CAMERA}"), Path::new("s.toml")).unwrap().config;
        assert_eq!(sun, Config::preset(Preset::Sun, sun.camera.clone()));
        assert_ne!(sun, Config::new(sun.camera.clone()));
        let text = format!("preset = \"sun\"\n{CAMERA}[covariance]\nsigma_px = 0.5\n");
        let own = parse(&text, Path::new("s.toml")).unwrap().config;
        let mut want = sun;
        want.covariance.sigma_px = 0.5;
        assert_eq!(own, want);
        // Errors still name the right line.
        let message = parse(&text.replace("0.5", "-1"), Path::new("s.toml")).unwrap_err().to_string();
        assert_eq!(message, "s.toml:11: [covariance] sigma_px: -1 is refused: must be above 0");
    }

    #[test]
    fn methods_behind_features_are_taken_or_the_feature_is_named() {
        for key in crate::keys::all() {
            for choice in key.choices {
                let line = match key.section() {
                    "" => format!("{} = {:?}\n{CAMERA}", key.name(), choice.name),
                    "camera" | "body" => continue,
                    section => format!("{CAMERA}[{section}]\n{} = {:?}\n", key.name(), choice.name),
                };
                match parse(&line, Path::new("s.toml")) {
                    Ok(_) => assert!(choice.is_built, "{choice:?}"),
                    Err(e) => {
                        let feature = choice.feature.unwrap_or_default();
                        assert!(
                            !choice.is_built && e.to_string().contains(&format!("feature {feature:?}")),
                            "{choice:?}: {e}"
                        )
                    }
                }
            }
        }
    }

    #[test]
    fn several_bodies_have_their_own_levels() {
        let two = "[[bodies]]\nkind = \"earth\"\naltitude_km = 400\n[[bodies]]\nkind = \
                                               \"sun\"\n[bodies.threshold]\nmethod = \"fixed\"\nlevel = 0.9\n";
        let config = parse(&format!("{CAMERA}{two}"), Path::new("s.toml")).unwrap().config;
        assert_eq!((config.each_body().len(), config.each_body()[0].altitude_km), (2, Some(400.0)));
        assert_eq!(config.each_body()[1].threshold.unwrap().level, 0.9);
        assert_eq!(
            error(&two.replace("0.9", "-1")),
            "sensor.toml:16: [[bodies]] 2 threshold.level: -1 is refused: must be above 0"
        );
        assert_eq!(
            error(&two.replace("400", "-400")),
            "sensor.toml:11: [[bodies]] 1 altitude_km: -400 is refused: must be above 0"
        );
        assert_eq!(
            error(&two.replace("altitude_km", "altitude")),
            "sensor.toml:11: [[bodies]] 1 altitude: unknown key; did you mean altitude_km?"
        );
        assert_eq!(
            error(&two.replace("level =", "levels =")),
            "sensor.toml:16: [[bodies]] 2 threshold.levels: unknown key; did you mean level?"
        );
        assert_eq!(
            error(&format!("[body]\nkind = \"earth\"\n{two}")),
            "sensor.toml:11: [[bodies]]: cannot be combined with [body]; write one body as [body], or all bodies as \
             [[bodies]]"
        );
        let four = "[[bodies]]\nkind = \"earth\"\n".repeat(4);
        assert_eq!(error(&four), "sensor.toml:9: [[bodies]]: 4 are too many; at most 3 bodies are possible");
    }

    #[test]
    fn misspelt_names_suggest_the_right_one() {
        assert_eq!(
            error("[consensus]\nthreshold_pxx = 3.0\n"),
            "sensor.toml:10: [consensus] threshold_pxx: unknown key; did you mean threshold_px?"
        );
        assert_eq!(
            error("[consnsus]\nseed = 3\n"),
            "sensor.toml:9: consnsus: unknown section or key; did you mean consensus?"
        );
        assert_eq!(
            error("[consensus]\nmethod = \"twopoint\"\n"),
            "sensor.toml:10: [consensus] method: \"twopoint\" is not a valid value; did you mean two-point?"
        );
        let above = parse(&format!("altitude_km = 400\n{CAMERA}"), Path::new("s.toml")).unwrap_err();
        assert_eq!(above.to_string(), "s.toml:1: altitude_km: unknown section or key; it is a key of [body]");
        let preset = parse(&format!("preset = \"hznn\"\n{CAMERA}"), Path::new("s.toml")).unwrap_err();
        assert_eq!(preset.to_string(), "s.toml:1: preset: no preset \"hznn\"; did you mean hzn?");
        assert_eq!(
            error("[brightness]\ncolour = 1\n"),
            "sensor.toml:10: [brightness] colour: unknown key; valid here: min_mean, max_mean"
        );
    }

    #[test]
    fn wrong_values_name_the_limit() {
        assert_eq!(
            error("[consensus]\nthreshold_px = -3\n"),
            "sensor.toml:10: [consensus] threshold_px: -3 is refused: must be above 0"
        );
        assert_eq!(
            error("[body]\naltitude_km = nan\n"),
            "sensor.toml:10: [body] altitude_km: nan is refused: must be a finite number"
        );
        assert_eq!(
            error("[body]\naltitude_km = -inf\n"),
            "sensor.toml:10: [body] altitude_km: -inf is refused: must be a finite number"
        );
        let camera =
            |from: &str, to: &str| parse(&CAMERA.replace(from, to), Path::new("s.toml")).unwrap_err().to_string();
        assert_eq!(
            camera("fx_px = 500.0", "fx_px = nan"),
            "s.toml:5: [camera] fx_px: nan is refused: must be a finite number"
        );
        // A missing value has no number that the message could show.
        assert_eq!(
            error("[body]\nkind = \"sphere\"\naltitude_km = 9\n"),
            "sensor.toml:9: [body] radius_km: a sphere needs its radius in km"
        );
        assert_eq!(
            error("[consensus]\nthreshold_px = \"3\"\n"),
            "sensor.toml:10: [consensus] threshold_px: invalid type: string \"3\", expected a number"
        );
        let twisted = CAMERA.replace("pinhole", "kannala-brandt") + "k = [-0.9]\n";
        let message = parse(&twisted, Path::new("s.toml")).unwrap_err().to_string();
        assert!(message.starts_with("s.toml:9: [camera] k: ") || message.contains("monotone"), "{message}");
    }

    #[test]
    fn what_looks_wrong_is_a_warning_with_its_line() {
        let warned = |text: String| {
            let sensor = parse(&text, Path::new("s.toml")).unwrap();
            sensor.warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
        };
        assert_eq!(warned(CAMERA.to_owned()), "");
        let swapped = CAMERA.replace("319.5", "x").replace("239.5", "319.5").replace("= x", "= 39.5");
        assert!(
            warned(swapped).starts_with("s.toml:7: [camera] cx_px: the centre (39.5, 319.5) is far from the middle")
        );
        let moon = warned(format!("{CAMERA}[body]\nkind = \"moon\"\naltitude_km = 100\n"));
        assert!(moon.starts_with("s.toml:11: [body] altitude_km: is not used: kind = \"moon\""), "{moon}");
        let two = "[[bodies]]\naltitude_km = 400\n[[bodies]]\nkind = \"sphere\"\nradius_km = 1\naltitude_km = 100\n";
        assert!(
            warned(format!("{CAMERA}{two}")).starts_with("s.toml:14: [[bodies]] 2 altitude_km: 100 km is implausibly")
        );
        // The preset `moon` gives no warning.
        assert_eq!(warned(format!("preset = \"moon\"\n{CAMERA}")), "");
        let five = CAMERA.replace("pinhole", "kannala-brandt") + "k = [1.0, -0.055, 0.011, -0.0035, 0.0002]\n";
        let message = parse(&five, Path::new("s.toml")).unwrap_err().to_string();
        assert!(message.starts_with("s.toml:9: [camera] k: has five coefficients that begin with"), "{message}");
    }

    #[test]
    fn whole_numbers_name_the_limits_of_their_key() {
        let width = |value: &str| {
            let text = CAMERA.replace("width = 640", &format!("width = {value}"));
            parse(&text, Path::new("s.toml")).unwrap_err().to_string()
        };
        for value in ["70000", "-5"] {
            let want = format!("s.toml:2: [camera] width: {value} is refused: must be between 2 and 65535");
            assert_eq!(width(value), want);
        }
        assert_eq!(width("1"), "s.toml:2: [camera] width: 1 is refused: must be between 2 and 65535");
        assert_eq!(
            width("640.5"),
            "s.toml:2: [camera] width: invalid type: number `640.5`: must be a whole number, between 2 and 65535"
        );
        for (text, what) in [
            ("[edge_points]\nkeep_points = 99999\n", "keep_points: 99999 is refused: must be 0 (all) or 16 to 65535"),
            ("[edge_points]\nmin_points = -1\n", "min_points: -1 is refused: must be between 3 and 65535"),
            ("[gates]\nmin_inliers = 65536\n", "min_inliers: 65536 is refused: must be between 3 and 65535"),
            ("[consensus]\nseed = -1\n", "seed: -1 is refused: must be between 0 and 4294967295"),
            ("[consensus]\nmax_draws = 5000000000\n", "max_draws: 5000000000 is refused: must be between 1 and 100000"),
            ("[input]\nbits = 300\n", "bits: 300 is refused: must be between 8 and 16"),
        ] {
            assert!(error(text).ends_with(what), "{}", error(text));
        }
    }

    #[test]
    fn lists_that_are_too_long_name_their_number_and_the_limit() {
        let list = |item: &str, n: usize| format!("[{}]", vec![item; n].join(", "));
        let k = parse(&format!("{CAMERA}k = {}\n", list("0.0", 12)), Path::new("s.toml")).unwrap_err();
        assert_eq!(k.to_string(), "s.toml:9: [camera] k: has 12 numbers; at most 5 are allowed");
        let polygon = |corners: usize| list("[1, 2]", corners);
        assert_eq!(
            error(&format!("[mask]\npolygons_px = {}\n", list(&polygon(3), 50))),
            "sensor.toml:10: [mask] polygons_px: has 50 polygons; at most 8 are allowed"
        );
        assert_eq!(
            error(&format!("[mask]\npolygons_px = [\n{},\n{}]\n", polygon(3), polygon(100))),
            "sensor.toml:12: [mask] polygons_px 2: has 100 corners; at most 16 are allowed"
        );
        let rows = format!("limb_height_by_latitude_km = {}\n", list("[0, 20]", 17));
        assert_eq!(
            error(&format!("[body]\n{rows}")),
            "sensor.toml:10: [body] limb_height_by_latitude_km: has 17 rows; at most 16 are allowed"
        );
        assert_eq!(
            error(&format!("[[bodies]]\nkind = \"sun\"\n[[bodies]]\n{rows}")),
            "sensor.toml:12: [[bodies]] 2 limb_height_by_latitude_km: has 17 rows; at most 16 are allowed"
        );
        // serde alone would read the first numbers of these lists and ignore the others.
        for (text, what) in [
            (
                "[mount]\nq_vehicle_from_camera_wxyz = [1, 0, 0, 0, 0]\n",
                "[mount] q_vehicle_from_camera_wxyz: has 5 numbers; at most 4",
            ),
            (
                "[mask]\npolygons_px = [[[1, 2], [3, 4, 5], [5, 6]]]\n",
                "[mask] polygons_px 1.2: has 3 numbers; at most 2",
            ),
            (
                "[body]\nlimb_height_by_latitude_km = [[0, 20, 1]]\n",
                "[body] limb_height_by_latitude_km 1: has 3 numbers; at most 2",
            ),
            ("[gates]\naltitude_limits_km = [1, 2, 3]\n", "[gates] altitude_limits_km: has 3 numbers; at most 2"),
        ] {
            assert_eq!(error(text), format!("sensor.toml:10: {what} are allowed"));
        }
        // Lists of exactly the maximum length are accepted.
        assert!(parse(&format!("{CAMERA}k = {}\n", list("0.0", 5)), Path::new("s.toml")).is_ok());
        let corners: Vec<&str> = ["[1, 2]", "[9, 2]", "[9, 8]", "[1, 8]"].into_iter().cycle().take(16).collect();
        let full = format!("{CAMERA}[mask]\npolygons_px = {}\n", list(&format!("[{}]", corners.join(", ")), 8));
        assert!(parse(&full, Path::new("s.toml")).is_ok());
    }

    #[test]
    fn what_is_missing_is_named() {
        let message = |text: &str| parse(text, Path::new("s.toml")).unwrap_err().to_string();
        assert_eq!(message(""), "s.toml: camera: the section [camera] is missing");
        assert_eq!(
            message("[camera]\nwidth = 3\nheight = 3\nfx_px = 3\ncx_px = 1\ncy_px = 1\n"),
            "s.toml:1: [camera] fy_px: missing; write it, or use a `file` with the calibration"
        );
        assert_eq!(message("[camera\n"), "s.toml:1:8: not valid TOML: unclosed table, expected `]`");
        assert!(load(Path::new("/nowhere/s.toml")).unwrap_err().to_string().contains("hzn init"));
    }

    #[test]
    fn the_camera_may_come_from_another_file() {
        let dir = tempfile::tempdir().unwrap();
        let chain = "cam0:\n  camera_model: pinhole\n  intrinsics: [300.0, 301.0, 320.0, 240.0]\n  \
                     distortion_model: equidistant\n  distortion_coeffs: [0.01, 0.0, 0.0, 0.0]\n  resolution: [640, \
                     480]\n";
        std::fs::write(dir.path().join("camchain.yaml"), chain).unwrap();
        let path = dir.path().join("sensor.toml");
        std::fs::write(&path, "[camera]\nfile = \"camchain.yaml\"\ntheta_max_deg = 50\n[consensus]\nseed = 7\n")
            .unwrap();
        let config = load(&path).unwrap().config;
        assert_eq!((config.camera.fy_px, config.camera.theta_max_deg, config.consensus.seed), (301.0, Some(50.0), 7));
        std::fs::write(&path, "[camera]\nfile = \"camchain.yaml\"\nwidth = 50\n").unwrap();
        assert!(load(&path).unwrap_err().to_string().contains(":3: [camera] width: cannot be next to `file`"));
        std::fs::write(&path, "[camera]\nfile = \"other.yaml\"\n").unwrap();
        assert!(load(&path).unwrap_err().to_string().contains("no such file (paths are relative"));
    }
}
