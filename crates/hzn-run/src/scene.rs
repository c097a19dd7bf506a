//! Scenes by name or from a file.

use std::path::{Path, PathBuf};

use hzn_sim::scenario::BUILTIN;
use hzn_sim::{Scenario, ScenarioError};

use crate::error::{Error, unusable};
use crate::sink;

/// Path and text of a scene: one of [`BUILTIN`], or a scene.toml.
///
/// # Errors
/// No such scene or file.
pub fn source(name: &str) -> Result<(PathBuf, String), Error> {
    if let Some((_, _, text)) = BUILTIN.iter().find(|b| b.0 == name) {
        return Ok((PathBuf::from(name), (*text).to_owned()));
    }
    let path = PathBuf::from(name);
    let text = std::fs::read_to_string(&path).map_err(|e| {
        let names: Vec<&str> = BUILTIN.iter().map(|b| b.0).collect();
        match hzn_calib::nearest(name, names.iter().copied()) {
            Some(near) if !path.exists() => unusable(format!("{name}: no such scene or file; did you mean {near}?")),
            _ if !path.exists() => unusable(format!("{name}: no such file; built-in scenes are {}", names.join(", "))),
            _ => sink::cannot(&path, &e),
        }
    })?;
    Ok((path, text))
}

/// A scene that was checked, with the number of pictures and the seed instead of its own where they are given.
///
/// # Errors
/// As [`source`] and [`parse`].
pub fn load(name: &str, frames: Option<u32>, seed: Option<u64>) -> Result<Scenario, Error> {
    let (path, text) = source(name)?;
    parse(&text, &path, frames, seed)
}

/// As [`load`], from the text of a scene.toml.
///
/// # Errors
/// The first key or value that is refused.
pub fn parse(text: &str, path: &Path, frames: Option<u32>, seed: Option<u64>) -> Result<Scenario, Error> {
    let name = path.display().to_string();
    let pair = |e: ScenarioError| (e.field, e.what);
    let mut scenario: Scenario =
        hzn_calib::document::parse(text, path, |s: &Scenario| s.check().map_err(pair)).map_err(Error::from)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    scenario.read_files(folder).map_err(|e| refused(&name, &e))?;
    if let Some(frames) = frames {
        scenario.capture.frames = frames;
    }
    if let Some(seed) = seed {
        scenario.seed = seed;
    }
    scenario.check().map_err(|e| refused(&name, &e))?;
    Ok(scenario)
}

/// A scene that is refused, by its name.
pub fn refused(name: &str, error: &ScenarioError) -> Error {
    unusable(format!("{name}: {error}"))
}
