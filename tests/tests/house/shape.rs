//! Tests the shape of the sources: short functions, short files, short lines.

use std::fs;
use std::path::{Path, PathBuf};

/// Longest line in columns.
const MAX_COLUMNS: usize = 120;
/// Longest file in lines.
const MAX_FILE_LINES: usize = 450;
/// Longest function in lines; only a few may be longer than [`USUAL_FUNCTION_LINES`].
const MAX_FUNCTION_LINES: usize = 100;
const USUAL_FUNCTION_LINES: usize = 60;
/// Number of functions that are longer: loops over pixels and points, and two tests, which read better in one piece. It
/// may only fall.
const MAX_LONG_FUNCTIONS: usize = 5;

pub(crate) fn collect_sources(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            if !path.file_name().unwrap().to_string_lossy().starts_with("target") {
                collect_sources(&path, out);
            }
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

fn for_each_source(mut visit: impl FnMut(&str, &str)) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap();
    let mut paths = Vec::new();
    for folder in ["benches", "crates", "examples", "firmware", "reproduce", "tests", "xtask"] {
        collect_sources(&root.join(folder), &mut paths);
    }
    assert!(paths.len() > 300, "{}", paths.len());
    for path in paths {
        let name = path.strip_prefix(&root).unwrap().display().to_string();
        visit(&name, &fs::read_to_string(&path).unwrap());
    }
}

#[test]
fn lines_and_files_are_short() {
    let mut long = Vec::new();
    for_each_source(|name, text| {
        if text.lines().count() > MAX_FILE_LINES {
            long.push(format!("{name}: {} lines", text.lines().count()));
        }
        // A snapshot stays on one line, as the program wrote it.
        let is_wide = |line: &str| line.chars().count() > MAX_COLUMNS && !line.contains("assert_snapshot!");
        let wide = text.lines().enumerate().filter(|(_, line)| is_wide(line));
        long.extend(wide.map(|(i, line)| format!("{name}:{}: {} columns", i + 1, line.chars().count())));
    });
    assert!(long.is_empty(), "{} places: {long:#?}", long.len());
}

/// Returns (line, number of lines, name) of every function of a file that rustfmt has formatted.
fn find_functions(text: &str) -> Vec<(usize, usize, String)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let words = line.trim_start();
        let indent = line.len() - words.len();
        let Some(at) = words.find("fn ").filter(|at| *at == 0 || words[..*at].ends_with(' ')) else { continue };
        let is_head = words[..at]
            .split_whitespace()
            .all(|w| w.starts_with("pub") || ["const", "unsafe", "extern", "\"C\"", "async"].contains(&w));
        if !is_head || line.trim_end().ends_with(';') {
            continue;
        }
        let end = format!("{}}}", " ".repeat(indent));
        let Some(length) = lines[i..].iter().position(|l| l.starts_with(&end)) else { continue };
        let name = words[at + 3..].split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default();
        found.push((i + 1, length + 1, name.to_owned()));
    }
    found
}

#[test]
fn functions_are_short() {
    let mut long = Vec::new();
    for_each_source(|name, text| {
        let of_file = find_functions(text).into_iter().filter(|(_, length, _)| *length > USUAL_FUNCTION_LINES);
        long.extend(of_file.map(|(line, length, function)| (length, format!("{name}:{line} {function}"))));
    });
    long.sort();
    assert!(long.iter().all(|(length, _)| *length <= MAX_FUNCTION_LINES), "{long:#?}");
    assert!(
        long.len() <= MAX_LONG_FUNCTIONS,
        "{} functions of more than {USUAL_FUNCTION_LINES} lines: {long:#?}",
        long.len()
    );
}
