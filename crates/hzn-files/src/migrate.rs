//! Names of version 0.1.0 in sensor.toml, scene.toml and fuse.toml. A file with an old name is refused with the new
//! one, because a key that silently means nothing is worse than an error; [`migrate`] rewrites the text of such a file.

use std::path::Path;

use toml::de::DeTable;

use crate::Problem;
use crate::located::{KeyPlace, field_name, find_places, translate_syntax_error};

/// Sections of version 0.1.0, at the top of a file, with their new names.
const SECTIONS: [(&str, &str); 7] = [
    ("gate", "brightness"),
    ("binarize", "threshold"),
    ("candidates", "edge_points"),
    ("reject", "consensus"),
    ("estimate", "fit"),
    ("select", "gates"),
    ("recover", "retry"),
];

/// Keys of version 0.1.0, in any section, with their new names.
const KEYS: [(&str, &str); 4] = [
    ("binarize", "threshold"),
    ("q_body_from_camera_wxyz", "q_vehicle_from_camera_wxyz"),
    ("body_from_camera", "vehicle_from_camera"),
    ("cam_to_ecef_wxyz", "q_fixed_from_camera_wxyz"),
];

/// Keys of version 0.1.0 that are constants now, by section, because no scene and no flight needed another value.
const CONSTANTS: [(&str, &str); 18] = [
    ("gates", "ambiguous_deg"),
    ("gates", "ambiguous_score"),
    ("gates", "band_step"),
    ("gates", "certain_share"),
    ("gates", "certain_support"),
    ("gates", "departure_contrast"),
    ("gates", "departure_turn_deg"),
    ("gates", "max_nearby"),
    ("gates", "max_way"),
    ("gates", "min_inlier_share"),
    ("gates", "min_side_sigma"),
    ("gates", "min_sun_elevation_deg"),
    ("gates", "min_support_whole"),
    ("gates", "moon_bloom_px"),
    ("gates", "moon_size"),
    ("gates", "rival_floor_px"),
    ("gates", "sun_size"),
    ("retry", "min_part"),
];

/// What [`migrate`] changed at one place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// Line of the file, from 1.
    pub line: usize,
    /// The key as it was, for example `[reject]` or `[select] max_way`.
    pub field: String,
    /// The new name of its last part; `None` for a key that is a constant now, whose lines become comments.
    pub new: Option<&'static str>,
}

