//! Tests that every link between the documents of the repository leads to an existing path, and that the documents show
//! the code of an image that runs.

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

/// Returns the anchors of the headings of a page, as GitHub and mkdocs make them.
fn find_anchors(text: &str) -> Vec<String> {
    let mut fenced = false;
    let headings = text.lines().filter(|line| {
        fenced ^= line.trim_start().starts_with("```");
        !fenced && line.starts_with('#')
    });
    let words = |line: &str| line.trim_start_matches('#').trim().to_lowercase();
    let is_kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    headings.map(|line| words(line).chars().filter(is_kept).collect::<String>().replace(' ', "-")).collect()
}

#[test]
fn every_anchor_of_the_book_exists() {
    let mut pages = Vec::new();
    collect_pages(&root().join("book"), &mut pages);
    pages.push(root().join("README.md"));
    let (mut checked, mut broken) = (0, Vec::new());
    for page in pages {
        for target in find_targets(&fs::read_to_string(&page).unwrap()) {
            let Some((path, anchor)) = target.split_once('#') else { continue };
            let text = fs::read_to_string(page.parent().unwrap().join(path)).unwrap_or_default();
            checked += 1;
            if !find_anchors(&text).iter().any(|have| have.replace("--", "-") == anchor.replace("--", "-")) {
                broken.push(format!("{}: {target}", page.display()));
            }
        }
    }
    assert!(checked > 30, "{checked}");
    assert!(broken.is_empty(), "{broken:#?}");
}

/// Tests that each code cell of a notebook was executed, because GitHub shows only the outputs that the file has.
#[test]
fn every_notebook_has_its_outputs() {
    for name in ["photograph.ipynb", "methods.ipynb"] {
        let text = fs::read_to_string(root().join("book/guide/python/notebooks").join(name)).unwrap();
        assert!(text.contains("\"image/png\""), "{name} has no picture");
        assert!(!text.contains("\"execution_count\": null"), "{name} has cells that were not executed");
    }
}

/// Tests that the lines which the documents show are those of the image `example`, which runs on a board with 192 KiB
/// of RAM (`firmware.rs`). Only the picture has another source there.
#[test]
fn the_example_of_the_documents_is_that_of_the_image() {
    let read = |file: &str| fs::read_to_string(root().join(file)).unwrap();
    let strip = |line: &str| line.trim_start_matches("//! ").split("//").next().unwrap_or_default().trim().to_owned();
    let image = read("firmware/stm32f405/src/bin/example.rs");
    let image: Vec<String> = image.lines().map(strip).collect();
    for file in ["README.md", "book/guide/first-steps.md", "crates/hzn-core/README.md", "crates/hzn-core/src/lib.rs"] {
        let text = read(file);
        let block = text.split("```").find(|block| block.contains("FlightHorizon::empty()")).unwrap_or_default();
        let lines = block.lines().skip(1).map(strip);
        let has_own_source = |line: &String| {
            line.is_empty() || ["use ", "let data", "println!", "# "].iter().any(|start| line.starts_with(start))
        };
        let shown: Vec<String> = lines.filter(|line| !has_own_source(line)).collect();
        let foreign: Vec<&String> = shown.iter().filter(|line| !image.contains(line)).collect();
        assert!(foreign.is_empty(), "{file}: the image does not have {foreign:#?}");
        assert!(shown.len() >= 5, "{file}: {shown:#?}");
    }
}

/// Tests that the guide shows the files of its project, which the step `firmware` builds and runs.
#[test]
fn the_project_of_the_guide_is_that_of_the_folder() {
    let guide = fs::read_to_string(root().join("book/guide/own-firmware.md")).unwrap();
    let file = |name: &str| fs::read_to_string(root().join("examples/own-firmware").join(name)).unwrap();
    for name in ["Cargo.toml", ".cargo/config.toml", "memory.x", "build.rs"] {
        assert!(guide.contains(&file(name)), "the guide shows another {name}");
    }
    let main = file("src/main.rs");
    let blocks: Vec<&str> = guide.split("```rust\n").skip(1).filter_map(|block| block.split("```").next()).collect();
    assert_eq!(blocks.len(), 3);
    for block in blocks.iter().filter(|block| !block.contains("rustc-link-search")) {
        assert!(main.contains(block), "src/main.rs does not have\n{block}");
    }
}
