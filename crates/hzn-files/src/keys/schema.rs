//! The JSON schema of sensor.toml. An editor uses it to complete keys and to mark wrong values.

use serde_json::{Map, Value, json};

use super::table::about;
use super::{Form, Key, Limits, PRESET, Table, default_of, defaults, keys_of_file, sections};

/// Returns the schema, in the draft 2020-12.
pub fn json() -> Value {
    let defaults = defaults();
    let mut properties = Map::from_iter([("preset".to_owned(), property(&PRESET, &defaults))]);
    for table in sections() {
        properties.insert(table.name.to_owned(), section(table, &defaults));
    }
    properties.insert(
        "bodies".to_owned(),
        json!({
            "type": "array",
            "maxItems": hzn_core::report::MAX_BODIES,
            "items": {"$ref": "#/properties/body"},
            "description": "Several bodies in one picture, instead of [body]. The sensor looks for them in this order, \
                            for Sun and Moon last.",
        }),
    );
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "sensor.toml",
        "description": "A horizon sensor: its camera, the body it looks for, and the parameters of every stage.",
        "type": "object",
        "properties": properties,
        "required": ["camera"],
        "additionalProperties": false,
    })
}

fn section(table: &Table, defaults: &toml::Table) -> Value {
    let keys = || table.keys.iter().chain(keys_of_file(table.name));
    let properties: Map<_, _> = keys().map(|key| (key.name().to_owned(), property(key, defaults))).collect();
    let mut schema = json!({
        "type": "object",
        "description": about(table),
        "properties": properties,
        "additionalProperties": false,
    });
    let required: Vec<_> =
        keys().filter(|key| key.unset.is_none() && default_of(key, defaults).is_none()).map(Key::name).collect();
    match table.name {
        "camera" => {
            schema["anyOf"] = json!([{"required": ["file"]}, {"required": required}]);
        }
        "mount" => schema["required"] = json!(["q_vehicle_from_camera_wxyz"]),
        _ => {}
    }
    schema
}

fn property(key: &Key, defaults: &toml::Table) -> Value {
    let mut schema = match key.form {
        Form::Number => json!({"type": "number"}),
        Form::Whole => json!({"type": "integer"}),
        Form::Flag => json!({"type": "boolean"}),
        Form::Word if key.choices.is_empty() => json!({"type": "string"}),
        Form::Word => json!({"enum": key.choices.iter().map(|choice| choice.name).collect::<Vec<_>>()}),
        Form::WordOrNumber => {
            let words: Vec<_> = key.choices.iter().map(|choice| choice.name).collect();
            json!({"anyOf": [{"enum": words}, {"type": "number"}]})
        }
        Form::Numbers => json!({"type": "array", "items": {"type": "number"}}),
        Form::Rows => json!({"type": "array", "items": {"type": "array", "items": {"type": "number"}}}),
        Form::Polygons => json!({"type": "array", "items": {"type": "array", "items": {"type": "array"}}}),
        // A body has the same sections as the whole file. The tables of a camera have keys of their own.
        _ if key.section() == "body" => json!({"$ref": format!("#/properties/{}", key.name())}),
        _ => json!({"type": "object"}),
    };
    let place = if key.form == Form::Numbers { &mut schema["items"] } else { &mut schema };
    if let Limits::Number { low, above, high } = key.limits {
        place[if above { "exclusiveMinimum" } else { "minimum" }] = json!(low);
        if high.is_finite() {
            place["maximum"] = json!(high);
        }
    }
    let paragraphs = key.doc.split("\n\n").map(|text| text.split_whitespace().collect::<Vec<_>>().join(" "));
    schema["description"] = json!(paragraphs.collect::<Vec<_>>().join("\n\n").trim());
    if let Some(Ok(value)) = defaults.get(key.section()).and_then(|s| s.get(key.name())).map(serde_json::to_value) {
        schema["default"] = value;
    }
    schema
}
