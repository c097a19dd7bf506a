//! The commented sensor.toml to start from.

use super::table::about;
use super::{Key, Limits, default_of, defaults, keys_of_file, limits_in_words, sections, wrap};

/// Length of a comment line, in characters.
const WIDTH: usize = 118;

/// Returns the text of the template. It loads without changes, and every value outside of `[camera]` is the default.
pub fn text() -> String {
    let defaults = defaults();
    let mut out = comment(
        "A horizon sensor. Write your camera into [camera]. Every other value is the default: a key that you remove \
         keeps the value that it has here. Try it on one picture:  hzn explain PICTURE --sensor sensor.toml --overlay \
         out.png",
    );
    out.push('\n');
    out += &entry(&super::PRESET, &defaults);
    for table in sections() {
        out.push('\n');
        out += &comment(&about(table));
        // `[mount]` is commented out, because it is optional and has no default.
        out += &format!("{}[{}]\n", if table.name == "mount" { "# " } else { "" }, table.name);
        for key in table.keys.iter().chain(keys_of_file(table.name)) {
            out += &entry(key, &defaults);
        }
        if table.name == "body" {
            out += &comment(
                "For several bodies in one picture, write one [[bodies]] for each instead of [body]. It has the same \
                 keys, and may have a [bodies.threshold] and a [bodies.covariance].",
            );
        }
    }
    out
}

fn comment(text: &str) -> String {
    wrap(text, WIDTH).iter().map(|line| format!("# {line}\n")).collect()
}

/// Writes a key with its meaning and its values above it. A key without a default is commented out.
fn entry(key: &Key, defaults: &toml::Table) -> String {
    let (name, sentence) = (key.name(), key.sentence());
    // The keys of a table are below its heading.
    if key.example.is_none() && default_of(key, defaults).is_none() {
        return comment(&format!("[{}]: {sentence}", key.path));
    }
    let values = limits_in_words(key).replace("`, `", " | ").replace('`', "");
    let unset = key.unset.filter(|words| *words != "none");
    let unset = unset.map_or(String::new(), |words| format!("; left out: {}", words.replace('`', "")));
    let about = match key.limits {
        Limits::Choice => format!("{sentence} {values}{unset}"),
        _ => format!("{sentence} [{values}{unset}]"),
    };
    let live = match (default_of(key, defaults), key.example) {
        (Some(value), _) => format!("{name} = {value}\n"),
        (None, Some(value)) if is_live(key) => format!("{name} = {value}\n"),
        (None, value) => format!("# {name} = {}\n", value.unwrap_or_default()),
    };
    comment(&about) + &live
}

/// Returns whether the template sets a key that has no default: the camera, the altitude and the preset.
fn is_live(key: &Key) -> bool {
    let of_camera = key.section() == "camera" && key.unset.is_none();
    of_camera || matches!(key.path, "camera.model" | "body.altitude_km") || key.path == "preset"
}
