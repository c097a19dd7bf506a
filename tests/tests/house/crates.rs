//! Tests the order of the crates: each crate imports only from those below it.

use std::fs;
use std::path::Path;

/// Every crate in `crates/`, with the crates of this project that it may import from.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("hzn-fpu", &[]),
    ("hzn-twice", &[]),
    ("hzn-core", &["hzn-fpu"]),
    ("hzn-host", &["hzn-core"]),
    ("hzn-nav", &["hzn-core"]),
    ("hzn-files", &["hzn-core", "hzn-nav"]),
    ("hzn-calib", &["hzn-core", "hzn-nav", "hzn-files"]),
    ("hzn-sim", &["hzn-core", "hzn-host", "hzn-nav", "hzn-files", "hzn-calib"]),
    ("hzn-flight", &["hzn-twice", "hzn-core", "hzn-nav"]),
    ("hzn-mcap", &["hzn-core", "hzn-nav", "hzn-files"]),
    ("hzn-evaluate", &["hzn-core", "hzn-files", "hzn-mcap"]),
    ("hzn-run", &["hzn-core", "hzn-host", "hzn-nav", "hzn-files", "hzn-flight", "hzn-mcap"]),
    ("hzn-fuse", &["hzn-core", "hzn-nav", "hzn-files", "hzn-sim", "hzn-mcap", "hzn-run"]),
    ("hzn-fly", &["hzn-core", "hzn-nav", "hzn-files", "hzn-mcap", "hzn-flight", "hzn-run"]),
    ("hzn-ground", &["hzn-core", "hzn-nav", "hzn-files", "hzn-flight", "hzn-mcap", "hzn-run", "hzn-fly"]),
    ("hzn-plot", &[]),
    (
        "hzn-cli",
        &[
            "hzn-core",
            "hzn-nav",
            "hzn-files",
            "hzn-calib",
            "hzn-sim",
            "hzn-flight",
            "hzn-mcap",
            "hzn-evaluate",
            "hzn-run",
            "hzn-fuse",
            "hzn-fly",
            "hzn-ground",
            "hzn-plot",
        ],
    ),
    (
        "hzn-py",
        &[
            "hzn-core",
            "hzn-nav",
            "hzn-files",
            "hzn-calib",
            "hzn-sim",
            "hzn-flight",
            "hzn-mcap",
            "hzn-evaluate",
            "hzn-run",
            "hzn-fuse",
            "hzn-fly",
            "hzn-ground",
            "hzn-plot",
        ],
    ),
    (
        "hzn-viewer",
        &[
            "hzn-core",
            "hzn-nav",
            "hzn-files",
            "hzn-calib",
            "hzn-sim",
            "hzn-flight",
            "hzn-mcap",
            "hzn-evaluate",
            "hzn-run",
            "hzn-fuse",
            "hzn-fly",
            "hzn-ground",
            "hzn-plot",
        ],
    ),
    ("hzn-web", &["hzn-core", "hzn-files", "hzn-mcap", "hzn-run"]),
];

/// Returns the crates of this project that a Cargo.toml lists in `[dependencies]`. Dependencies for tests and builds
/// are left out.
fn read_imports(manifest: &Path) -> Vec<String> {
    let text = fs::read_to_string(manifest).unwrap();
    let table = text.split("\n[").find(|table| table.starts_with("dependencies]")).unwrap_or_default();
    let name = |line: &str| line.split(['.', ' ', '=']).next().unwrap_or_default().to_owned();
    table.lines().skip(1).map(name).filter(|name| name.starts_with("hzn-")).collect()
}

#[test]
fn crates_import_from_below() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    let mut imports_read = 0;
    for entry in fs::read_dir(&crates).unwrap() {
        let manifest = entry.unwrap().path().join("Cargo.toml");
        let name = manifest.parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned();
        let (_, may) = MAY_IMPORT
            .iter()
            .find(|(importer, _)| *importer == name)
            .unwrap_or_else(|| panic!("{name} is missing in MAY_IMPORT"));
        for import in read_imports(&manifest) {
            assert!(may.contains(&import.as_str()), "{name} imports {import}, which is not below it");
            imports_read += 1;
        }
    }
    assert!(imports_read > 20, "{imports_read} imports were read");
    // The library must not link crates that parse arguments, catch signals or draw progress bars and charts.
    let run = fs::read_to_string(crates.join("hzn-run/Cargo.toml")).unwrap();
    for theirs in ["clap", "ctrlc", "indicatif", "plotters"] {
        assert!(!run.contains(theirs), "hzn-run imports {theirs}");
    }
}

/// A package of the registry has only what is in its own folder, so each crate that is published has the licence texts.
#[test]
fn published_crates_have_the_licence_texts() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut published = 0;
    for entry in fs::read_dir(root.join("crates")).unwrap() {
        let folder = entry.unwrap().path();
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let is_published = !manifest.lines().any(|line| line.starts_with("publish"));
        for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let own = fs::read(folder.join(name)).ok();
            assert!(own.is_some() || !is_published, "{}: has no {name}", folder.display());
            let whole = fs::read(root.join(name)).unwrap();
            assert!(own.is_none_or(|own| own == whole), "{}: its {name} differs", folder.display());
        }
        published += u32::from(is_published);
    }
    assert!(published > 15, "{published}");
}

/// A library whose tests are turned off has none: they would never run.
#[test]
fn no_unit_test_is_turned_off() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut without = 0;
    for entry in fs::read_dir(root.join("crates")).unwrap() {
        let folder = entry.unwrap().path();
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let library = manifest.split("[lib]").nth(1).and_then(|rest| rest.split("\n[").next()).unwrap_or_default();
        if library.contains("\ntest = false") {
            without += 1;
            let mut sources = Vec::new();
            crate::shape::collect_sources(&folder.join("src"), &mut sources);
            for source in sources {
                let text = fs::read_to_string(&source).unwrap();
                assert!(!text.contains("#[cfg(test)]"), "{}: the tests of this file never run", source.display());
            }
        }
    }
    assert!(without > 0, "no library has its tests turned off, so this test can go");
}
