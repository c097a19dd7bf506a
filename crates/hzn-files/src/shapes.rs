//! Tells a section or a key of a sensor.toml that has another shape than it needs: a list where a table belongs, or a
//! table where a number belongs. serde alone would tell it in the terms of Rust.

use std::path::Path;

use hzn_core::report::MAX_BODIES;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use crate::Problem;
use crate::keys::{self, Form, Key};
use crate::located::field_name;

/// The language in which the sensor is written, and which messages use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notation {
    /// A file in TOML.
    Toml,
    /// Arguments and dictionaries of Python.
    Python,
}

/// A value of a wrong shape.
struct WrongShape {
    /// The path of its key.
    path: Vec<String>,
    /// Place of the value in the text, in bytes.
    offset: usize,
    /// What it is, and what to write.
    what: String,
}

/// Checks the shape of every section and key of a sensor.toml. A text that is no TOML, and unknown names, are left to
/// [`crate::sensor::parse`].
///
/// # Errors
/// The first value with a wrong shape: its section and key, what it is, and what to write in this notation.
///
/// ```
/// use hzn_files::shapes::{Notation, check};
///
/// let why = check("bodies = {}", Notation::Python).unwrap_err();
/// assert!(why.starts_with("bodies: is a dict; write a list of dicts"), "{why}");
/// ```
pub fn check(text: &str, notation: Notation) -> Result<(), String> {
    let Ok(table) = DeTable::parse(text) else { return Ok(()) };
    match find_wrong(table.get_ref(), notation) {
        Some(WrongShape { path, what, .. }) => Err(format!("{}: {what}", field_name(&path))),
        None => Ok(()),
    }
}

/// Refuses the first value with a wrong shape in a file.
pub(crate) fn refuse_wrong_shape(table: &DeTable<'_>, text: &str, path: &Path) -> Result<(), Problem> {
    match find_wrong(table, Notation::Toml) {
        None => Ok(()),
        Some(WrongShape { path: key, offset, what }) => {
            Err(Problem::new(path, what).at_offset(text, offset).in_field(field_name(&key)))
        }
    }
}

/// Refuses `[[bodies]]` together with `[body]`, and too many of them.
pub(crate) fn check_bodies(table: &DeTable<'_>, text: &str, path: &Path) -> Result<(), Problem> {
    let Some((key, bodies)) = table.get_key_value("bodies") else { return Ok(()) };
    let refused = |what: &str| Err(Problem::new(path, what).at_offset(text, key.span().start).in_field("[[bodies]]"));
    if table.contains_key("body") {
        return refused("cannot be combined with [body]; write one body as [body], or all bodies as [[bodies]]");
    }
    let count = bodies.get_ref().as_array().map_or(0, |bodies| bodies.len());
    if count > MAX_BODIES {
        return refused(&format!("{count} are too many; at most {MAX_BODIES} bodies are possible"));
    }
    Ok(())
}

/// Returns the first value with a wrong shape.
fn find_wrong(table: &DeTable<'_>, notation: Notation) -> Option<WrongShape> {
    Walk { notation, defaults: keys::defaults(), path: Vec::new() }.table(table)
}

