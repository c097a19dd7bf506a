//! The tables of keys in the documentation.

use super::{Key, Table, default_of, defaults, keys_of_file, limits_in_words, sections};

/// The lines that enclose the tables on their page.
const MARKS: [&str; 2] = ["<!-- keys: `cargo xtask keys` writes these tables -->\n", "<!-- end of keys -->\n"];

/// Returns a page with the current tables between its marks; `None` if the page has no marks.
pub fn insert_table(page: &str) -> Option<String> {
    let [begin, end] = MARKS;
    let (before, rest) = page.split_once(begin)?;
    let (_, after) = rest.split_once(end)?;
    Some(format!("{before}{begin}\n{}\n{end}{after}", markdown()))
}

/// Writes the tables as Markdown: each section has a heading, and therefore an anchor of its own, such as `#camera`.
pub fn markdown() -> String {
    let defaults = defaults();
    let head = "| key | meaning | values | default | in flight |\n|---|---|---|---|---|\n";
    let mut out = format!("### Above the sections\n\n{head}{}", row(&super::PRESET, &defaults));
    for table in sections() {
        out += &format!("\n### [{}]\n\n{}\n\n{head}", table.name, about(table));
        for key in table.keys.iter().chain(keys_of_file(table.name)) {
            out += &row(key, &defaults);
        }
    }
    out
}

/// Returns the purpose of a section: its text without its name.
pub(super) fn about(table: &Table) -> String {
    let text = table.doc.split("\n\n").next().unwrap_or_default();
    let text = text.split_once("sensor.toml").map_or(text, |(_, rest)| rest);
    let text = text.trim_start_matches([':', ',', ' ']).split_whitespace().collect::<Vec<_>>().join(" ");
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

fn row(key: &Key, defaults: &toml::Table) -> String {
    let meaning = key.sentence().split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|");
    let default = match (key.unset, default_of(key, defaults)) {
        (Some(words), _) => words.to_owned(),
        (None, Some(value)) => format!("`{value}`"),
        (None, None) => "required".to_owned(),
    };
    let flight = match (key.flight, key.path) {
        (Some(_), "camera.k") => "8 to 12".to_owned(),
        (Some(_), "mount.q_vehicle_from_camera_wxyz") => "20 to 23".to_owned(),
        (None, "mask.polygons_px") => "200 to 207, 1000 on".to_owned(),
        (Some(number), _) => number.to_string(),
        (None, _) => "–".to_owned(),
    };
    format!("| `{}` | {meaning} | {} | {default} | {flight} |\n", key.name(), limits_in_words(key))
}
