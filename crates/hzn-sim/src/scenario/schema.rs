//! The JSON schema of scene.toml, from the structures that read the file: their keys and comments, and the limits of
//! [`Scenario::check`]. An editor uses it to complete keys and to mark wrong values.
//!
//! The schema accepts each scene that hzn accepts. It does not know rules that combine several keys.

use std::collections::BTreeMap;

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::check::ABOVE_ZERO;
use super::{Part, Scenario};
use crate::scene::World;
use crate::texture::Clouds;
use crate::weather::Weather;

/// Words of schemars that say something about Rust, and nothing about the file.
const NOT_OF_THE_FILE: &[&str] = &["title", "format"];

/// Mark of a number that may be infinite.
const INFINITE: &str = "infinite";

/// Returns the schema, in the draft 2020-12.
pub fn json() -> Value {
    // Without references, since not every editor follows them.
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    let mut schema = settings.into_generator().into_root_schema_for::<Scenario>().to_value();
    tidy(&mut schema);
    for (path, [low, high]) in limits() {
        if let Some(property) = find(&mut schema, &path) {
            restrict(property, low, high);
        }
    }
    if let Some(object) = schema.as_object_mut() {
        object.insert("title".to_owned(), json!("scene.toml"));
    }
    schema
}

/// Returns the limits of each checked key by its path: the widest ones, where a key has several.
fn limits() -> BTreeMap<Vec<String>, [f64; 2]> {
    let mut all: BTreeMap<Vec<String>, [f64; 2]> = BTreeMap::new();
    for limit in all_kinds().iter().flat_map(Scenario::limits) {
        let [low, high] = limit.range();
        let widest = all.entry(limit.path()).or_insert([low, high]);
        *widest = [widest[0].min(low), widest[1].max(high)];
    }
    all
}

/// Returns scenes that together have each key whose limits are checked, with the widest limits where one key limits
/// another.
fn all_kinds() -> Vec<Scenario> {
    let clouds = Clouds { largest_km: 20_000.0, ..Clouds::default() };
    let part = Part { polygon_px: vec![[0.0; 2]], brightness: 0.0, masked: false };
    let mut all: Vec<Scenario> = ["rocket", "leo-infrared"].into_iter().filter_map(Scenario::builtin).collect();
    for scenario in &mut all {
        scenario.vehicle = vec![part.clone()];
        match &mut scenario.world {
            World::Visible(world) => world.clouds = clouds,
            World::Infrared(world) => (world.clouds, world.weather) = (Some(clouds), Some(Weather::default())),
            World::Plain | World::Ellipsoid(_) => {}
        }
    }
    all
}

/// Returns the property with a path of keys. A list is its elements.
fn find<'a>(schema: &'a mut Value, path: &[String]) -> Option<&'a mut Value> {
    let Some((key, rest)) = path.split_first() else { return Some(schema) };
    if schema.get("items").is_some() {
        return find(schema.get_mut("items")?, path);
    }
    find(schema.get_mut("properties")?.get_mut(key)?, rest)
}

/// Adds limits to a number, or to the numbers of a list.
fn restrict(schema: &mut Value, low: f64, high: f64) {
    if let Some(items) = schema.get_mut("items") {
        return restrict(items, low, high);
    }
    let Some(object) = schema.as_object_mut() else { return };
    let lowest = if low == ABOVE_ZERO { ("exclusiveMinimum", 0.0) } else { ("minimum", low) };
    object.remove("minimum");
    for (word, value) in [lowest, ("maximum", high)] {
        if value.is_finite() {
            object.insert(word.to_owned(), json!(value));
        }
    }
}

/// Removes what a file of TOML cannot have (null), and what belongs to Rust.
fn tidy(schema: &mut Value) {
    match schema {
        Value::Array(all) => all.iter_mut().for_each(tidy),
        Value::Object(object) => {
            tidy_object(object);
            merge_choice(object);
            for (word, value) in object.iter_mut() {
                // A property can have the name of a word of the schema.
                match value {
                    Value::Object(keys) if word == "properties" => keys.values_mut().for_each(tidy),
                    _ if word != "default" => tidy(value),
                    _ => {}
                }
            }
        }
        _ => {}
    }
}

fn tidy_object(object: &mut Map<String, Value>) {
    for word in NOT_OF_THE_FILE {
        object.remove(*word);
    }
    // The keys of a table have their own.
    if object.get("default").is_some_and(|default| default.is_null() || default.is_object()) {
        object.remove("default");
    }
    if let Some(Value::String(text)) = object.get_mut("description") {
        *text = plain(text);
    }
    if let Some(kinds) = object.get("type").and_then(Value::as_array) {
        let Some(kind) = kinds.iter().find(|kind| *kind != "null").cloned() else { return };
        object.insert("type".to_owned(), kind);
    }
    // Editors of TOML take infinity for null.
    if object.remove(INFINITE).is_some() {
        object.insert("type".to_owned(), json!(["number", "null"]));
    }
    let null = json!({"type": "null"});
    if let Some(branches) = object.get_mut("anyOf").and_then(Value::as_array_mut)
        && branches.contains(&null)
    {
        branches.retain(|branch| *branch != null);
        if let [Value::Object(only)] = branches.as_slice() {
            let only = only.clone();
            object.remove("anyOf");
            for (word, value) in only {
                object.entry(word).or_insert(value);
            }
            tidy_object(object);
        }
    }
}

