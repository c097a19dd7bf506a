//! Checks the order of the folders: each imports only from the folders before it in `FOLDERS`. A stage imports only
//! earlier stages.
//!
//! Every path that begins with `crate::` counts, in imports and in code. Tests inside a file do not count.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const FOLDERS: &[&str] = &["base", "geometry", "model", "image", "stages", "config", "papers", "pipeline", "rig"];
const STAGES: &[&str] = &["threshold", "contour", "edge_points", "rays", "consensus", "fit", "covariance", "gates"];

fn files(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, out);
        } else if !path.ends_with("tests.rs") {
            out.push(path);
        }
    }
}

/// Returns the name of a file or folder without `.rs`.
fn name(part: &std::ffi::OsStr) -> String {
    Path::new(part).file_stem().unwrap().to_str().unwrap().to_owned()
}

/// Returns the identifier at the beginning of a text.
fn word(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    &text[..end]
}

/// Returns the modules after `crate::folder::`: one, or those of a list in braces.
fn modules(rest: &str) -> Vec<&str> {
    match rest.strip_prefix('{') {
        Some(list) => list.split('}').next().unwrap().split(',').map(|item| word(item.trim())).collect(),
        None => vec![word(rest)],
    }
}

/// Returns (folder, module, imported folder, imported module) for every path in the crate.
fn imports() -> BTreeSet<[String; 4]> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&src, &mut paths);
    let mut found = BTreeSet::new();
    for path in paths {
        let parts: Vec<_> = path.strip_prefix(&src).unwrap().components().map(|c| name(c.as_os_str())).collect();
        let [folder, module, ..] = parts.as_slice() else { continue };
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        let code: String =
            code.lines().filter(|l| !l.trim_start().starts_with("//")).fold(String::new(), |s, l| s + l + "\n");
        for rest in code.split("crate::").skip(1) {
            let other = word(rest);
            let tail = rest[other.len()..].strip_prefix("::").unwrap_or_default();
            for imported in modules(tail) {
                found.insert([folder.clone(), module.clone(), other.to_owned(), imported.to_owned()]);
            }
        }
    }
    found
}

#[test]
fn imports_run_one_way() {
    let found = imports();
    assert!(found.len() > 100, "too few imports were read: {found:?}");
    let place = |list: &[&str], name: &str| {
        list.iter().position(|known| *known == name).unwrap_or_else(|| panic!("{name} is not in {list:?}"))
    };
    for [folder, module, other, imported] in &found {
        assert!(place(FOLDERS, other) <= place(FOLDERS, folder), "{folder}/{module} imports {other}::{imported}");
        if folder == "stages" && other == "stages" && module != "mod" {
            assert!(
                place(STAGES, imported) <= place(STAGES, module),
                "the stage {module} imports the later {imported}"
            );
        }
    }
}

#[test]
fn every_folder_and_stage_is_in_the_order() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let listed = |dir: PathBuf| -> BTreeSet<String> {
        fs::read_dir(dir).unwrap().map(|e| name(&e.unwrap().file_name())).filter(|n| n != "lib" && n != "mod").collect()
    };
    let set = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<BTreeSet<_>>();
    assert_eq!(listed(src.clone()), set(FOLDERS));
    assert_eq!(listed(src.join("stages")), set(STAGES));
}
