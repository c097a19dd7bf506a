//! Numbers, lists and matrices as the writers of camera files form them.

use serde_json::Value;

/// Reads a list of numbers; `None` if it is anything else.
pub(super) fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(number).collect()
}

/// Reads a number. YAML 1.1 writers may omit the decimal point, as in `1e-05`. A stricter reader takes this for a text,
/// so a text with a number is accepted too. A number must be finite.
pub(super) fn number(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_str()?.trim().parse().ok()).filter(|x: &f64| x.is_finite())
}

/// Reads an OpenCV matrix (its `data`), a list, or a list of rows, and flattens it.
pub(super) fn matrix(value: &Value) -> Option<Vec<f64>> {
    let list = value.get("data").unwrap_or(value).as_array()?;
    let mut out = Vec::new();
    for item in list {
        match item {
            Value::Array(row) => out.extend(row.iter().map(number).collect::<Option<Vec<_>>>()?),
            item => out.push(number(item)?),
        }
    }
    Some(out)
}
