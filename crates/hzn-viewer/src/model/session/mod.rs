//! The sensor that is being tuned: its text, the configuration that the text yields, and undo.

mod numbers;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use hzn_core::{Config, Preset};
use hzn_files::keys::{self, Form, Key};
use hzn_files::{Problem, limited};
use toml_edit::Value;

use super::sheet::{self, Sheet};
use super::{Fingerprint, atomic_file};
use numbers::{number, tidy, tidy_px};

/// Largest number of steps that can be undone.
const MAX_UNDO: usize = 500;

/// What another program did to the file of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileChange {
    /// The file has another content, or it cannot be read.
    Changed,
    /// The file does not exist any more.
    Removed,
}

/// A sensor.toml that is being edited. Only the text is kept: a change of a parameter changes the text, and the text is
/// then read like every sensor.toml.
#[derive(Debug, Clone)]
pub struct Session {
    /// File that [`Session::save`] last wrote or that the text was read from; `None` if the text came from a recording.
    path: Option<PathBuf>,
    /// Fingerprint of this file as it was last read or written. The saved text can differ from it by the number of bits
    /// of the pictures, which is added when the pictures are opened.
    as_read: Option<Fingerprint>,
    /// The user opened the file himself. Any other session ends with its pictures.
    is_opened_by_user: bool,
    /// Path that messages name. A camera `file` is looked for in the same folder.
    home: PathBuf,
    /// Text of the file, to which saving is compared.
    on_file: Sheet,
    saved: Sheet,
    sheet: Sheet,
    undo: Vec<Sheet>,
    redo: Vec<Sheet>,
    /// Key whose consecutive changes count as one step.
    gesture: Option<String>,
    config: Option<Arc<Config>>,
    values: toml::Table,
    /// Values of the saved text.
    saved_values: toml::Table,
    /// Preset that the text names, or else the default preset.
    preset: String,
    /// Keys whose values differ from the saved text, as (section, name, body).
    differing: HashSet<(&'static str, &'static str, usize)>,
    problem: Option<Problem>,
    version: u64,
}

impl Session {
    /// Begins with a text. `home` is the file that contains the text, or its default path. `as_read` is the fingerprint
    /// of the file; `None` if the text does not come from a file.
    pub fn new(text: &str, home: &Path, as_read: Option<Fingerprint>) -> Self {
        let sheet = Sheet::new(text);
        let mut session = Self {
            path: as_read.map(|_| home.to_owned()),
            as_read,
            is_opened_by_user: false,
            home: home.to_owned(),
            on_file: sheet.clone(),
            saved: sheet.clone(),
            sheet,
            undo: Vec::new(),
            redo: Vec::new(),
            gesture: None,
            config: None,
            values: toml::Table::new(),
            saved_values: toml::Table::new(),
            preset: String::new(),
            differing: HashSet::new(),
            problem: None,
            version: 0,
        };
        session.read();
        session
    }

    /// Reads a sensor.toml.
    ///
    /// # Errors
    /// The file cannot be read. An error in its text is not an error here but a [`Session::problem`].
    pub fn open(path: &Path) -> Result<Self, Problem> {
        let text = read_file(path)?;
        Ok(Self::new(&text, path, Some(Fingerprint::of(&text))))
    }

    /// Returns the session as one whose text was completed when its pictures were opened. `text` is that of the file.
    pub fn completed_from(self, text: &str) -> Self {
        Self { on_file: Sheet::new(text), ..self }
    }
    /// Returns the session as one whose file the user opened himself.
    pub fn opened_by_user(self) -> Self {
        Self { is_opened_by_user: true, ..self }
    }
    /// Returns true if the user opened the file himself. Any other session ends with its pictures.
    pub fn is_opened_by_user(&self) -> bool {
        self.is_opened_by_user
    }

