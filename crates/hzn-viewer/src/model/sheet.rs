//! The text of a sensor.toml, in which single values are changed. Comments, order and spacing stay as they are.

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

/// The text of a sensor.toml.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sheet(String);

/// A key: its section (empty at the top level) and its name. With several bodies, `body` is the index of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key<'a> {
    /// Section, for example `consensus`.
    pub section: &'a str,
    /// Name, for example `threshold_px`.
    pub name: &'a str,
    /// Index of the body, from 0.
    pub body: usize,
}

impl Sheet {
    /// Returns a sheet with this text.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }
    /// Returns the text.
    pub fn text(&self) -> &str {
        &self.0
    }

    /// Returns the value of a key as it is written in the text; `None` if the text has no value for the key.
    pub fn get(&self, key: Key<'_>) -> Option<String> {
        value_text(&mut self.0.parse().ok()?, key)
    }

    /// Returns the keys whose values differ between the two texts.
    pub fn differing<'k>(&self, other: &Self, keys: impl Iterator<Item = Key<'k>>) -> Vec<Key<'k>> {
        let [mut ours, mut theirs] = [self, other].map(|s| s.0.parse::<DocumentMut>().unwrap_or_default());
        keys.filter(|key| value_text(&mut ours, *key) != value_text(&mut theirs, *key)).collect()
    }

    /// Returns the text with another value for the key. `None` removes the key, so that the value of the preset applies
    /// again.
    ///
    /// # Errors
    /// The text is not TOML, or the section is not a table.
    pub fn with_value(&self, key: Key<'_>, value: Option<Value>) -> Result<Self, String> {
        let mut document: DocumentMut = self.0.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
        let no_section = || format!("[{}] is not a section", key.section);
        match value {
            None => {
                if let Some(table) = table(&mut document, key, false) {
                    table.remove(key.name);
                }
            }
            Some(mut value) => {
                let table = table(&mut document, key, true).ok_or_else(no_section)?;
                match table.get_mut(key.name).and_then(Item::as_value_mut) {
                    Some(own) => {
                        // The comment behind a value is part of its decoration.
                        *value.decor_mut() = own.decor().clone();
                        *own = value;
                    }
                    None => {
                        table.insert(key.name, Item::Value(value));
                    }
                }
            }
        }
        Ok(Self(document.to_string()))
    }

    /// Returns the lines that differ from `other`: the lines of `other` with a `-`, and the lines of this text with a
    /// `+`.
    pub fn diff(&self, other: &Self) -> Vec<String> {
        self.diff_by_section(other).into_iter().flat_map(|(_, lines)| lines).collect()
    }

    /// Returns the same lines as [`Self::diff`], with the header of the section that they are in. The header is empty
    /// at the top of the file.
    pub fn diff_by_section(&self, other: &Self) -> Vec<(String, Vec<String>)> {
        let (old, new): (Vec<&str>, Vec<&str>) = (other.0.lines().collect(), self.0.lines().collect());
        let (old_sections, new_sections) = (section_of_lines(&old), section_of_lines(&new));
        let mut out: Vec<(String, Vec<String>)> = Vec::new();
        let mut add = |section: &str, line: String| match out.last_mut() {
            Some((last, lines)) if last == section => lines.push(line),
            _ => out.push((section.to_owned(), vec![line])),
        };
        let (mut i, mut j) = (0, 0);
        for (a, b) in common_lines(&old, &new).into_iter().chain([(old.len(), new.len())]) {
            (i..a).for_each(|k| add(old_sections[k], format!("-{}", old[k])));
            (j..b).for_each(|k| add(new_sections[k], format!("+{}", new[k])));
            (i, j) = (a + 1, b + 1);
        }
        out
    }
}

/// Returns the header of the section that each line is in. A header is in its own section.
fn section_of_lines<'a>(lines: &[&'a str]) -> Vec<&'a str> {
    let mut section = "";
    let header =
        |line: &&'a str| line.trim_start().starts_with('[').then(|| line.split('#').next().unwrap_or("").trim());
    lines
        .iter()
        .map(|line| {
            section = header(line).unwrap_or(section);
            section
        })
        .collect()
}

/// Returns the indices of a longest common subsequence of lines, in both texts.
fn common_lines(old: &[&str], new: &[&str]) -> Vec<(usize, usize)> {
    let width = new.len() + 1;
    let mut longest = vec![0u32; (old.len() + 1) * width];
    for i in (0..old.len()).rev() {
        for j in (0..new.len()).rev() {
            longest[i * width + j] = if old[i] == new[j] {
                longest[(i + 1) * width + j + 1] + 1
            } else {
                longest[(i + 1) * width + j].max(longest[i * width + j + 1])
            };
        }
    }
    let (mut i, mut j, mut out) = (0, 0, Vec::new());
    while i < old.len() && j < new.len() {
        if old[i] == new[j] {
            out.push((i, j));
            (i, j) = (i + 1, j + 1);
        } else if longest[(i + 1) * width + j] >= longest[i * width + j + 1] {
            i += 1;
        } else {
            j += 1;
        }
    }
    out
}

fn value_text(document: &mut DocumentMut, key: Key<'_>) -> Option<String> {
    let value = table(document, key, false)?.get(key.name)?.as_value()?;
    Some(value.clone().decorated("", "").to_string())
}

