//! A build beside the other steps.
//!
//! The images for the boards are linked with optimisation over all crates, on one processor and in folders of their
//! own. The tests of each binary end with a few long ones, also on one processor. So the two take hardly longer
//! together than the longer one alone.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// A running `cargo xtask firmware --build`, if there is one.
#[derive(Default)]
pub(crate) struct Beside(Option<(Child, PathBuf)>);

impl Beside {
    /// Starts the build, whose output goes into a file of `folder`. Where it cannot be started, the step that needs the
    /// images builds them.
    pub(crate) fn start(folder: &Path) -> Self {
        let start = || {
            fs::create_dir_all(folder)?;
            let log = folder.join("firmware.log");
            let out = File::create(&log)?;
            let mut build = Command::new(std::env::current_exe()?);
            build.args(["firmware", "--build"]).stdin(Stdio::null()).stderr(out.try_clone()?).stdout(out);
            std::io::Result::Ok((build.spawn()?, log))
        };
        Self(start().ok())
    }

    /// Waits for the end of the build. A fault is left to the step, which builds again and prints it.
    pub(crate) fn wait(&mut self) {
        if let Some((mut child, log)) = self.0.take() {
            println!("waits for the build beside the other steps; its output is in {}", log.display());
            let _ = child.wait();
        }
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        self.wait();
    }
}
