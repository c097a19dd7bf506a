//! Cells of a row as arrays; `None` if a cell is empty. Candidates as dictionaries.

use hzn_mcap::CandidateEdge;
use numpy::ndarray::{Array2, arr1, arr2};
use numpy::{PyArray1, PyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Returns a symmetric matrix from its upper triangle: xx, xy, xz, yy, yz, zz.
pub(crate) fn symmetric(py: Python<'_>, upper: [Option<f64>; 6]) -> Option<Bound<'_, PyArray2<f64>>> {
    let [xx, xy, xz, yy, yz, zz] = upper;
    let (xy, xz, yz) = (xy?, xz?, yz?);
    Some(arr2(&[[xx?, xy, xz], [xy, yy?, yz], [xz, yz, zz?]]).to_pyarray(py))
}

/// Returns a vector.
pub(crate) fn vector<'py>(py: Python<'py>, xyz: [Option<f64>; 3]) -> Option<Bound<'py, PyArray1<f64>>> {
    let [Some(x), Some(y), Some(z)] = xyz else { return None };
    Some(arr1(&[x, y, z]).to_pyarray(py))
}

/// Returns rows of numbers as an array of shape (n, N).
pub(crate) fn table<'py, const N: usize>(py: Python<'py>, rows: &[[f64; N]]) -> Bound<'py, PyArray2<f64>> {
    Array2::from_shape_fn((rows.len(), N), |(i, j)| rows[i][j]).to_pyarray(py)
}

/// Returns a candidate edge as a dictionary.
pub(crate) fn candidate<'py>(py: Python<'py>, edge: &CandidateEdge) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("length_px", edge.length_px)?;
    dict.set_item("points", edge.points)?;
    dict.set_item("inliers", edge.inliers)?;
    dict.set_item("rms_px", edge.rms_px)?;
    dict.set_item("verdict", &edge.verdict)?;
    Ok(dict)
}
