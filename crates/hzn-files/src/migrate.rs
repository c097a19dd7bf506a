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
const KEYS: [(&str, &str); 5] = [
    ("binarize", "threshold"),
    ("max_way", "max_path"),
    ("q_body_from_camera_wxyz", "q_vehicle_from_camera_wxyz"),
    ("body_from_camera", "vehicle_from_camera"),
    ("cam_to_ecef_wxyz", "q_fixed_from_camera_wxyz"),
];

/// A name that [`migrate`] replaced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Renamed {
    /// Line of the file, from 1.
    pub line: usize,
    /// The key as it was, for example `[reject]` or `[select] max_way`.
    pub field: String,
    /// The new name of its last part.
    pub new: &'static str,
}

/// Returns the new name of the last part of a key, if that part is an old name.
fn new_name(path: &[String]) -> Option<&'static str> {
    let names: &[(&str, &str)] = if path.len() == 1 { &SECTIONS } else { &KEYS };
    names.iter().find(|(old, _)| path.last().is_some_and(|last| last == old)).map(|(_, new)| *new)
}

/// Refuses the first old name of a file.
pub(crate) fn refuse_old_names(text: &str, path: &Path, places: &[KeyPlace]) -> Result<(), Problem> {
    let found = places.iter().find_map(|place| new_name(&place.path).map(|new| (place, new)));
    found.map_or(Ok(()), |(place, new)| {
        let what = format!("this name is now {new}; `hzn migrate {}` rewrites the file", path.display());
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

/// Replaces all old names of a file by the new ones. Everything else stays as it is, comments and spaces too. Returns
/// the new text and what was replaced, in the order of the file; the list is empty if the file has no old name.
///
/// ```
/// let old = "[reject]  # outliers\nthreshold_px = 2.0\n";
/// let (new, renamed) = hzn_files::migrate::migrate(old, "sensor.toml".as_ref()).expect("TOML");
/// assert_eq!(new, "[consensus]  # outliers\nthreshold_px = 2.0\n");
/// assert_eq!((renamed[0].field.as_str(), renamed[0].new), ("[reject]", "consensus"));
/// ```
///
/// # Errors
/// The text is not TOML, or an old name stands next to its new one, for example `[select]` next to `[gates]`.
pub fn migrate(text: &str, path: &Path) -> Result<(String, Vec<Renamed>), Problem> {
    let mut renamed: Vec<Renamed> = Vec::new();
    let mut now = text.to_owned();
    // A dotted key such as `select.max_way` shows only the first of several places of `select`, so the search repeats
    // until nothing is left. Each round replaces at least one name.
    loop {
        let (next, mut found) = migrate_once(&now, path)?;
        if found.is_empty() {
            break;
        }
        renamed.append(&mut found);
        now = next;
    }
    renamed.sort_by_key(|r| r.line);
    Ok((now, renamed))
}

fn migrate_once(text: &str, path: &Path) -> Result<(String, Vec<Renamed>), Problem> {
    let table = DeTable::parse(text).map_err(|e| translate_syntax_error(&e, text, path))?;
    let places = find_places(table.get_ref());
    let (mut next, mut renamed) = (text.to_owned(), Vec::new());
    let mut old: Vec<_> = places.iter().filter_map(|place| new_name(&place.path).map(|new| (place, new))).collect();
    // From the end, so that the places before stay valid.
    old.sort_by_key(|(place, _)| std::cmp::Reverse(place.key.start));
    for (place, new) in old {
        let mut sibling = place.path.clone();
        sibling.pop();
        sibling.push(new.to_owned());
        let field = section_or_key(&place.path);
        let taken = places.iter().find(|other| other.path == sibling);
        // Parts of one section may have been renamed in an earlier round, if they are dotted keys.
        if let Some(taken) = taken.filter(|taken| !is_dotted(text, taken) || !is_dotted(text, place)) {
            let other = section_or_key(&taken.path);
            let what = format!("the file has {other} too, which is the new name; write all of it under {other}");
            return Err(Problem::new(path, what).at_offset(text, place.key.start).in_field(field));
        }
        let line = text.get(..place.key.start).map_or(1, |before| before.matches('\n').count() + 1);
        next.replace_range(place.key.clone(), new);
        renamed.push(Renamed { line, field, new });
    }
    Ok((next, renamed))
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
                   [bodies.binarize] # the Earth's\n  method = \"otsu\"\n[select]\nmax_way = 2.0\n";
        let new = "# mine\n[mount]\nq_vehicle_from_camera_wxyz = [1, 0, 0, 0] # exact\n\n[[bodies]]\nkind = \"earth\"\n\
                   \x20 [bodies.threshold] # the Earth's\n  method = \"otsu\"\n[gates]\nmax_path = 2.0\n";
        assert_eq!(renamed(old), new);
        assert_eq!(migrate(new, Path::new("s.toml")).unwrap(), (new.to_owned(), Vec::new()));
    }

    #[test]
    fn dotted_inline_and_quoted_keys() {
        assert_eq!(
            renamed("select.max_way = 2\nreject.seed = 1\nselect.min_inliers = 30\n"),
            "gates.max_path = 2\nconsensus.seed = 1\ngates.min_inliers = 30\n"
        );
        assert_eq!(renamed("body = { binarize = { scale = 2.0 } }\n"), "body = { threshold = { scale = 2.0 } }\n");
        assert_eq!(renamed("[\"recover\"]\nlevels = []\n"), "[retry]\nlevels = []\n");
    }

    #[test]
    fn an_old_name_next_to_the_new_one_is_left_to_the_user() {
        let error = |text: &str| migrate(text, Path::new("s.toml")).unwrap_err().to_string();
        assert_eq!(
            error("[gates]\nmin_inliers = 30\n[select]\nmax_way = 2\n"),
            "s.toml:3: [select]: the file has [gates] too, which is the new name; write all of it under [gates]"
        );
        assert!(error("[gates]\nmax_path = 1\nmax_way = 2\n").contains("[gates] max_path too"));
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
        assert_eq!(refused("[gates]\nmax_path = 2\n"), Ok(()));
    }
}
