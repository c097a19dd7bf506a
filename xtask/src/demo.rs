//! Runs the demo and finds its files. The window and the readers of other projects use these files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::machine::target;
use crate::steps::{self, Outcome, Trouble};
use crate::test_build::build_tests;

/// Returns the folder for the demo's files.
pub(crate) fn demo_dir() -> PathBuf {
    target().join("xtask").join("hzn-demo")
}

/// Runs `hzn demo` with the binary that the test build has made.
pub(crate) fn run_demo() -> Outcome {
    build_tests()?;
    let dir = demo_dir();
    if dir.exists() {
        fs::remove_dir_all(&dir)?;
    }
    fs::create_dir_all(dir.parent().unwrap_or(&dir))?;
    steps::run(Command::new(target().join("debug/hzn")).arg("demo").arg(&dir))?;
    if find_recordings(&dir).is_empty() {
        return Err(Trouble::Failed(format!("the demo has written no .mcap file into {}", dir.display())));
    }
    Ok(())
}

/// Returns the recordings in a folder and its subfolders.
pub(crate) fn find_recordings(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.append(&mut find_recordings(&path));
        } else if path.extension().is_some_and(|e| e == "mcap") {
            found.push(path);
        }
    }
    found.sort();
    found
}