    /// Returns the text.
    pub fn sheet(&self) -> &Sheet {
        &self.sheet
    }
    /// Returns the text as it was read or last saved.
    pub fn saved(&self) -> &Sheet {
        &self.saved
    }
    /// Returns the text of the file. What the window added when it opened the pictures is not in it.
    pub fn on_file(&self) -> &Sheet {
        &self.on_file
    }
    /// Returns the lines that saving changes in the file, by section.
    pub fn unsaved_lines(&self) -> Vec<(String, Vec<String>)> {
        self.sheet.diff_by_section(&self.on_file)
    }
    /// Returns the file of the text.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }
    /// Returns the fingerprint of the file as it was last read or written.
    pub fn as_read(&self) -> Option<Fingerprint> {
        self.as_read
    }
    /// Returns the default path for saving.
    pub fn home(&self) -> &Path {
        &self.home
    }
    /// Returns the last configuration that was accepted.
    pub fn config(&self) -> Option<&Arc<Config>> {
        self.config.as_ref()
    }
    /// Returns the error in the text. While there is one, the configuration is the last one that was accepted.
    pub fn problem(&self) -> Option<&Problem> {
        self.problem.as_ref()
    }
    /// Returns the number of this version of the configuration. Every version of every session has a different number.
    pub fn version(&self) -> u64 {
        self.version
    }
    /// Returns true if there are changes that are not saved.
    pub fn is_changed(&self) -> bool {
        self.sheet != self.saved
    }
    /// Returns true if a change can be undone.
    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }
    /// Returns true if an undone change can be made again.
    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// Returns the name of the preset in effect.
    pub fn preset(&self) -> &str {
        &self.preset
    }

    /// Returns the value in effect: the one of the text, or else the one of the preset; `None` if there is no value.
    /// The threshold and the edge errors of a body override those of the sensor.
    pub fn value(&self, section: &str, name: &str, body: usize) -> Option<&toml::Value> {
        Self::find(&self.values, section, name, body)
    }

    fn find<'a>(values: &'a toml::Table, section: &str, name: &str, body: usize) -> Option<&'a toml::Value> {
        let body_values = match values.get("bodies").and_then(toml::Value::as_array) {
            Some(bodies) => bodies.get(body),
            None => values.get("body"),
        };
        if section == "body" {
            return body_values?.get(name);
        }
        let own_section =
            body_values.and_then(|b| b.get(section)).filter(|_| matches!(section, "threshold" | "covariance"));
        own_section.or_else(|| values.get(section))?.get(name)
    }

    /// Returns the value in effect if it is a number.
    pub fn number(&self, section: &str, name: &str, body: usize) -> Option<f64> {
        number(self.value(section, name, body)?)
    }

    /// Returns the usual magnitude of a number, a power of ten; it sets the range of a slider. It follows the saved
    /// value, so that it stays the same while the slider is moved. Without a saved value it follows the value in
    /// effect.
    pub fn usual_magnitude(&self, section: &str, name: &str, body: usize) -> f64 {
        let saved = Self::find(&self.saved_values, section, name, body).and_then(number);
        match saved.or_else(|| self.number(section, name, body)) {
            Some(x) if x != 0.0 => 10f64.powf(x.abs().log10().round()),
            _ => 1.0,
        }
    }

    /// Changes a value, or removes it from the text (`None`). Consecutive changes of the same key are one step, unless
    /// [`Session::end_step`] is called between them.
    pub fn set(&mut self, section: &str, name: &str, body: usize, value: Option<Value>) {
        let key = format!("{section}.{name}.{body}");
        match self.sheet.with_value(sheet::Key { section, name, body }, value) {
            Ok(sheet) => self.replace(sheet, Some(key)),
            Err(why) => self.problem = Some(Problem::new(&self.home, why)),
        }
    }

    /// Changes several values as one step. `None` removes a key.
    pub fn set_all(&mut self, values: &[(&str, &str, Option<Value>)], body: usize) {
        self.set_step(values, body, None);
    }

    /// Changes several values of the sensor. Consecutive changes with the same name of a gesture are one step.
    pub fn set_gesture(&mut self, gesture: &str, values: &[(&str, &str, Option<Value>)]) {
        self.set_step(values, 0, Some(gesture.to_owned()));
    }

    fn set_step(&mut self, values: &[(&str, &str, Option<Value>)], body: usize, gesture: Option<String>) {
        let mut sheet = self.sheet.clone();
        for (section, name, value) in values {
            match sheet.with_value(sheet::Key { section, name, body }, value.clone()) {
                Ok(changed) => sheet = changed,
                Err(why) => {
                    self.problem = Some(Problem::new(&self.home, why));
                    return;
                }
            }
        }
        self.replace(sheet, gesture);
    }

    /// Returns a number as it is written into the text.
    pub fn tidy_value(x: f64) -> Value {
        Value::from(tidy(x))
    }

    /// Sets a number. It is rounded to a whole number if the value in effect is whole.
    pub fn set_number(&mut self, key: &Key, body: usize, x: f64) {
        let is_whole = matches!(self.value(key.section(), key.name(), body), Some(toml::Value::Integer(_)))
            || (self.value(key.section(), key.name(), body).is_none() && key.form == Form::Whole);
        let value = if is_whole { Value::from(x.round() as i64) } else { Value::from(tidy(x)) };
        self.set(key.section(), key.name(), body, Some(value));
    }

    /// Returns true if the value of a key differs from the saved text.
    pub fn differs(&self, section: &str, name: &str, body: usize) -> bool {
        // The set is small. A lookup would need keys with the static lifetime.
        self.differing.iter().any(|d| *d == (section, name, body))
    }

    /// Restores the saved value of a key. If the saved text has no value for the key, the key is removed.
    pub fn restore(&mut self, section: &str, name: &str, body: usize) {
        let value = self.saved.get(sheet::Key { section, name, body });
        self.set(section, name, body, value.and_then(|v| v.parse().ok()));
    }

    /// Sets the polygons of the mask, in pixels.
    pub fn set_polygons(&mut self, polygons: &[Vec<[f64; 2]>]) {
        let corner = |[x, y]: &[f64; 2]| Value::from_iter([tidy_px(*x), tidy_px(*y)]);
        let polygon = |p: &Vec<[f64; 2]>| Value::from_iter(p.iter().map(corner));
        self.set("mask", "polygons_px", 0, Some(Value::from_iter(polygons.iter().map(polygon))));
    }

    /// Returns the polygons of the mask, in pixels.
    pub fn polygons(&self) -> Vec<Vec<[f64; 2]>> {
        let config = self.config.iter();
        config.flat_map(|c| c.mask.polygons_px.iter().map(|p| p.iter().copied().collect())).collect()
    }

    /// Returns a session with the same camera, mount, bodies, mask and input under another preset. All other keys are
    /// left out.
    pub fn under_preset(&self, preset: Preset) -> Self {
        const KEPT: [&str; 6] = ["camera", "mount", "body", "bodies", "mask", "input"];
        let mut table: toml::Table = self.sheet.text().parse().unwrap_or_default();
        table.retain(|key, _| KEPT.contains(&key));
        let text = format!("preset = \"{}\"\n{table}", preset.name());
        Self::new(&text, &self.home, None)
    }

    /// Ends a step, for example when a slider is released.
    pub fn end_step(&mut self) {
        self.gesture = None;
    }

    /// Undoes the last step.
    pub fn undo(&mut self) {
        if let Some(sheet) = self.undo.pop() {
            self.redo.push(std::mem::replace(&mut self.sheet, sheet));
            self.end_step();
            self.read();
        }
    }

    /// Makes the step again that was undone last.
    pub fn redo(&mut self) {
        if let Some(sheet) = self.redo.pop() {
            self.undo.push(std::mem::replace(&mut self.sheet, sheet));
            self.end_step();
            self.read();
        }
    }

    /// Goes back to the text that was read or last saved. This can be undone.
    pub fn reset(&mut self) {
        self.replace(self.saved.clone(), None);
    }

    /// Replaces the whole text, as one step.
    pub fn set_text(&mut self, text: &str) {
        self.replace(Sheet::new(text), None);
    }

    /// Returns what happened to the file of the session since it was last read or written. A file that already has the
    /// text of the session has nothing to lose, so it counts as unchanged.
    pub fn file_change(&self) -> Option<FileChange> {
        let path = self.path.as_deref()?;
        match limited::read(path, limited::SETTINGS_BYTES) {
            Ok(content) => {
                let is_same = self.as_read == Some(Fingerprint::of(&content));
                (!is_same && content != self.sheet.text().as_bytes()).then_some(FileChange::Changed)
            }
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Some(FileChange::Removed),
            // A file that cannot be read may have any content.
            Err(_) => Some(FileChange::Changed),
        }
    }

    /// Returns the lines in which the text of the session differs from that of its file, by section.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn differs_from_file(&self) -> Result<Vec<(String, Vec<String>)>, Problem> {
        let text = read_file(self.path.as_deref().unwrap_or(&self.home))?;
        Ok(self.sheet.diff_by_section(&Sheet::new(text)))
    }

    /// Reads the file again, as one step, so that undo brings the text of the window back.
    ///
    /// # Errors
    /// The file cannot be read, or the text does not come from a file.
    pub fn reload(&mut self) -> Result<(), Problem> {
        let path = self.path.as_deref().unwrap_or(&self.home);
        let text = read_file(path)?;
        let mut sheet = Sheet::new(text);
        // If the number of bits was added to the text that was read first, it is added again.
        let is_completed = self.on_file != self.saved;
        (self.as_read, self.on_file) = (Some(Fingerprint::of(sheet.text())), sheet.clone());
        let bits = sheet::Key { section: "input", name: "bits", body: 0 };
        if is_completed
            && sheet.get(bits).is_none()
            && let Some(value) = self.saved.get(bits).and_then(|v| v.parse().ok())
        {
            sheet = sheet.with_value(bits, Some(value)).unwrap_or(sheet);
        }
        self.saved = sheet.clone();
        self.replace(sheet, None);
        // The differences from the saved text are new, even if the text of the window is the same.
        self.read();
        Ok(())
    }

    /// Writes the text to `path`, which becomes the file of the session. The file is written completely or not at all.
    ///
    /// # Errors
    /// The file cannot be written; the message says why and what to do.
    pub fn save(&mut self, path: &Path) -> Result<(), String> {
        atomic_file::write(path, self.sheet.text().as_bytes())?;
        (self.saved, self.on_file) = (self.sheet.clone(), self.sheet.clone());
        self.as_read = Some(Fingerprint::of(self.sheet.text()));
        self.saved_values = self.values.clone();
        self.differing.clear();
        (self.path, self.home) = (Some(path.to_owned()), path.to_owned());
        self.end_step();
        Ok(())
    }

    fn replace(&mut self, sheet: Sheet, gesture: Option<String>) {
        if sheet == self.sheet {
            return;
        }
        let before = std::mem::replace(&mut self.sheet, sheet);
        self.redo.clear();
        if gesture.is_none() || gesture != self.gesture {
            self.undo.push(before);
            if self.undo.len() > MAX_UNDO {
                self.undo.remove(0);
            }
        }
        self.gesture = gesture;
        self.read();
    }

    /// Gives the configuration a new version number, so that all pictures are processed again.
    pub fn renew(&mut self) {
        static VERSIONS: AtomicU64 = AtomicU64::new(1);
        self.version = VERSIONS.fetch_add(1, Ordering::Relaxed);
    }

    /// Parses the text, once per change, because the panels read the result in every frame of the window.
    fn read(&mut self) {
        let table: Option<toml::Table> = self.sheet.text().parse().ok();
        let named = table.as_ref().and_then(|t| t.get("preset")?.as_str());
        self.preset = named.unwrap_or(Preset::default().name()).to_owned();
        self.differing.clear();
        if self.is_changed() {
            let bodies = table.as_ref().and_then(|t| t.get("bodies")?.as_array()).map_or(1, |b| b.len().max(1));
            let with_bodies = |k: &'static Key| (0..bodies).map(move |body| (k, body));
            let key = |(k, body): (&'static Key, usize)| sheet::Key { section: k.section(), name: k.name(), body };
            let keys = keys::all().flat_map(with_bodies).map(key);
            self.differing.extend(self.sheet.differing(&self.saved, keys).iter().map(|k| (k.section, k.name, k.body)));
        }
        match hzn_files::sensor::parse(self.sheet.text(), &self.home) {
            Ok(sensor) => {
                // An accepted configuration can be written as TOML. If it could not, only the sliders would lack their
                // values.
                self.values = toml::Table::try_from(&sensor.config).unwrap_or_default();
                if !self.is_changed() {
                    self.saved_values = self.values.clone();
                }
                self.config = Some(Arc::new(sensor.config));
                self.problem = None;
                self.renew();
            }
            Err(problem) => self.problem = Some(problem),
        }
    }
}

/// Reads the text of a sensor.toml.
fn read_file(path: &Path) -> Result<String, Problem> {
    limited::read_text(path, limited::SETTINGS_BYTES).map_err(|e| Problem::new(path, format!("cannot be read: {e}")))
}

#[cfg(test)]
mod tests;
