//! Conversion between sections and keys of a sensor.toml and Python data.

use std::path::Path;

use hzn_core::Config;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyModule};
use serde::Serialize;
use serde_json::Value;

use crate::errors;

/// Reads sections and checks them like a sensor.toml.
pub(crate) fn config(sections: &Bound<'_, PyDict>) -> PyResult<Config> {
    let text = toml::to_string(&from_python(sections)?).map_err(errors::config)?;
    Ok(hzn_files::sensor::parse(&text, Path::new("parameters")).map_err(errors::config)?.config)
}

/// Converts to plain Python data: dicts, lists, numbers, text.
pub(crate) fn to_python<'py>(py: Python<'py>, data: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(data).map_err(errors::other)?;
    json(py)?.call_method1("loads", (text,))
}

/// Converts Python data to JSON and leaves out None. Numbers and arrays of NumPy are accepted.
pub(crate) fn from_python(data: &Bound<'_, PyAny>) -> PyResult<Value> {
    let py = data.py();
    let options = PyDict::new(py);
    options.set_item("default", py.import("operator")?.call_method1("methodcaller", ("tolist",))?)?;
    let text: PyResult<String> = json(py)?.call_method("dumps", (data,), Some(&options)).and_then(|t| t.extract());
    let value = serde_json::from_str(&text.map_err(|e| errors::config(format!("parameters: {e}")))?);
    value.map(without_null).map_err(|_| errors::config("parameters: contain a number that is not finite; remove it"))
}

fn json(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    py.import("json")
}

/// Removes nulls, because TOML leaves a key out where JSON has null.
fn without_null(value: Value) -> Value {
    match value {
        Value::Object(map) => map
            .into_iter()
            .filter(|(_, v)| !v.is_null())
            .map(|(k, v)| (k, without_null(v)))
            .collect::<serde_json::Map<_, _>>()
            .into(),
        Value::Array(list) => list.into_iter().map(without_null).collect(),
        other => other,
    }
}
