//! Conversion between sections and keys of a sensor.toml and Python data.

use std::path::Path;

use hzn_core::Config;
use hzn_files::shapes::{self, Notation};
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict, PyModule, PyTuple};
use serde::Serialize;
use serde_json::Value;

use crate::errors;
use crate::numbers::class_of;

/// Reads sections and checks them like a sensor.toml.
pub(crate) fn config(sections: &Bound<'_, PyDict>) -> PyResult<Config> {
    let text = toml::to_string(&from_python(sections)?).map_err(errors::config)?;
    shapes::check(&text, Notation::Python).map_err(|what| errors::config(format!("parameters: {what}")))?;
    Ok(hzn_files::sensor::parse(&text, Path::new("parameters")).map_err(errors::unseen)?.config)
}

/// Converts to plain Python data: dicts, lists, numbers, text.
pub(crate) fn to_python<'py>(py: Python<'py>, data: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(data).map_err(errors::other)?;
    json(py)?.call_method1("loads", (text,))
}

/// Converts Python data to JSON and leaves out None. Numbers and arrays of NumPy are accepted, and paths.
pub(crate) fn from_python(data: &Bound<'_, PyAny>) -> PyResult<Value> {
    let text = dumps(data, true).map_err(|e| match find_foreign(data) {
        Some((place, kind)) => errors::config(format!(
            "parameters: {place}: {kind} is no value of a sensor; write a number, a text, a list or a dict"
        )),
        None => errors::config(format!("parameters: {e}")),
    })?;
    serde_json::from_str(&text).map(without_null).map_err(|_| {
        let place =
            find_refused(data, false, String::new()).map_or_else(String::new, |(place, _)| format!(" {place}:"));
        errors::config(format!("parameters:{place} a number is not finite; write None or leave it out"))
    })
}

/// Writes JSON. Without `allow_nan`, a number that is not finite is an error; with it, the text is then no JSON.
fn dumps(data: &Bound<'_, PyAny>, allow_nan: bool) -> PyResult<String> {
    let py = data.py();
    let plain = |args: &Bound<'_, PyTuple>, _: Option<&Bound<'_, PyDict>>| {
        let object = args.get_item(0)?;
        let as_list = object.call_method0("tolist");
        as_list.or_else(|_| object.call_method0("__fspath__")).map(Bound::unbind)
    };
    let options = PyDict::new(py);
    options.set_item("default", PyCFunction::new_closure(py, None, None, plain)?)?;
    options.set_item("allow_nan", allow_nan)?;
    json(py)?.call_method("dumps", (data,), Some(&options))?.extract()
}

/// Returns the place and the class of the first value that JSON does not have.
fn find_foreign(data: &Bound<'_, PyAny>) -> Option<(String, String)> {
    let (place, value) = find_refused(data, true, String::new())?;
    Some((place, format!("an object of the class {}", class_of(&value))))
}

/// Returns the first value that [`dumps`] refuses, with its place.
fn find_refused<'py>(data: &Bound<'py, PyAny>, allow_nan: bool, place: String) -> Option<(String, Bound<'py, PyAny>)> {
    let Ok(dict) = data.cast::<PyDict>() else {
        return dumps(data, allow_nan).is_err().then(|| (place, data.clone()));
    };
    dict.iter().find_map(|(key, value)| {
        let key = key.to_string();
        find_refused(&value, allow_nan, if place.is_empty() { key } else { format!("{place}.{key}") })
    })
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
