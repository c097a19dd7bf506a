//! Recordings: results as columns, one picture after another, and shards of an archive.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use hzn_mcap::{Contents, EncodedImage, FrameRecord, Reader, Row};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::Value;

use crate::camera::Camera;
use crate::errors;
use crate::report::Report;
use crate::sensor::Sensor;

#[doc = doc!("read_mcap")]
#[pyfunction]
pub(crate) fn read_mcap(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let read = errors::detached(py, || {
        let mut reader = Reader::open(&path, Contents::WithoutImages)?;
        let rows = reader.by_ref().map(|frame| frame.map(|f| f.row)).collect::<Result<Vec<Row>, hzn_mcap::Error>>()?;
        Ok::<_, hzn_mcap::Error>((rows, hzn_run::source::describe_recording_loss(&reader, &path, "read")))
    })?;
    let (rows, lost) = read.map_err(errors::other)?;
    lost.map_or(Ok(()), |lost| errors::warn(py, lost))?;
    let rows: Vec<Value> = rows.iter().map(|r| serde_json::to_value(r).unwrap_or_default()).collect();
    let numpy = py.import("numpy")?;
    let table = PyDict::new(py);
    for name in Row::COLUMNS {
        let cells: Vec<&Value> = rows.iter().map(|r| &r[name]).collect();
        let column = if cells.iter().any(|c| c.is_string()) || matches!(name, "file" | "body" | "status" | "detail") {
            let texts = PyList::new(py, cells.iter().map(|c| c.as_str().unwrap_or_default()))?;
            numpy.call_method1("array", (texts, "U"))?
        } else if name == "index" {
            numpy.call_method1("array", (cells.iter().map(|c| c.as_u64().unwrap_or(0)).collect::<Vec<_>>(), "u8"))?
        } else {
            // Empty cells become NaN, as pandas and polars expect.
            let numbers: Vec<f64> = cells.iter().map(|c| c.as_f64().unwrap_or(f64::NAN)).collect();
            numpy.call_method1("array", (numbers, "f8"))?
        };
        table.set_item(name, column)?;
    }
    Ok(table)
}

#[doc = doc!("open_mcap")]
#[pyfunction]
pub(crate) fn open_mcap(py: Python<'_>, path: PathBuf) -> PyResult<Recording> {
    let reader = errors::detached(py, || Reader::open(&path, Contents::All))?.map_err(errors::other)?;
    let text = reader.sensor_toml().map(str::to_owned);
    let config = text.as_deref().and_then(|t| hzn_files::sensor::parse(t, Path::new("sensor.toml")).ok());
    Ok(Recording {
        sensor_toml: text,
        metadata: reader.metadata().clone(),
        camera: config.and_then(|c| Camera::from_config(c.config.camera).ok()).map(Arc::new),
        path,
        open: Mutex::new(Some(Open { reader, ahead: None, warned: false })),
    })
}

#[doc = doc!("Recording")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Recording {
    sensor_toml: Option<String>,
    metadata: BTreeMap<String, String>,
    camera: Option<Arc<Camera>>,
    path: PathBuf,
    open: Mutex<Option<Open>>,
}

struct Open {
    reader: Reader,
    /// First record of the next picture.
    ahead: Option<FrameRecord>,
    /// True if the user was warned about missing data.
    warned: bool,
}

impl Open {
    /// Returns which part is missing of a recording that was read to its end, but only once.
    fn lost(&mut self, path: &Path) -> Option<String> {
        if std::mem::replace(&mut self.warned, true) {
            None
        } else {
            hzn_run::source::describe_recording_loss(&self.reader, path, "read")
        }
    }

    /// Returns the records of a picture, one for each body.
    fn next(&mut self) -> Result<Vec<FrameRecord>, hzn_mcap::Error> {
        let mut records: Vec<FrameRecord> = self.ahead.take().into_iter().collect();
        while let Some(record) = self.reader.next().transpose()? {
            if records.first().is_some_and(|first| first.row.index != record.row.index) {
                self.ahead = Some(record);
                break;
            }
            records.push(record);
        }
        Ok(records)
    }
}

