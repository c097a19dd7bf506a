//! The page with the sensor in the browser (crates/hzn-web): its files, and its test in a browser.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::machine::{apt_install, has, need_target, root, target};
use crate::site;
use crate::steps::{self, Outcome, Trouble, cargo};
use crate::test_build::build_tests;

const TRIPLE: &str = "wasm32-unknown-unknown";
const SOURCES: &str = "crates/hzn-web/page";
/// The pictures of the examples and their sensors. Each name in examples.json is a file here.
const EXAMPLES: &str = "tests/data/real";

/// Returns the folder of the page.
fn folder() -> PathBuf {
    target().join("xtask").join("page")
}

/// Builds the page into target/xtask/page.
pub(crate) fn build() -> Result<PathBuf, Trouble> {
    need_target(TRIPLE)?;
    // `--crate-type` is only given here, so that other builds link no library.
    let mut build = cargo(&["rustc", "--package", "hzn-web", "--lib", "--crate-type", "cdylib"]);
    steps::run(build.args(["--profile", "web", "--target", TRIPLE]))?;
    let page = folder();
    if page.exists() {
        fs::remove_dir_all(&page)?;
    }
    fs::create_dir_all(page.join("examples"))?;
    for name in ["index.html", "page.css", "page.js", "worker.js"] {
        fs::copy(root().join(SOURCES).join(name), page.join(name))?;
    }
    fs::copy(target().join(TRIPLE).join("web/hzn_web.wasm"), page.join("hzn.wasm"))?;
    let list = fs::read_to_string(root().join(SOURCES).join("examples.json"))?;
    let pictures = root().join(EXAMPLES);
    for entry in fs::read_dir(&pictures)? {
        let name = entry?.file_name();
        if name.to_str().is_some_and(|name| list.contains(&format!("\"{name}\""))) {
            fs::copy(pictures.join(&name), page.join("examples").join(&name))?;
        }
    }
    fs::write(page.join("examples/list.json"), list)?;
    fs::copy(pictures.join("README.md"), page.join("examples/CREDITS.md"))?;
    Ok(page)
}

/// Builds the page and prints where it is.
pub(crate) fn run() -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    let page = build().map_err(Trouble::into_message)?;
    println!("{} is the page; any server of files serves it: python3 -m http.server -d ...", page.display());
    Ok(())
}

/// Returns the name of a browser, which is installed if there is none.
fn browser() -> Result<&'static str, Trouble> {
    let found = || ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| has(name));
    if found().is_none() {
        apt_install(&["chromium"])?;
    }
    found().ok_or_else(|| Trouble::Missing("needs the browser Chromium: apt-get install chromium".into()))
}

/// Tests the page in a browser without a window and without a network: its answers are those of `hzn run`.
pub(crate) fn test() -> Outcome {
    let browser = browser()?;
    let page = build()?;
    build_tests()?;
    let mut check = Command::new("python3");
    check.arg("tests/python/check_page.py").args(["--browser", browser, "--page"]).arg(&page);
    steps::run(check.arg("--hzn").arg(target().join("debug/hzn")).arg("--out").arg(target().join("xtask/page-test")))?;
    site::add_page(&page)
}
