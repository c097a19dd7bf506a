//! What hzn is built from: licences, sources, and the list of its parts.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use hzn_supply::{self as supply, Package};

/// Returns whether an SPDX expression allows one of these licences: every part that `AND` joins needs one choice.
fn is_allowed(expression: &str, allowed: &BTreeSet<String>) -> bool {
    // Older manifests write a slash instead of OR.
    let text = expression.replace('/', " OR ").replace(['(', ')'], " ");
    let choice = |part: &str| part.split(" OR ").any(|licence| allowed.contains(licence.trim()));
    text.split(" AND ").all(choice)
}

#[test]
fn licences_and_sources_are_allowed() {
    let rules: toml::Table = std::fs::read_to_string(supply::root().join("deny.toml")).unwrap().parse().unwrap();
    let list = rules["licenses"]["allow"].as_array().unwrap();
    let allowed: BTreeSet<String> = list.iter().map(|name| name.as_str().unwrap().to_owned()).collect();
    assert!(!is_allowed("GPL-3.0-only", &allowed) && !is_allowed("MIT AND GPL-2.0", &allowed));
    assert!(is_allowed("GPL-3.0 OR MIT", &allowed) && is_allowed("(MIT OR Apache-2.0) AND Unicode-3.0", &allowed));
    let exceptions = rules["licenses"]["exceptions"].as_array().unwrap();
    let is_exception = |name: &str, license: &str| {
        exceptions.iter().any(|e| e["crate"].as_str() == Some(name) && e["allow"][0].as_str() == Some(license))
    };
    let mut seen = 0;
    for manifest in ["Cargo.toml", "fuzz/Cargo.toml"] {
        for Package { name, version, license, source, .. } in supply::packages(manifest) {
            let license = license.unwrap_or_else(|| panic!("{name} {version} has no licence in its manifest"));
            let is_fine = is_allowed(&license, &allowed) || is_exception(&name, &license);
            assert!(is_fine, "{name} {version}: {license} is not in deny.toml");
            let known = source.as_deref().is_none_or(|source| source.starts_with("registry+"));
            assert!(known, "{name} {version} comes from {source:?}");
            seen += 1;
        }
    }
    assert!(seen > 200, "{seen}");
}

#[test]
fn the_list_of_parts_is_complete() {
    for package in supply::PRODUCTS {
        let sbom = supply::sbom(package, supply::PLATFORM);
        assert_eq!((&sbom["bomFormat"], &sbom["specVersion"]), (&"CycloneDX".into(), &"1.5".into()));
        assert_eq!(sbom["metadata"]["component"]["name"], *package);
        let parts = sbom["components"].as_array().unwrap();
        assert!(parts.iter().any(|part| part["name"] == "hzn-core"), "{package}");
        for part in parts {
            assert!(part["purl"].as_str().unwrap().starts_with("pkg:cargo/"), "{part}");
            let is_ours = part["name"].as_str().unwrap().starts_with("hzn");
            assert!(is_ours || part["hashes"][0]["alg"] == "SHA-256", "{part} has no checksum");
        }
    }
}

/// Most licences ask that a copy of the program has their text.
#[test]
fn the_notices_have_the_licence_of_each_part() {
    let text = supply::notices(&["hzn-cli", "hzn-py"], supply::PLATFORM);
    let (list, texts) = text.split_once("\n------").unwrap();
    for part in ["clap ", "pyo3 ", "zstd-sys ", "epaint_default_fonts "] {
        let version = list.lines().find(|line| line.starts_with(part)).unwrap_or_else(|| panic!("{part}: {list}"));
        let name = version.split_once(':').unwrap().0;
        assert!(texts.contains(name), "{name} has a text");
    }
    assert!(!list.contains("hzn-") && list.lines().filter(|line| line.contains(": ")).count() > 200, "{list}");
    // A package without a text is named, and there are few.
    let without: Vec<_> = list.lines().filter(|line| line.contains("has no text")).collect();
    assert!(without.len() < 24, "{without:#?}");
    for word in ["Permission is hereby granted", "Apache License", "UBUNTU FONT LICENCE", "Redistribution and use"] {
        assert!(texts.contains(word), "{word}");
    }
    assert!(!texts.contains("GNU GENERAL PUBLIC LICENSE"));
}