/// Returns what is to be done with a key: `Some(Some(name))` if it has a new name, `Some(None)` if it is a constant
/// now.
fn what_to_do(path: &[String]) -> Option<Option<&'static str>> {
    let find = |names: &[(&str, &'static str)], old: &str| names.iter().find(|(o, _)| *o == old).map(|(_, new)| *new);
    match path {
        [section] => find(&SECTIONS, section).map(Some),
        [section, key] if CONSTANTS.contains(&(find(&SECTIONS, section).unwrap_or(section), key)) => Some(None),
        [.., key] => find(&KEYS, key).map(Some),
        [] => None,
    }
}

/// Refuses the first old name of a file.
pub(crate) fn refuse_old_names(text: &str, path: &Path, places: &[KeyPlace]) -> Result<(), Problem> {
    let found = places.iter().find_map(|place| what_to_do(&place.path).map(|new| (place, new)));
    found.map_or(Ok(()), |(place, new)| {
        let command = format!("`hzn migrate {}`", path.display());
        let what = match new {
            Some(new) => format!("this name is now {new}; {command} rewrites the file"),
            None => format!("this key is a constant now; remove its line, or {command} makes it a comment"),
        };
        Err(Problem::new(path, what).at_offset(text, place.key.start).in_field(section_or_key(&place.path)))
    })
}

/// Returns a key as it is in the file, with brackets also for a section alone.
fn section_or_key(path: &[String]) -> String {
    match path {
        [section] => format!("[{section}]"),
        _ => field_name(path),
    }
}

/// Replaces all old names of a file by the new ones, and makes comments of keys that are constants now. Everything else
/// stays as it is, comments and spaces too. Returns the new text and what was changed, in the order of the file; the
/// list is empty if the file has no old name.
///
/// ```
/// let old = "[reject]  # outliers\nthreshold_px = 2.0\n";
/// let (new, changes) = hzn_files::migrate::migrate(old, "sensor.toml".as_ref()).expect("TOML");
/// assert_eq!(new, "[consensus]  # outliers\nthreshold_px = 2.0\n");
/// assert_eq!((changes[0].field.as_str(), changes[0].new), ("[reject]", Some("consensus")));
/// ```
///
/// # Errors
/// The text is not TOML; an old name stands next to its new one, for example `[select]` next to `[gates]`; or a key
/// that is a constant now does not have a line of its own.
pub fn migrate(text: &str, path: &Path) -> Result<(String, Vec<Change>), Problem> {
    let mut changes: Vec<Change> = Vec::new();
    let mut now = text.to_owned();
    // A dotted key such as `select.max_rms_px` shows only the first of several places of `select`, so the search
    // repeats until nothing is left. Each round changes at least one place.
    loop {
        let (next, mut found) = migrate_once(&now, path)?;
        if found.is_empty() {
            break;
        }
        changes.append(&mut found);
        now = next;
    }
    changes.sort_by_key(|change| change.line);
    Ok((now, changes))
}

fn migrate_once(text: &str, path: &Path) -> Result<(String, Vec<Change>), Problem> {
    let table = DeTable::parse(text).map_err(|e| translate_syntax_error(&e, text, path))?;
    let places = find_places(table.get_ref());
    let (mut next, mut changes) = (text.to_owned(), Vec::new());
    let mut old: Vec<_> = places.iter().filter_map(|place| what_to_do(&place.path).map(|new| (place, new))).collect();
    // A comment sign moves the keys on its line, so names are replaced in a later round.
    if old.iter().any(|(_, new)| new.is_none()) {
        old.retain(|(_, new)| new.is_none());
    }
    // From the end, so that the places before stay valid.
    old.sort_by_key(|(place, _)| std::cmp::Reverse(place.key.start));
    for (place, new) in old {
        let field = section_or_key(&place.path);
        let refused = |what: String| Problem::new(path, what).at_offset(text, place.key.start).in_field(&*field);
        match new {
            Some(new) => {
                if let Some(other) = taken_name(text, place, new, &places) {
                    let what =
                        format!("the file has {other} too, which is the new name; write all of it under {other}");
                    return Err(refused(what));
                }
                next.replace_range(place.key.clone(), new);
            }
            None => {
                let lines = own_lines(text, place).ok_or_else(|| {
                    refused("this key is a constant now, and it has no line of its own; remove it".to_owned())
                })?;
                // From the end again.
                lines.into_iter().rev().for_each(|start| next.insert_str(start, "# "));
            }
        }
        let line = text.get(..place.key.start).map_or(1, |before| before.matches('\n').count() + 1);
        changes.push(Change { line, field, new });
    }
    Ok((next, changes))
}

/// Returns the new name of a key as it is in the file, if the file has it already.
fn taken_name(text: &str, place: &KeyPlace, new: &str, places: &[KeyPlace]) -> Option<String> {
    let mut sibling = place.path.clone();
    sibling.pop();
    sibling.push(new.to_owned());
    let taken = places.iter().find(|other| other.path == sibling)?;
    // Parts of one section may have been renamed in an earlier round, if they are dotted keys.
    (!is_dotted(text, taken) || !is_dotted(text, place)).then(|| section_or_key(&taken.path))
}

/// Returns where the lines of a key and its value begin; `None` if other keys are on them.
fn own_lines(text: &str, place: &KeyPlace) -> Option<Vec<usize>> {
    let start = text.get(..place.key.start)?.rfind('\n').map_or(0, |n| n + 1);
    let before = text.get(start..place.key.start)?;
    // What is before a dotted key is the path to it.
    let is_alone = before.chars().all(|c| c.is_alphanumeric() || "_-.\"' \t".contains(c));
    let value = text.get(start..place.value.end)?;
    let breaks = value.match_indices('\n').map(|(n, _)| start + n + 1);
    is_alone.then(|| std::iter::once(start).chain(breaks).collect())
}

/// Returns whether a key is the first part of a dotted key such as `select.max_way`.
fn is_dotted(text: &str, place: &KeyPlace) -> bool {
    text.get(place.key.end..).is_some_and(|rest| rest.trim_start().starts_with('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn renamed(text: &str) -> String {
        migrate(text, Path::new("sensor.toml")).unwrap().0
    }

    #[test]
    fn only_names_change() {
        let old = "# mine\n[mount]\nq_body_from_camera_wxyz = [1, 0, 0, 0] # exact\n\n[[bodies]]\nkind = \"earth\"\n  \
                   [bodies.binarize] # the Earth's\n  method = \"otsu\"\n[select]\nmax_way = 2.0\nmax_rms_px = 1.0\n";
        let new = "# mine\n[mount]\nq_vehicle_from_camera_wxyz = [1, 0, 0, 0] # exact\n\n[[bodies]]\nkind = \"earth\"\n\
                   \x20 [bodies.threshold] # the Earth's\n  method = \"otsu\"\n[gates]\n# max_way = 2.0\n\
                   max_rms_px = 1.0\n";
        assert_eq!(renamed(old), new);
        assert_eq!(migrate(new, Path::new("s.toml")).unwrap(), (new.to_owned(), Vec::new()));
    }

    #[test]
    fn dotted_inline_and_quoted_keys() {
        assert_eq!(
            renamed("select.max_way = 2\nreject.seed = 1\nselect.min_inliers = 30\n"),
            "# select.max_way = 2\nconsensus.seed = 1\ngates.min_inliers = 30\n"
        );
        assert_eq!(renamed("body = { binarize = { scale = 2.0 } }\n"), "body = { threshold = { scale = 2.0 } }\n");
        assert_eq!(renamed("[\"recover\"]\nlevels = []\n"), "[retry]\nlevels = []\n");
    }

    #[test]
    fn a_constant_becomes_a_comment() {
        assert_eq!(
            renamed(
                "[gates]\n  sun_size = [\n    0.9, 12.0 ]  # as it blooms\nmin_inliers = 30\n[retry]\nmin_part = 0.5"
            ),
            "[gates]\n#   sun_size = [\n#     0.9, 12.0 ]  # as it blooms\nmin_inliers = 30\n[retry]\n# min_part = 0.5"
        );
    }

    #[test]
    fn an_old_name_next_to_the_new_one_is_left_to_the_user() {
        let error = |text: &str| migrate(text, Path::new("s.toml")).unwrap_err().to_string();
        assert_eq!(
            error("[gates]\nmin_inliers = 30\n[select]\nmax_rms_px = 2\n"),
            "s.toml:3: [select]: the file has [gates] too, which is the new name; write all of it under [gates]"
        );
        assert!(error("[body]\nthreshold = {}\nbinarize = {}\n").contains("[body] threshold too"));
        assert!(
            error("gates = { max_nearby = 0.5, min_inliers = 30 }\n").contains("has no line of its own; remove it")
        );
        assert!(error("[select\n").contains("not valid TOML"));
    }

    #[test]
    fn every_old_name_is_refused_with_the_new_one() {
        let refused = |text: &str| {
            let table = DeTable::parse(text).unwrap();
            refuse_old_names(text, Path::new("s.toml"), &find_places(table.get_ref())).map_err(|e| e.to_string())
        };
        for (old, new) in SECTIONS {
            let what = format!("this name is now {new}; `hzn migrate s.toml` rewrites the file");
            assert_eq!(refused(&format!("[{old}]\n")), Err(format!("s.toml:1: [{old}]: {what}")));
        }
        for (old, new) in KEYS {
            let why = refused(&format!("[any]\n{old} = 1\n")).unwrap_err();
            assert!(why.starts_with(&format!("s.toml:2: [any] {old}: this name is now {new}; ")), "{why}");
        }
        for (section, key) in CONSTANTS {
            let why = refused(&format!("[{section}]\n{key} = 1\n")).unwrap_err();
            assert!(why.contains(&format!("[{section}] {key}: this key is a constant now; ")), "{why}");
        }
        assert_eq!(refused("[gates]\nmin_inliers = 30\n"), Ok(()));
    }
}