/// What belongs at a place.
enum Wanted {
    /// A table: a section or one of several bodies, by the name of the section.
    Section(&'static str),
    /// A list of bodies.
    Bodies,
    /// The value of a key.
    Key(&'static Key),
}

struct Walk {
    notation: Notation,
    defaults: Table,
    path: Vec<String>,
}

impl Walk {
    fn table(&mut self, table: &DeTable<'_>) -> Option<WrongShape> {
        table.iter().find_map(|(key, value)| {
            self.path.push(key.get_ref().to_string());
            let found = self.value(value.get_ref(), value.span().start);
            self.path.pop();
            found
        })
    }

    fn value(&mut self, value: &DeValue<'_>, offset: usize) -> Option<WrongShape> {
        if let Some(wanted) = self.wanted()
            && let Some(is) = self.describe_wrong(value, &wanted)
        {
            let what = format!("{is}; write {}, for example {}", self.form(&wanted), self.example(&wanted, value));
            return Some(WrongShape { path: self.path.clone(), offset, what });
        }
        match value {
            DeValue::Table(inner) => self.table(inner),
            DeValue::Array(items) if self.path == ["bodies"] => items.iter().enumerate().find_map(|(i, item)| {
                self.path.push(i.to_string());
                let found = self.value(item.get_ref(), item.span().start);
                self.path.pop();
                found
            }),
            _ => None,
        }
    }

    /// Returns what belongs at the current path; `None` for a name that does not exist.
    fn wanted(&self) -> Option<Wanted> {
        let section = |name: &str| keys::sections().find(|table| table.name == name).map(|table| table.name);
        let names: Vec<&str> = self.path.iter().map(String::as_str).collect();
        match names[..] {
            ["bodies"] => Some(Wanted::Bodies),
            ["bodies", _] => section("body").map(Wanted::Section),
            [name] if let Some(name) = section(name) => Some(Wanted::Section(name)),
            _ => keys::find_parts(&self.path).map(|key| match key.form {
                // A body has some sections of its own.
                Form::Table => section(key.name()).map_or(Wanted::Key(key), Wanted::Section),
                _ => Wanted::Key(key),
            }),
        }
    }

    /// Returns in words what a value is, if its shape is wrong. Numbers, words and flags are left to serde where one of
    /// them belongs.
    fn describe_wrong(&self, value: &DeValue<'_>, wanted: &Wanted) -> Option<String> {
        let depth = match wanted {
            Wanted::Section(_) => return (!value.is_table()).then(|| format!("is {}", self.name(value))),
            Wanted::Bodies => 1,
            Wanted::Key(key) => match key.form {
                Form::Table => return (!value.is_table()).then(|| format!("is {}", self.name(value))),
                Form::Numbers => 1,
                Form::Rows => 2,
                Form::Polygons => 3,
                _ => return (value.is_table() || value.is_array()).then(|| format!("is {}", self.name(value))),
            },
        };
        let not_a_list = match find_no_list(value, depth)? {
            (place, found) if place.is_empty() => format!("is {}", self.name(found)),
            (place, found) => format!("has {} as item {place}", self.name(found)),
        };
        Some(not_a_list)
    }

    fn name(&self, value: &DeValue<'_>) -> String {
        match value {
            DeValue::Table(_) => format!("a {}", self.table_word()),
            DeValue::Array(_) => "a list".to_owned(),
            DeValue::String(text) if text.chars().count() <= 40 => format!("the text {text:?}"),
            DeValue::String(_) => "a text".to_owned(),
            DeValue::Integer(_) | DeValue::Float(_) => "a number".to_owned(),
            DeValue::Boolean(_) => "a truth value".to_owned(),
            DeValue::Datetime(_) => "a date".to_owned(),
        }
    }

    fn table_word(&self) -> &'static str {
        if self.notation == Notation::Python { "dict" } else { "table" }
    }

    /// Returns the wanted shape in words.
    fn form(&self, wanted: &Wanted) -> String {
        let table = self.table_word();
        match wanted {
            Wanted::Section(_) => format!("a {table}"),
            Wanted::Bodies => format!("a list of {table}s, one for each body"),
            Wanted::Key(key) => match key.form {
                Form::Table => format!("a {table}"),
                Form::Numbers => "a list of numbers".to_owned(),
                Form::Rows => "a list of lists of numbers".to_owned(),
                Form::Polygons => "a list of polygons, each a list of corners [x, y]".to_owned(),
                Form::Number => "a number".to_owned(),
                Form::Whole => "a whole number".to_owned(),
                Form::Flag if self.notation == Notation::Python => "True or False".to_owned(),
                Form::Flag => "true or false".to_owned(),
                Form::WordOrNumber => "a text or a number".to_owned(),
                _ => "a text".to_owned(),
            },
        }
    }

    /// Returns the key with a value of the wanted shape, as the notation writes it.
    fn example(&self, wanted: &Wanted, got: &DeValue<'_>) -> String {
        let kind = |name: &str| self.pairs(&[("kind", format!("{name:?}"))]);
        let shown = match wanted {
            Wanted::Bodies => format!("[{}, {}]", kind("earth"), kind("moon")),
            // A word is the name of a body, or of the file with a calibration.
            Wanted::Section("body") => kind(got.as_str().unwrap_or("earth")),
            Wanted::Section("camera") if got.is_str() => self.section("camera", &["file"]),
            Wanted::Section(name) => self.section(name, &self.shown_keys(name)),
            Wanted::Key(key) => self.show(&self.value_of(key)),
        };
        match (self.path.last().map(String::as_str), self.notation, self.path.len()) {
            (Some(name), Notation::Toml, _) if name.parse::<usize>().is_err() => format!("{name} = {shown}"),
            (Some(name), Notation::Python, 1) => format!("{name}={shown}"),
            (Some(name), Notation::Python, _) if name.parse::<usize>().is_err() => format!("\"{name}\": {shown}"),
            _ => shown,
        }
    }

    /// Returns the keys that the example of a section shows: those that it requires, or else the first one.
    fn shown_keys(&self, section: &str) -> Vec<&'static str> {
        let has_value = |key: &&Key| key.example.is_some() || keys::default_of(key, &self.defaults).is_some();
        let is_required = |key: &&Key| key.unset.is_none() && keys::default_of(key, &self.defaults).is_none();
        let required: Vec<_> = keys::in_section(section).filter(is_required).map(Key::name).collect();
        match keys::in_section(section).find(has_value) {
            Some(first) if required.is_empty() => vec![first.name()],
            _ => required,
        }
    }

