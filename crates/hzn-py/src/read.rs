//! A picture that Python gives: an array, or a file that is read as `hzn run` reads it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use hzn_core::Config;
use hzn_run::source::{self, Payload};
use hzn_run::{Error, open};
use pyo3::prelude::*;
use pyo3::types::{PyWeakrefMethods, PyWeakrefReference};

use crate::errors;
use crate::image::to_array;
use crate::state::State;

/// A picture as an array, and what its file says.
pub(crate) struct Read<'py> {
    pub(crate) image: Bound<'py, PyAny>,
    /// The file, which a report reads again when it shows the picture.
    pub(crate) path: Option<PathBuf>,
    /// Name of the file; empty for an array.
    pub(crate) file: String,
    pub(crate) bits: Option<u8>,
    pub(crate) time_s: Option<f64>,
    /// The sensor, with the bits and the tone of the file.
    pub(crate) state: Arc<State>,
}

impl<'py> Read<'py> {
    /// Takes an array, or reads a picture file.
    pub(crate) fn from_object(py: Python<'py>, state: &Arc<State>, image: &Bound<'py, PyAny>) -> PyResult<Self> {
        match image.extract::<PathBuf>() {
            Ok(path) => Self::from_file(py, state, path),
            Err(_) => Ok(Self {
                image: image.clone(),
                path: None,
                file: String::new(),
                bits: None,
                time_s: None,
                state: Arc::clone(state),
            }),
        }
    }

    /// Reads a picture file as `hzn run` does.
    pub(crate) fn from_file(py: Python<'py>, state: &Arc<State>, path: PathBuf) -> PyResult<Self> {
        let (shown, file) = (path.display().to_string(), path.file_name().unwrap_or_default().to_string_lossy().into());
        let payload = Payload::File(path.clone());
        let (completed, decoded) =
            errors::detached(py, || (complete(&path, &state.config), payload.decode(Some(&state.config))))?;
        let (picture, _) = decoded.map_err(|why| errors::image(format!("{shown}: {why}")))?;
        let bits = Some(picture.layout.bits).filter(|bits| (9..16).contains(bits));
        let time_s = picture.exif_time_s;
        let (config, notes) = completed.map_err(errors::run)?;
        notes.iter().try_for_each(|note| errors::warn(py, note))?;
        let state = state.completed(config)?;
        Ok(Self { image: to_array(py, picture)?, path: Some(path), file, bits, time_s, state })
    }
}

/// Returns the sensor with the bits and the tone of a picture file, as `hzn run` completes it, and what the user should
/// know about them.
fn complete(path: &Path, config: &Config) -> Result<(Config, Vec<String>), Error> {
    let mut source = source::open(&[path.to_path_buf()], None, None)?;
    let mut sensor = hzn_files::Sensor { config: config.clone(), text: String::new(), warnings: Vec::new() };
    // Nobody doubts the tone of a photograph: a note about each one would be noise.
    if let Some(found) = source::find_tone(source.as_ref()).filter(|_| config.input.tone.is_none()) {
        sensor.config.set_tone(found.tone);
    }
    let notes = open::complete(source.as_mut(), &mut sensor)?;
    Ok((sensor.config, notes))
}

/// The picture of a report, for showing it again.
pub(crate) enum Shown {
    /// An array, while another object keeps it alive: a report holds no picture.
    Array(Py<PyWeakrefReference>),
    /// A file, which is read again, with the sensor that read it.
    File(PathBuf, Arc<State>),
}

impl Shown {
    /// Remembers a picture. Returns `None` for an object without weak references.
    pub(crate) fn new(read: &Read<'_>) -> Option<Self> {
        match &read.path {
            Some(path) => Some(Self::File(path.clone(), Arc::clone(&read.state))),
            None => Some(Self::Array(PyWeakrefReference::new(&read.image).ok()?.unbind())),
        }
    }

    pub(crate) fn clone_ref(&self, py: Python<'_>) -> Self {
        match self {
            Self::Array(image) => Self::Array(image.clone_ref(py)),
            Self::File(path, state) => Self::File(path.clone(), Arc::clone(state)),
        }
    }

    /// Returns the picture: the array if it still exists, or the file, which is read again.
    pub(crate) fn picture<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        match self {
            Self::Array(image) => Ok(image.bind(py).upgrade()),
            Self::File(path, state) => Read::from_file(py, state, path.clone()).map(|read| Some(read.image)),
        }
    }
}