#[pymethods]
impl Recording {
    #[doc = doc!("Recording.sensor_toml")]
    #[getter]
    fn sensor_toml(&self) -> Option<&str> {
        self.sensor_toml.as_deref()
    }
    #[doc = doc!("Recording.metadata")]
    #[getter]
    fn metadata(&self) -> BTreeMap<String, String> {
        self.metadata.clone()
    }
    #[doc = doc!("Recording.sensor")]
    fn sensor(&self) -> PyResult<Sensor> {
        let text = self.sensor_toml.as_deref().ok_or_else(|| errors::other("the recording contains no sensor.toml"))?;
        let parsed = hzn_files::sensor::parse(text, Path::new("sensor.toml")).map_err(errors::config)?;
        Sensor::from_config(parsed.config, false)
    }
    #[doc = doc!("Recording.close")]
    fn close(&self) {
        *self.open.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }
    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Frame>> {
        let (records, lost) = errors::detached(py, || {
            let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
            let open =
                open.as_mut().ok_or_else(|| errors::other("the recording is closed; open_mcap opens it again"))?;
            let records = open.next().map_err(errors::other)?;
            let lost = if records.is_empty() { open.lost(&self.path) } else { None };
            Ok::<_, PyErr>((records, lost))
        })??;
        let Some(image) = records.first().map(|first| first.image.clone()) else {
            lost.map_or(Ok(()), |lost| errors::warn(py, lost))?;
            return Ok(None);
        };
        let reports = records.into_iter().map(|r| Report::from_record(r, self.camera.clone()));
        Ok(Some(Frame { image, report: Py::new(py, Report::from_bodies(py, reports)?)? }))
    }
    fn __enter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }
    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, _exception: &Bound<'_, pyo3::types::PyTuple>) {
        self.close();
    }
}

#[doc = doc!("Frame")]
#[pyclass(frozen, module = "hzn")]
pub(crate) struct Frame {
    image: Option<EncodedImage>,
    report: Py<Report>,
}

#[pymethods]
impl Frame {
    #[doc = doc!("Frame.image")]
    #[getter]
    fn image<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(image) = self.image.clone() else { return Ok(None) };
        let decoded = errors::detached(py, || hzn_run::source::Payload::from_recorded(image).decode(None))?;
        crate::image::to_array(py, decoded.map_err(errors::image)?.0).map(Some)
    }
    #[doc = doc!("Frame.report")]
    #[getter]
    fn report(&self, py: Python<'_>) -> Py<Report> {
        self.report.clone_ref(py)
    }
}

/// Writes reports into a recording and replaces an existing file.
#[pyfunction]
#[pyo3(name = "_write_mcap")]
pub(crate) fn write_mcap(py: Python<'_>, path: PathBuf, sensor: &Sensor, reports: Vec<Py<Report>>) -> PyResult<()> {
    let config = sensor.state().config.clone();
    let frames: Vec<Vec<FrameRecord>> = reports.iter().map(|r| r.get().each().map(Report::record).collect()).collect();
    errors::detached(py, || {
        let sensor_toml = hzn_files::sensor::to_text(&config).map_err(errors::other)?;
        let metadata = [("program".to_owned(), format!("hzn in Python {}", env!("CARGO_PKG_VERSION")))].into();
        let camera = Some(config.camera);
        let options = hzn_mcap::Options { sensor_toml, metadata, camera, force: true, ..hzn_mcap::Options::default() };
        let mut writer = hzn_mcap::Writer::create(&path, &options).map_err(errors::other)?;
        frames.iter().try_for_each(|bodies| writer.write_bodies(bodies)).map_err(errors::other)?;
        writer.finish().map(drop).map_err(errors::other)
    })?
}