/// Returns the table that a key belongs to.
fn table<'a>(document: &'a mut DocumentMut, key: Key<'_>, create: bool) -> Option<&'a mut dyn TableLike> {
    let root = document.as_table_mut();
    if key.section.is_empty() {
        return Some(root);
    }
    let is_list = root.get("bodies").is_some_and(Item::is_array_of_tables);
    let is_of_body = match key.section {
        "body" => true,
        // The threshold and the edge errors of a body override those of the sensor.
        "threshold" | "covariance" => has_own_section(root, key, is_list),
        _ => false,
    };
    if !is_of_body {
        return section(root, key.section, create);
    }
    let body: &mut dyn TableLike = if is_list {
        root.get_mut("bodies")?.as_array_of_tables_mut()?.get_mut(key.body)?
    } else {
        section(root, "body", create)?
    };
    if key.section == "body" { Some(body) } else { body.get_mut(key.section)?.as_table_like_mut() }
}

/// Returns true if the body has a section of this name.
fn has_own_section(root: &Table, key: Key<'_>, is_list: bool) -> bool {
    let body: Option<&dyn TableLike> = if is_list {
        root.get("bodies").and_then(Item::as_array_of_tables).and_then(|a| a.get(key.body)).map(|t| t as &dyn TableLike)
    } else {
        root.get("body").and_then(Item::as_table_like)
    };
    body.and_then(|b| b.get(key.section)).is_some_and(Item::is_table_like)
}

fn section<'a>(root: &'a mut Table, name: &str, create: bool) -> Option<&'a mut dyn TableLike> {
    if create && !root.contains_key(name) {
        let mut table = Table::new();
        table.decor_mut().set_prefix("\n");
        root.insert(name, Item::Table(table));
    }
    root.get_mut(name)?.as_table_like_mut()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# mine\npreset = \"hzn\"   # best\n\n[consensus]  # outliers\nthreshold_px = 3.0     # \
                                                wide\n\n[body]\nkind = \"earth\"\n";

    fn key<'a>(section: &'a str, name: &'a str) -> Key<'a> {
        Key { section, name, body: 0 }
    }

    #[test]
    fn everything_but_the_value_stays() {
        let sheet = Sheet::new(TEXT).with_value(key("consensus", "threshold_px"), Some(4.5.into())).unwrap();
        assert_eq!(sheet.text(), TEXT.replace("3.0", "4.5"));
        assert_eq!(sheet.diff(&Sheet::new(TEXT)), ["-threshold_px = 3.0     # wide", "+threshold_px = 4.5     # wide"]);
        let back = sheet.with_value(key("consensus", "threshold_px"), Some(3.0.into())).unwrap();
        assert_eq!(back.text(), TEXT);
        assert!(back.diff(&Sheet::new(TEXT)).is_empty());
        let preset = back.with_value(key("", "preset"), Some("sun".into())).unwrap();
        assert_eq!(preset.text(), TEXT.replace("\"hzn\"", "\"sun\""));
    }

    #[test]
    fn changed_lines_are_below_their_sections() {
        let sheet = Sheet::new(TEXT).with_value(key("consensus", "threshold_px"), Some(4.5.into())).unwrap();
        let sheet = sheet.with_value(key("brightness", "max_mean"), Some(0.5.into())).unwrap();
        let diff = sheet.diff_by_section(&Sheet::new(TEXT));
        let sections: Vec<&str> = diff.iter().map(|(section, _)| section.as_str()).collect();
        // The empty line before a new section belongs to the section before it.
        assert_eq!(sections, ["[consensus]", "[body]", "[brightness]"]);
        assert_eq!(diff[0].1.len(), 2);
        assert!(diff[2].1.contains(&"+max_mean = 0.5".to_owned()));
    }

    #[test]
    fn new_keys_and_sections_are_appended() {
        let sheet = Sheet::new(TEXT).with_value(key("consensus", "seed"), Some(7.into())).unwrap();
        assert!(sheet.text().contains("# wide\nseed = 7\n"), "{}", sheet.text());
        let sheet = sheet.with_value(key("brightness", "max_mean"), Some(0.5.into())).unwrap();
        assert!(sheet.text().ends_with("kind = \"earth\"\n\n[brightness]\nmax_mean = 0.5\n"), "{}", sheet.text());
        let sheet = sheet.with_value(key("brightness", "max_mean"), None).unwrap();
        assert!(!sheet.text().contains("max_mean"));
        // Removing a missing value changes nothing and inserts nothing.
        assert_eq!(Sheet::new(TEXT).with_value(key("mask", "polygons_px"), None).unwrap().text(), TEXT);
    }

    #[test]
    fn a_body_of_several_has_its_own_values() {
        let text = "[threshold]\nscale = 1.0\n[[bodies]]\nkind = \"earth\"\n[[bodies]]\nkind = \
            \"sun\"\n[bodies.threshold]\nlevel = 0.9\n";
        let changed = |section, name, body, value: f64| {
            Sheet::new(text).with_value(Key { section, name, body }, Some(value.into())).unwrap().text().to_owned()
        };
        assert!(changed("body", "altitude_km", 1, 5.0).contains("kind = \"sun\"\naltitude_km = 5.0\n"));
        assert_eq!(changed("threshold", "level", 1, 0.5), text.replace("0.9", "0.5"));
        assert_eq!(changed("threshold", "scale", 0, 2.0), text.replace("1.0", "2.0"));
        assert!(Sheet::new("mask = 3").with_value(key("mask", "x"), Some(1.into())).is_err());
    }

    #[test]
    fn inline_tables_are_tables() {
        let sheet =
            Sheet::new("consensus = { seed = 1 }\n").with_value(key("consensus", "seed"), Some(2.into())).unwrap();
        assert_eq!(sheet.text(), "consensus = { seed = 2 }\n");
    }
}
