//! The keys of sensor.toml: those of hzn-core, and those that exist only in the file.
//!
//! Four files are generated from the keys: the [tables](table::markdown) of the documentation, the commented
//! [template](template::text), the [JSON schema](schema::json) for editors, and the [types](python::module) of the
//! Python package. `cargo xtask keys` writes all four.

pub mod python;
pub mod schema;
pub mod table;
pub mod template;

use hzn_core::Preset;
pub use hzn_core::keys::{Choice, Form, Key, Limits, Table, Value};

/// The key for the starting values, which is above all sections.
const PRESET: Key = Key {
    path: "preset",
    doc: "Named starting values of the whole sensor; keys in the file replace them.\n",
    form: Form::Word,
    limits: Limits::Choice,
    choices: Preset::CHOICES,
    feature: None,
    unset: Some("`hzn`"),
    example: Some("\"hzn\""),
    flight: None,
};

/// Keys of `[camera]` that take the calibration from another tool's file.
const CAMERA_FILE: [Key; 2] = [
    Key {
        path: "camera.file",
        doc: "A Kalibr, OpenCV, EuRoC or ROS camera_info file with the calibration. Its path is relative to this \
              sensor.toml. Of the other keys of `[camera]`, only `camera`, `theta_max_deg`, `theta_min_deg`, \
              `readout_s`, `temperature`, the sigmas and `covariance` are allowed with it.\n",
        form: Form::Word,
        limits: Limits::Rule("a path"),
        choices: &[],
        feature: None,
        unset: Some("none"),
        example: Some("\"camchain.yaml\""),
        flight: None,
    },
    Key {
        path: "camera.camera",
        doc: "Name of the camera in `file`.\n",
        form: Form::Word,
        limits: Limits::Rule("a name in the file"),
        choices: &[],
        feature: None,
        unset: Some("the first one"),
        example: Some("\"cam0\""),
        flight: None,
    },
];

/// Returns the sections in the order of the documents: `[mount]` comes after `[camera]`.
pub fn sections() -> impl Iterator<Item = &'static Table> {
    let is_first = |table: &&Table| table.name == "camera";
    let is_mount = |table: &&Table| table.name == "mount";
    let all = hzn_core::config::SECTIONS;
    let rest = all.iter().filter(move |table| !is_first(table) && !is_mount(table));
    all.iter().filter(is_first).chain(all.iter().filter(is_mount)).chain(rest)
}

/// Returns every key, in the order of the documents.
pub fn all() -> impl Iterator<Item = &'static Key> {
    let keys = |table: &'static Table| table.keys.iter().chain(keys_of_file(table.name));
    core::iter::once(&PRESET).chain(sections().flat_map(keys))
}

/// Returns the keys of a section that exist only in the file.
fn keys_of_file(section: &str) -> &'static [Key] {
    if section == "camera" { &CAMERA_FILE } else { &[] }
}

/// Returns the keys of one section, in order; `""` is the top of the file.
pub fn in_section(section: &str) -> impl Iterator<Item = &'static Key> {
    all().filter(move |key| key.section() == section)
}

/// Returns the key of a path, for example `consensus.threshold_px`; `None` if there is no such key.
pub fn find(path: &str) -> Option<&'static Key> {
    all().find(|key| key.path == path)
}

/// Returns the key of a path in parts, for example `consensus`, `threshold_px`. For `[[bodies]]` the path contains the
/// number of the body.
pub(crate) fn find_parts(path: &[String]) -> Option<&'static Key> {
    let names: Vec<&str> = path.iter().map(String::as_str).filter(|part| part.parse::<usize>().is_err()).collect();
    let section = match names[..] {
        ["body" | "bodies", section, _] => section,
        ["bodies", _] => "body",
        [section, _] => section,
        _ => "",
    };
    in_section(section).find(|key| names.last() == Some(&key.name()))
}

/// Describes the allowed values of a key: `above 0 to 1000`, a list of the choices, or the key's rule.
pub fn limits_in_words(key: &Key) -> String {
    match key.limits {
        Limits::Number { low, above, high } => {
            let low = format!("{}{}", if above { "above " } else { "" }, format_number(low));
            match (high.is_finite(), above) {
                (true, _) => format!("{low} to {}", format_number(high)),
                (false, true) => low,
                (false, false) => format!("{low} or more"),
            }
        }
        Limits::Choice => {
            let words = key.choices.iter().map(|choice| format!("`{}`", choice.name)).collect::<Vec<_>>().join(", ");
            if key.form == Form::WordOrNumber { words + ", or a number" } else { words }
        }
        Limits::Rule(rule) => rule.to_owned(),
        _ => String::new(),
    }
}

/// Formats a number without a trailing `.0`; whole millions are written as powers of ten.
fn format_number(x: f64) -> String {
    if x.abs() >= 1e6 && x.abs() % 1e6 == 0.0 { format!("{x:e}") } else { x.to_string() }.replace('-', "−")
}

/// Returns the defaults as TOML, by section.
pub(crate) fn defaults() -> toml::Table {
    use hzn_core::camera::{Config, Model};
    // In pixels as narrow as those of usual cameras: some defaults are smaller in wider ones.
    let config = hzn_core::Config::new(Config::ideal(Model::default(), 2, 2, 1000.0));
    let mut table = toml::Table::try_from(config).unwrap_or_default();
    // A camera has no defaults.
    table.remove("camera");
    table
}

/// Returns the default of a key as TOML; `None` if it has no default.
pub(crate) fn default_of(key: &Key, defaults: &toml::Table) -> Option<String> {
    let value = defaults.get(key.section())?.get(key.name())?;
    Some(value.to_string())
}

/// Breaks a text into lines of at most `width` characters.
fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests;
