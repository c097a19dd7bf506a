//! Places of keys in a TOML file, and errors that name these places in the terms of the file.

use std::ops::Range;
use std::path::Path;

use hzn_core::body::MAX_LATITUDES;
use hzn_core::error::{ConfigError, Limit};
use hzn_core::region::{MAX_CORNERS, MAX_POLYGONS};
use toml::de::{DeTable, DeValue};

use crate::Problem;
use crate::keys::{self, Limits};
use crate::nearest::suggestion;

/// A key, or a list within a list, with its place: the dotted path, the bytes of the key and the bytes of the value.
pub(crate) struct KeyPlace {
    pub(crate) path: Vec<String>,
    pub(crate) key: Range<usize>,
    pub(crate) value: Range<usize>,
    /// Number of items of a list; 0 for other values.
    items: usize,
}

impl KeyPlace {
    fn field(&self) -> String {
        field_name(&self.path)
    }
}

/// Formats `consensus.threshold_px` as it is in the file: `[consensus] threshold_px`. A key of the second of several
/// tables is `[[bodies]] 2 radius_km`. The third of several lists is `[mask] polygons_px 3`, and the second list in it
/// is `[mask] polygons_px 3.2`.
pub(crate) fn field_name(path: &[String]) -> String {
    let nth = |place: &String| place.parse::<usize>().ok().map(|n| n + 1);
    let key = |rest: &[String]| {
        let names = rest.iter().take_while(|part| nth(part).is_none()).count();
        let places: Vec<String> = rest.iter().filter_map(nth).map(|n| n.to_string()).collect();
        format!("{} {}", rest.get(..names).unwrap_or_default().join("."), places.join(".")).trim_end().to_owned()
    };
    match path {
        [] => String::new(),
        [one] => one.clone(),
        [section, place, rest @ ..] if let Some(nth) = nth(place) => {
            format!("[[{section}]] {nth} {}", key(rest)).trim_end().to_owned()
        }
        [section, rest @ ..] => format!("[{section}] {}", key(rest)),
    }
}

/// Returns every key of the file, including those of inner tables, and the lists within lists.
pub(crate) fn find_places(table: &DeTable<'_>) -> Vec<KeyPlace> {
    fn walk(table: &DeTable<'_>, path: &mut Vec<String>, out: &mut Vec<KeyPlace>) {
        for (key, value) in table {
            path.push(key.get_ref().to_string());
            enter(value.get_ref(), [key.span(), value.span()], path, out);
            path.pop();
        }
    }
    fn enter(value: &DeValue<'_>, [key, span]: [Range<usize>; 2], path: &mut Vec<String>, out: &mut Vec<KeyPlace>) {
        let items = value.as_array().map_or(0, |items| items.len());
        out.push(KeyPlace { path: path.clone(), key, value: span, items });
        match value {
            DeValue::Table(inner) => walk(inner, path, out),
            DeValue::Array(items) => {
                for (i, item) in items.iter().enumerate() {
                    if matches!(item.get_ref(), DeValue::Table(_) | DeValue::Array(_)) {
                        path.push(i.to_string());
                        enter(item.get_ref(), [item.span(), item.span()], path, out);
                        path.pop();
                    }
                }
            }
            _ => {}
        }
    }
    let mut out = Vec::new();
    walk(table, &mut Vec::new(), &mut out);
    out
}

/// Refuses the first list that is longer than the sensor's limit. serde alone would refuse some lists without their
/// length, and would read only the first values of others.
pub(crate) fn check_list_lengths(text: &str, path: &Path, places: &[KeyPlace]) -> Result<(), Problem> {
    const ROWS: &str = "limb_height_by_latitude_km";
    const QUATERNION: &str = "q_vehicle_from_camera_wxyz";
    for place in places {
        let parts: Vec<&str> = place.path.iter().map(String::as_str).collect();
        let (max, what) = match parts[..] {
            // The limit is that of `brown-conrady`.
            ["camera", "k"] => (5, "numbers"),
            ["mount" | "attitude_mount", QUATERNION] | ["cameras", _, "mount", QUATERNION] => (4, "numbers"),
            ["rig", "mount", "q_vehicle_from_rig_wxyz"] | ["head", _, "mount", "q_rig_from_camera_wxyz"] => {
                (4, "numbers")
            }
            ["head", _, "mount", "covariance_deg2"] => (6, "numbers"),
            ["mask", "polygons_px"] => (MAX_POLYGONS, "polygons"),
            ["mask", "polygons_px", _] => (MAX_CORNERS, "corners"),
            ["body", ROWS] | ["bodies", _, ROWS] => (MAX_LATITUDES, "rows"),
            ["mask", "polygons_px", _, _]
            | ["body", ROWS, _]
            | ["bodies", _, ROWS, _]
            | ["gates", "altitude_limits_km"] => (2, "numbers"),
            _ => continue,
        };
        if place.items > max {
            let what = format!("has {} {what}; at most {max} are allowed", place.items);
            return Err(Problem::new(path, what).at_offset(text, place.key.start).in_field(place.field()));
        }
    }
    Ok(())
}