/// The page in the browser has no C compiler, no files and no threads, so nothing that it is built from may need them.
#[test]
fn the_page_is_built_without_c() {
    let tree = |platform: &[&str]| {
        let mut cargo = std::process::Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.args(["tree", "--locked", "--edges", "normal,build", "--prefix", "none", "--package"]).args(platform);
        let out = cargo.current_dir(supply::root()).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    let needs_c = |tree: &str| tree.lines().any(|part| part.starts_with("zstd-sys ") || part.starts_with("cc "));
    let page = tree(&["hzn-web", "--target", "wasm32-unknown-unknown"]);
    assert!(page.contains("hzn-run ") && !needs_c(&page), "{page}");
    assert!(needs_c(&tree(&["hzn-cli"])), "the command has zstd; otherwise the lines above look for another name");
}

/// Dependencies that the sources of their package need not name, with the reason.
const UNNAMED: [(&str, &str, &str); 3] = [
    ("hzn-mps2", "portable-atomic", "its feature critical-section gives static_cell what a Cortex-M0+ lacks"),
    ("hzn-run", "kamadak-exif", "its library is called exif"),
    ("hzn-stm32f405", "cortex-m", "its feature critical-section-single-core stops interrupts for the other crates"),
];

/// A dependency that nothing uses would be kept up to date for nothing.
#[test]
fn every_dependency_of_the_workspace_is_used() {
    let manifest = read_manifest(&supply::root());
    let members = manifest["workspace"]["members"].as_array().unwrap().iter().map(|m| m.as_str().unwrap());
    let folders = members.flat_map(|member| match member.strip_suffix("/*") {
        Some(folder) => folders(&supply::root().join(folder)),
        None => vec![supply::root().join(member)],
    });
    let mut used = BTreeSet::new();
    let mut unnamed = Vec::new();
    for folder in folders.filter(|folder| folder.join("Cargo.toml").exists()) {
        let manifest = read_manifest(&folder);
        let package = manifest["package"]["name"].as_str().unwrap().to_owned();
        let only_a_feature = features_of_dependencies(&manifest);
        let mut sources = String::new();
        add_sources(&folder, &mut sources);
        for name in dependencies(manifest) {
            if !only_a_feature.contains(&format!("dep:{name}")) && !has_name(&sources, &name.replace('-', "_")) {
                unnamed.push((package.clone(), name.clone()));
            }
            used.insert(name);
        }
    }
    let listed = manifest["workspace"]["dependencies"].as_table().unwrap();
    let unused: Vec<_> = listed.keys().filter(|name| !used.contains(*name)).collect();
    assert!(unused.is_empty() && used.len() > 50, "{unused:?}");
    unnamed.sort();
    let stated: Vec<_> = UNNAMED.iter().map(|(package, name, _)| ((*package).to_owned(), (*name).to_owned())).collect();
    assert_eq!(unnamed, stated, "no source file of these packages names the dependency");
}

fn read_manifest(folder: &Path) -> toml::Table {
    std::fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap()
}

fn folders(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir()).collect()
}

/// Returns the dependencies of the wheel that are there only to have the features that they have in the tests.
fn features_of_dependencies(manifest: &toml::Table) -> Vec<String> {
    let feature = manifest.get("features").and_then(|features| features.get("as-in-the-tests"));
    let listed = feature.and_then(toml::Value::as_array).into_iter().flatten();
    listed.map(|name| name.as_str().unwrap().to_owned()).collect()
}

/// Adds the source files of a package, but not those of a package inside of its folder.
fn add_sources(folder: &Path, sources: &mut String) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.join("Cargo.toml").exists() && !path.ends_with("target") {
            add_sources(&path, sources);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            sources.push_str(&std::fs::read_to_string(path).unwrap());
            sources.push('\n');
        }
    }
}

/// Returns whether code has a name as a whole word. A comment counts only if it has a path, as examples in it have:
/// `either` and `log` are words, too.
fn has_name(sources: &str, name: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    sources.lines().any(|line| {
        let is_comment = line.trim_start().starts_with("//");
        line.match_indices(name).any(|(at, _)| {
            let (before, after) = (&line[..at], &line[at + name.len()..]);
            !before.ends_with(is_part) && !after.starts_with(is_part) && (!is_comment || after.starts_with("::"))
        })
    })
}

#[test]
fn a_name_is_a_whole_word_of_code() {
    assert!(has_name("use approx::abs;", "approx") && has_name("    /// use approx::abs;", "approx"));
    assert!(!has_name("// is approx. 3\nlet approx_3 = approximate(3);\nmy_approx();", "approx"));
}

/// Returns the names of all dependencies of a manifest, also of those for some systems, for tests and for builds.
fn dependencies(manifest: toml::Table) -> Vec<String> {
    let mut found = Vec::new();
    for (key, value) in manifest {
        match value {
            toml::Value::Table(table) if key.ends_with("dependencies") => found.extend(table.into_iter().map(|e| e.0)),
            toml::Value::Table(table) => found.extend(dependencies(table)),
            _ => {}
        }
    }
    found
}

/// The binary does not know the features that its library was built with, so the text names them.
#[test]
fn the_version_names_the_features_that_the_manifest_turns_on() {
    let root = supply::root();
    let manifest: toml::Table =
        std::fs::read_to_string(root.join("crates/hzn-cli/Cargo.toml")).unwrap().parse().unwrap();
    let all = manifest["dependencies"]["hzn-core"]["features"].as_array().unwrap();
    let methods: Vec<&str> =
        all.iter().map(|f| f.as_str().unwrap()).filter(|f| !["serde", "std"].contains(f)).collect();
    let source = std::fs::read_to_string(root.join("crates/hzn-cli/src/commands/mod.rs")).unwrap();
    assert!(source.contains(&format!("features {}\"", methods.join(", "))), "{methods:?}");
}

/// Returns the sets of features with which `cargo tree` says that each crate is compiled.
fn features(args: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let mut tree = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    tree.args(["tree", "--locked", "--prefix", "none", "--format", "{p}|{f}"]).args(args).current_dir(supply::root());
    let out = tree.output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let mut all = BTreeMap::<String, BTreeSet<String>>::new();
    for line in String::from_utf8(out.stdout).unwrap().lines() {
        let Some((package, features)) = line.trim_end_matches(" (*)").split_once('|') else { continue };
        let name: Vec<&str> = package.split(' ').take(2).collect();
        all.entry(name.join(" ")).or_default().insert(features.to_owned());
    }
    all
}

/// Another feature of one crate would compile all crates that use it a second time.
#[test]
fn the_wheel_takes_what_the_tests_have_compiled() {
    let tests = features(&["--edges", "normal,build,dev"]);
    let wheel = features(&["--edges", "normal,build", "--package", "hzn-py", "--features", "as-in-the-tests"]);
    let others = |(name, sets): &(&String, &BTreeSet<String>)| {
        let is_own = name.starts_with("hzn-py ");
        !is_own && !tests.get(*name).is_some_and(|known| sets.is_subset(known))
    };
    let others: Vec<_> = wheel.iter().filter(others).collect();
    assert!(wheel.len() > 100 && others.is_empty(), "of {}: {others:?}", wheel.len());
}
