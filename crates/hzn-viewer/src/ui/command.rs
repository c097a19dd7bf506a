//! What can be done with a key: one table for keys, menus and the help.

use egui::{Key, KeyboardShortcut, Modifiers};

/// Something that can be done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Asks what to open.
    Open,
    /// Saves the sensor.toml.
    Save,
    /// Saves the sensor.toml in another place.
    SaveAs,
    /// Takes a change back.
    Undo,
    /// Makes it again.
    Redo,
    /// Back to what is saved.
    Reset,
    /// Shows what differs from the file.
    Diff,
    /// Plays or stops.
    Play,
    /// One frame on.
    Next,
    /// One frame back.
    Back,
    /// Ten frames on.
    Next10,
    /// Ten frames back.
    Back10,
    /// To the first frame.
    First,
    /// To the last frame.
    Last,
    /// To the next frame without an answer.
    NextRefused,
    /// To the one before.
    BackRefused,
    /// To the worst frame, then the second worst, and so on.
    Worst,
    /// Plays faster.
    Faster,
    /// Plays slower.
    Slower,
    /// The whole picture.
    Fit,
    /// One screen point a pixel.
    Actual,
    /// Larger.
    ZoomIn,
    /// Smaller.
    ZoomOut,
    /// Colour.
    Colour,
    /// Brightness.
    Grey,
    /// Lit or dark.
    Level,
    /// Without the lens's distortion.
    Undistorted,
    /// Draws the mask.
    Mask,
    /// Nothing over the picture, or everything again.
    Layers,
    /// Compares with another sensor.
    Compare,
    /// Processes all frames.
    ProcessAll,
    /// Processes all frames into a new recording.
    Rerun,
    /// Saves the picture with what is drawn over it.
    ExportPicture,
    /// Shows or hides the stages.
    Stages,
    /// Shows or hides the plots.
    Plots,
    /// Dark or light.
    Theme,
    /// Shows or hides the help.
    Help,
}

/// The table: what, its name, its key.
pub(super) const ALL: &[(Command, &str, Modifiers, Key)] = &[
    (Command::Open, "Open", Modifiers::COMMAND, Key::O),
    (Command::Save, "Save sensor.toml", Modifiers::COMMAND, Key::S),
    (Command::SaveAs, "Save sensor.toml as", Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S),
    (Command::Undo, "Undo", Modifiers::COMMAND, Key::Z),
    (Command::Redo, "Redo", Modifiers::COMMAND, Key::Y),
    (Command::Reset, "Reset to the file", Modifiers::COMMAND, Key::R),
    (Command::Diff, "Changes against the file", Modifiers::COMMAND, Key::D),
    (Command::Play, "Play, pause", Modifiers::NONE, Key::Space),
    (Command::Next, "Next frame", Modifiers::NONE, Key::ArrowRight),
    (Command::Back, "Frame before", Modifiers::NONE, Key::ArrowLeft),
    (Command::Next10, "Ten frames on", Modifiers::SHIFT, Key::ArrowRight),
    (Command::Back10, "Ten frames back", Modifiers::SHIFT, Key::ArrowLeft),
    (Command::First, "First frame", Modifiers::NONE, Key::Home),
    (Command::Last, "Last frame", Modifiers::NONE, Key::End),
    (Command::NextRefused, "Next frame without an answer", Modifiers::NONE, Key::N),
    (Command::BackRefused, "Frame before without an answer", Modifiers::SHIFT, Key::N),
    (Command::Worst, "Worst frame, then the next worst", Modifiers::NONE, Key::W),
    (Command::Faster, "Faster", Modifiers::NONE, Key::Period),
    (Command::Slower, "Slower", Modifiers::NONE, Key::Comma),
    (Command::Fit, "Whole picture", Modifiers::NONE, Key::Num0),
    (Command::Actual, "Single pixels (1:1)", Modifiers::NONE, Key::Num1),
    (Command::ZoomIn, "Larger", Modifiers::NONE, Key::Plus),
    (Command::ZoomOut, "Smaller", Modifiers::NONE, Key::Minus),
    (Command::Colour, "Colour", Modifiers::NONE, Key::C),
    (Command::Grey, "Grey: the brightness that counts", Modifiers::NONE, Key::G),
    (Command::Level, "Level: lit or dark", Modifiers::NONE, Key::L),
    (Command::Undistorted, "Without distortion", Modifiers::NONE, Key::U),
    (Command::Mask, "Draw the mask", Modifiers::NONE, Key::M),
    (Command::Layers, "Hide or show all overlays", Modifiers::NONE, Key::H),
    (Command::Compare, "Compare", Modifiers::NONE, Key::X),
    (Command::ProcessAll, "Process all frames", Modifiers::COMMAND, Key::P),
    (Command::Rerun, "Run all frames into a new MCAP", Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::P),
    (Command::ExportPicture, "Save picture with overlays", Modifiers::COMMAND, Key::E),
    (Command::Stages, "Stages panel", Modifiers::NONE, Key::S),
    (Command::Plots, "Plots panel", Modifiers::NONE, Key::P),
    (Command::Theme, "Dark or light", Modifiers::NONE, Key::D),
    (Command::Help, "This help", Modifiers::NONE, Key::F1),
];

impl Command {
    /// Its name.
    pub fn name(self) -> &'static str {
        ALL.iter().find(|(c, ..)| *c == self).map_or("", |(_, name, ..)| name)
    }
    /// Its key, as it is written for people.
    pub fn key(self, ctx: &egui::Context) -> String {
        let entry = ALL.iter().find(|(c, ..)| *c == self);
        entry.map_or_else(String::new, |(_, _, m, k)| ctx.format_shortcut(&KeyboardShortcut::new(*m, *k)))
    }
}

/// What the keys pressed since the last frame ask for. Keys with more modifiers are looked at first.
pub(super) fn pressed(ctx: &egui::Context) -> Vec<Command> {
    if ctx.text_edit_focused() {
        return Vec::new();
    }
    let weight = |m: &Modifiers| u8::from(m.command) + u8::from(m.shift);
    let mut table: Vec<_> = ALL.iter().collect();
    table.sort_by_key(|(_, _, m, _)| std::cmp::Reverse(weight(m)));
    ctx.input_mut(|i| {
        // The plus is on the same key as the equals sign, and may need shift.
        let plus = i.consume_key(Modifiers::NONE, Key::Equals) || i.consume_key(Modifiers::SHIFT, Key::Plus);
        let hit = table.into_iter().filter(|(_, _, m, k)| i.consume_shortcut(&KeyboardShortcut::new(*m, *k)));
        let hit: Vec<Command> = hit.map(|(c, ..)| *c).collect();
        hit.into_iter().chain(plus.then_some(Command::ZoomIn)).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_means_two_things() {
        for (i, (a, name, m, k)) in ALL.iter().enumerate() {
            assert!(!name.is_empty());
            for (b, _, n, l) in &ALL[..i] {
                assert!(a != b && (m, k) != (n, l), "{a:?} {b:?}");
            }
        }
    }
}
