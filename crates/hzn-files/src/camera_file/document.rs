//! Reads the text of a camera file into values. YAML, JSON and OpenCV's XML are told apart by the text itself.

use std::path::Path;

use roxmltree::{Document, Node};
use serde_json::{Map, Number, Value};

use crate::Problem;

/// Reads a document. `path` is used in messages.
pub(super) fn parse(text: &str, path: &Path) -> Result<Value, Problem> {
    let text = text.trim_start_matches('\u{feff}');
    match text.trim_start().chars().next() {
        Some('<') => parse_xml(text, path),
        Some('{') => parse_json(text, path),
        _ => parse_yaml(text, path),
    }
}

/// Reads JSON. YAML with braces around the whole document is read too.
fn parse_json(text: &str, path: &Path) -> Result<Value, Problem> {
    serde_json::from_str(text).or_else(|e| {
        parse_yaml(text, path).map_err(|_| Problem {
            line: Some(e.line()),
            column: Some(e.column()),
            ..Problem::new(path, format!("not valid JSON: {e}"))
        })
    })
}

fn parse_yaml(text: &str, path: &Path) -> Result<Value, Problem> {
    // OpenCV writes `%YAML:1.0`, which is not a valid YAML directive.
    let body = match text.split_once('\n') {
        Some((first, rest)) if first.starts_with("%YAML:") => format!("#\n{rest}"),
        _ => text.to_owned(),
    };
    // The tag adds nothing to its mapping.
    let body = body.replace("!!opencv-matrix", "");
    // `ros2 topic echo` ends every message with this line.
    let body = body.trim_end().strip_suffix("\n---").unwrap_or(&body);
    serde_saphyr::from_str(body).map_err(|e| {
        let location = e.location();
        let shown = e.to_string();
        let what = format!("not valid YAML: {}", shown.lines().next().unwrap_or_default());
        let mut problem = Problem::new(path, what);
        if let Some(at) = location {
            problem.line = usize::try_from(at.line()).ok();
            problem.column = usize::try_from(at.column()).ok();
        }
        problem
    })
}

/// Reads the XML of OpenCV's FileStorage or of Metashape: an element is a value, or a mapping of its child elements.
fn parse_xml(text: &str, path: &Path) -> Result<Value, Problem> {
    let document = Document::parse(text).map_err(|e| {
        let at = e.pos();
        let place = (usize::try_from(at.row).ok(), usize::try_from(at.col).ok());
        Problem { line: place.0, column: place.1, ..Problem::new(path, format!("not valid XML: {e}")) }
    })?;
    let root = document.root_element();
    if root.has_tag_name("opencv_storage") || root.has_tag_name("calibration") {
        return Ok(element(root, 0));
    }
    let what = format!("is XML with the root <{}>; OpenCV's XML has the root <opencv_storage>", root.tag_name().name());
    Err(Problem::new(path, what))
}

/// Deepest element that is read. Camera files have three levels.
const MAX_DEPTH: usize = 16;

/// Returns the value of an element.
fn element(node: Node<'_, '_>, depth: usize) -> Value {
    let children: Vec<Node<'_, '_>> = node.children().filter(Node::is_element).collect();
    if children.is_empty() || depth > MAX_DEPTH {
        return scalar(node.text().unwrap_or_default());
    }
    // The elements of a list have the name `_`.
    if children.iter().all(|c| c.has_tag_name("_")) {
        return Value::Array(children.into_iter().map(|c| element(c, depth + 1)).collect());
    }
    let pairs = children.into_iter().map(|c| (c.tag_name().name().to_owned(), element(c, depth + 1)));
    Value::Object(pairs.collect::<Map<_, _>>())
}

/// Returns a number, a list of numbers, or a text.
fn scalar(text: &str) -> Value {
    let words: Vec<Option<Value>> = text.split_whitespace().map(to_number).collect();
    let numbers: Option<Vec<Value>> = words.into_iter().collect();
    match numbers {
        Some(mut numbers) if numbers.len() == 1 => numbers.remove(0),
        Some(numbers) if !numbers.is_empty() => Value::Array(numbers),
        _ => Value::String(text.trim().trim_matches('"').to_owned()),
    }
}

fn to_number(word: &str) -> Option<Value> {
    let whole = word.parse::<i64>().ok().map(Number::from);
    whole.or_else(|| word.parse().ok().and_then(Number::from_f64)).map(Value::Number)
}
