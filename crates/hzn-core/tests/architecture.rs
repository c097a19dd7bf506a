//! The order of the modules: the vocabulary knows no stage, a stage knows earlier ones, only `pipeline` knows all.
//!
//! Imports are read from the lines `use crate::…` outside tests.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const VOCABULARY: &[&str] = &[
    "real",
    "frames",
    "pixel",
    "image",
    "linalg",
    "median",
    "limb",
    "block",
    "rng",
    "camera",
    "circle",
    "ellipsoid",
    "body",
    "error",
    "region",
    "section",
    "sort",
    "status",
    "work",
];
const STAGES: &[&str] =
    &["binarize", "contour", "candidates", "undistort", "reject", "estimate", "covariance", "select", "recover"];

/// What a stage may import besides: (stage, import, reason).
const EXCEPTIONS: &[(&str, &str, &str)] = &[
    ("body", "binarize", "its `Config`: a body may have its own level"),
    ("body", "covariance", "its `Config`: a body may have its own edge errors"),
    ("estimate", "covariance", "its `Config`: the half-angle's row is weighed against the edge's correlated errors"),
    ("binarize", "pipeline::Observer", "pixel reads and the level are reported"),
    ("contour", "pipeline::Observer", "pixel reads are reported"),
    ("candidates", "pipeline::Observer", "points are reported"),
    ("select", "pipeline::Observer", "part of the scene that it reads"),
    ("select", "pipeline::Verdict", "its answer stands in the report"),
];

fn files(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, out);
        } else if !["tests.rs", "golden.rs", "lib.rs"].iter().any(|n| path.ends_with(n)) {
            out.push(path);
        }
    }
}

/// (module, import): the import is a module's name, or `pipeline::Name`.
fn imports() -> BTreeSet<(String, String)> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    files(&src, &mut paths);
    let mut found = BTreeSet::new();
    for path in paths {
        let first = path.strip_prefix(&src).unwrap().components().next().unwrap();
        let module = Path::new(first.as_os_str()).file_stem().unwrap().to_str().unwrap().to_owned();
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        for rest in code.split("\nuse crate::").skip(1) {
            let tree = rest.split(';').next().unwrap();
            let names = |list: &str| -> Vec<String> {
                list.trim_matches(['{', '}'])
                    .split(',')
                    .map(|n| n.trim().to_owned())
                    .filter(|n| !n.is_empty())
                    .collect()
            };
            if tree.starts_with('{') {
                found.extend(names(tree).into_iter().map(|n| (module.clone(), n)));
                continue;
            }
            let (head, tail) = tree.split_once("::").unwrap_or((tree, ""));
            if head == "pipeline" {
                found.extend(names(tail).into_iter().map(|n| (module.clone(), format!("pipeline::{n}"))));
            } else {
                found.insert((module.clone(), head.to_owned()));
            }
        }
    }
    found
}

#[test]
fn imports_run_one_way() {
    let found = imports();
    assert!(found.len() > 40, "too few imports were read: {found:?}");
    for (module, import) in &found {
        let (module, import) = (module.as_str(), import.as_str());
        if module == "pipeline" || module == import || VOCABULARY.contains(&import) {
            continue;
        }
        let excepted = EXCEPTIONS.iter().any(|(m, i, _)| (*m, *i) == (module, import));
        assert!(excepted || !VOCABULARY.contains(&module), "{module} is vocabulary and imports {import}");
        let place = |name| STAGES.iter().position(|s| *s == name);
        if excepted {
            continue;
        }
        let own = place(module).unwrap_or_else(|| panic!("{module} is in neither list"));
        let earlier = place(import).is_some_and(|other| other < own);
        assert!(earlier, "{module} imports {import}, which comes later");
    }
    for (module, import, _) in EXCEPTIONS {
        assert!(found.contains(&((*module).into(), (*import).into())), "{module} no longer needs {import}");
    }
}
