//! Tests that every link between the documents of the repository leads to an existing path.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Collects the documents: Markdown outside of folders that a build makes.
fn collect_pages(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !name.starts_with("target") && name != ".git" && name != "hzn-demo" && name != ".venv" {
                collect_pages(&path, out);
            }
        } else if name.ends_with(".md") {
            out.push(path);
        }
    }
}

/// Returns the targets of `[text](target)` outside of code. Links to other sites and to headings of the same page are
/// left out.
fn find_targets(text: &str) -> Vec<String> {
    let mut fenced = false;
    let prose = text.lines().filter(|line| {
        fenced ^= line.trim_start().starts_with("```");
        !fenced
    });
    let link = |rest: &str| rest.split(')').next().unwrap_or_default().to_owned();
    let is_local = |target: &String| !target.is_empty() && !target.starts_with('#') && !target.contains("://");
    prose.flat_map(|line| line.split("](").skip(1).map(link).filter(is_local).collect::<Vec<_>>()).collect()
}

#[test]
fn every_link_leads_somewhere() {
    let mut documents = Vec::new();
    collect_pages(&root(), &mut documents);
    assert!(documents.len() > 15, "{documents:?}");
    let mut checked = 0;
    let mut broken = Vec::new();
    for page in documents {
        for target in find_targets(&fs::read_to_string(&page).unwrap()) {
            let path = target.split('#').next().unwrap_or_default();
            checked += 1;
            if !page.parent().unwrap().join(path).exists() {
                broken.push(format!("{}: {target}", page.display()));
            }
        }
    }
    assert!(checked > 30, "{checked}");
    assert!(broken.is_empty(), "{broken:#?}");
}
