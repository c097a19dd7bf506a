//! Entry points for arbitrary bytes.
//!
//! Each function of [`TARGETS`] takes any bytes, gives them to one part of the program as a file, a picture or a
//! stream, and panics if a promise is broken. `fuzz/` runs them under libFuzzer (`cargo xtask campaign fuzz`); the test
//! of this crate replays the corpora that libFuzzer found.

mod files;
mod flight;
mod input;
mod picture;
mod texts;

/// A function that takes any bytes.
pub type Target = fn(&[u8]);

/// The targets by name. The name is also that of the folder of the target's corpus.
pub const TARGETS: &[(&str, Target)] = &[
    ("picture", picture::any_picture),
    ("rows", picture::any_rows),
    ("sensor_toml", texts::sensor_toml),
    ("frames_csv", texts::frames_csv),
    ("scene_toml", texts::scene_toml),
    ("camera_file", texts::camera_file),
    ("tables", texts::tables),
    ("picture_file", files::picture_file),
    ("mcap", files::mcap),
    ("results", files::results),
    ("telemetry", flight::telemetry),
    ("telecommand", flight::telecommand),
    ("parameters", flight::parameters),
];
