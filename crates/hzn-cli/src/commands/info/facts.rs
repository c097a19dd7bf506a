//! What is known about a file, for a reader and for a program.

use serde_json::{Map, Value, json};

use crate::tell::one_line;

/// The facts about a file: lines of text, and the same as a JSON object.
pub(super) struct Facts {
    text: String,
    json: Map<String, Value>,
}

impl Facts {
    /// Begins with the kind of the file, as a word for programs and in words for readers.
    pub(super) fn new(kind: &str, words: &str) -> Self {
        let mut facts = Self { text: String::new(), json: Map::new() };
        facts.line("file", words.to_owned());
        facts.key("kind", kind);
        facts
    }

    /// Adds a line for readers.
    pub(super) fn line(&mut self, name: &str, text: String) {
        self.whole_line(&format!("{name:<16} {}", one_line(text)));
    }

    /// Adds a line that has its name already.
    pub(super) fn whole_line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// Adds several lines that have their names already.
    pub(super) fn text_block(&mut self, lines: &str) {
        self.text.push_str(lines);
    }

    /// Adds a key for programs.
    pub(super) fn key(&mut self, key: &str, value: impl Into<Value>) {
        self.json.insert(key.to_owned(), value.into());
    }

    /// Adds a line and its key.
    pub(super) fn fact(&mut self, name: &str, text: String, key: &str, value: impl Into<Value>) {
        self.line(name, text);
        self.key(key, value);
    }

    /// Adds the first and the last time, in seconds.
    pub(super) fn time(&mut self, first_s: f64, last_s: f64) {
        self.fact("time", format!("{first_s:.3} to {last_s:.3} s"), "time_s", json!([first_s, last_s]));
    }

    /// Returns the lines.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// Returns the JSON object.
    pub(super) fn json(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(&self.json)? + "\n")
    }
}
