//! The commands of the window: one table for keys, menus and the help.

use egui::{Key, KeyboardShortcut, Modifiers};

/// A command of the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Asks for a path and opens it.
    Open,
    /// Saves the sensor.toml.
    Save,
    /// Saves the sensor.toml under another path.
    SaveAs,
    /// Undoes the last change.
    Undo,
    /// Makes the change again that was undone last.
    Redo,
    /// Goes back to the saved text.
    Reset,
    /// Shows the differences from the saved file.
    Diff,
    /// Starts or stops playing.
    Play,
    /// Goes to the next picture.
    Next,
    /// Goes to the previous picture.
    Back,
    /// Goes ten pictures forward.
    Next10,
    /// Goes ten pictures back.
    Back10,
    /// Goes to the first picture.
    First,
    /// Goes to the last picture.
    Last,
    /// Goes to the next picture without an answer.
    NextRefused,
    /// Goes to the previous picture without an answer.
    BackRefused,
    /// Goes to the worst picture, then to the second worst, and so on.
    Worst,
    /// Plays faster.
    Faster,
    /// Plays slower.
    Slower,
    /// Shows the whole picture.
    Fit,
    /// Shows one pixel of the picture per pixel of the screen.
    Actual,
    /// Enlarges the picture.
    ZoomIn,
    /// Makes the picture smaller.
    ZoomOut,
    /// Shows the picture in colour.
    Colour,
    /// Shows the brightness.
    Grey,
    /// Shows lit and dark pixels.
    Level,
    /// Shows the picture with or without the distortion of the lens.
    Undistorted,
    /// Starts or ends the drawing of the mask.
    Mask,
    /// Hides or shows all overlays.
    Layers,
    /// Compares with another sensor.
    Compare,
    /// Processes all pictures.
    ProcessAll,
    /// Processes all pictures into a new recording.
    Rerun,
    /// Saves the picture with its overlays.
    ExportPicture,
    /// Shows or hides the stages.
    Stages,
    /// Shows or hides the plots.
    Plots,
    /// Switches between dark and light colours.
    Theme,
    /// Shows or hides the help.
    Help,
}

/// The table: command, name and key.
pub(super) const ALL: &[(Command, &str, Modifiers, Key)] = &[
    (Command::Open, "Open", Modifiers::COMMAND, Key::O),
    (Command::Save, "Save sensor.toml", Modifiers::COMMAND, Key::S),
    (Command::SaveAs, "Save sensor.toml as", Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S),
    (Command::Undo, "Undo", Modifiers::COMMAND, Key::Z),
    (Command::Redo, "Redo", Modifiers::COMMAND, Key::Y),
    (Command::Reset, "Reset to the file", Modifiers::COMMAND, Key::R),
    (Command::Diff, "Changes against the file", Modifiers::COMMAND, Key::D),
    (Command::Play, "Play, pause", Modifiers::NONE, Key::Space),
    (Command::Next, "Next picture", Modifiers::NONE, Key::ArrowRight),
    (Command::Back, "Previous picture", Modifiers::NONE, Key::ArrowLeft),
    (Command::Next10, "Ten pictures forward", Modifiers::SHIFT, Key::ArrowRight),
    (Command::Back10, "Ten pictures back", Modifiers::SHIFT, Key::ArrowLeft),
    (Command::First, "First picture", Modifiers::NONE, Key::Home),
    (Command::Last, "Last picture", Modifiers::NONE, Key::End),
    (Command::NextRefused, "Next picture without an answer", Modifiers::NONE, Key::N),
    (Command::BackRefused, "Previous picture without an answer", Modifiers::SHIFT, Key::N),
    (Command::Worst, "Worst picture, then the next worst", Modifiers::NONE, Key::W),
    (Command::Faster, "Faster", Modifiers::NONE, Key::Period),
    (Command::Slower, "Slower", Modifiers::NONE, Key::Comma),
    (Command::Fit, "Whole picture", Modifiers::NONE, Key::Num0),
    (Command::Actual, "Single pixels (1:1)", Modifiers::NONE, Key::Num1),
    (Command::ZoomIn, "Larger", Modifiers::NONE, Key::Plus),
    (Command::ZoomOut, "Smaller", Modifiers::NONE, Key::Minus),
    (Command::Colour, "Colour", Modifiers::NONE, Key::C),
    (Command::Grey, "Grey: brightness", Modifiers::NONE, Key::G),
    (Command::Level, "Threshold: lit or dark pixels", Modifiers::NONE, Key::L),
    (Command::Undistorted, "Without distortion", Modifiers::NONE, Key::U),
    (Command::Mask, "Draw the mask", Modifiers::NONE, Key::M),
    (Command::Layers, "Hide or show all overlays", Modifiers::NONE, Key::H),
    (Command::Compare, "Compare", Modifiers::NONE, Key::X),
    (Command::ProcessAll, "Process all pictures", Modifiers::COMMAND, Key::P),
    (Command::Rerun, "Run all pictures into a new MCAP", Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::P),
    (Command::ExportPicture, "Save picture with overlays", Modifiers::COMMAND, Key::E),
    (Command::Stages, "Stages panel", Modifiers::NONE, Key::S),
    (Command::Plots, "Plots panel", Modifiers::NONE, Key::P),
    (Command::Theme, "Dark or light", Modifiers::NONE, Key::D),
    (Command::Help, "This help", Modifiers::NONE, Key::F1),
];

impl Command {
    /// Returns the name of the command.
    pub fn name(self) -> &'static str {
        ALL.iter().find(|(c, ..)| *c == self).map_or("", |(_, name, ..)| name)
    }
    /// Returns the key of the command, as text for the user.
    pub fn key(self, ctx: &egui::Context) -> String {
        let entry = ALL.iter().find(|(c, ..)| *c == self);
        entry.map_or_else(String::new, |(_, _, m, k)| ctx.format_shortcut(&KeyboardShortcut::new(*m, *k)))
    }
}

/// Returns the commands of the keys that were pressed since the last frame of the window. Keys with more modifiers are
/// checked first.
pub(super) fn pressed(ctx: &egui::Context) -> Vec<Command> {
    if ctx.text_edit_focused() {
        return Vec::new();
    }
    let weight = |m: &Modifiers| u8::from(m.command) + u8::from(m.shift);
    let mut table: Vec<_> = ALL.iter().collect();
    table.sort_by_key(|(_, _, m, _)| std::cmp::Reverse(weight(m)));
    ctx.input_mut(|i| {
        // The plus sign is on the same key as the equals sign, and may need the shift key.
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