    /// Shows these keys of a section.
    fn section(&self, section: &str, names: &[&str]) -> String {
        let keys = keys::in_section(section).filter(|key| names.contains(&key.name()));
        self.pairs(&keys.map(|key| (key.name(), self.show(&self.value_of(key)))).collect::<Vec<_>>())
    }

    /// Shows a table with these keys, in their order.
    fn pairs(&self, pairs: &[(&str, String)]) -> String {
        match self.notation {
            Notation::Python => {
                let each: Vec<String> = pairs.iter().map(|(key, value)| format!("\"{key}\": {value}")).collect();
                format!("{{{}}}", each.join(", "))
            }
            Notation::Toml => {
                let each: Vec<String> = pairs.iter().map(|(key, value)| format!("{key} = {value}")).collect();
                format!("{{ {} }}", each.join(", "))
            }
        }
    }

    /// Returns an example or the default of a key.
    fn value_of(&self, key: &Key) -> Value {
        let text = key.example.map(str::to_owned).or_else(|| keys::default_of(key, &self.defaults)).unwrap_or_default();
        let read = format!("value = {text}").parse::<Table>().ok().and_then(|mut table| table.remove("value"));
        read.unwrap_or_else(|| Value::from(text))
    }

    fn show(&self, value: &Value) -> String {
        match value {
            Value::Array(items) => {
                let each: Vec<String> = items.iter().map(|item| self.show(item)).collect();
                format!("[{}]", each.join(", "))
            }
            Value::Table(table) => {
                let each: Vec<_> = table.iter().map(|(key, value)| (key.as_str(), self.show(value))).collect();
                self.pairs(&each)
            }
            Value::Boolean(flag) if self.notation == Notation::Python => {
                if *flag { "True" } else { "False" }.to_owned()
            }
            other => other.to_string(),
        }
    }
}