/// Returns the innermost key whose name or value contains the byte `offset`.
fn find_place(places: &[KeyPlace], offset: usize) -> Option<&KeyPlace> {
    let holds = |p: &&KeyPlace| p.key.contains(&offset) || p.value.contains(&offset);
    places.iter().filter(holds).max_by_key(|p| p.path.len())
}

/// Converts an error of the TOML syntax.
pub(crate) fn translate_syntax_error(error: &toml::de::Error, text: &str, path: &Path) -> Problem {
    let is_comma = error.span().is_some_and(|span| has_decimal_comma(text, span.start));
    let why = if is_comma {
        "a number has a decimal comma; write a point".to_owned()
    } else {
        error.message().replace('\n', "; ")
    };
    let problem = Problem::new(path, format!("not valid TOML: {why}"));
    match error.span() {
        Some(span) => problem.at_exactly(text, span.start),
        None => problem,
    }
}

/// Returns whether there is a comma between two digits at this byte or next to it.
fn has_decimal_comma(text: &str, offset: usize) -> bool {
    let bytes = text.as_bytes().get(offset.saturating_sub(2)..).unwrap_or_default();
    let is_comma = |w: &[u8]| matches!(w, [a, b',', c] if a.is_ascii_digit() && c.is_ascii_digit());
    bytes.get(..4.min(bytes.len())).unwrap_or_default().windows(3).any(is_comma)
}

