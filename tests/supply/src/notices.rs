//! The licence texts of what is linked into a product: most licences ask that a copy of the program has them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::{Package, linked, metadata};

/// Words of which the name of a licence text has one, in capitals. `OFL` and `UFL` are licences of fonts.
const WORDS: &[&str] = &["LICEN", "COPYING", "COPYRIGHT", "NOTICE", "OFL", "UFL"];
/// Endings of files that are no texts, or that say nothing about rights.
const OTHER_ENDINGS: &[&str] = &["rs", "c", "h", "py", "sh", "toml", "json", "html", "ttf"];

/// Returns the names, versions and licences of all foreign packages that are linked into the products for a platform,
/// each with its licence texts. A text that several packages share is written once.
///
/// # Panics
/// A product does not exist, cargo cannot read the manifest and its lock file, or a package cannot be read.
pub fn notices(products: &[&str], platform: &str) -> String {
    let graph = metadata("Cargo.toml", platform);
    let parts = products.iter().flat_map(|product| linked(product, &graph).1);
    let foreign: BTreeMap<(&str, &str), &Package> = parts
        .filter(|part| part.source.is_some())
        .map(|part| ((part.name.as_str(), part.version.as_str()), part))
        .collect();
    let mut owners: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut out =
        format!("hzn contains parts of others. These are their {} packages and their licences.\n\n", foreign.len());
    for ((name, version), part) in foreign {
        let texts = texts(part.manifest_path.parent().unwrap_or(Path::new("")));
        let licence = part.license.as_deref().unwrap_or("see its text");
        let without = if texts.is_empty() { " (the package has no text of its licence)" } else { "" };
        out += &format!("{name} {version}: {licence}{without}\n");
        for text in texts {
            owners.entry(text).or_default().push(format!("{name} {version}"));
        }
    }
    for (text, owners) in owners {
        out += &format!("\n{}\n{}\n\n{}\n", "-".repeat(100), owners.join(", "), text.trim_end());
    }
    out
}

/// Returns the licence texts in the folder of a package and in the folders in it, each once.
fn texts(package: &Path) -> Vec<String> {
    let mut folders = vec![package.to_path_buf()];
    folders.extend(entries(package).into_iter().filter(|path| path.is_dir()));
    let mut texts: Vec<String> = Vec::new();
    for folder in folders {
        let is_fonts = folder.file_name().is_some_and(|name| name == "fonts");
        let named: Vec<PathBuf> =
            entries(&folder).into_iter().filter(|path| path.is_file() && is_text(path, is_fonts)).collect();
        // Where there is both, COPYING only names the choice, or is the choice that hzn does not make (GPL).
        let has_licence = named.iter().any(|path| name(path).contains("LICEN"));
        let kept = named.iter().filter(|path| !(has_licence && name(path).starts_with("COPYING")));
        for text in kept.map(|path| String::from_utf8_lossy(&fs::read(path).expect("a file")).replace("\r\n", "\n")) {
            if !texts.contains(&text) {
                texts.push(text);
            }
        }
    }
    texts
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().to_uppercase()
}

/// Fonts have their licence in a text with any name.
fn is_text(path: &Path, is_fonts: bool) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let is_named = WORDS.iter().any(|word| name(path).contains(word)) && !OTHER_ENDINGS.contains(&ending.as_str());
    is_named || (is_fonts && ending == "txt")
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    entries
}
