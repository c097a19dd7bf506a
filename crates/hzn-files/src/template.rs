//! A commented sensor.toml to start from. [`crate::keys::template`] writes it.

/// The file that `hzn init` writes. It loads without changes, and every value outside of `[camera]` is the default.
pub const SENSOR_TOML: &str = include_str!("template.toml");

#[cfg(test)]
mod tests {
    use std::path::Path;

    use hzn_core::Config;

    #[test]
    fn loads_and_equals_the_defaults() {
        let mut config = crate::sensor::parse(super::SENSOR_TOML, Path::new("template.toml")).unwrap().config;
        // An altitude has no default, but no picture can be processed without one.
        assert_eq!(config.body.altitude_km.take(), Some(400.0));
        assert_eq!(config, Config::new(config.camera.clone()));
    }

    #[test]
    fn every_key_is_there() {
        // The template describes these two tables in words.
        let in_words = ["body.threshold", "body.covariance"];
        for key in crate::keys::all().filter(|k| !in_words.contains(&k.path)) {
            let there = |l: &str| l.trim_start_matches("# ").starts_with(&format!("{} =", key.name()));
            assert!(super::SENSOR_TOML.lines().any(there), "{}", key.path);
        }
    }

    #[test]
    fn commented_keys_are_valid_too() {
        let key = |l: &&str| l.starts_with("# ") && l[2..].split_once(" = ").is_some_and(|(k, _)| !k.contains(' '));
        let commented: Vec<_> = super::SENSOR_TOML.lines().filter(key).collect();
        assert!(commented.len() >= 4, "{commented:?}");
        for line in commented.iter().filter(|l| !l.contains("file =") && !l.contains("camera =")) {
            let text = super::SENSOR_TOML
                .replace(*line, &line[2..])
                .replace("# [mount]", if line.contains("q_vehicle") { "[mount]" } else { "" });
            if let Err(e) = crate::sensor::parse(&text, Path::new("template.toml")) {
                // The value may be refused. The name must exist.
                assert!(!e.what.contains("unknown"), "{e}");
            }
        }
    }
}
