use std::path::Path;

use super::*;

const CAMERA: &str = "[camera]\nwidth = 640\nheight = 480\nmodel = \"pinhole\"\nfx_px = 500.0\nfy_px = 500\ncx_px = \
    319.5\ncy_px = 239.5\n";

/// Returns the error of sensor.toml for a value; `None` if the value is accepted.
fn refused(key: &Key, value: &str) -> Option<String> {
    let text = match key.section() {
        "" => format!("{} = {value}\n{CAMERA}", key.name()),
        "camera" => {
            let others = CAMERA.lines().filter(|l| !l.starts_with(&format!("{} =", key.name())));
            format!("{}\n{} = {value}\n", others.collect::<Vec<_>>().join("\n"), key.name())
        }
        section => format!("{CAMERA}[{section}]\n{} = {value}\n", key.name()),
    };
    crate::sensor::parse(&text, Path::new("sensor.toml")).err().map(|e| e.to_string())
}

#[test]
fn every_key_exists() {
    assert!(all().count() > 100);
    // This key is valid only next to `file`.
    for key in all().filter(|k| k.path != "camera.camera") {
        // No key accepts this value. The error must be about the value and not about the key's name.
        let why = refused(key, "[[[]]]").unwrap_or_default();
        assert!(!why.contains("unknown section") && !why.contains("unknown key"), "{}: {why}", key.path);
    }
}

#[test]
fn every_key_of_the_file_is_in_the_table() {
    let config = crate::sensor::parse(CAMERA, Path::new("sensor.toml")).unwrap().config;
    for (section, values) in toml::Table::try_from(config).unwrap() {
        for (name, _) in values.as_table().into_iter().flatten() {
            assert!(find(&format!("{section}.{name}")).is_some(), "{section}.{name} has no entry");
        }
    }
}

#[test]
fn every_key_has_a_sentence() {
    for key in all() {
        let sentence = key.sentence();
        assert!(sentence.ends_with('.') && sentence.len() > 10, "{}: {sentence:?}", key.path);
        for choice in key.choices {
            assert!(choice.doc.trim().ends_with('.'), "{} {}", key.path, choice.name);
        }
    }
}

#[test]
fn limits_are_checked() {
    // For these keys the limit depends on another value.
    let depends = ["brightness.max_mean", "brightness.min_mean", "body.range_km"];
    let mut checked = 0;
    for key in all().filter(|k| !depends.contains(&k.path)) {
        match key.limits {
            Limits::Choice => {
                for choice in key.choices {
                    let why = refused(key, &format!("{:?}", choice.name)).unwrap_or_default();
                    assert!(!why.contains("is not a valid value"), "{}: {why}", key.path);
                    checked += 1;
                }
            }
            Limits::Number { low, above, high } => {
                let list = |x: String| match key.form {
                    Form::Numbers if key.path == "retry.levels" => format!("[{x}]"),
                    Form::Numbers => format!("[{x}, {x}]"),
                    _ => x,
                };
                // A file writes whole numbers for whole fields.
                let is_accepted = |x: f64| {
                    refused(key, &list(format!("{x:.0}"))).is_none() && x.fract() == 0.0
                        || refused(key, &list(format!("{x:?}"))).is_none()
                };
                let inside = if above { low + 1e-3_f64.max(if high.is_infinite() { 1.0 } else { 0.0 }) } else { low };
                let of_lens = key.section() == "camera";
                assert!(is_accepted(inside) || of_lens, "{} = {inside} is refused", key.path);
                let outside = low - if above { 0.0 } else { 1.0 };
                assert!(!is_accepted(outside), "{} = {outside} is taken", key.path);
                if high.is_finite() {
                    let why = refused(key, &list(format!("{high:?}")));
                    assert!(is_accepted(high) || of_lens, "{} = {high} is refused: {why:?}", key.path);
                    assert!(!is_accepted(high * 2.0 + 1.0), "{} = {} is taken", key.path, high * 2.0 + 1.0);
                }
                checked += 1;
            }
            _ => {}
        }
    }
    assert!(checked > 90, "{checked}");
}

#[test]
fn entries_say_unit_method_and_limits() {
    let key = |path: &str| find(path).unwrap();
    assert_eq!(key("consensus.threshold_px").unit(), "px");
    assert_eq!(key("gates.max_rate_deg_s").unit(), "deg/s");
    assert_eq!(key("consensus.threshold_px").limits, Limits::Number { low: 0.0, above: true, high: 1000.0 });
    assert_eq!(key("threshold.level").method(), Some("fixed"));
    assert_eq!(key("threshold.factor").method(), Some("dynamic"));
    assert_eq!(key("body.altitude_reference").method(), None);
    let words: Vec<_> = key("retry.combine").choices.iter().map(|c| c.name).collect();
    assert_eq!(words, ["median", "mean"]);
    assert_eq!(limits_in_words(key("limits.max_work")), "10000 to 1e9");
    assert_eq!(limits_in_words(key("fit.half_angle")), "`fused`, `known`, `free`");
}

#[test]
fn every_section_has_a_heading_and_its_keys() {
    let text = table::markdown();
    let parts: Vec<(&str, &str)> = text.split("\n### [").skip(1).filter_map(|part| part.split_once("]\n")).collect();
    let names: Vec<&str> = parts.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, sections().map(|table| table.name).collect::<Vec<_>>());
    for (name, part) in parts {
        let rows = part.lines().filter(|line| line.starts_with("| `")).count();
        assert_eq!(rows, in_section(name).count(), "{name}");
    }
}

#[test]
fn documents_are_as_the_keys_say() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let say = "run `cargo xtask keys` and look at the difference";
    let page = std::fs::read_to_string(root.join("book/reference/sensor-toml.md")).unwrap();
    assert!(table::insert_table(&page).as_ref() == Some(&page), "{say}");
    assert!(crate::template::SENSOR_TOML == template::text(), "{say}");
    let types = std::fs::read_to_string(root.join("crates/hzn-py/python/hzn/keys.py")).unwrap();
    assert!(types == python::module(), "{say}");
    let schema = std::fs::read_to_string(root.join("book/reference/sensor.schema.json")).unwrap();
    assert!(serde_json::from_str::<serde_json::Value>(&schema).unwrap() == schema::json(), "{say}");
}
