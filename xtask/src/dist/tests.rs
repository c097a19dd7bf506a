//! What other files say about the files of a release.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use super::{Dist, UNPUBLISHED};
use crate::machine::root;

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Returns the value of a key of a table of TOML.
fn value<'a>(manifest: &'a str, table: &str, key: &str) -> Option<&'a str> {
    let table = manifest.split("\n[").find_map(|part| part.strip_prefix(&format!("{table}]\n")))?;
    table.lines().find_map(|line| line.strip_prefix(&format!("{key} = \""))?.strip_suffix('"'))
}

/// `cargo binstall` must ask for the names that the archives of each system have.
#[test]
fn binstall_asks_for_the_archives_of_a_release() {
    let (manifest, workflow) = (read("crates/hzn-cli/Cargo.toml"), read(".github/workflows/release.yml"));
    let targets = workflow.split("targets: \"").skip(1).filter_map(|rest| rest.split('"').next());
    let mut systems = 0;
    for triple in targets {
        let dist = Dist {
            triple: triple.to_owned(),
            host: triple.to_owned(),
            profile: "dist".to_owned(),
            version: "1.2.3".to_owned(),
            time: String::new(),
            python: PathBuf::new(),
        };
        let general = "package.metadata.binstall";
        let own = format!("{general}.overrides.{triple}");
        let get = |key| value(&manifest, &own, key).or_else(|| value(&manifest, general, key)).unwrap();
        let asked = |key| get(key).replace("{ version }", "1.2.3").replace("{ target }", triple);
        let archive = dist.archive();
        let name = archive.file_name().unwrap().to_str().unwrap();
        assert!(asked("pkg-url").ends_with(&format!("/v1.2.3/{name}")), "{}: {name}", asked("pkg-url"));
        assert_eq!(get("pkg-fmt"), if name.ends_with(".zip") { "zip" } else { "txz" }, "{name}");
        assert_eq!(asked("bin-dir"), format!("{}/{{ bin }}{{ binary-ext }}", dist.name()));
        systems += 1;
    }
    assert!(systems >= 4, "{systems}");
}

/// What is not published is said in each manifest, and in the list that `cargo publish` gets.
#[test]
fn the_list_of_unpublished_packages_is_that_of_the_manifests() {
    let workspace = read("Cargo.toml");
    let members = workspace.split_once("\nmembers = [").unwrap().1.split_once(']').unwrap().0;
    let mut told = BTreeSet::new();
    for member in members.split('"').skip(1).step_by(2) {
        assert!(!member.contains('*'), "{member}: name each member here");
        let manifest = read(&format!("{member}/Cargo.toml"));
        let is_unpublished =
            |line: &str| line.starts_with("publish.workspace = true") || line.starts_with("publish = false");
        if manifest.lines().any(is_unpublished) {
            told.insert(value(&format!("\n{manifest}"), "package", "name").unwrap().to_owned());
        }
    }
    assert!(workspace.contains("\npublish = false"), "`publish.workspace` means something else");
    let listed: BTreeSet<String> = UNPUBLISHED.iter().map(|name| (*name).to_owned()).collect();
    assert_eq!(listed, told);
}
