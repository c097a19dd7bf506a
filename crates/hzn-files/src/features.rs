//! The features of `hzn-core` that a configuration needs.

use hzn_core::Config;
use hzn_core::config::SECTIONS;
use hzn_core::keys::Key;

use crate::sensor::to_table;

/// Returns the features of `hzn-core` without which a configuration is refused, in the order of the keys. A flight
/// computer that is built without one of them refuses the sensor.
///
/// # Errors
/// The configuration cannot be written as TOML.
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::{Config, Preset};
///
/// let lens = camera::Config::ideal(Model::Pinhole, 640, 480, 600.0);
/// assert_eq!(hzn_files::features::needed(&Config::new(lens.clone()))?, Vec::<&str>::new());
/// assert_eq!(hzn_files::features::needed(&Config::preset(Preset::Dlr2022, lens))?, ["dlr"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn needed(config: &Config) -> Result<Vec<&'static str>, toml::ser::Error> {
    let table = to_table(config)?;
    let mut default = to_table(&Config::new(config.camera.clone()))?;
    // A lens has no default: its model counts, whatever it is.
    default.remove("camera");
    let mut features = Vec::new();
    for key in SECTIONS.iter().flat_map(|section| section.keys) {
        let unlike_default = |own: &&toml::Value| value(default.get(key.section()), key) != Some(own);
        for own in tables(&table, key.section()).filter_map(|table| value(Some(table), key)).filter(unlike_default) {
            let word = key.choices.iter().find(|choice| own.as_str() == Some(choice.name));
            for feature in key.feature.into_iter().chain(word.and_then(|word| word.feature)) {
                if !features.contains(&feature) {
                    features.push(feature);
                }
            }
        }
    }
    Ok(features)
}

/// Returns the tables of a section: each of several bodies has one.
fn tables<'a>(table: &'a toml::Table, section: &str) -> impl Iterator<Item = &'a toml::Value> {
    let bodies = table.get("bodies").filter(|_| section == "body").and_then(toml::Value::as_array);
    table.get(section).into_iter().chain(bodies.into_iter().flatten())
}

fn value<'a>(section: Option<&'a toml::Value>, key: &Key) -> Option<&'a toml::Value> {
    section?.as_table()?.get(key.name())
}
