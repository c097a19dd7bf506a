//! What hzn is built from, as cargo knows it: as a CycloneDX list of parts (SBOM), and as the notices of its licences.

mod notices;

pub use notices::notices;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;
use serde_json::{Value, json};

/// The packages of the products.
pub const PRODUCTS: &[&str] = &["hzn-cli", "hzn-py", "hzn-mps2"];

/// Packages for other systems are left out, because cargo would have to fetch them.
pub const PLATFORM: &str = "x86_64-unknown-linux-gnu";

/// A package of the dependency graph.
#[derive(Debug, Clone, Deserialize)]
pub struct Package {
    /// Identifier within the graph.
    pub id: String,
    /// Name of the crate.
    pub name: String,
    /// Version of the crate.
    pub version: String,
    /// SPDX expression.
    pub license: Option<String>,
    /// Registry; `None` for a crate of this repository.
    pub source: Option<String>,
    /// Path of its Cargo.toml.
    pub manifest_path: PathBuf,
}

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
}

#[derive(Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Deserialize)]
struct Node {
    id: String,
    deps: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Dependency {
    pkg: String,
    dep_kinds: Vec<Kind>,
}

/// The kind is `None` for a normal dependency, else `dev` or `build`.
#[derive(Deserialize)]
struct Kind {
    kind: Option<String>,
}

#[derive(Deserialize)]
struct Lock {
    package: Vec<Locked>,
}

#[derive(Deserialize)]
struct Locked {
    name: String,
    version: String,
    checksum: Option<String>,
}

/// Returns the root folder of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn metadata(manifest: &str, platform: &str) -> Metadata {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["metadata", "--locked", "--format-version", "1", "--filter-platform", platform, "--manifest-path"]);
    cargo.arg(root().join(manifest));
    let out = cargo.output().expect("cargo runs");
    assert!(out.status.success(), "{manifest}: {}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("cargo's own format")
}

/// Returns all packages of a workspace's dependency graph.
///
/// # Panics
/// Cargo cannot read the manifest and its lock file.
pub fn packages(manifest: &str) -> Vec<Package> {
    metadata(manifest, PLATFORM).packages
}

/// Returns the packages that are linked into a product, without the product itself, in the order of their names.
/// Dependencies for builds and tests are left out.
fn linked<'a>(product: &str, Metadata { packages, resolve }: &'a Metadata) -> (&'a Package, Vec<&'a Package>) {
    let nodes: BTreeMap<&str, &Node> = resolve.nodes.iter().map(|node| (node.id.as_str(), node)).collect();
    let product = packages.iter().find(|p| p.name == product).unwrap_or_else(|| panic!("{product} is no package"));
    let (mut linked, mut open) = (BTreeSet::new(), vec![product.id.as_str()]);
    while let Some(id) = open.pop() {
        let deps = nodes.get(id).into_iter().flat_map(|node| &node.deps);
        let normal =
            deps.filter(|dep| dep.dep_kinds.iter().any(|kind| kind.kind.is_none())).map(|dep| dep.pkg.as_str());
        open.extend(normal.filter(|id| linked.insert(*id)));
    }
    let mut parts: Vec<&Package> = packages.iter().filter(|p| linked.contains(p.id.as_str())).collect();
    parts.sort_by_key(|p| (p.name.as_str(), p.version.as_str()));
    (product, parts)
}

/// Returns the CycloneDX list of the parts that are linked into a product for a platform, which is a triple of rustc.
/// Dependencies for builds and tests are left out. The list depends only on the lock file, so the same commit gives the
/// same list.
///
/// # Panics
/// The package does not exist, or cargo cannot read the manifest and its lock file.
pub fn sbom(package: &str, platform: &str) -> Value {
    let graph = metadata("Cargo.toml", platform);
    let lock = std::fs::read_to_string(root().join("Cargo.lock")).expect("a lock file");
    let lock: Lock = toml::from_str(&lock).expect("a valid lock file");
    let checksums: BTreeMap<(&str, &str), &str> = lock
        .package
        .iter()
        .filter_map(|p| Some(((p.name.as_str(), p.version.as_str()), p.checksum.as_deref()?)))
        .collect();
    let (product, parts) = linked(package, &graph);
    let component = |p: &Package, kind: &str| {
        let mut part = json!({
            "type": kind,
            "name": p.name,
            "version": p.version,
            "purl": format!("pkg:cargo/{}@{}", p.name, p.version),
        });
        if let Some(license) = &p.license {
            part["licenses"] = json!([{"expression": license.replace('/', " OR ")}]);
        }
        if let Some(checksum) = checksums.get(&(p.name.as_str(), p.version.as_str())) {
            part["hashes"] = json!([{"alg": "SHA-256", "content": checksum}]);
        }
        part
    };
    json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": component(product, "application")},
        "components": parts.iter().map(|p| component(p, "library")).collect::<Vec<_>>(),
    })
}
