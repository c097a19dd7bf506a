//! The keys as types of Python: a `TypedDict` for each section. A type checker then finds a misspelt key, and an editor
//! completes the keys.

use super::table::about;
use super::{Form, Key, Limits, PRESET, Table, default_of, defaults, keys_of_file, limits_in_words, sections, wrap};

/// Length of a line, in columns.
const WIDTH: usize = 120;

const HEAD: &str = r#""""Types of the sections of a sensor.toml, as dictionaries, for type checkers and editors.

``body: hzn.keys.Body = {"altitude_km": 230.0}`` is a dictionary whose keys a type checker compares with those of
``[body]``. The sensor itself checks names, values and limits in any case. A key that is None counts as left out.

`cargo xtask keys` writes this file from the table of keys.
"""

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias, TypedDict

from numpy.typing import NDArray

from . import _hzn

_Numbers: TypeAlias = Sequence[float] | NDArray[Any]
_Rows: TypeAlias = Sequence[Sequence[float]] | Sequence[NDArray[Any]] | NDArray[Any]
_Polygons: TypeAlias = Sequence[_Rows] | NDArray[Any]
"#;

/// The tables inside a section that are no sections themselves.
const CAMERA_TABLES: &str = r#"

class CameraCovariance(TypedDict):
    """Covariance of the intrinsic parameters of a camera, as a calibration program reports it."""

    order: Sequence[str]
    """The parameters of the rows and columns, by their names (``fx_px``, ``k1``)."""
    rows: _Rows
    """The matrix row by row, symmetric and positive semidefinite; in px² and the units of the coefficients."""


class _Reference(TypedDict):
    reference_c: float
    """Temperature for which the other keys of the camera hold, °C."""


class CameraTemperature(_Reference, total=False):
    """How the lens of a camera changes with its temperature; only ``reference_c`` is required."""

    focal_ppm_per_k: float
    """Relative change of both focal lengths, millionths per kelvin."""
    cx_px_per_k: float
    """Motion of the principal point along x, px per kelvin."""
    cy_px_per_k: float
    """Motion of the principal point along y, px per kelvin."""
    untold_sigma_k: float
    """1σ of the temperature of a picture that comes without one, K."""
"#;

/// The classes of the whole file. A dictionary that the sensor returns has the camera as keys, never as an object.
const FILE: &str = r#"

class Sections(_Optional):
    """The sections of a sensor.toml: the keyword arguments of `hzn.Sensor`. Only ``camera`` is required."""

    camera: _hzn.Camera | Camera


class Parameters(_Optional):
    """All parameters of a sensor: `hzn.Sensor.parameters`."""

    camera: Camera
"#;

/// Returns the text of the Python module.
pub fn module() -> String {
    let defaults = defaults();
    let mut out = String::from(HEAD) + CAMERA_TABLES;
    // A body contains other sections, so it stands after them.
    let (bodies, others): (Vec<_>, Vec<_>) = sections().partition(|table| table.name == "body");
    others.iter().chain(&bodies).for_each(|table| out += &class(table, &defaults));
    out += "\n\nclass _Optional(TypedDict, total=False):\n";
    out += &docstring("The sections that may be left out.");
    out.push('\n');
    out += &entry(&PRESET, &defaults);
    for table in sections().filter(|table| table.name != "camera") {
        let name = class_name(table.name);
        out += &format!("    {}: {name}\n{}", table.name, docstring(&about(table)));
        if table.name == "body" {
            out += &format!("    bodies: Sequence[{name}]\n");
            out += &docstring(
                "Several bodies in one picture, instead of `body`. The sensor searches in this order, for Sun \
                 and Moon last.",
            );
        }
    }
    out + FILE
}

/// Returns the name of a section's class: `Body` for `body`.
fn class_name(section: &str) -> String {
    let mut letters = section.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().collect::<String>() + letters.as_str())
}

fn class(table: &Table, defaults: &toml::Table) -> String {
    let keys = || table.keys.iter().chain(keys_of_file(table.name));
    // A section of which the file requires one single key requires it here, too. A camera may also come from a file.
    let is_total = table.name == "mount";
    let total = if is_total { "" } else { ", total=False" };
    let head = format!("\n\nclass {}(TypedDict{total}):\n{}\n", class_name(table.name), docstring(&about(table)));
    keys().fold(head, |text, key| text + &entry(key, defaults))
}

/// Writes a key with its type, and its meaning, values and default below it.
fn entry(key: &Key, defaults: &toml::Table) -> String {
    let default = default_of(key, defaults);
    let is_unset = default.is_none() && key.unset.is_some();
    let none = if is_unset && key.section() != "mount" { " | None" } else { "" };
    let mut about = key.sentence().to_owned();
    let unit = Some(key.unit()).filter(|unit| !unit.is_empty()).map_or(String::new(), |unit| format!(" {unit}"));
    match key.limits {
        Limits::Choice => {}
        Limits::Number { .. } => about += &format!(" Values: {}{unit}.", limits_in_words(key)),
        _ => about += &format!(" Values: {}.", limits_in_words(key)),
    }
    match (key.unset, default) {
        (Some("none"), _) => {}
        (Some(words), _) => about += &format!(" Default: {words}."),
        (None, Some(value)) => about += &format!(" Default: {value}."),
        (None, None) => {}
    }
    format!("    {}: {}{none}\n{}", key.name(), form(key), docstring(&about))
}

/// Returns the type of a key.
fn form(key: &Key) -> String {
    match key.form {
        Form::Number => "float".to_owned(),
        Form::Whole => "int".to_owned(),
        Form::Flag => "bool".to_owned(),
        Form::Word if key.choices.is_empty() => "str".to_owned(),
        Form::Word | Form::WordOrNumber => {
            let words: Vec<_> = key.choices.iter().map(|choice| format!("{:?}", choice.name)).collect();
            let number = if key.form == Form::WordOrNumber { " | float" } else { "" };
            format!("Literal[{}]{number}", words.join(", "))
        }
        Form::Numbers => "_Numbers".to_owned(),
        Form::Rows => "_Rows".to_owned(),
        Form::Polygons => "_Polygons".to_owned(),
        _ if key.section() == "body" => class_name(key.name()),
        _ if key.path == "camera.temperature" => "CameraTemperature".to_owned(),
        _ => "CameraCovariance".to_owned(),
    }
}

/// Writes a docstring inside a class. Names in code have two backticks there.
fn docstring(text: &str) -> String {
    let text = text.replace('`', "``");
    let text = format!("\"\"\"{text}");
    // The closing quotes stay in the last line.
    let mut lines = wrap(&text, WIDTH - 4 - 3);
    if let Some(last) = lines.last_mut() {
        last.push_str("\"\"\"");
    }
    lines.iter().map(|line| format!("    {line}\n")).collect()
}
