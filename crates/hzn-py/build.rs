//! The help texts of Python are written only once, in `python/hzn/_hzn.pyi`. This script extracts the docstrings of the
//! stubs into one file each, which the classes and functions include.

use std::path::Path;
use std::{env, fs};

const STUBS: &str = "python/hzn/_hzn.pyi";

fn main() {
    println!("cargo::rerun-if-changed={STUBS}");
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    let stubs = fs::read_to_string(STUBS).expect(STUBS);
    let (mut class, mut name) = (String::new(), String::new());
    let mut lines = stubs.lines();
    while let Some(line) = lines.next() {
        let text = line.trim_start();
        let word = |rest: &str| rest.split(['(', ':']).next().unwrap_or_default().trim().to_owned();
        if let Some(rest) = text.strip_prefix("class ") {
            class = word(rest);
            name.clone_from(&class);
        } else if let Some(rest) = text.strip_prefix("def ") {
            name = if line.starts_with(' ') { format!("{class}.{}", word(rest)) } else { word(rest) };
        } else if let Some(first) = text.strip_prefix("\"\"\"").filter(|_| !name.is_empty()) {
            let indent = line.len() - text.len();
            let mut doc = first.to_owned();
            while !doc.ends_with("\"\"\"") {
                let next = lines.next().expect("a docstring ends");
                doc.push('\n');
                doc.push_str(next.get(indent..).unwrap_or_default());
            }
            let doc = doc.trim_end_matches("\"\"\"").trim_end();
            fs::write(Path::new(&out).join(&name), doc).expect("OUT_DIR can be written");
        }
    }
}
