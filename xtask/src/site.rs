//! The site: the book with its notebooks, the programs that it links to, and the page with the sensor in the browser.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::target;
use crate::steps::{self, Outcome};

/// Programs that the book links to, outside of its folder.
const PROGRAMS: &str = "crates/hzn-py/examples";
/// Folder of the page with the sensor, in the site.
const PAGE: &str = "app";

/// Returns the folder of the site.
pub(crate) fn folder() -> PathBuf {
    target().join("xtask").join("site")
}

/// Builds the site without the page of the sensor, and checks it. `python` has the wheel, from which the reference
/// takes its texts. One notebook is executed, or with `every_notebook` all.
pub(crate) fn build(python: &Path, every_notebook: bool) -> Outcome {
    let config = fs::canonicalize("mkdocs.yml")?;
    let mut mkdocs = Command::new(python);
    mkdocs.args(["-m", "mkdocs", "build", "--strict", "--quiet", "--config-file"]).arg(config);
    mkdocs.env("NO_MKDOCS_2_WARNING", "1").arg("--site-dir").arg(folder());
    if !every_notebook {
        mkdocs.env("HZN_UNEXECUTED", "methods.ipynb");
    }
    // Away from the sources, so that Python imports the installed package.
    fs::create_dir_all(target().join("xtask"))?;
    steps::run(mkdocs.current_dir(target().join("xtask")))?;
    copy_files(Path::new(PROGRAMS), &folder().join(PROGRAMS))?;
    steps::run(Command::new(python).arg("tests/python/check_search.py").arg(folder()))?;
    check_links(&["--without", PAGE])
}

/// Makes the page of the sensor a part of the site, if there is a site, and checks the links again.
pub(crate) fn add_page(page: &Path) -> Outcome {
    if !folder().exists() {
        println!("there is no site in {}: `cargo xtask site` builds it", folder().display());
        return Ok(());
    }
    for part in ["", "examples"] {
        copy_files(&page.join(part), &folder().join(PAGE).join(part))?;
    }
    check_links(&[])
}

fn check_links(options: &[&str]) -> Outcome {
    steps::run(Command::new("python3").arg("tests/python/check_links.py").arg(folder()).args(options))
}

/// Copies the files of a folder, without its subfolders.
fn copy_files(from: &Path, to: &Path) -> Outcome {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        if entry.file_type()?.is_file() {
            fs::copy(entry.path(), to.join(entry.file_name()))?;
        }
    }
    Ok(())
}
