//! The state of the palette: what is typed, and the entries that it finds.

use hzn_files::keys;

use super::command::{ALL, Command};

/// What an entry of the palette does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entry {
    /// Runs a command.
    Command(Command),
    /// Shows a key of sensor.toml among the stages.
    Key(&'static str),
}

impl Entry {
    /// Returns the text that the user searches.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Command(command) => command.name(),
            Self::Key(path) => path,
        }
    }
}

/// The palette while it is open.
#[derive(Debug, Default)]
pub(super) struct Palette {
    pub(super) text: String,
    /// Place of the marked entry among those that are found.
    pub(super) marked: usize,
    /// The field has had the focus.
    pub(super) is_focused: bool,
}

impl Palette {
    /// Returns the entries that contain every typed word, commands before keys. Those that begin with the text come
    /// first.
    pub(super) fn found(&self, has_sensor: bool) -> Vec<Entry> {
        let commands = ALL.iter().map(|(command, ..)| Entry::Command(*command));
        let commands = commands.filter(|entry| *entry != Entry::Command(Command::Palette));
        let keys = keys::all().filter(|_| has_sensor).map(|key| Entry::Key(key.path));
        let text = self.text.trim().to_lowercase();
        let has_all = |entry: &Entry| {
            let name = entry.name().to_lowercase();
            text.split_whitespace().all(|word| name.contains(word))
        };
        let mut found: Vec<Entry> = commands.chain(keys).filter(has_all).collect();
        found.sort_by_key(|entry| !entry.name().to_lowercase().starts_with(&text));
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str, has_sensor: bool) -> Vec<&'static str> {
        let palette = Palette { text: text.to_owned(), ..Palette::default() };
        palette.found(has_sensor).into_iter().map(Entry::name).collect()
    }

    #[test]
    fn every_typed_word_counts() {
        assert_eq!(found("ICTURE worst", true), ["Worst picture, then the next worst"]);
        assert_eq!(found("  threshold.sca ", true), ["threshold.scale"]);
        assert_eq!(found("zoom in", true)[0], "Zoom in");
        assert!(found("no such thing", true).is_empty());
        // What begins with the text comes first.
        assert!(found("thresh", true)[0].starts_with("Thresh"));
        // Without a sensor.toml there is no key to show.
        assert!(found("threshold.", false).is_empty());
        assert_eq!(found("", false).len(), ALL.len() - 1);
    }
}