/// Finds the first value that is no list within lists of this depth. Returns its place, counted from 1, and the value.
fn find_no_list<'a, 'i>(value: &'a DeValue<'i>, depth: usize) -> Option<(String, &'a DeValue<'i>)> {
    let Some(items) = value.as_array().filter(|_| depth > 0) else {
        return (depth > 0).then(|| (String::new(), value));
    };
    items.iter().enumerate().find_map(|(i, item)| {
        let (place, found) = find_no_list(item.get_ref(), depth - 1)?;
        Some((if place.is_empty() { format!("{}", i + 1) } else { format!("{}.{place}", i + 1) }, found))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn why(text: &str, notation: Notation) -> String {
        check(text, notation).unwrap_err()
    }

    #[test]
    fn a_wrong_shape_is_named_with_what_to_write() {
        for (text, toml, python) in [
            (
                "bodies = {}",
                "bodies: is a table; write a list of tables, one for each body, for example bodies = [{ kind = \
                 \"earth\" }, { kind = \"moon\" }]",
                "bodies: is a dict; write a list of dicts, one for each body, for example bodies=[{\"kind\": \
                 \"earth\"}, {\"kind\": \"moon\"}]",
            ),
            (
                "body = [{ kind = \"moon\" }]",
                "body: is a list; write a table, for example body = { kind = \"earth\" }",
                "body: is a list; write a dict, for example body={\"kind\": \"earth\"}",
            ),
            (
                "bodies = [\"moon\"]",
                "[[bodies]] 1: is the text \"moon\"; write a table, for example { kind = \"moon\" }",
                "[[bodies]] 1: is the text \"moon\"; write a dict, for example {\"kind\": \"moon\"}",
            ),
            (
                "camera = \"c.yaml\"",
                "camera: is the text \"c.yaml\"; write a table, for example camera = { file = \"camchain.yaml\" }",
                "camera: is the text \"c.yaml\"; write a dict, for example camera={\"file\": \"camchain.yaml\"}",
            ),
            (
                "[camera]\nwidth = [640]",
                "[camera] width: is a list; write a whole number, for example width = 1920",
                "[camera] width: is a list; write a whole number, for example \"width\": 1920",
            ),
            (
                "[gates]\naltitude_limits_km = { low = 1 }",
                "[gates] altitude_limits_km: is a table; write a list of numbers, for example altitude_limits_km = \
                 [0.0, 1000.0]",
                "[gates] altitude_limits_km: is a dict; write a list of numbers, for example \
                 \"altitude_limits_km\": [0.0, 1000.0]",
            ),
            (
                "[input]\ninvert = {}",
                "[input] invert: is a table; write true or false, for example invert = false",
                "[input] invert: is a dict; write True or False, for example \"invert\": False",
            ),
        ] {
            assert_eq!((why(text, Notation::Toml), why(text, Notation::Python)), (toml.into(), python.into()));
        }
        let polygon = why("[mask]\npolygons_px = [[[1, 2], [3, 4], 5]]", Notation::Toml);
        assert!(polygon.starts_with("[mask] polygons_px: has a number as item 1.3; write a list of polygons"));
        assert!(why("camera = []", Notation::Python).contains("\"width\": 1920, "));
        let inner = why("[[bodies]]\nkind = \"sun\"\n[[bodies]]\nthreshold = 3", Notation::Toml);
        assert!(inner.starts_with("[[bodies]] 2 threshold: is a number; write a table"), "{inner}");
    }

    #[test]
    fn every_key_accepts_its_own_example() {
        let walk = Walk { notation: Notation::Toml, defaults: keys::defaults(), path: Vec::new() };
        for key in keys::all() {
            let Some((section, name)) = key.path.split_once('.') else { continue };
            // The sections of a body have no example of their own.
            if section == "body" && key.form == Form::Table {
                continue;
            }
            let value = walk.value_of(key);
            let text = format!("[{section}]\n{name} = {}", walk.show(&value));
            assert_eq!(check(&text, Notation::Toml), Ok(()), "{text}");
            // A list is never a table: each key refuses the other one.
            let other = if value.is_table() { "[]" } else { "{}" };
            let refused = why(&format!("[{section}]\n{name} = {other}"), Notation::Toml);
            assert!(refused.starts_with(&format!("[{section}] {name}: is a ")), "{refused}");
        }
    }
}