/// Makes one table of tables of which one is chosen, so that an editor names the wrong key in it instead of the whole
/// choice. A word may be there in place of a table.
fn merge_choice(object: &mut Map<String, Value>) {
    let Some(branches) = object.get("oneOf").and_then(Value::as_array) else { return };
    let (mut keys, mut words) = (Map::new(), Vec::new());
    for branch in branches {
        let properties = branch.get("properties").and_then(Value::as_object);
        match (branch.get("const").and_then(Value::as_str), properties.and_then(|all| all.iter().next())) {
            (Some(word), _) => words.push(word.to_owned()),
            (None, Some((key, property))) => {
                let mut property = property.clone();
                if let (Some(of_choice), Some(own)) = (branch.get("description"), property.as_object_mut()) {
                    own.insert("description".to_owned(), of_choice.clone());
                }
                keys.insert(key.clone(), property);
            }
            (None, None) => return,
        }
    }
    // Words alone stay a choice, in which each has its description.
    if keys.is_empty() {
        return;
    }
    object.remove("oneOf");
    object.insert("type".to_owned(), if words.is_empty() { json!("object") } else { json!(["object", "string"]) });
    if !words.is_empty() {
        object.insert("pattern".to_owned(), json!(format!("^({})$", words.join("|"))));
    }
    object.insert("properties".to_owned(), keys.into());
    for (word, value) in
        [("additionalProperties", json!(false)), ("minProperties", json!(1)), ("maxProperties", json!(1))]
    {
        object.insert(word.to_owned(), value);
    }
}

/// Returns a comment of Rust as plain text: lines are joined, and links are their words.
fn plain(text: &str) -> String {
    let paragraphs = text.split("\n\n").map(|text| text.split_whitespace().collect::<Vec<_>>().join(" "));
    let text = paragraphs.collect::<Vec<_>>().join("\n\n");
    text.replace("[`", "`").replace("`]", "`")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_files_are_those_of_the_structures() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let page = std::fs::read_to_string(root.join("book/reference/scene.schema.json")).unwrap();
        let say = "the keys of scene.toml changed: run `cargo xtask keys`";
        assert!(page == super::super::SCHEMA, "{say}");
        assert!(serde_json::from_str::<Value>(&page).unwrap() == json(), "{say}");
    }

    #[test]
    fn a_limit_of_the_check_is_one_of_the_schema() {
        let schema = json();
        let mut lost: Vec<String> = Vec::new();
        for path in limits().keys() {
            let mut copy = schema.clone();
            let property = find(&mut copy, path).unwrap_or_else(|| panic!("{path:?} is no property"));
            let text = property.to_string();
            if !text.contains("inimum\":") {
                lost.push(path.join("."));
            }
        }
        assert!(lost.is_empty(), "{lost:?}");
        let at = |pointer: &str| schema.pointer(pointer).unwrap_or_else(|| panic!("{pointer}"));
        assert_eq!(at("/properties/capture/properties/jpeg_quality/maximum"), &json!(100.0));
        assert_eq!(at("/properties/exposure/properties/gain/exclusiveMinimum"), &json!(0.0));
        assert_eq!(at("/properties/known/properties/attitude_sigma_deg/type"), "number");
    }

    #[test]
    fn each_key_has_a_description() {
        fn collect(schema: &Value, place: &str, without: &mut Vec<String>) {
            for branch in schema.get("oneOf").and_then(Value::as_array).into_iter().flatten() {
                collect(branch, place, without);
            }
            if let Some(items) = schema.get("items") {
                collect(items, place, without);
            }
            for (key, property) in schema.get("properties").and_then(Value::as_object).into_iter().flatten() {
                let place = format!("{place}.{key}");
                if property.get("description").is_none() {
                    without.push(place.clone());
                }
                collect(property, &place, without);
            }
        }
        let mut without = Vec::new();
        collect(&json(), "", &mut without);
        assert!(without.is_empty(), "{without:?}");
        let text = json().to_string();
        assert!(!text.contains("[`") && text.matches("null").count() == 1, "words of Rust");
        let yoyo = json().pointer("/properties/attitude/properties/spin/properties/yoyo_s/type").cloned();
        assert_eq!(yoyo, Some(json!(["number", "null"])));
        assert_eq!(json().pointer("/properties/world/pattern"), Some(&json!("^(plain)$")));
    }
}
