//! The commands of the window: one table for keys, menus and the help.

use egui::{Key, KeyboardShortcut, Modifiers};

/// A command of the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Asks for a file and opens it.
    Open,
    /// Asks for a folder and opens it.
    OpenFolder,
    /// Opens a path that is typed.
    OpenPath,
    /// Opens the same files again.
    Reload,
    /// Shows new pictures as they come.
    Follow,
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
    /// Shows the brightness as colours.
    FalseColour,
    /// Shows the picture with or without the distortion of the lens.
    Undistorted,
    /// Starts or ends the drawing of the mask.
    Mask,
    /// Starts or ends the dragging of the image circle.
    Circle,
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
    /// Shows or hides the column with the answer.
    Answer,
    /// Shows or hides the stages.
    Stages,
    /// Shows or hides the plots.
    Plots,
    /// Shows or hides the view from space.
    Space,
    /// Switches between dark and light colours.
    Theme,
    /// Finds a command or a key of sensor.toml by its name.
    Palette,
    /// Shows or hides the help.
    Help,
}

/// The table: command, name and key.
pub(super) const ALL: &[(Command, &str, Modifiers, Key)] = &[
    (Command::Open, "Open file…", Modifiers::COMMAND, Key::O),
    (Command::OpenFolder, "Open folder…", Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::O),
    (Command::OpenPath, "Open path…", Modifiers::COMMAND, Key::L),
    (Command::Reload, "Reload the pictures", Modifiers::NONE, Key::F5),
    (Command::Follow, "Follow new pictures", Modifiers::SHIFT, Key::F),
    (Command::Save, "Save sensor.toml", Modifiers::COMMAND, Key::S),
    (Command::SaveAs, "Save sensor.toml as…", Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S),
    (Command::Undo, "Undo", Modifiers::COMMAND, Key::Z),
    (Command::Redo, "Redo", Modifiers::COMMAND, Key::Y),
    (Command::Reset, "Discard unsaved changes", Modifiers::COMMAND, Key::R),
    (Command::Diff, "Unsaved changes", Modifiers::COMMAND, Key::D),
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
    (Command::Fit, "Zoom to fit", Modifiers::NONE, Key::Num0),
    (Command::Actual, "Zoom to 1:1", Modifiers::NONE, Key::Num1),
    (Command::ZoomIn, "Zoom in", Modifiers::NONE, Key::Plus),
    (Command::ZoomOut, "Zoom out", Modifiers::NONE, Key::Minus),
    (Command::Colour, "Colour", Modifiers::NONE, Key::C),
    (Command::Grey, "Grey: brightness", Modifiers::NONE, Key::G),
    (Command::Level, "Threshold: lit or dark pixels", Modifiers::NONE, Key::L),
    (Command::FalseColour, "False colour: brightness as colours", Modifiers::NONE, Key::F),
    (Command::Undistorted, "Without distortion", Modifiers::NONE, Key::U),
    (Command::Mask, "Draw the mask", Modifiers::NONE, Key::M),
    (Command::Circle, "Drag the image circle", Modifiers::NONE, Key::I),
    (Command::Layers, "Hide or show all overlays", Modifiers::NONE, Key::H),
    (Command::Compare, "Compare", Modifiers::NONE, Key::X),
    (Command::ProcessAll, "Process all pictures again", Modifiers::SHIFT, Key::F5),
    (Command::Rerun, "Run all pictures into a new MCAP…", Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::P),
    (Command::ExportPicture, "Save picture with overlays…", Modifiers::COMMAND, Key::E),
    (Command::Answer, "Answer panel", Modifiers::NONE, Key::A),
    (Command::Stages, "Stages panel", Modifiers::NONE, Key::S),
    (Command::Plots, "Plots panel", Modifiers::NONE, Key::P),
    (Command::Space, "View from space", Modifiers::NONE, Key::V),
    (Command::Theme, "Dark or light theme", Modifiers::NONE, Key::D),
    (Command::Palette, "Find a command or a key…", Modifiers::COMMAND, Key::P),
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

/// Further keys of commands. The plus sign shares its key with the equals sign, and may need the shift key.
const FURTHER: &[(Command, Modifiers, Key)] = &[
    (Command::Redo, Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z),
    (Command::ZoomIn, Modifiers::SHIFT, Key::Plus),
    (Command::ZoomIn, Modifiers::NONE, Key::Equals),
    (Command::ZoomIn, Modifiers::SHIFT, Key::Equals),
];

/// Returns the command of a key with exactly these modifiers.
fn find(key: Key, pressed: Modifiers) -> Option<Command> {
    let keys = ALL.iter().map(|(c, _, m, k)| (*c, *m, *k)).chain(FURTHER.iter().copied());
    // On a Mac, the control key is another key than the command key.
    let extra = |m: Modifiers| pressed.ctrl && !pressed.command && !m.ctrl;
    let same = |m: Modifiers| (m.command, m.shift, m.alt) == (pressed.command, pressed.shift, pressed.alt) && !extra(m);
    keys.filter(|(_, m, k)| *k == key && same(*m)).map(|(c, ..)| c).next()
}

/// Returns the commands of the keys that were pressed since the last frame of the window, in order. A key counts only
/// with exactly the modifiers of its command.
pub(super) fn pressed(ctx: &egui::Context) -> Vec<Command> {
    if ctx.text_edit_focused() {
        return Vec::new();
    }
    let mut commands = Vec::new();
    ctx.input_mut(|i| {
        i.events.retain(|event| {
            let command = match event {
                egui::Event::Key { key, modifiers, pressed: true, .. } => find(*key, *modifiers),
                _ => None,
            };
            commands.extend(command);
            command.is_none()
        });
    });
    commands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modifiers_are_matched_exactly() {
        let ctrl = Modifiers { ctrl: true, ..Modifiers::COMMAND };
        assert_eq!(find(Key::Z, ctrl), Some(Command::Undo));
        assert_eq!(find(Key::Z, ctrl | Modifiers::SHIFT), Some(Command::Redo));
        assert_eq!(find(Key::Y, ctrl), Some(Command::Redo));
        assert_eq!(find(Key::S, Modifiers::NONE), Some(Command::Stages));
        assert_eq!(find(Key::S, Modifiers::SHIFT), None);
        assert_eq!(find(Key::S, ctrl), Some(Command::Save));
        assert_eq!(find(Key::S, Modifiers::ALT), None);
        assert_eq!(find(Key::Z, Modifiers { ctrl: true, ..Modifiers::NONE }), None, "this is no command key");
        assert_eq!(find(Key::Equals, Modifiers::SHIFT), Some(Command::ZoomIn));
    }

    #[test]
    fn no_key_means_two_things() {
        for (command, m, k) in FURTHER {
            assert!(ALL.iter().all(|(_, _, n, l)| (m, k) != (n, l)), "{command:?}");
        }
        for (i, (a, name, m, k)) in ALL.iter().enumerate() {
            assert!(!name.is_empty());
            for (b, _, n, l) in &ALL[..i] {
                assert!(a != b && (m, k) != (n, l), "{a:?} {b:?}");
            }
        }
    }
}
