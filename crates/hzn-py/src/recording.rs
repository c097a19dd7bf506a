//! Results that were recorded, as columns.

use std::path::PathBuf;

use hzn_mcap::{Contents, Reader, Row};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::Value;

use crate::errors::HznError;

/// Columns of an MCAP's results.
#[pyfunction]
pub(crate) fn read_mcap(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let failed = |e: hzn_mcap::Error| HznError::new_err(e.to_string());
    let rows = py.detach(|| {
        let reader = Reader::open(&path, Contents::WithoutImages)?;
        reader.map(|frame| frame.map(|f| f.row)).collect::<Result<Vec<Row>, _>>()
    });
    let rows: Vec<Value> = rows.map_err(failed)?.iter().map(|r| serde_json::to_value(r).unwrap_or_default()).collect();
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
            // Empty cells are NaN, as pandas and polars expect.
            let numbers: Vec<f64> = cells.iter().map(|c| c.as_f64().unwrap_or(f64::NAN)).collect();
            numpy.call_method1("array", (numbers, "f8"))?
        };
        table.set_item(name, column)?;
    }
    Ok(table)
}
