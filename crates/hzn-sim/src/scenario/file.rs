//! Scenes, by name or from a file.

use std::path::{Path, PathBuf};

use hzn_files::{Problem, limited};

use super::{BUILTIN, Scenario, ScenarioError};

/// Returns the path and the text of a scene. `name` is one of [`BUILTIN`], or the path of a scene.toml.
///
/// # Errors
/// There is no built-in scene and no file with this name, or the file cannot be read.
pub fn source(name: &str) -> Result<(PathBuf, String), Problem> {
    if let Some((_, _, text)) = BUILTIN.iter().find(|b| b.0 == name) {
        return Ok((PathBuf::from(name), (*text).to_owned()));
    }
    let path = PathBuf::from(name);
    let text = limited::read_text(&path, limited::SETTINGS_BYTES).map_err(|e| {
        let names: Vec<&str> = BUILTIN.iter().map(|b| b.0).collect();
        let what = match hzn_files::nearest(name, names.iter().copied()) {
            Some(near) if !path.exists() => format!("no such scene or file; did you mean {near}?"),
            _ if !path.exists() => format!("no such file; built-in scenes are {}", names.join(", ")),
            _ => format!("cannot be read: {e}"),
        };
        Problem::new(&path, what)
    })?;
    Ok((path, text))
}

/// Loads and checks a scene. `frames` (number of pictures) and `seed` replace the values of the scene if they are
/// given.
///
/// # Errors
/// The errors of [`source`] and of [`parse`].
pub fn load(name: &str, frames: Option<u32>, seed: Option<u64>) -> Result<Scenario, Problem> {
    let (path, text) = source(name)?;
    parse(&text, &path, frames, seed)
}

/// Parses and checks the text of a scene.toml, as [`load`] does.
///
/// # Errors
/// The first key or value that is refused.
pub fn parse(text: &str, path: &Path, frames: Option<u32>, seed: Option<u64>) -> Result<Scenario, Problem> {
    let mut scenario = Scenario::parse(text, path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    scenario.read_files(folder).map_err(|e| refused(path, &e))?;
    if let Some(frames) = frames {
        scenario.capture.frames = frames;
    }
    if let Some(seed) = seed {
        scenario.seed = seed;
    }
    scenario.check().map_err(|e| refused(path, &e))?;
    Ok(scenario)
}

/// Returns the problem of a refused scene, with its name.
pub fn refused(name: impl AsRef<Path>, error: &ScenarioError) -> Problem {
    Problem::new(name.as_ref(), error.to_string())
}