/// Translates serde's error into the terms of the file. `extra_keys` are top-level keys that serde does not know.
pub(crate) fn translate_serde_error(
    error: &toml::de::Error,
    text: &str,
    path: &Path,
    places: &[KeyPlace],
    extra_keys: &[&'static str],
) -> Problem {
    let message = error.message();
    let offset = error.span().map(|s| s.start);
    let place = match error.span() {
        // The place is the table that lacks the field, which may be the whole file.
        Some(span) if message.starts_with("missing field") => places.iter().find(|p| p.value == span),
        _ => offset.and_then(|o| find_place(places, o)),
    };
    let attach = |p: Problem| match offset {
        // An error of the whole table, for example a missing section, points to the first byte. Its place is not shown.
        Some(o) if place.is_some() => p.at_offset(text, o),
        _ => p,
    };
    let mut quoted = message.split('`').skip(1).step_by(2);
    let first = quoted.next().unwrap_or_default();
    let valid: Vec<&str> = quoted.collect();
    let field = place.map(KeyPlace::field).unwrap_or_default();
    let problem = if message.starts_with("unknown field") {
        let valid: Vec<&str> = match place.map(|p| p.path.as_slice()) {
            Some([_]) => valid.into_iter().chain(extra_keys.iter().copied()).collect(),
            Some([section, _]) if section == "camera" => valid.into_iter().chain(["file"]).collect(),
            _ => valid,
        };
        let what = if field.is_empty() || place.is_some_and(|p| p.path.len() == 1) { "section or key" } else { "key" };
        let of_sections = place.filter(|p| p.path.len() == 1).and_then(|_| sections_with(first, &valid));
        let hint = of_sections.unwrap_or_else(|| suggestion(first, &valid));
        Problem::new(path, format!("unknown {what}{hint}")).in_field(field)
    } else if message.starts_with("unknown variant") {
        let what = format!("{first:?} is not a valid value{}", suggestion(first, &valid));
        Problem::new(path, what).in_field(field)
    } else if message.starts_with("missing field") {
        let mut p: Vec<String> = place.map(|p| p.path.clone()).unwrap_or_default();
        p.push(first.to_owned());
        let what = if p.len() == 1 {
            format!("the section [{first}] is missing")
        } else if p.first().is_some_and(|s| s == "camera") {
            "missing; write it, or use a `file` with the calibration".to_owned()
        } else {
            "missing".to_owned()
        };
        Problem::new(path, what).in_field(field_name(&p))
    } else {
        let what = explain_whole_number(message, place).or_else(|| explain_shape(message));
        let problem = Problem::new(path, what.unwrap_or_else(|| in_words(message)));
        if field.is_empty() { problem } else { problem.in_field(field) }
    };
    attach(problem)
}

/// Returns serde's message in the words of a file.
fn in_words(message: &str) -> String {
    let message = message.replace("expected f64", "expected a number");
    message.replace("floating point `", "number `").replace('\n', "; ")
}

/// Says which sections of a sensor.toml have a key that was written above all sections. `valid` are the sections of the
/// file; `None` if none of them has it.
fn sections_with(name: &str, valid: &[&str]) -> Option<String> {
    let own = keys::all().filter(|key| key.name() == name && valid.contains(&key.section()));
    let sections: Vec<String> = own.map(|key| format!("[{}]", key.section())).collect();
    (!sections.is_empty()).then(|| format!("; it is a key of {}", sections.join(", ")))
}

/// Returns the message for a wrong value of a whole-number key, with the limits of that key; `None` for other keys.
fn explain_whole_number(message: &str, place: Option<&KeyPlace>) -> Option<String> {
    let (found, expected) = message.split_once(", expected ")?;
    let max = match expected {
        "u8" => f64::from(u8::MAX),
        "u16" => f64::from(u16::MAX),
        "u32" => f64::from(u32::MAX),
        _ => return None,
    };
    let key = place.and_then(|p| keys::find_parts(&p.path));
    let rule = match key.map(|key| &key.limits) {
        Some(Limits::Number { low, high, .. }) => format!("between {low} and {}", high.min(max)),
        Some(Limits::Rule(words)) if words.contains(" to ") => (*words).to_owned(),
        _ => format!("between 0 and {max}"),
    };
    Some(match found.strip_prefix("invalid value: integer `").and_then(|n| n.strip_suffix('`')) {
        Some(number) => format!("{number} is refused: must be {rule}"),
        None => {
            let found = found.replace("floating point `", "number `");
            let found = found.replace("invalid type: map", "is a table").replace("invalid type: sequence", "is a list");
            format!("{found}: must be a whole number, {rule}")
        }
    })
}

/// Returns the message for a list or a table where something else belongs, or the other way round, without the terms of
/// Rust; `None` for other messages.
fn explain_shape(message: &str) -> Option<String> {
    if let Some((count, wanted)) = message.strip_prefix("invalid length ").and_then(|m| m.split_once(", expected ")) {
        return match wanted.strip_prefix("an array of length ") {
            Some(length) => Some(format!("has {count} values; {length} are expected")),
            None => wanted.starts_with("struct ").then(|| "is a list; a table is expected".to_owned()),
        };
    }
    let (is, wanted) = message.strip_prefix("invalid type: ")?.split_once(", expected ")?;
    let is_inner = |word: &str| matches!(word, "map" | "sequence");
    let belongs = match wanted {
        "a sequence" => "a list",
        _ if wanted.starts_with("an array of length ") => "a list",
        "a map" => "a table",
        _ if wanted.starts_with("struct ") => "a table",
        // A number, a text or a flag in place of another one has a message that shows the value.
        _ if !is_inner(is) => return None,
        "f64" => "a number",
        "a boolean" => "true or false",
        "a string" => "a text",
        other => other,
    };
    let is = match is.split(' ').next().unwrap_or_default() {
        "map" => "a table",
        "sequence" => "a list",
        "integer" | "floating" => "a number",
        "string" => "a text",
        _ => "a truth value",
    };
    Some(format!("is {is}; {belongs} is expected"))
}

/// Converts an error of hzn-core, with the place of the value.
pub(crate) fn translate_config_error(error: &ConfigError, text: &str, path: &Path, places: &[KeyPlace]) -> Problem {
    let what = match error.limit {
        // The value is missing.
        rule @ (Limit::Rule(_) | Limit::Feature { .. }) if error.value.is_nan() => rule.to_string(),
        rule if error.value.is_nan() => format!("nan is refused: {rule}"),
        rule => format!("{} is refused: {rule}", error.value),
    };
    problem_at_key(error.field, error.body, what, text, path, places)
}

/// Returns a problem with a key in hzn-core's notation, for example `camera.fx_px`. `body` is the index in
/// `[[bodies]]`.
pub(crate) fn problem_at_key(
    key: &str,
    body: Option<u8>,
    what: String,
    text: &str,
    path: &Path,
    places: &[KeyPlace],
) -> Problem {
    let mut parts: Vec<String> = key.split('.').map(str::to_owned).collect();
    if let Some(which) = body {
        // hzn-core writes `body.` before the body's own keys, but not before its threshold and its edge errors.
        parts.retain(|p| p != "body");
        parts.splice(0..0, ["bodies".to_owned(), which.to_string()]);
    }
    let problem = Problem::new(path, what).in_field(field_name(&parts));
    // The place of the field, or of the section that lacks it.
    let place = (1..=parts.len()).rev().find_map(|n| places.iter().find(|p| p.path == parts[..n]));
    match place {
        Some(place) => problem.at_offset(text, place.key.start),
        None => problem,
    }
}
