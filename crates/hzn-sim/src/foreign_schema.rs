//! Parts of the schema of scene.toml for types of other crates.

use hzn_core::body::{Kind, Limb};
use schemars::{Schema, SchemaGenerator};

/// Returns a section of the schema of sensor.toml.
fn section(name: &str) -> Schema {
    let sensor = hzn_files::keys::schema::json();
    let section = sensor.pointer(&format!("/properties/{name}")).cloned();
    section.and_then(|section| section.try_into().ok()).unwrap_or_default()
}

pub(crate) fn camera(_: &mut SchemaGenerator) -> Schema {
    section("camera")
}

pub(crate) fn mount(_: &mut SchemaGenerator) -> Schema {
    section("mount")
}

pub(crate) fn bodies(_: &mut SchemaGenerator) -> Schema {
    let names = [Kind::Earth, Kind::Sun, Kind::Moon].map(Kind::name);
    schemars::json_schema!({"type": "array", "items": {"enum": names}, "minItems": 1, "maxItems": 3})
}

pub(crate) fn limb(_: &mut SchemaGenerator) -> Schema {
    let thermal = [Limb::Window, Limb::Co2].map(|limb| toml::Value::try_from(limb).ok());
    let names: Vec<String> = thermal.iter().flatten().filter_map(|name| name.as_str().map(str::to_owned)).collect();
    schemars::json_schema!({"enum": names})
}
